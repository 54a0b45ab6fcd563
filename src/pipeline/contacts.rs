//! Contacts of a step: hooks before Rapier's step, and detection and answers after it.

use std::sync::Arc;

use super::scene::moment;
use super::timings::span;
use super::{Definition, FieldPipeline, FieldState, OpenStep};
use crate::bridge::{self, WorldMut, WorldRef};
use crate::contact::{
    Arrival, FieldContact, Given, HandOver, HeldPairs, Joints, KickShare, PairOutcomes, PairOwner,
    Pairs, SweptStep, report,
};
use crate::integrate::{
    Caps, Completion, Evaluation, FASTEST, StepWarning, TurnAfter, warn_of_springs,
};
use crate::math::Vector;
use crate::rapier::pipeline::ActiveHooks;
use crate::rigid::Lookup;

impl FieldPipeline {
    /// Records the bodies at the start of the step, before fields act on them, for contacts.
    pub(super) fn note_starts(&mut self, world: &WorldMut<'_>) {
        if !self.scene.compiled.detectors.is_empty() {
            let starts = Arc::make_mut(&mut self.detector.starts);
            starts.before(&world.view(), world.gravity, world.integration_parameters);
        }
    }

    /// Records the bodies after the first kicks, for contacts.
    pub(super) fn note_kicks(
        &mut self,
        fields: &Definition<'_>,
        evaluation: Option<&Evaluation>,
        world: &WorldMut<'_>,
    ) {
        if self.scene.compiled.detectors.is_empty() {
            return;
        }
        let motions = &self.motions;
        let turns = motions.turns.iter();
        let momenta = turns.filter_map(|turn| match turn.after {
            TurnAfter::Momentum(momentum) => Some((turn.body, [momentum, turn.twist])),
            TurnAfter::Velocity(_) => None,
        });
        let whole = fields.settings.scheme.kicks_once();
        let arrival = |body| {
            Some(Arrival {
                linvel: motions.arrival(body)?,
                first: evaluation?.wrench(body)?,
            })
        };
        let share = |body| match motions.completion(body) {
            Some(rest) if rest.is_completed() => KickShare::Within(arrival(body)),
            _ if whole => KickShare::Whole,
            rest => KickShare::Half {
                free: rest.is_some_and(Completion::is_free),
            },
        };
        Arc::make_mut(&mut self.detector.starts).after(&world.view(), share, momenta);
    }

    /// The pairs of the fields that are left to Rapier, because no detection field acts at their present poses.
    pub(super) fn release(&mut self, state: &FieldState, world: &WorldMut<'_>) -> Pairs {
        let (view, rules, properties) = (world.view(), &self.ownership_rules, &self.properties);
        let pairs = world.narrow_phase.contact_pairs();
        let pairs = pairs.map(|pair| [pair.collider1, pair.collider2]);
        let owned = pairs.filter(|pair| rules.law(*pair).is_some());
        let moment = moment(state.time, world.integration_parameters.dt);
        let compiled = &self.scene.compiled;
        let sites = Self::sites(&mut self.gatherer, properties, compiled, &view);
        self.detector
            .released(compiled, &view, owned, moment, sites)
    }

    /// Gives the colliders whose contacts fields own, or that are checked, the hook bits that they need, and restores
    /// the bits of those that no longer need them.
    pub(super) fn listen(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        world: &mut WorldMut<'_>,
    ) {
        span!("listen");
        let check = &fields.settings.cross_check;
        let fresh = check.on && !check.lets_recycle;
        let (view, starts) = (world.view(), &self.detector.starts);
        self.hook_filter.find(
            &self.ownership_rules,
            starts,
            &view,
            world.integration_parameters,
        );
        let wanted = |collider| {
            let mut bits = ActiveHooks::empty();
            if !self.hook_filter.is_quiet(collider) {
                bits |= self.ownership_rules.hook_bits(collider);
            }
            if fresh && self.watched.contains(collider) {
                bits |= ActiveHooks::FILTER_CONTACT_PAIRS;
            }
            bits
        };
        let hooked = &mut state.hooked;
        if hooked.any_free(wanted) {
            for (collider, own) in Arc::make_mut(hooked).release(wanted) {
                bridge::set_hooks(world, collider, own);
            }
        }
        let view = world.view();
        let silent = self.watched.colliders().filter_map(|collider| {
            let own = view.collider(collider)?.active_hooks();
            let bits = wanted(collider);
            (!own.contains(bits)).then_some((collider, own, bits))
        });
        let silent: Vec<_> = silent.collect();
        for (collider, own, bits) in silent {
            bridge::set_hooks(world, collider, own | bits);
            Arc::make_mut(hooked).add(collider, own);
        }
    }

