//! The contact detector: finds contacts over a step or at its end, and answers them by their laws.

use std::collections::HashSet;
use std::sync::Arc;

use super::approach::approach_speed;
use super::discrete::{Discrete, FoundContacts};
use super::field_contact::FieldContact;
use super::field_mask::{At, DetectionFields, FieldMasks};
use super::hooks::PairOutcomes;
use super::meet::next_touch;
use super::modes::Detection;
use super::ownership::PairOwner;
use super::resting::HeldPairs;
use super::rules::{Pairs, in_order};
use super::starts::Starts;
use super::sweep::{Sweep, SweepScene};
use super::touch_record::TouchRecord;
use crate::bridge::Push;
use crate::compile::Compiled;
use crate::field::{ContactLaw, Frames};
use crate::math::{ColliderHandle, Real, RigidBodyHandle, to_f64};
use crate::rigid::Lookup;
use crate::sample::{Moment, Samples};

/// Finds contacts and answers them; its buffers and caches are kept between steps.
#[derive(Debug)]
pub(crate) struct Detector {
    pub(super) touch: Discrete,
    pub(super) masks: FieldMasks,
    /// `Some` only with [`Detection::Swept`] and at least one detection field.
    sweep: Option<Box<Sweep>>,
    /// The state of the bodies when Rapier's step began.
    pub starts: Arc<Starts>,
    /// Overlaps at the end of the step.
    pub(super) found: FoundContacts,
    /// True if an overlap in `found` may be an impact. If false, only springs need an answer.
    hit: bool,
    /// Touches found by the sweep of this step, until [`Detector::add_touches`] moves them into `contacts`.
    pub(super) touched: Vec<FieldContact>,
    /// Pairs whose impulses in this step were not finite, and were left out.
    pub not_finite: Vec<[ColliderHandle; 2]>,
    /// The number of bodies that the last sweep stopped, because it reached its limit of work.
    pub stopped: usize,
    /// The contacts of the last step: touches in the order of time, then overlaps in the order of their handles.
    pub contacts: Vec<FieldContact>,
}

/// The inputs of a sweep over one step.
pub(crate) struct SweptStep<'a, A> {
    /// The moment at which the step began.
    pub moment: Moment,
    pub dt: Real,
    /// The owner of a contact's pair.
    pub owner: A,
    /// The decisions of the hooks on pairs of the fields during Rapier's step.
    pub outcomes: &'a PairOutcomes,
    /// See [`FieldSettings::swept_work`](crate::pipeline::FieldSettings::swept_work).
    pub work: u32,
}

/// A detector without detection fields.
impl Default for Detector {
    fn default() -> Self {
        Detector::new(&Compiled::default(), Detection::default())
    }
}

impl Detector {
    pub(crate) fn new(compiled: &Compiled, mode: Detection) -> Self {
        Detector {
            touch: Discrete::new(compiled),
            masks: FieldMasks::default(),
            sweep: (mode == Detection::Swept && !compiled.detectors.is_empty()).then(Box::default),
            starts: Arc::default(),
            found: FoundContacts::default(),
            hit: false,
            touched: Vec::new(),
            not_finite: Vec::new(),
            stopped: 0,
            contacts: Vec::new(),
        }
    }

    /// Turns the log of touches, which the cross-check needs, on or off.
    pub(crate) fn log_touches(&mut self, on: bool) {
        if let Some(sweep) = &mut self.sweep
            && sweep.log.is_some() != on
        {
            sweep.log = on.then(Vec::new);
        }
    }

    /// The logged touches of the last step; empty if logging is off.
    pub(crate) fn touch_log(&self) -> &[TouchRecord] {
        let log = self.sweep.as_ref().and_then(|sweep| sweep.log.as_ref());
        log.map_or(&[], Vec::as_slice)
    }

    /// With swept detection, finds and answers all touches during Rapier's step, and appends the end state of the
    /// bodies that were hit to `pushes`. `samples` fills in the samples at which detection fields under operators are
    /// evaluated.
    pub(crate) fn sweep(
        &mut self,
        compiled: &Compiled,
        world: &(impl Lookup + Frames),
        step: SweptStep<'_, impl Fn(&FieldContact) -> PairOwner>,
        samples: impl FnOnce(&mut Samples),
        pushes: &mut Vec<Push>,
    ) {
        self.touched.clear();
        self.not_finite.clear();
        self.stopped = 0;
        let Some(sweep) = &mut self.sweep else {
            return;
        };
        let guarded = is_masked(compiled);
        if guarded {
            self.masks.refresh(compiled, world, samples);
        }
        let scene = SweepScene {
            fields: DetectionFields::new(&self.touch, compiled, step.moment),
            masks: guarded.then_some(&mut self.masks),
            starts: &self.starts,
            owner: &step.owner,
            outcomes: step.outcomes,
            work: step.work,
        };
        let dt = to_f64(step.dt);
        self.stopped = sweep.run(scene, world, dt, &mut self.touched, pushes);
        self.not_finite.append(&mut sweep.not_finite);
    }

