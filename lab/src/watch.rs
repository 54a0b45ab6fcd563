//! Contacts and momentum of a world, for its [`Record`](crate::record::Record).

use super::fields;
use crate::AnyError;
use crate::record::StepContacts;
use fields::cross_check::CrossCheckReport;
use fields::math::{DVec3, to_dvec3, to_f64};
use fields::prelude::*;

/// Counts the contacts of the last step, and sums the impulses on the walls (fixed bodies).
pub fn contacts(fields: &Fields, world: &PhysicsWorld) -> StepContacts {
    let mut step = StepContacts {
        found_by_fields: fields.contacts().len() as u64,
        found_by_rapier: touching_pairs(world),
        ..StepContacts::default()
    };
    for contact in fields.contacts() {
        let answered = contact.impulses.iter().any(|j| *j != Vector::ZERO);
        step.answered += u64::from(answered);
        let point = to_dvec3(contact.world_point);
        for (body, impulse) in contact.bodies.iter().zip(contact.impulses) {
            if body.is_some_and(|handle| world.bodies[handle].is_fixed()) {
                let impulse: DVec3 = to_dvec3(impulse);
                step.wall_impulse += impulse;
                step.wall_twist += point.cross(impulse);
            }
        }
    }
    step
}

/// The scales of [`Totals`](crate::record::Totals) for all dynamic bodies.
pub fn momentum_scales(bodies: &RigidBodySet) -> [f64; 2] {
    let dynamic = bodies.iter().filter(|(_, body)| body.is_dynamic());
    dynamic.fold([0.0; 2], |[linear, angular], (_, body)| {
        let momentum = to_f64(body.mass()) * to_dvec3(body.linvel()).length();
        let arm = to_dvec3(body.translation()).length();
        [linear + momentum, angular + arm * momentum]
    })
}

/// Number of overlapping pairs of colliders that Rapier found at the start of its last step.
fn touching_pairs(world: &PhysicsWorld) -> u64 {
    let touching = world.narrow_phase.contact_pairs().filter(|pair| {
        let mut points = pair.manifolds().iter().flat_map(|m| m.points.iter());
        points.any(|point| point.dist < 0.0)
    });
    touching.count() as u64
}

/// Prints the report of a cross-check; `length` is the unit of its lengths.
pub fn print_cross_check(report: &CrossCheckReport, length: &str) {
    print!("{report}");
    println!("  (lengths in {length})");
}

/// Makes disagreements of a cross-check an error, with which a program can end.
///
/// # Errors
/// Fields and Rapier disagree.
pub fn cross_check_passed(report: &CrossCheckReport) -> Result<(), AnyError> {
    match (report.disagreed(), &report.first) {
        (0, _) => Ok(()),
        (count, Some(first)) => {
            Err(format!("the cross-check found {count} disagreements, the first: {first}").into())
        }
        (count, None) => Err(format!("the cross-check found {count} disagreements").into()),
    }
}
