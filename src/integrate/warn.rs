//! Warnings of steps that are too long for the fields, under schemes that do not choose.

use super::evaluation::Evaluation;
use super::lookahead::{Lookahead, NEAR};
use super::motion::{Motions, Start};
use super::rate_estimate::Track;
use super::secant::fourth_power;
use super::stability::{BY_FORCE, COUPLED, Mode, warns_from};
use super::stiffness::{Estimate, StepWarning, StiffMethod, Stiffness};
use super::{Integrator, Scheme, StepContext};
use crate::math::{Real, RigidBodyHandle, Vector, from_f64, to_f64};
use crate::rapier::dynamics::RigidBody;
use crate::rigid::{Lookup, Mobility, Wrench, find};

/// Of more new bodies than this, only this number are linearised: the worst by the change of the fields along their
/// first step.
const MOST_NEW: usize = 16;

/// The dt·ω from which on the linearly implicit scheme warns of bodies that act on each other: half the limit of
/// stability of an explicit scheme, because it is explicit in the motion of the bodies that carry fields.
const COUPLED_FROM: f64 = 1.0;

/// The dt·ω from which on schemes that choose warn of a body that Rapier's solver holds.
const HELD: f64 = 1.0;

impl Integrator {
    /// Warns of bodies that are not in the `last` evaluation and are where the fields are too stiff for the coming
    /// step: bodies that overlap would be thrown far apart.
    pub(super) fn warn_of_new(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        last: &Evaluation,
        warnings: &mut Vec<StepWarning>,
    ) {
        let Some(limit) = limit(context) else {
            return;
        };
        let mut new = std::mem::take(&mut self.candidates);
        new.clear();
        let places = evaluation.bodies.iter().enumerate();
        let places = places.filter(|(place, body)| {
            let felt = evaluation.wrenches[*place] != Wrench::ZERO;
            felt && !context.bodies[*place].sleeping && last.place_of(**body).is_none()
        });
        new.extend(places.map(|(place, _)| place));
        if !new.is_empty() && context.is_coupled() {
            let worst = self.coupled(context, evaluation, new.iter().copied(), limit);
            warnings.extend(worst);
            new.clear();
        } else if new.len() > MOST_NEW {
            let mut lookahead = Lookahead::default();
            lookahead.look(&mut self.motions, context, &evaluation.wrenches, 1.0);
            let shown =
                |place: usize| to_f64(lookahead.shown(context, place, evaluation.wrenches[place]));
            // Half of the limit, because the path of a body need not be in the stiffest direction.
            new.retain(|place| exceeds(shown(*place), 0.25 * limit * limit));
            new.sort_unstable_by(|one, other| shown(*other).total_cmp(&shown(*one)));
            new.truncate(MOST_NEW);
        }
        if !new.is_empty() {
            self.prepare(context);
        }
        let worst = new.iter().filter_map(|place| {
            let estimate = self.estimate(context, *place);
            judged(context, evaluation, &estimate)
        });
        let worst = worst.max_by(|one, other| one.0.total_cmp(&other.0));
        warnings.extend(worst.map(|(_, warning)| warning));
        self.candidates = new;
    }

    /// Warns of links of multibodies that are not in the `last` evaluation; they get forces under every scheme.
    pub(super) fn warn_of_new_links(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        last: &Evaluation,
        warnings: &mut Vec<StepWarning>,
    ) {
        let mut worst = (from_f64(BY_FORCE), None);
        self.prepare(context);
        for link in context.rules.links {
            let new = last.place_of(*link).is_none();
            let Some(place) = evaluation.place_of(*link).filter(|_| new) else {
                continue;
            };
            let estimate = self.estimate(context, place);
            let dt_omega = estimate.rates.report(context.dt, 0.0).dt_omega;
            if dt_omega > worst.0 {
                worst = (dt_omega, Some(*link));
            }
        }
        let worst = worst.1.map(|link| (link, worst.0));
        warnings.extend(worst.map(|(link, dt_omega)| by_force(link, dt_omega, context.dt)));
    }

