//! From the tree to batches.

use std::collections::HashMap;

use crate::field::{
    Anchor, ContactLaw, Field, Formula, Modifier, Node, Radial, Sampling, SamplingRule, Tree,
};
use crate::math::{Pose, Real, Vector, to_f64};

use super::{
    AnchorId, Compiled, ConstantField, Detector, FieldMask, Plan, PlanEntry, Program, RadialBatch,
    RadialSource, SamplingRequirements, Weighting, program::NO_ANCHOR,
};

/// A field is looked for among this many of the last programs: a tree of fields that are all
/// different should not be compared with itself.
const MOST_COMPARED: usize = 64;

impl Compiled {
    /// Lowers a validated tree, for bodies some of which may ask for a sampling of their own.
    pub(crate) fn new(tree: Tree, overrides: Vec<Sampling>) -> Self {
        let mut lowering = Lowering::new(&tree);
        lowering.compiled.overrides = overrides;
        for term in tree.terms() {
            lowering.term(term);
        }
        let compiled = lowering.finish();
        Compiled { tree, ..compiled }
    }
}

struct Lowering<'a> {
    tree: &'a Tree,
    compiled: Compiled,
    anchor_ids: HashMap<AnchorKey, AnchorId>,
    radial_ids: HashMap<RadialKey, usize>,
    left_out: Vec<(String, usize)>,
}

/// Anchors are told apart by what they hang on and by the bits of their pose.
type AnchorKey = (u8, (u32, u32), [u64; 7]);
type RadialKey = ([u64; 7], Weighting, (u8, u64, bool, bool));

impl<'a> Lowering<'a> {
    fn new(tree: &'a Tree) -> Self {
        Lowering {
            tree,
            compiled: Compiled {
                tree: Tree::empty(),
                anchors: Vec::new(),
                constants: Vec::new(),
                radials: Vec::new(),
                programs: Vec::new(),
                detectors: Vec::new(),
                overrides: Vec::new(),
                requirements: SamplingRequirements::default(),
                plan: Plan::default(),
            },
            anchor_ids: HashMap::new(),
            radial_ids: HashMap::new(),
            left_out: Vec::new(),
        }
    }

    /// One operand of the outermost sum of union.
    fn term(&mut self, node: u32) {
        match &self.tree.nodes()[node as usize] {
            Node::Leaf(field) => self.leaf(node, field, &Anchor::WORLD),
            Node::Instances { prototype, anchors } => {
                match &self.tree.nodes()[*prototype as usize] {
                    Node::Leaf(field) => {
                        for anchor in anchors.iter() {
                            self.leaf(*prototype, field, anchor);
                        }
                    }
                    _ => self.program(*prototype, anchors),
                }
            }
            _ => self.program(node, &[Anchor::WORLD]),
        }
    }

    /// A field that is a term by itself.
    fn leaf(&mut self, place: u32, field: &Field, instance: &Anchor) {
        let anchor = field.anchor.within(instance);
        let everywhere = field.region.is_everywhere();
        let range = field.region.as_centred_ball();
        let bare = field.scale.is_none() && field.limit.is_none() && !field.reacts;
        let how = self.tree.how(place);
        // Only programs are sampled once per body, or finer where a border passes through one.
        let in_batch = how.sampling != Sampling::Centre
            && (everywhere || !self.may_be_adaptive(how))
            && !field.coupling.reads_frame();
        match &field.formula {
            formula if formula.is_zero() => {
                self.leave_out(format!(
                    "{}: zero wherever it is defined",
                    field.label(place as usize)
                ));
            }
            Formula::Contact(law) if everywhere => self.detector(place, &anchor, *law, None),
            Formula::Uniform(law)
                if everywhere
                    && bare
                    && how.sampling == Sampling::Centre
                    && field.acts_at_centre()
                    && anchor == Anchor::WORLD =>
            {
                self.compiled.constants.push(ConstantField {
                    leaf: place,
                    vector: law.vector,
                    mode: field.mode,
                });
            }
            // A batch weighs its samples once for all its sources.
            Formula::Radial(radial) if (everywhere || range.is_some()) && bare && in_batch => {
                self.radial((place, how), field, radial, range, &anchor);
            }
            _ => self.program_of_leaf(place, field, instance),
        }
    }

