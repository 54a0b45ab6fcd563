//! Discrete detection: overlaps at the end of a step, between all pairs of which one side has a detection field.

use std::collections::HashMap;
use std::ops::Range;

use super::approach::{PointMotion, approach_speed};
use super::field_contact::{ContactPart, FieldContact};
use super::laws::LawTable;
use super::near_pairs::{NearPairs, Place};
use super::overlap::{ManifoldPoint, OverlapPoint, PlacedBall, PlacedShape};
use super::resting::{HeldPairs, StillPoints};
use super::rules::in_order;
use super::separation::Separations;
use super::starts::Starts;
use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Pose, Real, RigidBodyHandle, Vector};
use crate::rapier::geometry::Collider;
use crate::rapier::parry::bounding_volume::BoundingVolume;
use crate::rigid::{Lookup, local_pose};

/// All colliders that may touch, at their present poses, and the caches that find their pairs.
#[derive(Debug)]
pub(super) struct Discrete {
    /// Indices into `Compiled::detectors`, by collider.
    detectors: HashMap<ColliderHandle, Vec<u32>>,
    laws: LawTable,
    solids: Vec<SolidPart>,
    /// By the index of a collider: the index of its solid.
    number_of: Vec<u32>,
    balls: Vec<Ball>,
    clusters: Vec<BallCluster>,
    /// The solids, followed by the clusters.
    places: Vec<Place>,
    near: NearPairs,
    /// A buffer for the contact points of a pair.
    points: Vec<ManifoldPoint>,
    /// By solid: true if it has not changed since the previous [`Discrete::gather`].
    still: Vec<bool>,
    known: KnownPairs,
    /// The balls and solids of the previous [`Discrete::gather`].
    last: (Vec<Ball>, Vec<SolidPart>),
}

/// Caches for pairs of solids, kept from step to step.
#[derive(Debug, Default)]
struct KnownPairs {
    apart: Separations,
    still: StillPoints,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Ball {
    part: ContactPart,
    placed: PlacedBall,
}

/// The balls of a body, or a ball without a body.
#[derive(Debug)]
struct BallCluster {
    balls: Range<usize>,
    place: Place,
}

/// A collider of any shape but a ball.
#[derive(Debug, PartialEq)]
struct SolidPart {
    part: ContactPart,
    placed: PlacedShape,
}

impl SolidPart {
    /// The points at which it is near another solid; none if the two are known to be apart.
    fn search(&self, other: &SolidPart, apart: &mut Separations) -> Vec<ManifoldPoint> {
        let pair = [self.part.collider, other.part.collider];
        if self.placed.is_apart(&other.placed, pair, apart) {
            return Vec::new();
        }
        self.placed.near(&other.placed)
    }
}

/// The contacts found, each with the range of its points in `points`.
#[derive(Debug, Default)]
pub(super) struct FoundContacts {
    pub contacts: Vec<(FieldContact, Range<usize>)>,
    pub points: Vec<OverlapPoint>,
    /// True if no point was taken over from Rapier's manifolds.
    pub anew: bool,
}

impl FoundContacts {
    /// Returns true if at any contact point two parts approach fast enough that it may be an impact. The limit is half
    /// the [resting threshold](Starts::resting_speed), which leaves room for rounding and for accelerations within the step.
    pub(super) fn is_hit(&self, world: &impl Lookup, starts: &Starts) -> bool {
        self.contacts.iter().any(|(contact, points)| {
            let law = contact.law;
            let motions = PointMotion::of_sides(contact, world, starts);
            if law == ContactLaw::Observe || motions.iter().all(PointMotion::is_still) {
                return false;
            }
            let lags = contact.bodies.map(|body| starts.behind(body));
            let resting_speed = 0.5 * starts.resting_speed(law, contact.bodies);
            let fast = |point: &OverlapPoint| {
                let [one, two] = [0, 1].map(|it| motions[it].at(point.world_point) + lags[it]);
                (one - two).dot(point.world_normal) >= resting_speed
            };
            self.points[points.clone()].iter().any(fast)
        })
    }
}

impl Discrete {
    pub(super) fn new(compiled: &Compiled) -> Self {
        let mut detectors: HashMap<ColliderHandle, Vec<u32>> = HashMap::new();
        for (number, detector) in compiled.detectors.iter().enumerate() {
            let numbers = detectors.entry(detector.collider).or_default();
            numbers.push(number as u32);
        }
        Discrete {
            detectors,
            laws: LawTable::new(compiled),
            solids: Vec::new(),
            number_of: Vec::new(),
            balls: Vec::new(),
            clusters: Vec::new(),
            places: Vec::new(),
            near: NearPairs::default(),
            points: Vec::new(),
            still: Vec::new(),
            known: KnownPairs::default(),
            last: Default::default(),
        }
    }

