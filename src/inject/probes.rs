//! Probes from bodies and their colliders.

use std::sync::Arc;

use super::error::StepError;
use crate::eval::{Probe, Probes, UserValues, Wrench, owner};
use crate::math::{
    ColliderHandle, ColliderSet, InteractionGroups, Pose, Real, RigidBodyHandle, RigidBodySet,
    Vector,
};
use crate::math::{from_f64, to_f64};
use crate::rapier::data::Coarena;
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Collider;

/// What the fields may ask of a collider, beyond its shape and place.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let nitrogen = ProbeProperties::new().charge(-1.02).mass(14.0067).axis("dispersion", 1.0);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ProbeProperties {
    /// Electric charge, for [`Axis::Charge`](crate::Axis::Charge). Zero by default.
    pub charge: Real,
    /// Mass of this part of the body, if it is not the collider's own: colliders of density zero
    /// have none. Only the ratio between the parts of a body counts.
    pub mass: Option<Real>,
    /// Values along the user's axes; others take the value of the world.
    pub axes: Vec<(Arc<str>, Real)>,
}

impl ProbeProperties {
    /// No charge, the collider's own mass, and the world's values on the user's axes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the charge.
    pub fn charge(mut self, charge: Real) -> Self {
        self.charge = charge;
        self
    }

    /// Sets the mass of this part of the body.
    pub fn mass(mut self, mass: Real) -> Self {
        self.mass = Some(mass);
        self
    }

    /// Sets the value along one of the user's axes.
    pub fn axis(mut self, name: &str, value: Real) -> Self {
        self.axes.push((name.into(), value));
        self
    }

    fn validate(&self, collider: ColliderHandle) -> Result<(), StepError> {
        let bad = |quantity, requirement, value| StepError::Property {
            collider,
            quantity,
            requirement,
            value,
        };
        if !self.charge.is_finite() {
            return Err(bad("the charge", "finite", self.charge));
        }
        match self.mass {
            Some(mass) if !(mass >= 0.0 && mass.is_finite()) => {
                Err(bad("the mass", "zero or more, and finite", mass))
            }
            _ => Ok(()),
        }
    }
}

/// The properties of all colliders that have some, and the world's values on the user's axes.
#[derive(Clone, Default)]
pub(crate) struct PropertyBook {
    world: Vec<(Arc<str>, f64)>,
    entries: Coarena<Option<Entry>>,
    /// Handles with an entry, to rebuild them when the world's values change.
    listed: Vec<ColliderHandle>,
}

#[derive(Clone)]
struct Entry {
    properties: ProbeProperties,
    user: UserValues,
}

impl PropertyBook {
    pub(crate) fn new(axes: Vec<(Arc<str>, Real)>) -> Self {
        PropertyBook {
            world: axes
                .into_iter()
                .map(|(name, value)| (name, to_f64(value)))
                .collect(),
            ..Self::default()
        }
    }

    /// Sets the properties of a collider.
    pub(crate) fn set(
        &mut self,
        collider: ColliderHandle,
        properties: ProbeProperties,
    ) -> Result<(), StepError> {
        properties.validate(collider)?;
        for (name, value) in &properties.axes {
            self.check_axis(name, *value)?;
        }
        if self.get(collider).is_none() {
            self.listed.push(collider);
        }
        let user = self.values(&properties);
        self.entries
            .insert(collider.0, Some(Entry { properties, user }));
        Ok(())
    }

    /// Sets the world's value along one of the user's axes.
    pub(crate) fn set_axis(&mut self, name: &str, value: Real) -> Result<(), StepError> {
        self.check_axis(name, value)?;
        for (known, current) in &mut self.world {
            if **known == *name {
                *current = to_f64(value);
            }
        }
        for collider in self.listed.clone() {
            let entry = self.entries.get(collider.0).cloned().flatten();
            if let Some(Entry { properties, .. }) = entry {
                let user = self.values(&properties);
                self.entries
                    .insert(collider.0, Some(Entry { properties, user }));
            }
        }
        Ok(())
    }

    /// Gives probes the world's values, as the first of theirs.
    pub(super) fn of_world(&self, probes: &mut Probes) {
        probes.user.push(self.world.iter().cloned().collect());
    }

    fn check_axis(&self, name: &str, value: Real) -> Result<(), StepError> {
        let axis = name.to_owned();
        if !self.world.iter().any(|(known, _)| **known == *name) {
            return Err(StepError::UnknownAxis { axis });
        }
        if !value.is_finite() {
            return Err(StepError::AxisValue { axis, value });
        }
        Ok(())
    }

    fn values(&self, properties: &ProbeProperties) -> UserValues {
        let value = |(name, world): &(Arc<str>, f64)| {
            let own = properties
                .axes
                .iter()
                .rev()
                .find(|(known, _)| known == name);
            (
                name.clone(),
                own.map_or(*world, |(_, value)| to_f64(*value)),
            )
        };
        self.world.iter().map(value).collect()
    }

    fn get(&self, collider: ColliderHandle) -> Option<&Entry> {
        self.entries.get(collider.0)?.as_ref()
    }
}

/// What decides which bodies are sampled, and how fast they are taken to move.
pub(crate) struct Gathering<'a> {
    pub book: &'a PropertyBook,
    pub sleepers: bool,
    /// Whether the parts of bodies are wanted, or only the bodies as a whole.
    pub parts: bool,
    /// Impulses still to come, whose effect on the velocity counts already: see
    /// [`Injector`](super::Injector).
    pub pending: Option<Pending<'a>>,
}

