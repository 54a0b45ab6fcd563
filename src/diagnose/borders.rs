//! The borders of a term's regions near a body, found from the tree.

use super::sampled::SampledFields;
use crate::field::{Anchor, Border, Frames, Node, Nodes, Query, QueryProperties};
use crate::math::{DVec3, to_dvec3};
use crate::reference::Reference;

/// The borders in a reference's subtree that may pass through a body, given by its index among the sampled ones.
pub(super) fn near(
    fields: &SampledFields<'_, impl Frames>,
    of: &Reference<'_>,
    body: u32,
) -> Vec<Border> {
    let samples = fields.samples;
    let centre = &samples.centres[body as usize];
    let bulk = samples.bulks.get(body as usize);
    let mut found = BorderSearch {
        nodes: fields.set.nodes(),
        frames: fields.frames,
        query: samples.query(centre, fields.moment),
        world_point: to_dvec3(centre.world_point),
        extent: bulk.map_or(0.0, |bulk| bulk.extent),
        borders: Vec::new(),
    };
    found.below(of.root, &of.instance);
    found.borders
}

struct BorderSearch<'a, F> {
    nodes: Nodes<'a>,
    frames: &'a F,
    query: Query,
    world_point: DVec3,
    extent: f64,
    borders: Vec<Border>,
}

impl<F: Frames> BorderSearch<'_, F> {
    /// Recursion is safe, because the depth of a tree is limited.
    fn below(&mut self, node: u32, instance: &Anchor) {
        match self.nodes.get(node) {
            Node::Leaf(field) => {
                let frame = self.frames.frame(&field.anchor.within(instance));
                if let Some(frame) = frame
                    && field.is_on(self.query.span())
                    && !frame.carries(&self.query)
                {
                    let (point, borders) = (self.world_point, &mut self.borders);
                    Border::near(field, &frame, point, self.extent, borders);
                }
            }
            Node::Instances { prototype, anchors } => {
                for anchor in anchors.iter() {
                    self.below(*prototype, &anchor.within(instance));
                }
            }
            inner => {
                for operand in inner.operands() {
                    self.below(*operand, instance);
                }
            }
        }
    }
}
