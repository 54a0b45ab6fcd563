//! The set of all fields of a world, with look-up by handles and names.

mod arena;
mod changes;
mod index;
mod names;
#[cfg(feature = "serde-serialize")]
mod saved;
mod unchecked;
mod validity;

use std::collections::HashSet;

use super::handle::{FieldHandle, TreeHandle};
use super::leaf::Field;
use super::lifetime::Span;
use super::nodes::{Node, Nodes};
use super::operator::Operator;
use super::properties::{ColliderProperties, PropertyError, UserProperties};
use super::sampling::Sampling;
use super::tree::Tree;
use super::{Axis, BuildError, FieldRef};
use crate::math::{ColliderHandle, Real, RigidBodyHandle, from_f64};

use arena::{Arena, NONE};
pub(crate) use changes::Change;
use changes::Changes;
use names::FieldNames;
use unchecked::Unchecked;

/// An operand of the outermost sum of union of a set. The forces of all terms add up, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub(crate) struct Term {
    /// The number of the term in the order in which terms were inserted.
    pub serial: u64,
    pub root: u32,
    /// The tree that it was inserted with; [`NONE`] if it is a field by itself.
    tree: u32,
}

/// A tree that was inserted into a set, with the serials of its terms.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
struct InsertedTree {
    generation: u32,
    terms: Vec<u64>,
    there: bool,
}

/// The fields of a world: single fields and trees, whose sum of union acts on its bodies.
///
/// A set is plain data. Each field in it, at any depth of any tree, has a [`FieldHandle`], and may have a name;
/// both lead to the field, which can be changed in place.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let wind = Field::uniform(Vector::X).named("wind");
/// let lee = Field::uniform(Vector::ZERO).within(Region::ball(2.0)).named("lee");
/// let mut set = FieldSet::from(wind.replace_union(lee));
/// let well = set.insert_field(Field::spring(4.0));
///
/// set["wind"].strength = 3.0;
/// set["lee"].anchor = Vector::new(0.0, 1.0, 0.0).into();
/// set[well].enabled = false;
///
/// let wind = set.handle("wind").expect("it has that name");
/// assert_eq!(set[wind].strength, 3.0);
/// set.remove_field(well);
/// assert!(set.get(well).is_none(), "gone, and no other field in its place");
/// assert!(set.get("calm").is_none());
/// ```
///
/// Changed fields are checked when they are used; see [`validate_changes`](Self::validate_changes).
#[derive(Clone, Debug, Default)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(try_from = "saved::SavedSet", into = "saved::SavedSet")
)]
pub struct FieldSet {
    arena: Arena,
    /// In the order of serials.
    terms: Vec<Term>,
    next_serial: u64,
    trees: Vec<InsertedTree>,
    free_trees: Vec<u32>,
    names: FieldNames,
    /// Places of the fields with a lifetime that begins or ends.
    timed: Vec<u32>,
    data: UserProperties,
    changes: Changes,
    unchecked: Unchecked,
}

impl FieldSet {
    /// A set without fields.
    pub fn new() -> Self {
        FieldSet::default()
    }

    /// Adds a tree. If its root is a sum of union, its operands become terms, as if they were inserted one by
    /// one.
    pub fn insert(&mut self, tree: impl Into<Tree>) -> TreeHandle {
        let mut nodes = tree.into().nodes;
        let roots = match nodes.pop() {
            Some(Node::Operation {
                operator: Operator::SumUnion,
                operands,
            }) => operands,
            Some(root) => {
                nodes.push(root);
                vec![nodes.len() as u32 - 1]
            }
            None => Vec::new(),
        };
        let index = self.free_trees.pop().unwrap_or(self.trees.len() as u32);
        if index as usize == self.trees.len() {
            self.trees.push(InsertedTree::default());
        }
        let places = self.arena.insert_all(nodes);
        let first = self.next_serial;
        for root in roots {
            self.add_term(places[root as usize], index);
        }
        for place in places {
            self.settle(place);
        }
        let tree = &mut self.trees[index as usize];
        tree.terms = (first..self.next_serial).collect();
        tree.there = true;
        TreeHandle {
            index,
            generation: tree.generation,
        }
    }