    /// With swept detection, finds and answers the touches during Rapier's step.
    pub(super) fn sweep(
        &mut self,
        fields: &Definition<'_>,
        open: &OpenStep,
        outcomes: &PairOutcomes,
        began: f64,
        world: &WorldMut<'_>,
    ) {
        span!("sweep");
        self.pushes.clear();
        let (view, joints, compiled) = (world.view(), joints(world), &self.scene.compiled);
        let step = SweptStep {
            moment: moment(began, open.dt),
            dt: open.dt,
            owner: owner(outcomes, joints, open, &view),
            outcomes,
            work: fields.settings.swept_work,
        };
        let sites = Self::sites(&mut self.gatherer, &self.properties, compiled, &view);
        self.detector
            .sweep(compiled, &view, step, sites, &mut self.pushes);
        let bodies = self.detector.stopped;
        if bodies > 0 {
            self.warnings.push(StepWarning::SweptWork { bodies });
        }
    }

    /// Writes the results of contacts to bodies, except of bodies that would be too fast or have a pose that is not
    /// finite. Returns the number of bodies written.
    pub(super) fn push(&mut self, world: &mut WorldMut<'_>) -> usize {
        self.pushes.retain(|push| {
            let bears = |velocity: Vector| velocity.length() <= FASTEST;
            let stays = push.pose.is_none_or(|pose| pose.is_finite());
            let sound = stays && bears(push.linvel) && bears(push.angvel);
            if !sound {
                let body = push.body;
                self.warnings.push(StepWarning::AnswerLeftOut { body });
            }
            sound
        });
        let caps = Caps::new(world.integration_parameters);
        for push in &self.pushes {
            let body = world.bodies.get(push.body);
            let speed = caps.of_speed(push.body, push.linvel.length());
            let turn = caps.of_turn(push.body, push.angvel.length(), body);
            self.warnings.extend(speed.into_iter().chain(turn));
        }
        bridge::push(world.bodies, &self.pushes)
    }

    /// Finds the contacts at the end of the step, answers them, and sends events; returns the number of bodies written.
    pub(super) fn touch(
        &mut self,
        fields: &Definition<'_>,
        state: &mut FieldState,
        open: &OpenStep,
        outcomes: &PairOutcomes,
        world: &mut WorldMut<'_>,
    ) -> usize {
        span!("touch");
        let dt = open.dt;
        if self.scene.compiled.detectors.is_empty() {
            state.hand_over = HandOver::default();
            return 0;
        }
        self.pushes.clear();
        let view = world.view();
        let moment = moment(state.time, dt);
        let compiled = &self.scene.compiled;
        let held = Some(HeldPairs {
            pairs: &outcomes.held,
            narrow_phase: world.narrow_phase,
        });
        let sites = Self::sites(&mut self.gatherer, &self.properties, compiled, &view);
        let detector = &mut self.detector;
        detector.run(compiled, &view, moment, held, sites);
        if fields.settings.rules.answer_any() {
            let owner = owner(outcomes, joints(world), open, &view);
            let answers = |contact: &FieldContact| {
                matches!(owner(contact), PairOwner::Fields(_) | PairOwner::Both)
            };
            let stiffest = detector.respond(&view, compiled, moment, dt, answers, &mut self.pushes);
            self.warnings
                .extend(stiffest.and_then(|(body, omega2)| warn_of_springs(body, omega2, dt)));
        }
        let written = self.push(world);
        let hand_over = &mut state.hand_over;
        let given = hand_over.update(&self.detector, &open.ownership.rules, outcomes);
        self.warnings.extend(warnings_of(given));
        self.detector.add_touches();
        if let Some(channel) = &self.events {
            let contacts = &self.detector.contacts;
            report(channel, &mut state.touching, contacts, state.time);
        }
        written
    }
}

/// The owner of a contact's pair. Of pairs that the user's hooks or a joint let pass through each other, it is Rapier.
fn owner<'a>(
    outcomes: &'a PairOutcomes,
    joints: Joints<'a>,
    open: &'a OpenStep,
    view: &'a WorldRef<'a>,
) -> impl Fn(&FieldContact) -> PairOwner + 'a {
    move |contact| {
        let (pair, handles) = (contact.colliders, contact.bodies);
        if outcomes.vetoed.contains(&pair) || joints.keep_apart(handles) {
            return PairOwner::Rapier;
        }
        let bodies = handles.map(|handle| Some((handle?, view.body(handle?)?)));
        open.ownership.of(pair, bodies)
    }
}

/// The warnings for pairs that are handed over to Rapier; there is none for a pair that rests.
fn warnings_of(given: Given) -> impl Iterator<Item = StepWarning> {
    let deeper = given.deeper.into_iter();
    let deeper = deeper.map(|(colliders, depth)| StepWarning::ContactDeepens { colliders, depth });
    let not_finite = given.not_finite.into_iter();
    deeper.chain(not_finite.map(|colliders| StepWarning::AnswerNotFinite { colliders }))
}

pub(super) fn joints<'a>(world: &'a WorldMut<'_>) -> Joints<'a> {
    Joints {
        impulse: world.impulse_joints,
        multibody: world.multibody_joints,
    }
}
