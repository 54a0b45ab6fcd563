//! The derivatives by velocity of the wrenches on bodies, for which kicks are solved.

use super::coupling::{LinearisedWrench, Slope};
use super::evaluation::Evaluation;
use super::jacobian;
use super::stiffness::Estimate;
use super::{Integrator, StepContext};
use crate::eval::Terms;
use crate::math::{Vector, to_dvec3};
use crate::rapier::na::Vector6;
use crate::rigid::{Lookup, Wrench, of_wrench, velocities};

impl Integrator {
    /// The wrench of the terms that read velocities on a body, and its slope: for drag and wind from the last
    /// evaluation, for other fields from the lineariser.
    fn by_velocity(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        place: usize,
    ) -> (Vector6<f64>, Slope) {
        let mut of_terms = |terms: Terms| {
            let frames = self.motions.frames(context, &[], 0.0);
            let (scene, angvel) = (context.sampled(&frames), context.bodies[place].angvel);
            let angvel = to_dvec3(angvel);
            let own = jacobian::of_body(&mut self.lineariser, &scene, terms, place, angvel);
            (own.wrench, Slope::of_body(&own.by_velocity))
        };
        let Some(drags) = self.slowings.on(place) else {
            return of_terms(Terms::ThatReadVelocities);
        };
        let slope = Slope::of_drags(&drags);
        if !context.compiled.reads_velocity_otherwise {
            return (drags.wrench, slope);
        }
        let other = of_terms(Terms::ThatReadVelocitiesOtherwise);
        (drags.wrench + other.0, slope.plus(&other.1))
    }

    /// Sets the couplings: the derivatives by velocity, for which kicks are solved.
    pub(super) fn couple(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
    ) {
        if !context.compiled.reads_velocity {
            return;
        }
        let closed = self.slowings.of_any() && !context.compiled.reads_velocity_otherwise;
        if !closed {
            self.prepare(context);
        }
        evaluation.couplings.clear();
        for place in 0..evaluation.bodies.len() {
            let (wrench, body) = (evaluation.wrenches[place], &context.bodies[place]);
            let evaluated = of_wrench(wrench);
            let felt = wrench != Wrench::ZERO;
            // Drag acts on a body that begins at rest, too, once it moves.
            let still = !body.sleeping && [body.linvel, body.angvel] == [Vector::ZERO; 2];
            let mut coupling = None;
            if (felt || still) && !evaluation.is_left_out(place) {
                let (part, slope) = self.by_velocity(context, place);
                if felt || !slope.is_zero() {
                    let sampled_at = velocities(body);
                    // Other terms may be weaker by any factor, and are not to be lost.
                    let in_part = context.compiled.ignores_velocity_in_part;
                    let precise = if in_part { &evaluated } else { &part };
                    coupling = Some(LinearisedWrench::new(
                        precise, slope, &evaluated, sampled_at,
                    ));
                }
            }
            evaluation.couplings.push(coupling);
        }
    }

    /// Computes the couplings of linearised bodies from their Jacobians, and removes couplings that are not finite.
    pub(super) fn couple_candidates(evaluation: &mut Evaluation) {
        let Evaluation {
            couplings,
            estimates,
            ..
        } = evaluation;
        for Estimate {
            place, jacobian, ..
        } in estimates
        {
            let Some(Some(coupling)) = couplings.get_mut(*place) else {
                continue;
            };
            let slope = Slope::of_body(&jacobian.by_velocity);
            let evaluated = of_wrench(evaluation.wrenches[*place]);
            let sampled_at = coupling.sampled_at;
            *coupling = LinearisedWrench::new(&jacobian.wrench, slope, &evaluated, sampled_at);
        }
        for coupling in couplings {
            let finite = |it: &mut LinearisedWrench| it.slope.is_finite();
            if !coupling.as_mut().is_some_and(finite) {
                *coupling = None;
            }
        }
    }
}
