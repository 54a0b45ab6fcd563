//! The list of a set's nodes, with generations.

use crate::field::handle::FieldHandle;
use crate::field::leaf::Field;
use crate::field::nodes::Node;

/// Stands for the absence of a number.
pub(super) const NONE: u32 = u32::MAX;

/// Nodes in places that are reused, each time with another generation.
#[derive(Clone, Debug, Default)]
pub(super) struct Arena {
    nodes: Vec<Node>,
    slots: Vec<Slot>,
    free: Vec<u32>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    generation: u32,
    /// The node that uses this one, or [`NONE`] for the root of a term.
    parent: u32,
    /// The serial of the term, for its root.
    serial: u64,
}

impl Arena {
    /// Nodes, generations and free places.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn into_parts(self) -> (Vec<Node>, Vec<u32>, Vec<u32>) {
        let generations = self.slots.iter().map(|slot| slot.generation);
        (self.nodes, generations.collect(), self.free)
    }

    /// From parts that were checked, with the parent of each node.
    #[cfg(feature = "serde-serialize")]
    pub(super) fn from_parts(
        nodes: Vec<Node>,
        generations: Vec<u32>,
        free: Vec<u32>,
        parents: Vec<u32>,
    ) -> Self {
        let slots = generations.into_iter().zip(parents);
        let slots = slots.map(|(generation, parent)| Slot {
            generation,
            parent,
            serial: 0,
        });
        Arena {
            nodes,
            slots: slots.collect(),
            free,
        }
    }

    pub(super) fn list(&self) -> &[Node] {
        &self.nodes
    }

    /// Adds nodes that refer to each other by their numbers in the list. Returns the place of each.
    pub(super) fn insert_all(&mut self, nodes: Vec<Node>) -> Vec<u32> {
        let places: Vec<u32> = nodes.iter().map(|_| self.take_place()).collect();
        for (mut node, place) in nodes.into_iter().zip(&places) {
            for operand in node.operands_mut() {
                *operand = places[*operand as usize];
                self.slots[*operand as usize].parent = *place;
            }
            self.nodes[*place as usize] = node;
        }
        places
    }

    fn take_place(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.nodes.push(Node::Vacant);
            self.slots.push(Slot::default());
            self.nodes.len() as u32 - 1
        })
    }

    pub(super) fn set_root(&mut self, place: u32, serial: u64) {
        let slot = &mut self.slots[place as usize];
        (slot.parent, slot.serial) = (NONE, serial);
    }

    /// The serial of the term that a node belongs to.
    pub(super) fn serial_of(&self, place: u32) -> Option<u64> {
        let mut slot = self.slots.get(place as usize)?;
        while slot.parent != NONE {
            slot = &self.slots[slot.parent as usize];
        }
        Some(slot.serial)
    }

    pub(super) fn handle(&self, place: u32) -> FieldHandle {
        FieldHandle {
            index: place,
            generation: self.slots[place as usize].generation,
        }
    }

    pub(super) fn holds(&self, handle: FieldHandle) -> bool {
        let slot = self.slots.get(handle.index as usize);
        slot.is_some_and(|slot| slot.generation == handle.generation)
    }

    pub(super) fn field_mut(&mut self, place: u32) -> Option<&mut Field> {
        match self.nodes.get_mut(place as usize)? {
            Node::Leaf(field) => Some(field),
            _ => None,
        }
    }

    /// Removes a leaf, and leaves its place vacant for the operation that uses it.
    pub(super) fn vacate(&mut self, place: u32) {
        self.nodes[place as usize] = Node::Vacant;
        let slot = &mut self.slots[place as usize];
        slot.generation = slot.generation.wrapping_add(1);
    }

    /// Removes a node; its place may be used again.
    pub(super) fn free(&mut self, place: u32) {
        self.vacate(place);
        self.free.push(place);
    }
}
