//! The kicks of all bodies before and after Rapier's step.

use super::begun::{BegunBody, BegunStep};
use super::evaluation::Evaluation;
use super::fault::{Fault, FaultKind, FaultPolicy};
use super::kick::Kick;
use super::method::{Method, method_of, together};
use super::motion::{Faster, Motions};
use super::spins::SpinRules;
use super::{Integrator, StepContext};
use crate::math::Real;
use crate::rigid::{Body, Lookup, Wrench};

/// Schemes without a tolerance warn if a hit within a step leaves a larger relative error of the speed.
const HIT: f64 = 0.01;

/// Returns whether a wrench acts on a body, and whether the body is to be woken or kept from falling asleep.
pub(crate) type Acts<'a> = &'a dyn Fn(usize, &Body, Wrench) -> (bool, bool);

impl Integrator {
    /// Computes the motions to write before Rapier's step.
    pub(crate) fn first_half(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        acts: Acts<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        motions.clear();
        self.fastest = None;
        self.passages.clear();
        self.kick(context, evaluation, None, acts, motions)?;
        self.move_within(context, evaluation, motions)?;
        motions.sort();
        Ok(())
    }

    /// Computes the motions to write after Rapier's step: the second half of a kick, for all bodies that were not
    /// settled in the first one.
    pub(crate) fn second_half(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        begun: &BegunStep<'_>,
        acts: Acts<'_>,
        motions: &mut Motions,
    ) -> Result<(), Fault> {
        motions.clear();
        self.kick(context, evaluation, Some(begun), acts, motions)?;
        let told = context.choice().map_or(HIT, |choice| choice.tolerance);
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
        acts: Acts<'_>,
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
            let (acts, wake) = acts(place, body, wrench);
            if !acts {
                continue;
            }
            let kick = Kick {
                context,
                evaluation,
                begun,
                place,
                body,
                wrench,
                wake,
                felt: true,
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
