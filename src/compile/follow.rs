//! Compiles a set, and follows its changes term by term.

use super::at_centres::AtCentres;
use super::compiled::{Compiled, TermRecord};
use super::entries::{ConstantField, DetectionField, RadialBatch, RadialSource};
use super::extent::{bound, of_instances, of_sources};
use super::index_kind::IndexKind;
use super::lower::{Lowered, Lowering};
use super::ordered::{Key, places_of};
use super::program::Program;
use super::term_flags::TermFlags;
use crate::field::{Change, FieldSet, Sampling, Term};

impl Compiled {
    /// Compiles a validated set.
    pub(crate) fn new(set: &FieldSet) -> Self {
        let mut compiled = Compiled::default();
        compiled.start(set);
        compiled
    }

    /// Follows the changes of a set, which must be valid; returns true if there were any. Evaluation then gives the
    /// same sums as after [`Compiled::new`]; the numbers of batches, programs and anchors may differ.
    pub(crate) fn update(&mut self, set: &FieldSet) -> bool {
        if self.revision == set.revision() {
            return false;
        }
        let changes = set.changes_since(self.revision);
        let in_order = changes.filter(|changes| !changes.clone().any(|c| c == Change::Samplings));
        let Some(changes) = in_order else {
            self.start(set);
            return true;
        };
        let terms = changes.filter_map(|change| match change {
            Change::Term(serial) => Some(serial),
            _ => None,
        });
        let mut serials: Vec<Key> = terms.collect();
        serials.sort_unstable();
        serials.dedup();
        for serial in serials {
            self.take_up(set, serial, set.term(serial));
        }
        self.end(set);
        true
    }

    fn start(&mut self, set: &FieldSet) {
        *self = Compiled {
            overrides: set.data().overrides(),
            ..Compiled::default()
        };
        for term in set.terms() {
            self.take_up(set, term.serial, Some(*term));
        }
        self.end(set);
    }

    /// Compiles one term again; `term` is `None` if it was removed.
    fn take_up(&mut self, set: &FieldSet, serial: Key, term: Option<Term>) {
        let lowered = term.map_or_else(Lowered::default, |term| self.lower(set, term));
        let before = self.terms.remove(&serial).unwrap_or_default();
        let mut after = TermRecord {
            flags: lowered.flags,
            radial: None,
            program: None,
            constants: !lowered.constants.is_empty(),
            detectors: !lowered.detectors.is_empty(),
        };
        if before.constants || after.constants {
            self.put_constants(serial, lowered.constants);
        }
        let home = lowered
            .radial
            .as_ref()
            .and_then(|batch| self.radial_ids.get(&batch.key));
        let home = home.copied();
        if let Some(number) = before.radial.filter(|number| home != Some(*number)) {
            self.put_sources(serial, number, None);
        }
        if let Some(batch) = lowered.radial {
            after.radial = Some(self.put_batch(serial, home, batch));
        }
        let home = lowered
            .program
            .as_ref()
            .and_then(|program| self.home_of(program));
        if let Some(number) = before.program.filter(|number| home != Some(*number)) {
            self.put_instances(set, serial, number, None);
        }
        if let Some(program) = lowered.program {
            after.program = Some(self.put_program(set, serial, home, program));
        }
        if before.detectors || after.detectors {
            self.put_detectors(serial, lowered.detectors, after.program);
        }
        self.flag_counts.replace(before.flags, after.flags);
        if term.is_some() {
            self.terms.insert(serial, after);
        }
    }

    fn lower(&mut self, set: &FieldSet, term: Term) -> Lowered {
        let lowering = Lowering {
            nodes: set.nodes(),
            anchors: &mut self.anchors,
            serial: term.serial,
            by_surface: self.overrides.contains(&Sampling::Surface),
            lowered: Lowered::default(),
        };
        lowering.term(term.root)
    }

    fn put_constants(&mut self, serial: Key, constants: Vec<ConstantField>) {
        let places = places_of(&self.constants, serial, |known| known.serial);
        self.constants.splice(places, constants);
    }

    fn put_detectors(&mut self, serial: Key, new: Vec<DetectionField>, program: Option<u32>) {
        let places = places_of(&self.detectors, serial, |known| known.serial);
        let new = new.into_iter().map(|mut detector| {
            if let (Some(mask), Some(program)) = (&mut detector.mask, program) {
                mask.program = program;
            }
            detector
        });
        let old: Vec<DetectionField> = self.detectors.splice(places, new).collect();
        for detector in old {
            self.anchors.release(detector.anchor);
        }
        self.detectors_changed = true;
    }

    /// Adds the sources of a term to the batch `home`, or makes a batch of them.
    fn put_batch(&mut self, serial: Key, home: Option<u32>, batch: RadialBatch) -> u32 {
        self.extent.add_sources(&batch, &self.anchors);
        if let Some(number) = home {
            self.put_sources(serial, number, Some(batch));
            return number;
        }
        let key = batch.key.clone();
        let number = self.radials.add(batch);
        self.radial_ids.insert(key, number);
        number
    }