    /// Adds a field as a term of its own.
    pub fn insert_field(&mut self, field: Field) -> FieldHandle {
        let places = self.arena.insert_all(vec![Node::Leaf(Box::new(field))]);
        self.add_term(places[0], NONE);
        self.settle(places[0]);
        self.arena.handle(places[0])
    }

    fn add_term(&mut self, root: u32, tree: u32) {
        let serial = self.next_serial;
        self.next_serial += 1;
        self.arena.set_root(root, serial);
        self.terms.push(Term { serial, root, tree });
        self.changes.push(Change::Term(serial));
        self.unchecked.terms.push(serial);
    }

    /// Removes all fields. Axes, and properties of colliders and bodies, stay.
    pub fn clear(&mut self) {
        let serials: Vec<u64> = self.terms.iter().rev().map(|term| term.serial).collect();
        for serial in serials {
            self.remove_term(serial);
        }
        for index in 0..self.trees.len() as u32 {
            if self.trees[index as usize].there {
                self.forget_tree(index);
            }
        }
    }

    /// Removes a tree, and returns what is left of it; `None` if it is not (or no longer) in the set.
    pub fn remove(&mut self, tree: TreeHandle) -> Option<Tree> {
        let entry = self.inserted(tree)?;
        let serials = entry.terms.clone();
        let taken: Vec<Tree> = serials
            .iter()
            .filter_map(|serial| self.term(*serial))
            .map(|term| self.nodes().subtree(term.root))
            .collect();
        for serial in serials {
            self.remove_term(serial);
        }
        self.forget_tree(tree.index);
        Some(Tree::fold(Operator::SumUnion, taken))
    }

    fn inserted(&self, tree: TreeHandle) -> Option<&InsertedTree> {
        let entry = self.trees.get(tree.index as usize)?;
        (entry.there && entry.generation == tree.generation).then_some(entry)
    }

    fn forget_tree(&mut self, index: u32) {
        let entry = &mut self.trees[index as usize];
        entry.terms.clear();
        entry.there = false;
        entry.generation = entry.generation.wrapping_add(1);
        self.free_trees.push(index);
    }

    /// Removes a field. A field that is a term leaves the set; one inside a composite is then defined nowhere,
    /// like one whose anchor is gone. `None` if the field is not in the set.
    pub fn remove_field(&mut self, field: FieldHandle) -> Option<Field> {
        let taken = self.get(field)?.clone();
        let term = self.term_of(field.index)?;
        if term.root == field.index {
            self.remove_term(term.serial);
            if let Some(tree) = self.trees.get_mut(term.tree as usize)
                && let Ok(place) = tree.terms.binary_search(&term.serial)
            {
                tree.terms.remove(place);
            }
        } else {
            self.forget_leaf(field.index);
            self.arena.vacate(field.index);
            self.changes.push(Change::Term(term.serial));
            // Without the field the rest of the term may not be valid.
            self.unchecked.terms.push(term.serial);
        }
        Some(taken)
    }

    fn remove_term(&mut self, serial: u64) {
        let Ok(place) = self.terms.binary_search_by_key(&serial, |term| term.serial) else {
            return;
        };
        let term = self.terms.remove(place);
        for node in self.nodes().below(term.root) {
            self.forget_leaf(node);
            self.arena.free(node);
        }
        self.changes.push(Change::Term(serial));
    }

    /// Removes a leaf from all lists except that of the nodes.
    fn forget_leaf(&mut self, place: u32) {
        self.names.forget(place);
        if let Ok(at) = self.timed.binary_search(&place) {
            self.timed.remove(at);
        }
    }

