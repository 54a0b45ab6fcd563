//! Tests of formulas against their derivatives, potentials and closed forms.

use std::sync::Arc;

use approx::assert_relative_eq;

use super::random::Random;
use super::*;
use crate::field::query::Sample;
use crate::field::region::Region;
use crate::field::scalar::Scalar;
use crate::field::{Coupling, Field, Frame, Linearised, Motion, Query, Tree};
use crate::math::{Pose, Real, SharedShape, Vector};
use crate::number::{Dual, differences, real};

/// Fields of all formulas; true for those whose derivatives are numerical.
fn fields() -> Vec<(&'static str, Field, bool)> {
    let law = |name, field| (name, field, false);
    let rows = |a: Real| {
        [
            Vector::X * a,
            Vector::Y * 0.5 + Vector::Z * a,
            Vector::ONE * 0.3,
        ]
    };
    let kernel = |coordinates| {
        Field::linear_kernel(LinearKernel {
            coordinates,
            constant: Vector::new(0.3, -0.2, 0.5),
            position_target: Vector::new(0.4, 0.1, -0.6),
            position_multiplier: rows(0.7),
            velocity_target: Vector::new(1.0, 2.0, -1.0),
            velocity_multiplier: rows(-0.4),
            noise: Vector::ZERO,
            falloff_linear: Vector::new(0.2, 0.0, 0.4),
            falloff_quadratic: Vector::new(0.1, 0.3, 0.0),
        })
    };
    let corners = [Vector::ZERO, Vector::X * 2.0, Vector::new(2.0, 2.0, 1.0)];
    let grid = Grid::sampled(Vector::splat(-3.0), Vector::splat(3.0), [7, 5, 6], |p| {
        Vector::new(p.x * p.y, p.z * p.z, p.x - p.y)
    });
    vec![
        law("uniform", Field::uniform(Vector::new(1.0, -2.0, 0.5))),
        law("inverse square", Field::radial(3.0, -2.0)),
        law("softened", Field::radial(3.0, -2.0).softened(0.5)),
        law("logarithmic", Field::radial(-2.0, -1.0)),
        law("linear", Field::radial(2.0, 1.0)),
        law("shifted", Field::radial(3.0, -2.0).shifted_to_zero_at(6.0)),
        law("no nearer", Field::radial(3.0, -2.0).no_nearer_than(1.4)),
        law("limited", Field::radial(3.0, -2.0).limited_to(0.9)),
        law("Lennard-Jones", Field::lennard_jones(2.0, 1.2)),
        law("Yukawa", Field::yukawa(2.0, 1.5)),
        law("Morse", Field::morse(2.0, 1.1, 1.3)),
        law("Gaussian", Field::gaussian(2.0, 1.1)),
        law("Hertz", Field::hertz(2.0, 1.8)),
        law("spring", Field::spring_damper(2.0, 0.0, 0.7)),
        law("spring and damper", Field::spring_damper(2.0, 0.6, 0.7)),
        law("drag", Field::drag(0.5, 0.3)),
        law(
            "wind",
            Field::vortex(2.0, -1.0).smoothed(0.3).as_wind(0.5, 0.2),
        ),
        law(
            "capped wind",
            Field::wind(Vector::X * 4.0, 0.5, 0.2).speed_cap(0.5),
        ),
        law(
            "magnetic",
            Field::magnetic(Vector::new(0.5, 1.0, -0.5)).coupled_to(Coupling::Each),
        ),
        law("spin", Field::spin(1.5)),
        law("vortex", Field::vortex(1.5, -1.0).smoothed(0.2)),
        law("updraft", Field::updraft(1.5, 0.0)),
        law("inward updraft", Field::updraft(1.5, 0.5)),
        law("buoyancy", Field::buoyancy(1.2, 9.8)),
        law(
            "turbulence",
            Field::turbulence(Turbulence::new(5, 2.0, 3.0).turnover(0.4)),
        ),
        law(
            "path",
            Field::path(Path::new(corners, true).damping(0.5, 2.0).look_ahead(0.3)),
        ),
        law("grid", Field::grid(grid)),
        law("kernel", kernel(Coordinates::Cartesian)),
        law("spherical kernel", kernel(Coordinates::Spherical)),
        law("cylindrical kernel", kernel(Coordinates::Cylindrical)),
        law(
            "toroidal kernel",
            kernel(Coordinates::Toroidal { radius: 1.5 }),
        ),
        #[cfg(feature = "expression")]
        law(
            "expression",
            Field::expression(["x*y - vz^2", "sin(z) * exp(-x^2)", "speed + time"]),
        ),
        (
            "nearest point",
            Field::radial(-3.0, -2.0).around(SharedShape::ball(0.5)),
            true,
        ),
        (
            "closure",
            Field::closure([Axis::Speed], |s: &Sample| {
                s.local_point * s.local_point.x - s.local_velocity * s.axes[0]
            }),
            true,
        ),
    ]
}