    /// Indices into `Compiled::detectors` of the detection fields of a collider.
    pub(super) fn detectors_of(&self, collider: ColliderHandle) -> &[u32] {
        self.detectors.get(&collider).map_or(&[], Vec::as_slice)
    }

    /// A collider as a contact part, with its law.
    pub(super) fn part_of(
        &self,
        handle: ColliderHandle,
        collider: &Collider,
        body: Option<RigidBodyHandle>,
        dynamic: bool,
    ) -> ContactPart {
        ContactPart {
            collider: handle,
            body,
            dynamic,
            law: self.laws.of(handle),
            groups: collider.collision_groups(),
        }
    }

    /// Collects all enabled colliders that are no sensors, at their present poses. Returns true if any of them differs
    /// from the previous call. `dt` is the length of a step.
    pub(super) fn gather(&mut self, world: &impl Lookup, dt: Real) -> bool {
        std::mem::swap(&mut self.balls, &mut self.last.0);
        std::mem::swap(&mut self.solids, &mut self.last.1);
        self.balls.clear();
        self.clusters.clear();
        self.solids.clear();
        self.places.clear();
        for (handle, body) in world.bodies().filter(|(_, body)| body.is_enabled()) {
            let start = self.balls.len();
            let (owner, dynamic) = (Some(handle), body.is_dynamic());
            let way = body.linvel() * dt;
            for handle in body.colliders() {
                if let Some(collider) = world.collider(*handle) {
                    let pose = *body.position() * local_pose(collider);
                    let part = self.part_of(*handle, collider, owner, dynamic);
                    self.part(part, collider, pose, way);
                }
            }
            self.cluster(start, way);
        }
        for (handle, collider) in world.free_colliders() {
            let start = self.balls.len();
            let part = self.part_of(handle, collider, None, false);
            self.part(part, collider, *collider.position(), Vector::ZERO);
            self.cluster(start, Vector::ZERO);
        }
        let clusters = self.clusters.iter().map(|cluster| cluster.place);
        self.places.extend(clusters);
        let before = &self.last.1;
        let still = self.solids.iter().enumerate();
        let still = still.map(|(number, solid)| before.get(number) == Some(solid));
        self.still.clear();
        self.still.extend(still);
        let alike = before.len() == self.solids.len() && self.still.iter().all(|still| *still);
        !alike || self.balls != self.last.0
    }

    fn part(&mut self, part: ContactPart, collider: &Collider, pose: Pose, way: Vector) {
        if !collider.is_enabled() || collider.is_sensor() {
            return;
        }
        // Parry panics at a negative margin.
        let skin = collider.contact_skin().max(0.0);
        if let Some(ball) = collider.shape().as_ball() {
            let placed = PlacedBall {
                centre: pose.translation,
                radius: ball.radius + skin,
            };
            self.balls.push(Ball { part, placed });
        } else {
            let shape = collider.shared_shape().clone();
            let index = part.collider.into_raw_parts().0 as usize;
            self.number_of
                .resize(self.number_of.len().max(index + 1), 0);
            self.number_of[index] = self.solids.len() as u32;
            self.places.push(Place {
                bounds: shape.compute_aabb(&pose).loosened(skin),
                way,
                dynamic: part.dynamic,
                // Parry gives a half-space bounds as large as the number type allows.
                bounded: shape.as_halfspace().is_none(),
            });
            let placed = PlacedShape { pose, shape, skin };
            self.solids.push(SolidPart { part, placed });
        }
    }