    /// Whether the term may be sampled adaptively, on some bodies at least.
    fn may_be_adaptive(&self, how: SamplingRule) -> bool {
        let mut overrides = self.compiled.overrides.iter();
        let by_body = overrides.any(|own| own.tolerance().is_some());
        how.sampling.tolerance().is_some() || how.overridable && by_body
    }

    fn radial(
        &mut self,
        (leaf, how): (u32, SamplingRule),
        field: &Field,
        radial: &Radial,
        range: Option<Real>,
        anchor: &Anchor,
    ) {
        let (strength, law) = radial.unit();
        let weighting = Weighting {
            mode: field.mode,
            coupling: field.coupling.clone(),
            groups: field.groups,
        };
        let key = (radial_bits(&law, range), weighting.clone(), how.key());
        let batches = &mut self.compiled.radials;
        let batch = *self.radial_ids.entry(key).or_insert_with(|| {
            batches.push(RadialBatch {
                law,
                range,
                weighting,
                how,
                sources: Vec::new(),
            });
            batches.len() - 1
        });
        let collider = match anchor {
            Anchor::Collider { handle, local_pose } if local_pose.translation == Vector::ZERO => {
                Some(*handle)
            }
            _ => None,
        };
        let anchor = self.anchor(anchor);
        self.compiled.radials[batch].sources.push(RadialSource {
            anchor,
            collider,
            strength,
            leaf,
        });
    }

    /// Fields that are alike but for their anchor become instances of one program.
    fn program_of_leaf(&mut self, place: u32, field: &Field, instance: &Anchor) {
        let programs = self.compiled.programs.iter().enumerate().rev();
        let like = |program: &Program| matches!(&program.leaves[..], [leaf] if leaf.is_like(field));
        let known = programs
            .take(MOST_COMPARED)
            .find(|(_, program)| like(program));
        let index = known.map(|(index, _)| index).unwrap_or_else(|| {
            let (mut program, _) = Program::lower(self.tree, place);
            program.reach = field.region.bounding_radius();
            self.compiled.programs.push(program);
            self.compiled.programs.len() - 1
        });
        let anchor = field.anchor.within(instance);
        self.instance(index, &anchor, &[(place, Some(anchor))]);
    }

    fn program(&mut self, node: u32, instances: &[Anchor]) {
        let (program, places) = Program::lower(self.tree, node);
        let of_leaves = program.leaves.iter().map(|leaf| Some(leaf.anchor));
        let of_modifiers = program.modifiers.iter().map(Modifier::anchor);
        let local: Vec<Option<Anchor>> = of_leaves.chain(of_modifiers).collect();
        self.compiled.programs.push(program);
        let index = self.compiled.programs.len() - 1;
        for instance in instances {
            let within = |anchor: &Option<Anchor>| anchor.map(|anchor| anchor.within(instance));
            let anchors = local.iter().map(within);
            let anchored: Vec<_> = places.iter().copied().zip(anchors).collect();
            self.instance(index, instance, &anchored);
        }
    }

