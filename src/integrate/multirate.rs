//! Motion in the fields alone, in steps smaller than Rapier's.
//!
//! All bodies that are moved so drift together; each is kicked as often as it needs. The others,
//! which Rapier moves, are taken to move on at constant velocity meanwhile.

use super::context::StepContext;
use super::fault::{Fault, FaultKind};
use super::implicit::Coupling;
use super::jacobian;
use super::motion::FASTEST;
use super::predicted::{PredictedFrames, PredictedMotions};
use crate::eval::{Evaluator, Lineariser};
use crate::math::{DPose3, DVec3, RigidBodyHandle};
use crate::math::{from_dvec3, from_f64, to_dvec3, to_f64};
use crate::rigid::{self as mobility, pair, six};
use crate::rigid::{COMPOSED_ENERGY_ERROR, ENERGY_ERROR};
use crate::rigid::{Lookup, RigidState, Wrench};
use crate::sample::{Kind, Moment, SamplePoint, Samples, Solid};

/// What evaluates a group of bodies, and what its derivatives; each keeps its buffers.
pub(super) type Evaluators = (Evaluator, Lineariser);

/// Evaluations that solve the kicks of a scheme of fourth order, where forces read velocities:
/// each brings the kick two orders closer to the implicit midpoint rule.
const MIDPOINT_ROUNDS: usize = 2;

/// Bodies that are kicked at the same times.
struct Group {
    /// Kicked at every so many ticks.
    stride: usize,
    /// The place of each of its bodies among the states.
    states: Vec<usize>,
    samples: Samples,
    /// From the centre of mass to each sample of `samples.list`, in the body's axes.
    arms: Vec<DVec3>,
    /// The frame of each of `samples.solids` relative to the centre of mass, in the body's axes.
    frames: Vec<DPose3>,
    wrenches: Vec<Wrench>,
}

/// What the integrator needs to know.
pub(super) struct Setting<'a, W> {
    pub context: &'a StepContext<'a, W>,
    /// Lengths of the ticks in units of `dt`.
    pub ticks: &'a [f64],
    /// What each body does meanwhile.
    pub motions: &'a PredictedMotions,
    /// Whether the ticks are those of a composition of fourth order.
    pub composed: bool,
}

/// One run of the multirate integrator over a step (Tuckerman, Berne and Martyna, J. Chem. Phys. 97
/// (1992) 1990).
pub(super) struct Multirate<'a, W> {
    setting: Setting<'a, W>,
    pub states: Vec<RigidState>,
    groups: Vec<Group>,

    elapsed: f64,
}

impl<'a, W: Lookup> Multirate<'a, W> {
    /// Of bodies that are given with their places among `samples` and how many kicks they need,
    /// and start out with the wrenches given.
    pub(super) fn new(
        setting: Setting<'a, W>,
        states: Vec<RigidState>,
        places: &[(usize, u32)],
        wrenches: &[Wrench],
    ) -> Self {
        let samples = setting.context.samples;
        let mut groups: Vec<Group> = Vec::new();
        for (state, (place, count)) in places.iter().enumerate() {
            let stride = setting.ticks.len() / (*count as usize).max(1);
            let known = groups.iter().position(|group| group.stride == stride);
            let group = known.unwrap_or_else(|| {
                groups.push(Group::new(stride, samples));
                groups.len() - 1
            });
            groups[group].take(
                (state, states[state].body),
                *place,
                samples,
                wrenches[*place],
            );
        }
        groups.iter_mut().for_each(|group| group.close(&states));
        Multirate {
            setting,
            states,
            groups,
            elapsed: 0.0,
        }
    }

    /// Goes through all ticks.
    pub(super) fn integrate(&mut self, evaluators: &mut Vec<Evaluators>) -> Result<(), Fault> {
        evaluators.resize_with(evaluators.len().max(self.groups.len()), Default::default);
        let count = self.setting.ticks.len();
        let energy_error = if self.setting.composed {
            COMPOSED_ENERGY_ERROR
        } else {
            ENERGY_ERROR
        };
        for tick in 0..=count {
            for (group, evaluators) in (0..self.groups.len()).zip(&mut *evaluators) {
                if tick % self.groups[group].stride == 0 {
                    self.kicks(group, tick, evaluators)?;
                }
            }
            let Some(tick) = self.setting.ticks.get(tick) else {
                break;
            };
            let h = tick * to_f64(self.setting.context.dt);
            let states = self.states.iter_mut();
            states.for_each(|state| state.drift(h, energy_error));
            self.elapsed += h;
        }
        Ok(())
    }

