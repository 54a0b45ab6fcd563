//! No spring explodes without a warning: schemes against stiffness, damping and gravity.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::{self, DT, Damping, Kind, SCHEMES};
use crate::support::*;

/// How a spring of `turn` radians a step behaves for ten seconds.
#[derive(Debug)]
struct Fate {
    /// The largest energy as a share of that of the start.
    energy: f64,
    /// The number of steps with a warning.
    warned: usize,
    refused: bool,
}

fn fate(scheme: Scheme, turn: f64, (damping, gravity): (Real, Real)) -> Fate {
    let mut world = weightless(1.0 / 60.0);
    world.gravity = Vector::Y * gravity;
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    let stiffness = (turn * 60.0).powi(2);
    let ball = insert_ball(&mut world, 1.0, Vector::X, Vector::ZERO);
    world.bodies[ball].set_linear_damping(damping);
    let mut fields = build(Field::spring(from_f64(stiffness)), scheme);
    fields.settings.on_fault = FaultPolicy::Refuse;
    let mut fate = Fate {
        energy: 0.0,
        warned: 0,
        refused: false,
    };
    for _ in 0..600 {
        if fields.step(&mut world).is_err() {
            fate.refused = true;
            break;
        }
        fate.warned += usize::from(!fields.warnings().is_empty());
        let body = &world.bodies[ball];
        let [place, velocity] = [body.translation(), body.linvel()];
        // Relative to where it hangs at rest; it starts 1 m aside.
        let place = place - world.gravity / from_f64(stiffness);
        let energy = stiffness * to_f64(place.length_squared()) + to_f64(velocity.length_squared());
        let sag = to_f64(gravity).powi(2) / stiffness;
        fate.energy = fate.energy.max(energy / (stiffness + sag));
    }
    fate
}

#[test]
fn no_spring_explodes_without_a_warning() {
    let turns = [
        0.03, 0.1, 0.3, 1.0, 1.5, 1.9, 2.1, 3.0, 5.0, 7.0, 10.0, 100.0, 1000.0,
    ];
    let mut silent = Vec::new();
    for scheme in SCHEMES {
        for others in [(0.0, 0.0), (1.0, 0.0), (30.0, -9.81)] {
            for turn in turns {
                let fate = fate(scheme, turn, others);
                let told = fate.refused || fate.warned > 0;
                // Under symplectic Euler the energy oscillates by dt·ω/2 of itself, and does not grow.
                let swing = if scheme == Scheme::Kick {
                    1.0 / (1.0 - 0.5 * turn.min(1.9))
                } else {
                    1.0
                };
                if fate.energy > 1.1 * swing && !told {
                    silent.push(format!("{scheme:?}, {turn}, {others:?}: {fate:?}"));
                }
                // Stable springs get no warning.
                if turn < 0.5 && scheme != Scheme::ExternalForce {
                    assert_eq!(fate.warned, 0, "{scheme:?}, {turn}: {fate:?}");
                }
            }
        }
    }
    assert!(silent.is_empty(), "{silent:#?}");
}

/// Scenes of one free body that never turns.
fn is_of_one_ball(kind: &Kind) -> bool {
    use Kind::{Drag, Gyration, QuadraticDrag, Spring, Trap, Trough};
    matches!(
        kind,
        Spring | Trough | Gyration | Trap | Drag | QuadraticDrag
    )
}

/// Scenes that adaptive schemes see in full: no contacts, nothing on joints, and no more than two bodies, to be quick.
fn is_chosen_for(kind: &Kind) -> bool {
    use Kind::{Chain, PenaltyPair, PenaltyRow, PenaltyWalls, Pendulum, Rod};
    !matches!(
        kind,
        Chain(_) | PenaltyPair(_) | PenaltyRow | PenaltyWalls | Pendulum | Rod
    )
}

