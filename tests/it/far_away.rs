//! Bodies so far from the origin that their positions are coarse: rounding changes energies, and steps warn.

use rapier3d_fields::math::{Real, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{build, insert_ball, weightless};

const DT: Real = 1.0 / 60.0;

/// A place at which neighbouring numbers are this far apart, in one of the directions at most.
fn place(spacing: Real) -> Vector {
    Vector::new(1.0, 0.3, -0.2) * (spacing / Real::EPSILON)
}

fn is_far(warning: &StepWarning, of: RigidBodyHandle) -> bool {
    matches!(warning, StepWarning::FarFromOrigin { body, spacing, .. } if *body == of && *spacing > 0.0)
}

/// Swings a ball on a spring. Returns its largest energy, as a share of the first, and the number of warnings.
fn swing(spacing: Real, swing: Real, scheme: Scheme) -> (f64, usize) {
    let stiffness = (swing / DT).powi(2);
    let mut world = weightless(DT);
    let centre = place(spacing);
    let ball = insert_ball(&mut world, 1.0, centre + Vector::X * 0.5, Vector::ZERO);
    let mut fields = build(Field::spring(stiffness).at(centre), scheme);
    let (mut most, mut warned) = (0.0_f64, 0);
    for _ in 0..600 {
        fields.step(&mut world).expect("a step");
        warned += fields
            .warnings()
            .iter()
            .filter(|it| is_far(it, ball))
            .count();
        let body = &world.bodies[ball];
        let off = (body.translation() - centre).length_squared();
        let energy = stiffness * off + body.linvel().length_squared();
        most = most.max(to_f64(energy / (stiffness * 0.25)));
    }
    (most, warned)
}

/// A gain of energy of a twentieth is warned of, and there is no such warning where positions are finer than a
/// tenth of a millimetre.
#[test]
fn energy_gained_by_rounding_is_warned_of() {
    let schemes = [
        Scheme::KickDriftKick,
        Scheme::Forward4,
        Scheme::auto(1e-2),
        Scheme::substeps(4),
    ];
    let mut gained = 0;
    for scheme in schemes {
        for rate in [0.02, 0.1, 0.5] {
            for spacing in [1e-7, 1e-4, 1e-3, 0.01, 0.1] {
                let (most, warned) = swing(spacing, rate, scheme);
                let what = format!("{scheme:?}, {rate}, {spacing}: energy × {most}, {warned}");
                assert!(most < 1.05 || warned > 0, "{what}");
                assert!(spacing > 1e-4 || warned == 0, "{what}");
                gained += usize::from(most > 1.05);
            }
        }
    }
    assert!(gained > 20, "{gained} cases show an error");
}

/// Fast bodies, those that rest on a floor, and those that no field moves are not warned of, wherever they are.
#[test]
fn bodies_that_are_exact_enough_are_not_warned_of() {
    let (centre, spacing) = (place(0.01), 0.01);
    let fast = Vector::X * (20.0 * spacing / DT);
    let pull = Field::uniform(Vector::Y * -9.81);
    let elsewhere = pull.clone().within(Region::ball(1.0));
    for (name, linvel, has_floor, field) in [
        ("fast", fast, false, pull.clone()),
        ("resting", Vector::ZERO, true, pull),
        ("left alone", Vector::ZERO, false, elsewhere),
    ] {
        let mut world = weightless(DT);
        let ball = insert_ball(&mut world, 1.0, centre + Vector::Y * 0.5, linvel);
        if has_floor {
            let floor = ColliderBuilder::cuboid(5.0, 1.0, 5.0).translation(centre - Vector::Y);
            world.colliders.insert(floor);
        }
        let mut fields = build(field, Scheme::default());
        for step in 0..60 {
            fields.step(&mut world).expect("a step");
            // At first it falls onto the floor, which is a rounding below it.
            let falls = has_floor && step < 5;
            let told = fields.warnings().iter().any(|it| is_far(it, ball));
            assert!(falls || !told, "{name}, step {step}");
        }
    }
}

/// Bodies far away keep the short way of steps at centres of mass; each that is slow is warned of, as by whole steps.
#[test]
fn warnings_are_the_same_at_centres_of_mass() {
    let warned = |needs_samples: bool| {
        let mut world = weightless(DT);
        let centre = place(0.01);
        for number in 0..20 {
            let linvel = Vector::Y * (number as Real * 0.6);
            let place = centre + Vector::X * (number as Real * 2.0);
            insert_ball(&mut world, 1.0, place, linvel);
        }
        if needs_samples {
            let ball = insert_ball(&mut world, 1.0, Vector::Y * 5.0, Vector::ZERO);
            let beside = ColliderBuilder::ball(0.2).translation(Vector::X);
            let (colliders, bodies) = (&mut world.colliders, &mut world.bodies);
            colliders.insert_with_parent(beside, ball, bodies);
        }
        let above = Region::half_space(-Vector::Y, 0.0);
        let pull = Field::uniform(Vector::Y * 0.1).within(above);
        let mut fields = build(pull, Scheme::default());
        let step = |_| {
            fields.step(&mut world).expect("a step");
            let mut warned = Vec::new();
            for it in fields.warnings() {
                match it {
                    StepWarning::FarFromOrigin { body, .. } => warned.push(*body),
                    other => panic!("{other}"),
                }
            }
            warned.sort_by_key(|it| it.into_raw_parts());
            warned
        };
        (0..30).map(step).collect::<Vec<_>>()
    };
    let at_centres = warned(false);
    assert_eq!(at_centres, warned(true));
    let counts = at_centres.iter().map(Vec::len);
    assert!(counts.into_iter().all(|count| (5..15).contains(&count)));
}
