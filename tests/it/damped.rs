//! Forces that read velocities, of any strength, under every scheme: nothing explodes, drag reverses no motion, and
//! falling bodies reach their terminal velocity.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rapier3d_fields::math::{DVec3, Real, from_f64, to_dpose3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::na::{Matrix3, Matrix6, Vector6};

use crate::lab::stability::{self, Damping, Kind, SCHEMES, fate};
use crate::support::*;

const DT: Real = 1.0 / 60.0;

/// Drag of rate `k` on a mass of 1; if quadratic, with that rate at `speed`.
fn drag(k: f64, quadratic: bool, speed: f64) -> Field {
    match quadratic {
        false => Field::drag(from_f64(k), 0.0),
        true => Field::drag(0.0, from_f64(k / speed)),
    }
}

fn strengths() -> impl Iterator<Item = f64> {
    (-6..=6).map(|power| 10.0_f64.powi(power) / to_f64(DT))
}

#[test]
fn drag_slows_and_never_reverses_a_motion() {
    for scheme in SCHEMES {
        for (k, quadratic) in strengths().flat_map(|k| [(k, false), (k, true)]) {
            let mut world = weightless(DT);
            let ball = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::X * 3.0);
            let mut fields = build(drag(k, quadratic, 3.0), scheme);
            let mut last = 3.0;
            for step in 0..100 {
                fields.step(&mut world).expect("a finite step");
                let body = &world.bodies[ball];
                let now = to_f64(body.linvel().x);
                let what = format!("{scheme:?}, {k:e}, quadratic {quadratic}, step {step}: {now}");
                // A force given by `add_force` stops a body only up to rounding.
                let lent = scheme == Scheme::ExternalForce;
                let least = if lent {
                    -12.0 * to_f64(Real::EPSILON)
                } else {
                    0.0
                };
                assert!((least..=last).contains(&now), "{what} after {last}");
                assert!(body.translation().is_finite(), "{what}");
                // Below this, squares of speeds underflow, or the speed is rounding.
                if now < 1e-100 || (lent && now < 12.0 * to_f64(Real::EPSILON)) {
                    break;
                }
                last = now;
            }
        }
    }
}

#[test]
fn falling_bodies_reach_their_terminal_velocity() {
    let mut off = Vec::new();
    for scheme in SCHEMES {
        for (k, quadratic) in strengths().flat_map(|k| [(k, false), (k, true)]) {
            // The terminal velocity and the time to get there; more than 20 s are skipped.
            let limit = if quadratic {
                (9.81 / k).sqrt()
            } else {
                9.81 / k
            };
            let time = limit / 9.81;
            if time > 20.0 {
                continue;
            }
            let mut world = weightless(DT);
            world.gravity = Vector::Y * -9.81;
            let ball = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
            let mut fields = build(drag(k, quadratic, 1.0), scheme);
            let steps = (10.0 * time / to_f64(DT)) as usize + 60;
            for _ in 0..steps {
                fields.step(&mut world).expect("a finite step");
            }
            let start = to_f64(world.bodies[ball].translation().y);
            for _ in 0..60 {
                fields.step(&mut world).expect("a finite step");
            }
            let body = &world.bodies[ball];
            let shown = -to_f64(body.linvel().y) / limit - 1.0;
            let fallen = (start - to_f64(body.translation().y)) / limit - 1.0;
            // The velocity that gravity adds in a step is rounded.
            let rounding = 4.0 * to_f64(Real::EPSILON) * 9.81 * to_f64(DT) / limit;
            let bound = rounding.max(1e-3);
            // So are positions: the first step may go as far as Rapier's largest speed allows.
            let placed = 60.0 * to_f64(Real::EPSILON) * start.abs() / limit;
            if !(shown.abs() < bound && fallen.abs() < bound.max(placed)) {
                let what = format!("{scheme:?}, {k:.1e}, quadratic {quadratic}");
                off.push(format!("{what}: {shown:.1e} shown, {fallen:.1e} fallen"));
            }
        }
    }
    assert!(off.is_empty(), "{off:#?}");
}

/// The exact speed after a fall from rest of this time.
fn falling(k: f64, quadratic: bool, time: f64) -> f64 {
    let g = 9.81;
    if quadratic {
        (g / k).sqrt() * (time * (g * k).sqrt()).tanh()
    } else {
        -g / k * (-k * time).exp_m1()
    }
}

