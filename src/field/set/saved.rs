//! A set as data, and back. The structure of the data is checked on reading.

use serde::{Deserialize, Serialize};

use super::arena::{Arena, NONE};
use super::{FieldSet, InsertedTree, Term};
use crate::field::nodes::Node;
use crate::field::properties::UserProperties;

/// The parts of a set that are saved.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedSet {
    nodes: Vec<Node>,
    generations: Vec<u32>,
    free: Vec<u32>,
    terms: Vec<Term>,
    next_serial: u64,
    trees: Vec<InsertedTree>,
    free_trees: Vec<u32>,
    data: UserProperties,
    mark: u64,
}

impl From<FieldSet> for SavedSet {
    fn from(set: FieldSet) -> Self {
        let mark = set.mark();
        let (nodes, generations, free) = set.arena.into_parts();
        SavedSet {
            nodes,
            generations,
            free,
            terms: set.terms,
            next_serial: set.next_serial,
            trees: set.trees,
            free_trees: set.free_trees,
            data: set.data,
            mark,
        }
    }
}

impl TryFrom<SavedSet> for FieldSet {
    type Error = String;

    fn try_from(saved: SavedSet) -> Result<Self, String> {
        saved.check_lists()?;
        let parents = saved.parents()?;
        let data = saved.data.checked().map_err(|error| error.to_string())?;
        let mut set = FieldSet {
            arena: Arena::from_parts(saved.nodes, saved.generations, saved.free, parents),
            terms: saved.terms,
            next_serial: saved.next_serial,
            trees: saved.trees,
            free_trees: saved.free_trees,
            data,
            ..FieldSet::default()
        };
        for term in set.terms.clone() {
            set.arena.set_root(term.root, term.serial);
            set.unchecked.terms.push(term.serial);
        }
        for place in 0..set.arena.list().len() as u32 {
            set.settle(place);
        }
        set.changes.go_on_from(saved.mark);
        Ok(set)
    }
}

fn is_distinct(places: &[u32]) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    sorted.is_sorted_by(|a, b| a < b)
}

impl SavedSet {
    /// Checks that all numbers are in range, and lists in order.
    fn check_lists(&self) -> Result<(), String> {
        let count = self.nodes.len();
        if self.generations.len() != count {
            return Err(format!(
                "{count} nodes with {} generations",
                self.generations.len()
            ));
        }
        let is_vacant = |place: &u32| matches!(self.nodes.get(*place as usize), Some(Node::Vacant));
        if !is_distinct(&self.free) || !self.free.iter().all(is_vacant) {
            return Err("a place is free that is in use".to_owned());
        }
        let ordered = self.terms.is_sorted_by(|a, b| a.serial < b.serial);
        let last = self.terms.last().map_or(0, |term| term.serial);
        if !ordered || (!self.terms.is_empty() && last >= self.next_serial) {
            return Err("terms are out of order".to_owned());
        }
        let known = |serial: &u64| {
            let place = self.terms.binary_search_by_key(serial, |term| term.serial);
            place.is_ok()
        };
        let trees = self.trees.iter();
        let sound = |tree: &InsertedTree| tree.terms.is_sorted() && tree.terms.iter().all(known);
        let home = |term: &Term| term.tree == NONE || (term.tree as usize) < self.trees.len();
        let is_gone = |tree: &u32| self.trees.get(*tree as usize).is_some_and(|t| !t.there);
        let unused = is_distinct(&self.free_trees) && self.free_trees.iter().all(is_gone);
        if !(trees.clone().all(sound) && self.terms.iter().all(home) && unused) {
            return Err("a tree has terms that are not there".to_owned());
        }
        Ok(())
    }

    /// The node that uses each node. Checks that each node in use belongs to exactly one root.
    fn parents(&self) -> Result<Vec<u32>, String> {
        let mut parents = vec![NONE; self.nodes.len()];
        let mut seen = vec![false; self.nodes.len()];
        for term in &self.terms {
            let mut open = vec![term.root];
            while let Some(place) = open.pop() {
                let node = self.nodes.get(place as usize);
                let node = node.ok_or_else(|| format!("there is no node {place}"))?;
                if std::mem::replace(&mut seen[place as usize], true) {
                    return Err(format!("node {place} is used twice"));
                }
                for operand in node.operands() {
                    if let Some(parent) = parents.get_mut(*operand as usize) {
                        *parent = place;
                    }
                    open.push(*operand);
                }
                if !node.is_whole() {
                    let message = format!("node {place}: the number of its operands does not fit");
                    return Err(message);
                }
            }
        }
        for place in &self.free {
            if seen[*place as usize] {
                return Err(format!("node {place} is free and used"));
            }
        }
        let lost = self.nodes.iter().zip(&seen);
        let lost = lost.filter(|(node, seen)| !**seen && !matches!(node, Node::Vacant));
        match lost.count() {
            0 => Ok(parents),
            count => Err(format!("{count} nodes belong to nothing")),
        }
    }
}
