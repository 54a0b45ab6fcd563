//! Who is in stiff fields: noticed by how wrenches change along the way, and then looked into.

use super::error::StepError;
use super::implicit::Coupling;
use super::jacobian::{self, Jacobian};
use super::predicted::{PredictedFrames, PredictedMotion};
use super::stiffness::{Rates, StepWarning, Treatment};
use super::{Injector, Scheme, assign};
use crate::compile::Prepared;
use crate::eval::Evaluator;
use crate::math::{ColliderSet, Real, RigidBodyHandle, RigidBodySet, Vector, to_f64};
use crate::rapier::dynamics::RigidBody;
use crate::rapier::na::Vector6;
use crate::rigid::Wrench;
use crate::rigid::{Mobility, pair};
use crate::sample::Samples;

/// From this (dt·ω)² on a scheme that does not choose warns; its limit is 4.
const WARNING: Real = 1.0;

/// A body is looked into at this share of the (dt·ω)² that would change what is done with it:
/// along its way it need not meet the stiffest direction.
const CAUTION: f64 = 0.25;

/// What is known of the last evaluation beyond the wrenches.
#[derive(Default)]
pub(super) struct Watch {
    /// The wrenches before those, if they were on the same bodies.
    pub last: Vec<Wrench>,
    /// The velocities that the fields saw; empty if none reads them.
    pub sampled_at: Vec<Vector6<f64>>,
    /// By place; empty if no field reads velocities, or the scheme samples them as they are.
    pub couplings: Vec<Option<Coupling>>,
    /// Of bodies that were looked into, by place.
    pub(super) verdicts: Vec<Verdict>,
    /// Bodies that were found stiff, in the order of their handles.
    pub(super) stiff: Vec<RigidBodyHandle>,
    scout: Evaluator,
}

/// What was found out about a body.
pub(super) struct Verdict {
    pub place: usize,
    pub treatment: Treatment,
    pub jacobian: Jacobian,
    pub rates: Rates,
}

impl Watch {
    /// Forgets what the next evaluation makes stale.
    pub(super) fn forget(&mut self) {
        self.sampled_at.clear();
        self.couplings.clear();
        self.verdicts.clear();
    }

    pub(super) fn verdict(&self, place: usize) -> Option<&Verdict> {
        let found = self.verdicts.binary_search_by_key(&place, |v| v.place);
        found.ok().map(|found| &self.verdicts[found])
    }

    pub(super) fn treatment(&self, place: usize) -> Treatment {
        if self.verdicts.is_empty() {
            return Treatment::KickDriftKick;
        }
        let verdict = self.verdict(place);
        verdict.map_or(Treatment::KickDriftKick, |verdict| verdict.treatment)
    }
}

impl Injector {
    /// After an evaluation that the step before did not make: judges the bodies for schemes that
    /// want it, and prepares kicks by forces that read velocities.
    pub(super) fn predict(
        &mut self,
        compiled: Prepared<'_>,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Result<(), StepError> {
        if dt == 0.0 {
            return Ok(());
        }
        if self.scheme == Scheme::LinearlyImplicit {
            let all = 0..self.samples.bodies.len();
            self.judge_all(compiled, all, dt, bodies, colliders);
        } else if self.scheme.choice().is_some() && may_be_stiff(compiled) {
            let ahead = self.scout(compiled, dt, bodies, colliders);
            let candidates = self.candidates(|place| {
                let (there, change) = &ahead[place];
                let body = bodies.get(self.samples.bodies[place]);
                let here = self.wrenches[place];
                body.map_or(0.0, |body| {
                    secant(body, here, *there, Some(change), dt).powi(2)
                })
            });
            self.judge_all(compiled, candidates.into_iter(), dt, bodies, colliders);
        }
        self.couple(compiled, bodies, colliders);
        Ok(())
    }

    /// After the evaluation that follows Rapier's step: the same, by how the wrenches changed.
    pub(super) fn update(
        &mut self,
        compiled: Prepared<'_>,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) {
        if dt == 0.0 || !may_be_stiff(compiled) {
            return;
        }
        let last = std::mem::take(&mut self.watch.last);
        if self.scheme.choice().is_some() {
            let candidates = if last.len() == self.wrenches.len() {
                self.candidates(|place| self.fourth_power(place, last[place], dt, bodies))
            } else {
                (0..self.wrenches.len()).collect()
            };
            self.judge_all(compiled, candidates.into_iter(), dt, bodies, colliders);
        } else if last.len() == self.wrenches.len() {
            self.warn(compiled, dt, &last, bodies, colliders);
        }
        self.watch.last = last;
        self.couple(compiled, bodies, colliders);
    }