/// Also in drag too weak to reach the terminal velocity; gravity is Rapier's or a field.
#[test]
fn falling_bodies_have_the_speed_of_the_closed_form() {
    let down = Vector::Y * -9.81;
    let mut off = Vec::new();
    for scheme in SCHEMES {
        for (k, quadratic) in strengths().flat_map(|k| [(k, false), (k, true)]) {
            for scene in [true, false] {
                let mut world = weightless(DT);
                let mut tree = Tree::from(drag(k, quadratic, 1.0));
                match scene {
                    true => world.gravity = down,
                    false => {
                        let pull = Field::uniform(down).force_mode(ForceMode::Acceleration);
                        tree = tree.sum_union(pull);
                    }
                }
                // Starts at a millionth of the terminal velocity: at rest no drag acts, and the first step is Rapier's.
                let most = falling(k, quadratic, f64::INFINITY);
                let linvel = Vector::Y * from_f64(-1e-6 * most.min(1.0));
                let ball = insert_ball(&mut world, 1.0, Vector::ZERO, linvel);
                let mut fields = build(tree, scheme);
                for _ in 0..120 {
                    fields.step(&mut world).expect("a finite step");
                }
                let speed = -to_f64(world.bodies[ball].linvel().y);
                let share = speed / falling(k, quadratic, 2.0) - 1.0;
                // The implicit scheme is of first order.
                let first = scheme == Scheme::LinearlyImplicit;
                let bound: f64 = if first { 5e-3 } else { 1e-3 };
                // The velocity that gravity adds in a step is rounded.
                let rounding = 4.0 * to_f64(Real::EPSILON) * 9.81 * to_f64(DT) / most;
                if share.is_nan() || share.abs() > bound.max(rounding) {
                    let what = format!("{scheme:?}, {k:.1e}, quadratic {quadratic}");
                    off.push(format!("{what}, of the scene {scene}: {share:.1e}"));
                }
            }
        }
    }
    assert!(off.is_empty(), "{off:#?}");
}

#[test]
fn gyration_keeps_the_speed() {
    for scheme in SCHEMES {
        for turn in [0.01, 0.1, 1.0, 3.0, 10.0, 100.0] {
            let mut world = weightless(DT);
            let velocity = Vector::new(1.0, -0.3, 0.5);
            let ball = insert_ball(&mut world, 1.0, Vector::ZERO, velocity);
            let rate = Vector::new(0.6, 0.0, 0.8) * (from_f64(turn) / DT);
            let mut fields = build(Field::magnetic(rate), scheme);
            let charge = ColliderProperties::new().charge(1.0);
            let part = world.bodies[ball].colliders()[0];
            fields
                .set_properties(part, charge, &world.colliders)
                .expect("a collider");
            let mut worst = 0.0_f64;
            for _ in 0..100 {
                fields.step(&mut world).expect("a finite step");
                let ratio = world.bodies[ball].linvel().length() / velocity.length();
                worst = worst.max((to_f64(ratio) - 1.0).abs());
            }
            println!("{scheme:?}, {turn}: {worst:.1e}");
            let bound = either(1e-6, 1e-12);
            assert_at_most(worst, bound, format!("{scheme:?}, {turn}"));
        }
    }
}

/// Beside a spring, as much as Rapier's own damping of the same rate.
#[test]
fn drag_takes_energy_from_bodies_on_joints() {
    for kind in [Kind::Pendulum, Kind::Rod] {
        for turn in [0.03, 0.1, 0.3, 0.9] {
            let run = |damping| {
                let scene = kind.scene(turn / stability::DT, damping);
                fate(scene, Scheme::KickDriftKick)
            };
            let [ours, theirs] = [Damping::Field(0.05), Damping::Rapier(0.05)].map(run);
            let name = format!("{kind:?}, dt·ω = {turn}: {ours:?} beside {theirs:?}");
            println!("{name}");
            assert_at_most(ours.most, 1.0, &name);
            if turn < 0.2 {
                assert_close(ours.last / theirs.last, 1.0, 0.02, &name);
            }
        }
    }
}

/// The other field does not read velocities.
#[test]
fn drag_causes_no_evaluations_of_other_fields() {
    let asked = |scheme: Scheme, drag: bool| {
        let count = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&count);
        let mut tree = Tree::from(Field::closure([], move |sample: &Sample<'_>| {
            counted.fetch_add(1, Ordering::Relaxed);
            -sample.local_point
        }));
        if drag {
            tree += Field::drag(0.1, 0.2);
        }
        let mut world = weightless(DT);
        for x in [5.0, 10.0, 15.0] {
            insert_ball(&mut world, 1.0, Vector::X * x, Vector::Y);
        }
        let mut fields = build(tree, scheme);
        for _ in 0..10 {
            fields.step(&mut world).expect("a finite step");
        }
        count.load(Ordering::Relaxed)
    };
    let auto = Scheme::auto(0.01);
    for scheme in [Scheme::Kick, Scheme::KickDriftKick, auto] {
        let (without, with) = (asked(scheme, false), asked(scheme, true));
        assert!(without >= 30, "{scheme:?}: asked {without} times");
        assert_eq!(with, without, "{scheme:?}");
    }
}

