//! The laws of response.

use super::FieldContact;
use crate::field::ContactLaw;
use crate::math::{AngularInertia, Real, RigidBodyHandle, RigidBodySet, Vector};

/// Contacts of one step that hang together are answered one after the other, until no pair
/// approaches any more; each answer conserves what its law conserves. A chain of bodies needs
/// about as many rounds as it is long.
const ROUNDS: usize = 64;

/// After the first round, approach slower than this fraction of the fastest part is rounding.
const AT_REST: Real = 16.0 * Real::EPSILON;

/// A body as the response sees it.
struct Mover {
    handle: RigidBodyHandle,
    world_com: Vector,
    inverse_mass: Vector,
    inverse_inertia: AngularInertia,
    linvel: Vector,
    angvel: Vector,
    pushed: bool,
}

/// Answers contacts whose parts approach, and notes the impulses; returns the bodies written.
pub(super) fn respond(contacts: &mut [FieldContact], bodies: &mut RigidBodySet) -> usize {
    let mut movers = Movers::of(contacts, bodies);
    for round in 0..ROUNDS {
        let mut answered = false;
        for contact in contacts.iter_mut() {
            answered |= movers.answer(contact, round);
        }
        if !answered {
            break;
        }
    }
    movers.write(bodies)
}

/// The bodies of all contacts, in the order of their handles.
struct Movers(Vec<Mover>);

impl Movers {
    fn of(contacts: &[FieldContact], bodies: &RigidBodySet) -> Self {
        let mut handles: Vec<RigidBodyHandle> =
            contacts.iter().flat_map(|c| c.bodies).flatten().collect();
        handles.sort_unstable_by_key(|handle| handle.into_raw_parts());
        handles.dedup();
        let mover = |handle: RigidBodyHandle| {
            let body = bodies.get(handle)?;
            let properties = body.mass_properties();
            Some(Mover {
                handle,
                world_com: body.position().transform_point(body.local_center_of_mass()),
                inverse_mass: properties.effective_inv_mass,
                inverse_inertia: properties.effective_world_inv_inertia,
                linvel: body.linvel(),
                angvel: body.angvel(),
                pushed: false,
            })
        };
        Movers(handles.into_iter().filter_map(mover).collect())
    }

    fn place(&self, body: Option<RigidBodyHandle>) -> Option<usize> {
        let key = body?.into_raw_parts();
        self.0
            .binary_search_by_key(&key, |mover| mover.handle.into_raw_parts())
            .ok()
    }

    /// Answers one contact, if its parts approach; whether it did.
    fn answer(&mut self, contact: &mut FieldContact, round: usize) -> bool {
        let places = contact.bodies.map(|body| self.place(body));
        let (point, normal) = (contact.world_point, contact.world_normal);
        let velocities = places
            .map(|place| place.map_or(Vector::ZERO, |place| self.0[place].velocity_at(point)));
        let approach = (velocities[0] - velocities[1]).dot(normal);
        let rounding = velocities[0].length().max(velocities[1].length()) * AT_REST;
        if approach <= if round == 0 { 0.0 } else { rounding } {
            return false;
        }
        let impulses = match contact.law {
            ContactLaw::Observe => return false,
            // The paper's rule acts once a step, whatever it leads to.
            ContactLaw::Paper if round > 0 => return false,
            ContactLaw::Paper => {
                // Each part is pushed by the field of the other, if that has one.
                let push = |part: usize, by: usize| match places[part] {
                    Some(place) if contact.has_field[by] => {
                        velocities[part].length() * self.0[place].mass()
                    }
                    _ => 0.0,
                };
                [normal * -push(0, 1), normal * push(1, 0)]
            }
            ContactLaw::Impulse { restitution } => {
                let yielding = places.map(|place| {
                    place.map_or(0.0, |place| self.0[place].inverse_mass_at(point, normal))
                });
                let total = yielding[0] + yielding[1];
                if total <= 0.0 {
                    return false;
                }
                let impulse = normal * ((1.0 + restitution) * approach / total);
                [-impulse, impulse]
            }
        };
        for ((place, impulse), sum) in places.iter().zip(impulses).zip(&mut contact.impulses) {
            *sum += impulse;
            if let Some(place) = place {
                self.0[*place].push(point, impulse);
            }
        }
        true
    }

    fn write(self, bodies: &mut RigidBodySet) -> usize {
        let mut written = 0;
        for mover in self.0.into_iter().filter(|mover| mover.pushed) {
            if let Some(body) = bodies.get_mut(mover.handle) {
                // A contact wakes whom it hits, as Rapier's do.
                body.set_linvel(mover.linvel, true);
                body.set_angvel(mover.angvel, true);
                written += 1;
            }
        }
        written
    }
}

impl Mover {
    fn velocity_at(&self, world_point: Vector) -> Vector {
        self.linvel + self.angvel.cross(world_point - self.world_com)
    }

    /// Velocity along `normal` that a unit impulse along it at the point gives the point.
    fn inverse_mass_at(&self, world_point: Vector, normal: Vector) -> Real {
        let arm = world_point - self.world_com;
        let twist = self.inverse_inertia * arm.cross(normal);
        normal.dot(normal * self.inverse_mass) + twist.cross(arm).dot(normal)
    }

    /// Mass along the axes that are free; a fixed body has none.
    fn mass(&self) -> Real {
        let inverse = self.inverse_mass.max_element();
        if inverse > 0.0 { inverse.recip() } else { 0.0 }
    }

    fn push(&mut self, world_point: Vector, impulse: Vector) {
        let arm = world_point - self.world_com;
        let kick = impulse * self.inverse_mass;
        let twist = self.inverse_inertia * arm.cross(impulse);
        self.linvel += kick;
        self.angvel += twist;
        // A body held in its place may still turn.
        self.pushed |= kick != Vector::ZERO || twist != Vector::ZERO;
    }
}
