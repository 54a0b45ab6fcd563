//! Lowers one term: sorts its fields into constants, radial sources, program instances and detection fields.

use super::anchors::{Anchors, NO_ANCHOR};
use super::entries::{
    ConstantField, DetectionField, FieldMask, RadialBatch, RadialKey, RadialSource, SourceLog,
    Weighting,
};
use super::program::Program;
use super::requirements::SamplingRequirements;
use super::term_flags::TermFlags;
use crate::field::{
    Anchor, ContactLaw, Coupling, Cuts, Field, Formula, Modifier, Node, Nodes, Radial, Sampling,
    SamplingRule,
};
use crate::math::{Real, Vector, to_f64};

/// The compiled parts of one term. Its sources belong to at most one batch, its instances to one program.
#[derive(Debug, Default)]
pub(super) struct Lowered {
    pub flags: TermFlags,
    pub constants: Vec<ConstantField>,
    pub radial: Option<RadialBatch>,
    pub program: Option<Program>,
    pub detectors: Vec<DetectionField>,
}

/// The lowering of one term of a set.
pub(super) struct Lowering<'a> {
    pub nodes: Nodes<'a>,
    pub anchors: &'a mut Anchors,
    pub serial: u64,
    /// True if a body is sampled over its surface in place of its centre of mass, about which a uniform field then turns
    /// it.
    pub by_surface: bool,
    pub lowered: Lowered,
}

