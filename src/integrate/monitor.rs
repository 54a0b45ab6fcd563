//! The stiffness monitor: finds bodies in stiff fields by how wrenches change along the path, and linearises those.

use super::balance::EnergyBalance;
use super::begun::BegunStep;
use super::coupling::LinearisedWrench;
use super::evaluation::Evaluation;
use super::jacobian::{self, Jacobian};
use super::motion::{Motions, Resolved};
use super::plan::{CAUTION, PlanRules, StepPlan};
use super::secant::fourth_power;
use super::stability::COUPLED;
use super::stiffness::{Estimate, Rates, StepWarning, StiffMethod};
use super::{Integrator, Scheme, StepContext};
use crate::eval::Terms;
use crate::math::{Real, RigidBodyHandle, to_dvec3, to_f64};
use crate::rigid::{Lookup, Mobility, Wrench, find};

/// The error of the energy of a vibration that is damped: it is lost.
const LOST: f64 = 1.0;

/// Beyond this dt·ω a step into a field may have multiplied the energy, and the body is damped.
const BROKEN: f64 = 1.0;

impl Integrator {
    /// After an evaluation that the previous step did not make: chooses methods under schemes that choose, warns
    /// under others, and prepares kicks by forces that read velocities. `stiff` are the bodies found stiff last, in the
    /// order of their handles. `all` is true if any body may be stiff, because the fields or the bodies differ from
    /// those of the `last` evaluation.
    pub(crate) fn predict(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        last: &Evaluation,
        all: bool,
        stiff: &mut Vec<RigidBodyHandle>,
        warnings: &mut Vec<StepWarning>,
    ) {
        if context.dt == 0.0 {
            return;
        }
        self.couple(context, evaluation);
        let scheme = context.rules.scheme;
        // After an edit of fields alone, the next step shows the stiffness.
        let joined = all && last.bodies != evaluation.bodies;
        if scheme == Scheme::LinearlyImplicit {
            self.candidates.clear();
            self.candidates.extend(0..evaluation.bodies.len());
            self.estimate_candidates(context, evaluation);
            self.warn_of_implicit(context, evaluation, warnings);
        } else if !context.compiled.varies() {
            // No field is stiff.
        } else if scheme.plan_rules().is_none() {
            if joined {
                self.warn_of_new(context, evaluation, last, warnings);
            }
        } else if all {
            self.candidates.clear();
            self.candidates.extend(0..evaluation.bodies.len());
            self.look_into(context, evaluation, stiff);
            Self::warn_of_held(context, evaluation, warnings);
        } else {
            let mut lookahead = std::mem::take(&mut self.lookahead);
            lookahead.look(&mut self.motions, context, &evaluation.wrenches, 1.0);
            let drifts = self.drifts(context, context.bodies, 0.0);
            self.find_candidates(context, evaluation, stiff, |place| {
                let shown = lookahead.shown(context, place, evaluation.wrenches[place]);
                Some(drifts.shown(&context.bodies[place], shown.powi(2)))
            });
            (self.lookahead, self.drifts) = (lookahead, drifts);
            self.look_into(context, evaluation, stiff);
        }
        if joined && context.compiled.varies() && !context.rules.links.is_empty() {
            self.warn_of_new_links(context, evaluation, last, warnings);
        }
        evaluation.carry_balances(last);
        warn_of_damped(context, evaluation, last, warnings);
        Self::couple_candidates(evaluation);
    }

