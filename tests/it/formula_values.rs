//! Forces and potentials of all formulas, against the closed forms that their documentation states: at points without
//! symmetry, in a frame that is turned and away from the origin.

use rapier3d_fields::field::{Coordinates, Grid, LinearKernel, Path, Swirl};
use rapier3d_fields::math::{
    DVec3, Real, Rotation, SharedShape, from_dvec3, from_f64, to_dpose3, to_dvec3, to_f64,
};
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, either, insert_ball, weightless};

const MASS: f64 = 1.7;
const CHARGE: f64 = -0.6;

/// Places and velocities of a body in the frame of the field.
const STATES: [[[f64; 3]; 2]; 4] = [
    [[1.3, 0.4, -0.7], [0.3, -1.1, 0.6]],
    [[-0.9, 1.6, 1.1], [-2.1, 0.2, 0.4]],
    [[2.2, -1.2, 0.6], [0.1, 0.9, -1.7]],
    [[-1.4, -2.1, -1.8], [1.2, 1.3, 0.8]],
];

type Force = Box<dyn Fn(DVec3, DVec3) -> DVec3>;
type Potential = Option<Box<dyn Fn(DVec3) -> f64>>;

struct Case {
    name: &'static str,
    field: Field,
    force: Force,
    potential: Potential,
}

fn case(name: &'static str, field: Field, force: impl Fn(DVec3, DVec3) -> DVec3 + 'static) -> Case {
    Case {
        name,
        field,
        force: Box::new(force),
        potential: None,
    }
}

/// A force along the distance vector, and its potential, from the distance.
fn central(
    name: &'static str,
    field: Field,
    force: impl Fn(f64) -> f64 + 'static,
    potential: impl Fn(f64) -> f64 + 'static,
) -> Case {
    Case {
        potential: Some(Box::new(move |d: DVec3| potential(d.length()))),
        ..case(name, field, move |d, _| d.normalize() * force(d.length()))
    }
}

fn frame() -> Pose {
    let turn = Rotation::from_euler(Default::default(), 0.4, -1.1, 0.7);
    Pose::from_parts(Vector::new(0.5, -0.25, 0.75), turn)
}

/// The force on the body, in the frame of the field, and the potential energy if it is known.
fn found(field: &Field, [place, velocity]: [DVec3; 2]) -> (DVec3, Option<f64>) {
    let mut world = weightless(1e-3);
    let frame = frame();
    let turn = to_dpose3(&frame).rotation;
    let at = to_dvec3(frame.translation) + turn * place;
    let [at, velocity] = [at, turn * velocity].map(from_dvec3);
    let ball = insert_ball(&mut world, from_f64(MASS), at, velocity);
    let collider = world.bodies[ball].colliders()[0];
    let mut fields = Fields::new(field.clone().sampled(Sampling::Centre).at(frame)).expect("valid");
    let charge = ColliderProperties::new().charge(from_f64(CHARGE));
    fields
        .set
        .set_properties(collider, charge.clone())
        .expect("finite");
    assert_eq!(fields.set.properties(collider), Some(&charge));
    let wrench = fields.sample(ball, &world).expect("finite").expect("felt");
    let energy = fields.potential_energy(&world);
    let energy = (energy.without == 0).then_some(energy.total);
    (turn.inverse() * to_dvec3(wrench.force), energy)
}

fn check(cases: Vec<Case>) {
    check_within(either(2e-5, 1e-13), cases);
}

fn check_within(tolerance: f64, cases: Vec<Case>) {
    for Case {
        name,
        field,
        force,
        potential,
    } in cases
    {
        for state in STATES {
            let [place, velocity] = state.map(DVec3::from);
            let (seen, energy) = found(&field, [place, velocity]);
            let wanted = force(place, velocity);
            let off = (seen - wanted).length() / (1.0 + wanted.length());
            let at = format!("{name} at {place}: {seen}, not {wanted}");
            assert_at_most(off, tolerance, at);
            if let Some(wanted) = potential.as_ref().map(|it| it(place)) {
                let energy = energy.expect("a potential");
                let off = (energy - wanted).abs() / (1.0 + wanted.abs());
                let at = format!("{name} at {place}: potential {energy}, not {wanted}");
                assert_at_most(off, tolerance, at);
            }
        }
    }
}

fn number(x: f64) -> Real {
    from_f64(x)
}

/// The number that a parameter has in the precision of the world.
fn as_real(x: f64) -> f64 {
    to_f64(from_f64(x))
}

fn vector(x: f64, y: f64, z: f64) -> (Vector, DVec3) {
    let v = Vector::new(from_f64(x), from_f64(y), from_f64(z));
    (v, to_dvec3(v))
}

