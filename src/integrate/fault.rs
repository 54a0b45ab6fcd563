//! What stops a step, with all that is needed to say who is to blame.

use crate::compile::Compiled;
use crate::field::{Anchor, Frame, Frames};
use crate::math::Real;
use crate::sample::{Moment, Samples};

/// A wrench or a speed that cannot be given to Rapier.
pub(crate) struct Fault {
    pub kind: FaultKind,
    /// Which body, of those sampled.
    pub place: usize,
    pub scene: Box<FaultScene>,
}

/// Where and when it happened.
pub(crate) struct FaultScene {
    pub samples: Samples,
    pub frames: KnownFrames,
    pub moment: Moment,
}

pub(crate) enum FaultKind {
    /// The wrench is infinite or NaN.
    NonFinite,
    /// The body would be faster than what can be squared.
    TooFast { speed: Real },
}

/// Where the anchors of a tree were at one moment.
pub(crate) struct KnownFrames(Vec<(Anchor, Option<Frame>)>);

impl KnownFrames {
    pub(crate) fn of(compiled: &Compiled, frames: &impl Frames) -> Self {
        let anchors = compiled.anchors.iter();
        KnownFrames(
            anchors
                .map(|anchor| (*anchor, frames.frame(anchor)))
                .collect(),
        )
    }
}

impl Frames for KnownFrames {
    fn frame(&self, anchor: &Anchor) -> Option<Frame> {
        let known = self.0.iter().find(|(known, _)| known == anchor);
        match (known, anchor) {
            (Some((_, frame)), _) => *frame,
            (None, Anchor::World { local_pose }) => Some(Frame::at_rest(*local_pose)),
            (None, _) => None,
        }
    }
}

impl Fault {
    /// A wrench that is infinite or NaN.
    pub(crate) fn non_finite(
        compiled: &Compiled,
        frames: &impl Frames,
        place: (&Samples, usize),
        moment: Moment,
    ) -> Self {
        Fault::new(FaultKind::NonFinite, compiled, frames, place, moment)
    }

    pub(super) fn new(
        kind: FaultKind,
        compiled: &Compiled,
        frames: &impl Frames,
        (samples, place): (&Samples, usize),
        moment: Moment,
    ) -> Self {
        Fault {
            kind,
            place,
            scene: Box::new(FaultScene {
                samples: samples.clone(),
                frames: KnownFrames::of(compiled, frames),
                moment,
            }),
        }
    }
}
