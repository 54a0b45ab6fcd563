//! Warnings in the step in which a body meets a stiff field: within it, or as a new link of a multibody.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_close, build, insert_ball, weightless};

const DT: f64 = 1.0 / 60.0;

fn told(fields: &Fields, one: RigidBodyHandle) -> Vec<[f64; 2]> {
    let stiff = fields
        .warnings()
        .iter()
        .filter_map(|warning| match warning {
            StepWarning::Stiff {
                body,
                dt_omega,
                largest_stable_dt,
            } if *body == one => Some([*dt_omega, *largest_stable_dt].map(to_f64)),
            _ => None,
        });
    stiff.collect()
}

/// A trough that pulls a body towards its middle; the body passes it within one step, and swings across it while it does.
/// No field acts on it where the step begins and where it ends.
fn passed(turn: f64, count: u32) -> (Vec<[f64; 2]>, Real) {
    let stiffness = from_f64((turn / DT).powi(2));
    let pull = move |sample: &Sample| Vector::Y * (-stiffness * sample.local_point.y);
    let trough = Field::closure([], pull).within(Region::cuboid(Vector::new(1.0, 5.0, 5.0)));
    let mut world = weightless(from_f64(DT));
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    let speed = from_f64(4.0 / DT);
    let start = Vector::new(-2.0, 0.5, 0.0);
    let ball = insert_ball(&mut world, 1.0, start, Vector::X * speed);
    let scheme = Scheme::Substep(Substeps::Fixed(count));
    let mut fields = build(trough, scheme);
    fields.step(&mut world).expect("a step");
    let body = &world.bodies[ball];
    assert!(body.translation().x > 1.5, "{}", body.translation());
    (told(&fields, ball), body.linvel().y)
}

/// Half of the limit of stability is the limit of the warning.
#[test]
fn stiff_fields_that_are_passed_within_a_step_are_warned_of() {
    for count in [32, 64] {
        let limit = f64::from(count);
        let (warned, sideways) = passed(1.5 * limit, count);
        assert!(sideways != 0.0, "the trough moves the body");
        let [[turn, largest]] = warned[..] else {
            panic!("{count}: {warned:?}");
        };
        assert_close(turn, 1.5 * limit, 0.02, "dt·ω");
        assert_close(largest, DT * 2.0 * limit / turn, 1e-5, "the longest step");
        let (warned, _) = passed(0.7 * limit, count);
        assert!(warned.is_empty(), "{count}: {warned:?}");
    }
}

/// Links are moved by forces, which gain energy at any step, under every scheme.
#[test]
fn links_in_stiff_fields_are_warned_of_in_their_first_step() {
    let turn = 0.5;
    let pull = Field::spring(from_f64((turn / DT).powi(2))).at(Vector::X * 1.1);
    for scheme in [Scheme::KickDriftKick, Scheme::Kick, Scheme::auto(1e-2)] {
        let mut world = weightless(from_f64(DT));
        let post = world.insert_body(RigidBodyBuilder::fixed());
        let link = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
        let joint = SphericalJointBuilder::new().local_anchor2(-Vector::X);
        let joints = &mut world.multibody_joints;
        joints.insert(post, link, joint, true).expect("a joint");
        let mut fields = build(pull.clone(), scheme);
        fields.step(&mut world).expect("a step");
        let warned = told(&fields, link);
        let [[found, largest]] = warned[..] else {
            panic!("{scheme:?}: {warned:?}");
        };
        assert_close(found, turn, 1e-3, "dt·ω");
        assert_close(largest, DT * 0.02 / turn, 1e-3, "the longest step");
    }
}

/// Bodies of which samples are taken, under schemes that kick once a step: what they meet shows by their way.
#[test]
fn boxes_that_come_to_a_stiff_field_are_warned_of() {
    for (scheme, limit) in [(Scheme::Kick, 1.0), (Scheme::ExternalForce, 0.02)] {
        for (share, is_stiff) in [(1.4, true), (0.7, false)] {
            let turn = share * limit;
            let stiffness = from_f64((turn / DT).powi(2));
            let right = Region::half_space(-Vector::X, 0.0);
            let spring = Field::spring(stiffness)
                .within(right)
                .force_mode(ForceMode::Acceleration);
            let mut world = weightless(from_f64(DT));
            let body = RigidBodyBuilder::dynamic().linvel(Vector::X);
            let body = body.translation(Vector::X * from_f64(-3.2 * DT));
            let (handle, _) = world.insert(body, ColliderBuilder::cuboid(1e-3, 2e-3, 1e-3));
            let mut fields = build(spring, scheme);
            let mut warned = Vec::new();
            for _ in 0..8 {
                fields.step(&mut world).expect("a step");
                warned.extend(told(&fields, handle));
            }
            assert_eq!(
                !warned.is_empty(),
                is_stiff,
                "{scheme:?}, {share}: {warned:?}"
            );
            for [found, _] in warned {
                assert_close(found, turn, 0.02, "dt·ω");
            }
        }
    }
}