#[test]
fn radial_formulas_have_the_values_of_their_closed_forms() {
    let (k, q) = (1.5, as_real(CHARGE));
    let power = |n: f64| {
        central(
            "a power",
            Field::radial(number(k), number(n)),
            move |r| k * r.powf(n),
            move |r| {
                if n == -1.0 {
                    -k * r.ln()
                } else {
                    -k * r.powf(n + 1.0) / (n + 1.0)
                }
            },
        )
    };
    let soft = |r: f64| (r * r + 0.25).sqrt();
    let lennard_jones = |r: f64| {
        let s6 = (1.25 / r).powi(6);
        0.75 * 24.0 * (2.0 * s6 * s6 - s6) / r
    };
    check(vec![
        power(-3.0),
        power(-1.0),
        power(0.0),
        power(2.5),
        central(
            "gravity",
            Field::point_gravity(2.5),
            |r| -as_real(MASS) * 2.5 / (r * r),
            |r| -as_real(MASS) * 2.5 / r,
        ),
        central(
            "softened gravity",
            Field::point_gravity(2.5).softened(0.5),
            move |r| -as_real(MASS) * 2.5 * r / soft(r).powi(3),
            move |r| -as_real(MASS) * 2.5 / soft(r),
        ),
        central(
            "Coulomb",
            Field::coulomb(3.0, 0.5),
            move |r| 1.5 * q / (r * r),
            move |r| 1.5 * q / r,
        ),
        central(
            "Lennard-Jones",
            Field::lennard_jones(0.75, 1.25),
            lennard_jones,
            |r| {
                let s6 = (1.25 / r).powi(6);
                3.0 * (s6 * s6 - s6)
            },
        ),
        case(
            "Lennard-Jones, shifted to zero",
            Field::lennard_jones(0.75, 1.25).shifted_to_zero_at(4.0),
            move |d, _| d.normalize() * (lennard_jones(d.length()) - lennard_jones(4.0)),
        ),
        central(
            "Morse",
            Field::morse(1.5, 0.75, 1.25),
            |r| {
                let e = (-0.75 * (r - 1.25)).exp();
                -2.0 * 1.5 * 0.75 * (1.0 - e) * e
            },
            |r| 1.5 * ((1.0 - (-0.75 * (r - 1.25)).exp()).powi(2) - 1.0),
        ),
        central(
            "Yukawa",
            Field::yukawa(1.5, 0.75),
            |r| 1.5 * (-r / 0.75).exp() * (1.0 / (r * r) + 1.0 / (0.75 * r)),
            |r| 1.5 * (-r / 0.75).exp() / r,
        ),
        central(
            "Hertz",
            Field::hertz(1.5, 2.5),
            |r| 1.5 * (2.5 - r).max(0.0).powf(1.5),
            |r| 0.4 * 1.5 * (2.5 - r).max(0.0).powf(2.5),
        ),
        central(
            "Gauss",
            Field::gaussian(1.5, 1.25),
            |r| 1.5 * r / (1.25 * 1.25) * (-r * r / (2.0 * 1.25 * 1.25)).exp(),
            |r| 1.5 * (-r * r / (2.0 * 1.25 * 1.25)).exp(),
        ),
        central(
            "a spring",
            Field::spring(1.5),
            |r| -1.5 * r,
            |r| 0.75 * r * r,
        ),
        case(
            "a damped spring of some length",
            Field::spring_damper(1.5, 0.25, 0.75),
            |d, v| d.normalize() * (-1.5 * (d.length() - 0.75)) - v * 0.25,
        ),
        case(
            "a power, no nearer than",
            Field::radial(1.5, -2.0).no_nearer_than(2.25),
            |d, _| d.normalize() * (1.5 / d.length().max(2.25).powi(2)),
        ),
        case(
            "a power around a box",
            Field::radial(1.5, -2.0).around(SharedShape::cuboid(0.5, 0.75, 0.25)),
            |d, _| {
                let half = DVec3::new(0.5, 0.75, 0.25);
                let away = d - d.clamp(-half, half);
                away * (1.5 / away.length().powi(3))
            },
        ),
        case("a magnet", Field::magnet(1.5, 0.5, 9.0), move |d, _| {
            d * (-1.5 / soft(d.length()).powi(3))
        }),
    ]);
}

