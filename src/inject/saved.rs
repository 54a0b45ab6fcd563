//! What a step takes over from the last one, as data.

use serde::{Deserialize, Serialize};

use super::implicit::Coupling;
use super::jacobian::Jacobian;
use super::monitor::{Verdict, Watch};
use super::rollback::Snapshot;
use super::stiffness::{Rates, Treatment};
use super::{Injector, WakePolicy};
use crate::compile::Prepared;
use crate::eval::WrenchError;
use crate::math::{ColliderSet, Real, RigidBodyHandle, RigidBodySet, Vector};
use crate::rapier::na::{Matrix6, Vector6};
use crate::rigid::Mobility;
use crate::rigid::Wrench;
use crate::sample::Gathering;
use crate::sample::Samples;

/// The state of an injector between two steps. Buffers and neighbour lists are not part of it:
/// what they hold does not show in any result.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct InjectorState {
    time: f64,
    before: Snapshot,
    sleepers: Vec<(RigidBodyHandle, [Vector; 2])>,
    anchored: bool,
    evaluated: bool,
    evaluated_dt: Real,
    bodies: Vec<RigidBodyHandle>,
    wrenches: Vec<[Vector; 2]>,
    errors: Vec<(RigidBodyHandle, [Real; 2])>,
    watch: WatchState,
}

/// The evaluation that the next step begins with, beyond the wrenches.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct WatchState {
    sampled_at: Vec<Vec<f64>>,
    /// Derivatives by velocity, and the velocities they were taken at.
    couplings: Vec<Option<[Vec<f64>; 2]>>,
    verdicts: Vec<VerdictState>,
    stiff: Vec<RigidBodyHandle>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct VerdictState {
    place: usize,
    treatment: Treatment,
    /// By motion, and by velocity.
    jacobian: [Vec<f64>; 2],
}

fn pair(wrench: &Wrench) -> [Vector; 2] {
    [wrench.force, wrench.torque]
}

fn wrench([force, torque]: [Vector; 2]) -> Wrench {
    Wrench { force, torque }
}

/// What has another number of entries is zero.
fn matrix(entries: &[f64]) -> Matrix6<f64> {
    Matrix6::from_iterator(
        entries
            .iter()
            .copied()
            .chain(std::iter::repeat(0.0))
            .take(36),
    )
}

fn six(entries: &[f64]) -> Vector6<f64> {
    Vector6::from_iterator(
        entries
            .iter()
            .copied()
            .chain(std::iter::repeat(0.0))
            .take(6),
    )
}

impl InjectorState {
    /// Whether it holds what no step leaves behind: a time that is not finite.
    pub(crate) fn is_bad(&self) -> bool {
        !self.time.is_finite()
    }
}

impl WatchState {
    fn of(watch: &Watch) -> Self {
        let coupling = |coupling: &Coupling| {
            let (slope, at) = (&coupling.by_velocity, &coupling.sampled_at);
            [slope.as_slice().to_vec(), at.as_slice().to_vec()]
        };
        let verdict = |verdict: &Verdict| VerdictState {
            place: verdict.place,
            treatment: verdict.treatment,
            jacobian: [verdict.jacobian.by_motion, verdict.jacobian.by_velocity]
                .map(|m| m.as_slice().to_vec()),
        };
        let sampled_at = watch.sampled_at.iter();
        let couplings = watch.couplings.iter();
        WatchState {
            sampled_at: sampled_at.map(|v| v.as_slice().to_vec()).collect(),
            couplings: couplings.map(|c| c.as_ref().map(coupling)).collect(),
            verdicts: watch.verdicts.iter().map(verdict).collect(),
            stiff: watch.stiff.clone(),
        }
    }

    fn put(self, watch: &mut Watch, bodies: &RigidBodySet, sampled: &[RigidBodyHandle]) {
        let coupling = |[slope, at]: [Vec<f64>; 2]| Coupling {
            by_velocity: matrix(&slope),
            sampled_at: six(&at),
        };
        let verdict = |state: VerdictState| {
            let body = bodies.get(*sampled.get(state.place)?)?;
            let [by_motion, by_velocity] = state.jacobian.map(|m| matrix(&m));
            let jacobian = Jacobian {
                by_motion,
                by_velocity,
            };
            Some(Verdict {
                place: state.place,
                treatment: state.treatment,
                rates: Rates::new(&jacobian, &Mobility::of(body)),
                jacobian,
            })
        };
        watch.sampled_at = self.sampled_at.iter().map(|v| six(v)).collect();
        watch.couplings = self
            .couplings
            .into_iter()
            .map(|c| c.map(coupling))
            .collect();
        watch.verdicts = self.verdicts.into_iter().filter_map(verdict).collect();
        watch.stiff = self.stiff;
    }
}

impl Injector {
    /// What the next step takes over.
    pub(crate) fn state(&self) -> InjectorState {
        let errors = self.errors.iter();
        let sleepers = self.sleepers.iter();
        InjectorState {
            time: self.time,
            before: self.before.clone(),
            sleepers: sleepers
                .map(|(body, wrench)| (body, pair(&wrench)))
                .collect(),
            anchored: self.anchored,
            evaluated: self.evaluated,
            evaluated_dt: self.evaluated_dt,
            bodies: self.samples.bodies.clone(),
            wrenches: self.wrenches.iter().map(pair).collect(),
            errors: errors
                .map(|(body, e)| (*body, [e.force, e.torque]))
                .collect(),
            watch: WatchState::of(&self.watch),
        }
    }

    /// Goes on from a state. If the world is not the one it was taken in, the next step evaluates
    /// the fields anew, as after any change.
    pub(crate) fn resume(
        &mut self,
        state: InjectorState,
        compiled: Prepared<'_>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) {
        self.time = state.time;
        self.before = state.before;
        self.anchored = state.anchored;
        for (body, resting) in state.sleepers {
            self.sleepers.resting_under(body, wrench(resting));
        }
        // Of the samples only the velocities are not those of the evaluation, which kicks have
        // changed since; nobody asks for them again.
        let mut gathering = Gathering {
            book: &self.book,
            shapes: &mut self.shapes,
            sleepers: self.wake != WakePolicy::Never,
            wanted: compiled.wanted,
            pending: None,
            several: Vec::new(),
        };
        let mut samples = Samples::default();
        gathering.run(bodies, colliders, &mut samples);
        if samples.bodies != state.bodies || state.wrenches.len() != state.bodies.len() {
            return;
        }
        self.samples = samples;
        self.wrenches = state.wrenches.into_iter().map(wrench).collect();
        let errors = state.errors.into_iter();
        let errors = errors.map(|(body, [force, torque])| (body, WrenchError { force, torque }));
        self.errors = errors.collect();
        state
            .watch
            .put(&mut self.watch, bodies, &self.samples.bodies);
        self.evaluated = state.evaluated;
        self.evaluated_dt = state.evaluated_dt;
    }
}