    /// The fields of a tree, in the order of a walk; empty if the tree was removed.
    pub fn fields_of(&self, tree: TreeHandle) -> Vec<FieldHandle> {
        let serials = self.inserted(tree).map_or(&[][..], |entry| &entry.terms);
        let terms = serials.iter().filter_map(|serial| self.term(*serial));
        let nodes = terms.flat_map(|term| self.nodes().postorder(term.root));
        let leaves = nodes.filter(|node| self.nodes().field(*node).is_some());
        leaves.map(|leaf| self.arena.handle(leaf)).collect()
    }

    /// The field with a name; if several have it, the one that got it first. `None` if there is none.
    pub fn handle(&self, name: &str) -> Option<FieldHandle> {
        self.handles(name).next()
    }

    /// All fields with a name, in the order in which they got it: by insertion or renaming.
    pub fn handles(&self, name: &str) -> impl Iterator<Item = FieldHandle> {
        let listed = self.names.places(name);
        let is_called = |place: &u32| self.field(*place).is_some_and(|f| f.name() == Some(name));
        // The field that `get_mut` returned last may have another name by now.
        let open = self.unchecked.open.filter(|open| !listed.contains(open));
        let all = listed.iter().copied().chain(open);
        all.filter(is_called).map(|place| self.arena.handle(place))
    }

    /// Gives a field another name, or none; `None` if the field was removed.
    pub fn rename(&mut self, field: FieldHandle, name: Option<&str>) -> Option<()> {
        self.get_mut(field)?.name = name.map(Into::into);
        self.settle(field.index);
        Some(())
    }

    /// A field by its handle or name.
    pub fn get<K: FieldKey>(&self, key: K) -> Option<&Field> {
        let handle = key.find(self)?;
        let there = self.arena.holds(handle);
        there.then(|| self.nodes().field(handle.index)).flatten()
    }

    /// A field as errors and answers name it: by its name, or by its place and formula.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut set = FieldSet::new();
    /// let drag = set.insert_field(Field::drag(1.0, 0.0));
    /// assert_eq!(set.describe(drag).unwrap(), "field #0 (drag)");
    /// ```
    pub fn describe<K: FieldKey>(&self, key: K) -> Option<FieldRef> {
        let handle = key.find(self)?;
        let there = self.arena.holds(handle);
        there.then(|| self.field_ref(handle.index))
    }

    /// A field by its handle or name, to be changed. The term that it belongs to is compiled again before the
    /// next evaluation.
    pub fn get_mut<K: FieldKey>(&mut self, key: K) -> Option<&mut Field> {
        let handle = key.find(self)?;
        self.get(handle)?;
        let serial = self.term_of(handle.index)?.serial;
        // The lists follow the changes of the last such field only now that its borrow has ended.
        if let Some(last) = self.unchecked.open.replace(handle.index) {
            self.settle(last);
        }
        self.changes.push(Change::Term(serial));
        self.unchecked.leaf(handle.index);
        self.arena.field_mut(handle.index)
    }

    /// All fields, each with its handle.
    pub fn iter(&self) -> impl Iterator<Item = (FieldHandle, &Field)> {
        let leaves = self.nodes().leaves();
        leaves.map(|(place, field)| (self.arena.handle(place as u32), field))
    }

    /// The fields that are not part of a prototype of instances, each with its handle. They act at their own anchors.
    pub fn fields_in_place(&self) -> impl Iterator<Item = (FieldHandle, &Field)> {
        let nodes = self.nodes();
        let prototypes = nodes.0.iter().filter_map(|node| match node {
            Node::Instances { prototype, .. } => Some(*prototype),
            _ => None,
        });
        let copied = prototypes.flat_map(|prototype| nodes.leaves_below(prototype));
        let copied: HashSet<FieldHandle> = copied.map(|place| self.arena.handle(place)).collect();
        self.iter().filter(move |it| !copied.contains(&it.0))
    }

    /// The number of fields; those of a prototype count once.
    pub fn len(&self) -> usize {
        self.nodes().leaves().count()
    }

