//! Who is in stiff fields: noticed by how wrenches change along the way, and then looked into.

use super::evaluation::{Evaluation, find};
use super::implicit::Coupling;
use super::jacobian::{self, Jacobian};
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

/// A body is looked into at this share of the (dt·ω)² that would change what is done with it:
/// along its way it need not meet the stiffest direction.
const CAUTION: f64 = 0.25;

impl Evaluation {
    pub(super) fn treatment(&self, place: usize) -> Treatment {
        if self.estimates.is_empty() {
            return Treatment::KickDriftKick;
        }
        let estimate = self.estimate(place);
        estimate.map_or(Treatment::KickDriftKick, |estimate| estimate.treatment)
    }
}

impl Integrator {
    /// After an evaluation that the step before did not make: judges the bodies for schemes that
    /// want it, and prepares kicks by forces that read velocities. `stiff`: the bodies that were
    /// found stiff last, in the order of their handles.
    pub(crate) fn predict(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        stiff: &mut Vec<RigidBodyHandle>,
    ) {
        if context.dt == 0.0 {
            return;
        }
        let scheme = context.rules.scheme;
        if scheme == Scheme::LinearlyImplicit {
            self.candidates.clear();
            self.candidates.extend(0..evaluation.bodies.len());
            self.estimate_candidates(context, evaluation, stiff);
        } else if scheme.choice().is_some() && context.compiled.varies() {
            let mut scout = std::mem::take(&mut self.scout);
            scout.look(&mut self.motions, context, &evaluation.wrenches);
            self.find_candidates(context, evaluation, stiff, |place| {
                let (here, there) = (evaluation.wrenches[place], scout.wrenches[place]);
                let change = Some(&scout.ways[place].change);
                secant(&context.bodies[place], here, there, change, context.dt).powi(2)
            });
            self.scout = scout;
            self.estimate_candidates(context, evaluation, stiff);
        }
        self.couple(context, evaluation);
    }

    /// After the evaluation that follows Rapier's step: the same, by how the wrenches changed since
    /// the `last` one, if that was of the same bodies.
    pub(crate) fn update(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        last: Option<&[Wrench]>,
        stiff: &mut Vec<RigidBodyHandle>,
        warnings: &mut Vec<StepWarning>,
    ) {
        if context.dt == 0.0 || !context.compiled.varies() {
            return;
        }
        if context.rules.scheme.choice().is_some() {
            match last {
                Some(last) => self.find_candidates(context, evaluation, stiff, |place| {
                    fourth_power(context, place, evaluation.wrenches[place], last[place])
                }),
                None => {
                    self.candidates.clear();
                    self.candidates.extend(0..evaluation.bodies.len());
                }
            }
            self.estimate_candidates(context, evaluation, stiff);
        } else if let Some(last) = last {
            let fourth =
                |place| fourth_power(context, place, evaluation.wrenches[place], last[place]);
            self.warn(context, evaluation, fourth, warnings);
        }
        self.couple(context, evaluation);
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
        let Some(choice) = context.rules.scheme.choice() else {
            return;
        };
        let bound = (CAUTION * 4.0 * choice.tolerance).powi(2);
        let reads_velocity = !evaluation.sampled_at.is_empty();
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

    /// Looks into the candidates.
    fn estimate_candidates(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
        stiff: &mut Vec<RigidBodyHandle>,
    ) {
        stiff.clear();
        if !self.candidates.is_empty() {
            self.prepare(context);
        }
        let candidates = std::mem::take(&mut self.candidates);
        for place in &candidates {
            let mut estimate = self.estimate(context, evaluation, *place);
            if let Some(choice) = context.rules.scheme.choice() {
                estimate.treatment = estimate.rates.treatment(to_f64(context.dt), choice);
                if estimate.treatment != Treatment::KickDriftKick {
                    stiff.push(evaluation.bodies[*place]);
                }
            }
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
            treatment: Treatment::Implicit,
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
            if evaluation.wrenches[place] != Wrench::ZERO {
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
