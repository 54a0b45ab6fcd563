//! Who is in stiff fields: noticed by how wrenches change along the way, and then looked into.

use super::evaluation::{Evaluation, find};
use super::implicit::Coupling;
use super::jacobian::{self, Jacobian};
use super::kick::Redirected;
use super::motion::Motions;
use super::plan::{CAUTION, Choice, Plan};
use super::stiffness::{Estimate, Rates, StepWarning, Stiffness, Treatment};
use super::{Integrator, Scheme, StepContext, Substeps};
use crate::math::{Real, RigidBodyHandle, Vector, to_dvec3, to_f64};
use crate::rapier::na::Vector6;
use crate::rigid::{Body, Lookup, Mobility, Wrench, of_wrench, pair, rounded};

/// From which dt·ω on a scheme that does not choose warns: half of where it explodes, of one that gains
/// energy at any where that is a percent in a hundred steps, and never of one that damps.
fn warns_from(scheme: Scheme) -> Option<Real> {
    match scheme {
        Scheme::Substep(Substeps::Fixed(count)) => Some(count as Real),
        Scheme::Suzuki4 => Some(1.25),
        Scheme::ExternalForce => Some(0.02),
        Scheme::LinearlyImplicit => None,
        _ => Some(1.0),
    }
}

/// Beyond this dt·ω a step into a field may have multiplied the energy, and it is damped.
const BROKEN: f64 = 1.0;

impl Integrator {
    /// After an evaluation that the step before did not make: judges the bodies for schemes that
    /// want it, and prepares kicks by forces that read velocities. `stiff`: the bodies that were
    /// found stiff last, in the order of their handles; `all`: whether any may be, since the fields
    /// or the bodies are others.
    pub(crate) fn predict(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        (stiff, all): (&mut Vec<RigidBodyHandle>, bool),
    ) {
        if context.dt == 0.0 {
            return;
        }
        let scheme = context.rules.scheme;
        if scheme == Scheme::LinearlyImplicit {
            self.candidates.clear();
            self.candidates.extend(0..evaluation.bodies.len());
            self.estimate_candidates(context, evaluation);
        } else if all && scheme.choice().is_some() && context.compiled.varies() {
            self.candidates.clear();
            self.candidates.extend(0..evaluation.bodies.len());
            self.look_into(context, evaluation, stiff);
        } else if scheme.choice().is_some() && context.compiled.varies() {
            let mut scout = std::mem::take(&mut self.scout);
            scout.look(&mut self.motions, context, &evaluation.wrenches);
            self.find_candidates(context, evaluation, stiff, |place| {
                let (here, there) = (evaluation.wrenches[place], scout.wrenches[place]);
                let change = Some(&scout.ways[place].change);
                secant(&context.bodies[place], here, there, change, context.dt).powi(2)
            });
            self.scout = scout;
            self.look_into(context, evaluation, stiff);
        }
        self.couple(context, evaluation);
    }

