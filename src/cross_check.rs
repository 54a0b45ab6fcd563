//! Cross-check: what fields detect beside what Rapier's narrow phase finds, at the same poses.
//!
//! Contacts that Rapier reports after a step belong to the poses before it. So what the fields find
//! before a step is kept, and compared after it.

mod disagreement;
mod settings;

pub use disagreement::Disagreement;
pub use settings::CrossCheck;

use std::collections::HashSet;

use crate::contact::FieldContact;
use crate::math::{ColliderHandle, Pose, Real, Vector, to_f64};
use crate::rapier::dynamics::IntegrationParameters;
use crate::rapier::geometry::{ContactPair, NarrowPhase};
use crate::rigid::Lookup;

/// How many roundings of a coordinate stand between the poses and a gap, at most, on both sides
/// together: positions of two bodies, their rotations and those of the parts' places in them, the
/// difference, its length and the radii, and the same on Rapier's side in the frame of one part.
const ROUNDINGS: Real = 32.0;

/// Counts and errors of a [cross-check](crate::FieldsBuilder::cross_check), since it began.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CrossCheckReport {
    /// Steps compared.
    pub steps: u64,
    /// Contacts of all steps.
    pub total: ContactCounts,
    /// Contacts of the last step.
    pub last_step: ContactCounts,
    /// Largest difference of depth.
    pub depth_error: Real,
    /// Largest angle between the normals, in radians.
    pub normal_error: Real,
    /// Largest distance between the points of contact.
    pub point_error: Real,
    /// Whether Rapier's contacts were being recycled, and so up to 0.05 length units stale, which
    /// is only so if [the check was told to let it](CrossCheck::let_recycle).
    pub recycling: bool,
    /// Whether Rapier may have made more than one pass of continuous detection
    /// (`max_ccd_substeps` above 1): its contacts then belong to poses within the step, and
    /// disagreements mean little.
    pub ccd_substeps: bool,
    /// The disagreements of the last step, those within the band left out.
    pub disagreements: Vec<Disagreement>,
    /// Sums of the differences of depth, normal and point.
    sums: [f64; 3],
}

/// Contacts by who found them.
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize)
)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ContactCounts {
    /// Found by both sides.
    pub both: u64,
    /// Found by the fields only.
    pub only_field: u64,
    /// Found by Rapier only.
    pub only_rapier: u64,
    /// Found by one side only, and shallower than the tolerance band: see
    /// [`CrossCheckReport::band`].
    pub within_band: u64,
}

impl ContactCounts {
    /// Contacts on which the sides disagree, outside the band.
    pub fn disagreed(&self) -> u64 {
        self.only_field + self.only_rapier
    }

    fn add(&mut self, other: ContactCounts) {
        self.both += other.both;
        self.only_field += other.only_field;
        self.only_rapier += other.only_rapier;
        self.within_band += other.within_band;
    }
}

impl CrossCheckReport {
    /// Overlaps shallower than this are not told from rounding: 32 half units in the last place
    /// of a length as large as the contact's distance from the origin and the parts together.
    pub fn band(world_point: Vector, size: Real) -> Real {
        ROUNDINGS * 0.5 * Real::EPSILON * (world_point.length() + size)
    }
}

/// A contact of one side, at the poses compared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sighting {
    colliders: [ColliderHandle; 2],
    world_point: Vector,
    /// From the first to the second.
    world_normal: Vector,
    depth: Real,
    band: Real,
}

/// Colliders with a detection field: only their pairs are compared.
pub(crate) type Watched = HashSet<ColliderHandle>;

/// What the fields found, for comparison after the next step.
pub(crate) fn expect(
    settings: &CrossCheck,
    contacts: &[FieldContact],
    world: &impl Lookup,
) -> Vec<Sighting> {
    let watched = contacts
        .iter()
        .filter(|contact| settings.watches(contact.colliders));
    let sightings = watched.map(|contact| Sighting {
        colliders: contact.colliders,
        world_point: contact.world_point,
        world_normal: contact.world_normal,
        depth: contact.depth,
        band: band(world, contact.colliders, contact.world_point),
    });
    sightings.collect()
}

impl CrossCheckReport {
    /// Takes note of settings of Rapier under which its contacts are not those of the poses before
    /// the step.
    pub(crate) fn note(&mut self, settings: &CrossCheck, parameters: &IntegrationParameters) {
        self.recycling |= settings.lets_recycle && parameters.contact_recycling;
        self.ccd_substeps |= parameters.max_ccd_substeps > 1;
    }

