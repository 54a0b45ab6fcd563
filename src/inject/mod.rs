//! Inject: wrenches become motion of Rapier's bodies.
//!
//! A step is two halves around Rapier's own. What the fields give is worked out in full, and
//! checked, before anything is written; so an error leaves the world as it was.

mod blame;
mod error;
mod evaluate;
mod implicit;
mod jacobian;
mod kick;
mod monitor;
mod motion;
mod multirate;
mod predicted;
mod realise;
mod rollback;
#[cfg(feature = "serde-serialize")]
mod saved;
mod scheme;
mod soft;
mod stiffness;
mod wake;

pub use error::StepError;
pub use evaluate::BodySample;
pub use scheme::{Scheme, Substeps, WakePolicy};
pub use stiffness::{StepWarning, Stiffness};

#[cfg(feature = "serde-serialize")]
pub(crate) use saved::InjectorState;

use crate::compile::Prepared;
use crate::eval::{Evaluator, Lineariser, WrenchError};
use crate::field::{Frame, Frames};
use crate::math::{
    ColliderHandle, ColliderSet, DVec3, Pose, Real, RigidBodyHandle, RigidBodySet, Vector, to_f64,
};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::Wrench;
use crate::sample::{Moment, Properties, SamplePoint, Samples, Shapes};
use monitor::Watch;
use motion::{Kicks, Loan, Ride, Spin, Turned, finish, take_back, write};
use predicted::PredictedMotion;
use rollback::{Change, Snapshot};
use wake::Sleepers;

/// Carries the wrenches of a compiled tree into the bodies of a world.
pub(crate) struct Injector {
    pub scheme: Scheme,
    pub wake: WakePolicy,
    pub book: Properties,
    shapes: Shapes,
    /// Solver iterations of Rapier's step, over which it integrates a rotation.
    pub substeps: u32,
    /// What Rapier adds of its own, as far as it was told.
    pub gravity: Vector,
    /// The speed that Rapier cuts others down to; without one it was not told.
    pub max_speed: Option<Real>,
    /// Links of multibodies, in the order of their handles.
    pub links: Vec<RigidBodyHandle>,
    /// Of the last step.
    pub warnings: Vec<StepWarning>,
    /// Whether every body that turns freely is turned by this crate, even one like a ball and even
    /// where no field can turn it: swept detection must know how.
    pub exact_turns: bool,
    /// In 64 bits, so that long runs of small steps do not lose time.
    pub time: f64,
    evaluator: Evaluator,
    samples: Samples,
    /// A buffer for samples that are no sites.
    several: Vec<SamplePoint>,
    wrenches: Vec<Wrench>,
    /// Of those bodies that were sampled adaptively.
    errors: Vec<(RigidBodyHandle, WrenchError)>,
    sleepers: Sleepers,
    kicks: Kicks,
    watch: Watch,
    softs: soft::Softs,
    /// Of the inner integrator, one per group of bodies.
    inner: Vec<multirate::Evaluators>,
    lineariser: Lineariser,
    roles: Vec<PredictedMotion>,
    /// The world at the last evaluation; without one, nothing is known of it.
    before: Snapshot,
    evaluated: bool,
    /// The step for which it was evaluated: a change of velocity is a force by its length.
    evaluated_dt: Real,
    /// Whether all anchors were found once; what is missing later was removed.
    anchored: bool,
    open: Option<OpenStep>,
}

/// What `begin` did that `end` completes.
#[derive(Default)]
struct OpenStep {
    dt: Real,
    spins: Vec<Spin>,
    rides: Vec<Ride>,
    loans: Vec<Loan>,
    /// Bodies that get no second half of a kick, in the order of their handles.
    settled: Vec<RigidBodyHandle>,
}

impl Injector {
    pub(crate) fn new(scheme: Scheme, wake: WakePolicy, book: Properties) -> Self {
        Injector {
            scheme,
            wake,
            book,
            shapes: Shapes::default(),
            substeps: 4,
            gravity: Vector::ZERO,
            max_speed: None,
            links: Vec::new(),
            warnings: Vec::new(),
            exact_turns: false,
            time: 0.0,
            evaluator: Evaluator::default(),
            lineariser: Lineariser::default(),
            samples: Samples::default(),
            several: Vec::new(),
            wrenches: Vec::new(),
            errors: Vec::new(),
            sleepers: Sleepers::default(),
            kicks: Kicks::default(),
            watch: Watch::default(),
            softs: soft::Softs::default(),
            inner: Vec::new(),
            roles: Vec::new(),
            before: Snapshot::default(),
            evaluated: false,
            evaluated_dt: 0.0,
            anchored: false,
            open: None,
        }
    }

