//! The recursive walk over a tree at one sample, over [numbers](Single) with or without derivatives, and with or
//! without a log.

use std::cell::RefCell;

use super::trace::{Contribution, Fate};
use crate::field::{
    Anchor, Field, Frame, Frames, LocalQuery, Modifier, Motion, Neighbourhood, Node, Nodes, Normal,
    Operator, Override, Pieces, Query, QueryProperties, Single,
};
use crate::math::InteractionGroups;
use crate::number::{Vec3, real};

/// The value of a composite at a sample.
pub(super) struct TracedValue<T> {
    /// The pieces of the sample's neighbourhood on which the composite is defined.
    pub defined: Pieces,
    pub vector: Vec3<T>,
    /// The entries of the log whose forces are part of `vector`.
    holds: Vec<u32>,
}

impl<T: Single> TracedValue<T> {
    fn undefined() -> Self {
        TracedValue {
            defined: Pieces::NONE,
            vector: Vec3::zero(),
            holds: Vec::new(),
        }
    }
}

pub(super) struct TreeWalk<'a, F, T> {
    nodes: Nodes<'a>,
    frames: &'a F,
    query: &'a Query,
    motion: Motion<T>,
    here: Neighbourhood,
    pub log: Option<RefCell<Vec<Contribution>>>,
}

impl<'a, F: Frames, T: Single> TreeWalk<'a, F, T> {
    pub fn new(nodes: Nodes<'a>, frames: &'a F, query: &'a Query, motion: Motion<T>) -> Self {
        TreeWalk {
            nodes,
            frames,
            query,
            motion,
            here: Neighbourhood::open(),
            log: None,
        }
    }

    /// The value of an instance of the subtree at `root`.
    pub fn subtree(&mut self, root: u32, instance: &Anchor) -> TracedValue<T> {
        self.here = self.neighbourhood(root, *instance);
        self.node(root, instance)
    }

    /// The pieces into which the surfaces of all regions that touch the sample cut its neighbourhood.
    fn neighbourhood(&self, root: u32, instance: Anchor) -> Neighbourhood {
        let mut normals: Vec<Normal> = Vec::new();
        let mut open = vec![(root, instance)];
        while let Some((node, instance)) = open.pop() {
            let node = self.nodes.get(node);
            match node {
                Node::Leaf(field) => {
                    if let Ok(frame) = self.acting_frame(field, &instance) {
                        let local = LocalQuery::moving(self.query, &self.motion, &frame);
                        field.region.touched(&local, &mut normals);
                    }
                }
                Node::Instances { prototype, anchors } => {
                    open.extend(anchors.iter().map(|a| (*prototype, a.within(&instance))));
                }
                _ => open.extend(node.operands().iter().map(|operand| (*operand, instance))),
            }
        }
        Neighbourhood::of(&normals)
    }

    /// The frame of a field, or the reason why the field does not act on the sample. Regions are not tested
    /// here.
    fn acting_frame(&self, field: &Field, instance: &Anchor) -> Result<Frame, Fate> {
        let frame = self.frames.frame(&field.anchor.within(instance));
        let frame = frame.ok_or(Fate::AnchorGone)?;
        if !field.is_on(self.query.span()) {
            return Err(Fate::Off);
        }
        if frame.body.is_some() && frame.body == self.query.body {
            return Err(Fate::OwnBody);
        }
        let allowed = |groups: InteractionGroups| groups.test(self.query.groups);
        if !field.groups.is_none_or(allowed) {
            return Err(Fate::OtherGroups);
        }
        Ok(frame)
    }

    /// Evaluates a node. Recursion is safe, since the depth of a tree is limited.
    fn node(&self, node: u32, instance: &Anchor) -> TracedValue<T> {
        match self.nodes.get(node) {
            Node::Leaf(field) => self.leaf(node, field, instance),
            Node::Vacant => TracedValue::undefined(),
            Node::Operation { operator, operands } => {
                let values = operands.iter().map(|operand| self.node(*operand, instance));
                let combined = values.reduce(|u, v| self.apply(*operator, u, v));
                combined.unwrap_or_else(TracedValue::undefined)
            }
            Node::Instances { prototype, anchors } => {
                let values = anchors
                    .iter()
                    .map(|a| self.node(*prototype, &a.within(instance)));
                values.fold(TracedValue::undefined(), |u, v| {
                    self.apply(Operator::SumUnion, u, v)
                })
            }
            Node::Modified { operand, modifier } => {
                let value = self.node(*operand, instance);
                self.modified(value, modifier, instance)
            }
            Node::Layers { operands, modes } => {
                let values = operands.iter().map(|operand| self.node(*operand, instance));
                self.layers(values.collect(), modes)
            }
        }
    }

    // Not inlined, like `leaf`: a recursive function should need little of the stack.
    #[inline(never)]
    fn modified(
        &self,
        mut value: TracedValue<T>,
        modifier: &Modifier,
        instance: &Anchor,
    ) -> TracedValue<T> {
        if value.defined.any() {
            let anchor = modifier.anchor().map(|anchor| anchor.within(instance));
            let frame = anchor.and_then(|anchor| self.frames.frame(&anchor));
            let local = frame.map(|frame| LocalQuery::moving(self.query, &self.motion, &frame));
            value.vector = modifier.apply(value.vector, local.as_ref());
        }
        value
    }

