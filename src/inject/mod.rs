//! Inject: wrenches become motion of Rapier's bodies.
//!
//! A step is two halves around Rapier's own. What the fields give is worked out in full, and
//! checked, before anything is written; so an error leaves the world as it was.

mod blame;
mod book;
mod error;
mod motion;
mod probes;
mod rotation;
mod scheme;
mod shapes;
mod snapshot;
mod wake;

pub use book::ProbeProperties;
pub use error::StepError;
pub use scheme::{Scheme, WakePolicy};

pub(crate) use book::PropertyBook;

use crate::compile::{Compiled, Wanted};
use crate::eval::{Evaluator, Kind, Moment, PotentialEnergy, Probe, Probes, Wrench, WrenchError};
use crate::field::{Frame, Frames, Query, Sampling};
use crate::math::{
    ColliderHandle, ColliderSet, Pose, Real, RigidBodyHandle, RigidBodySet, Vector, to_f64,
};
use crate::rapier::dynamics::RigidBody;
use motion::{FASTEST, Kicks, Loan, Spin, finish_spins, free_top, kicked, take_back, write};
use probes::{Gathering, Pending};
use shapes::Shapes;
use snapshot::{Change, Snapshot};
use wake::Sleepers;

/// Carries the wrenches of a compiled tree into the bodies of a world.
pub(crate) struct Injector {
    pub scheme: Scheme,
    pub wake: WakePolicy,
    pub book: PropertyBook,
    shapes: Shapes,
    /// Solver iterations of Rapier's step, over which it integrates a rotation.
    pub substeps: u32,
    /// In 64 bits, so that long runs of small steps do not lose time.
    pub time: f64,
    evaluator: Evaluator,
    probes: Probes,
    /// A buffer for samples that are no sites.
    several: Vec<Probe>,
    wrenches: Vec<Wrench>,
    /// Of those bodies that were sampled adaptively.
    errors: Vec<(RigidBodyHandle, WrenchError)>,
    sleepers: Sleepers,
    kicks: Kicks,
    /// The world at the last evaluation; without one, nothing is known of it.
    before: Snapshot,
    evaluated: bool,
    /// The step for which it was evaluated: a change of velocity is a force by its length.
    evaluated_dt: Real,
    /// Whether all anchors were found once; what is missing later was removed.
    anchored: bool,
    open: Option<OpenStep>,
}

/// A point at which a body is sampled; see [`Fields::samples`](crate::Fields::samples).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BodySample {
    /// The kind of sampling it belongs to: one of `Centre`, `Parts`, `Volume` and `Surface`.
    pub sampling: Sampling,
    /// What fields are asked there. The sample stands for `share` · `fraction` of the body's mass.
    pub query: Query,
}

/// What `begin` did that `end` completes.
#[derive(Default)]
struct OpenStep {
    dt: Real,
    spins: Vec<Spin>,
    loans: Vec<Loan>,
}

