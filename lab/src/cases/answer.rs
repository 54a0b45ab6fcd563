//! Worlds whose contacts are answered by fields or by Rapier, and the loop over their steps.

use super::fields;
use super::simulation::{Driver, Simulation};
use crate::study::{Method, StudyError};
use fields::rapier::prelude::{ColliderHandle, PhysicsWorld};
use fields::{ContactLaw, Detection, Field, Fields, Operator, Tree};

/// Prediction distance of Rapier's soft CCD, in units of length. Rapier's default of 0 turns it off.
const SOFT_AHEAD: f64 = 1.0;

/// A world in which the contacts of some colliders are answered by `method`.
pub(super) fn answered(
    case: &str,
    method: Method,
    mut world: PhysicsWorld,
    colliders: &[ColliderHandle],
    law: ContactLaw,
) -> Result<Simulation, StudyError> {
    let detection = match method {
        Method::FieldsDiscrete | Method::PaperLaw => Detection::Discrete,
        Method::FieldsSwept => Detection::Swept,
        Method::Rapier | Method::RapierCcd | Method::RapierSoftCcd => {
            for (_, body) in world.bodies.iter_mut() {
                body.enable_ccd(method == Method::RapierCcd);
                if method == Method::RapierSoftCcd {
                    body.set_soft_ccd_prediction(fields::math::from_f64(SOFT_AHEAD));
                }
            }
            let driver = Driver::Nobody;
            return Ok(Simulation { world, driver });
        }
        _ => {
            let (case, method) = (case.to_owned(), method.name());
            return Err(StudyError::Method { case, method });
        }
    };
    let touch = |part: &ColliderHandle| Tree::from(Field::contact(law).at(*part));
    let tree = Tree::fold(Operator::SumUnion, colliders.iter().map(touch));
    let fields = Fields::builder(tree).detection(detection).build()?;
    let driver = Driver::Fields(Box::new(fields));
    Ok(Simulation { world, driver })
}

/// Makes steps until one fails, and calls `look` after each. Returns how many steps were made, and how many of them
/// gave a warning.
pub(super) fn follow(
    simulation: &mut Simulation,
    steps: u64,
    mut look: impl FnMut(u64, &Simulation),
) -> (u64, u64) {
    let mut warned = 0;
    for step in 1..=steps {
        let Ok(told) = simulation.step() else {
            return (step - 1, warned);
        };
        warned += u64::from(told);
        look(step, simulation);
    }
    (steps, warned)
}