    /// Compares with what Rapier found in the step since. `pose_before` gives the world poses
    /// that colliders had when that step began.
    pub(crate) fn compare(
        &mut self,
        (settings, watched): (&CrossCheck, &Watched),
        expected: &[Sighting],
        (world, narrow_phase): (&impl Lookup, &NarrowPhase),
        pose_before: impl Fn(ColliderHandle) -> Option<Pose>,
    ) {
        let mut theirs: Vec<Sighting> = narrow_phase
            .contact_pairs()
            .filter(|pair| compares(pair, (settings, watched), world))
            .filter_map(|pair| sighting(pair, world, &pose_before))
            .collect();
        let key = |sighting: &Sighting| sighting.colliders.map(|c| c.into_raw_parts());
        theirs.sort_unstable_by_key(key);
        self.steps += 1;
        self.disagreements.clear();
        self.last_step = ContactCounts::default();
        let (mut ours, mut theirs) = (expected.iter().peekable(), theirs.iter().peekable());
        while let Some(next) = ours
            .peek()
            .into_iter()
            .chain(theirs.peek())
            .map(|s| key(s))
            .min()
        {
            let our = ours.next_if(|sighting| key(sighting) == next);
            let their = theirs.next_if(|sighting| key(sighting) == next);
            let new = self.record(our, their);
            if let (Some(new), Some(tell)) = (new, &settings.listener) {
                tell(&new);
            }
        }
        self.total.add(self.last_step);
    }
}

/// Whether fields could have found what a pair of Rapier's may hold: one side has a detection
/// field, and one is a ball.
fn compares(
    pair: &ContactPair,
    (settings, watched): (&CrossCheck, &Watched),
    world: &impl Lookup,
) -> bool {
    let mut handles = [pair.collider1, pair.collider2];
    handles.sort_unstable_by_key(|handle| handle.into_raw_parts());
    if !settings.watches(handles) {
        return false;
    }
    let is_ball = |handle: &ColliderHandle| {
        let collider = world.collider(*handle);
        collider.is_some_and(|collider| collider.shape().as_ball().is_some())
    };
    handles.iter().any(|handle| watched.contains(handle)) && handles.iter().any(is_ball)
}

impl CrossCheckReport {
    fn record(&mut self, our: Option<&Sighting>, their: Option<&Sighting>) -> Option<Disagreement> {
        if let (Some(our), Some(their)) = (our, their) {
            self.last_step.both += 1;
            let depth = (our.depth - their.depth).abs();
            self.depth_error = self.depth_error.max(depth);
            self.sums[0] += to_f64(depth);
            let cross = our.world_normal.cross(their.world_normal).length();
            let angle = cross.atan2(our.world_normal.dot(their.world_normal));
            self.normal_error = self.normal_error.max(angle);
            self.sums[1] += to_f64(angle);
            let apart = (our.world_point - their.world_point).length();
            self.point_error = self.point_error.max(apart);
            self.sums[2] += to_f64(apart);
            return None;
        }
        let only = our.or(their)?;
        if only.depth <= only.band {
            self.last_step.within_band += 1;
            return None;
        }
        self.last_step.only_field += u64::from(our.is_some());
        self.last_step.only_rapier += u64::from(their.is_some());
        let disagreement = Disagreement {
            step: self.steps,
            colliders: only.colliders,
            world_point: only.world_point,
            field_depth: our.map(|our| our.depth),
            rapier_depth: their.map(|their| their.depth),
            band: only.band,
        };
        self.disagreements.push(disagreement);
        Some(disagreement)
    }

    /// Mean differences over all contacts that both sides found: of the depth, of the normal (an
    /// angle, in radians) and of the point. Zero if there was none.
    pub fn mean_errors(&self) -> [f64; 3] {
        let count = self.total.both.max(1) as f64;
        self.sums.map(|sum| sum / count)
    }
}

/// The deepest overlap of a pair of Rapier's, if it overlaps.
fn sighting(
    pair: &ContactPair,
    world: &impl Lookup,
    pose_before: impl Fn(ColliderHandle) -> Option<Pose>,
) -> Option<Sighting> {
    let points = pair.manifolds().iter().flat_map(|manifold| {
        let points = manifold.points.iter();
        points.map(move |point| (manifold, point))
    });
    let deepest = points.min_by(|(_, a), (_, b)| a.dist.total_cmp(&b.dist));
    let (manifold, point) = deepest.filter(|(_, point)| point.dist < 0.0)?;
    let (pose1, pose2) = (pose_before(pair.collider1)?, pose_before(pair.collider2)?);
    let world_point =
        (pose1.transform_point(point.local_p1) + pose2.transform_point(point.local_p2)) * 0.5;
    let mut handles = [pair.collider1, pair.collider2];
    let mut world_normal = manifold.data.normal;
    if handles[1].into_raw_parts() < handles[0].into_raw_parts() {
        handles.reverse();
        world_normal = -world_normal;
    }
    Some(Sighting {
        colliders: handles,
        world_point,
        world_normal,
        depth: -point.dist,
        band: band(world, handles, world_point),
    })
}

/// The tolerance band of a pair: half-spaces and other unbounded shapes have no size.
fn band(world: &impl Lookup, handles: [ColliderHandle; 2], world_point: Vector) -> Real {
    let size = |handle: ColliderHandle| {
        let ball = world
            .collider(handle)
            .and_then(|collider| collider.shape().as_ball());
        ball.map_or(0.0, |ball| ball.radius)
    };
    CrossCheckReport::band(world_point, size(handles[0]) + size(handles[1]))
}