/// A frame that is turned and moves.
fn frame() -> Frame {
    let pose = Pose::new(Vector::new(0.1, 0.2, -0.3), Vector::new(0.3, -0.5, 0.7));
    Frame {
        velocity: Vector::new(0.2, -0.1, 0.4),
        angvel: Vector::new(0.5, 0.6, -0.2),
        ..Frame::at_rest(pose)
    }
}

fn query(random: &mut Random) -> Query {
    Query {
        world_point: random.unit_vector() * (0.8 + random.uniform()),
        world_velocity: random.unit_vector() * (2.0 * random.uniform()),
        time: random.uniform(),
        volume: 2.0,
        ..Query::default()
    }
}

fn force(field: &Field, query: &Query) -> DVec3 {
    real(field.force(&LocalQuery::new(query, &frame())))
}

/// ∂F/∂x and ∂F/∂v from numbers that carry derivatives, compared with central differences of the force.
#[test]
fn derivatives_are_those_of_finite_differences() {
    let mut random = Random::new(3);
    for (name, field, numerical) in fields() {
        for _ in 0..50 {
            let query = query(&mut random);
            let motion = Motion::<Dual<6>>::seeded(&query);
            let exact = field.force(&LocalQuery::moving(&query, &motion, &frame()));
            let exact = Linearised::new(exact);
            let motion = Motion::by_velocity(&query);
            let by_velocity = field.force(&LocalQuery::moving(&query, &motion, &frame()));
            let by_velocity = Linearised::new(by_velocity).by_velocity;
            assert_eq!(by_velocity, exact.by_velocity, "{name}");
            let plain = force(&field, &query);
            let off = (exact.force - plain).length();
            assert!(
                off <= 1e-12 * (1.0 + plain.length()),
                "{name}: {} and {plain}",
                exact.force
            );
            let x = query.world_point;
            let v = query.world_velocity;
            // Closures and shapes are computed in `Real`, so their differences need a larger step.
            let step = if numerical { 30.0 } else { 1.0 };
            let step = step
                * if numerical {
                    f64::from(Real::EPSILON as f32).cbrt() / 30.0
                } else {
                    1e-6
                };
            let slopes = differences([x.x, x.y, x.z, v.x, v.y, v.z], [step; 6], |q| {
                let moved = Query {
                    world_point: DVec3::new(q[0], q[1], q[2]),
                    world_velocity: DVec3::new(q[3], q[4], q[5]),
                    ..query.clone()
                };
                force(&field, &moved)
            });
            let columns = [0, 1, 2]
                .map(|k| exact.by_position.col(k))
                .into_iter()
                .chain([0, 1, 2].map(|k| exact.by_velocity.col(k)));
            let scale = exact.force.length() + slopes.iter().map(|s| s.length()).sum::<f64>();
            let tolerance = if numerical { 2e-2 } else { 1e-6 } * (1.0 + scale);
            for (k, (exact, slope)) in columns.zip(slopes).enumerate() {
                // At a corner of the force within the step, the slopes of both sides differ.
                if !numerical && is_at_a_corner(&field, &query, k, 2e-6) {
                    continue;
                }
                assert!(
                    (exact - slope).length() <= tolerance,
                    "{name}, input {k}: {exact} by its own account, {slope} by differences"
                );
            }
        }
    }
}

