//! A report of the decisions of the compiler, for people.

use std::fmt;

use super::compiled::Compiled;
use super::cost;
use super::entries::{ConstantField, RadialBatch};
pub use super::index_kind::IndexKind;
use super::program::Program;
use super::term_flags::TermFlags;
use crate::field::{Coupling, Cuts, Field, FieldSet, Node, Points, Sampling, SamplingRule, Term};

/// The way in which a tree is evaluated, and the fields that were left out. Its `Display` is a short report.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Plan {
    /// Number of fields in the tree; those of a prototype count once.
    pub fields: usize,
    /// Number of different frames to which fields are anchored.
    pub anchors: usize,
    /// True if any field depends on velocities.
    pub reads_velocity: bool,
    /// True if any field may change with time while its anchor stands still.
    pub varies: bool,
    /// True if bodies are sampled part by part. If not, colliders are not looked at.
    pub samples_parts: bool,
    /// True if any field can turn a body. If not, no lever arms are computed.
    pub torque_possible: bool,
    /// Number of detection fields. If there are none, nothing is detected.
    pub detectors: usize,
    /// Constants, batches and programs that give forces.
    pub entries: Vec<PlanEntry>,
    /// Axes that fields name, beyond those that every formula reads.
    pub axes: Vec<String>,
    /// Fields that can never act, with the reason.
    pub left_out: Vec<String>,
}

/// One constant, batch or program of a plan.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlanEntry {
    /// A label of its fields.
    pub what: String,
    /// The number of its sources or instances.
    pub count: usize,
    /// The index by which samples find the sources or instances that act on them.
    pub index: IndexKind,
    /// The sampling of bodies for which none was set; never [`Sampling::Auto`].
    pub sampling: Sampling,
    /// True if a ball is sampled at its centre only, where other shapes are sampled at several points.
    pub spares_balls: bool,
    /// True if a body that a border passes through is cut there, and sampled in pieces.
    pub cuts_at_borders: bool,
    /// The number of samples of a body of one cube.
    pub samples_of_a_cube: usize,
    /// Rough time on one sample (ns): of each source or instance that reaches the sample, if these are found by an
    /// index or are bounded; else of all together.
    pub cost: f64,
}

impl PlanEntry {
    fn of(rule: SamplingRule) -> Self {
        let sampling = match rule.cuts {
            Cuts::Never => rule.sampling,
            Cuts::Bodies => Sampling::Centre,
            Cuts::Shares | Cuts::Parts => Sampling::Parts,
        };
        let points = SamplingRule { sampling, ..rule }.points();
        let samples_of_a_cube = match points {
            None => 1,
            Some(Points::Volume) => 27,
            Some(Points::Surface) => 24,
            Some(Points::FewOfVolume | Points::FewOfSurface) => 4,
        };
        PlanEntry {
            what: String::new(),
            count: 0,
            index: IndexKind::None,
            sampling,
            spares_balls: rule.auto && points.is_some(),
            cuts_at_borders: rule.cuts != Cuts::Never,
            samples_of_a_cube,
            cost: 0.0,
        }
    }

    fn write_sampling(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pieces = if self.cuts_at_borders {
            ", in pieces where a border passes"
        } else {
            ""
        };
        match self.sampling {
            Sampling::Auto | Sampling::Centre => return write!(f, "once per body{pieces}"),
            Sampling::Parts => return write!(f, "per part{pieces}"),
            Sampling::Volume => f.write_str("over the volume")?,
            Sampling::Surface => f.write_str("over the surface")?,
        }
        write!(f, " ({} samples of a cube", self.samples_of_a_cube)?;
        let balls = if self.spares_balls {
            ", 1 of a ball)"
        } else {
            ")"
        };
        f.write_str(balls)
    }

    pub(super) fn constant(constant: &ConstantField, set: &FieldSet) -> Self {
        PlanEntry {
            what: format!("{}, the same everywhere", set.field_ref(constant.leaf)),
            count: 1,
            cost: cost::CONSTANTS,
            index: IndexKind::None,
            ..PlanEntry::of(SamplingRule::own(Sampling::Centre))
        }
    }