    /// Replaces the sources of a term in a batch by those of `term`. An empty batch is removed.
    fn put_sources(&mut self, serial: Key, number: u32, term: Option<RadialBatch>) {
        let (anchors, extent) = (&mut self.anchors, &mut self.extent);
        let emptied = self.radials.change(number, |batch| {
            let old = batch.put(serial, term);
            extent.remove(of_sources(&old, batch.range, anchors));
            let stood =
                |source: &RadialSource| anchors[source.anchor as usize].local_pose().translation;
            batch.log.note(serial, old.iter().map(stood));
            for source in old {
                batch.on_colliders -= usize::from(source.collider.is_some());
                batch.moving -= usize::from(!anchors.stands_still(source.anchor));
                anchors.release(source.anchor);
            }
            batch.sources.is_empty().then(|| batch.key.clone())
        });
        if let Some(Some(key)) = emptied {
            self.radial_ids.remove(&key);
            self.radials.remove(number);
        }
    }

    /// The number of the program to which instances of `program` can be added, if there is one.
    fn home_of(&self, program: &Program) -> Option<u32> {
        let numbers = self.alike.get(&program.dedup_key)?;
        let like = |number: &&u32| {
            let known = self.programs.get(**number);
            known.is_some_and(|known| known.is_like(program))
        };
        numbers.iter().find(like).copied()
    }

    fn put_program(
        &mut self,
        set: &FieldSet,
        serial: Key,
        home: Option<u32>,
        program: Program,
    ) -> u32 {
        self.extent.add_instances(&program, &self.anchors);
        if let Some(number) = home {
            self.put_instances(set, serial, number, Some(program));
            return number;
        }
        let dedup_key = program.dedup_key;
        let number = self.programs.add(program);
        self.alike.entry(dedup_key).or_default().push(number);
        self.program_log
            .note(number, serial, self.programs.get(number));
        number
    }

    /// Replaces the instances of a term in a program by those of `term`. An empty program is removed.
    fn put_instances(&mut self, set: &FieldSet, serial: Key, number: u32, term: Option<Program>) {
        let (anchors, extent) = (&mut self.anchors, &mut self.extent);
        let emptied = self.programs.change(number, |program| {
            let reach = bound(program);
            let old = program.put(serial, term);
            extent.remove(of_instances(&old, reach, anchors));
            program.instances.moving -= old.moves(program.stride(), anchors);
            old.anchors().for_each(|anchor| anchors.release(anchor));
            program.follow_first(set);
            program.instances.is_empty().then_some(program.dedup_key)
        });
        if let Some(Some(dedup_key)) = emptied {
            self.programs.remove(number);
            if let Some(numbers) = self.alike.get_mut(&dedup_key) {
                numbers.retain(|known| *known != number);
                if numbers.is_empty() {
                    self.alike.remove(&dedup_key);
                }
            }
        }
        self.program_log
            .note(number, serial, self.programs.get(number));
    }

    /// Updates the properties that depend on all terms.
    fn end(&mut self, set: &FieldSet) {
        let flag_counts = &self.flag_counts;
        self.requirements = flag_counts.wanted();
        self.requirements.parts |= !self.overrides.is_empty();
        self.reads_velocity = flag_counts.any(TermFlags::READS_VELOCITY);
        self.reads_velocity_otherwise = flag_counts.any(TermFlags::READS_VELOCITY_OTHERWISE);
        self.ignores_velocity_in_part = flag_counts.any(TermFlags::IGNORES_VELOCITY);
        self.reads_time = flag_counts.any(TermFlags::READS_TIME);
        self.reads_user_axes = flag_counts.any(TermFlags::READS_USER_AXES);
        self.torque_possible = flag_counts.any(TermFlags::TURNS) || !self.overrides.is_empty();
        self.is_static =
            !flag_counts.any(TermFlags::MOVES) && !flag_counts.any(TermFlags::READS_TIME);
        // Instances share a program with masks only if they have detection fields, too.
        if std::mem::take(&mut self.detectors_changed) {
            self.place_masks();
            self.detectors_revision = set.revision();
        }
        if self.extent.shrinks {
            self.extent
                .renew(&self.radials, &self.programs, &self.anchors);
        }
        let alone = self.detectors.is_empty() && self.overrides.is_empty();
        let moves = self.flag_counts.any(TermFlags::MOVES);
        let still = alone && !moves;
        let radials = self.radials.iter().map(|(_, batch)| batch);
        // Eight neighbouring samples open the same cells, so a wrench depends on other bodies.
        let by_cells = |batch: &RadialBatch| batch.index_kind() == IndexKind::Cells;
        self.each_by_itself = !moves && !self.reads_velocity && !radials.clone().any(by_cells);
        let programs = self.programs.iter().map(|(_, program)| program);
        self.at_centres = still.then(|| AtCentres::of(radials, programs)).flatten();
        self.revision = set.revision();
    }

    /// Updates the instance numbers in the masks of detection fields, after instances were added or removed.
    fn place_masks(&mut self) {
        for detector in &mut self.detectors {
            let Some(mask) = &mut detector.mask else {
                continue;
            };
            if let Some(program) = self.programs.get(mask.program) {
                mask.instance = program.instances.start_of(detector.serial) + detector.instance;
            }
        }
    }
}
