//! Makes samples of bodies and their colliders. Offsets, weights and properties are kept until the data that they
//! were made from change; places and velocities are set before each evaluation.

use super::known_points::{KnownPoints, PointsKey, PointsMap};
use super::part_shape::{Attitude, Bulk, PartShape, PartSolid};
use super::properties::Properties;
use super::samples::LocalSpread;
use super::shapes::Shapes;
use super::{Kind, SamplePoint, Samples, owner};
use crate::compile::{PartSampling, SamplingRequirements};
use crate::field::Points;
use crate::math::{
    ColliderHandle, DMat3, DPose3, DVec3, InteractionGroups, Pose, Real, RigidBodyHandle,
    SharedShape, Vector, to_dquat,
};
use crate::math::{from_f64, to_dpose3, to_dvec3, to_f64};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::geometry::Collider;
use crate::rigid::{Body, Lookup, PrincipalInertia, find_next, local_pose};

/// Makes samples, and keeps the data that they were made from, so that changes are noticed.
#[derive(Debug, Default)]
pub(crate) struct Gatherer {
    shapes: Shapes,
    /// The requirements of the last call, and the number of changes of the properties until then.
    made_for: Option<(SamplingRequirements, u64)>,
    bodies: Vec<BodyStamp>,
    parts: Vec<PartStamp>,
    /// The columns of points that were made for parts of other bodies.
    columns: PointsMap,
    /// The indices, in order, of the bodies in the last call that are new or have other parts than in the call before.
    pub(crate) changed: Vec<usize>,
}

/// The state of a body that its samples were made from.
#[derive(Debug)]
struct BodyStamp {
    body: RigidBodyHandle,
    /// This and the next two change with the masses of its parts, which take longer to compute.
    mass: Real,
    local_com: Vector,
    principal_inertia: PrincipalInertia,
    /// The end of its parts in the list of all.
    end: usize,
}

/// The state of a collider that its samples were made from.
#[derive(Debug)]
struct PartStamp {
    collider: ColliderHandle,
    /// Held so that Rapier copies the shape before a change, and the changed shape has another address.
    shape: Option<SharedShape>,
    local_pose: Pose,
    groups: InteractionGroups,
    is_sampled: bool,
}

impl PartStamp {
    fn of(handle: ColliderHandle, collider: Option<&Collider>) -> Self {
        PartStamp {
            collider: handle,
            shape: collider.map(|collider| collider.shared_shape().clone()),
            local_pose: collider.map_or(Pose::IDENTITY, local_pose),
            groups: collider.map_or(InteractionGroups::all(), Collider::collision_groups),
            is_sampled: collider.is_some_and(is_sampled),
        }
    }

    fn still_holds(&self, handle: ColliderHandle, collider: Option<&Collider>) -> bool {
        let Some(collider) = collider else {
            return self.collider == handle && self.shape.is_none();
        };
        let shape = self.shape.as_ref();
        let same = |shape: &SharedShape| std::ptr::addr_eq(&*shape.0, &*collider.shared_shape().0);
        self.collider == handle
            && shape.is_some_and(same)
            && self.local_pose == local_pose(collider)
            && self.groups == collider.collision_groups()
            && self.is_sampled == is_sampled(collider)
    }
}

fn is_sampled(collider: &Collider) -> bool {
    collider.is_enabled() && !collider.is_sensor()
}

impl Gatherer {
    /// Brings `samples` up to date with some bodies, in the order of their handles. With `known`, the parts of the
    /// bodies are taken to be unchanged since the last call. Returns true if anything but places and velocities has
    /// changed since then.
    pub(crate) fn gather(
        &mut self,
        samples: &mut Samples,
        properties: &Properties,
        requirements: SamplingRequirements,
        bodies: &[Body],
        known: bool,
        world: &impl Lookup,
    ) -> bool {
        let made_for = Some((requirements, properties.changes));
        let before = std::mem::replace(&mut self.made_for, made_for);
        let by_parts = requirements.parts && !known;
        self.changed.clear();
        if before == made_for && self.still_holds(bodies, by_parts, world) {
            return false;
        }
        let mut at = 0;
        for (place, body) in bodies.iter().enumerate() {
            let stamp = find_next(&self.bodies, &mut at, body.handle, |it| it.body);
            let is_known = before == made_for && stamp.is_some();
            if !(is_known && self.holds(at, body, requirements.parts, world)) {
                self.changed.push(place);
            }
        }
        self.make(samples, properties, requirements, bodies, world);
        before.is_some()
    }