    /// Returns true if there are no terms: no trees and no fields.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// All terms as one tree.
    pub fn tree(&self) -> Tree {
        let terms = self.terms.iter();
        let trees = terms.map(|term| self.nodes().subtree(term.root));
        Tree::fold(Operator::SumUnion, trees)
    }

    /// Counts a step that ended at the simulated time `time` for enabled fields with a limit of steps. Removes fields
    /// after their last step, and fields whose time is over.
    pub fn step_done(&mut self, time: f64) {
        if let Some(last) = self.unchecked.open.take() {
            self.settle(last);
        }
        let mut over = Vec::new();
        for place in &self.timed {
            let Some(field) = self.arena.field_mut(*place) else {
                continue;
            };
            if let Some(steps) = field.lifetime.steps.as_mut().filter(|_| field.enabled) {
                *steps = steps.saturating_sub(1);
            }
            if field.lifetime.is_over_at(time) {
                over.push(self.arena.handle(*place));
            }
        }
        for handle in over {
            self.remove_field(handle);
        }
    }

    /// Returns true if any field begins or ends in a span.
    pub(crate) fn changes_in(&self, span: Span) -> bool {
        let mut fields = self.timed.iter().filter_map(|place| self.field(*place));
        fields.any(|field| field.lifetime.changes_in(span))
    }

    /// Updates the lists for the name and lifetime of a leaf that was inserted or changed.
    fn settle(&mut self, place: u32) {
        let Some(field) = Nodes(self.arena.list()).field(place) else {
            return;
        };
        self.names.set(place, field.name.as_ref());
        let ends = field.lifetime.steps.is_some() || !field.lifetime.is_timeless();
        match self.timed.binary_search(&place) {
            Err(at) if ends => self.timed.insert(at, place),
            Ok(at) if !ends => {
                self.timed.remove(at);
            }
            _ => {}
        }
    }

    /// A number that changes with every change of the set. Different states of sets in one process have different ones.
    pub fn revision(&self) -> u64 {
        self.changes.last()
    }
}

impl FieldSet {
    /// [`revision`](Self::revision), except that it stays the same when the set is saved and read again.
    pub(crate) fn mark(&self) -> u64 {
        self.changes.mark()
    }
}

/// Axes, and properties of colliders and bodies.
impl FieldSet {
    /// Declares an axis of the user's own. Samples have this value unless their collider has one of its own; see
    /// [`set_properties`](Self::set_properties).
    ///
    /// # Errors
    /// There is an axis of that name already, or the value is not finite.
    pub fn declare_axis(&mut self, name: &str, value: Real) -> Result<(), BuildError> {
        self.data.declare(name, value)?;
        self.changes.push(Change::Properties);
        Ok(())
    }

    /// Sets the value along a declared axis for all samples without a value of their own.
    ///
    /// # Errors
    /// The axis was not declared, or the value is not finite.
    pub fn set_axis(&mut self, name: &str, value: Real) -> Result<(), PropertyError> {
        self.data.set_axis(name, value)?;
        self.changes.push(Change::Properties);
        Ok(())
    }

    /// The declared axes, with the values of samples without values of their own.
    pub fn axes(&self) -> impl Iterator<Item = (Axis, Real)> {
        let axes = self.data.axes().iter();
        axes.map(|(name, value)| (Axis::User(name.clone()), from_f64(*value)))
    }

    /// Sets the properties of a collider that fields may read.
    ///
    /// # Errors
    /// A value is out of its range, or an axis was not declared.
    pub fn set_properties(
        &mut self,
        collider: ColliderHandle,
        properties: ColliderProperties,
    ) -> Result<(), PropertyError> {
        self.data.set(collider, properties)?;
        self.changes.push(Change::Properties);
        Ok(())
    }

    /// The properties that were set for a collider.
    pub fn properties(&self, collider: ColliderHandle) -> Option<&ColliderProperties> {
        self.data.get(collider)
    }