/// Returns true if the one-sided slopes along an input differ.
fn is_at_a_corner(field: &Field, query: &Query, input: usize, step: f64) -> bool {
    let at = |by: f64| {
        let mut moved = query.clone();
        if input < 3 {
            moved.world_point[input] += by;
        } else {
            moved.world_velocity[input - 3] += by;
        }
        force(field, &moved)
    };
    let bend = (at(step) + at(-step) - at(0.0) * 2.0) / step;
    bend.length() > 1e-3 * (1.0 + at(0.0).length())
}

/// The slopes of radial laws that Jacobians use, compared with the definition of each law.
#[test]
fn slopes_of_radial_laws_are_those_of_their_factors() {
    let mut laws = 0;
    for (name, field, _) in fields() {
        let Formula::Radial(law) = &field.formula else {
            continue;
        };
        laws += 1;
        for r2 in [0.3, 1.7, 2.2, 30.0] {
            let Dual {
                re: factor,
                slopes: [by_r2],
            } = law.slope()(r2);
            let exact = law.factor(Dual::<1>::input(r2, 0));
            let context = format!("{name} at {r2}: {factor}, {by_r2}");
            assert!(
                (factor - exact.re).abs() <= 1e-14 * exact.re.abs(),
                "{context}"
            );
            assert!(
                (by_r2 - exact.slopes[0]).abs() <= 1e-13 * exact.slopes[0].abs(),
                "{context}"
            );
        }
    }
    assert!(laws >= 7);
}

/// F = −∇U, for fields with a potential U that do not depend on the velocity.
#[test]
fn forces_are_the_slopes_of_their_potentials() {
    let mut random = Random::new(4);
    let mut with_potential = 0;
    for (name, field, numerical) in fields() {
        if field.reads_velocity() || numerical {
            continue;
        }
        for _ in 0..50 {
            let query = query(&mut random);
            let motion = Motion::<Dual<6>>::seeded(&query);
            let local = LocalQuery::moving(&query, &motion, &frame());
            let Some(potential) = field.potential(&local) else {
                break;
            };
            with_potential += 1;
            let [x, y, z, ..] = potential.slopes;
            let slope = DVec3::new(x, y, z);
            let force = force(&field, &query);
            let error = (force + slope).length();
            assert!(
                error <= 1e-12 * (1.0 + force.length()),
                "{name}: {force} is not −{slope}"
            );
        }
    }
    assert_eq!(with_potential, 50 * 15, "fields with a potential");
}

/// The flow also has the mean square that was set.
#[test]
fn turbulence_has_no_divergence() {
    let mut random = Random::new(9);
    let field = Field::turbulence(Turbulence::new(1, 3.0, 2.0));
    let (mut square, samples) = (0.0, 20_000);
    for _ in 0..samples {
        let query = Query {
            world_point: random.unit_vector() * (1e3 * random.uniform()),
            ..Query::default()
        };
        let local = LocalQuery::moving(&query, &Motion::<Dual<6>>::seeded(&query), &frame());
        let flow = Linearised::new(field.force(&local));
        let trace: f64 = (0..3).map(|k| flow.by_position.col(k)[k]).sum();
        assert!(trace.abs() < 1e-9 * flow.by_position.col(0).length().max(1.0));
        square += flow.force.length_squared() / f64::from(samples);
    }
    assert_relative_eq!(square.sqrt(), 3.0, max_relative = 0.02);
}