    /// Makes a cluster of the balls from index `start` on, if there are any.
    fn cluster(&mut self, start: usize, way: Vector) {
        let balls = &self.balls[start..];
        let bounds = balls.iter().map(|ball| ball.placed.bounds());
        let Some(bounds) = bounds.reduce(|one, other| one.merged(&other)) else {
            return;
        };
        let place = Place {
            bounds,
            way,
            dynamic: balls[0].part.dynamic,
            bounded: true,
        };
        let balls = start..self.balls.len();
        self.clusters.push(BallCluster { balls, place });
    }

    /// The index of the solid of a collider.
    fn solid_of(&self, collider: ColliderHandle) -> Option<u32> {
        let index = collider.into_raw_parts().0 as usize;
        let number = *self.number_of.get(index)?;
        let solid = self.solids.get(number as usize)?;
        (solid.part.collider == collider).then_some(number)
    }

    /// Finds all overlaps in which at least one side has a detection field. For pairs `held` by Rapier's solver the
    /// points of its manifolds may be reused.
    pub(super) fn find(
        &mut self,
        world: &impl Lookup,
        starts: &Starts,
        held: Option<HeldPairs<'_>>,
        found: &mut FoundContacts,
    ) {
        found.contacts.clear();
        found.points.clear();
        let held = held.filter(|held| !held.pairs.is_empty());
        found.anew = held.is_none();
        self.near.refresh(&self.places);
        let mut finder = Finder {
            world,
            starts,
            found,
        };
        let mut known = std::mem::take(&mut self.known);
        known.apart.turn();
        known.still.turn();
        if let Some(held) = held {
            self.take_over(held, &mut known.apart, &mut finder);
        }
        for numbers in &self.near.list {
            let [a, b] = numbers.map(|number| &self.places[number as usize]);
            if b.bounded && !a.bounds.intersects(&b.bounds) {
                continue;
            }
            match numbers.map(|number| self.cluster_at(number)) {
                [Some(one), Some(two)] => between(one, two, &mut finder),
                [Some(balls), None] => self.touch_balls(balls, numbers[1], &mut finder),
                [None, Some(balls)] => self.touch_balls(balls, numbers[0], &mut finder),
                [None, None] => self.touch_solids(*numbers, held, &mut known, &mut finder),
            }
        }
        self.known = known;
    }

    /// Adds the contact of two solids, unless it was taken over from Rapier's solver.
    fn touch_solids(
        &self,
        numbers: [u32; 2],
        held: Option<HeldPairs<'_>>,
        known: &mut KnownPairs,
        finder: &mut Finder<'_, impl Lookup>,
    ) {
        let [one, two] = self.ordered(numbers);
        let stands = self.stands(numbers);
        let pair = [one, two].map(|solid| solid.part.collider);
        if !stands && held.is_some_and(|held| held.pairs.contains(&in_order(pair))) {
            return;
        }
        finder.pair(&one.part, &two.part, |points| {
            let mut search = || one.search(two, &mut known.apart);
            if stands {
                let near = known.still.near(pair, search);
                one.placed.place(&two.placed, near, points);
            } else {
                one.placed.place(&two.placed, &search(), points);
            }
        });
    }

    /// The balls of the cluster at a place; `None` if that is a solid.
    fn cluster_at(&self, number: u32) -> Option<&[Ball]> {
        let number = (number as usize).checked_sub(self.solids.len())?;
        Some(&self.balls[self.clusters[number].balls.clone()])
    }

