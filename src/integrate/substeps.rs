//! The integrator of the motion in the fields alone, in steps smaller than Rapier's.
//!
//! Its bodies are moved together. The other bodies, which Rapier moves, are assumed to move at constant velocity during
//! the step.

mod bisection;
mod forward;
mod group;
mod passage;

use super::context::StepContext;
use super::coupling::{ExternalTerms, LinearisedWrench, Slope};
use super::fault::{DropNonFinite, Fault, FaultKind};
use super::jacobian::{self, Jacobian};
use super::motion::{FASTEST, Start};
use super::plan::{Bisection, PlanRules, suzuki_steps};
use super::predicted::{PredictedFrames, PredictedMotions};
use super::rate_estimate::{Track, track_all};
use super::stiffness::Rates;
use group::{Group, Solution};
pub(super) use passage::Passage;

use crate::eval::{SampledWorld, Terms};
use crate::math::{DVec3, from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rigid::{COMPOSED_ENERGY_ERROR, ENERGY_ERROR};
use crate::rigid::{Lookup, Mobility, RigidState, Wrench, of_wrench, pair, phi1, six};
use crate::sample::{Moment, Samples};

/// The number of evaluations that solve a kick of a scheme of fourth order for forces that read velocities: each brings
/// the kick two orders closer to the implicit midpoint rule.
const MIDPOINT_ROUNDS: usize = 2;

/// The map from the start of a step to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum StepMap {
    /// Equal steps of kick-drift-kick, by their number.
    KickDriftKick(u32),
    /// Suzuki's composition, for forces that read velocities.
    Suzuki,
    /// Equal steps of fourth order, by their number, for forces that read no velocities.
    Forward(u32),
}

/// The inputs of the integrator.
pub(super) struct Setting<'a, W> {
    pub context: &'a StepContext<'a, W>,
    /// The predicted motion of each body.
    pub motions: &'a PredictedMotions,
    pub map: StepMap,
    /// If set, the step is halved by these rules, whatever the map.
    pub uneven: Option<PlanRules>,
    /// True to record how fast bodies oscillate.
    pub tracked: bool,
    /// The square of the highest frequency that a scheme that does not choose can follow.
    pub most: Option<f64>,
    /// True if the bodies act on each other.
    pub coupled: bool,
    /// If set, contributions that are not finite are left out; otherwise they are a fault.
    pub drop_non_finite: Option<DropNonFinite<'a>>,
    /// The time at which the run begins, relative to the world of the context: zero, or minus one step.
    pub from: f64,
}

/// The integrator; its buffers are reused from step to step.
#[derive(Default)]
pub(super) struct SubstepIntegrator {
    pub states: Vec<RigidState>,
    /// The path of each state, if recorded.
    pub tracks: Vec<Track>,
    /// The result, if parts were halved.
    pub bisection: Option<Bisection>,
    /// The contributions that were left out.
    pub faults: Vec<Fault>,
    /// Lengths of the ticks in units of `dt`.
    ticks: Vec<f64>,
    group: Group,
}

impl SubstepIntegrator {
    /// Integrates over all ticks, from the states of the bodies in `starts`. `wrenches` are those at the start, by the
    /// place of a body among the samples.
    pub(super) fn integrate(
        &mut self,
        setting: Setting<'_, impl Lookup>,
        starts: &[Start],
        wrenches: &[Wrench],
    ) -> Result<(), Fault> {
        let samples = setting.context.samples;
        let group = &mut self.group;
        group.begin(samples);
        for (start, state) in starts.iter().zip(&self.states) {
            group.take(state.body, start.place, samples);
            group.wrenches.push(wrenches[start.place]);
        }
        group.samples.number();
        self.tracks.clear();
        if setting.tracked {
            let tracks = starts.iter();
            let tracks = tracks.map(|it| Track::new(it.drift, it.is_linearised));
            self.tracks.extend(tracks);
        }
        self.ticks.clear();
        match setting.map {
            StepMap::KickDriftKick(count) => {
                let part = f64::from(count).recip();
                self.ticks.extend((0..count).map(|_| part));
            }
            StepMap::Suzuki => self.ticks.extend(suzuki_steps()),
            StepMap::Forward(_) => {}
        }
        let mut run = Run {
            setting,
            states: &mut self.states,
            tracks: &mut self.tracks,
            ticks: &self.ticks,
            faults: &mut self.faults,
            elapsed: 0.0,
        };
        run.faults.clear();
        self.bisection = None;
        match (run.setting.uneven, run.setting.map) {
            (Some(plan_rules), _) => self.bisection = Some(run.bisect(group, plan_rules)?),
            (None, StepMap::Forward(count)) => run.forward(group, count)?,
            (None, _) => run.all(group)?,
        }
        Ok(())
    }