    pub(super) fn radial(batch: &RadialBatch) -> Self {
        let coupling = match &batch.weighting.coupling {
            Coupling::Share => String::new(),
            Coupling::Each => ", on each part".to_owned(),
            Coupling::Axis(axis) => format!(", times {axis}"),
        };
        let range = batch
            .range
            .map_or(String::new(), |r| format!(" within {r}"));
        PlanEntry {
            what: format!("{} sources{range}{coupling}", batch.law.profile.kind()),
            count: batch.sources.len(),
            cost: cost::of_batch(batch),
            index: batch.index_kind(),
            ..PlanEntry::of(batch.sampling_rule)
        }
    }

    pub(super) fn program(program: &Program, set: &FieldSet) -> Self {
        let what = match &program.leaves[..] {
            [_] => set.field_ref(program.instances.places[0]).label.into(),
            leaves => format!("composite of {} fields", leaves.len()),
        };
        PlanEntry {
            what,
            count: program.instances.len(),
            cost: cost::of_program(program),
            index: program.index_kind(),
            ..PlanEntry::of(program.sampling_rule)
        }
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let yes_no = |yes| if yes { "yes" } else { "no" };
        writeln!(
            f,
            "plan: {} fields at {} anchors",
            self.fields, self.anchors
        )?;
        for entry in &self.entries {
            write!(f, "  {:>6} × {}; ", entry.count, entry.what)?;
            entry.write_sampling(f)?;
            writeln!(f, ", {}, about {:.0} ns a sample", entry.index, entry.cost)?;
        }
        if self.detectors > 0 {
            writeln!(
                f,
                "  {:>6} × detection field; neighbour list",
                self.detectors
            )?;
        }
        let (velocity, torque) = (yes_no(self.reads_velocity), yes_no(self.torque_possible));
        writeln!(
            f,
            "  reads velocities: {velocity}; can turn bodies: {torque}"
        )?;
        if !self.axes.is_empty() {
            writeln!(f, "  axes named: {}", self.axes.join(", "))?;
        }
        for what in &self.left_out {
            writeln!(f, "  left out: {what}")?;
        }
        Ok(())
    }
}

impl Compiled {
    /// The plan of a set.
    pub(crate) fn plan(&self, set: &FieldSet) -> Plan {
        let constants = self.constants.iter();
        let mut entries: Vec<PlanEntry> = constants
            .map(|constant| PlanEntry::constant(constant, set))
            .collect();
        let radials = self.radials.iter();
        entries.extend(radials.map(|(_, batch)| PlanEntry::radial(batch)));
        let programs = self
            .programs
            .iter()
            .filter(|(_, program)| program.has_force);
        entries.extend(programs.map(|(_, program)| PlanEntry::program(program, set)));
        let mut axes: Vec<String> = Vec::new();
        for axis in set.named_axes() {
            if !axes.iter().any(|known| known == axis.name()) {
                axes.push(axis.name().to_owned());
            }
        }
        Plan {
            fields: set.len(),
            anchors: self.anchors.count(),
            varies: self.reads_time,
            reads_velocity: self.reads_velocity,
            samples_parts: self.requirements.parts,
            torque_possible: self.torque_possible,
            detectors: self.detectors.len(),
            entries,
            axes,
            left_out: self.left_out(set),
        }
    }

    /// The fields that can never act. Neighbours with equal labels are written once, with a count.
    fn left_out(&self, set: &FieldSet) -> Vec<String> {
        let mut told: Vec<(String, usize)> = Vec::new();
        for term in set.terms() {
            let record = self.terms.get(&term.serial);
            if !record.is_some_and(|record| record.flags.holds(TermFlags::LEFT_OUT)) {
                continue;
            }
            let (what, count) = left_out(set, *term);
            match told.last_mut() {
                Some((last, known)) if *last == what => *known += count,
                _ => told.push((what, count)),
            }
        }
        let in_words = |(what, count)| match count {
            1 => what,
            _ => format!("{what} (×{count})"),
        };
        told.into_iter().map(in_words).collect()
    }
}

/// The reason why a term of one field, or its instances, is left out, and the number of instances.
fn left_out(set: &FieldSet, term: Term) -> (String, usize) {
    let (place, count) = match set.nodes().get(term.root) {
        Node::Instances { prototype, anchors } => (*prototype, anchors.len()),
        _ => (term.root, 1),
    };
    let off = |field: &Field| !field.enabled || field.lifetime.steps == Some(0);
    let why = if set.field(place).is_some_and(off) {
        "off"
    } else {
        "zero wherever it is defined"
    };
    (format!("{}: {why}", set.field_ref(place)), count)
}