    /// A gatherer that has the samples of the same shapes, for a question between steps.
    pub(crate) fn share_shapes(&self) -> Self {
        Gatherer {
            shapes: self.shapes.share(),
            ..Gatherer::default()
        }
    }

    /// Makes samples of some bodies besides those that are kept up to date.
    pub(crate) fn make_besides(
        &mut self,
        samples: &mut Samples,
        properties: &Properties,
        requirements: SamplingRequirements,
        bodies: &[Body],
        world: &impl Lookup,
    ) {
        let mut other = Gatherer {
            shapes: std::mem::take(&mut self.shapes),
            ..Gatherer::default()
        };
        other.make(samples, properties, requirements, bodies, world);
        self.shapes = other.shapes;
    }

    /// A bound of the distance of a body's colliders from its centre of mass.
    pub(crate) fn extent(&mut self, body: &RigidBody, world: &impl Lookup) -> Real {
        let mut extent: Real = 0.0;
        for handle in body.colliders() {
            let Some(collider) = world.collider(*handle) else {
                continue;
            };
            let (point, radius) = match collider.shape().as_ball() {
                Some(ball) => (Vector::ZERO, ball.radius),
                None => self.shapes.bounding_ball(*handle, collider),
            };
            let point = local_pose(collider).transform_point(point);
            extent = extent.max((point - body.local_center_of_mass()).length() + radius);
        }
        extent
    }

    fn still_holds(&self, bodies: &[Body], by_parts: bool, world: &impl Lookup) -> bool {
        let holds = |(place, body)| self.holds(place, body, by_parts, world);
        self.bodies.len() == bodies.len() && bodies.iter().enumerate().all(holds)
    }

    /// Returns true if the body at a place, with `by_parts` also its colliders, is as when its samples were made.
    fn holds(&self, place: usize, body: &Body, by_parts: bool, world: &impl Lookup) -> bool {
        let stamp = &self.bodies[place];
        let same = stamp.body == body.handle
            && stamp.mass == body.mass
            && stamp.local_com == body.local_com
            && stamp.principal_inertia == body.principal_inertia;
        if !(same && by_parts) {
            return same;
        }
        let start = place.checked_sub(1).map_or(0, |last| self.bodies[last].end);
        let parts = &self.parts[start..stamp.end];
        let found = world.body(body.handle);
        let handles = found.map_or(&[][..], |it| it.colliders());
        let mut pairs = parts.iter().zip(handles);
        handles.len() == parts.len()
            && pairs.all(|(part, handle)| part.still_holds(*handle, world.collider(*handle)))
    }

    /// Makes `samples` of some bodies anew.
    pub(crate) fn make(
        &mut self,
        samples: &mut Samples,
        properties: &Properties,
        requirements: SamplingRequirements,
        bodies: &[Body],
        world: &impl Lookup,
    ) {
        samples.clear();
        self.bodies.clear();
        self.parts.clear();
        self.columns.clear();
        properties.of_world(samples);
        for body in bodies {
            let mut making = Making {
                properties,
                shapes: &mut self.shapes,
                requirements,
                columns: &mut self.columns,
                parts: &mut self.parts,
                samples,
            };
            making.body(body, world);
            self.bodies.push(BodyStamp {
                body: body.handle,
                mass: body.mass,
                local_com: body.local_com,
                principal_inertia: body.principal_inertia,
                end: self.parts.len(),
            });
        }
        samples.apart = requirements.apart;
        samples.number();
    }
}

