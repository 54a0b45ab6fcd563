//! Forces that cannot be given to Rapier, and the policy for bodies that get them.

use std::collections::{HashMap, HashSet};

use crate::compile::Compiled;
use crate::eval::SampledWorld;
use crate::field::{Anchor, Frame, Frames};
use crate::math::{ColliderHandle, Real, RigidBodyHandle};
use crate::rigid::Wrench;
use crate::sample::{Moment, Samples};

/// The treatment of a body to which fields give a force that is infinite or NaN, or that would make it so fast that the
/// square of its speed overflows. No such number reaches Rapier under any policy.
///
/// Under [`FaultPolicy::Quarantine`] fields act on all other bodies as if that body were disabled, from that half of
/// the step on. The policy at the start of a step holds for the whole step.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let mut world = PhysicsWorld::new();
/// let bad = Vector::new(0.0, 50.0, 0.0);
/// let ball = RigidBodyBuilder::dynamic().translation(bad);
/// let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.5));
/// // Infinite at its own centre.
/// let charge = Field::radial(1.0, -2.0).coupled_to(Coupling::Each).at(bad).named("charge");
/// let mut fields = Fields::new(charge)?;
/// fields.step(&mut world)?;
/// assert!(!world.bodies[ball].is_enabled(), "in quarantine, by default");
/// assert!(fields.warnings()[0].to_string().contains("`charge`"));
///
/// world.bodies[ball].set_enabled(true);
/// fields.settings.on_fault = FaultPolicy::Refuse;
/// assert!(matches!(fields.step(&mut world), Err(StepError::NonFinite { .. })));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case")
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum FaultPolicy {
    /// The force is left out, and the step warns with [`StepWarning::LeftOut`](crate::StepWarning::LeftOut): the
    /// contribution of a term at a sample counts as zero if it is not finite. A term is an operand of the outermost
    /// sum. Its other samples count, and so do all other terms. The body is kicked by the rest, without derivatives.
    ///
    /// If finite forces make a body too fast, no field acts on it: in that half of the step if it is kicked, and in the
    /// whole step if it is moved within it.
    LeaveOut,
    /// The body is treated as Rapier treats one that is not finite, and the step warns with
    /// [`StepWarning::Quarantined`](crate::StepWarning::Quarantined): the body is disabled, and its velocities and the
    /// user's forces on it become zero. It stays where it is. Unlike Rapier's own quarantine, this affects no
    /// neighbours, and is not listed in `world.quarantine()`. `set_enabled(true)` ends it.
    ///
    /// A soft body is disabled as a whole. Of a multibody only the link is disabled.
    #[default]
    Quarantine,
    /// The step is refused with [`StepError::NonFinite`](crate::StepError::NonFinite) or
    /// [`StepError::TooFast`](crate::StepError::TooFast), and the world is as it was before. Because Rapier may have
    /// made its step by then, each step in which fields can reach a body begins with a copy of all bodies.
    Refuse,
}

/// Computes the wrenches on the bodies of a fault, in their order, without contributions that are not finite.
pub(crate) type DropNonFinite<'a> = &'a dyn Fn(&Fault) -> Vec<Wrench>;

/// Wrenches or speeds that cannot be given to Rapier.
#[derive(Debug)]
pub(crate) struct Fault {
    pub kind: FaultKind,
    /// The places of the bodies among the sampled ones, in order; at least one.
    pub places: Vec<usize>,
    bodies: HashSet<RigidBodyHandle>,
    pub scene: Box<FaultScene>,
}

/// The samples, frames and moment of a fault, to find the field behind it later.
#[derive(Debug)]
pub(crate) struct FaultScene {
    pub samples: Samples,
    pub frames: KnownFrames,
    pub moment: Moment,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FaultKind {
    /// The wrench is infinite or NaN.
    NonFinite,
    /// The square of the body's speed would overflow; `speed` is that of the first body.
    TooFast { speed: Real },
}

/// The frames of the anchors of a tree at one moment, by the bodies and colliders that carry them.
#[derive(Debug)]
pub(crate) struct KnownFrames(HashMap<Carrier, Vec<(Anchor, Option<Frame>)>>);

#[derive(Debug, PartialEq, Eq, Hash)]
enum Carrier {
    Body(RigidBodyHandle),
    Collider(ColliderHandle),
}

impl Carrier {
    /// `None` for the world, whose frame needs no lookup.
    fn of(anchor: &Anchor) -> Option<Self> {
        match anchor {
            Anchor::World { .. } => None,
            Anchor::Body { handle, .. } => Some(Carrier::Body(*handle)),
            Anchor::Collider { handle, .. } => Some(Carrier::Collider(*handle)),
        }
    }
}

impl KnownFrames {
    pub(crate) fn of(compiled: &Compiled, frames: &impl Frames) -> Self {
        let mut known: HashMap<_, Vec<_>> = HashMap::new();
        for anchor in compiled.anchors.iter() {
            if let Some(carrier) = Carrier::of(anchor) {
                let frame = (*anchor, frames.frame(anchor));
                known.entry(carrier).or_default().push(frame);
            }
        }
        KnownFrames(known)
    }
}

impl Frames for KnownFrames {
    fn frame(&self, anchor: &Anchor) -> Option<Frame> {
        if let Anchor::World { local_pose } = anchor {
            return Some(Frame::at_rest(*local_pose));
        }
        let known = self.0.get(&Carrier::of(anchor)?)?;
        known.iter().find(|(known, _)| known == anchor)?.1
    }
}

impl Fault {
    /// The fault of all wrenches that are infinite or NaN; `None` if all wrenches are finite.
    pub(crate) fn of_wrenches(
        wrenches: &[Wrench],
        scene: &SampledWorld<'_, impl Frames>,
    ) -> Option<Self> {
        let numbered = wrenches.iter().enumerate();
        let bad = numbered.filter(|(_, wrench)| !wrench.is_finite());
        // An empty list does not allocate.
        let places: Vec<usize> = bad.map(|(place, _)| place).collect();
        (!places.is_empty()).then(|| Fault::new(FaultKind::NonFinite, scene, places))
    }

    pub(crate) fn new(
        kind: FaultKind,
        scene: &SampledWorld<'_, impl Frames>,
        places: Vec<usize>,
    ) -> Self {
        let samples = scene.samples.clone();
        let bodies = places.iter().map(|place| samples.bodies[*place]);
        Fault {
            kind,
            bodies: bodies.collect(),
            places,
            scene: Box::new(FaultScene {
                samples,
                frames: KnownFrames::of(scene.compiled, scene.world),
                moment: scene.moment,
            }),
        }
    }

    /// The bodies, in their order.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = RigidBodyHandle> {
        let places = self.places.iter();
        places.map(|place| self.scene.samples.bodies[*place])
    }

    pub(crate) fn is_of(&self, body: RigidBodyHandle) -> bool {
        self.bodies.contains(&body)
    }
}
