//! The colliders of a step for swept detection, each as a part of its body.

use super::discrete::Discrete;
use super::field_contact::ContactPart;
use super::starts::{Starts, pivot};
use super::swept_body::SweptBody;
use crate::math::{DQuat, DVec3, Pose, Real, SharedShape, to_dpose3, to_dvec3, to_f64};
use crate::rapier::geometry::{Aabb, Collider};
use crate::rapier::parry::bounding_volume::BoundingVolume;
use crate::rigid::{Lookup, local_pose};

/// A collider of a body on its path.
#[derive(Debug)]
pub(super) struct SweptPart {
    pub part: ContactPart,
    /// From the centre of mass to the collider's frame, in the body's axes.
    pub arm: DVec3,
    /// The rotation of that frame relative to the body; the identity for a ball.
    pub rotation: DQuat,
    pub shape: SharedShape,
    pub form: Form,
    /// An upper bound of the distance of its points from its frame, with the skin; infinite for a half-space.
    pub reach: f64,
    /// About half of its least extent; infinite for a half-space, and for a shape made of pieces, such as a level, that
    /// is not dynamic.
    pub thickness: f64,
    /// Its `contact_skin`: it touches at that distance from its surface.
    pub skin: f64,
    /// Its bounds, if its body stood still during Rapier's step.
    pub bounds: Option<Aabb>,
}

/// The shape of a part, by the method that finds its touches.
#[derive(Clone, Copy, Debug)]
pub(super) enum Form {
    /// Exact against balls and half-spaces. The radius includes the skin.
    Ball { radius: f64 },
    /// Exact against balls while it does not rotate. The normal is in the body's axes.
    Plane { normal: DVec3 },
    /// By Parry.
    Other,
}

/// All bodies and colliders that may touch in a step.
#[derive(Debug, Default)]
pub(super) struct SweptBodies {
    pub list: Vec<SweptBody>,
    pub parts: Vec<SweptPart>,
}

impl SweptBodies {
    /// Collects all bodies and free colliders, with their motion over the last `dt`.
    pub(super) fn gather(
        &mut self,
        touch: &Discrete,
        starts: &Starts,
        world: &impl Lookup,
        dt: f64,
    ) {
        self.list.clear();
        self.parts.clear();
        for (handle, body) in world.bodies() {
            if !body.is_enabled() || body.is_soft_frame() {
                continue;
            }
            let mut first = self.parts.len();
            let start = starts.of(handle, body);
            let still = start.is_still(body);
            // Each part of a level gets its own track, since a level may have many.
            let apart = still && !body.is_dynamic();
            let local_com = to_dvec3(pivot(body));
            let track = || SweptBody::of_body(&start, body, local_com, dt);
            for collider in body.colliders() {
                if let Some(found) = world.collider(*collider) {
                    let part = touch.part_of(*collider, found, Some(handle), body.is_dynamic());
                    let local = local_pose(found);
                    let pose = still.then(|| *body.position() * local);
                    self.add_part(part, found, &local, pose.as_ref(), local_com);
                    if apart {
                        self.add_track(track, first);
                        first = self.parts.len();
                    }
                }
            }
            self.add_track(track, first);
        }
        for (handle, collider) in world.free_colliders() {
            let first = self.parts.len();
            let part = touch.part_of(handle, collider, None, false);
            let pose = collider.position();
            self.add_part(part, collider, pose, Some(pose), DVec3::ZERO);
            self.add_track(SweptBody::free, first);
        }
    }

    fn add_part(
        &mut self,
        part: ContactPart,
        collider: &Collider,
        local: &Pose,
        still_at: Option<&Pose>,
        local_com: DVec3,
    ) {
        if !collider.is_enabled() || collider.is_sensor() {
            return;
        }
        let bounds = still_at.map(|pose| bounds_of(collider, pose));
        let pose = to_dpose3(local);
        // Parry panics at a negative margin.
        let skin = to_f64(collider.contact_skin().max(0.0));
        let shape = collider.shared_shape().clone();
        let (mut rotation, reach, form);
        let mut thickness = f64::INFINITY;
        rotation = pose.rotation;
        if let Some(ball) = shape.as_ball() {
            rotation = DQuat::IDENTITY;
            thickness = to_f64(ball.radius);
            reach = thickness + skin;
            form = Form::Ball { radius: reach };
        } else if let Some(plane) = shape.as_halfspace() {
            let normal = rotation * to_dvec3(plane.normal);
            reach = f64::INFINITY;
            form = Form::Plane { normal };
        } else {
            let bounds = shape.compute_local_bounding_sphere();
            reach = to_f64(bounds.center.length() + bounds.radius) + skin;
            form = Form::Other;
            if part.dynamic || shape.as_composite_shape().is_none() {
                let bounds = shape.compute_local_aabb();
                thickness = to_f64(bounds.half_extents().min_element());
            }
        }
        self.parts.push(SweptPart {
            part,
            arm: pose.translation - local_com,
            rotation,
            shape,
            form,
            reach,
            thickness,
            skin,
            bounds,
        });
    }

    /// Adds a track for the parts from index `first` on, if there are any.
    fn add_track(&mut self, track: impl FnOnce() -> SweptBody, first: usize) {
        let parts = &self.parts[first..];
        if parts.is_empty() {
            return;
        }
        let mut track = track();
        let bounds = parts.iter().filter_map(|member| member.bounds);
        track.still = bounds.reduce(|one, two| one.merged(&two));
        track.parts = first..self.parts.len();
        track.detects = parts.iter().any(|member| member.part.law.is_some());
        let round = |part: &SweptPart| part.is_ball() && part.arm == DVec3::ZERO;
        track.round = parts.iter().all(round);
        track.reach = parts
            .iter()
            .map(|member| member.arm.length() + member.reach)
            .fold(0.0, f64::max);
        self.list.push(track);
    }
}

/// The bounds of a collider at a pose, with the margin within which a gap counts as touching.
fn bounds_of(collider: &Collider, pose: &Pose) -> Aabb {
    let own = collider.shape().compute_aabb(pose);
    let far = own.mins.abs().max(own.maxs.abs()).max_element();
    own.loosened(64.0 * Real::EPSILON * far + collider.contact_skin().max(0.0))
}

impl SweptPart {
    pub(super) fn is_ball(&self) -> bool {
        matches!(self.form, Form::Ball { .. })
    }

    /// Returns true if its shape is made of pieces, such as a mesh.
    pub(super) fn has_pieces(&self) -> bool {
        self.shape.as_composite_shape().is_some()
    }

    /// Its reach; zero for a half-space.
    pub(super) fn finite_reach(&self) -> f64 {
        match self.form {
            Form::Plane { .. } => 0.0,
            Form::Ball { .. } | Form::Other => self.reach,
        }
    }
}
