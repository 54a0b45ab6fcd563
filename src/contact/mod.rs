//! Detect and respond (§3.3): who touches whom, and what follows.

mod conservative_advancement;
mod discrete;
mod event;
mod field_mask;
mod impact;
mod lcp;
mod respond;
mod rules;
mod solve;
mod sweep;
mod swept_body;
mod time_of_impact;
mod trajectory;

use std::collections::HashSet;

use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::{
    ColliderHandle, ColliderSet, DVec3, Real, RigidBodyHandle, RigidBodySet, Vector, to_f64,
};
use crate::rapier::geometry::{Group, InteractionGroups};
use crate::sample::{Moment, Samples};

pub use event::ContactEvent;
pub use rules::ResponderHooks;

pub(crate) use event::Reporter;
pub(crate) use rules::Rules;

use discrete::{Discrete, Part};
use field_mask::FieldMasks;
use sweep::{Scene, Sweep, Swept};

/// When fields look for contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Detection {
    /// At the end of each step, as the paper does: who overlaps there is touching. What passes
    /// through another within a step is not seen.
    #[default]
    Discrete,
    /// Over the whole of each step: who touches first, when and where, the rotation of bodies
    /// included. Each contact is answered at the moment it happens: its bodies are taken back to
    /// it, pushed by their law, and move on freely for the rest of the step; so a body may bounce
    /// any number of times in one step, in the right order, and nothing tunnels.
    ///
    /// Balls and half-spaces are exact, to some roundings in 64 bits; other shapes are found by
    /// Parry's distance, in time to some roundings of their size (in [`Real`]) over the speed of
    /// approach. Not seen are a body's collisions with what only Rapier answers after it was
    /// pushed: those wait for the next step.
    ///
    /// Bodies move as they do for Rapier. Those that turn freely are all turned by this crate's own
    /// rotation, balls included, which Rapier would turn by linearised substeps. Where something
    /// else pushed a body within the step (gravity, joints, Rapier's contacts), its path is taken
    /// as the straight line, and the steady rotation, between its poses.
    Swept,
}

/// Who answers the contacts that fields detect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Responder {
    /// Rapier's solver; fields only observe.
    Rapier,
    /// The fields, by their laws. Rapier still finds and reports contacts between two colliders
    /// that both have a detection field, but does not solve them: their `solver_groups` become
    /// [`Responder::groups`]. Contacts with all other colliders stay Rapier's.
    #[default]
    Fields,
    /// Both, each by its own rule.
    Both,
}

impl Responder {
    /// The solver groups of colliders whose contacts with each other the fields answer: members
    /// of the last group, which do not meet that group.
    pub fn groups() -> InteractionGroups {
        InteractionGroups {
            memberships: Group::GROUP_32,
            filter: Group::ALL - Group::GROUP_32,
            ..InteractionGroups::all()
        }
    }
}

/// A contact found by detection fields.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldContact {
    /// The colliders, in the order of their handles.
    pub colliders: [ColliderHandle; 2],
    /// Their bodies.
    pub bodies: [Option<RigidBodyHandle>; 2],
    /// The middle of the overlap.
    pub world_point: Vector,
    /// Unit vector from the first to the second.
    pub world_normal: Vector,
    /// How far they overlap; more than zero, but for a touch found when it happened.
    pub depth: Real,
    /// Simulated time at which the two touched, found by [`Detection::Swept`]; `None` for an
    /// overlap seen at the end of a step.
    pub time_of_impact: Option<f64>,
    /// How fast the two approached along the normal when found; negative if they parted.
    pub approach_speed: Real,
    /// The impulses that the fields gave the two bodies, fixed ones included; zero if the fields
    /// did not answer.
    pub impulses: [Vector; 2],
    /// The law of the pair.
    pub law: ContactLaw,
    /// Which of the two have a detection field.
    pub has_field: [bool; 2],
}

impl FieldContact {
    /// Of two parts, in any order; the normal is from the first to the second.
    fn new([first, second]: [&Part; 2], point: Vector, normal: Vector, depth: Real) -> Self {
        let law = match (first.law, second.law) {
            (Some(a), Some(b)) => a.stronger(b),
            (law, None) | (None, law) => law.unwrap_or(ContactLaw::Observe),
        };
        let swap = second.collider.into_raw_parts() < first.collider.into_raw_parts();
        let (parts, normal) = if swap {
            ([second, first], -normal)
        } else {
            ([first, second], normal)
        };
        FieldContact {
            colliders: parts.map(|part| part.collider),
            bodies: parts.map(|part| part.body),
            world_point: point,
            world_normal: normal,
            depth,
            time_of_impact: None,
            approach_speed: 0.0,
            impulses: [Vector::ZERO; 2],
            law,
            has_field: parts.map(|part| part.law.is_some()),
        }
    }

    fn key(&self) -> [(u32, u32); 2] {
        self.colliders.map(ColliderHandle::into_raw_parts)
    }
}

/// Finds contacts and answers them; keeps its buffers between calls.
#[derive(Debug)]
pub(crate) struct Detector {
    touch: Discrete,
    masks: FieldMasks,
    /// Only with [`Detection::Swept`].
    sweep: Option<Box<Sweep>>,
    /// Touches of the step that has just ended, not yet among the contacts.
    touched: Vec<FieldContact>,
    /// Whether the last step had more impacts than one step may have.
    pub exhausted: bool,
    /// What touches what, in the order of the handles.
    pub contacts: Vec<FieldContact>,
}