/// Wrenches of an earlier evaluation, and for how long they still act.
pub(crate) struct Pending<'a> {
    pub bodies: &'a [RigidBodyHandle],
    pub wrenches: &'a [Wrench],
    pub duration: Real,
}

impl Gathering<'_> {
    /// Fills `probes` with those of all bodies that fields can move.
    pub(crate) fn run(&self, bodies: &RigidBodySet, colliders: &ColliderSet, probes: &mut Probes) {
        probes.clear();
        self.book.of_world(probes);
        for (handle, body) in bodies.iter() {
            let sampled = body.is_dynamic() && body.is_enabled() && !body.is_soft_frame();
            if sampled && (self.sleepers || !body.is_sleeping()) {
                self.body(handle, body, colliders, probes);
            }
        }
        probes.number();
    }

    fn body(
        &self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        colliders: &ColliderSet,
        probes: &mut Probes,
    ) {
        let pose = body.position();
        let mass = body.mass();
        let (linvel, angvel) = self.velocity(handle, body);
        let mut centre = Probe {
            // Rapier's own world centre of mass lags behind a body that was just teleported.
            world_point: pose.transform_point(body.local_center_of_mass()),
            arm: Vector::ZERO,
            velocity: linvel,
            body: probes.bodies.len() as u32,
            owner: owner(Some(handle)),
            radius: 0.0,
            mass,
            share: 1.0,
            charge: 0.0,
            volume: 0.0,
            groups: InteractionGroups::all(),
            user: 0,
            collider: None,
            at_origin: false,
        };
        if !self.parts {
            probes.centres.push(centre);
            probes.bodies.push(handle);
            return;
        }
        let first = probes.list.len();
        for collider_handle in body.colliders() {
            let Some(collider) = colliders.get(*collider_handle) else {
                continue;
            };
            if !collider.is_enabled() || collider.is_sensor() {
                continue;
            }
            let local_pose = collider
                .position_wrt_parent()
                .copied()
                .unwrap_or(Pose::IDENTITY);
            let (local_point, radius) = middle(collider);
            let body_point = local_pose.transform_point(local_point);
            let arm = pose.rotation * (body_point - body.local_center_of_mass());
            let mut probe = Probe {
                world_point: centre.world_point + arm,
                arm,
                velocity: linvel + angvel.cross(arm),
                radius,
                mass: 0.0,
                groups: collider.collision_groups(),
                collider: Some(*collider_handle),
                at_origin: local_point == Vector::ZERO,
                ..centre
            };
            let entry = self.book.get(*collider_handle);
            // A part that is alone has all of the mass; a collider's own takes time to work out.
            probe.mass = match entry.and_then(|entry| entry.properties.mass) {
                _ if body.colliders().len() == 1 => 1.0,
                Some(own_mass) => own_mass,
                None => collider.mass(),
            };
            if let Some(entry) = entry {
                probe.charge = entry.properties.charge;
                if !entry.user.is_empty() {
                    probe.user = probes.user.len() as u32;
                    probes.user.push(entry.user.clone());
                }
            }
            centre.charge += probe.charge;
            centre.radius = centre.radius.max(arm.length() + radius);
            probes.list.push(probe);
        }
        if probes.list.len() == first {
            probes.list.push(centre);
        }
        share_mass(&mut probes.list[first..], mass);
        probes.centres.push(centre);
        probes.bodies.push(handle);
    }

    /// How fast a body is taken to move.
    pub(super) fn velocity(&self, handle: RigidBodyHandle, body: &RigidBody) -> (Vector, Vector) {
        let (linvel, angvel) = (body.linvel(), body.angvel());
        let pending = self.pending.as_ref().and_then(|pending| {
            let index = |handle: &RigidBodyHandle| handle.into_raw_parts().0;
            let place = pending
                .bodies
                .binary_search_by_key(&index(&handle), index)
                .ok()?;
            Some((pending.wrenches[place], pending.duration))
        });
        let Some((wrench, duration)) = pending else {
            return (linvel, angvel);
        };
        let properties = body.mass_properties();
        (
            linvel + wrench.force * duration * properties.effective_inv_mass,
            angvel + properties.effective_world_inv_inertia * (wrench.torque * duration),
        )
    }
}

/// Where a collider is sampled, in its own frame, and the radius it is taken to have.
fn middle(collider: &Collider) -> (Vector, Real) {
    if let Some(ball) = collider.shape().as_ball() {
        return (Vector::ZERO, ball.radius);
    }
    let bounds = collider.shape().compute_local_bounding_sphere();
    if bounds.radius.is_finite() {
        (bounds.center, bounds.radius)
    } else {
        (Vector::ZERO, 0.0)
    }
}

/// Divides the mass of a body among its probes, in the ratio of the masses they came with.
fn share_mass(probes: &mut [Probe], mass: Real) {
    let total: Real = probes.iter().map(|probe| probe.mass).sum();
    let count: Real = from_f64(probes.len() as f64);
    for probe in probes {
        let equal = total <= 0.0 || !total.is_finite();
        probe.share = if equal {
            count.recip()
        } else {
            probe.mass / total
        };
        probe.mass = probe.share * mass;
    }
}
