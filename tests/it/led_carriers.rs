//! A spring on a kinematic body that is led from pose to pose, against the closed form of the motion that it drives.

use rapier3d_fields::math::{DVec3, Rotation, from_dvec3, from_f64, to_dvec3};
use rapier3d_fields::prelude::*;

use crate::support::{build, insert_ball, weightless};

const END: f64 = 1.0;
/// The angular frequency of the spring.
const OMEGA: f64 = 5.0;
/// The angular velocity of the carrier about z, and its velocity.
const TURN: f64 = 2.0;
const DRIFT: DVec3 = DVec3::new(0.7, -0.4, 0.3);
/// The spring's centre is this far from the carrier's origin, along its x axis.
const ARM: f64 = 0.6;

const PLACE: DVec3 = DVec3::new(0.2, -0.5, 0.4);
const VELOCITY: DVec3 = DVec3::new(-0.3, 0.8, 0.1);

fn carrier_at(time: f64) -> Pose {
    let turn = Rotation::from_rotation_z(from_f64(TURN * time));
    Pose::from_parts(from_dvec3(DRIFT * time), turn)
}

fn stepped(scheme: Scheme, steps: usize) -> DVec3 {
    let dt = END / steps as f64;
    let mut world = weightless(from_f64(dt));
    let handle = world.insert_body(RigidBodyBuilder::kinematic_position_based());
    let ball = insert_ball(&mut world, 1.0, from_dvec3(PLACE), from_dvec3(VELOCITY));
    let centre = Anchor::Body {
        handle,
        local_pose: Pose::from_translation(Vector::X * from_f64(ARM)),
    };
    let spring = Field::spring(from_f64(OMEGA * OMEGA)).at(centre);
    let mut fields = build(spring, scheme);
    for step in 1..=steps {
        world.bodies[handle].set_next_kinematic_position(carrier_at(dt * step as f64));
        fields.step(&mut world).expect("a step");
    }
    to_dvec3(world.bodies[ball].translation())
}

/// In the plane of the turn, x'' = −ω² (x − u t − r cos Ωt), and the same with a sine; along z only the carrier's drift.
fn exact() -> DVec3 {
    let (turn, swing) = (TURN * END, OMEGA * END);
    let driven = ARM * OMEGA.powi(2) / (OMEGA.powi(2) - TURN.powi(2));
    let forced = DVec3::new(turn.cos(), turn.sin(), 0.0) * driven;
    let apart = PLACE - DVec3::X * driven;
    let speeds = VELOCITY - DRIFT - DVec3::Y * (driven * TURN);
    DRIFT * END + forced + apart * swing.cos() + speeds * (swing.sin() / OMEGA)
}

#[test]
fn bodies_follow_a_carrier_that_is_led_at_the_order_of_the_scheme() {
    for (scheme, order, steps) in [
        (Scheme::KickDriftKick, 2, [40, 80]),
        (Scheme::Substep(Substeps::Fixed(3)), 2, [20, 40]),
        (Scheme::Forward4, 4, [8, 16]),
    ] {
        let errors = steps.map(|steps| (stepped(scheme, steps) - exact()).length());
        let found = (errors[0] / errors[1]).log2();
        assert!(
            (found - f64::from(order)).abs() < 0.25,
            "{scheme:?}: order {found}, errors {errors:?}"
        );
    }
}

/// An elastic wall that moves into a ball at rest throws it off at twice the wall's velocity, also where the ball meets
/// the wall within a step, which is then made again in smaller ones. In f64 such a step was taken whole, without a
/// warning, because the path of a ball at rest shows no stiffness: 1.24 times the velocity.
#[test]
fn moving_walls_throw_at_twice_their_velocity() {
    let (dt, speed) = (1.0 / 60.0, 3.0);
    for turn in [0.5_f64, 1.5, 4.0] {
        for gap in [0.101, 0.117, 0.134] {
            let mut world = weightless(from_f64(dt));
            let wall = RigidBodyBuilder::kinematic_velocity_based();
            let wall = world.insert_body(wall.linvel(Vector::X * from_f64(speed)));
            let place = Vector::X * from_f64(gap);
            let ball = insert_ball(&mut world, 1.0, place, Vector::ZERO);
            let spring = Field::spring(from_f64((turn / dt).powi(2)));
            let behind = Region::half_space(Vector::X, 0.0);
            let mut fields = build(spring.within(behind).at(wall), Scheme::auto(1e-3));
            for _ in 0..30 {
                fields.step(&mut world).expect("a step");
            }
            let found = to_dvec3(world.bodies[ball].linvel()).x / (2.0 * speed);
            let place = format!("dt·ω {turn}, gap {gap}: {found} of the velocity");
            assert!((found - 1.0).abs() < 0.02, "{place}");
        }
    }
}