    /// Warns of the body whose wrench changed the most, if that is because the fields are stiff
    /// and not because it passed an edge.
    fn warn(
        &mut self,
        compiled: Prepared<'_>,
        dt: Real,
        last: &[Wrench],
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) {
        // Of (dt·ω)⁴, which takes no root.
        let mut worst = (WARNING * WARNING, None);
        for (place, was) in last.iter().enumerate() {
            let fourth = self.fourth_power(place, *was, dt, bodies);
            if fourth > worst.0 {
                worst = (fourth, Some(place));
            }
        }
        let Some(place) = worst.1 else {
            return;
        };
        self.lineariser.prepare(&compiled, &(bodies, colliders));
        let Some(verdict) = self.judge(compiled, place, bodies, colliders) else {
            return;
        };
        let report = verdict.rates.report(dt);
        if report.dt_omega > WARNING {
            self.warnings.push(StepWarning::Stiff {
                body: self.samples.bodies[place],
                dt_omega: report.dt_omega,
                largest_stable_dt: report.largest_stable_dt,
            });
        }
    }

    /// (dt·ω)⁴ as it shows in how a wrench changed over the last step.
    fn fourth_power(&self, place: usize, was: Wrench, dt: Real, bodies: &RigidBodySet) -> Real {
        let is = self.wrenches[place];
        if is == was {
            return 0.0;
        }
        if is.torque != was.torque {
            let body = bodies.get(self.samples.bodies[place]);
            return body.map_or(0.0, |body| secant(body, is, was, None, dt).powi(2));
        }
        // What the sample knows does for a force alone, without a look at the body.
        let centre = &self.samples.centres[place];
        let pull = (is.force - was.force).length_squared() * (dt * dt);
        pull / (centre.velocity.length_squared() * (centre.mass * centre.mass))
    }

    /// The wrenches where bodies would be after a step, and the changes of velocity on the way.
    fn scout(
        &mut self,
        compiled: Prepared<'_>,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Vec<(Wrench, Vector6<f64>)> {
        let mut samples = Samples::default();
        samples.list.clone_from(&self.samples.list);
        samples.centres.clone_from(&self.samples.centres);
        samples.bodies.clone_from(&self.samples.bodies);
        samples.user.clone_from(&self.samples.user);
        samples.spreads.clone_from(&self.samples.spreads);
        samples.overrides.clone_from(&self.samples.overrides);
        samples.sites = self.samples.sites;
        samples.number();
        self.roles.clear();
        let mut changes = Vec::with_capacity(samples.bodies.len());
        let mut ways: Vec<(Vector, Vector)> = Vec::with_capacity(samples.bodies.len());
        for (handle, wrench) in samples.bodies.iter().zip(&self.wrenches) {
            let Some(body) = bodies.get(*handle).filter(|body| !body.is_sleeping()) else {
                changes.push(Vector6::zeros());
                ways.push((Vector::ZERO, Vector::ZERO));
                continue;
            };
            let change = Mobility::of(body).apply(&crate::rigid::of_wrench(*wrench));
            let change = change * to_f64(dt);
            let (linear, angular) = crate::rigid::rounded(&change);
            let (linvel, angvel) = (body.linvel() + linear, body.angvel() + angular);
            ways.push((linvel, angvel));
            changes.push(change);
            assign(
                &mut self.roles,
                *handle,
                PredictedMotion::CoastsAt { linvel, angvel },
            );
        }
        for sample in &mut samples.list {
            let (linvel, angvel) = ways[sample.body as usize];
            let turned = sample.arm + angvel.cross(sample.arm) * dt;
            sample.world_point += linvel * dt + turned - sample.arm;
            sample.arm = turned;
        }
        for (centre, (linvel, _)) in samples.centres.iter_mut().zip(&ways) {
            centre.world_point += *linvel * dt;
        }
        let trial = PredictedFrames {
            bodies,
            colliders,
            roles: &self.roles,
            states: &[],
            elapsed: to_f64(dt),
            dt: to_f64(dt),
        };
        let moment = self.moment(dt);
        let mut wrenches = Vec::new();
        let scout = &mut self.watch.scout;
        scout.wrenches(&compiled, &trial, &samples, moment, &mut wrenches);
        wrenches.into_iter().zip(changes).collect()
    }