#[test]
fn flows_and_drags_have_the_values_of_their_closed_forms() {
    let around = |d: DVec3| DVec3::Y.cross(d);
    let beside = |d: DVec3| DVec3::new(d.x, 0.0, d.z);
    let slowed = |w: DVec3| w * (0.75 + 0.5 * w.length());
    let swirl = Swirl {
        around: 1.5,
        inward: 0.75,
        along: -0.5,
        power: 0.5,
        core: 0.25,
    };
    let (wind, air) = vector(0.5, -1.25, 0.75);
    let (magnet, field) = vector(0.25, 1.5, -0.75);
    check(vec![
        case("a vector", Field::uniform(wind), move |_, _| air),
        case(
            "an acceleration",
            Field::uniform(wind).force_mode(ForceMode::Acceleration),
            move |_, _| air * as_real(MASS),
        ),
        case(
            "a stronger vector that is limited",
            Field::uniform(wind).strength(3.0).limited_to(2.0),
            move |_, _| air.normalize() * 2.0,
        ),
        case("a spin", Field::spin(1.5), move |d, _| around(d) * 1.5),
        case("a vortex", Field::vortex(1.5, -1.0), move |d, _| {
            around(d) * (1.5 / beside(d).length_squared())
        }),
        case(
            "a smoothed vortex",
            Field::vortex(1.5, -1.0).smoothed(0.5),
            move |d, _| around(d) * (1.5 / (beside(d).length_squared() + 0.25)),
        ),
        case("a swirl", Field::swirl(swirl), move |d, _| {
            let s = (beside(d).length_squared() + 0.0625).sqrt();
            (around(d) * 1.5 - beside(d) * 0.75) * (s.sqrt() / s) - DVec3::Y * 0.5
        }),
        case("an updraft", Field::updraft(1.5, 0.75), move |d, _| {
            DVec3::Y * 1.5 - beside(d).normalize() * 0.75
        }),
        case("drag", Field::drag(0.75, 0.5), move |_, v| slowed(-v)),
        case("wind", Field::wind(wind, 0.75, 0.5), move |_, v| {
            slowed(air - v)
        }),
        case(
            "a vortex as wind",
            Field::vortex(1.5, 1.0).as_wind(0.75, 0.5),
            move |d, v| slowed(around(d) * 1.5 - v),
        ),
        case(
            "a wind of limited speed",
            Field::wind(wind, 0.75, 0.5).speed_cap(0.5),
            move |_, v| slowed((air - v).clamp_length_max(0.5)),
        ),
        Case {
            potential: Some(Box::new(|_| 0.0)),
            ..case("a magnetic field", Field::magnetic(magnet), move |_, v| {
                v.cross(field) * as_real(CHARGE)
            })
        },
        case(
            "expressions",
            Field::expression(["vz - 4 * x", "sin(y * z)", "exp(-x * x) * vy"]),
            |d, v| {
                let bell = (-d.x * d.x).exp();
                DVec3::new(v.z - 4.0 * d.x, (d.y * d.z).sin(), bell * v.y)
            },
        ),
    ]);
}

/// The force of a field in each mode, by couplings; alone it acts at centres of mass, beside a sampled field it does not.
#[test]
fn forces_have_the_weights_of_their_modes_and_couplings() {
    let dt = 0.125;
    // So weak that the field is not stiff, which would need samples.
    let pull = DVec3::new(0.5, -0.25, 0.75) * 1e-3;
    let modes = [
        (ForceMode::Force, 1.0),
        (ForceMode::Acceleration, MASS),
        (ForceMode::VelocityChange, MASS / dt),
    ];
    let couplings = [(Coupling::Share, 1.0), (Coupling::Axis(Axis::Mass), MASS)];
    for (mode, by_mode) in modes {
        for (coupling, by_coupling) in &couplings {
            for with_region in [false, true] {
                let mut world = weightless(from_f64(dt));
                let ball = insert_ball(&mut world, from_f64(MASS), Vector::ZERO, Vector::ZERO);
                let at = from_dvec3(-pull.normalize() * 2.0);
                let mut field = Field::radial(from_f64(4.0 * pull.length()), -2.0);
                if with_region {
                    field = field.within(Region::ball(5.0));
                }
                let field = field.force_mode(mode).coupled_to(coupling.clone()).at(at);
                let scheme = Scheme::Kick;
                let mut fields = Fields::builder(field)
                    .scheme(scheme)
                    .build()
                    .expect("valid");
                // The first step takes samples, to look at bodies that sleep.
                for _ in 0..4 {
                    fields.step(&mut world).expect("a step");
                }
                let found = to_dvec3(world.bodies[ball].linvel());
                let wanted = pull * (4.0 * by_mode * by_coupling * dt / MASS);
                let what = format!("{mode:?} {coupling:?} {with_region}");
                // The place changes by as little.
                assert_at_most((found - wanted).length(), 3e-3 * wanted.length(), what);
            }
        }
    }
}