    /// The kicks of a group at a tick: half the way from the last one, and half to the next.
    fn kicks(
        &mut self,
        group: usize,
        tick: usize,
        evaluators: &mut Evaluators,
    ) -> Result<(), Fault> {
        let stride = self.groups[group].stride;
        let ticks = self.setting.ticks;
        let half =
            |ticks: &[f64]| ticks.iter().sum::<f64>() * 0.5 * to_f64(self.setting.context.dt);
        let before = half(&ticks[tick.saturating_sub(stride)..tick]);
        let after = half(&ticks[tick..(tick + stride).min(ticks.len())]);
        if !self.setting.context.compiled.reads_velocity {
            // The wrenches of the start are known.
            let evaluators = (tick > 0).then_some(evaluators);
            return self.kick(group, before + after, evaluators);
        }
        if !self.setting.composed {
            return self.kick(group, before + after, Some(evaluators));
        }
        // Two kicks by the implicit midpoint rule are not one, at the order wanted.
        for duration in [before, after] {
            if duration != 0.0 {
                self.kick(group, duration, Some(evaluators))?;
            }
        }
        Ok(())
    }

    /// Kicks a group, if need be after evaluating the wrenches on it.
    fn kick(
        &mut self,
        number: usize,
        duration: f64,
        evaluators: Option<&mut Evaluators>,
    ) -> Result<(), Fault> {
        let mut group = std::mem::take(&mut self.groups[number]);
        let outcome = match (evaluators, self.setting.context.compiled.reads_velocity) {
            (None, _) => self.push(&group, duration, None),
            (Some((evaluator, _)), false) => {
                self.evaluate(&mut group, evaluator, None)?;
                self.push(&group, duration, None)
            }
            (Some(evaluators), true) => self.solve(&mut group, evaluators, duration),
        };
        self.groups[number] = group;
        outcome
    }

    /// The kick by the implicit midpoint rule, for forces that read velocities.
    fn solve(
        &mut self,
        group: &mut Group,
        (evaluator, lineariser): &mut Evaluators,
        duration: f64,
    ) -> Result<(), Fault> {
        self.evaluate(group, evaluator, None)?;
        let mut midway = Vec::with_capacity(group.states.len());
        let mut solvers = Vec::with_capacity(group.states.len());
        let frames = self.frames();
        lineariser.prepare(self.setting.context.compiled, &frames);
        for (body, state) in group.states.iter().enumerate() {
            let state = &self.states[*state];
            let jacobian = jacobian::of_body(
                lineariser,
                (self.setting.context.compiled, &frames),
                &group.samples,
                body,
                self.moment(),
                state.angvel,
            );
            let velocities = six(state.linvel, state.angvel);
            let coupling = Coupling {
                by_velocity: jacobian.by_velocity,
                sampled_at: velocities,
            };
            let wrench = mobility::of_wrench(group.wrenches[body]);
            let mobility = state.mobility();
            let solved = coupling.midway(&mobility, &wrench, &velocities, duration);
            midway.push(solved.unwrap_or(wrench));
            solvers.push((coupling, mobility, velocities));
        }
        let rounds = if self.setting.composed {
            MIDPOINT_ROUNDS
        } else {
            0
        };
        for _ in 0..rounds {
            // Newton's method, with the derivative of the start.
            let middles: Vec<_> = midway
                .iter()
                .zip(&solvers)
                .map(|(wrench, (_, mobility, start))| {
                    pair(&(start + mobility.apply(wrench) * (0.5 * duration)))
                })
                .collect();
            self.evaluate(group, evaluator, Some(&middles))?;
            let sampled = group.wrenches.iter().zip(&solvers);
            for (wrench, (sampled, (coupling, mobility, _))) in midway.iter_mut().zip(sampled) {
                let off = mobility::of_wrench(*sampled) - *wrench;
                let change = mobility.apply(&off) * duration;
                if let Some(change) = coupling.solve(mobility, &change, duration) {
                    *wrench += off + coupling.by_velocity * change * 0.5;
                }
            }
        }
        self.push(group, duration, Some(&midway))
    }

    fn push(
        &mut self,
        group: &Group,
        duration: f64,
        midway: Option<&[crate::rapier::na::Vector6<f64>]>,
    ) -> Result<(), Fault> {
        for (body, place) in group.states.iter().enumerate() {
            let (force, torque) = match midway {
                Some(midway) => pair(&midway[body]),
                None => pair(&mobility::of_wrench(group.wrenches[body])),
            };
            let state = &mut self.states[*place];
            state.pushed |= group.wrenches[body] != Wrench::ZERO;
            state.kick(force * duration, torque * duration);
            state.linvel += state.acceleration * duration;
            let speed = state.linvel.length().max(state.angvel.length());
            if speed.is_nan() || speed > to_f64(FASTEST) {
                return Err(self.too_fast(group, body, speed));
            }
        }
        Ok(())
    }

    fn too_fast(&self, group: &Group, body: usize, speed: f64) -> Fault {
        let speed = from_f64(speed);
        self.fault(FaultKind::TooFast { speed }, group, body)
    }

