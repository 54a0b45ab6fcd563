//! The evaluation: the wrenches of the fields on bodies at one moment, from which motions are computed.

use std::collections::HashSet;
use std::fmt::Debug;

use super::balance::EnergyBalance;
use super::coupling::LinearisedWrench;
use super::fault::Fault;
use super::predicted::PredictedMotion;
use super::stiffness::{Estimate, StiffMethod};
use super::{Integrator, StepContext};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::rigid::{Body, Lookup, PartsMark, Wrench, find, find_next_place, is_in_order};

/// The wrenches on some bodies, with derivatives and the methods for stiff bodies. Unless something changes, the next
/// step begins with the evaluation at the end of this one.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Evaluation {
    /// The step for which it was made: a change of velocity counts as a force over this time.
    pub dt: Real,
    /// In the order of their handles.
    pub bodies: Vec<RigidBodyHandle>,
    pub wrenches: Vec<Wrench>,
    /// The centres of mass, in world space, under schemes that do not kick twice a step; else empty.
    pub centres: Vec<Vector>,
    /// The colliders of each body.
    pub parts: Vec<PartsMark>,
    /// The linearised wrench on each body; empty if no field reads velocities, or the step has no length.
    pub couplings: Vec<Option<LinearisedWrench>>,
    /// True if the next step has to evaluate forces again: because the last kick changed those that read velocities, or
    /// bodies were placed or disabled since.
    pub outdated: bool,
    /// The linearisations of bodies that have one, in the order of their places.
    pub estimates: Vec<Estimate>,
    /// The methods for bodies that are not simply kicked, with their places, in the order of these.
    pub stiff_methods: Vec<(usize, StiffMethod)>,
    /// The places of bodies whose step is to be repeated with a finer plan, in order.
    #[cfg_attr(feature = "serde-serialize", serde(skip))]
    pub missed: Vec<usize>,
    /// The places of bodies whose wrenches lack some contributions, in order. Their derivatives are not used.
    pub left_out: Vec<usize>,
}

impl Evaluation {
    /// The place of a body.
    pub(crate) fn place_of(&self, body: RigidBodyHandle) -> Option<usize> {
        find(&self.bodies, body)
    }

    pub(super) fn estimate(&self, place: usize) -> Option<&Estimate> {
        let found = self.estimates.binary_search_by_key(&place, |e| e.place);
        found.ok().map(|found| &self.estimates[found])
    }

    pub(super) fn stiff_method(&self, place: usize) -> Option<StiffMethod> {
        let found = self.stiff_methods.binary_search_by_key(&place, |it| it.0);
        found.ok().map(|found| self.stiff_methods[found].1)
    }

    /// The balance of a body in the steps before this one.
    pub(super) fn balance(&self, place: usize) -> EnergyBalance {
        match self.stiff_method(place) {
            Some(StiffMethod::Resolve { balance, .. }) => balance,
            _ => EnergyBalance::default(),
        }
    }

    /// Takes over the balances of bodies that were and are moved within steps.
    pub(super) fn carry_balances(&mut self, last: &Evaluation) {
        if last.stiff_methods.is_empty() {
            return;
        }
        for (place, stiff_method) in &mut self.stiff_methods {
            if let StiffMethod::Resolve { balance, .. } = stiff_method
                && let Some(before) = last.place_of(self.bodies[*place])
            {
                *balance = last.balance(before);
            }
        }
    }

    /// The wrench on a body, if it was sampled.
    pub(crate) fn wrench(&self, body: RigidBodyHandle) -> Option<Wrench> {
        self.wrenches.get(self.place_of(body)?).copied()
    }

    pub(crate) fn clear(&mut self) {
        self.bodies.clear();
        self.wrenches.clear();
        self.centres.clear();
        self.parts.clear();
        self.couplings.clear();
        self.estimates.clear();
        self.stiff_methods.clear();
        self.missed.clear();
        self.left_out.clear();
        self.outdated = false;
    }

    /// A description of the first value that is not valid, for an evaluation that was deserialized.
    pub(crate) fn amiss(&self) -> Option<String> {
        let count = self.bodies.len();
        if !(self.dt >= 0.0 && self.dt.is_finite()) {
            return Some(format!("dt is {}", self.dt));
        }
        if !is_in_order(&self.bodies, |body| *body) {
            return Some("bodies are out of order".to_owned());
        }
        let lengths = [
            ("wrenches", self.wrenches.len(), false),
            ("centres", self.centres.len(), true),
            ("parts", self.parts.len(), false),
            ("couplings", self.couplings.len(), true),
        ];
        for (name, length, or_none) in lengths {
            if length != count && !(or_none && length == 0) {
                return Some(format!("{name} has {length} entries of {count} bodies"));
            }
        }
        let places = [
            (
                "estimates",
                places(self.estimates.iter().map(|it| it.place), count),
            ),
            (
                "stiff_methods",
                places(self.stiff_methods.iter().map(|it| it.0), count),
            ),
            ("left_out", places(self.left_out.iter().copied(), count)),
        ];
        for (name, place) in places {
            if let Some(place) = place {
                return Some(format!("{name} has the place {place} of {count} bodies"));
            }
        }
        let coupled = |it: &Option<LinearisedWrench>| it.as_ref().is_none_or(|it| it.is_finite());
        first_unsound(&self.wrenches, "wrenches", Wrench::is_finite)
            .or_else(|| first_unsound(&self.centres, "centres", |it| it.is_finite()))
            .or_else(|| first_unsound(&self.couplings, "couplings", coupled))
            .or_else(|| first_unsound(&self.estimates, "estimates", Estimate::is_sound))
            .or_else(|| first_unsound(&self.stiff_methods, "stiff_methods", |it| it.1.is_sound()))
    }

