//! Overlap at the end of a step, of all pairs of which one side has a detection field.

use std::collections::HashMap;
use std::ops::Range;

use super::field_contact::{FieldContact, Part};
use super::laws::Laws;
use super::overlap::{OverlapPoint, PlacedBall, PlacedShape};
use super::resting::{HeldPairs, HeldPart, StillPoints};
use super::separation::Separations;
use super::starts::Starts;
use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Pose, Real, RigidBodyHandle, Vector};
use crate::neighbors::{Cluster, VerletList, hierarchy};
use crate::rapier::geometry::{Aabb, Collider};
use crate::rapier::parry::bounding_volume::BoundingVolume;
use crate::rapier::parry::partitioning::{Bvh, BvhWorkspace};
use crate::rigid::Lookup;

/// Everything that may touch, at its present place.
#[derive(Debug)]
pub(super) struct Discrete {
    /// Numbers of the detection fields of each collider.
    detectors: HashMap<ColliderHandle, Vec<u32>>,
    laws: Laws,
    /// Those of one body stand together.
    balls: Vec<Ball>,
    clusters: Vec<Cluster>,
    list: VerletList,
    solids: Vec<Solid>,
    /// The bounded solids, by their number, and the numbers of the others.
    tree: Bvh,
    unbounded: Vec<u32>,
    /// Whether each solid is as it was the time before.
    still: Vec<bool>,
    still_points: StillPoints,
    separations: Separations,
    /// The balls and solids of the time before.
    last: (Vec<Ball>, Vec<Solid>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Ball {
    part: Part,
    placed: PlacedBall,
}

/// Another shape.
#[derive(Debug, PartialEq)]
struct Solid {
    part: Part,
    placed: PlacedShape,
    bounds: Aabb,
}

impl Solid {
    /// Where it was when Rapier's step began, and is.
    fn since(&self, world: &impl Lookup, starts: &Starts) -> HeldPart {
        let now = self.placed.pose;
        let start = self.part.body.and_then(|handle| {
            let body = world.body(handle)?;
            let local = body.position().inv_mul(&now);
            Some(starts.of(handle, body).pose * local)
        });
        HeldPart {
            poses: [start.unwrap_or(now), now],
            size: self.bounds.half_extents().length(),
        }
    }
}

/// The contacts found, each with where it is among the points, and all points.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub contacts: Vec<(FieldContact, Range<usize>)>,
    pub points: Vec<OverlapPoint>,
    /// Whether no point was taken from Rapier.
    pub anew: bool,
}

impl Found {
    /// Whether at any contact two parts approach fast enough that it may be an impact: half as fast
    /// as what does not last, which leaves room for rounding and for what presses them.
    pub(super) fn is_hit(&self, world: &impl Lookup, starts: &Starts) -> bool {
        self.contacts.iter().any(|(contact, points)| {
            let law = contact.law;
            let motions = contact.bodies.map(|body| PointMotion::of(body, world));
            if law == ContactLaw::Observe || motions.iter().all(PointMotion::is_still) {
                return false;
            }
            let lags = contact.bodies.map(|body| starts.behind(body));
            let slow = 0.5 * starts.slow(law, contact.bodies);
            let fast = |point: &OverlapPoint| {
                let [one, two] = [0, 1].map(|it| motions[it].at(point.world_point) + lags[it]);
                (one - two).dot(point.world_normal) >= slow
            };
            self.points[points.clone()].iter().any(fast)
        })
    }
}

/// How the points of a body move; what has no body stands still.
#[derive(Clone, Copy, Default)]
struct PointMotion {
    com: Vector,
    linvel: Vector,
    angvel: Vector,
}

impl PointMotion {
    fn of(body: Option<RigidBodyHandle>, world: &impl Lookup) -> Self {
        let body = body.and_then(|body| world.body(body));
        body.map_or(PointMotion::default(), |body| PointMotion {
            com: body.center_of_mass(),
            linvel: body.linvel(),
            angvel: body.angvel(),
        })
    }

    fn is_still(&self) -> bool {
        self.linvel == Vector::ZERO && self.angvel == Vector::ZERO
    }

