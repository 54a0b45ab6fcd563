//! Diagnosis: the reasons for the wrench on a body, field by field, the energy audit, and which bodies enter and leave
//! zones. All but zones evaluate the tree by the reference.

mod audit;
mod blame;
mod borders;
mod sampled;
mod zones;

use std::collections::HashMap;
use std::fmt;

pub use crate::eval::PotentialEnergy;
pub(crate) use audit::AuditReading;
pub use audit::{EnergyAudit, FieldEnergy};
pub(crate) use blame::{blame, missing_anchor, warn_of, without_non_finite};
pub(crate) use sampled::SampledFields;
pub use zones::ZoneEvent;
pub(crate) use zones::{Occupant, ZoneWatch};

use crate::field::{Anchor, Cuts, FieldRef, FieldSet, Frames, Node};
use crate::math::{ColliderHandle, RigidBodyHandle, Vector, from_dvec3, to_dvec3};
use crate::reference::{Contribution, Fate, Reference, Trace};
use crate::rigid::Wrench;
use crate::sample::{Cutter, SamplePoint};

/// The reasons for the wrench of the fields on a body: the force of each field at each sample, and whether it counts.
/// Its `Display` is a report.
///
/// It is made by the reference evaluator, so it shows the meaning of the tree, independently of the fast evaluators.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Explanation {
    /// The body.
    pub body: RigidBodyHandle,
    /// The resulting wrench of all fields, in world axes.
    pub wrench: Wrench,
    /// The forces of single fields, sample by sample. Fields whose region does not hold the sample are only counted, in
    /// `outside`.
    pub contributions: Vec<ExplainedField>,
    /// The wrenches of single fields, summed over the samples where they count, in the order in which they first count.
    /// Under a plain sum these and `reaction` add up to `wrench`.
    pub totals: Vec<FieldTotal>,
    /// The number of times that a field's region did not hold a sample.
    pub outside: usize,
    /// The reaction on the body to the forces of its own [reacting](crate::Field::reacting) fields on
    /// others; part of `wrench`.
    pub reaction: Wrench,
}

/// The wrench of one field over all samples of a body.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldTotal {
    /// The field's name, or its place in the tree.
    pub field: FieldRef,
    /// The sum of its own forces, before any operator, and their torque about the centre of mass.
    pub wrench: Wrench,
    /// The number of samples at which it counts.
    pub samples: usize,
}

/// The force of one field at one sample.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ExplainedField {
    /// The field's name, or its place in the tree.
    pub field: FieldRef,
    /// The collider that was sampled; `None` where the body was sampled as a whole.
    pub collider: Option<ColliderHandle>,
    /// The sample point, in world space.
    pub world_point: Vector,
    /// The field's own force there, in world axes, before any operator; `None` where it does not
    /// act.
    pub force: Option<Vector>,
    /// `Counts`, or the reason why it does not count.
    pub fate: Fate,
    /// The fields that overruled it.
    pub overruled_by: Vec<FieldRef>,
}

impl<F: Frames> SampledFields<'_, F> {
    /// Visits the traces of one body: the force and the contributions of the fields, for each term of the tree at each
    /// sample, or at each piece if the term cuts bodies.
    fn each_trace(&self, body: u32, mut visit: impl FnMut(&SamplePoint, u32, Trace)) {
        let (samples, moment) = (self.samples, self.moment);
        let mut cutter = Cutter::default();
        let centre = &samples.centres[body as usize];
        let parts: Vec<_> = samples.each_of(body as usize).collect();
        for term in self.set.terms() {
            let (term, rule) = (term.root, self.set.nodes().sampling_rule(term.root));
            let cuts = samples.cut(rule, body).is_some();
            for reference in self.references(term, cuts) {
                let borders = cuts.then(|| borders::near(self, &reference, body));
                let borders = borders.unwrap_or_default();
                let in_pieces = cuts && !(borders.is_empty() && rule.cuts == Cuts::Bodies);
                if in_pieces {
                    for piece in cutter.body(samples, body, &borders) {
                        let (query, weight, arm) = samples.of_piece(rule, body, piece, moment);
                        let sample = samples.in_piece(body, piece, &query, arm);
                        let trace = reference.trace(self.frames, &query);
                        visit(&sample, term, trace.times(weight));
                    }
                    continue;
                }
                let at_centre = samples.asks_whole(rule) && samples.takes(rule, centre);
                let own = parts.iter();
                let own = own.filter(|sample| samples.takes_part(rule, sample));
                for sample in at_centre.then_some(centre).into_iter().chain(own) {
                    let query = samples.query(sample, moment);
                    visit(sample, term, reference.trace(self.frames, &query));
                }
            }
        }
    }

    /// The references that a term is the sum of: where its instances cut bodies, each does so by its own borders.
    fn references(&self, term: u32, cuts: bool) -> Vec<Reference<'_>> {
        match self.set.nodes().get(term) {
            Node::Instances { prototype, anchors } if cuts => {
                let of = |anchor: &Anchor| Reference::of_instance(self.set, *prototype, *anchor);
                anchors.iter().map(of).collect()
            }
            _ => vec![Reference::of_term(self.set, term)],
        }
    }

    /// Explains the wrench on a body, given by its index among the sampled ones.
    pub(crate) fn explain(&self, body: u32) -> Explanation {
        let mut explanation = Explanation {
            body: self.samples.bodies[body as usize],
            wrench: Wrench::ZERO,
            contributions: Vec::new(),
            totals: Vec::new(),
            outside: 0,
            reaction: self.reaction(body, |_| true),
        };
        explanation.wrench = explanation.reaction;
        let mut known = HashMap::new();
        self.each_trace(body, |sample, _, trace| {
            if let Some(force) = trace.force {
                explanation.wrench.force += from_dvec3(force);
                explanation.wrench.torque += from_dvec3(to_dvec3(sample.arm).cross(force));
            }
            for contribution in trace.contributions {
                if contribution.fate == Fate::OutsideRegion {
                    explanation.outside += 1;
                } else if !is_contact(self.set, contribution.place) {
                    let place = contribution.place;
                    let explained = ExplainedField::new(self.set, sample, contribution);
                    explanation.add_to_totals(place, &mut known, &explained, sample);
                    explanation.contributions.push(explained);
                }
            }
        });
        explanation
    }

    /// The opposite of the forces of a body's reacting fields on all other bodies. Forces for which `felt` returns
    /// false are left out.
    fn reaction(&self, body: u32, felt: impl Fn(Vector) -> bool) -> Wrench {
        let (set, samples) = (self.set, self.samples);
        let mut wrench = Wrench::ZERO;
        let reacts = |place: u32| set.field(place).is_some_and(|field| field.reacts);
        if !set.nodes().leaves().any(|(_, field)| field.reacts) {
            return wrench;
        }
        let carrier = Some(samples.bodies[body as usize]);
        let centre = samples.centres[body as usize].world_point;
        for other in (0..samples.bodies.len() as u32).filter(|other| *other != body) {
            self.each_trace(other, |sample, _, trace| {
                let counts = |c: &&Contribution| c.fate == Fate::Counts && c.carrier == carrier;
                for contribution in trace.contributions.iter().filter(counts) {
                    if reacts(contribution.place) {
                        let force = from_dvec3(contribution.force.unwrap_or_default());
                        if felt(force) {
                            wrench.force -= force;
                            wrench.torque -= (sample.world_point - centre).cross(force);
                        }
                    }
                }
            });
        }
        wrench
    }
}