    /// The warning for the worst of some bodies in fields anchored to bodies that move, by the change of the wrenches
    /// over a short motion of all. Jacobians hold the carriers of the fields still, so they miss the reaction of a
    /// body's own fields.
    fn coupled(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        places: impl Iterator<Item = usize>,
        limit: f64,
    ) -> Option<StepWarning> {
        let mut lookahead = std::mem::take(&mut self.lookahead);
        lookahead.look(&mut self.motions, context, &evaluation.wrenches, NEAR);
        let shown =
            |place: usize| to_f64(lookahead.shown(context, place, evaluation.wrenches[place]));
        let shown = places.map(|place| (shown(place).sqrt(), place));
        let bad = shown.filter(|(dt_omega, _)| exceeds(*dt_omega, limit));
        let worst = bad.max_by(|one, other| one.0.total_cmp(&other.0));
        self.lookahead = lookahead;
        worst.map(|(dt_omega, place)| stiff(evaluation.bodies[place], dt_omega, context))
    }

    /// Warns of the body whose wrench changed the most since the `last` evaluation, if the cause is stiffness and not
    /// an edge that it passed.
    pub(super) fn warn(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        fourth_power: impl Fn(usize) -> Real,
        warnings: &mut Vec<StepWarning>,
    ) {
        let others = limit(context);
        let links = context.rules.links;
        if others.is_none() && links.is_empty() {
            return;
        }
        let limit_of = |place: usize| match others {
            // Links get forces under every scheme.
            _ if find(links, evaluation.bodies[place]).is_some() => Some(BY_FORCE),
            others => others,
        };
        // In (dt·ω)⁴, which needs no root, as a share of the limit.
        let mut worst = (1.0, None);
        for place in 0..evaluation.bodies.len() {
            let most = if links.is_empty() {
                others
            } else {
                limit_of(place)
            };
            let share = most.map_or(0.0, |limit| fourth_power(place) / from_f64(limit.powi(4)));
            if share > worst.0 {
                worst = (share, Some(place));
            }
        }
        let Some(place) = worst.1 else {
            return;
        };
        let body = evaluation.bodies[place];
        if is_warned_of(warnings, body) {
            return;
        }
        // Energy is gained at any step, so Jacobians would be computed in each one.
        if context.rules.scheme == Scheme::ExternalForce {
            let dt_omega = worst.0.sqrt().sqrt() * from_f64(BY_FORCE);
            warnings.push(by_force(body, dt_omega, context.dt));
            return;
        }
        self.prepare(context);
        let estimate = self.estimate(context, place);
        if limit_of(place) == Some(BY_FORCE) {
            let dt_omega = estimate.rates.report(context.dt, 0.0).dt_omega;
            let told = to_f64(dt_omega) > BY_FORCE;
            warnings.extend(told.then(|| by_force(body, dt_omega, context.dt)));
            return;
        }
        let mut worst = judged(context, evaluation, &estimate).map(|it| it.1);
        if let Some(limit) = others.filter(|_| worst.is_none() && context.is_coupled()) {
            worst = self.coupled(context, evaluation, std::iter::once(place), limit);
        }
        warnings.extend(worst);
    }

    /// [`Self::warn`] for schemes that do not kick twice a step, by the displacements since the `last` evaluation,
    /// because their motion within a step does not show in the velocities.
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

    /// Warns of the linearised body for which the linearly implicit scheme is the worst: it damps restoring forces, and
    /// leaves out forces that push bodies apart, and the motion of other bodies.
    pub(super) fn warn_of_implicit(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        warnings: &mut Vec<StepWarning>,
    ) {
        let estimates = evaluation.estimates.iter();
        let told = estimates.filter_map(|estimate| judged(context, evaluation, estimate));
        let mut worst = told
            .max_by(|one, other| one.0.total_cmp(&other.0))
            .map(|it| it.1);
        if worst.is_none() && context.compiled.varies() && context.is_coupled() {
            let all = 0..evaluation.bodies.len();
            worst = self.coupled(context, evaluation, all, COUPLED_FROM);
        }
        warnings.extend(worst);
    }

    /// Warns of bodies that Rapier's solver holds and that oscillate too fast for one kick a step: the substeps of a
    /// scheme that chooses do not include contacts and joints.
    pub(super) fn warn_of_held(
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        warnings: &mut Vec<StepWarning>,
    ) {
        for (place, stiff_method) in &evaluation.stiff_methods {
            let body = &context.bodies[*place];
            let StiffMethod::Resolve { path_rate, .. } = stiff_method else {
                continue;
            };
            let dt_omega = path_rate.omega2.sqrt() * to_f64(context.dt);
            if dt_omega > HELD && context.is_held(body) && !is_warned_of(warnings, body.handle) {
                warnings.push(stiff(body.handle, dt_omega, context));
            }
        }
    }