    fn at(&self, world_point: Vector) -> Vector {
        self.linvel + self.angvel.cross(world_point - self.com)
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
            laws: Laws::new(compiled),
            balls: Vec::new(),
            clusters: Vec::new(),
            list: VerletList::default(),
            solids: Vec::new(),
            tree: Bvh::new(),
            unbounded: Vec::new(),
            still: Vec::new(),
            still_points: StillPoints::default(),
            separations: Separations::default(),
            last: Default::default(),
        }
    }

    /// Numbers of the detection fields of a collider.
    pub(super) fn detectors_of(&self, collider: ColliderHandle) -> &[u32] {
        self.detectors.get(&collider).map_or(&[], Vec::as_slice)
    }

    /// A collider, with its law.
    pub(super) fn part_of(
        &self,
        handle: ColliderHandle,
        collider: &Collider,
        (body, dynamic): (Option<RigidBodyHandle>, bool),
    ) -> Part {
        Part {
            collider: handle,
            body,
            dynamic,
            law: self.laws.of(handle),
            groups: collider.collision_groups(),
        }
    }

    /// Takes up all colliders that can touch or be touched; returns whether any is not where it
    /// was when this was called last.
    pub(super) fn gather(&mut self, world: &impl Lookup) -> bool {
        std::mem::swap(&mut self.balls, &mut self.last.0);
        std::mem::swap(&mut self.solids, &mut self.last.1);
        self.balls.clear();
        self.clusters.clear();
        self.solids.clear();
        for (handle, body) in world.bodies().filter(|(_, body)| body.is_enabled()) {
            let start = self.balls.len() as u32;
            let owner = (Some(handle), body.is_dynamic());
            for handle in body.colliders() {
                if let Some(collider) = world.collider(*handle) {
                    let local_pose = collider.position_wrt_parent();
                    let pose = *body.position() * local_pose.copied().unwrap_or(Pose::IDENTITY);
                    self.part(self.part_of(*handle, collider, owner), collider, pose);
                }
            }
            self.cluster(start);
        }
        for (handle, collider) in world.free_colliders() {
            let start = self.balls.len() as u32;
            let part = self.part_of(handle, collider, (None, false));
            self.part(part, collider, *collider.position());
            self.cluster(start);
        }
        let before = &self.last.1;
        let still = self.solids.iter().enumerate();
        let still = still.map(|(number, solid)| before.get(number) == Some(solid));
        self.still.clear();
        self.still.extend(still);
        let alike = before.len() == self.solids.len() && self.still.iter().all(|still| *still);
        let moved = !alike || self.balls != self.last.0;
        if moved {
            self.arrange();
        }
        moved
    }

    fn part(&mut self, part: Part, collider: &Collider, pose: Pose) {
        if !collider.is_enabled() || collider.is_sensor() {
            return;
        }
        // Parry panics at what is negative.
        let skin = collider.contact_skin().max(0.0);
        if let Some(ball) = collider.shape().as_ball() {
            let placed = PlacedBall {
                centre: pose.translation,
                radius: ball.radius + skin,
            };
            self.balls.push(Ball { part, placed });
        } else {
            let shape = collider.shared_shape().clone();
            self.solids.push(Solid {
                part,
                bounds: shape.compute_aabb(&pose).loosened(skin),
                placed: PlacedShape { pose, shape, skin },
            });
        }
    }

    /// Makes a cluster of the balls from `start` on.
    fn cluster(&mut self, start: u32) {
        let balls = &self.balls[start as usize..];
        let Some(first) = balls.first().map(|ball| ball.placed.centre) else {
            return;
        };
        let sum = balls
            .iter()
            .fold(Vector::ZERO, |sum, ball| sum + (ball.placed.centre - first));
        let centre = first + sum / balls.len() as Real;
        let reach = |ball: &Ball| (ball.placed.centre - centre).length() + ball.placed.radius;
        self.clusters.push(Cluster {
            centre,
            radius: balls.iter().map(reach).fold(0.0, Real::max),
            start,
            end: self.balls.len() as u32,
        });
    }

    /// Puts the solids into a hierarchy.
    fn arrange(&mut self) {
        self.unbounded.clear();
        let mut leaves = Vec::with_capacity(self.solids.len());
        for (number, solid) in self.solids.iter().enumerate() {
            // A half-space says that it is as large as numbers go.
            if solid.placed.shape.as_halfspace().is_some() {
                self.unbounded.push(number as u32);
            } else {
                leaves.push((number, solid.bounds));
            }
        }
        self.tree = hierarchy(leaves);
    }