    /// [`Self::predict`] for the evaluation after Rapier's step: by the change of the wrenches since the last
    /// evaluation, and by the results of the first half of the step.
    pub(crate) fn update(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        begun: &BegunStep<'_>,
        stiff: &mut Vec<RigidBodyHandle>,
        warnings: &mut Vec<StepWarning>,
    ) {
        let (last, first) = (begun.last, begun.motions);
        self.reached = 0.0;
        if context.dt == 0.0 || !context.compiled.varies() {
            return;
        }
        self.couple(context, evaluation);
        let fourth = |evaluation: &Evaluation, place: usize| {
            let was = last.map_or(Wrench::ZERO, |last| last.wrenches[place]);
            fourth_power(context, place, evaluation.wrenches[place], was)
        };
        match context.plan_rules() {
            Some(rules) => {
                let together = stay_together(rules, context, first);
                // Bodies that are led have arrived, and have only the velocity of the step before now.
                let drifts = self.drifts(context, context.bodies, -to_f64(context.dt));
                self.find_candidates(context, evaluation, stiff, |place| {
                    let body = evaluation.bodies[place];
                    let known = first.resolved(body).is_some();
                    let new = last.is_none() || begun.hit(body).is_some();
                    match (known, new) {
                        (true, _) => (!together).then_some(0.0),
                        (false, true) => Some(Real::INFINITY),
                        (false, false) => {
                            let fourth = fourth(evaluation, place);
                            Some(drifts.shown(&context.bodies[place], fourth))
                        }
                    }
                });
                self.drifts = drifts;
                // Bodies that are not linearised have a smaller error.
                self.reached = CAUTION * rules.tolerance;
                self.look_into(context, evaluation, stiff);
                self.judge(context, evaluation, begun, together, stiff, warnings);
                warn_of_damped(
                    context,
                    evaluation,
                    last.unwrap_or(&Evaluation::default()),
                    warnings,
                );
                Self::warn_of_held(context, evaluation, warnings);
                if last.is_some() && !context.rules.links.is_empty() {
                    self.warn(context, evaluation, |it| fourth(evaluation, it), warnings);
                }
            }
            None if last.is_some() => {
                self.warn(context, evaluation, |it| fourth(evaluation, it), warnings);
            }
            None => {}
        }
        Self::couple_candidates(evaluation);
    }

    /// Linearises bodies whose velocities were changed since the evaluation.
    pub(crate) fn look_again(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        places: impl Iterator<Item = usize>,
        stiff: &mut Vec<RigidBodyHandle>,
    ) {
        if context.plan_rules().is_none() || !context.compiled.varies() {
            return;
        }
        self.candidates.clear();
        self.candidates.extend(places);
        if self.candidates.is_empty() || context.dt == 0.0 {
            return;
        }
        let estimates = std::mem::take(&mut evaluation.estimates);
        let known = std::mem::take(&mut evaluation.stiff_methods);
        self.look_into(context, evaluation, stiff);
        evaluation.estimates.extend(estimates);
        evaluation.estimates.sort_by_key(|estimate| estimate.place);
        evaluation.estimates.dedup_by_key(|estimate| estimate.place);
        evaluation.stiff_methods.extend(known);
        evaluation.stiff_methods.sort_by_key(|(place, _)| *place);
        evaluation.stiff_methods.dedup_by_key(|(place, _)| *place);
        note_stiff(evaluation, stiff);
    }