    /// The stiffness of the fields for a body.
    pub(crate) fn stiffness(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        body: RigidBodyHandle,
    ) -> Option<Stiffness> {
        let place = evaluation.place_of(body)?;
        self.prepare(context);
        let estimate = self.estimate(context, place);
        Some(report(context, &estimate))
    }
}

impl Integrator {
    /// Records the body that oscillates the fastest along its path within the step, beyond the limit of a scheme that
    /// does not choose.
    pub(super) fn note_ways(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        starts: &[Start],
        tracks: &[Track],
    ) {
        let Some(most) = most_to_follow(context) else {
            return;
        };
        let known = self.fastest.map_or(most, |(_, omega2)| omega2);
        let swings = starts.iter().zip(tracks);
        let swings = swings.map(|(start, track)| (start.place, track.sustained));
        let fastest = swings.filter(|(_, omega2)| *omega2 > known);
        let fastest = fastest.max_by(|one, other| one.1.total_cmp(&other.1));
        if let Some((place, omega2)) = fastest {
            self.fastest = Some((context.bodies[place].handle, omega2));
        }
    }

    /// Warns of the body that [`note_ways`](Self::note_ways) has recorded.
    pub(crate) fn warn_of_ways(
        &self,
        context: &StepContext<'_, impl Lookup>,
        warnings: &mut Vec<StepWarning>,
    ) {
        let Some((body, omega2)) = self
            .fastest
            .filter(|(body, _)| !is_warned_of(warnings, *body))
        else {
            return;
        };
        warnings.push(stiff(body, omega2.sqrt() * to_f64(context.dt), context));
    }
}

/// The (dt·ω)⁴ from which on a body is linearised, under a scheme that does not choose.
pub(crate) fn stiff_from(scheme: Scheme) -> Option<Real> {
    warns_from(scheme, false).map(|limit| from_f64(limit.powi(4)))
}

fn limit(context: &StepContext<'_, impl Lookup>) -> Option<f64> {
    warns_from(context.rules.scheme, context.compiled.reads_velocity)
}

/// The square of the highest frequency that a scheme that does not choose can follow.
pub(super) fn most_to_follow(context: &StepContext<'_, impl Lookup>) -> Option<f64> {
    let limit = limit(context)?;
    Some((limit / to_f64(context.dt)).powi(2))
}

/// True also for NaN.
fn exceeds(rate: f64, limit: f64) -> bool {
    rate.is_nan() || rate > limit
}

fn is_warned_of(warnings: &[StepWarning], body: RigidBodyHandle) -> bool {
    let tells = |it: &StepWarning| matches!(it, StepWarning::Stiff { body: it, .. } if *it == body);
    warnings.iter().any(tells)
}

/// The warning for a body that oscillates this fast.
fn stiff(
    body: RigidBodyHandle,
    dt_omega: f64,
    context: &StepContext<'_, impl Lookup>,
) -> StepWarning {
    let mode = Mode {
        omega2: (dt_omega / to_f64(context.dt)).powi(2),
        damping: 0.0,
        gyration: 0.0,
    };
    let scheme = match context.rules.scheme {
        Scheme::ExternalForce => return by_force(body, from_f64(dt_omega), context.dt),
        // For a scheme that chooses, the explicit kick counts; for the implicit one, its explicit part.
        scheme if scheme.chooses() => Scheme::KickDriftKick,
        Scheme::LinearlyImplicit => Scheme::Kick,
        scheme => scheme,
    };
    stiff_warning(
        body,
        from_f64(dt_omega),
        mode.largest_stable_dt(scheme, context.compiled.reads_velocity),
    )
}

/// The warning for forces given to Rapier, which gain energy at any step; at `dt_omega`, more than a percent in a
/// hundred steps.
fn by_force(body: RigidBodyHandle, dt_omega: Real, dt: Real) -> StepWarning {
    stiff_warning(body, dt_omega, to_f64(dt) * BY_FORCE / to_f64(dt_omega))
}