impl Injector {
    pub(crate) fn new(scheme: Scheme, wake: WakePolicy, book: PropertyBook) -> Self {
        Injector {
            scheme,
            wake,
            book,
            shapes: Shapes::default(),
            substeps: 4,
            time: 0.0,
            evaluator: Evaluator::default(),
            probes: Probes::default(),
            several: Vec::new(),
            wrenches: Vec::new(),
            errors: Vec::new(),
            sleepers: Sleepers::default(),
            kicks: Kicks::default(),
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
    }

    /// The last wrench on a body; nothing if the body was not sampled.
    pub(crate) fn wrench(&self, body: RigidBodyHandle) -> Option<Wrench> {
        let place = self
            .probes
            .bodies
            .iter()
            .position(|handle| *handle == body)?;
        self.wrenches.get(place).copied()
    }

    /// The bound of the error of the last wrench on a body that was sampled adaptively.
    pub(crate) fn wrench_error(&self, body: RigidBodyHandle) -> Option<WrenchError> {
        let mut errors = self.errors.iter();
        let found = errors.find(|(handle, _)| *handle == body);
        found.map(|(_, error)| *error)
    }

    /// Where and how a body is sampled.
    pub(crate) fn samples(
        &mut self,
        body: RigidBodyHandle,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Vec<BodySample> {
        let mut probes = Probes::default();
        self.gather_all(compiled, bodies, colliders, &mut probes);
        let moment = self.moment(1.0);
        let list = probes.centres.iter().chain(&probes.list);
        let own = list.filter(|probe| probes.bodies[probe.body as usize] == body);
        let sample = |probe: &Probe| BodySample {
            sampling: match probe.kind {
                Kind::Centre => Sampling::Centre,
                Kind::Site => Sampling::Parts,
                Kind::Volume => Sampling::Volume,
                Kind::Surface => Sampling::Surface,
            },
            query: probes.query(probe, moment),
        };
        own.map(sample).collect()
    }

    /// How many bodies were sampled last.
    pub(crate) fn sampled(&self) -> usize {
        self.probes.bodies.len()
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

    /// The wrench on a body in the world as it is. Leaves the evaluation of the step alone: where
    /// forces depend on velocities, another would not be the same to the last bit.
    pub(crate) fn sample(
        &mut self,
        body: RigidBodyHandle,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<Option<Wrench>, StepError> {
        self.check_anchors(compiled, bodies, colliders)?;
        let probes = std::mem::take(&mut self.probes);
        let wrenches = std::mem::take(&mut self.wrenches);
        let evaluated = (self.evaluated, self.evaluated_dt);
        let sampled = self.evaluate(compiled, 1.0, bodies, colliders, None);
        let wrench = sampled.map(|()| self.wrench(body));
        (self.probes, self.wrenches) = (probes, wrenches);
        (self.evaluated, self.evaluated_dt) = evaluated;
        wrench
    }

    /// What happens before Rapier's step; returns how many bodies were written.
    pub(crate) fn begin(
        &mut self,
        compiled: &Compiled,
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
        let may_change = match compiled.plan.reads_velocity {
            true => Change::Nothing,
            false => Change::Velocities,
        };
        if !self.evaluated || self.evaluated_dt != dt || change > may_change {
            self.evaluate(compiled, dt, bodies, colliders, None)?;
        }
        let mut open = OpenStep {
            dt,
            ..OpenStep::default()
        };
        match self.scheme {
            Scheme::ExternalForce => {}
            Scheme::Kick => self.kick(compiled, dt, Some(dt), bodies, colliders)?,
            Scheme::KickDriftKick => self.kick(compiled, dt * 0.5, Some(dt), bodies, colliders)?,
        }
        if change != Change::Nothing {
            self.before.take(bodies);
        }
        let written = match self.scheme {
            Scheme::ExternalForce => self.lend(bodies, &mut open),
            _ => {
                std::mem::swap(&mut open.spins, &mut self.kicks.spins);
                write(bodies, &self.kicks.updates)
            }
        };
        self.open = Some(open);
        Ok(written)
    }

    /// What happens after Rapier's step; returns how many bodies were written.
    pub(crate) fn end(
        &mut self,
        compiled: &Compiled,
        bodies: &mut RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<usize, StepError> {
        let Some(open) = self.open.take() else {
            return Err(StepError::OutOfTurn { called: "end_step" });
        };
        let mut written = take_back(bodies, &open.loans);
        finish_spins(bodies, &open.spins);
        let began = self.time;
        self.time += to_f64(open.dt);
        self.evaluated = false;
        if self.scheme == Scheme::KickDriftKick {
            match self.second_half(compiled, open.dt, bodies, colliders) {
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

    /// Remembers under which wrenches bodies fell asleep in this step: the next evaluation may
    /// see changed fields already.
    fn note_sleepers(&mut self, bodies: &RigidBodySet) {
        if !matches!(self.wake, WakePolicy::OnChange { .. }) {
            return;
        }
        for (handle, wrench) in self.probes.bodies.iter().zip(&self.wrenches) {
            if bodies.get(*handle).is_some_and(RigidBody::is_sleeping) {
                self.sleepers.resting_under(*handle, *wrench);
            }
        }
    }

    fn second_half(
        &mut self,
        compiled: &Compiled,
        dt: Real,
        bodies: &mut RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<usize, StepError> {
        self.evaluate(compiled, dt, bodies, colliders, Some(dt * 0.5))?;
        self.kick(compiled, dt * 0.5, None, bodies, colliders)?;
        let written = write(bodies, &self.kicks.updates);
        self.before.take(bodies);
        Ok(written)
    }

    /// Fills in the sites of all bodies as they are now, sleepers included.
    pub(crate) fn gather(
        book: &PropertyBook,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        probes: &mut Probes,
    ) {
        let mut gathering = Gathering {
            book,
            shapes: &mut Shapes::default(),
            sleepers: true,
            wanted: Wanted {
                parts: true,
                ..Wanted::default()
            },
            pending: None,
            several: Vec::new(),
        };
        gathering.run(bodies, colliders, probes);
    }

    /// Fills in all samples of all bodies that the fields want, sleepers included.
    fn gather_all(
        &mut self,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        probes: &mut Probes,
    ) {
        let mut gathering = Gathering {
            book: &self.book,
            shapes: &mut self.shapes,
            sleepers: true,
            wanted: Wanted {
                parts: true,
                ..compiled.wanted
            },
            pending: None,
            several: Vec::new(),
        };
        gathering.run(bodies, colliders, probes);
    }

    /// The potential energy of the bodies as they are now.
    pub(crate) fn potential_energy(
        &mut self,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> PotentialEnergy {
        // Sleepers have potential energy too, so the probes of the step do not do.
        let mut probes = Probes::default();
        self.gather_all(compiled, bodies, colliders, &mut probes);
        let world = (bodies, colliders);
        let moment = self.moment(1.0);
        self.evaluator
            .potential_energy(compiled, &world, &probes, moment)
    }

    /// Works out the wrenches on all bodies. `pending`: for how long the last ones still act, so
    /// that fields see the velocities that will be there in the end. This keeps forces that
    /// depend on velocities at second order with one evaluation per step.
    fn evaluate(
        &mut self,
        compiled: &Compiled,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        pending: Option<Real>,
    ) -> Result<(), StepError> {
        let last_bodies = std::mem::take(&mut self.probes.bodies);
        let foreseen = pending.filter(|_| compiled.plan.reads_velocity);
        let mut gathering = Gathering {
            book: &self.book,
            shapes: &mut self.shapes,
            sleepers: self.wake != WakePolicy::Never,
            wanted: compiled.wanted,
            pending: foreseen.map(|duration| Pending {
                bodies: &last_bodies,
                wrenches: &self.wrenches,
                duration,
            }),
            several: std::mem::take(&mut self.several),
        };
        gathering.run(bodies, colliders, &mut self.probes);
        self.several = gathering.several;
        let moment = self.moment(dt);
        let world = (bodies, colliders);
        let (evaluator, wrenches) = (&mut self.evaluator, &mut self.wrenches);
        evaluator.wrenches(compiled, &world, &self.probes, moment, wrenches);
        self.errors.clear();
        let handles = self.probes.bodies.iter().enumerate();
        let errors = handles.filter_map(|(n, handle)| Some((*handle, evaluator.error(n)?)));
        self.errors.extend(errors);
        if let Some(body) = wrenches.iter().position(|wrench| !wrench.is_finite()) {
            self.evaluated = false;
            let frames = find_frames(compiled, bodies, colliders);
            return Err(blame::non_finite(
                compiled,
                &frames,
                &self.probes,
                moment,
                body,
            ));
        }
        self.evaluated = true;
        self.evaluated_dt = dt;
        Ok(())
    }

    /// Works out `self.kicks`: the velocities after the wrenches acted for `duration`; with a
    /// `drift`, also the free rotations that Rapier is to carry out over that time.
    fn kick(
        &mut self,
        compiled: &Compiled,
        duration: Real,
        drift: Option<Real>,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        let drift = drift.filter(|dt| *dt > 0.0 && compiled.plan.torque_possible);
        self.kicks.updates.clear();
        self.kicks.spins.clear();
        for (place, handle) in self.probes.bodies.iter().enumerate() {
            let Some(body) = bodies.get(*handle) else {
                continue;
            };
            let wrench = self.wrenches[place];
            if !self.sleepers.acts(*handle, body, wrench, self.wake) {
                continue;
            }
            let wake = self.wakes(body, wrench);
            let may_spin = drift.is_some() && body.angvel() != Vector::ZERO;
            // Bodies that feel nothing are left alone.
            if wrench == Wrench::ZERO && !wake && !may_spin {
                continue;
            }
            let mut update = kicked(*handle, body, wrench, duration);
            update.wake = wake;
            let speed = update.linvel.length();
            if !(speed <= FASTEST && update.angvel.length() <= FASTEST) {
                let moment = self.moment(self.evaluated_dt);
                let frames = find_frames(compiled, bodies, colliders);
                return Err(StepError::TooFast {
                    field: blame::strongest(compiled, &frames, &self.probes, moment, place),
                    body: *handle,
                    speed,
                    limit: FASTEST,
                });
            }
            if let (Some(dt), Some(inertia)) = (drift, free_top(body, update.angvel)) {
                let twist = wrench.torque * duration;
                let spin = Spin::new(*handle, body, &inertia, twist, dt, self.substeps);
                update.angvel = spin.steady;
                update.spins = true;
                self.kicks.spins.push(spin);
            }
            if update.spins || wrench != Wrench::ZERO || wake {
                self.kicks.updates.push(update);
            }
        }
        Ok(())
    }

    /// Whether a body that the fields act on is to be woken, or kept from falling asleep.
    fn wakes(&self, body: &RigidBody, wrench: Wrench) -> bool {
        let always = self.wake == WakePolicy::Always && wrench != Wrench::ZERO;
        always || body.is_sleeping()
    }

    /// Puts the wrenches in place of the user's forces, on top of them.
    fn lend(&mut self, bodies: &mut RigidBodySet, open: &mut OpenStep) -> usize {
        for (place, handle) in self.probes.bodies.iter().enumerate() {
            let wrench = self.wrenches[place];
            let Some(body) = bodies.get(*handle) else {
                continue;
            };
            let acts = self.sleepers.acts(*handle, body, wrench, self.wake);
            if !acts || wrench == Wrench::ZERO {
                continue;
            }
            let wake = self.wakes(body, wrench);
            let Some(body) = bodies.get_mut(*handle) else {
                continue;
            };
            open.loans.push(Loan {
                body: *handle,
                force: body.user_force(),
                torque: body.user_torque(),
            });
            body.add_force(wrench.force, wake);
            body.add_torque(wrench.torque, wake);
        }
        open.loans.len()
    }

    /// The first time a tree meets a world, every anchor must be there; later, what is missing
    /// was removed, and its fields leave with it.
    fn check_anchors(
        &mut self,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        if self.anchored {
            return Ok(());
        }
        let frames = find_frames(compiled, bodies, colliders);
        if let Some(missing) = frames.iter().position(Option::is_none) {
            return Err(blame::missing_anchor(compiled, missing));
        }
        self.anchored = true;
        Ok(())
    }
}

fn find_frames(
    compiled: &Compiled,
    bodies: &RigidBodySet,
    colliders: &ColliderSet,
) -> Vec<Option<Frame>> {
    let world = (bodies, colliders);
    compiled
        .anchors
        .iter()
        .map(|anchor| world.frame(anchor))
        .collect()
}