    /// Puts the touches of the step before the overlaps at its end. An overlap without an impulse is dropped if its
    /// pair is among the touches.
    pub(crate) fn add_touches(&mut self) {
        if self.touched.is_empty() {
            return;
        }
        let touched: HashSet<_> = self.touched.iter().map(FieldContact::key).collect();
        self.contacts
            .retain(|contact| contact.is_answered() || !touched.contains(&contact.key()));
        self.touched.append(&mut self.contacts);
        std::mem::swap(&mut self.touched, &mut self.contacts);
    }

    /// Finds all overlaps at the present poses. `held` are the pairs that Rapier's solver held in its last step.
    /// `samples` fills in the samples at which detection fields under operators are evaluated.
    pub(crate) fn run(
        &mut self,
        compiled: &Compiled,
        world: &(impl Lookup + Frames),
        moment: Moment,
        held: Option<HeldPairs<'_>>,
        samples: impl FnOnce(&mut Samples),
    ) {
        let found = &mut self.found;
        let masked = is_masked(compiled);
        let moved = self.touch.gather(world, self.starts.dt()) || masked;
        if moved || held.is_none() && !found.anew {
            self.touch.find(world, &self.starts, held, found);
        } else {
            for (contact, _) in &mut found.contacts {
                contact.approach_speed = approach_speed(contact, world, &self.starts);
            }
        }
        self.hit = found.is_hit(world, &self.starts);
        if self.hit && !found.anew {
            // An impact travels through resting contacts, so their points are searched anew at the present poses.
            self.touch.find(world, &self.starts, None, found);
        }
        if masked {
            self.masks.refresh(compiled, world, samples);
            let (touch, masks) = (&self.touch, &mut self.masks);
            let fields = DetectionFields::new(touch, compiled, moment);
            found
                .contacts
                .retain(|(contact, _)| masks.any_acts(fields, contact.colliders, At::Now));
        }
        found
            .contacts
            .sort_unstable_by_key(|(contact, _)| contact.key());
        self.contacts.clear();
        self.contacts
            .extend(found.contacts.iter().map(|(contact, _)| *contact));
    }

    /// Returns those of `pairs` on which no detection field acts, neither at their present poses nor where they touch
    /// next: the field is cut out or replaced there, or they are outside its region. Rapier answers these pairs.
    /// `pairs` are those that Rapier's narrow phase has near each other.
    pub(crate) fn released(
        &mut self,
        compiled: &Compiled,
        world: &(impl Lookup + Frames),
        pairs: impl Iterator<Item = [ColliderHandle; 2]>,
        moment: Moment,
        samples: impl FnOnce(&mut Samples),
    ) -> Pairs {
        if !is_masked(compiled) {
            return Pairs::default();
        }
        self.masks.refresh(compiled, world, samples);
        let (touch, masks, starts) = (&self.touch, &mut self.masks, &self.starts);
        let fields = DetectionFields::new(touch, compiled, moment);
        let mut acts = |pair: &[ColliderHandle; 2]| {
            masks.any_acts(fields, *pair, At::Now)
                || next_touch(starts, *pair, world).is_some_and(|constraint| {
                    let gained = |body| starts.gained(body);
                    masks.let_meet(fields, &constraint, gained)
                })
        };
        let pairs = pairs.filter(|pair| !acts(pair));
        pairs.map(in_order).collect()
    }

    /// Answers the contacts by their laws, and appends the new velocities to `pushes`. Returns the body between the
    /// stiffest springs, with an upper bound of the square of its angular frequency there.
    pub(crate) fn respond(
        &mut self,
        world: &impl Lookup,
        compiled: &Compiled,
        moment: Moment,
        dt: Real,
        answers: impl Fn(&FieldContact) -> bool,
        pushes: &mut Vec<Push>,
    ) -> Option<(RigidBodyHandle, f64)> {
        // Swept detection has already answered all contacts but springs, at the moment of impact.
        let swept = self.sweep.is_some();
        let answers = |contact: &FieldContact| {
            let late = !swept || matches!(contact.law, ContactLaw::Penalty { .. });
            late && answers(contact)
        };
        let springs = |contact: &FieldContact| matches!(contact.law, ContactLaw::Penalty { .. });
        if !self.hit && !self.contacts.iter().any(springs) {
            return None;
        }
        self.answer(world, compiled, moment, dt, answers, pushes)
    }
}

/// Returns true if any detection field stands under operators.
pub(super) fn is_masked(compiled: &Compiled) -> bool {
    compiled.detectors.iter().any(|it| it.mask.is_some())
}