    /// Makes this the evaluation of `bodies`: the wrenches are those of `found` for bodies at `places`, of `last` for
    /// others.
    pub(crate) fn join(
        &mut self,
        bodies: &[Body],
        last: &Evaluation,
        places: &[usize],
        found: &Evaluation,
    ) {
        self.clear();
        self.dt = last.dt;
        let mut found = places.iter().zip(&found.wrenches).peekable();
        let mut at = 0;
        for (place, body) in bodies.iter().enumerate() {
            let wrench = match found.next_if(|found| *found.0 == place) {
                Some((_, wrench)) => *wrench,
                None => find_next_place(&last.bodies, &mut at, body.handle)
                    .map_or(Wrench::ZERO, |at| last.wrenches[at]),
            };
            self.bodies.push(body.handle);
            self.parts.push(body.parts);
            self.wrenches.push(wrench);
        }
    }

    /// Replaces the wrenches of a fault by what remains of them.
    pub(crate) fn leave_out(&mut self, fault: &Fault, left: &[Wrench]) {
        for (place, left) in fault.places.iter().zip(left) {
            self.wrenches[*place] = *left;
        }
        self.left_out.clone_from(&fault.places);
    }

    pub(super) fn is_left_out(&self, place: usize) -> bool {
        self.left_out.binary_search(&place).is_ok()
    }

    /// Removes some bodies.
    pub(crate) fn remove(&mut self, gone: &[RigidBodyHandle]) {
        let gone: HashSet<_> = gone.iter().collect();
        let mut count = 0;
        let place = |body: &RigidBodyHandle| {
            let stays = !gone.contains(body);
            count += usize::from(stays);
            stays.then(|| count - 1)
        };
        let places: Vec<Option<usize>> = self.bodies.iter().map(place).collect();
        keep(&mut self.bodies, &places);
        keep(&mut self.wrenches, &places);
        keep(&mut self.centres, &places);
        keep(&mut self.parts, &places);
        keep(&mut self.couplings, &places);
        let moved = |place: &mut usize| places[*place].map(|now| *place = now).is_some();
        self.estimates.retain_mut(|it| moved(&mut it.place));
        self.stiff_methods.retain_mut(|it| moved(&mut it.0));
        self.missed.retain_mut(moved);
        self.left_out.retain_mut(moved);
    }
}

/// The first of some places that is out of order, or not less than `count`.
fn places(mut all: impl Iterator<Item = usize>, count: usize) -> Option<usize> {
    let mut next = 0;
    all.find(|place| {
        let bad = *place < next || *place >= count;
        next = place.saturating_add(1);
        bad
    })
}

/// A description of the first entry of a list that is not sound.
pub(crate) fn first_unsound<T: Debug>(
    list: &[T],
    name: &str,
    is_sound: impl Fn(&T) -> bool,
) -> Option<String> {
    let place = list.iter().position(|it| !is_sound(it))?;
    Some(format!("{name}[{place}] is {:?}", list[place]))
}

/// Keeps the entries of a list whose new place is `Some`. The list may be empty.
fn keep<T>(list: &mut Vec<T>, places: &[Option<usize>]) {
    let mut places = places.iter();
    list.retain(|_| places.next().is_some_and(Option::is_some));
}

impl Integrator {
    /// Evaluates the wrenches on the bodies of the context, at the places of their samples.
    pub(crate) fn evaluate(
        &mut self,
        context: &StepContext<'_, impl Lookup>,
        evaluation: &mut Evaluation,
    ) -> Result<(), Fault> {
        evaluation.clear();
        evaluation.dt = context.dt;
        evaluation.bodies.extend_from_slice(&context.samples.bodies);
        let parts = context.bodies.iter().map(|body| body.parts);
        evaluation.parts.extend(parts);
        self.motions.clear();
        if !context.rules.scheme.kicks_twice() {
            let centres = context.samples.centres.iter();
            evaluation
                .centres
                .extend(centres.map(|centre| centre.world_point));
        }
        if context.compiled.reads_velocity {
            // Fields anchored to bodies move with the velocities of these bodies.
            for body in context.bodies {
                let (linvel, angvel) = (body.linvel, body.angvel);
                self.motions
                    .assign(body.handle, PredictedMotion::CoastsAt { linvel, angvel });
            }
        }
        let frames = self.motions.frames(context, &[], 0.0);
        let scene = context.sampled(&frames);
        let wrenches = &mut evaluation.wrenches;
        self.slowings.start(0);
        let slowings = context.compiled.reads_velocity.then(|| {
            self.slowings.start(context.samples.bodies.len());
            &mut self.slowings
        });
        self.evaluator.wrenches(&scene, wrenches, slowings);
        Fault::of_wrenches(wrenches, &scene).map_or(Ok(()), Err)
    }
}
