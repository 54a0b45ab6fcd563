//! No spring explodes without a warning: schemes against stiffness, damping and gravity.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::{self, DT, Damping, Kind, SCHEMES};
use crate::support::*;

/// How a spring of so many radians a step fares for ten seconds.
#[derive(Debug)]
struct Fate {
    /// The largest energy as a share of that of the start.
    energy: f64,
    /// In how many steps there was a warning.
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
        // About where it hangs, 1 m aside.
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
                // Symplectic Euler swings by dt·ω/2 of its energy, and stays there.
                let swing = if scheme == Scheme::Kick {
                    1.0 / (1.0 - 0.5 * turn.min(1.9))
                } else {
                    1.0
                };
                if fate.energy > 1.1 * swing && !told {
                    silent.push(format!("{scheme:?}, {turn}, {others:?}: {fate:?}"));
                }
                // Nothing is told of what goes well.
                if turn < 0.5 && scheme != Scheme::ExternalForce {
                    assert_eq!(fate.warned, 0, "{scheme:?}, {turn}: {fate:?}");
                }
            }
        }
    }
    assert!(silent.is_empty(), "{silent:#?}");
}

/// What moves one body that nothing holds, and turns it never.
fn is_of_one_ball(kind: &Kind) -> bool {
    use Kind::{Drag, Gyration, QuadraticDrag, Spring, Trap, Trough};
    matches!(
        kind,
        Spring | Trough | Gyration | Trap | Drag | QuadraticDrag
    )
}

/// What schemes that choose see in full: no contacts, nothing on joints, and no more than two bodies, to be
/// quick.
fn is_chosen_for(kind: &Kind) -> bool {
    use Kind::{Chain, PenaltyPair, PenaltyRow, PenaltyWalls, Pendulum, Rod};
    !matches!(
        kind,
        Chain(_) | PenaltyPair(_) | PenaltyRow | PenaltyWalls | Pendulum | Rod
    )
}

/// Beyond the 256 substeps of `PerBody`, whose path then looks uneven where it is not: with parts of unequal lengths a
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

/// A small part of the map of `tests/slow`.
#[test]
fn nothing_explodes_without_a_warning() {
    let chooses = [
        Scheme::Auto { tolerance: 1e-3 },
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
        // None, and a weak drag.
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