    /// Lists the bodies whose step is to be repeated, warns of those for which it cannot be, and takes over the results
    /// from within the step.
    fn judge(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        begun: &BegunStep<'_>,
        together: bool,
        stiff: &mut Vec<RigidBodyHandle>,
        warnings: &mut Vec<StepWarning>,
    ) {
        let Some(rules) = context.plan_rules() else {
            return;
        };
        let (last, first) = (begun.last, begun.motions);
        let dt = to_f64(context.dt);
        let before = |place| last.and_then(|last| last.stiff_method(place));
        let kicked =
            |place: usize| last.is_some() && first.resolved(evaluation.bodies[place]).is_none();
        let changed = |place: usize| {
            let was = last.map(|last| last.wrenches[place]);
            was != Some(evaluation.wrenches[place])
        };
        // The candidates have been linearised, so their list is free as a buffer.
        let mut wrong = std::mem::take(&mut self.candidates);
        wrong.clear();
        for (place, method) in &evaluation.stiff_methods {
            let StiffMethod::Resolve { path_rate, .. } = method else {
                self.reached = self.reached.max(LOST);
                continue;
            };
            let moved = changed(*place) || before(*place) == Some(StiffMethod::Damp);
            if !kicked(*place) || !moved {
                continue;
            }
            let error = rules.error(*path_rate, StepPlan::WHOLE, dt);
            if error > rules.tolerance {
                wrong.push(*place);
            } else {
                self.reached = self.reached.max(error);
            }
        }
        if !wrong.is_empty() {
            let coupled = context.is_coupled();
            let free = |place: &usize| {
                let body = &context.bodies[*place];
                before(*place) != Some(StiffMethod::Damp)
                    && !context.compiled.reads_velocity
                    && begun.hit(body.handle).is_none()
                    && !context.is_held(body)
                    && first.load(body.handle).is_none()
            };
            let all = || (0..evaluation.bodies.len()).filter(|it| !context.bodies[*it].sleeping);
            if begun.may_retry && coupled && all().all(|place| free(&place) && kicked(place)) {
                evaluation.missed.extend(all());
            } else {
                let again = wrong.iter().copied();
                let again = again.filter(|place| begun.may_retry && !coupled && free(place));
                evaluation.missed.extend(again);
                for (place, method) in &mut evaluation.stiff_methods {
                    let listed = |list: &[usize]| list.binary_search(place).is_ok();
                    let StiffMethod::Resolve { path_rate, .. } = *method else {
                        continue;
                    };
                    if !listed(&wrong) || listed(&evaluation.missed) {
                        continue;
                    }
                    let error = rules.error(path_rate, StepPlan::WHOLE, dt);
                    self.reached = self.reached.max(error);
                    warnings.push(StepWarning::missed(rules, evaluation.bodies[*place], error));
                    if rules.damps && !coupled && path_rate.omega2.sqrt() * dt > BROKEN {
                        *method = StiffMethod::Damp;
                    }
                }
            }
        }
        self.candidates = wrong;
        // The methods of linearised bodies come first, in order.
        let known = evaluation.stiff_methods.len();
        for (place, body) in evaluation.bodies.iter().enumerate() {
            let resolved = first.resolved(*body);
            self.reached = self.reached.max(resolved.map_or(0.0, |it| it.error));
            if let Some(resolved) = resolved.filter(|it| it.error > rules.tolerance) {
                warnings.push(StepWarning::missed(rules, *body, resolved.error));
            }
            let method = match (resolved, before(place)) {
                // A body that was stiff and was not linearised since stays so.
                (Some(it), was)
                    if !rules.is_calm(it.path_rate, dt)
                        || it.balance.is_open()
                        || (together && was.is_some()) =>
                {
                    StiffMethod::Resolve {
                        path_rate: it.path_rate,
                        balance: it.balance,
                    }
                }
                // The body stood still, and is treated as before.
                (None, Some(method @ StiffMethod::Resolve { .. })) => method,
                _ => continue,
            };
            let looked = &evaluation.stiff_methods[..known];
            if looked.binary_search_by_key(&place, |it| it.0).is_err() {
                evaluation.stiff_methods.push((place, method));
            }
        }
        let methods = &mut evaluation.stiff_methods;
        methods.sort_unstable_by_key(|(place, _)| *place);
        for (place, method) in methods {
            if let StiffMethod::Resolve { path_rate, balance } = method {
                let known = begun.resolved_alone(evaluation.bodies[*place]);
                let known = known.filter(|known| known.error <= rules.tolerance);
                let is_calm = rules.is_calm(*path_rate, dt);
                *balance = known.map_or(EnergyBalance::default(), |known| {
                    known.balance.after_step(is_calm)
                });
            }
        }
        note_stiff(evaluation, stiff);
    }

    /// Collects as candidates the places of bodies for which the shown (dt·ω)⁴, or the coupling to velocities, is large
    /// enough, and of those found stiff before; in order. A body for which `fourth_power` is `None` is no candidate
    /// unless by its coupling.
    fn find_candidates(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        stiff: &[RigidBodyHandle],
        fourth_power: impl Fn(usize) -> Option<Real>,
    ) {
        self.candidates.clear();
        let Some(rules) = context.plan_rules() else {
            return;
        };
        let bound = (CAUTION * 4.0 * rules.tolerance).powi(2);
        let quiet = rules.quiet_rate(to_f64(context.dt));
        let is_candidate = |place: &usize| {
            if let Some(Some(LinearisedWrench { slope, .. })) = evaluation.couplings.get(*place) {
                let rate = slope.fastest(&Mobility::of(&context.bodies[*place]));
                if !slope.is_finite() || rate > quiet {
                    return true;
                }
            }
            let Some(shown) = fourth_power(*place).map(to_f64) else {
                return false;
            };
            let was_stiff = || find(stiff, evaluation.bodies[*place]).is_some();
            shown.is_nan() || shown > bound || (!stiff.is_empty() && was_stiff())
        };
        let places = (0..evaluation.bodies.len()).filter(is_candidate);
        self.candidates.extend(places);
    }

