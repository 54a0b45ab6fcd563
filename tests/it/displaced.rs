//! Buoyancy of colliders that are sampled in pieces, and not cut at the surface of the fluid.

use std::f64::consts::{FRAC_PI_2, PI};

use rapier3d_fields::math::{DVec3, Real, Rotation, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::sampling::{one, wrench};
use crate::support::assert_at_most;

const DENSITY: f64 = 3.0;
const GRAVITY: f64 = 10.0;
const HALF: [f64; 3] = [0.5, 0.3, 0.2];
/// The layers of samples along each side.
const LAYERS: [f64; 3] = [5.0, 3.0, 2.0];

/// Quarter turns, and the side of the box that is then upright.
fn quarter_turns() -> [(Rotation, usize); 3] {
    let quarter = from_f64(FRAC_PI_2);
    [
        (Rotation::IDENTITY, 1),
        (Rotation::from_rotation_x(quarter), 2),
        (Rotation::from_rotation_z(quarter), 0),
    ]
}

/// The pieces of an upright box are layers, which displace without gaps, whether the body or its collider is turned.
/// Samples have the second moments of the box, so n layers are thicker together than the box, by (1 − 1/n²)^(−1/2).
#[test]
fn upright_boxes_displace_in_layers_without_gaps() {
    let water = Field::buoyancy(from_f64(DENSITY), from_f64(GRAVITY)).sampled(Sampling::Volume);
    let mut fields = Fields::new(water).expect("a sound tree");
    for (turn, side) in quarter_turns() {
        for of_collider in [false, true] {
            let [x, y, z] = HALF.map(from_f64);
            let (outer, inner) = match of_collider {
                true => (Rotation::IDENTITY, turn),
                false => (turn, Rotation::IDENTITY),
            };
            for depth in [-0.1, 0.05, 0.21, 0.4, 0.55, 0.85, 1.2] {
                let collider = ColliderBuilder::cuboid(x, y, z)
                    .position(Pose::from_parts(Vector::ZERO, inner))
                    .density(1.0);
                let height = 2.0 * HALF[side];
                let centre = from_f64(0.5 * height - depth);
                let (world, body) = one(Vector::Y * centre, outer, collider);
                let thickness = height / (1.0 - LAYERS[side].powi(-2)).sqrt();
                let below = 0.5 + (depth - 0.5 * height) / thickness;
                let volume = 8.0 * HALF.iter().product::<f64>();
                let displaced = volume * below.clamp(0.0, 1.0);
                let (force, torque) = wrench(&mut fields, &world, body);
                let lift = DENSITY * GRAVITY * displaced;
                let place = format!("side {side}, {of_collider}, depth {depth}: {force}");
                let rounding = 64.0 * to_f64(Real::EPSILON) * DENSITY * GRAVITY;
                assert_at_most((force.y - lift).abs(), rounding, &place);
                assert_at_most(force.x.abs() + force.z.abs(), rounding, &place);
                assert_at_most(torque.length(), rounding, &place);
                // The work of the lift from where the lowest layer touches the surface.
                let sunk = 0.5 * below.clamp(0.0, 1.0).powi(2) + (below - 1.0).max(0.0);
                let energy = fields.potential_energy(&world).total;
                let work = DENSITY * GRAVITY * volume * thickness * sunk;
                assert_at_most((energy - work).abs(), rounding, &place);
            }
        }
    }
}

/// A ball displaces the cap below the surface, V = π h² (3R − h)/3, and its potential is the work of that lift.
#[test]
fn balls_displace_a_cap() {
    let water = Field::buoyancy(from_f64(DENSITY), from_f64(GRAVITY)).sampled(Sampling::Parts);
    let mut fields = Fields::new(water).expect("a sound tree");
    let radius = 0.75;
    let cap = |h: f64| PI * h * h * (3.0 * radius - h) / 3.0;
    let work = |h: f64| PI * h.powi(3) * (radius - 0.25 * h) / 3.0;
    for depth in [0.2, 0.6, 1.1, 1.45, 1.5, 2.25, 4.0] {
        let ball = ColliderBuilder::ball(from_f64(radius)).density(1.0);
        let centre = Vector::new(0.5, from_f64(radius - depth), -0.25);
        let (world, body) = one(centre, Rotation::IDENTITY, ball);
        let (h, deeper) = (depth.min(2.0 * radius), (depth - 2.0 * radius).max(0.0));
        let (force, _) = wrench(&mut fields, &world, body);
        let energy = fields.potential_energy(&world).total;
        let weight = DENSITY * GRAVITY;
        let rounding = 256.0 * to_f64(Real::EPSILON) * weight;
        assert_at_most((force.y - weight * cap(h)).abs(), rounding, depth);
        let wanted = weight * (work(h) + cap(h) * deeper);
        assert_at_most((energy - wanted).abs(), 8.0 * rounding, depth);
    }
}

/// The velocities of a box that spins where its pieces are partly below the surface, after a tenth of a second.
fn spun(scheme: Scheme, rate: f64) -> [DVec3; 2] {
    let water = Field::buoyancy(from_f64(DENSITY), from_f64(GRAVITY)).sampled(Sampling::Volume);
    let mut fields = Fields::builder(water)
        .scheme(scheme)
        .build()
        .expect("valid");
    let [x, y, z] = HALF.map(from_f64);
    let raft = ColliderBuilder::cuboid(x, y, z).density(0.1);
    let (mut world, body) = one(Vector::ZERO, Rotation::from_rotation_z(0.3), raft);
    world.bodies[body].set_angvel(Vector::new(1.0, 0.5, 8.0), true);
    world.integration_parameters.dt = from_f64(rate.recip());
    for _ in 0..(0.1 * rate).round() as usize {
        fields.step(&mut world).expect("a step");
    }
    let body = &world.bodies[body];
    [body.linvel(), body.angvel()].map(to_dvec3)
}

/// The thickness of the layers was that of the start of the step, and the velocity off by 1e-3 m/s. Substeps make the
/// same map as steps of their length.
#[test]
fn layers_turn_with_their_body_within_steps() {
    let wanted = spun(Scheme::KickDriftKick, 1280.0);
    let found = spun(Scheme::Substep(Substeps::Fixed(64)), 20.0);
    for (found, wanted) in found.iter().zip(wanted) {
        let off = (*found - wanted).length();
        assert_at_most(off, 4e-6 * wanted.length(), "velocity");
    }
}