    #[inline(never)]
    fn leaf(&self, place: u32, field: &Field, instance: &Anchor) -> TracedValue<T> {
        let frame = match self.acting_frame(field, instance) {
            Ok(frame) => frame,
            Err(fate) => {
                self.note(Contribution::none(place, fate));
                return TracedValue::undefined();
            }
        };
        let local = LocalQuery::moving(self.query, &self.motion, &frame);
        let defined = field.region.set(&local, &self.here);
        if !defined.any() {
            self.note(Contribution::none(place, Fate::OutsideRegion));
            return TracedValue::undefined();
        }
        let vector = field.force(&local);
        let entry = self.note(Contribution {
            force: Some(real(vector)),
            potential: field.potential(&local).map(|potential| potential.re()),
            carrier: frame.body,
            ..Contribution::none(place, Fate::Counts)
        });
        TracedValue {
            defined,
            vector,
            holds: entry.into_iter().collect(),
        }
    }

    /// Applies the tables at [`Operator`], line by line, for vector U on region E and vector V on region G.
    fn apply(&self, operator: Operator, u: TracedValue<T>, v: TracedValue<T>) -> TracedValue<T> {
        use Operator::*;
        let (e, g) = (u.defined, v.defined);
        let (on_e, on_g) = (e.any(), g.any());
        let defined = match operator {
            SumUnion | CrossUnion | ReplaceUnion | Strongest | Weakest | Minimum | Maximum => {
                self.here.union(e, g)
            }
            SumIntersection | CrossIntersection | ReplaceIntersection => {
                self.here.intersection(e, g)
            }
            Difference => self.here.difference(e, g),
        };
        if !defined.any() {
            let by_v = operator == Difference && on_g;
            self.lose(&u.holds, operator, by_v.then_some(&v.holds));
            if operator == Difference {
                self.decide(&v.holds, Fate::Cuts);
            } else {
                self.lose(&v.holds, operator, None);
            }
            return TracedValue::undefined();
        }
        if !on_g {
            return TracedValue { defined, ..u };
        }
        if operator == Difference {
            self.decide(&v.holds, Fate::Cuts);
            return TracedValue { defined, ..u };
        }
        if !on_e {
            return TracedValue { defined, ..v };
        }
        let size = |vector: Vec3<T>| real(vector).length_squared();
        let v_wins = match operator {
            ReplaceUnion | ReplaceIntersection => Some(true),
            Strongest => Some(size(v.vector) > size(u.vector)),
            Weakest => Some(size(v.vector) < size(u.vector)),
            _ => None,
        };
        match v_wins {
            Some(true) => {
                self.lose(&u.holds, operator, Some(&v.holds));
                TracedValue { defined, ..v }
            }
            Some(false) => {
                self.lose(&v.holds, operator, Some(&u.holds));
                TracedValue { defined, ..u }
            }
            None => {
                let lesser = |a: T, b: T| if b.re() < a.re() { b } else { a };
                let greater = |a: T, b: T| if b.re() > a.re() { b } else { a };
                let vector = match operator {
                    CrossUnion | CrossIntersection => u.vector.cross(v.vector),
                    Minimum => u.vector.zip(v.vector, lesser),
                    Maximum => u.vector.zip(v.vector, greater),
                    _ => u.vector + v.vector,
                };
                let mut holds = u.holds;
                holds.extend(v.holds);
                TracedValue {
                    defined,
                    vector,
                    holds,
                }
            }
        }
    }

    /// Applies the rule at [`Tree::layers`](crate::Tree::layers), for operands of falling priority.
    fn layers(&self, values: Vec<TracedValue<T>>, modes: &[Override]) -> TracedValue<T> {
        let mut gathered = TracedValue::undefined();
        let mut stopped_by: Option<Vec<u32>> = None;
        for (value, mode) in values.into_iter().zip(modes) {
            gathered.defined = self.here.union(gathered.defined, value.defined);
            if let Some(by) = &stopped_by {
                self.decide(&value.holds, overruled("stop", self.places(by)));
                continue;
            }
            if !value.defined.any() {
                continue;
            }
            if mode.replaces {
                self.decide(
                    &gathered.holds,
                    overruled("replace", self.places(&value.holds)),
                );
                gathered.vector = Vec3::zero();
                gathered.holds.clear();
            }
            gathered.vector += value.vector;
            if mode.stops {
                stopped_by = Some(value.holds.clone());
            }
            gathered.holds.extend(value.holds);
        }
        gathered
    }

    /// Writes a field into the log, if there is one; returns the number of the entry.
    fn note(&self, contribution: Contribution) -> Option<u32> {
        let mut log = self.log.as_ref()?.borrow_mut();
        log.push(contribution);
        Some(log.len() as u32 - 1)
    }

    fn decide(&self, holds: &[u32], fate: Fate) {
        if let Some(log) = &self.log {
            for entry in holds {
                log.borrow_mut()[*entry as usize].fate = fate.clone();
            }
        }
    }

    /// Marks fields as no longer part of the result: overruled by others, or unmatched if `by` is `None`.
    fn lose(&self, holds: &[u32], operator: Operator, by: Option<&Vec<u32>>) {
        let operator = operator.symbol();
        let fate = match by {
            Some(by) => overruled(operator, self.places(by)),
            None => Fate::Unmatched { operator },
        };
        self.decide(holds, fate);
    }

    fn places(&self, holds: &[u32]) -> Vec<u32> {
        let Some(log) = &self.log else {
            return Vec::new();
        };
        let log = log.borrow();
        holds
            .iter()
            .map(|entry| log[*entry as usize].place)
            .collect()
    }
}

fn overruled(operator: &'static str, by: Vec<u32>) -> Fate {
    Fate::Overruled { operator, by }
}