    /// Adds the contacts between balls and a solid.
    fn touch_balls(&self, balls: &[Ball], number: u32, finder: &mut Finder<'_, impl Lookup>) {
        let place = &self.places[number as usize];
        let solid = &self.solids[number as usize];
        for ball in balls {
            if !place.bounded || place.bounds.intersects(&ball.placed.bounds()) {
                finder.pair(&solid.part, &ball.part, |points| {
                    solid.placed.overlaps_ball(&ball.placed, points);
                });
            }
        }
    }

    /// Adds the contacts of solids that Rapier's solver holds, from the points of its manifolds where these are still
    /// valid.
    fn take_over(
        &mut self,
        held: HeldPairs<'_>,
        apart: &mut Separations,
        finder: &mut Finder<'_, impl Lookup>,
    ) {
        let mut near = std::mem::take(&mut self.points);
        for found in held.found() {
            let numbers = [found.collider1, found.collider2].map(|it| self.solid_of(it));
            let [Some(a), Some(b)] = numbers else {
                continue;
            };
            if self.stands([a, b]) {
                continue;
            }
            let [one, two] = self.ordered([a.min(b), a.max(b)]);
            finder.pair(&one.part, &two.part, |points| {
                let size = |number: u32| {
                    let bounds = &self.places[number as usize].bounds;
                    bounds.half_extents().length()
                };
                let size = size(a).min(size(b));
                let relative = one.placed.pose.inv_mul(&two.placed.pose);
                let swapped = found.collider1 != one.part.collider;
                if !held.near(found, swapped, &relative, size, &mut near) {
                    near = one.search(two, apart);
                }
                one.placed.place(&two.placed, &near, points);
            });
        }
        self.points = near;
    }

    /// Two solids; one without bounds comes first.
    fn ordered(&self, pair: [u32; 2]) -> [&SolidPart; 2] {
        let [one, two] = pair.map(|number| &self.solids[number as usize]);
        if self.places[pair[1] as usize].bounded {
            [one, two]
        } else {
            [two, one]
        }
    }

    /// Returns true if two solids have not changed since the previous [`Discrete::gather`].
    fn stands(&self, pair: [u32; 2]) -> bool {
        pair.iter().all(|number| self.still[*number as usize])
    }
}

/// Adds the contacts between the balls of two clusters.
fn between(one: &[Ball], two: &[Ball], finder: &mut Finder<'_, impl Lookup>) {
    for ball in one {
        for other in two {
            finder.pair(&ball.part, &other.part, |points| {
                points.extend(ball.placed.overlap(&other.placed));
            });
        }
    }
}

/// Tests pairs of parts, and records their contacts.
struct Finder<'a, W> {
    world: &'a W,
    starts: &'a Starts,
    found: &'a mut FoundContacts,
}

impl<W: Lookup> Finder<'_, W> {
    /// Records a contact if two parts may touch, one of them has a detection field, and `overlaps` finds points. The
    /// deepest point becomes the contact's own.
    fn pair(
        &mut self,
        one: &ContactPart,
        two: &ContactPart,
        overlaps: impl FnOnce(&mut Vec<OverlapPoint>),
    ) {
        let detects = one.law.is_some() || two.law.is_some();
        if !detects || !one.may_touch(two) {
            return;
        }
        let points = &mut self.found.points;
        let start = points.len();
        overlaps(points);
        let deeper = |a: &OverlapPoint, b: &OverlapPoint| if b.depth > a.depth { *b } else { *a };
        let Some(deepest) = points[start..]
            .iter()
            .copied()
            .reduce(|a, b| deeper(&a, &b))
        else {
            return;
        };
        let (point, normal) = (deepest.world_point, deepest.world_normal);
        let mut contact = FieldContact::new([one, two], point, normal, deepest.depth);
        if contact.colliders[0] != one.collider {
            for point in &mut points[start..] {
                *point = point.flipped();
            }
        }
        contact.approach_speed = approach_speed(&contact, self.world, self.starts);
        let range = start..self.found.points.len();
        self.found.contacts.push((contact, range));
    }
}