    /// Adds an instance to a program: its centre, and for each leaf and modifier its place in the
    /// tree and its anchor. Detection fields among them are registered.
    fn instance(&mut self, index: usize, centre: &Anchor, anchored: &[(u32, Option<Anchor>)]) {
        let centre = self.anchor(centre);
        let number = self.compiled.programs[index].centres.len() as u32;
        self.compiled.programs[index].centres.push(centre);
        for (leaf, (place, anchor)) in anchored.iter().enumerate() {
            let id = anchor.map_or(NO_ANCHOR, |anchor| self.anchor(&anchor));
            let program = &mut self.compiled.programs[index];
            program.anchors.push(id);
            program.places.push(*place);
            let field = program.leaves.get(leaf);
            if let (Some(Formula::Contact(law)), Some(anchor)) =
                (field.map(|field| field.formula.clone()), anchor)
            {
                let mask = FieldMask {
                    program: index as u32,
                    instance: number,
                    leaf: leaf as u32,
                };
                self.detector(*place, anchor, law, Some(mask));
            }
        }
    }

    fn detector(&mut self, leaf: u32, anchor: &Anchor, law: ContactLaw, mask: Option<FieldMask>) {
        // Validation has refused detection fields that are anchored to anything else.
        if let Anchor::Collider { handle, .. } = anchor {
            let anchor = self.anchor(anchor);
            self.compiled.detectors.push(Detector {
                leaf,
                anchor,
                collider: *handle,
                law,
                mask,
            });
        }
    }

    fn anchor(&mut self, anchor: &Anchor) -> AnchorId {
        let anchors = &mut self.compiled.anchors;
        *self
            .anchor_ids
            .entry(anchor_key(anchor))
            .or_insert_with(|| {
                anchors.push(*anchor);
                anchors.len() as AnchorId - 1
            })
    }

    fn leave_out(&mut self, what: String) {
        match self.left_out.last_mut() {
            Some((last, count)) if *last == what => *count += 1,
            _ => self.left_out.push((what, 1)),
        }
    }

    fn finish(mut self) -> Compiled {
        let left_out = self.left_out.into_iter().map(|(what, count)| match count {
            1 => what,
            _ => format!("{what} (×{count})"),
        });
        self.compiled.requirements = SamplingRequirements::by(&self.compiled);
        self.compiled.plan = Plan::of(&self.compiled, self.tree, left_out.collect());
        self.compiled
    }
}

fn anchor_key(anchor: &Anchor) -> AnchorKey {
    let (kind, handle) = match anchor {
        Anchor::World { .. } => (0, (0, 0)),
        Anchor::Body { handle, .. } => (1, handle.into_raw_parts()),
        Anchor::Collider { handle, .. } => (2, handle.into_raw_parts()),
    };
    (kind, handle, pose_bits(anchor.local_pose()))
}

fn pose_bits(pose: &Pose) -> [u64; 7] {
    let (t, r) = (pose.translation, pose.rotation);
    [t.x, t.y, t.z, r.x, r.y, r.z, r.w].map(|x| to_f64(x).to_bits())
}

fn radial_bits(law: &Radial, range: Option<Real>) -> [u64; 7] {
    let [kind, a, b, c, d, e] = law.bits();
    let range = range.map_or(u64::MAX, |range| to_f64(range).to_bits());
    [kind, a, b, c, d, e, range]
}

impl Plan {
    fn of(compiled: &Compiled, tree: &Tree, left_out: Vec<String>) -> Plan {
        let mut entries = Vec::new();
        for constant in &compiled.constants {
            entries.push(PlanEntry::constant(constant, tree));
        }
        for batch in &compiled.radials {
            entries.push(PlanEntry::radial(batch));
        }
        for program in compiled.programs.iter().filter(|program| program.has_force) {
            entries.push(PlanEntry::program(program));
        }
        let mut axes: Vec<String> = Vec::new();
        for axis in tree.axes() {
            if !axes.iter().any(|known| known == axis.name()) {
                axes.push(axis.name().to_owned());
            }
        }
        Plan {
            fields: tree.field_count(),
            anchors: compiled.anchors.len(),
            reads_velocity: tree.reads_velocity(),
            varies: tree.may_vary(),
            samples_parts: compiled.requirements.parts,
            torque_possible: compiled.torque_possible(),
            detectors: compiled.detectors.len(),
            entries,
            axes,
            left_out,
        }
    }
}
