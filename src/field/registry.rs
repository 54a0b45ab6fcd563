//! Named functions for the closures of trees that were saved and read again.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::axis::Axis;
use super::closure::{Closure, Output};
use super::error::BuildError;
use super::formula::Formula;
use super::leaf::Field;
use super::modifier::Modifier;
use super::nodes::Node;
use super::query::Sample;
use super::region::{Region, RegionStep};
use super::scalar::{Scalar, ScalarStep};
use super::tree::Tree;
use crate::math::{Real, Vector};

/// The functions behind the names of closures.
///
/// A saved tree holds the names of its closures only. The functions have to be given again after reading:
///
/// ```
/// use rapier3d_fields::field::Registry;
/// use rapier3d_fields::prelude::*;
/// let pulse = |sample: &Sample| Vector::Y * sample.time.sin();
/// let tree = Tree::from(Field::closure_named("pulse", [], pulse));
/// # #[cfg(feature = "serde-serialize")] {
/// let mut read: Tree = serde_json::from_str(&serde_json::to_string(&tree)?)?;
/// assert!(Fields::new(read.clone()).is_err(), "which function is `pulse`?");
/// read.resolve(&Registry::new().formula("pulse", [], pulse))?;
/// assert!(Fields::new(read).is_ok());
/// # }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Registry {
    formulas: Names<Vector>,
    scalars: Names<Real>,
    predicates: Names<bool>,
}

type Names<R> = BTreeMap<Arc<str>, Arc<Closure<R>>>;

impl Registry {
    /// A registry without functions.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds the function of a [`Field::closure_named`]. Replaces another with that name.
    pub fn formula(
        mut self,
        name: &str,
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> Vector + Send + Sync + 'static,
    ) -> Self {
        let closure = Closure::new(Some(name), reads, function);
        self.formulas.insert(name.into(), closure);
        self
    }

    /// Adds the function of a [`Scalar::closure_named`]. Replaces another with that name.
    pub fn scalar(
        mut self,
        name: &str,
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> Real + Send + Sync + 'static,
    ) -> Self {
        let closure = Closure::new(Some(name), reads, function);
        self.scalars.insert(name.into(), closure);
        self
    }

    /// Adds the function of a [`Region::predicate_named`]. Replaces another with that name.
    pub fn predicate(
        mut self,
        name: &str,
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> bool + Send + Sync + 'static,
    ) -> Self {
        let closure = Closure::new(Some(name), reads, function);
        self.predicates.insert(name.into(), closure);
        self
    }
}

/// Replaces a closure without a function by the known one with its name.
fn fill<R: Output>(
    closure: &mut Arc<Closure<R>>,
    names: &Names<R>,
    field: &str,
) -> Result<(), BuildError> {
    if closure.is_resolved() {
        return Ok(());
    }
    let name = closure.name().unwrap_or_default();
    let Some(known) = names.get(name) else {
        return Err(BuildError::UnknownClosure {
            field: field.into(),
            kind: R::KIND,
            closure: name.to_owned(),
        });
    };
    *closure = known.clone();
    Ok(())
}

impl Tree {
    /// Looks up the functions of closures that were read by name.
    ///
    /// # Errors
    /// The registry has no function of that name and kind.
    pub fn resolve(&mut self, registry: &Registry) -> Result<(), BuildError> {
        for place in 0..self.nodes().0.len() {
            let label = self.nodes().label(place as u32);
            match &mut self.nodes[place] {
                Node::Leaf(field) => field.resolve(registry, &label)?,
                Node::Modified {
                    modifier: Modifier::Scale { scale, .. },
                    ..
                } => Arc::make_mut(scale).resolve(registry, &label)?,
                _ => {}
            }
        }
        Ok(())
    }
}

impl Field {
    pub(crate) fn resolve(&mut self, registry: &Registry, label: &str) -> Result<(), BuildError> {
        self.region.resolve(registry, label)?;
        if let Some(scale) = &mut self.scale {
            scale.resolve(registry, label)?;
        }
        let mut formula = &mut self.formula;
        while let Formula::Wind(wind) = formula {
            formula = &mut wind.flow;
        }
        match formula {
            Formula::Closure(closure) => fill(closure, &registry.formulas, label),
            _ => Ok(()),
        }
    }
}

impl Region {
    fn resolve(&mut self, registry: &Registry, label: &str) -> Result<(), BuildError> {
        self.steps.iter_mut().try_for_each(|step| match step {
            RegionStep::Predicate(predicate) => fill(predicate, &registry.predicates, label),
            _ => Ok(()),
        })
    }
}

impl Scalar {
    fn resolve(&mut self, registry: &Registry, label: &str) -> Result<(), BuildError> {
        self.steps.iter_mut().try_for_each(|step| match step {
            ScalarStep::Function(function) => fill(function, &registry.scalars, label),
            ScalarStep::Depth(region) => region.resolve(registry, label),
            _ => Ok(()),
        })
    }
}
