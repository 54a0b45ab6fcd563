//! Drag in the frame of a kinematic body that moves and turns, against a Runge-Kutta integration in this file. Before
//! its first step, Rapier has no centre of mass for a carrier without colliders.

use rapier3d_fields::math::{DVec3, from_dvec3, from_f64, to_dvec3};
use rapier3d_fields::prelude::*;

use crate::any_bodies::SCHEMES;
use crate::support::{build as fields_of, either, insert_ball, weightless};

const END: f64 = 1.0;
const MASS: f64 = 1.3;
const RATES: [f64; 2] = [0.4, 0.2];

/// The carrier: its origin, the centre about which Rapier turns it, and its velocities.
const ORIGIN: DVec3 = DVec3::new(-0.9, 0.8, 0.1);
const ARM: DVec3 = DVec3::new(0.4, -0.2, 0.3);
const LINVEL: DVec3 = DVec3::new(0.3, -0.5, -0.7);
const ANGVEL: DVec3 = DVec3::new(0.6, -0.2, 0.9);

const PLACE: DVec3 = DVec3::new(-0.6, -0.5, 0.1);
const VELOCITY: DVec3 = DVec3::new(-0.2, -0.9, 0.4);

/// The place and the velocity of a ball after some steps. The carrier has a part at `ARM` from its origin, or none.
fn stepped(scheme: Scheme, has_part: bool, steps: usize) -> [DVec3; 2] {
    let mut world = weightless(from_f64(END / steps as f64));
    let carrier = RigidBodyBuilder::kinematic_velocity_based()
        .translation(from_dvec3(ORIGIN))
        .linvel(from_dvec3(LINVEL))
        .angvel(from_dvec3(ANGVEL));
    let carrier = world.insert_body(carrier);
    if has_part {
        let part = ColliderBuilder::cuboid(0.1, 0.1, 0.1)
            .translation(from_dvec3(ARM))
            .collision_groups(InteractionGroups::none());
        world.insert_collider(part, Some(carrier));
    }
    let (place, velocity) = (from_dvec3(PLACE), from_dvec3(VELOCITY));
    let ball = insert_ball(&mut world, from_f64(MASS), place, velocity);
    let [linear, quadratic] = RATES.map(from_f64);
    let mut fields = fields_of(Field::drag(linear, quadratic).at(carrier), scheme);
    for _ in 0..steps {
        fields.step(&mut world).expect("a finite step");
    }
    let body = &world.bodies[ball];
    [to_dvec3(body.translation()), to_dvec3(body.linvel())]
}

/// The same by the classical Runge-Kutta scheme at small steps.
fn exact(has_part: bool) -> [DVec3; 2] {
    const STEPS: usize = 2000;
    let pivot = if has_part { ORIGIN + ARM } else { ORIGIN };
    let rate = |time: f64, [place, velocity]: [DVec3; 2]| {
        let centre = pivot + LINVEL * time;
        let past = velocity - LINVEL - ANGVEL.cross(place - centre);
        let force = past * -(RATES[0] + RATES[1] * past.length());
        [velocity, force / MASS]
    };
    let plus = |[place, velocity]: [DVec3; 2], rate: [DVec3; 2], h: f64| {
        [place + rate[0] * h, velocity + rate[1] * h]
    };
    let (mut state, h) = ([PLACE, VELOCITY], END / STEPS as f64);
    for step in 0..STEPS {
        let time = step as f64 * h;
        let k1 = rate(time, state);
        let k2 = rate(time + h / 2.0, plus(state, k1, h / 2.0));
        let k3 = rate(time + h / 2.0, plus(state, k2, h / 2.0));
        let k4 = rate(time + h, plus(state, k3, h));
        for (rate, part) in [(k1, 6.0), (k2, 3.0), (k3, 3.0), (k4, 6.0)] {
            state = plus(state, rate, h / part);
        }
    }
    state
}

#[test]
fn drag_in_a_frame_that_moves_and_turns_has_the_order_of_the_scheme() {
    for (scheme, order) in SCHEMES {
        for has_part in [false, true] {
            let exact = exact(has_part);
            let errors = [40, 160].map(|steps| {
                let [place, velocity] = stepped(scheme, has_part, steps);
                place.distance(exact[0]).max(velocity.distance(exact[1]))
            });
            let [coarse, fine] = errors;
            let least = 0.5 * 4.0_f64.powi(order);
            assert!(
                fine <= either(2e-5, 1e-7) || fine * least <= coarse,
                "{scheme:?}, part {has_part}: {coarse:e}, {fine:e}"
            );
        }
    }
}
