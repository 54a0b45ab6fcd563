//! The kicks of all bodies before and after Rapier's step.

use super::begun::{BegunBody, BegunStep};
use super::evaluation::Evaluation;
use super::fault::{Fault, FaultKind, FaultPolicy};
use super::kick::Kick;
use super::load::Before;
use super::method::{Method, method_of, together};
use super::motion::{Completion, Faster, Motions, Start, bearable};
use super::spins::SpinRules;
use super::{Integrator, StepContext};
use crate::math::Real;
use crate::rigid::{Body, Lookup, Wrench};

/// Schemes without a tolerance warn if a hit within a step leaves a larger relative error of the speed.
const HIT: f64 = 0.01;

/// Returns whether a wrench acts on a body, and whether the body is to be woken or kept from falling asleep.
pub(crate) type WakeDecision<'a> = &'a dyn Fn(usize, &Body, Wrench) -> (bool, bool);

impl Integrator {
    /// Computes the motions to write before Rapier's step.
    pub(crate) fn first_half(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        decide: WakeDecision<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        motions.clear();
        self.fastest = None;
        self.passages.clear();
        self.kick(context, evaluation, None, decide, motions)?;
        self.move_within(context, evaluation, motions)?;
        motions.sort();
        Ok(())
    }

    /// Computes the motions to write after Rapier's step: the second half of a kick, for all bodies that were not
    /// completed in the first one.
    pub(crate) fn second_half(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        begun: &BegunStep<'_>,
        decide: WakeDecision<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        motions.clear();
        self.kick(context, evaluation, Some(begun), decide, motions)?;
        let told = context
            .plan_rules()
            .map_or(HIT, |plan_rules| plan_rules.tolerance);
        if let Some((_, error)) = motions.worst_hit {
            self.reached = self.reached.max(error);
            motions.worst_hit = motions.worst_hit.filter(|_| error > told || error.is_nan());
        }
        Ok(())
    }

    /// Computes the action on each body, and collects the bodies to be moved within the step. `begun` is set in the
    /// second half: the results of the first.
    fn kick(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        begun: Option<&BegunStep<'_>>,
        decide: WakeDecision<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        let together = match begun {
            None => together(context, evaluation),
            Some(_) => None,
        };
        let mut at = 0;
        let policy = context.rules.on_fault;
        self.spins.begin(SpinRules {
            dt: context.dt,
            iterations: context.rules.iterations,
            balls_too: context.rules.exact_turns,
        });
        // The places of bodies that are too fast, and the speed of the first.
        let mut too_fast: Option<(Vec<usize>, Real)> = None;
        let note = |known: &mut Option<(Vec<usize>, Real)>, place, speed| {
            known
                .get_or_insert_with(|| (Vec::new(), speed))
                .0
                .push(place);
        };
        for (place, body) in context.bodies.iter().enumerate() {
            let begun = begun.map(|begun| BegunBody {
                step: begun,
                completion: begun.motions.next_completion(&mut at, body.handle),
            });
            let Some(method) = method_of(context, evaluation, begun, place) else {
                let completed = begun.map(|it| it.complete(context, evaluation, place, motions));
                if let Some(Err(Faster(speed))) = completed {
                    note(&mut too_fast, place, speed);
                    if policy == FaultPolicy::Refuse {
                        break;
                    }
                }
                continue;
            };
            let method = match (together, method) {
                (Some(plan), Method::Kick(_)) | (Some(plan), Method::Inner(_)) => {
                    Method::Inner(plan)
                }
                _ => method,
            };
            let wrench = evaluation.wrenches[place];
            let (acts, wake) = decide(place, body, wrench);
            if !acts {
                continue;
            }
            if let Method::Inner(plan) = method {
                motions.complete_by(body.handle, Completion::Completed);
                motions.inner.push(Start::new(place, plan, wake));
                continue;
            }
            let kick = Kick::new(context, evaluation, place);
            let estimate =
                matches!(method, Method::Implicit(_)).then(|| evaluation.estimate(place));
            let kick = Kick {
                jacobian: estimate.flatten().map(|it| &it.jacobian),
                before: begun.map(|begun| begun.before(&kick, place)),
                wake,
                ..kick
            };
            let drop = |motions: &mut Motions| {
                motions.drop_last(body.handle);
                motions.completions.pop_if(|it| it.body == body.handle);
            };
            let mut done = kick.done(method, motions);
            if let Err(Faster(speed)) = done {
                drop(motions);
                note(&mut too_fast, place, speed);
                match policy {
                    FaultPolicy::Refuse => break,
                    FaultPolicy::Quarantine => continue,
                    FaultPolicy::LeaveOut => done = kick.unfelt().done(method, motions),
                }
            }
            let Ok(Some((update, twist))) = done else {
                // The body is too fast without fields as well, so none of its motion is kept.
                if done.is_err() {
                    drop(motions);
                }
                continue;
            };
            match begun {
                None => self.spins.push(motions, body, update, twist),
                Some(_) => motions.updates.push(update),
            }
        }
        self.spins.compute(motions, |_| ());
        let Some((places, speed)) = too_fast else {
            return Ok(());
        };
        let fault = self.too_fast(context, places, speed);
        match policy {
            FaultPolicy::Refuse => Err(fault),
            _ => {
                motions.faults.push(fault);
                Ok(())
            }
        }
    }

    pub(super) fn too_fast(
        &self,
        context: &StepContext<'_, impl Lookup>,
        places: Vec<usize>,
        speed: Real,
    ) -> Fault {
        let frames = self.motions.frames(context, &[], 0.0);
        let kind = FaultKind::TooFast { speed };
        Fault::new(kind, &context.sampled(&frames), places)
    }
}

impl BegunBody<'_> {
    /// The first half of a kick.
    fn before(self, kick: &Kick<'_>, place: usize) -> Before {
        let (BegunStep { motions, .. }, body) = (self.step, kick.body.handle);
        Before {
            completion: self.completion,
            load: motions.load(body),
            given: kick.held.then(|| motions.given(body)).flatten(),
            correction: self.step.correction(place, body, kick.wrench),
        }
    }

    /// The second half for a body that gets no kick. Nothing is written if the body would be too fast.
    fn complete(
        self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        place: usize,
        motions: &mut Motions,
    ) -> Result<(), Faster> {
        let (first, body) = (self.step.motions, &context.bodies[place]);
        if let Some(was) = first.slope(self.completion) {
            if evaluation.missed.binary_search(&place).is_err()
                && let Some(update) = Kick::new(context, evaluation, place)
                    .end_of_load(was, first.load(body.handle).is_some())
            {
                motions.updates.push(bearable(update)?);
            }
            return Ok(());
        }
        let wrench = evaluation.wrenches[place];
        if let Some((update, error)) = self.step.after_hit(body, wrench, context.dt) {
            motions.updates.push(bearable(update)?);
            motions.note_hit(body.handle, error);
        }
        Ok(())
    }
}