/// The samples that are being made, and the data for it.
struct Making<'a> {
    properties: &'a Properties,
    shapes: &'a mut Shapes,
    requirements: SamplingRequirements,
    columns: &'a mut PointsMap,
    parts: &'a mut Vec<PartStamp>,
    samples: &'a mut Samples,
}

impl Making<'_> {
    fn body(&mut self, body: &Body, world: &impl Lookup) {
        let samples = &mut *self.samples;
        let mut centre =
            SamplePoint::at_rest(samples.bodies.len() as u32, owner(Some(body.handle)));
        centre.mass = body.mass;
        let own = self.properties.sampling(body.handle);
        if self.properties.any_sampling() {
            samples.overrides.push(own);
        }
        if !self.requirements.parts {
            samples.centres.push(centre);
            samples.bodies.push(body.handle);
            return;
        }
        let first = samples.sites.len();
        let found = world.body(body.handle);
        let handles = found.map_or(&[][..], |it| it.colliders());
        let alone = handles.len() == 1;
        for handle in handles {
            let collider = world.collider(*handle);
            self.parts.push(PartStamp::of(*handle, collider));
            if let Some(collider) = collider.filter(|collider| is_sampled(collider)) {
                self.part(body, &mut centre, *handle, collider, alone);
            }
        }
        let samples = &mut *self.samples;
        if samples.sites.len() == first {
            samples.sites.push(SamplePoint {
                kind: Kind::Site,
                ..centre
            });
        }
        share_mass(&mut samples.sites[first..], body.mass);
        if self.requirements.pieces {
            self.shape_parts(first, body, world);
        }
        if self.requirements.pieces || self.requires_runs() {
            self.samples.attitudes.push(Attitude {
                rotation: to_dquat(body.pose.rotation),
                angvel: body.angvel,
            });
        }
        let wanted = self.requirements.with(own);
        if wanted.apart {
            let samples = &mut *self.samples;
            let columns = samples.clouds.centre();
            for site in &samples.sites[first..] {
                let copy = SamplePoint {
                    kind: Kind::Centre,
                    local_arm: Vector::ZERO,
                    at_origin: false,
                    ..*site
                };
                samples.clouds.add(copy, columns);
            }
        }
        if wanted.has_many() {
            for site in first..self.samples.sites.len() {
                self.cut(site, wanted, body, world);
            }
        }
        self.samples.centres.push(centre);
        self.samples.bodies.push(body.handle);
    }

    /// Returns true if any part may have samples besides its site.
    fn requires_runs(&self) -> bool {
        let SamplingRequirements { apart, .. } = self.requirements;
        apart || self.requirements.has_many() || self.properties.any_sampling()
    }

    /// Adds the site of a collider, and adds its properties to those of the body as a whole.
    fn part(
        &mut self,
        body: &Body,
        centre: &mut SamplePoint,
        handle: ColliderHandle,
        collider: &Collider,
        alone: bool,
    ) {
        let (local_point, radius) = self.shapes.middle(handle, collider);
        let local_arm = local_pose(collider).transform_point(local_point) - body.local_com;
        let mut sample = SamplePoint {
            local_arm,
            radius,
            mass: 0.0,
            groups: collider.collision_groups(),
            collider: Some(handle),
            at_origin: local_point == Vector::ZERO,
            kind: Kind::Site,
            is_ball: collider.shape().as_ball().is_some(),
            ..*centre
        };
        let entry = self.properties.get(handle);
        sample.mass = match entry.and_then(|entry| entry.properties.mass) {
            // A single part has all of the mass, and the mass of a collider takes longer to compute.
            _ if alone => 1.0,
            Some(own_mass) => own_mass,
            None => collider.mass(),
        };
        if let Some(entry) = entry {
            sample.charge = entry.properties.charge;
            if !entry.user.is_empty() {
                sample.user = self.samples.user.len() as u32;
                self.samples.user.push(entry.user.clone());
            }
        }
        if self.requirements.displaced {
            sample.volume = from_f64(self.shapes.measure(handle, collider));
        }
        centre.volume += sample.volume;
        centre.charge += sample.charge;
        centre.radius = centre.radius.max(local_arm.length() + radius);
        self.samples.sites.push(sample);
    }

    /// Adds the shapes of the sites of a body, from number `first` on, and the [`Bulk`] of the body.
    fn shape_parts(&mut self, first: usize, body: &Body, world: &impl Lookup) {
        let samples = &mut *self.samples;
        let (mut extent, mut middle) = (0.0_f64, DVec3::ZERO);
        for site in &samples.sites[first..] {
            let part = site.collider.and_then(|handle| {
                let collider = world.collider(handle)?;
                let solid = self.shapes.solid(handle, collider);
                let solid = Some(solid).filter(|solid| !matches!(solid, PartSolid::Point))?;
                Some((to_dpose3(&local_pose(collider)), solid))
            });
            let shape = match part {
                Some((mut local_pose, solid)) => {
                    local_pose.translation -= to_dvec3(body.local_com);
                    PartShape { local_pose, solid }
                }
                None => PartShape {
                    local_pose: DPose3::from_translation(to_dvec3(site.local_arm)),
                    solid: PartSolid::Point,
                },
            };
            let centre = shape.local_pose.transform_point(shape.solid.centre());
            extent = extent.max(centre.length() + shape.solid.extent());
            middle += centre * to_f64(site.share);
            samples.shapes.push(shape);
        }
        samples.bulks.push(Bulk { extent, middle });
    }

    /// Adds the runs of a part.
    fn cut(
        &mut self,
        number: usize,
        wanted: SamplingRequirements,
        body: &Body,
        world: &impl Lookup,
    ) {
        let site = self.samples.sites[number];
        let part = site
            .collider
            .and_then(|handle| Some((handle, world.collider(handle)?)));
        let is_wanted = |points: &Points| match wanted.several[*points as usize] {
            PartSampling::None => false,
            PartSampling::AllButBalls => !site.is_ball,
            PartSampling::All => true,
        };
        let wanted = Points::ALL.into_iter().filter(is_wanted);
        let Some((handle, collider)) = part else {
            // Without a shape there is one sample, which stands for each kind.
            let clouds = &mut self.samples.clouds;
            let point = (site.local_arm.to_array(), site.fraction);
            let columns = clouds.add_columns([point].into_iter());
            for kind in wanted.map(Kind::Several) {
                clouds.add(SamplePoint { kind, ..site }, columns);
            }
            return;
        };
        let local_pose = local_pose(collider);
        let (middle, _) = self.shapes.middle(handle, collider);
        for points in wanted {
            let rule = self.shapes.rule(handle, collider, points, middle);
            let kind = Kind::Several(points);
            let mut spread = 0;
            if self.requirements.displaced && rule.spread != DMat3::ZERO {
                spread = self.samples.add_spread(LocalSpread {
                    body: site.body,
                    rotation: to_dquat(local_pose.rotation),
                    moments: rule.spread,
                });
            }
            let whole = SamplePoint {
                spread,
                kind,
                at_origin: false,
                ..site
            };
            let clouds = &mut self.samples.clouds;
            let key = PointsKey::new(&rule, &local_pose, body.local_com);
            let known = self.columns.entry(key).or_insert_with(|| {
                let points = rule.samples.iter().map(|(local_point, fraction)| {
                    let arm = local_pose.transform_point(*local_point) - body.local_com;
                    (arm.to_array(), from_f64(*fraction))
                });
                let columns = clouds.add_columns(points);
                KnownPoints { rule, columns }
            });
            clouds.add(whole, known.columns);
        }
    }
}

/// Divides the mass of a body among its samples, in the ratio of their own masses; equally, if the sum of these is
/// not positive and finite.
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
