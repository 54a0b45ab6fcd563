//! Samples from bodies and their colliders.

use super::properties::Properties;
use super::shapes::Shapes;
use super::{Kind, SamplePoint, Samples, Solid, owner};
use crate::compile::{PartSampling, SamplingRequirements};
use crate::field::Sampling;
use crate::math::{
    ColliderSet, DMat3, InteractionGroups, Pose, Real, RigidBodyHandle, RigidBodySet, Vector,
};
use crate::math::{from_f64, to_dpose3, to_dvec3};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Collider;
use crate::rigid::Wrench;

/// What decides which bodies are sampled, and how fast they are taken to move.
pub(crate) struct Gathering<'a> {
    pub book: &'a Properties,
    pub shapes: &'a mut Shapes,
    pub sleepers: bool,
    pub wanted: SamplingRequirements,
    /// Impulses still to come, whose effect on the velocity counts already: see
    /// [`Injector`](super::Injector).
    pub pending: Option<Pending<'a>>,
    /// Samples that are no sites.
    pub several: Vec<SamplePoint>,
}

/// Wrenches of an earlier evaluation, and for how long they still act.
pub(crate) struct Pending<'a> {
    pub bodies: &'a [RigidBodyHandle],
    pub wrenches: &'a [Wrench],
    pub duration: Real,
}