/// Drag, Rapier's damping and gravity on a ball, and on a box, which is sampled at many points.
#[test]
fn drag_and_damping_act_once_each() {
    let (drag, damping, spin_damping) = (0.3, 0.5, 0.7);
    for scheme in SCHEMES {
        for is_ball in [true, false] {
            let mut world = weightless(DT);
            world.gravity = Vector::Y * -9.81;
            let body = RigidBodyBuilder::dynamic()
                .linvel(Vector::X)
                .angvel(Vector::Z)
                .linear_damping(from_f64(damping))
                .angular_damping(from_f64(spin_damping))
                .can_sleep(false);
            let collider = if is_ball {
                ColliderBuilder::ball(0.5)
            } else {
                ColliderBuilder::cuboid(0.5, 0.4, 0.3)
            };
            let (handle, _) = world.insert(body, collider.mass(1.0));
            let mut fields = build(Field::drag(from_f64(drag), 0.0), scheme);
            for _ in 0..60 {
                fields.step(&mut world).expect("a finite step");
            }
            let time = 60.0 * to_f64(DT);
            let (body, rate) = (&world.bodies[handle], drag + damping);
            let kept = (-rate * time).exp();
            let mut pairs = vec![
                (to_f64(body.linvel().x), kept),
                (to_f64(body.linvel().y), -9.81 / rate * (1.0 - kept)),
            ];
            // Drag slows the rotation of a box, too.
            if is_ball {
                pairs.push((to_f64(body.angvel().z), (-spin_damping * time).exp()));
            }
            for (found, expected) in pairs {
                // Schemes of first order are off by half a step.
                let error = (found / expected - 1.0).abs();
                assert!(error < 0.02, "{scheme:?} {is_ball}: {found}, {expected}");
            }
        }
    }
}

/// The inverse of the mass and the inertia in world axes, of a body that is not turned.
fn inverse_mass(body: &RigidBody) -> Matrix6<f64> {
    let local = &body.mass_properties().local_mprops;
    let turned = Pose::from_parts(Vector::ZERO, local.principal_inertia_local_frame);
    let axes = to_dpose3(&turned).rotation;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| (axes * axis).to_array().into());
    let axes = Matrix3::from_columns(&axes);
    let moments = to_dvec3(local.inv_principal_inertia).to_array();
    let mut inverse = Matrix6::identity() * to_f64(local.inv_mass);
    let inertia = axes * Matrix3::from_diagonal(&moments.into()) * axes.transpose();
    inverse.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
    inverse
}

/// Drag on parts beside the centre of mass, for one step: the exponential of its derivative by velocity, which is found
/// here from the wrenches at six velocities. They are so small that the body hardly turns.
#[test]
fn drag_beside_the_centre_of_mass_is_the_matrix_exponential() {
    const SMALL: f64 = 1e-4;
    for (strength, sampling) in [0.1, 1.0, 3.0, 30.0]
        .into_iter()
        .flat_map(|it| [Sampling::Parts, Sampling::Surface].map(|by| (it, by)))
    {
        let mut world = weightless(DT);
        let body = RigidBodyBuilder::dynamic().can_sleep(false);
        let body = world.bodies.insert(body);
        for (place, radius) in [
            (Vector::new(1.0, 0.25, -0.5), 0.25),
            (Vector::new(-0.5, 1.0, 0.5), 0.5),
            (Vector::new(0.125, -0.75, 0.75), 0.375),
        ] {
            let ball = ColliderBuilder::ball(radius).translation(place);
            world
                .colliders
                .insert_with_parent(ball, body, &mut world.bodies);
        }
        world.bodies[body].recompute_mass_properties_from_colliders(&world.colliders);
        let mass = to_f64(world.bodies[body].mass());
        let drag = Field::drag(from_f64(strength * mass / to_f64(DT)), 0.0);
        let mut fields = build(drag.sampled(sampling), Scheme::KickDriftKick);
        let give = |world: &mut PhysicsWorld, velocity: &Vector6<f64>| {
            let [a, b, c, d, e, f] = (*velocity).into();
            world.bodies[body].set_linvel(Vector::new(from_f64(a), from_f64(b), from_f64(c)), true);
            world.bodies[body].set_angvel(Vector::new(from_f64(d), from_f64(e), from_f64(f)), true);
        };
        let six = |linear: Vector, angular: Vector| {
            let [linear, angular] = [linear, angular].map(|it| to_dvec3(it).to_array());
            Vector6::from_iterator(linear.into_iter().chain(angular))
        };
        let columns: Vec<_> = (0..6)
            .map(|axis| {
                let mut velocity = Vector6::zeros();
                velocity[axis] = SMALL;
                give(&mut world, &velocity);
                let wrench = fields.sample(body, &world).expect("finite").expect("felt");
                six(wrench.force, wrench.torque) / SMALL
            })
            .collect();
        let rate = inverse_mass(&world.bodies[body]) * Matrix6::from_columns(&columns);
        let before = Vector6::new(1.0, -0.5, 0.25, 0.5, 0.75, -1.0) * SMALL;
        let expected = (rate * to_f64(DT)).exp() * before;
        give(&mut world, &before);
        fields.step(&mut world).expect("a finite step");
        let found = &world.bodies[body];
        let found = six(found.linvel(), found.angvel());
        let error = (found - expected).norm() / before.norm();
        let place = format!("{strength}, {sampling:?}");
        println!("{place}: {error:e}, {:e}", expected.norm() / before.norm());
        // The largest is 3.1e-7, by the turn within the step.
        assert_at_most(error, 5e-7, place);
    }
}