impl Detector {
    pub(crate) fn new(compiled: &Compiled, mode: Detection) -> Self {
        Detector {
            touch: Discrete::new(compiled),
            masks: FieldMasks::default(),
            sweep: (mode == Detection::Swept && !compiled.detectors.is_empty()).then(Box::default),
            touched: Vec::new(),
            exhausted: false,
            contacts: Vec::new(),
        }
    }

    /// Notes how the bodies begin Rapier's step; `momenta` are those that this crate turns freely.
    pub(crate) fn begin(
        &mut self,
        bodies: &RigidBodySet,
        momenta: impl Iterator<Item = (RigidBodyHandle, DVec3)>,
    ) {
        if let Some(sweep) = &mut self.sweep {
            sweep.starts.take(bodies, momenta);
        }
    }

    /// Finds and answers what touched during Rapier's step, from a moment on; returns how many
    /// bodies were written. Does nothing unless detection is swept.
    pub(crate) fn sweep(
        &mut self,
        compiled: &Compiled,
        (bodies, colliders): (&mut RigidBodySet, &ColliderSet),
        (moment, dt): (Moment, Real),
        samples: impl FnOnce(&RigidBodySet, &mut Samples),
        answers: impl Fn(&FieldContact) -> bool,
    ) -> usize {
        self.touched.clear();
        let Some(sweep) = &mut self.sweep else {
            return 0;
        };
        let guarded = compiled.detectors.iter().any(|d| d.mask.is_some());
        if guarded {
            let fill = |list: &mut Samples| samples(bodies, list);
            self.masks.refresh(compiled, bodies, colliders, fill);
        }
        let scene = Scene {
            compiled,
            touch: &self.touch,
            masks: guarded.then_some(&mut self.masks),
            colliders,
            moment,
            answers: &answers,
        };
        let Swept { written, exhausted } = sweep.run(scene, bodies, to_f64(dt), &mut self.touched);
        self.exhausted = exhausted;
        written
    }

    /// Puts the touches of the step before the overlaps that its end has shown.
    pub(crate) fn add_touches(&mut self) {
        if self.touched.is_empty() {
            return;
        }
        let touched: HashSet<_> = self.touched.iter().map(FieldContact::key).collect();
        let pushes = |contact: &FieldContact| contact.impulses != [Vector::ZERO; 2];
        self.contacts
            .retain(|contact| pushes(contact) || !touched.contains(&contact.key()));
        self.touched.append(&mut self.contacts);
        std::mem::swap(&mut self.touched, &mut self.contacts);
    }

    /// Finds all contacts at the present poses. `samples` fills in what a detection field under
    /// operators may ask of what approaches it.
    pub(crate) fn run(
        &mut self,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
        moment: Moment,
        samples: impl FnOnce(&mut Samples),
    ) {
        self.contacts.clear();
        self.touch.gather(bodies, colliders);
        self.touch.find(bodies, &mut self.contacts);
        if compiled
            .detectors
            .iter()
            .any(|detector| detector.mask.is_some())
        {
            self.masks.refresh(compiled, bodies, colliders, samples);
            let (touch, masks) = (&self.touch, &mut self.masks);
            self.contacts.retain(|contact| {
                let [first, second] = contact.colliders;
                [(first, second), (second, first)]
                    .into_iter()
                    .any(|(owner, other)| {
                        let detectors = touch.detectors_of(owner).iter();
                        detectors.copied().any(|d| {
                            masks.lets_through(
                                compiled,
                                &compiled.detectors[d as usize],
                                other,
                                moment,
                            )
                        })
                    })
            });
        }
        self.contacts.sort_unstable_by_key(FieldContact::key);
    }

    /// Answers the contacts by their laws; returns how many bodies were written.
    pub(crate) fn respond(
        &mut self,
        bodies: &mut RigidBodySet,
        dt: Real,
        answers: impl Fn(&FieldContact) -> bool,
    ) -> usize {
        // All but springs were answered when they happened.
        let swept = self.sweep.is_some();
        let answers = |contact: &FieldContact| {
            let late = !swept || matches!(contact.law, ContactLaw::Penalty { .. });
            late && answers(contact)
        };
        respond::respond(&mut self.contacts, bodies, dt, answers)
    }

    /// Keeps Rapier from solving the contacts that fields answer: by the colliders' solver groups,
    /// or where these cannot tell, by a hook.
    pub(crate) fn claim(compiled: &Compiled, rules: &Rules, colliders: &mut ColliderSet) {
        rules.listen(colliders);
        if rules.everywhere != Responder::Fields {
            return;
        }
        let simple = |handle: &ColliderHandle| !rules.is_exceptional(*handle);
        let detecting = compiled.detectors.iter().map(|detector| detector.collider);
        for handle in detecting.filter(simple) {
            let groups = colliders.get(handle).map(|c| c.solver_groups());
            if groups.is_some_and(|groups| groups != Responder::groups())
                && let Some(collider) = colliders.get_mut(handle)
            {
                collider.set_solver_groups(Responder::groups());
            }
        }
    }
}