/// Beyond the 256 substeps of `PerBody` the path looks uneven although it is not: with substeps of unequal lengths a
/// rotor gained fifteen times its energy at dt·ω 500.
#[test]
fn no_rotor_beyond_all_substeps_gains_energy_without_a_warning() {
    let mut silent = Vec::new();
    for tolerance in [1e-3, 1e-2, 0.25] {
        let scheme = Scheme::Substep(Substeps::PerBody { tolerance });
        for turn in [100.0, 200.0, 400.0, 500.0, 700.0, 2000.0] {
            let fate = stability::fate(Kind::Rotor.scene(turn / DT, Damping::None), scheme);
            if fate.is_silent() {
                silent.push(format!("{tolerance}, {turn}: {fate:?}"));
            }
        }
    }
    assert!(silent.is_empty(), "{silent:#?}");
}

fn two_balls_that_become_one() -> (PhysicsWorld, [ColliderHandle; 2]) {
    two_balls_that_become_one_after(|world| world.step())
}

/// A dynamic body of two balls that bounces off a ball, and gets the shape of one ball once both are near.
fn two_balls_that_become_one_after(
    mut step: impl FnMut(&mut PhysicsWorld),
) -> (PhysicsWorld, [ColliderHandle; 2]) {
    let mut world = weightless(1.0 / 60.0);
    let ball = ColliderBuilder::ball(1.0);
    let other = world.insert_collider(ball, None);
    let child = |x: Real, y: Real| {
        let place = Vector::new(x, y, 0.0);
        (Pose::from_translation(place), SharedShape::ball(0.5))
    };
    let both = vec![child(0.15, -0.15), child(-0.15, 0.15)];
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::new(1.14, 1.14, 0.0))
        .linvel(Vector::new(-0.7, -0.7, 0.0));
    let (_, collider) = world.insert(body, ColliderBuilder::compound(both).restitution(1.0));
    for _ in 0..4 {
        step(&mut world);
    }
    let pair = world.narrow_phase.contact_pair(other, collider);
    assert_eq!(pair.map(|it| it.manifolds().len()), Some(2), "two contacts");
    world.colliders[collider].set_shape(SharedShape::ball(0.5));
    (world, [other, collider])
}

/// Rapier 0.36 alone reads beyond its contacts there and ends the program. With fields it does not, and a warning names
/// the two colliders until they part.
#[test]
fn contacts_that_outlive_a_shape_are_warned_of() {
    let far = Field::spring(1.0)
        .within(Region::ball(1.0))
        .at(Vector::X * 1e4);
    let near = Field::uniform(Vector::Z * 1e-3);
    for field in [far, near] {
        for scheme in SCHEMES {
            let (mut world, pair) = two_balls_that_become_one();
            let mut fields = build(field.clone(), scheme);
            let mut told = Vec::new();
            for _ in 0..80 {
                fields.step(&mut world).expect("a step");
                let outlives = |it: &StepWarning| match it {
                    StepWarning::ContactsOutliveShape { colliders } => *colliders == pair,
                    _ => false,
                };
                told.push(fields.warnings().iter().filter(|it| outlives(it)).count());
            }
            let parts = told.iter().position(|count| *count == 0);
            let parts = parts.expect("they part");
            assert!(parts > 10, "{scheme:?}: {told:?}");
            assert!(told[parts..].iter().all(|count| *count == 0), "{told:?}");
            assert!(told[..parts].iter().all(|count| *count == 1), "{told:?}");
        }
    }
}

/// A shape that is set later than in the first step is noticed in the next one.
#[test]
fn contacts_that_outlive_a_shape_are_warned_of_at_once() {
    let field = Field::uniform(Vector::Z * 1e-3);
    let mut fields = build(field, Scheme::KickDriftKick);
    let (mut world, pair) = two_balls_that_become_one_after(|world| {
        fields.step(world).expect("a step");
        assert!(fields.warnings().is_empty(), "{:?}", fields.warnings());
    });
    fields.step(&mut world).expect("a step");
    let outlives = StepWarning::ContactsOutliveShape { colliders: pair };
    assert_eq!(fields.warnings(), [outlives]);
}