    /// Finds all contacts in which at least one side has a detection field. Of pairs that are
    /// `held` by Rapier its points may do.
    pub(super) fn find(
        &mut self,
        (world, starts): (&impl Lookup, &Starts),
        held: Option<HeldPairs<'_>>,
        found: &mut Found,
    ) {
        found.contacts.clear();
        found.points.clear();
        found.anew = held.is_none_or(|held| held.pairs.is_empty());
        self.list.refresh(&self.clusters, 0.0);
        let mut finder = Finder { world, found };
        for (i, cluster) in self.clusters.iter().enumerate() {
            for j in self.list.later(i) {
                let other = &self.clusters[*j as usize];
                let reach = cluster.radius + other.radius;
                if (cluster.centre - other.centre).length_squared() <= reach * reach * 1.0001 {
                    self.between(cluster, other, &mut finder);
                }
            }
        }
        if self.solids.is_empty() {
            return;
        }
        for ball in &self.balls {
            let margin = Vector::splat(ball.placed.radius);
            let bounds = Aabb::new(ball.placed.centre - margin, ball.placed.centre + margin);
            let near = self.tree.intersect_aabb(&bounds);
            for number in near.chain(self.unbounded.iter().copied()) {
                let solid = &self.solids[number as usize];
                finder.pair(&solid.part, &ball.part, |points| {
                    solid.placed.overlaps_ball(&ball.placed, points);
                });
            }
        }
        let mut still = std::mem::take(&mut self.still_points);
        let mut apart = std::mem::take(&mut self.separations);
        still.turn();
        apart.turn();
        for pair in self.pairs_of_solids() {
            let [one, two] = pair.map(|number| &self.solids[number as usize]);
            let stands = pair.iter().all(|number| self.still[*number as usize]);
            let colliders = [one.part.collider, two.part.collider];
            finder.pair(&one.part, &two.part, |points| {
                let mut search = || {
                    if one.placed.is_apart(&two.placed, colliders, &mut apart) {
                        return Vec::new();
                    }
                    one.placed.near(&two.placed)
                };
                if stands {
                    let near = still.near(colliders, search);
                    one.placed.place(&two.placed, near, points);
                } else {
                    let parts = || [one, two].map(|solid| solid.since(world, starts));
                    let near = held.and_then(|held| held.near(colliders, parts));
                    let near = near.unwrap_or_else(&mut search);
                    one.placed.place(&two.placed, &near, points);
                }
            });
        }
        self.still_points = still;
        self.separations = apart;
    }

    fn pairs_of_solids(&self) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        let mut workspace = BvhWorkspace::default();
        self.tree
            .traverse_bvtt_single_tree::<false>(&mut workspace, &mut |a, b| {
                pairs.push([a.min(b), a.max(b)]);
            });
        for wall in &self.unbounded {
            let others = (0..self.solids.len() as u32).filter(|it| !self.unbounded.contains(it));
            pairs.extend(others.map(|other| [*wall, other]));
        }
        pairs
    }

    /// The contacts between the balls of two clusters.
    fn between(&self, one: &Cluster, two: &Cluster, finder: &mut Finder<'_, impl Lookup>) {
        let balls = |cluster: &Cluster| &self.balls[cluster.start as usize..cluster.end as usize];
        for ball in balls(one) {
            for other in balls(two) {
                finder.pair(&ball.part, &other.part, |points| {
                    points.extend(ball.placed.overlap(&other.placed));
                });
            }
        }
    }
}

/// Looks at pairs, and notes what touches.
struct Finder<'a, W> {
    world: &'a W,
    found: &'a mut Found,
}

impl<W: Lookup> Finder<'_, W> {
    /// Looks whether two parts touch, if one of them wants to know.
    fn pair(&mut self, one: &Part, two: &Part, overlaps: impl FnOnce(&mut Vec<OverlapPoint>)) {
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
        contact.approach_speed = approach_speed(&contact, self.world);
        let range = start..self.found.points.len();
        self.found.contacts.push((contact, range));
    }
}

/// How fast the parts of a contact approach.
pub(super) fn approach_speed(contact: &FieldContact, world: &impl Lookup) -> Real {
    let motions = contact.bodies.map(|body| PointMotion::of(body, world));
    let [one, two] = motions.map(|motion| motion.at(contact.world_point));
    (one - two).dot(contact.world_normal)
}