fn is_contact(set: &FieldSet, place: u32) -> bool {
    let field = set.field(place);
    field.is_some_and(|field| field.is_contact())
}

impl ExplainedField {
    fn new(set: &FieldSet, sample: &SamplePoint, contribution: Contribution) -> Self {
        let overruled_by = match &contribution.fate {
            Fate::Overruled { by, .. } => by.iter().map(|place| set.field_ref(*place)).collect(),
            _ => Vec::new(),
        };
        ExplainedField {
            field: set.field_ref(contribution.place),
            collider: sample.collider,
            world_point: sample.world_point,
            force: contribution.force.map(from_dvec3),
            fate: contribution.fate,
            overruled_by,
        }
    }
}

impl Explanation {
    /// Adds the force of the field at a place in the set. `known` maps places in the set to indices in the totals.
    fn add_to_totals(
        &mut self,
        place: u32,
        known: &mut HashMap<u32, usize>,
        explained: &ExplainedField,
        sample: &SamplePoint,
    ) {
        let Some(force) = explained.force.filter(|_| explained.fate == Fate::Counts) else {
            return;
        };
        let known = *known.entry(place).or_insert_with(|| {
            self.totals.push(FieldTotal {
                field: explained.field.clone(),
                wrench: Wrench::ZERO,
                samples: 0,
            });
            self.totals.len() - 1
        });
        let total = &mut self.totals[known];
        total.wrench.force += force;
        total.wrench.torque += sample.arm.cross(force);
        total.samples += 1;
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Wrench { force, torque } = self.wrench;
        writeln!(f, "{:?}: force {force}, torque {torque}", self.body)?;
        if self.reaction != Wrench::ZERO {
            let Wrench { force, torque } = self.reaction;
            writeln!(
                f,
                "  reaction to its own fields: force {force}, torque {torque}"
            )?;
        }
        for field in &self.contributions {
            writeln!(f, "  {field}")?;
        }
        match self.outside {
            0 => Ok(()),
            1 => writeln!(f, "  and 1 field whose region does not hold the sample"),
            more => writeln!(f, "  and {more} whose regions do not hold the sample"),
        }
    }
}

impl fmt::Display for ExplainedField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.field)?;
        if let Some(force) = self.force {
            write!(f, " gives {force}")?;
        }
        write!(f, " at {}", self.world_point)?;
        if let Some(collider) = self.collider {
            write!(f, " ({collider:?})")?;
        }
        match &self.fate {
            Fate::Counts => Ok(()),
            Fate::OutsideRegion => write!(f, ": outside its region"),
            Fate::OwnBody => write!(f, ": not on the body that carries it"),
            Fate::OtherGroups => write!(f, ": its groups leave this collider out"),
            Fate::Off => write!(f, ": it is off"),
            Fate::AnchorGone => write!(f, ": what it was anchored to is gone"),
            Fate::Overruled { operator, .. } => {
                let by = self.overruled_by.iter().map(FieldRef::to_string);
                let by = by.collect::<Vec<_>>().join(", ");
                write!(f, ": overruled ({operator}) by {by}")
            }
            Fate::Unmatched { operator } => {
                write!(
                    f,
                    ": left out, the other operand of {operator} is not defined here"
                )
            }
            Fate::Cuts => write!(f, ": only its region counts, it cuts"),
        }
    }
}
