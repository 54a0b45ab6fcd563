//! Estimates of a step's error against the true error, where it is known.

use rapier3d_fields::ErrorEstimate;
use rapier3d_fields::math::{DVec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::either;

/// A ball of 1 kg in a field, and its motion in closed form.
struct Known {
    name: &'static str,
    field: Field,
    start: [DVec3; 2],
    /// Position and velocity after a time.
    after: fn(f64) -> [DVec3; 2],
    dt: f64,
}

fn spring() -> Known {
    Known {
        name: "spring",
        field: Field::spring(36.0),
        start: [DVec3::X, DVec3::ZERO],
        after: |t| {
            let (sin, cos) = (6.0 * t).sin_cos();
            [DVec3::X * cos, DVec3::X * (-6.0 * sin)]
        },
        dt: 1.0 / 60.0,
    }
}

/// Eccentricity 0.5, major half axis 1, from the pericentre.
fn kepler() -> Known {
    Known {
        name: "Kepler",
        field: Field::point_gravity(1.0),
        start: [DVec3::X * 0.5, DVec3::Y * 3.0_f64.sqrt()],
        after: |t| {
            let mut e = t;
            for _ in 0..60 {
                e -= (e - 0.5 * e.sin() - t) / (1.0 - 0.5 * e.cos());
            }
            let (sin, cos) = e.sin_cos();
            let (b, rate) = (0.75_f64.sqrt(), 1.0 / (1.0 - 0.5 * cos));
            [
                DVec3::new(cos - 0.5, b * sin, 0.0),
                DVec3::new(-sin, b * cos, 0.0) * rate,
            ]
        },
        dt: 1.0 / 200.0,
    }
}

impl Known {
    fn build(&self, scheme: Scheme) -> (PhysicsWorld, RigidBodyHandle, Fields) {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        world.integration_parameters.dt = from_f64(self.dt);
        let [position, velocity] = self.start.map(|it| {
            let [x, y, z] = it.to_array().map(from_f64);
            Vector::new(x, y, z)
        });
        let body = RigidBodyBuilder::dynamic()
            .translation(position)
            .linvel(velocity)
            .can_sleep(false);
        let (ball, _) = world.insert(body, ColliderBuilder::ball(0.1).mass(1.0));
        let builder = Fields::builder(self.field.clone()).scheme(scheme);
        (world, ball, builder.build().expect("a valid tree"))
    }
}

/// Within a factor of 1.3; where order one is assumed and the order may be two, estimates may be larger by half.
#[test]
fn estimates_agree_with_the_errors() {
    // The schemes whose error is far above rounding.
    let schemes = [
        (Scheme::KickDriftKick, 1.3),
        (Scheme::Kick, 2.0),
        (Scheme::ExternalForce, 2.0),
        (Scheme::LinearlyImplicit, 2.0),
        (Scheme::substeps(2), 1.3),
        // Neither motion is stiff for it, in either copy.
        (Scheme::auto(0.1), 2.0),
    ];
    for known in [spring(), kepler()] {
        for (scheme, within) in schemes {
            let (mut world, ball, mut fields) = known.build(scheme);
            let steps = 20;
            let estimate = fields.estimate_error(&world, steps).expect("steps");
            assert_eq!(estimate.len(), 1);
            assert_eq!(estimate[0].body, ball);
            for _ in 0..steps {
                fields.step(&mut world).expect("a step");
            }
            let exact = (known.after)(steps as f64 * known.dt);
            let body = &world.bodies[ball];
            let found = [body.translation(), body.linvel()].map(to_dvec3);
            let said = [estimate[0].position, estimate[0].velocity].map(to_f64);
            for ((found, exact), said) in found.into_iter().zip(exact).zip(said) {
                let error = found.distance(exact);
                println!("{} {scheme:?}: {error:.2e}, said {said:.2e}", known.name);
                // Rounding of positions, seen by the difference of two runs.
                let rounding = either(2e-5, 1e-12);
                assert!(said < within * error + rounding, "{said:.3e}, {error:.3e}");
                assert!(said > error / 1.3 - rounding, "{said:.3e}, {error:.3e}");
            }
        }
    }
}

#[test]
#[cfg(feature = "f64")]
fn fourth_order_is_estimated_too() {
    for known in [spring(), kepler()] {
        let (mut world, ball, mut fields) = known.build(Scheme::Forward4);
        let said = fields.estimate_error(&world, 20).expect("steps")[0].position;
        for _ in 0..20 {
            fields.step(&mut world).expect("a step");
        }
        let [exact, _] = (known.after)(20.0 * known.dt);
        let error = world.bodies[ball].translation().distance(exact);
        assert!((0.7..1.4).contains(&(said / error)), "{said:e}, {error:e}");
    }
}

/// Also in a world in motion with contacts.
#[test]
fn an_estimate_changes_nothing() {
    let run = |ask: bool| {
        let known = spring();
        let (mut world, ball, mut fields) = known.build(Scheme::KickDriftKick);
        world.gravity = Vector::Y * -9.81;
        world.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::cuboid(5.0, 0.1, 5.0),
        );
        let mut told: Vec<ErrorEstimate> = Vec::new();
        for _ in 0..40 {
            if ask {
                told = fields.estimate_error(&world, 3).expect("steps");
            }
            fields.step(&mut world).expect("a step");
        }
        assert_eq!(told.len(), usize::from(ask), "the floor is not dynamic");
        (
            world.bodies[ball].position().to_mat4(),
            world.bodies[ball].linvel(),
        )
    };
    assert_eq!(run(true), run(false));
}

#[test]
fn an_estimate_fails_where_a_step_would() {
    let (mut world, _, fields) = spring().build(Scheme::KickDriftKick);
    let none = fields.estimate_error(&world, 0).expect("no steps");
    assert_eq!(none[0].position, 0.0);
    world.integration_parameters.dt = -1.0;
    let error = fields.estimate_error(&world, 1).expect_err("a step back");
    assert!(matches!(error, StepError::TimeStep { .. }), "{error}");
}