    /// Forgets what was evaluated: the fields or what they read have changed.
    pub(crate) fn invalidate(&mut self) {
        self.evaluated = false;
    }

    /// Forgets what belongs to the batches of an evaluation: they were made anew.
    pub(crate) fn forget_batches(&mut self) {
        self.evaluated = false;
        self.evaluator = Evaluator::default();
    }

    /// Like [`Injector::invalidate`], for a new tree: its anchors are to be found anew.
    pub(crate) fn forget_anchors(&mut self) {
        self.evaluated = false;
        self.anchored = false;
        // What it keeps between steps belongs to the old tree.
        self.evaluator = Evaluator::default();
        self.inner.clear();
        self.softs = soft::Softs::default();
        self.watch = Watch::default();
    }

    /// The last wrench on a body; `None` if the body was not sampled.
    pub(crate) fn wrench(&self, body: RigidBodyHandle) -> Option<Wrench> {
        self.wrenches.get(self.place_of(body)?).copied()
    }

    /// The bound of the error of the last wrench on a body that was sampled adaptively.
    pub(crate) fn wrench_error(&self, body: RigidBodyHandle) -> Option<WrenchError> {
        let mut errors = self.errors.iter();
        let found = errors.find(|(handle, _)| *handle == body);
        found.map(|(_, error)| *error)
    }

    /// How many bodies were sampled last.
    pub(crate) fn sampled(&self) -> usize {
        self.samples.bodies.len()
    }

    /// The present moment, in a step of length `dt`.
    pub(crate) fn moment(&self, dt: Real) -> Moment {
        Moment {
            time: self.time,
            // In a step of no length no force acts; that of a change of velocity is to be finite.
            dt: if dt == 0.0 { 1.0 } else { dt },
        }
    }

    /// The length of the step that was begun.
    pub(crate) fn open_dt(&self) -> Real {
        self.open.as_ref().map_or(0.0, |open| open.dt)
    }

    /// The world pose that a collider had when the step began.
    pub(crate) fn pose_before(
        &self,
        collider: ColliderHandle,
        colliders: &ColliderSet,
    ) -> Option<Pose> {
        let collider = colliders.get(collider)?;
        match (collider.parent(), collider.position_wrt_parent()) {
            (Some(parent), Some(local_pose)) => Some(self.before.pose(parent)? * *local_pose),
            _ => Some(*collider.position()),
        }
    }

    /// The place of a body among the sampled ones.
    fn place_of(&self, body: RigidBodyHandle) -> Option<usize> {
        find(&self.samples.bodies, body)
    }

    /// What happens before Rapier's step; returns how many bodies were written.
    pub(crate) fn begin(
        &mut self,
        compiled: Prepared<'_>,
        dt: Real,
        bodies: &mut RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<usize, StepError> {
        if self.open.is_some() {
            return Err(StepError::OutOfTurn {
                called: "begin_step",
            });
        }
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(StepError::TimeStep { dt });
        }
        self.check_anchors(compiled, bodies, colliders)?;
        let change = self.before.compare(bodies);
        if change == Change::Places {
            // Rapier computes masses in its next step only; an impulse before would be lost.
            for handle in self.before.moved(bodies) {
                if let Some(body) = bodies.get_mut(handle) {
                    body.recompute_mass_properties_from_colliders(colliders);
                }
            }
        }
        let may_change = match compiled.reads_velocity {
            true => Change::Nothing,
            false => Change::Velocities,
        };
        self.warnings.clear();
        if !self.evaluated || self.evaluated_dt != dt || change > may_change {
            self.evaluate(compiled, dt, bodies, colliders, None)?;
            self.predict(compiled, dt, bodies, colliders)?;
        }
        let mut open = OpenStep {
            dt,
            ..OpenStep::default()
        };
        self.first_half(compiled, &mut open, bodies, colliders)?;
        if change != Change::Nothing {
            self.before.take(bodies);
        }
        let mut written = self.lend(bodies, &mut open);
        std::mem::swap(&mut open.spins, &mut self.kicks.spins);
        std::mem::swap(&mut open.rides, &mut self.kicks.rides);
        written += write(bodies, &self.kicks.updates);
        self.open = Some(open);
        Ok(written)
    }