    /// The wrench on the state of this number, at its present pose.
    pub(super) fn wrench(&self, number: usize) -> Wrench {
        self.group.wrenches[number]
    }
}

/// One run of the integrator over a step.
struct Run<'a, W> {
    setting: Setting<'a, W>,
    states: &'a mut [RigidState],
    tracks: &'a mut [Track],
    ticks: &'a [f64],
    faults: &'a mut Vec<Fault>,
    elapsed: f64,
}

impl<W: Lookup> Run<'_, W> {
    fn all(&mut self, group: &mut Group) -> Result<(), Fault> {
        let energy_error = if self.is_composed() {
            COMPOSED_ENERGY_ERROR
        } else {
            ENERGY_ERROR
        };
        for tick in 0..=self.ticks.len() {
            self.kicks(group, tick)?;
            let Some(tick) = self.ticks.get(tick) else {
                break;
            };
            let h = tick * to_f64(self.setting.context.dt);
            let states = self.states.iter_mut();
            states.for_each(|state| state.drift(h, energy_error));
            self.elapsed += h;
        }
        Ok(())
    }

    /// The kick at a tick, over half of the previous drift and half of the next.
    fn kicks(&mut self, group: &mut Group, tick: usize) -> Result<(), Fault> {
        let half = |tick: Option<usize>| {
            let length = tick.and_then(|tick| self.ticks.get(tick));
            length.map_or(0.0, |length| length * 0.5 * to_f64(self.setting.context.dt))
        };
        let (before, after) = (half(tick.checked_sub(1)), half(Some(tick)));
        if !self.setting.context.compiled.reads_velocity {
            // The wrenches of the start are already known.
            if tick > 0 {
                self.evaluate(group, false)?;
            }
            self.see(group);
            return self.push(group, before + after);
        }
        if !self.is_composed() {
            return self.solve(group, before + after);
        }
        // To the order needed, two kicks by the implicit midpoint rule cannot be merged into one.
        for duration in [before, after] {
            if duration != 0.0 {
                self.solve(group, duration)?;
            }
        }
        Ok(())
    }

    /// The kick for forces that read velocities, by the implicit midpoint rule in compositions, else by the exact mean
    /// of the linear part.
    fn solve(&mut self, group: &mut Group, duration: f64) -> Result<(), Fault> {
        self.evaluate(group, false)?;
        self.start(group, duration);
        let rounds = if self.is_composed() {
            MIDPOINT_ROUNDS
        } else {
            0
        };
        for _ in 0..rounds {
            // Newton's method, with the derivative at the start.
            for known in &mut group.solutions {
                let change = known.mobility.apply(&known.wrench) * (0.5 * duration);
                known.velocities = pair(&(known.coupling.sampled_at + change));
            }
            self.evaluate(group, true)?;
            for (known, sampled) in group.solutions.iter_mut().zip(&group.wrenches) {
                let external = known.external.after(&known.wrench, 0.5 * duration);
                let off = of_wrench(*sampled) + external.wrench() - known.wrench;
                let damping = external.damping;
                let coupling = &known.coupling;
                let better = coupling.midway(&known.mobility, &off, damping, duration);
                known.wrench += better.unwrap_or(off);
            }
        }
        self.push(group, duration)
    }

    /// Solves the linear part of the forces for the kick.
    fn start(&mut self, group: &mut Group, duration: f64) {
        let frames = self.frames();
        let scene = self.scene(&frames, &group.samples);
        group.lineariser.prepare(&scene);
        group.solutions.clear();
        for (body, state) in self.states.iter().enumerate() {
            let jacobian = match group.left_out.binary_search(&body) {
                Ok(_) => Jacobian::default(),
                Err(_) => jacobian::of_body(
                    &mut group.lineariser,
                    &scene,
                    Terms::All,
                    body,
                    state.angvel,
                ),
            };
            let velocities = six(state.linvel, state.angvel);
            let evaluated = of_wrench(group.wrenches[body]);
            // Samples have velocities in the precision of the world.
            let seen = six(to_dvec3(from_dvec3(state.linvel)), state.angvel);
            let coupling = LinearisedWrench::new(
                &jacobian.wrench,
                Slope::of_body(&jacobian.by_velocity),
                &evaluated,
                seen,
            );
            let wrench = coupling.at(&velocities);
            let mobility = state.mobility();
            let omega2 = self.wants(&jacobian, &mobility).then(|| {
                let rates = Rates::new(&jacobian, &mobility);
                rates.omega2()
            });
            let (momentum, twist) = state.momentum();
            let external = ExternalTerms {
                pull: six(state.acceleration * state.mass, DVec3::ZERO),
                damping: state.damping,
                momentum: six(momentum, twist),
            };
            let all = wrench + external.wrench();
            let solved = if self.is_composed() {
                coupling.midway(&mobility, &all, state.damping, duration)
            } else {
                coupling.mean(&mobility, &wrench, &external, duration)
            };
            group.solutions.push(Solution {
                coupling,
                mobility,
                external,
                wrench: solved.unwrap_or(all),
                velocities: (state.linvel, state.angvel),
                omega2,
            });
        }
        for (track, known) in self.tracks.iter_mut().zip(&group.solutions) {
            known
                .omega2
                .into_iter()
                .for_each(|omega2| track.see_exactly(omega2));
        }
    }

    /// Returns true if the exact frequency is needed: to choose a plan, or because it may exceed the limit.
    fn wants(&self, jacobian: &Jacobian, mobility: &Mobility) -> bool {
        let bound = || jacobian.by_motion.norm() * mobility.matrix().norm();
        self.setting.tracked && self.setting.most.is_none_or(|most| bound() > most)
    }

    fn is_composed(&self) -> bool {
        self.setting.map == StepMap::Suzuki
    }

    /// Follows the paths of the bodies, with the wrenches at their present poses.
    fn see(&mut self, group: &mut Group) {
        self.track(group);
        if let Some(most) = self.setting.most {
            // A single fast piece may be an edge or a close pass; a Jacobian decides.
            self.look_into(group, |track| track.is_unsure(most));
        }
    }

    /// Records the present poses of the bodies. Returns the square of the highest frequency that the last pieces of
    /// their paths show.
    fn track(&mut self, group: &mut Group) -> f64 {
        let passing = self.states.iter().zip(&group.wrenches);
        let chooses = self.setting.most.is_none();
        let time = chooses.then_some(self.elapsed);
        let fastest = track_all(self.tracks, passing, self.setting.coupled, time);
        self.look_into(group, |track| track.is_linearised)
            .max(fastest)
    }

    /// Linearises the bodies whose tracks fulfil `which`, and records their exact frequencies. Returns the square of the
    /// highest one.
    fn look_into(&mut self, group: &mut Group, which: impl Fn(&Track) -> bool) -> f64 {
        if !self.tracks.iter().any(&which) {
            return 0.0;
        }
        let frames = self.frames();
        let scene = self.scene(&frames, &group.samples);
        group.lineariser.prepare(&scene);
        let mut found = std::mem::take(&mut group.found);
        for (number, state) in self.states.iter().enumerate() {
            if !which(&self.tracks[number]) {
                continue;
            }
            let lineariser = &mut group.lineariser;
            let jacobian = jacobian::of_body(lineariser, &scene, Terms::All, number, state.angvel);
            found.push((number, Rates::new(&jacobian, &state.mobility()).omega2()));
        }
        let mut fastest = 0.0_f64;
        for (number, omega2) in found.drain(..) {
            self.tracks[number].see_exactly(omega2);
            fastest = fastest.max(omega2);
        }
        group.found = found;
        fastest
    }

    fn push(&mut self, group: &Group, duration: f64) -> Result<(), Fault> {
        for (body, state) in self.states.iter_mut().enumerate() {
            state.pushed |= group.wrenches[body] != Wrench::ZERO;
            if self.setting.context.compiled.reads_velocity {
                let (force, torque) = pair(&group.solutions[body].wrench);
                state.kick(force * duration, torque * duration);
            } else {
                let (force, torque) = pair(&of_wrench(group.wrenches[body]));
                state.wrench = (force, torque);
                state.damp(duration);
                let shares = state.damping.map(|rate| duration * phi1(-rate * duration));
                state.kick(force * shares[0], torque * shares[1]);
                state.linvel += state.acceleration * shares[0];
            }
        }
        self.check_speeds(group)
    }

    /// Returns an error if a body is faster than [`FASTEST`].
    fn check_speeds(&self, group: &Group) -> Result<(), Fault> {
        let bears = |state: &RigidState| speed(state) <= to_f64(FASTEST);
        if self.states.iter().all(bears) {
            return Ok(());
        }
        let places = 0..self.states.len();
        let places: Vec<usize> = places.filter(|it| !bears(&self.states[*it])).collect();
        let speed = from_f64(speed(&self.states[places[0]]));
        let kind = FaultKind::TooFast { speed };
        let frames = self.frames();
        let scene = self.scene(&frames, &group.samples);
        Err(Fault::new(kind, &scene, places))
    }

    fn frames(&self) -> PredictedFrames<'_, W> {
        let Setting {
            context, motions, ..
        } = &self.setting;
        motions.frames(context, self.states, self.setting.from + self.elapsed)
    }

    fn scene<'a, F>(&'a self, frames: &'a F, samples: &'a Samples) -> SampledWorld<'a, F> {
        let context = self.setting.context;
        let moment = Moment {
            time: context.time + self.setting.from + self.elapsed,
            dt: context.dt,
            span: context.span,
        };
        SampledWorld::new(context.compiled, frames, samples, moment)
    }

    /// Evaluates the wrenches on a group at the present poses of its bodies, with their own velocities, or with those
    /// in the middle of a kick.
    fn evaluate(&mut self, group: &mut Group, midway: bool) -> Result<(), Fault> {
        group.place(self.states, midway);
        group.left_out.clear();
        let (frames, wrenches) = (self.frames(), &mut group.wrenches);
        let scene = self.scene(&frames, &group.samples);
        group.evaluator.wrenches(&scene, wrenches, None);
        let Some(fault) = Fault::of_wrenches(wrenches, &scene) else {
            return Ok(());
        };
        let Some(drop_non_finite) = self.setting.drop_non_finite else {
            return Err(fault);
        };
        for (place, left) in fault.places.iter().zip(drop_non_finite(&fault)) {
            wrenches[*place] = left;
        }
        group.left_out.clone_from(&fault.places);
        let known = |body| self.faults.iter().any(|known| known.is_of(body));
        if !fault.bodies().all(known) {
            self.faults.push(fault);
        }
        Ok(())
    }
}

/// The larger of the speed and the angular speed; NaN if either is.
fn speed(state: &RigidState) -> f64 {
    let (speed, turn) = (state.linvel.length(), state.angvel.length());
    if turn.is_nan() { turn } else { speed.max(turn) }
}