    /// Sets the sampling of a body for all fields with [`Sampling::Auto`], except laws between sites. `None` removes
    /// this setting.
    pub fn set_sampling(&mut self, body: RigidBodyHandle, sampling: impl Into<Option<Sampling>>) {
        self.data.set_sampling(body, sampling.into());
        self.changes.push(Change::Samplings);
    }
}

/// Read access to the properties that were set.
impl FieldSet {
    /// All colliders with properties, in the order of handles.
    pub fn colliders(&self) -> impl Iterator<Item = (ColliderHandle, &ColliderProperties)> {
        let colliders = self.data.colliders().iter();
        colliders.map(|(handle, properties)| (*handle, properties))
    }

    /// All bodies with a sampling of their own, in the order of handles.
    pub fn samplings(&self) -> impl Iterator<Item = (RigidBodyHandle, Sampling)> {
        self.data.samplings().iter().copied()
    }
}

/// Access for the stages that work with a set.
impl FieldSet {
    pub(crate) fn nodes(&self) -> Nodes<'_> {
        Nodes(self.arena.list())
    }

    /// All terms, in the order of their serials.
    pub(crate) fn terms(&self) -> &[Term] {
        &self.terms
    }

    pub(crate) fn term(&self, serial: u64) -> Option<Term> {
        let place = self.terms.binary_search_by_key(&serial, |term| term.serial);
        place.ok().map(|place| self.terms[place])
    }

    /// The term that a node belongs to.
    fn term_of(&self, place: u32) -> Option<Term> {
        self.term(self.arena.serial_of(place)?)
    }

    /// The field or operation at a place, for messages.
    pub(crate) fn field_ref(&self, place: u32) -> FieldRef {
        FieldRef {
            handle: self.handle_at(place),
            label: self.nodes().label(place).into(),
        }
    }

    pub(crate) fn field(&self, place: u32) -> Option<&Field> {
        self.nodes().field(place)
    }

    /// The handle of the field at a place, if there is one.
    pub(crate) fn handle_at(&self, place: u32) -> Option<FieldHandle> {
        self.field(place).map(|_| self.arena.handle(place))
    }

    /// The axes that fields and scales name, those of fields first.
    pub(crate) fn named_axes(&self) -> impl Iterator<Item = &Axis> {
        let nodes = self.nodes();
        let of_fields = nodes.leaves().flat_map(|(_, field)| field.axes());
        let places = 0..nodes.0.len() as u32;
        let scales = places.filter_map(move |place| nodes.scale(place));
        of_fields.chain(scales.flat_map(|scale| scale.axes()))
    }

    pub(crate) fn data(&self) -> &UserProperties {
        &self.data
    }

    /// The changes since a revision; `None` if they are not known: everything may have changed.
    pub(crate) fn changes_since(
        &self,
        revision: u64,
    ) -> Option<impl Iterator<Item = Change> + Clone> {
        self.changes.since(revision)
    }
}

/// A key of a field in a [`FieldSet`]: a [`FieldHandle`] or a name.
pub trait FieldKey {
    /// The handle, if there is a field.
    fn find(&self, set: &FieldSet) -> Option<FieldHandle>;

    /// The key in messages.
    fn describe(&self) -> String;
}

impl FieldKey for FieldHandle {
    fn find(&self, _: &FieldSet) -> Option<FieldHandle> {
        Some(*self)
    }

    fn describe(&self) -> String {
        format!("of {self:?}")
    }
}

impl FieldKey for &str {
    fn find(&self, set: &FieldSet) -> Option<FieldHandle> {
        set.handle(self)
    }

    fn describe(&self) -> String {
        format!("named `{self}`")
    }
}

impl<T: Into<Tree>> From<T> for FieldSet {
    fn from(tree: T) -> Self {
        let mut set = FieldSet::new();
        set.insert(tree);
        set
    }
}