/// What is of the first power in each coordinate is interpolated exactly.
#[test]
fn grids_and_kernels_and_paths_have_the_values_of_their_closed_forms() {
    let flow = |d: DVec3| {
        DVec3::new(
            1.0 + 2.0 * d.x - d.y * d.z,
            d.x * d.y * d.z - d.z,
            3.0 * d.x * d.z + d.y,
        )
    };
    let (low, high) = (Vector::new(-4.0, -3.0, -3.5), Vector::new(3.0, 4.5, 4.0));
    let grid = Grid::sampled(low, high, [3, 4, 6], move |place| {
        from_dvec3(flow(to_dvec3(place)))
    });
    let (constant, k) = vector(0.5, -0.25, 0.75);
    let (target, p) = vector(0.25, 1.5, -0.5);
    let (pace, u) = vector(-0.75, 0.25, 1.25);
    let (falls, l) = vector(0.5, 0.25, 0.125);
    let (bends, b) = vector(0.25, 0.75, 0.5);
    let rows = |scale: Real| {
        [
            Vector::new(1.0, 0.5, -0.25) * scale,
            Vector::new(-0.5, 0.75, 0.25) * scale,
            Vector::new(0.125, -1.0, 0.5) * scale,
        ]
    };
    let kernel = LinearKernel {
        constant,
        position_target: target,
        position_multiplier: rows(1.0),
        velocity_target: pace,
        velocity_multiplier: rows(0.5),
        falloff_linear: falls,
        falloff_quadratic: bends,
        ..LinearKernel::default()
    };
    let times =
        move |scale: Real, v: DVec3| DVec3::from(rows(scale).map(|row| to_dvec3(row).dot(v)));
    // One straight piece, from (−3, 0, 0) to (3, 0, 0); the last place is more than 1.5 before its end.
    let lane = Path::new([Vector::X * -3.0, Vector::X * 3.0], false)
        .stiffness(1.5)
        .damping(0.75, 2.0)
        .look_ahead(0.5);
    let pull = move |place: DVec3, v: DVec3| {
        let way = p - place;
        let pull = k + times(1.0, way) + times(0.5, u - v);
        pull / (DVec3::ONE + l * way.abs() + b * way * way)
    };
    // The components along three directions, for a place in these coordinates.
    let along = move |axes: [DVec3; 3], place: DVec3, v: DVec3| {
        let pulled = pull(place, DVec3::from(axes.map(|axis| axis.dot(v)))).to_array();
        let parts = axes.into_iter().zip(pulled);
        parts.map(|(axis, pull)| axis * pull).sum::<DVec3>()
    };
    let around = |d: DVec3| DVec3::new(d.z, 0.0, -d.x).normalize();
    let from_axis = |d: DVec3| DVec3::new(d.x, 0.0, d.z);
    let within = |coordinates| {
        Field::linear_kernel(LinearKernel {
            coordinates,
            ..kernel
        })
    };
    check(vec![
        case("a grid", Field::grid(grid), move |d, _| flow(d)),
        case("a linear kernel", Field::linear_kernel(kernel), pull),
        case(
            "a spherical kernel",
            within(Coordinates::Spherical),
            move |d, v| {
                let axes = [d.normalize(), around(d), d.normalize().cross(around(d))];
                along(axes, DVec3::X * d.length(), v)
            },
        ),
        case(
            "a cylindrical kernel",
            within(Coordinates::Cylindrical),
            move |d, v| {
                let out = from_axis(d);
                let axes = [out.normalize(), DVec3::Y, around(d)];
                along(axes, DVec3::new(out.length(), d.y, 0.0), v)
            },
        ),
        case(
            "a toroidal kernel",
            within(Coordinates::Toroidal { radius: 0.75 }),
            move |d, v| {
                let out = d - from_axis(d).normalize() * 0.75;
                let axes = [out.normalize(), around(d), out.normalize().cross(around(d))];
                along(axes, DVec3::X * out.length(), v)
            },
        ),
        case("a path", Field::path(lane), |d, v| {
            let goal = DVec3::X * (d.x.clamp(-3.0, 3.0) + 0.5).min(3.0);
            (goal - d) * 1.5 + (DVec3::X * 2.0 - v) * 0.75
        }),
    ]);
}