    /// Bodies whose (dt·ω)⁴, as far as it shows, makes them worth a look, in the order of their
    /// places; with those found stiff before.
    fn candidates(&self, fourth_power: impl Fn(usize) -> Real) -> Vec<usize> {
        let Some(choice) = self.scheme.choice() else {
            return Vec::new();
        };
        let bound = (CAUTION * 4.0 * choice.tolerance).powi(2);
        let reads_velocity = !self.watch.sampled_at.is_empty();
        let is_suspect = |place: &usize| {
            if reads_velocity && self.wrenches[*place] != Wrench::ZERO {
                return true;
            }
            let shown = to_f64(fourth_power(*place));
            let was_stiff =
                || super::find(&self.watch.stiff, self.samples.bodies[*place]).is_some();
            shown.is_nan() || shown > bound || (!self.watch.stiff.is_empty() && was_stiff())
        };
        (0..self.samples.bodies.len()).filter(is_suspect).collect()
    }

    /// Looks into some bodies, given in the order of their places.
    fn judge_all(
        &mut self,
        compiled: Prepared<'_>,
        places: impl Iterator<Item = usize>,
        dt: Real,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) {
        self.watch.stiff.clear();
        let mut places = places.peekable();
        if places.peek().is_some() {
            self.lineariser.prepare(&compiled, &(bodies, colliders));
        }
        for place in places {
            let Some(mut verdict) = self.judge(compiled, place, bodies, colliders) else {
                continue;
            };
            if let Some(choice) = self.scheme.choice() {
                verdict.treatment = verdict.rates.treatment(to_f64(dt), choice);
                if verdict.treatment != Treatment::KickDriftKick {
                    self.watch.stiff.push(self.samples.bodies[place]);
                }
            }
            self.watch.verdicts.push(verdict);
        }
    }

    /// Looks into a body, in the world the lineariser was prepared for.
    pub(super) fn judge(
        &mut self,
        compiled: Prepared<'_>,
        place: usize,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) -> Option<Verdict> {
        let body = bodies.get(self.samples.bodies[place])?;
        let jacobian = self.jacobian(compiled, place, body, (bodies, colliders));
        Some(Verdict {
            place,
            treatment: Treatment::Implicit,
            rates: Rates::new(&jacobian, &Mobility::of(body)),
            jacobian,
        })
    }

    /// In the world the lineariser was prepared for.
    fn jacobian(
        &mut self,
        compiled: Prepared<'_>,
        place: usize,
        body: &RigidBody,
        world: (&RigidBodySet, &ColliderSet),
    ) -> Jacobian {
        let moment = self.moment(self.evaluated_dt);
        let angvel = crate::math::to_dvec3(body.angvel());
        let angvel = match self.watch.sampled_at.get(place) {
            Some(velocities) => pair(velocities).1,
            None => angvel,
        };
        let (lineariser, samples) = (&mut self.lineariser, &self.samples);
        jacobian::of_body(
            lineariser,
            (compiled, &world),
            samples,
            place,
            moment,
            angvel,
        )
    }

    /// Takes the derivatives by velocity, for schemes whose kicks solve for it.
    fn couple(&mut self, compiled: Prepared<'_>, bodies: &RigidBodySet, colliders: &ColliderSet) {
        if !compiled.reads_velocity || !self.scheme.kicks_twice() {
            return;
        }
        let world = (bodies, colliders);
        self.lineariser.prepare(&compiled, &world);
        for place in 0..self.samples.bodies.len() {
            let mut coupling = None;
            if self.wrenches[place] != Wrench::ZERO
                && let Some(body) = bodies.get(self.samples.bodies[place])
            {
                let known = self.watch.verdict(place).map(|verdict| verdict.jacobian);
                let jacobian = known.unwrap_or_else(|| self.jacobian(compiled, place, body, world));
                let by_velocity = jacobian.by_velocity;
                let usable = by_velocity.iter().all(|entry| entry.is_finite());
                coupling = usable.then_some(Coupling {
                    by_velocity,
                    sampled_at: self.watch.sampled_at[place],
                });
            }
            self.watch.couplings.push(coupling);
        }
    }
}

/// Whether any force may change from place to place.
fn may_be_stiff(compiled: Prepared<'_>) -> bool {
    compiled.varies()
}

/// (dt·ω)² as it shows in the wrenches at the two ends of a way: how much the acceleration
/// changed, against the way in units of dt². `change`: of the velocity, before the way.
fn secant(
    body: &RigidBody,
    here: Wrench,
    there: Wrench,
    change: Option<&Vector6<f64>>,
    dt: Real,
) -> Real {
    let properties = body.mass_properties();
    let (inv_mass, inv_inertia) = (
        properties.effective_inv_mass,
        properties.effective_world_inv_inertia,
    );
    let linear = (here.force - there.force) * inv_mass;
    let angular = inv_inertia * (here.torque - there.torque);
    if linear == Vector::ZERO && angular == Vector::ZERO {
        return 0.0;
    }
    let (mut linvel, mut angvel) = (body.linvel(), body.angvel());
    if let Some(change) = change {
        let (more, twist) = crate::rigid::rounded(change);
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