fn stiff_warning(body: RigidBodyHandle, dt_omega: Real, largest_stable_dt: f64) -> StepWarning {
    StepWarning::Stiff {
        body,
        dt_omega,
        largest_stable_dt: some_step(largest_stable_dt),
    }
}

/// The length of a step, which is never zero.
fn some_step(dt: f64) -> Real {
    from_f64(dt).max(Real::MIN_POSITIVE)
}

/// The warning for a linearised body, if there is one, and the rate by which warnings are compared.
fn judged(
    context: &StepContext<'_, impl Lookup>,
    evaluation: &Evaluation,
    estimate: &Estimate,
) -> Option<(f64, StepWarning)> {
    let (scheme, dt) = (context.rules.scheme, to_f64(context.dt));
    let limit = limit(context)?;
    let coupled = context.is_coupled();
    let share = if coupled { COUPLED.sqrt() } else { 1.0 };
    let rates = &estimate.rates;
    let rate = match scheme {
        Scheme::LinearlyImplicit => rates.divergence,
        _ => share * rates.omega,
    };
    let body = &context.bodies[estimate.place];
    let gains = || {
        let modes = estimate.modes(&Mobility::of(body), body.damping, coupled);
        modes.iter().any(|mode| mode.gains(scheme, dt))
    };
    let bad = exceeds(rate * dt, limit) || (rates.turns_by(dt) > 1.0 && gains());
    bad.then(|| {
        let report = report(context, estimate);
        let body = evaluation.bodies[estimate.place];
        let warning = match scheme {
            Scheme::LinearlyImplicit => stiff_warning(body, from_f64(rate * dt), limit / rate),
            Scheme::ExternalForce => by_force(body, report.dt_omega, context.dt),
            _ => stiff_warning(body, report.dt_omega, to_f64(report.largest_stable_dt)),
        };
        (rate, warning)
    })
}

fn report(context: &StepContext<'_, impl Lookup>, estimate: &Estimate) -> Stiffness {
    let body = &context.bodies[estimate.place];
    let scheme = context.rules.scheme;
    let coupled = scheme != Scheme::LinearlyImplicit && context.is_coupled();
    let largest = if scheme == Scheme::ExternalForce {
        // ω may be −0.0.
        BY_FORCE / estimate.rates.omega.abs()
    } else {
        let reads_velocity = context.compiled.reads_velocity;
        let modes = estimate.modes(&Mobility::of(body), body.damping, coupled);
        let stable = modes.map(|mode| mode.largest_stable_dt(scheme, reads_velocity));
        stable.into_iter().fold(f64::INFINITY, f64::min)
    };
    estimate.rates.report(context.dt, some_step(largest))
}

/// The warning for a body between springs of contacts, whose ω² there is at most `omega2`: springs act as kicks once a
/// step under every scheme.
pub(crate) fn warn_of_springs(body: RigidBodyHandle, omega2: f64, dt: Real) -> Option<StepWarning> {
    let omega = omega2.sqrt();
    let dt_omega = omega * to_f64(dt);
    let warned = dt_omega > SPRINGS_FROM;
    warned.then(|| stiff_warning(body, from_f64(dt_omega), 2.0 / omega))
}

/// The dt·ω from which on springs warn. A bounce off a spring multiplies the energy by at most 1/(1 − (dt·ω)²/4), which
/// is 16/15 here.
const SPRINGS_FROM: f64 = 0.5;

/// Warns of the bodies that Rapier will slow down without a report of its own, and of those too far from the origin.
pub(crate) fn warn_of_caps(
    context: &StepContext<'_, impl Lookup>,
    motions: &Motions,
    warnings: &mut Vec<StepWarning>,
) {
    let caps = context.rules.caps;
    let look_up = |body: RigidBodyHandle| context.world.body(body);
    for update in &motions.updates {
        let place = look_up(update.body).map(RigidBody::translation);
        warnings.extend(place.and_then(|it| caps.of_place(update.body, it, update.linvel)));
    }
    let updates = motions.updates.iter();
    let updates = updates.map(|it| (it.body, [it.linvel, it.angvel].map(Vector::length)));
    let loads = motions.loads.iter().map(|load| (load.body, load.speeds));
    for (body, speeds) in updates.chain(loads) {
        warnings.extend(caps.of_speed(body, speeds[0]));
        warnings.extend(caps.of_turn(body, speeds[1], look_up(body)));
    }
}
