//! The speed at which the two sides of a contact approach.

use super::field_contact::FieldContact;
use super::starts::{Starts, pivot};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rigid::Lookup;

/// The motion of the points of a body, in world axes; zero for a collider without a body.
#[derive(Clone, Copy, Default)]
pub(super) struct PointMotion {
    pivot: Vector,
    linvel: Vector,
    angvel: Vector,
}

impl PointMotion {
    /// The motions of the two sides of a contact.
    pub(super) fn of_sides(
        contact: &FieldContact,
        world: &impl Lookup,
        starts: &Starts,
    ) -> [Self; 2] {
        contact
            .bodies
            .map(|body| PointMotion::of(body, world, starts))
    }

    fn of(body: Option<RigidBodyHandle>, world: &impl Lookup, starts: &Starts) -> Self {
        let body = body.and_then(|handle| Some((handle, world.body(handle)?)));
        body.map_or(PointMotion::default(), |(handle, body)| PointMotion {
            pivot: if body.is_dynamic() {
                body.center_of_mass()
            } else {
                body.position().transform_point(pivot(body))
            },
            linvel: starts.pivot_velocity(handle, body),
            angvel: body.angvel(),
        })
    }

    pub(super) fn is_still(&self) -> bool {
        self.linvel == Vector::ZERO && self.angvel == Vector::ZERO
    }

    pub(super) fn at(&self, world_point: Vector) -> Vector {
        self.linvel + self.angvel.cross(world_point - self.pivot)
    }
}

/// The speed at which the parts of a contact approach along its normal, at its point.
pub(super) fn approach_speed(contact: &FieldContact, world: &impl Lookup, starts: &Starts) -> Real {
    let motions = PointMotion::of_sides(contact, world, starts);
    let [one, two] = motions.map(|motion| motion.at(contact.world_point));
    (one - two).dot(contact.world_normal)
}