impl Lowering<'_> {
    /// Lowers one operand of the outermost sum of union.
    pub(super) fn term(mut self, root: u32) -> Lowered {
        let below = match self.nodes.get(root) {
            Node::Leaf(_) => vec![root],
            _ => self.nodes.below(root),
        };
        self.lowered.flags = TermFlags::of_nodes(self.nodes, &below);
        match self.nodes.get(root) {
            Node::Leaf(field) => {
                let moved = field.at_its_region();
                self.leaf(root, moved.as_ref().unwrap_or(field), &Anchor::WORLD);
            }
            Node::Instances { prototype, anchors } => match self.nodes.get(*prototype) {
                Node::Leaf(field) => {
                    for anchor in anchors.iter() {
                        self.leaf(*prototype, field, anchor);
                    }
                }
                _ => self.composite(*prototype, Some(anchors)),
            },
            _ => self.composite(root, None),
        }
        self.finish()
    }

    fn finish(mut self) -> Lowered {
        let lowered = &mut self.lowered;
        if let Some(batch) = &lowered.radial {
            let flags = &mut lowered.flags;
            flags.require(&SamplingRequirements::of_batch(batch));
            flags.set(TermFlags::TURNS);
            flags.set(TermFlags::VARIES);
            flags.set_if(TermFlags::UNBOUNDED, batch.range.is_none());
        }
        if let Some(program) = lowered.program.as_ref().filter(|program| program.has_force) {
            let flags = &mut lowered.flags;
            flags.require(&SamplingRequirements::of_program(program));
            let rule = program.sampling_rule;
            let at_centres = rule.sampling == Sampling::Centre && rule.cuts == Cuts::Never;
            // A reaction acts on the carrier at the place of the sample, off the carrier's centre of mass.
            flags.set_if(TermFlags::TURNS, !at_centres || program.reacts);
            flags.set(TermFlags::VARIES);
            flags.set_if(TermFlags::UNBOUNDED, program.reach.is_none());
            let otherwise = program.reads_velocity && program.as_drag().is_none();
            flags.set_if(TermFlags::READS_VELOCITY_OTHERWISE, otherwise);
        }
        let mut answers = lowered.detectors.iter();
        let answers = answers.any(|detector| detector.law != ContactLaw::Observe);
        lowered.flags.set_if(TermFlags::TURNS, answers);
        lowered
            .flags
            .set_if(TermFlags::UNBOUNDED, !lowered.constants.is_empty());
        self.lowered
    }

    /// Lowers a field that is a term by itself, or one instance of such a field.
    fn leaf(&mut self, place: u32, field: &Field, instance: &Anchor) {
        if !field.enabled || field.lifetime.steps == Some(0) {
            self.lowered.flags.set(TermFlags::LEFT_OUT);
            return;
        }
        let anchor = field.anchor.within(instance);
        let everywhere = field.region.is_everywhere();
        let range = field.region.as_centred_ball();
        let bare = field.scale.is_none() && field.limit.is_none() && !field.reacts;
        let rule = self.nodes.sampling_rule(place);
        // Only programs are sampled once per body.
        let in_batch = rule.sampling != Sampling::Centre && !field.coupling.reads_frame();
        match &field.formula {
            Formula::Contact(law)
                if everywhere
                    && field.lifetime.is_timeless()
                    && bare
                    && field.strength == 1.0
                    && field.groups.is_none()
                    && !matches!(field.coupling, Coupling::Axis(_)) =>
            {
                self.detector(place, 0, &anchor, *law, None);
            }
            formula if formula.is_zero() || field.strength == 0.0 && !field.is_contact() => {
                self.lowered.flags.set(TermFlags::LEFT_OUT);
            }
            Formula::Uniform(law)
                if everywhere
                    && field.lifetime.is_timeless()
                    && bare
                    && rule.sampling == Sampling::Centre
                    && !(rule.overridable && self.by_surface)
                    && field.acts_at_centre()
                    && anchor == Anchor::WORLD =>
            {
                self.lowered.constants.push(ConstantField {
                    serial: self.serial,
                    leaf: place,
                    vector: law.vector * field.strength,
                    mode: field.mode,
                });
            }
            // A batch computes the weight of a sample once for all of its sources.
            Formula::Radial(radial) if (everywhere || range.is_some()) && bare && in_batch => {
                self.radial(place, rule, field, radial, range, &anchor);
            }
            _ => self.instance_of_leaf(place, field, &anchor),
        }
    }

    fn radial(
        &mut self,
        leaf: u32,
        rule: SamplingRule,
        field: &Field,
        radial: &Radial,
        range: Option<Real>,
        anchor: &Anchor,
    ) {
        let radial = radial.times(field.strength);
        let (strength, law) = radial.unit();
        let batch = self.lowered.radial.get_or_insert_with(|| {
            let weighting = Weighting::of(field);
            let key = RadialKey {
                law: law.bits(),
                range: range.map_or(u64::MAX, |range| to_f64(range).to_bits()),
                weighting: weighting.clone(),
                sampling_rule: rule,
            };
            RadialBatch {
                key,
                law,
                prototype: field.clone(),
                range,
                weighting,
                sampling_rule: rule,
                sources: Vec::new(),
                serials: Vec::new(),
                on_colliders: 0,
                moving: 0,
                log: SourceLog::default(),
            }
        });
        let collider = match anchor {
            Anchor::Collider { handle, local_pose } if local_pose.translation == Vector::ZERO => {
                Some(*handle)
            }
            _ => None,
        };
        batch.on_colliders += usize::from(collider.is_some());
        batch.moving += usize::from(!matches!(anchor, Anchor::World { .. }));
        batch.serials.push(self.serial);
        batch.sources.push(RadialSource {
            anchor: self.anchors.hold(anchor),
            collider,
            strength,
            leaf,
        });
    }

    /// Adds an instance of the program of this field. Fields that differ only in their anchor share a program.
    fn instance_of_leaf(&mut self, place: u32, field: &Field, anchor: &Anchor) {
        self.lowered.program.get_or_insert_with(|| {
            let node = [Node::Leaf(Box::new(field.clone()))];
            let (program, _) = Program::lower(Nodes(&node), 0);
            program.about(None, Nodes(&node), 0)
        });
        self.instance(anchor, &[(place, Some(*anchor))]);
    }

    /// Lowers a composite, or `instances` of one. A composite by itself becomes one instance at the anchor of
    /// its first field, so that composites that differ only in their anchors share a program.
    fn composite(&mut self, node: u32, instances: Option<&[Anchor]>) {
        let (program, places) = Program::lower(self.nodes, node);
        // Without leaves there is nothing to evaluate: all of its fields were removed.
        if program.leaves.is_empty() {
            self.lowered.flags.set(TermFlags::LEFT_OUT);
            return;
        }
        let centre = instances.map(|_| Anchor::WORLD);
        let program = program.about(centre, self.nodes, node);
        let first = program.leaves.first().map(|leaf| leaf.anchor);
        let centre = centre.or(first).unwrap_or_default();
        let of_leaves = program.leaves.iter().map(|leaf| Some(leaf.anchor));
        let of_modifiers = program.modifiers.iter().map(Modifier::anchor);
        let local: Vec<Option<Anchor>> = of_leaves.chain(of_modifiers).collect();
        self.lowered.program = Some(program);
        for instance in instances.unwrap_or(&[Anchor::WORLD]) {
            let within = |anchor: &Option<Anchor>| anchor.map(|anchor| anchor.within(instance));
            let anchors = local.iter().map(within);
            let anchored: Vec<_> = places.iter().copied().zip(anchors).collect();
            self.instance(&centre.within(instance), &anchored);
        }
    }

    /// Adds an instance to the program: its centre, and for each leaf and modifier its place in the set and its
    /// anchor. Registers detection fields among them.
    fn instance(&mut self, centre: &Anchor, anchored: &[(u32, Option<Anchor>)]) {
        let Some(program) = &mut self.lowered.program else {
            return;
        };
        let number = program.instances.len() as u32;
        let mut moves = false;
        let mut found = Vec::new();
        program.instances.centres.push(self.anchors.hold(centre));
        program.instances.serials.push(self.serial);
        if program.is_one_field() {
            program.instances.strengths.push(program.leaves[0].strength);
        }
        for (leaf, (place, anchor)) in anchored.iter().enumerate() {
            let id = anchor.map_or(NO_ANCHOR, |anchor| self.anchors.hold(&anchor));
            moves |= anchor.is_some_and(|anchor| !matches!(anchor, Anchor::World { .. }));
            program.instances.anchors.push(id);
            program.instances.places.push(*place);
            let field = program.leaves.get(leaf);
            if let (Some(Formula::Contact(law)), Some(anchor)) =
                (field.map(|field| &field.formula), anchor)
            {
                let mask = FieldMask {
                    program: 0,
                    instance: 0,
                    leaf: leaf as u32,
                };
                found.push((*place, *anchor, *law, mask));
            }
        }
        program.instances.moving += usize::from(moves);
        for (leaf, anchor, law, mask) in found {
            self.detector(leaf, number, &anchor, law, Some(mask));
        }
    }

    /// Adds a detection field, given by its place and the number of the instance within the term.
    fn detector(
        &mut self,
        leaf: u32,
        instance: u32,
        anchor: &Anchor,
        law: ContactLaw,
        mask: Option<FieldMask>,
    ) {
        // Validation refuses detection fields with any other anchor.
        if let Anchor::Collider { handle, .. } = anchor {
            self.lowered.detectors.push(DetectionField {
                serial: self.serial,
                instance,
                leaf,
                anchor: self.anchors.hold(anchor),
                collider: *handle,
                law,
                mask,
            });
        }
    }
}