    /// The bodies that Rapier turns freely in the step that was begun, with their angular momenta.
    pub(crate) fn free_turns(&self) -> impl Iterator<Item = (RigidBodyHandle, DVec3)> {
        let spins = self.open.iter().flat_map(|open| &open.spins);
        spins.filter_map(|spin| match spin.after {
            Turned::Momentum(momentum) => Some((spin.body, momentum)),
            Turned::Velocity(_) => None,
        })
    }

    /// What happens after Rapier's step; returns how many bodies were written. `drifted` is called
    /// when the bodies have their true velocities again, before fields act at the new places.
    pub(crate) fn end(
        &mut self,
        compiled: Prepared<'_>,
        bodies: &mut RigidBodySet,
        colliders: &ColliderSet,
        drifted: impl FnOnce(&Properties, &mut RigidBodySet),
    ) -> Result<usize, StepError> {
        let Some(open) = self.open.take() else {
            return Err(StepError::OutOfTurn { called: "end_step" });
        };
        let mut written = take_back(bodies, &open.loans);
        finish(bodies, &open.spins, &open.rides, open.dt);
        drifted(&self.book, bodies);
        let began = self.time;
        self.time += to_f64(open.dt);
        self.evaluated = false;
        if self.scheme.kicks_twice() {
            match self.second_half(compiled, &open, bodies, colliders) {
                Ok(more) => written += more,
                Err(error) => {
                    self.time = began;
                    self.before.restore(bodies, colliders);
                    return Err(error);
                }
            }
        } else {
            self.note_sleepers(bodies);
            self.before.take(bodies);
        }
        Ok(written)
    }

    /// Gives up a step that was begun: everything is as it was before.
    pub(crate) fn abort(&mut self, bodies: &mut RigidBodySet, colliders: &ColliderSet) {
        if let Some(open) = self.open.take() {
            take_back(bodies, &open.loans);
            finish(bodies, &open.spins, &open.rides, open.dt);
            self.evaluated = false;
            self.before.restore(bodies, colliders);
        }
    }

    /// Remembers under which wrenches bodies fell asleep in this step: the next evaluation may
    /// see changed fields already.
    fn note_sleepers(&mut self, bodies: &RigidBodySet) {
        if !matches!(self.wake, WakePolicy::OnChange { .. }) {
            return;
        }
        for (handle, wrench) in self.samples.bodies.iter().zip(&self.wrenches) {
            if bodies.get(*handle).is_some_and(RigidBody::is_sleeping) {
                self.sleepers.resting_under(*handle, *wrench);
            }
        }
    }

    /// The first time a tree meets a world, every anchor must be there; later, what is missing
    /// was removed, and its fields leave with it.
    fn check_anchors(
        &mut self,
        compiled: Prepared<'_>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        if self.anchored {
            return Ok(());
        }
        let frames = find_frames(compiled, &(bodies, colliders));
        if let Some(missing) = frames.iter().position(Option::is_none) {
            return Err(blame::missing_anchor(compiled, missing));
        }
        self.anchored = true;
        Ok(())
    }
}

/// Where all anchors of a tree are.
fn find_frames(compiled: Prepared<'_>, world: &impl Frames) -> Vec<Option<Frame>> {
    let anchors = compiled.anchors.iter();
    anchors.map(|anchor| world.frame(anchor)).collect()
}

/// The place of a handle in a list that is in the order of handles.
fn find(handles: &[RigidBodyHandle], handle: RigidBodyHandle) -> Option<usize> {
    let index = |handle: &RigidBodyHandle| handle.into_raw_parts().0;
    let place = handles.binary_search_by_key(&index(&handle), index).ok()?;
    (handles[place] == handle).then_some(place)
}

/// Says what a body does in a trial.
fn assign(roles: &mut Vec<PredictedMotion>, body: RigidBodyHandle, role: PredictedMotion) {
    let index = body.into_raw_parts().0 as usize;
    if roles.len() <= index {
        roles.resize(index + 1, PredictedMotion::default());
    }
    roles[index] = role;
}