/// The displaced volume of a floating ball, by numerical integration over slices.
#[test]
fn buoyancy_displaces_the_cap() {
    let field = Field::buoyancy(1.0, 1.0);
    let radius = 0.7;
    let volume = 4.0 / 3.0 * std::f64::consts::PI * f64::powi(radius, 3);
    for height in [-2.0, -0.5, 0.0, 0.3, 0.69, 0.8] {
        let slices = 200_000;
        let width = 2.0 * radius / f64::from(slices);
        let below: f64 = (0..slices)
            .map(|k| -radius + (f64::from(k) + 0.5) * width)
            .filter(|y| y + height < 0.0)
            .map(|y| std::f64::consts::PI * (radius * radius - y * y) * width)
            .sum();
        let query = Query {
            world_point: DVec3::Y * height,
            volume,
            ..Query::default()
        };
        let local = LocalQuery::new(&query, &Frame::at_rest(Pose::IDENTITY));
        assert_relative_eq!(field.force(&local).y, below, epsilon = 1e-5);
    }
}

/// On a path the force is along it; beside it, it also pulls back to the path.
#[test]
fn a_path_pulls_along_it_and_back_to_it() {
    let lane = Path::new([Vector::ZERO, Vector::X * 10.0], false);
    let field = Field::path(lane.stiffness(2.0).damping(3.0, 1.5).look_ahead(1.0));
    let at = |point: DVec3, velocity: DVec3| {
        let query = Query {
            world_point: point,
            world_velocity: velocity,
            ..Query::default()
        };
        real(field.force(&LocalQuery::new(&query, &Frame::at_rest(Pose::IDENTITY))))
    };
    assert_eq!(at(DVec3::X * 4.0, DVec3::X * 1.5), DVec3::X * 2.0);
    assert_eq!(
        at(DVec3::new(4.0, 1.0, 0.0), DVec3::X * 1.5),
        DVec3::new(2.0, -2.0, 0.0)
    );
    assert_eq!(
        at(DVec3::X * 12.0, DVec3::ZERO),
        DVec3::X * -4.0,
        "the end is the goal"
    );
}

#[test]
fn bad_parameters_are_refused() {
    let grid = Grid {
        low: Vector::ZERO,
        high: Vector::ONE,
        counts: [2, 2, 2],
        values: vec![Vector::ZERO; 7],
    };
    let tables = |points: Vec<(Real, Real)>| {
        Field::uniform(Vector::X).scaled_by(Scalar::time().table(points))
    };
    let bad = [
        Field::grid(grid),
        Field::path(Path::new([Vector::X], true)),
        Field::path(Path::new([Vector::X, Vector::X], false)),
        Field::turbulence(Turbulence::new(1, 1.0, 0.0)),
        Field::turbulence(Turbulence::new(1, 1.0, 1.0).detail(0.5)),
        Field::yukawa(1.0, 0.0),
        Field::morse(1.0, -1.0, 1.0),
        Field::gaussian(1.0, 0.0),
        Field::hertz(1.0, -1.0),
        Field::wind(Vector::X, 1.0, 0.0).speed_cap(-1.0),
        Field::drag(1.0, 0.0).speed_cap(1.0),
        Field::drag(1.0, 0.0).around(SharedShape::ball(1.0)),
        Field::radial(1.0, 1.0).smoothed(1.0),
        Field::drag(1.0, 0.0).limited_to(-1.0),
        Field::drag(1.0, 0.0).no_nearer_than(1.0),
        Field::buoyancy(Real::NAN, 1.0),
        tables(vec![]),
        tables(vec![(1.0, 0.0), (1.0, 1.0)]),
        Field::uniform(Vector::X).within(Region::ball_over([(Axis::Time, 0.0, -1.0)])),
        Field::uniform(Vector::X).within(Region::half_space_over([], 1.0)),
        #[cfg(feature = "expression")]
        Field::expression(["1 +", "0", "0"]),
        #[cfg(feature = "expression")]
        Field::expression(["unheard_of", "0", "0"]),
    ];
    for field in bad {
        let kind = format!("{:?}", field.formula);
        assert!(Tree::from(field).validate(&[]).is_err(), "{kind}");
    }
}

#[test]
fn formulas_are_compared_by_their_parameters() {
    let a = Formula::Turbulence(Arc::new(Turbulence::new(1, 1.0, 1.0)));
    let b = Formula::Turbulence(Arc::new(Turbulence::new(1, 1.0, 1.0)));
    assert_eq!(a, b);
}
