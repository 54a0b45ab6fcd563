//! Follows bodies on which forces have changed much within a step, and adds up the errors of their energies.

use super::begun::BegunStep;
use super::edges::{Edges, FOLLOWED_FROM};
use super::evaluation::Evaluation;
use super::motion::{Completion, Start};
use super::secant::fourth_power;
use super::substeps::{Passage, SubstepIntegrator};
use super::{Integrator, StepContext};
use crate::math::{DQuat, Real, Vector, from_f64, to_dvec3, to_f64};
use crate::rigid::{Lookup, RigidState, Wrench};

/// The number of points at which the work along a way is evaluated.
const POINTS: u32 = 32;

/// At most this number of bodies are noted in the first half of a step.
const NOTED: usize = 64;

impl Integrator {
    /// Follows the bodies that were kicked at both ends of their way, and adds their errors.
    pub(crate) fn follow(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        begun: &BegunStep<'_>,
        edges: &mut Edges,
    ) {
        let Some(last) = begun
            .last
            .filter(|_| context.dt > 0.0 && context.compiled.varies())
        else {
            return;
        };
        let (dt, least) = (to_f64(context.dt), edges.followed_from());
        self.motions.clear();
        for (place, body) in context.bodies.iter().enumerate() {
            let wrenches = [last.wrenches[place], evaluation.wrenches[place]];
            let shown = fourth_power(context, place, wrenches[1], wrenches[0]);
            let is_large = shown > least && edges.has_room_for(body.handle);
            if !is_large || !is_alone(context, evaluation, place) {
                continue;
            }
            let completion = begun.motions.completion(body.handle);
            let is_kicked = completion.is_none_or(|it| it == Completion::Free);
            let is_hit = begun.hit(body.handle).is_some();
            if !is_kicked || is_hit || evaluation.missed.binary_search(&place).is_ok() {
                continue;
            }
            let mut state = RigidState::new(body, true);
            let turned = DQuat::from_scaled_axis(state.angvel * -dt);
            state.start = (state.position - state.linvel * dt, turned * state.attitude);
            let passage = Passage {
                place,
                state,
                wrenches,
                is_kicked: true,
                from: -dt,
                dt,
            };
            self.settle(context, &passage, edges);
        }
    }

    /// [`Self::follow`] for schemes that kick once a step, by the places since the `last` evaluation.
    pub(crate) fn follow_once(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        last: &Evaluation,
        edges: &mut Edges,
    ) {
        let same = last.bodies == evaluation.bodies && last.centres.len() == last.bodies.len();
        let kicks = context.rules.scheme.kicks_once();
        if !(same && kicks) || last.dt == 0.0 || !context.compiled.varies() {
            return;
        }
        let (dt, least) = (last.dt, edges.followed_from());
        self.motions.clear();
        for (place, body) in context.bodies.iter().enumerate() {
            let wrenches = [last.wrenches[place], evaluation.wrenches[place]];
            let turned = wrenches.iter().any(|it| it.torque != Vector::ZERO);
            let way = evaluation.centres[place] - last.centres[place];
            let is_large = changes_much(wrenches, body.inv_mass * dt * dt, way, least)
                && edges.has_room_for(body.handle);
            let most = body.linvel.length() + (wrenches[0].force * body.inv_mass).length() * dt;
            // A longer way is no motion.
            let leaps = way.length() > 2.0 * most * dt;
            if !is_large || turned || leaps || !is_alone(context, evaluation, place) {
                continue;
            }
            let mut state = RigidState::new(body, true);
            state.start.0 = to_dvec3(last.centres[place]);
            state.linvel = to_dvec3(way) / to_f64(dt);
            state.began.0 = state.linvel;
            let passage = Passage {
                place,
                state,
                wrenches,
                is_kicked: true,
                from: -to_f64(dt),
                dt: to_f64(dt),
            };
            self.settle(context, &passage, edges);
        }
    }

    /// [`Self::follow`] for the bodies that were moved within the step.
    pub(crate) fn follow_moved(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        edges: &mut Edges,
    ) {
        let passages = std::mem::take(&mut self.passages);
        self.motions.clear();
        for passage in &passages {
            self.settle(context, passage, edges);
        }
        self.passages = passages;
        self.passages.clear();
    }

    /// Notes bodies that have been moved and whose force has changed much; not all of them if there are many.
    pub(super) fn note_passages(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &Evaluation,
        starts: &[Start],
        substeps: &SubstepIntegrator,
    ) {
        // The bodies that carry fields would have to be moved with them.
        if context.is_coupled() {
            return;
        }
        let (dt, least) = (context.dt, from_f64(FOLLOWED_FROM * FOLLOWED_FROM));
        for (number, start) in starts.iter().enumerate() {
            let (place, body) = (start.place, &context.bodies[start.place]);
            let wrenches = [evaluation.wrenches[place], substeps.wrench(number)];
            let turned = wrenches[0].torque != wrenches[1].torque;
            let pull = body.inv_mass * dt * dt;
            let is_large = turned || changes_much(wrenches, pull, body.linvel * dt, least);
            if !is_large || !is_alone(context, evaluation, place) {
                continue;
            }
            if self.passages.len() < NOTED {
                self.passages.push(Passage {
                    place,
                    state: substeps.states[number].clone(),
                    wrenches,
                    is_kicked: false,
                    from: 0.0,
                    dt: to_f64(dt),
                });
            }
        }
    }

    /// Adds the error of a body whose force has changed abruptly.
    fn settle(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        passage: &Passage,
        edges: &mut Edges,
    ) {
        let change = passage.change();
        let Some(least) = edges.look(&change) else {
            return;
        };
        let mut error = |points| {
            let (substeps, motions) = (&mut self.substeps, &self.motions);
            passage.given() - substeps.work_along(context, motions, passage, points)
        };
        if error(1).abs() > least {
            edges.add(change.body, error(POINTS));
        }
    }
}

/// Returns true if the force on a body has changed so much over its way that its displacement by the change exceeds a
/// share of the way. `pull` is the displacement by a unit of force; shares are compared by their squares.
fn changes_much(wrenches: [Wrench; 2], pull: Vector, way: Vector, least: Real) -> bool {
    let change = (wrenches[1].force - wrenches[0].force) * pull;
    change.length_squared() > least * way.length_squared()
}

/// Returns true if only fields that read no velocities change the energy of a body, gravity apart.
fn is_alone(context: &StepContext<'_, impl Lookup>, evaluation: &Evaluation, place: usize) -> bool {
    let body = &context.bodies[place];
    let slowed = evaluation.couplings.get(place).is_some_and(Option::is_some);
    !slowed && body.damping == [0.0; 2] && !body.sleeping && !context.is_held(body)
}