    /// After the evaluation that follows Rapier's step: the same, by how the wrenches changed since
    /// the `last` one, if that was of the same bodies, and by what the first half of the step has
    /// found out. `redirected`: who was put on another path.
    pub(crate) fn update(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        last: Option<&Evaluation>,
        (first, redirected): (&Motions, Redirected<'_>),
        (stiff, warnings): (&mut Vec<RigidBodyHandle>, &mut Vec<StepWarning>),
    ) {
        if context.dt == 0.0 || !context.compiled.varies() {
            return;
        }
        let fourth = |place: usize| {
            let was = last.map_or(Wrench::ZERO, |last| last.wrenches[place]);
            fourth_power(context, place, evaluation.wrenches[place], was)
        };
        match context.choice() {
            Some(choice) => {
                self.find_candidates(context, evaluation, stiff, |place| {
                    let body = evaluation.bodies[place];
                    let known = first.resolved(body).is_some();
                    let new = last.is_none() || redirected.has(body);
                    match (known, new) {
                        (true, _) => 0.0,
                        (false, true) => Real::INFINITY,
                        (false, false) => fourth(place),
                    }
                });
                self.look_into(context, evaluation, stiff);
                let done = (last, first, redirected);
                self.judge(choice, context, evaluation, done, (stiff, warnings));
            }
            None if last.is_some() => self.warn(context, evaluation, fourth, warnings),
            None => {}
        }
        self.couple(context, evaluation);
    }

    /// Looks again at bodies that were given other velocities since.
    pub(crate) fn look_again(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        places: impl Iterator<Item = usize>,
        stiff: &mut Vec<RigidBodyHandle>,
    ) {
        if context.choice().is_none() || !context.compiled.varies() {
            return;
        }
        self.candidates.clear();
        self.candidates.extend(places);
        if self.candidates.is_empty() || context.dt == 0.0 {
            return;
        }
        let estimates = std::mem::take(&mut evaluation.estimates);
        let known = std::mem::take(&mut evaluation.treatments);
        self.look_into(context, evaluation, stiff);
        evaluation.estimates.extend(estimates);
        evaluation.estimates.sort_by_key(|estimate| estimate.place);
        evaluation.estimates.dedup_by_key(|estimate| estimate.place);
        evaluation.treatments.extend(known);
        evaluation.treatments.sort_by_key(|(place, _)| *place);
        evaluation.treatments.dedup_by_key(|(place, _)| *place);
        note_stiff(evaluation, stiff);
    }

    /// Says who is to be moved again, tells of what cannot be, and takes over what was found within
    /// the step.
    fn judge(
        &mut self,
        choice: Choice,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        (last, first, redirected): (Option<&Evaluation>, &Motions, Redirected<'_>),
        (stiff, warnings): (&mut Vec<RigidBodyHandle>, &mut Vec<StepWarning>),
    ) {
        let dt = to_f64(context.dt);
        let before = |place| last.and_then(|last| last.treatment(place));
        let kicked =
            |place: usize| last.is_some() && first.resolved(evaluation.bodies[place]).is_none();
        let changed = |place: usize| {
            let was = last.map(|last| last.wrenches[place]);
            was != Some(evaluation.wrenches[place])
        };
        // The candidates have been looked into.
        let mut wrong = std::mem::take(&mut self.candidates);
        wrong.clear();
        for (place, treatment) in &evaluation.treatments {
            if let Treatment::Resolve(pace) = treatment
                && kicked(*place)
                && choice.error(*pace, Plan::WHOLE, dt) > choice.tolerance
                && (changed(*place) || before(*place) == Some(Treatment::Damp))
            {
                wrong.push(*place);
            }
        }
        if !wrong.is_empty() {
            let coupled = context.is_coupled();
            let free = |place: &usize| {
                let body = &context.bodies[*place];
                before(*place) != Some(Treatment::Damp)
                    && !context.compiled.reads_velocity
                    && !redirected.has(body.handle)
                    && !context.is_held(body)
                    && first.load(body.handle).is_none()
            };
            let all = || (0..evaluation.bodies.len()).filter(|it| !context.bodies[*it].sleeping);
            if redirected.may_redo && coupled && all().all(|place| free(&place) && kicked(place)) {
                evaluation.missed.extend(all());
            } else {
                let again = wrong.iter().copied();
                let again = again.filter(|place| redirected.may_redo && !coupled && free(place));
                evaluation.missed.extend(again);
                for (place, treatment) in &mut evaluation.treatments {
                    let listed = |list: &[usize]| list.binary_search(place).is_ok();
                    let Treatment::Resolve(pace) = *treatment else {
                        continue;
                    };
                    if !listed(&wrong) || listed(&evaluation.missed) {
                        continue;
                    }
                    let error = choice.error(pace, Plan::WHOLE, dt);
                    warnings.push(StepWarning::missed(
                        choice,
                        evaluation.bodies[*place],
                        error,
                    ));
                    if choice.damps && !coupled && pace.omega2.sqrt() * dt > BROKEN {
                        *treatment = Treatment::Damp;
                    }
                }
            }
        }
        self.candidates = wrong;
        // What was looked into stands first, in order.
        let known = evaluation.treatments.len();
        for (place, body) in evaluation.bodies.iter().enumerate() {
            let resolved = first.resolved(*body);
            if let Some(resolved) = resolved.filter(|it| it.error > choice.tolerance) {
                warnings.push(StepWarning::missed(choice, *body, resolved.error));
            }
            let treatment = match (resolved, before(place)) {
                (Some(resolved), _) if !choice.is_calm(resolved.pace, dt) => {
                    Treatment::Resolve(resolved.pace)
                }
                // It stood still, and is as it was.
                (None, Some(treatment @ Treatment::Resolve(_))) => treatment,
                _ => continue,
            };
            let looked = &evaluation.treatments[..known];
            if looked.binary_search_by_key(&place, |it| it.0).is_err() {
                evaluation.treatments.push((place, treatment));
            }
        }
        let treatments = &mut evaluation.treatments;
        treatments.sort_unstable_by_key(|(place, _)| *place);
        note_stiff(evaluation, stiff);
    }

    /// The same for schemes that evaluate once a step, by the ways since the `last` evaluation: what they
    /// do within a step does not show in the velocities.
    pub(crate) fn watch(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        last: &Evaluation,
        warnings: &mut Vec<StepWarning>,
    ) {
        let same = last.bodies == evaluation.bodies && last.centres.len() == last.bodies.len();
        if !same || context.dt == 0.0 || !context.compiled.varies() {
            return;
        }
        let fourth = |place: usize| {
            let (is, was) = (evaluation.wrenches[place], last.wrenches[place]);
            if is.torque != was.torque {
                return fourth_power(context, place, is, was);
            }
            let way = evaluation.centres[place] - last.centres[place];
            let pull = (is.force - was.force) * (context.bodies[place].inv_mass * context.dt);
            (pull * context.dt).length_squared() / way.length_squared()
        };
        self.warn(context, evaluation, fourth, warnings);
    }

    /// How stiff the fields are for a body.
    pub(crate) fn stiffness(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        body: RigidBodyHandle,
    ) -> Option<Stiffness> {
        let place = evaluation.place_of(body)?;
        self.prepare(context);
        let estimate = self.estimate(context, evaluation, place);
        Some(estimate.rates.report(context.dt))
    }

    /// Warns of the body whose wrench changed the most, if that is because the fields are stiff
    /// and not because it passed an edge.
    fn warn(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        fourth_power: impl Fn(usize) -> Real,
        warnings: &mut Vec<StepWarning>,
    ) {
        let Some(limit) = warns_from(context.rules.scheme) else {
            return;
        };
        // Of (dt·ω)⁴, which takes no root.
        let mut worst = (limit.powi(4), None);
        for place in 0..evaluation.bodies.len() {
            let fourth = fourth_power(place);
            if fourth > worst.0 {
                worst = (fourth, Some(place));
            }
        }
        let Some(place) = worst.1 else {
            return;
        };
        // Where energy is gained at any step, Jacobians would be worked out in every one.
        let (dt_omega, largest_stable_dt) = match context.rules.scheme {
            Scheme::ExternalForce => (worst.0.sqrt().sqrt(), 0.0),
            _ => {
                self.prepare(context);
                let estimate = self.estimate(context, evaluation, place);
                let report = estimate.rates.report(context.dt);
                (report.dt_omega, report.largest_stable_dt)
            }
        };
        if dt_omega > limit {
            warnings.push(StepWarning::Stiff {
                body: evaluation.bodies[place],
                dt_omega,
                largest_stable_dt,
            });
        }
    }

    /// Takes note of the bodies whose (dt·ω)⁴, as far as it shows, makes them worth a look, in the
    /// order of their places; with those found stiff before.
    fn find_candidates(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        stiff: &[RigidBodyHandle],
        fourth_power: impl Fn(usize) -> Real,
    ) {
        self.candidates.clear();
        let Some(choice) = context.choice() else {
            return;
        };
        let bound = (CAUTION * 4.0 * choice.tolerance).powi(2);
        let reads_velocity = context.compiled.reads_velocity;
        let is_candidate = |place: &usize| {
            if reads_velocity && evaluation.wrenches[*place] != Wrench::ZERO {
                return true;
            }
            let shown = to_f64(fourth_power(*place));
            let was_stiff = || find(stiff, evaluation.bodies[*place]).is_some();
            shown.is_nan() || shown > bound || (!stiff.is_empty() && was_stiff())
        };
        let places = (0..evaluation.bodies.len()).filter(is_candidate);
        self.candidates.extend(places);
    }

    /// Looks into the candidates, and says how they are to be moved by a scheme that chooses.
    fn look_into(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        stiff: &mut Vec<RigidBodyHandle>,
    ) {
        self.estimate_candidates(context, evaluation);
        let Some(choice) = context.choice() else {
            return;
        };
        let dt = to_f64(context.dt);
        let coupled = !self.candidates.is_empty() && context.is_coupled();
        let share = if coupled { COUPLED } else { 1.0 };
        for estimate in &evaluation.estimates {
            let mut pace = estimate.rates.pace(choice, dt);
            pace.omega2 *= share;
            let treatment = match choice.damps && !coupled && choice.is_hopeless(pace, dt) {
                true => Treatment::Damp,
                false => Treatment::Resolve(pace),
            };
            if !choice.is_calm(pace, dt) {
                evaluation.treatments.push((estimate.place, treatment));
            }
        }
        note_stiff(evaluation, stiff);
    }

    fn estimate_candidates(
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
            let estimate = self.estimate(context, evaluation, *place);
            evaluation.estimates.push(estimate);
        }
        self.candidates = candidates;
    }

    /// Readies the lineariser for the present places of all anchors.
    fn prepare(&mut self, context: &StepContext<'_, impl Lookup>) {
        self.motions.clear();
        let frames = self.motions.frames(context, &[], 0.0);
        self.lineariser.prepare(context.compiled, &frames);
    }

    /// Looks into a body, in the world the lineariser was prepared for.
    fn estimate(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        place: usize,
    ) -> Estimate {
        let jacobian = self.jacobian(context, evaluation, place);
        Estimate {
            place,
            rates: Rates::new(&jacobian, &Mobility::of(&context.bodies[place])),
            jacobian,
        }
    }

    /// In the world the lineariser was prepared for.
    fn jacobian(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        place: usize,
    ) -> Jacobian {
        let angvel = match evaluation.sampled_at.get(place) {
            Some(velocities) => pair(velocities).1,
            None => to_dvec3(context.bodies[place].angvel),
        };
        let frames = self.motions.frames(context, &[], 0.0);
        let world = (context.compiled, &frames);
        let (samples, moment) = (context.samples, context.moment());
        jacobian::of_body(&mut self.lineariser, world, samples, place, moment, angvel)
    }

    /// Takes the derivatives by velocity, since kicks solve for it.
    fn couple(&mut self, context: &StepContext<'_, impl Lookup>, evaluation: &mut Evaluation) {
        if !context.compiled.reads_velocity {
            return;
        }
        self.prepare(context);
        for place in 0..evaluation.bodies.len() {
            let mut coupling = None;
            if evaluation.wrenches[place] != Wrench::ZERO && !evaluation.is_left_out(place) {
                let known = evaluation.estimate(place).map(|estimate| estimate.jacobian);
                let jacobian = known.unwrap_or_else(|| self.jacobian(context, evaluation, place));
                let mut entries = jacobian.by_velocity.iter();
                let usable = entries.all(|entry| entry.is_finite());
                let wrench = of_wrench(evaluation.wrenches[place]);
                let sampled_at = evaluation.sampled_at[place];
                coupling = usable.then(|| Coupling::new(&jacobian, &wrench, sampled_at));
            }
            evaluation.couplings.push(coupling);
        }
    }
}

/// Two bodies that pull at each other swing at up to this times the square of the frequency at which
/// either would if the other were held.
const COUPLED: f64 = 2.0;

/// Takes note of who is not simply kicked.
fn note_stiff(evaluation: &Evaluation, stiff: &mut Vec<RigidBodyHandle>) {
    stiff.clear();
    let places = evaluation.treatments.iter().map(|(place, _)| *place);
    stiff.extend(places.map(|place| evaluation.bodies[place]));
}

/// (dt·ω)⁴ as it shows in how a wrench changed over the last step.
fn fourth_power(
    context: &StepContext<'_, impl Lookup>,
    place: usize,
    is: Wrench,
    was: Wrench,
) -> Real {
    if is == was {
        return 0.0;
    }
    let dt = context.dt;
    if is.torque != was.torque {
        return secant(&context.bodies[place], is, was, None, dt).powi(2);
    }
    // What the sample knows does for a force alone.
    let centre = &context.samples.centres[place];
    let pull = (is.force - was.force).length_squared() * (dt * dt);
    pull / (centre.velocity.length_squared() * (centre.mass * centre.mass))
}

/// (dt·ω)² as it shows in the wrenches at the two ends of a way: how much the acceleration
/// changed, against the way in units of dt². `change`: of the velocity, before the way.
fn secant(
    body: &Body,
    here: Wrench,
    there: Wrench,
    change: Option<&Vector6<f64>>,
    dt: Real,
) -> Real {
    let (inv_mass, inv_inertia) = (body.inv_mass, body.inv_inertia);
    let linear = (here.force - there.force) * inv_mass;
    let angular = inv_inertia * (here.torque - there.torque);
    if linear == Vector::ZERO && angular == Vector::ZERO {
        return 0.0;
    }
    let (mut linvel, mut angvel) = (body.linvel, body.angvel);
    if let Some(change) = change {
        let (more, twist) = rounded(change);
        (linvel, angvel) = (linvel + more, angvel + twist);
    }
    // The square of the radius of gyration makes lengths of angles.
    let trace = inv_inertia.m11 + inv_inertia.m22 + inv_inertia.m33;
    let radius = if trace > 0.0 {
        inv_mass.max_element() * 3.0 / trace
    } else {
        0.0
    };
    let sum = |v: Vector, w: Vector| v.length_squared() + radius * w.length_squared();
    dt * (sum(linear, angular) / sum(linvel, angvel)).sqrt()
}