    /// Linearises the candidates, and chooses the method for stiff ones under a scheme that chooses.
    fn look_into(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        stiff: &mut Vec<RigidBodyHandle>,
    ) {
        self.estimate_candidates(context, evaluation);
        let Some(rules) = context.plan_rules() else {
            return;
        };
        let dt = to_f64(context.dt);
        let coupled = !self.candidates.is_empty() && context.is_coupled();
        let share = if coupled { COUPLED } else { 1.0 };
        for estimate in &evaluation.estimates {
            let mut path_rate = estimate.rates.path_rate(rules, dt);
            path_rate.omega2 *= share;
            let method = if rules.damps && !coupled && rules.is_hopeless(path_rate, dt) {
                StiffMethod::Damp
            } else {
                let balance = EnergyBalance::default();
                StiffMethod::Resolve { path_rate, balance }
            };
            if !rules.is_calm(path_rate, dt) {
                evaluation.stiff_methods.push((estimate.place, method));
            }
        }
        note_stiff(evaluation, stiff);
    }

    pub(super) fn estimate_candidates(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
    ) {
        if !self.candidates.is_empty() {
            self.prepare(context);
        }
        let candidates = std::mem::take(&mut self.candidates);
        for place in &candidates {
            if evaluation.is_left_out(*place) {
                continue;
            }
            let estimate = self.estimate(context, *place);
            evaluation.estimates.push(estimate);
        }
        self.candidates = candidates;
    }

    /// Prepares the lineariser for the present frames of all anchors.
    pub(super) fn prepare(&mut self, context: &StepContext<'_, impl Lookup>) {
        self.motions.clear();
        let frames = self.motions.frames(context, &[], 0.0);
        self.lineariser.prepare(&context.sampled(&frames));
    }

    /// Linearises a body in the world for which the lineariser was prepared.
    pub(super) fn estimate(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        place: usize,
    ) -> Estimate {
        let jacobian = self.jacobian(context, place);
        Estimate {
            place,
            rates: Rates::new(&jacobian, &Mobility::of(&context.bodies[place])),
            jacobian,
        }
    }

    /// The Jacobian of a body in the world for which the lineariser was prepared.
    pub(super) fn jacobian(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        place: usize,
    ) -> Jacobian {
        let angvel = to_dvec3(context.bodies[place].angvel);
        let frames = self.motions.frames(context, &[], 0.0);
        let scene = context.sampled(&frames);
        jacobian::of_body(&mut self.lineariser, &scene, Terms::All, place, angvel)
    }
}

/// Returns true if bodies that act on each other stay moved within the next step, independently of Jacobians, because
/// the path of one of them was stiff.
fn stay_together(
    rules: PlanRules,
    context: &StepContext<'_, impl Lookup>,
    first: &Motions,
) -> bool {
    let calm = |it: &Resolved| rules.is_calm(it.path_rate, to_f64(context.dt));
    !first.resolved.iter().all(calm) && context.is_coupled()
}

/// Warns of bodies that are damped from this evaluation on.
fn warn_of_damped(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
    last: &Evaluation,
    warnings: &mut Vec<StepWarning>,
) {
    let Some(rules) = context.plan_rules() else {
        return;
    };
    let damped = evaluation.stiff_methods.iter();
    for (place, _) in damped.filter(|it| it.1 == StiffMethod::Damp) {
        let body = evaluation.bodies[*place];
        let before = last.place_of(body).and_then(|it| last.stiff_method(it));
        let is_told = |it: &StepWarning| matches!(it, StepWarning::ToleranceMissed { body: told, .. } if *told == body);
        if before != Some(StiffMethod::Damp) && !warnings.iter().any(is_told) {
            warnings.push(StepWarning::missed(rules, body, LOST));
        }
    }
}

/// Lists the bodies that are not simply kicked.
fn note_stiff(evaluation: &Evaluation, stiff: &mut Vec<RigidBodyHandle>) {
    stiff.clear();
    let places = evaluation.stiff_methods.iter().map(|(place, _)| *place);
    stiff.extend(places.map(|place| evaluation.bodies[place]));
}