impl Gathering<'_> {
    /// Fills `samples` with those of all bodies that fields can move.
    pub(crate) fn run(
        &mut self,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        samples: &mut Samples,
    ) {
        samples.clear();
        self.book.of_world(samples);
        for (handle, body) in bodies.iter() {
            let sampled = body.is_dynamic() && body.is_enabled() && !body.is_soft_frame();
            if sampled && (self.sleepers || !body.is_sleeping()) {
                self.body(handle, body, colliders, samples);
            }
        }
        samples.sites = samples.list.len();
        samples.list.append(&mut self.several);
        samples.number();
    }

    fn body(
        &mut self,
        handle: RigidBodyHandle,
        body: &RigidBody,
        colliders: &ColliderSet,
        samples: &mut Samples,
    ) {
        let pose = body.position();
        let mass = body.mass();
        let (linvel, angvel) = self.velocity(handle, body);
        let mut centre = SamplePoint {
            // Rapier's own world centre of mass lags behind a body that was just teleported.
            world_point: pose.transform_point(body.local_center_of_mass()),
            arm: Vector::ZERO,
            velocity: linvel,
            body: samples.bodies.len() as u32,
            owner: owner(Some(handle)),
            radius: 0.0,
            mass,
            share: 1.0,
            charge: 0.0,
            volume: 0.0,
            fraction: 1.0,
            spread: 0,
            kind: Kind::Centre,
            is_ball: true,
            groups: InteractionGroups::all(),
            user: 0,
            collider: None,
            at_origin: false,
        };
        let own = self.book.sampling(handle);
        if self.book.any_sampling {
            samples.overrides.push(own);
        }
        if !self.wanted.parts {
            samples.centres.push(centre);
            samples.bodies.push(handle);
            return;
        }
        let first = samples.list.len();
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
            let mut sample = SamplePoint {
                world_point: centre.world_point + arm,
                arm,
                velocity: linvel + angvel.cross(arm),
                radius,
                mass: 0.0,
                groups: collider.collision_groups(),
                collider: Some(*collider_handle),
                at_origin: local_point == Vector::ZERO,
                kind: Kind::Site,
                is_ball: collider.shape().as_ball().is_some(),
                ..centre
            };
            let entry = self.book.get(*collider_handle);
            // A part that is alone has all of the mass; a collider's own takes time to work out.
            sample.mass = match entry.and_then(|entry| entry.properties.mass) {
                _ if body.colliders().len() == 1 => 1.0,
                Some(own_mass) => own_mass,
                None => collider.mass(),
            };
            if let Some(entry) = entry {
                sample.charge = entry.properties.charge;
                if !entry.user.is_empty() {
                    sample.user = samples.user.len() as u32;
                    samples.user.push(entry.user.clone());
                }
            }
            if self.wanted.displaced {
                sample.volume = from_f64(self.shapes.measure(*collider_handle, collider));
            }
            centre.volume += sample.volume;
            centre.charge += sample.charge;
            centre.radius = centre.radius.max(arm.length() + radius);
            samples.list.push(sample);
        }
        if samples.list.len() == first {
            samples.list.push(SamplePoint {
                kind: Kind::Site,
                ..centre
            });
        }
        share_mass(&mut samples.list[first..], mass);
        let wanted = self.wanted.with(own);
        if own == Some(Sampling::Centre) {
            self.several.push(centre);
        }
        if wanted.volume != PartSampling::None || wanted.surface != PartSampling::None {
            for site in first..samples.list.len() {
                self.cut((site, wanted), (body, angvel), colliders, samples);
            }
        }
        samples.centres.push(centre);
        samples.bodies.push(handle);
    }

    /// Adds the samples of a part other than its site.
    fn cut(
        &mut self,
        (number, wanted): (usize, SamplingRequirements),
        (body, angvel): (&RigidBody, Vector),
        colliders: &ColliderSet,
        samples: &mut Samples,
    ) {
        let site = samples.list[number];
        let part = site
            .collider
            .and_then(|handle| Some((handle, colliders.get(handle)?)));
        let kinds = [
            (Kind::Volume, wanted.volume),
            (Kind::Surface, wanted.surface),
        ];
        let wanted_kinds = kinds.into_iter().filter(|(_, cut)| match cut {
            PartSampling::None => false,
            PartSampling::AllButBalls => !site.is_ball,
            PartSampling::All => true,
        });
        let Some((handle, collider)) = part else {
            // Without a shape there is only the one sample, of whatever kind.
            self.several
                .extend(wanted_kinds.map(|(kind, _)| SamplePoint { kind, ..site }));
            return;
        };
        let pose = *body.position();
        let local_pose = collider
            .position_wrt_parent()
            .copied()
            .unwrap_or(Pose::IDENTITY);
        let linvel = site.velocity - angvel.cross(site.arm);
        let centre = site.world_point - site.arm;
        let (middle, _) = middle(collider);
        for (kind, _) in wanted_kinds {
            let rule = match kind {
                Kind::Volume => self.shapes.volume(handle, collider, middle),
                _ => self.shapes.surface(handle, collider, middle),
            };
            let Some(rule) = rule else {
                continue;
            };
            let mut spread = 0;
            if self.wanted.displaced && rule.spread != DMat3::ZERO {
                let turned = DMat3::from_quat(to_dpose3(&(pose * local_pose)).rotation);
                spread = samples.spreads.len() as u32;
                samples
                    .spreads
                    .push(turned * rule.spread * turned.transpose());
            }
            self.several
                .extend(rule.samples.iter().map(|(local_point, fraction)| {
                    let body_point = local_pose.transform_point(*local_point);
                    let arm = pose.rotation * (body_point - body.local_center_of_mass());
                    SamplePoint {
                        world_point: centre + arm,
                        arm,
                        velocity: linvel + angvel.cross(arm),
                        fraction: from_f64(*fraction),
                        spread,
                        kind,
                        at_origin: false,
                        ..site
                    }
                }));
        }
        if wanted.cells
            && let Some(cells) = self.shapes.cells(handle, collider)
        {
            samples.solids.push(Solid {
                body: site.body,
                site: number as u32,
                pose: to_dpose3(&(pose * local_pose)),
                angvel: to_dvec3(angvel),
                cells,
            });
        }
    }

    /// How fast a body is taken to move.
    pub(crate) fn velocity(&self, handle: RigidBodyHandle, body: &RigidBody) -> (Vector, Vector) {
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

/// Divides the mass of a body among its samples, in the ratio of the masses they came with.
fn share_mass(samples: &mut [SamplePoint], mass: Real) {
    let total: Real = samples.iter().map(|sample| sample.mass).sum();
    let count: Real = from_f64(samples.len() as f64);
    for sample in samples {
        let equal = total <= 0.0 || !total.is_finite();
        sample.share = if equal {
            count.recip()
        } else {
            sample.mass / total
        };
        sample.mass = sample.share * mass;
    }
}