/// A collider that got several parts by `set_shape`, long ago.
#[test]
fn contacts_that_outlive_a_later_shape_are_warned_of() {
    let mut world = weightless(1.0 / 60.0);
    let other = world.insert_collider(ColliderBuilder::ball(1.0), None);
    // Both parts then touch within Rapier's prediction.
    let place = Vector::new(1.0504, 1.0504, 0.0);
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .can_sleep(false);
    let (_, collider) = world.insert(body, ColliderBuilder::ball(0.3));
    let mut fields = build(
        Field::uniform(Vector::X).within(Region::ball(0.1)),
        Scheme::Kick,
    );
    fields.step(&mut world).expect("a step");
    let child = |x: Real| {
        let place = Vector::new(x, -x, 0.0);
        (Pose::from_translation(place), SharedShape::ball(0.5))
    };
    let both = SharedShape::compound(vec![child(0.15), child(-0.15)]);
    world.colliders[collider].set_shape(both);
    for _ in 0..65 {
        fields.step(&mut world).expect("a step");
        assert!(fields.warnings().is_empty(), "{:?}", fields.warnings());
    }
    let pair = world.narrow_phase.contact_pair(other, collider);
    assert_eq!(pair.map(|it| it.manifolds().len()), Some(2), "two contacts");
    world.colliders[collider].set_shape(SharedShape::ball(0.3));
    fields.step(&mut world).expect("a step");
    let colliders = [other, collider];
    let outlives = StepWarning::ContactsOutliveShape { colliders };
    assert_eq!(fields.warnings(), [outlives]);
}

/// Shapes of several parts, and shapes that are set while nothing is near, cause no warning.
#[test]
fn contacts_that_fit_the_shape_are_not_warned_of() {
    let (mut world, [other, collider]) = two_balls_that_become_one();
    let child = |x: Real| {
        let place = Vector::new(x, -x, 0.0);
        (Pose::from_translation(place), SharedShape::ball(0.5))
    };
    let both = SharedShape::compound(vec![child(0.15), child(-0.15)]);
    world.colliders[collider].set_shape(both);
    let mut fields = build(Field::uniform(Vector::Z * 1e-3), Scheme::KickDriftKick);
    for step in 0..80 {
        if step == 60 {
            let touches = world.narrow_phase.contact_pair(other, collider);
            assert!(touches.is_none_or(|it| it.manifolds().is_empty()), "apart");
            world.colliders[collider].set_shape(SharedShape::ball(0.5));
        }
        fields.step(&mut world).expect("a step");
        let told = fields.warnings();
        assert!(told.is_empty(), "step {step}: {told:?}");
    }
}

/// The environment variable by which a child process makes Rapier's steps alone.
const ALONE: &str = "OUTLIVED_ALONE";

/// Rapier alone ends the process. Once it does not any more, the warning can be removed.
#[test]
#[ignore = "ends a child process by a fault of Rapier's"]
fn rapier_alone_ends_with_contacts_that_outlive_a_shape() {
    if std::env::var(ALONE).is_ok() {
        let (mut world, _) = two_balls_that_become_one();
        (0..80).for_each(|_| world.step());
        return;
    }
    let program = std::env::current_exe().expect("this program");
    let name = "warned::rapier_alone_ends_with_contacts_that_outlive_a_shape";
    let child = std::process::Command::new(program)
        .args([name, "--exact", "--include-ignored"])
        .env(ALONE, "1")
        .output();
    let status = child.expect("a child").status;
    println!("Rapier alone: {status}");
    assert!(!status.success());
}

/// A small part of the stability map of `tests/slow`.
#[test]
fn nothing_explodes_without_a_warning() {
    let chooses = [
        Scheme::auto(1e-3),
        Scheme::Substep(Substeps::PerBody { tolerance: 1e-3 }),
    ];
    let mut cells = Vec::new();
    for kind in Kind::ALL {
        if is_of_one_ball(&kind) {
            cells.push((Scheme::KickDriftKick, kind));
        }
        if is_chosen_for(&kind) {
            cells.extend(chooses.map(|scheme| (scheme, kind)));
        }
    }
    let mut silent = Vec::new();
    for (scheme, kind) in cells {
        // No damping, and a weak drag.
        for damping in Damping::ALL.into_iter().step_by(3) {
            for turn in [0.3, 1.5, 3.0, 10.0] {
                let fate = stability::fate(kind.scene(turn / DT, damping), scheme);
                if fate.is_silent() {
                    silent.push(format!(
                        "{kind:?}, {damping:?}, {scheme:?}, {turn}: {fate:?}"
                    ));
                }
            }
        }
    }
    assert!(silent.is_empty(), "{silent:#?}");
}