/// The random part of a kernel is spread evenly from zero to its strength, and the same at the same place and time.
#[test]
fn the_noise_of_a_kernel_is_spread_evenly_and_repeats() {
    let strength = Vector::new(2.0, -1.0, 0.5);
    let noisy = LinearKernel {
        noise: strength,
        ..LinearKernel::default()
    };
    let field = Field::linear_kernel(noisy);
    let count = 400;
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for number in 0..count {
        let place = DVec3::new(0.1, -0.02, 0.03) * f64::from(number);
        let (force, _) = found(&field, [place, DVec3::ZERO]);
        assert_eq!(force, found(&field, [place, DVec3::ZERO]).0);
        let share = force / to_dvec3(strength);
        let is_within = share.min_element() >= -1e-6 && share.max_element() <= 1.0 + 1e-6;
        assert!(is_within, "{share}");
        sum += share;
        squares += share * share;
    }
    // Within four standard errors of the mean of evenly spread numbers, and of their squares.
    let (mean, square) = (sum / f64::from(count), squares / f64::from(count));
    assert_at_most((mean - 0.5).abs().max_element(), 0.06, "the mean");
    assert_at_most((square - 1.0 / 3.0).abs().max_element(), 0.06, "the square");
}

/// The parts of a kernel that depend on the place do so in the frame of the field, wherever its region is.
#[test]
fn a_kernel_stays_where_it_is_when_its_region_is_moved() {
    let plain = LinearKernel {
        constant: Vector::new(0.5, -1.0, 2.0),
        ..LinearKernel::default()
    };
    let kernels = [
        LinearKernel {
            position_multiplier: [Vector::X, Vector::Y * 2.0, Vector::Z],
            ..plain
        },
        LinearKernel {
            coordinates: Coordinates::Cylindrical,
            ..plain
        },
        LinearKernel {
            falloff_linear: Vector::Y,
            ..plain
        },
        LinearKernel {
            falloff_quadratic: Vector::Y,
            ..plain
        },
        LinearKernel {
            noise: Vector::Y,
            ..plain
        },
    ];
    let mut world = weightless(1e-3);
    let ball = insert_ball(&mut world, 1.0, Vector::new(4.5, 0.25, 1.0), Vector::ZERO);
    let force = |field: Field| {
        let fields = Fields::new(field.sampled(Sampling::Centre)).expect("valid");
        let wrench = fields.sample(ball, &world).expect("finite");
        wrench.expect("felt").force
    };
    for kernel in kernels {
        let everywhere = Field::linear_kernel(kernel);
        let within = Region::ball(2.0).at(Vector::new(4.0, 0.5, 1.0));
        let there = force(everywhere.clone().within(within));
        assert_eq!(there, force(everywhere), "{kernel:?}");
    }
}

/// A place on a path through corners, by its length from the start, and the direction there; found by walking.
fn walked(corners: &[DVec3], length: f64) -> (DVec3, DVec3) {
    let mut left = length;
    for ends in corners.windows(2) {
        let piece = ends[0].distance(ends[1]);
        if left < piece {
            let along = (ends[1] - ends[0]) / piece;
            return (ends[0] + along * left, along);
        }
        left -= piece;
    }
    (corners[corners.len() - 1], DVec3::ZERO)
}

/// The nearest point is searched at many places of the path. A goal may be beyond an end, or beyond the seam of a ring.
#[test]
fn paths_lead_to_goals_ahead_and_behind() {
    let corners = [
        vector(-2.0, 0.5, 0.25),
        vector(1.0, 1.0, -0.5),
        vector(1.5, -1.5, 0.5),
        vector(-1.0, -2.0, 1.0),
    ];
    let mut cases = Vec::new();
    for (closed, ahead) in [false, true]
        .into_iter()
        .flat_map(|closed| [-9.0, -0.75, 0.0, 0.5, 2.5, 7.0, 14.0].map(|ahead| (closed, ahead)))
    {
        let lane = Path::new(corners.map(|it| it.0), closed).stiffness(1.5);
        let lane = lane.damping(0.75, -2.0).look_ahead(from_f64(ahead));
        let mut points = corners.map(|it| it.1).to_vec();
        points.extend(closed.then_some(points[0]));
        let total: f64 = points.windows(2).map(|it| it[0].distance(it[1])).sum();
        cases.push(case("a path", Field::path(lane), move |d, v| {
            let places = (0..=40_000).map(|part| f64::from(part) * total / 40_000.0);
            let off = |place: f64| walked(&points, place).0.distance(d);
            let nearest = places.min_by(|a, b| off(*a).total_cmp(&off(*b)));
            let goal = nearest.expect("places") + ahead;
            let (goal, along) = match closed {
                true => walked(&points, goal.rem_euclid(total)),
                false if goal < 0.0 => (points[0], DVec3::ZERO),
                false => walked(&points, goal),
            };
            (goal - d) * 1.5 + (along * -2.0 - v) * 0.75
        }));
    }
    check_within(1e-3, cases);
}