    fn fault(&self, kind: FaultKind, group: &Group, body: usize) -> Fault {
        let (compiled, frames) = (self.setting.context.compiled, self.frames());
        Fault::new(
            kind,
            compiled,
            &frames,
            (&group.samples, body),
            self.moment(),
        )
    }

    fn frames(&self) -> PredictedFrames<'_, W> {
        let Setting {
            context, motions, ..
        } = &self.setting;
        motions.frames(context, &self.states, self.elapsed)
    }

    fn moment(&self) -> Moment {
        Moment {
            time: self.setting.context.time + self.elapsed,
            dt: self.setting.context.dt,
        }
    }

    /// The wrenches on a group where its bodies are now; with velocities of their own, or those
    /// given.
    fn evaluate(
        &self,
        group: &mut Group,
        evaluator: &mut Evaluator,
        velocities: Option<&[(DVec3, DVec3)]>,
    ) -> Result<(), Fault> {
        group.place(&self.states, velocities);
        let (compiled, moment) = (self.setting.context.compiled, self.moment());
        let frames = self.frames();
        let (samples, wrenches) = (&group.samples, &mut group.wrenches);
        evaluator.wrenches(compiled, &frames, samples, moment, wrenches);
        let bad = wrenches.iter().position(|wrench| !wrench.is_finite());
        bad.map_or(Ok(()), |body| {
            Err(self.fault(FaultKind::NonFinite, group, body))
        })
    }
}

impl Default for Group {
    fn default() -> Self {
        Group {
            stride: 1,
            states: Vec::new(),
            samples: Samples::default(),
            arms: Vec::new(),
            frames: Vec::new(),
            wrenches: Vec::new(),
        }
    }
}

impl Group {
    fn new(stride: usize, samples: &Samples) -> Self {
        let mut group = Group {
            stride,
            ..Group::default()
        };
        group.samples.user.clone_from(&samples.user);
        group.samples.spreads.clone_from(&samples.spreads);
        group
    }

    /// Takes in a body with its samples.
    fn take(
        &mut self,
        (state, handle): (usize, RigidBodyHandle),
        place: usize,
        all: &Samples,
        wrench: Wrench,
    ) {
        let body = self.samples.bodies.len() as u32;
        let (own, first) = (&mut self.samples, all.of(place)[0].start as u32);
        for solid in all
            .solids
            .iter()
            .filter(|solid| solid.body as usize == place)
        {
            let site = own.sites as u32 + solid.site - first;
            let solid = solid.clone();
            own.solids.push(Solid {
                body,
                site,
                ..solid
            });
        }
        own.sites += all.of(place)[0].len();
        for range in all.of(place) {
            let moved = all.list[range].iter();
            own.list
                .extend(moved.map(|sample| SamplePoint { body, ..*sample }));
        }
        let centre = all.centres[place];
        own.centres.push(SamplePoint { body, ..centre });
        own.overrides.extend(all.overrides.get(place));
        own.bodies.push(handle);
        self.states.push(state);
        self.wrenches.push(wrench);
    }

    /// Puts the samples in order, once all bodies are there.
    fn close(&mut self, states: &[RigidState]) {
        let samples = &mut self.samples;
        samples.list.sort_by_key(|sample| sample.kind != Kind::Site);
        samples.number();
        let state = |body: u32| &states[self.states[body as usize]];
        let arm =
            |sample: &SamplePoint| state(sample.body).attitude.inverse() * to_dvec3(sample.arm);
        self.arms = samples.list.iter().map(arm).collect();
        let frame = |solid: &Solid| state(solid.body).pose().inverse() * solid.pose;
        self.frames = samples.solids.iter().map(frame).collect();
    }

    /// Moves the samples to where their bodies are.
    fn place(&mut self, states: &[RigidState], velocities: Option<&[(DVec3, DVec3)]>) {
        let velocity = |body: usize, state: &RigidState| match velocities {
            Some(velocities) => velocities[body],
            None => (state.linvel, state.angvel),
        };
        for (sample, arm) in self.samples.list.iter_mut().zip(&self.arms) {
            let state = &states[self.states[sample.body as usize]];
            let (linvel, angvel) = velocity(sample.body as usize, state);
            let arm = state.attitude * *arm;
            sample.arm = from_dvec3(arm);
            sample.world_point = from_dvec3(state.position + arm);
            sample.velocity = from_dvec3(linvel + angvel.cross(arm));
        }
        for (solid, frame) in self.samples.solids.iter_mut().zip(&self.frames) {
            let state = &states[self.states[solid.body as usize]];
            solid.pose = state.pose() * *frame;
            solid.angvel = velocity(solid.body as usize, state).1;
        }
        for (body, centre) in self.samples.centres.iter_mut().enumerate() {
            let state = &states[self.states[body]];
            centre.world_point = from_dvec3(state.position);
            centre.velocity = from_dvec3(velocity(body, state).0);
        }
    }
}
