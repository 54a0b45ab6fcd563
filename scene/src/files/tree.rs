//! Trees as nested documents; in memory, they are flat lists of nodes.

use serde::{Deserialize, Serialize};

use super::error::{FileError, content};
use super::field::{AnchorDoc, FieldDoc};
use super::fields::BuildError;
use super::fields::field::visit::{NodeView, Override};
use super::fields::{Layer, Operator, Tree};
use super::names::{Directory, Names};
use super::number::Num;
use super::scalar::{self, ScalarDoc};

#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    remote = "Self",
    rename_all = "kebab-case",
    rename_all_fields = "kebab-case",
    deny_unknown_fields
)]
pub(super) enum TreeDoc {
    /// Defined nowhere.
    Empty,
    Field(Box<FieldDoc>),
    /// The definition of that name.
    Use(String),
    SumUnion(Vec<TreeDoc>),
    SumIntersection(Vec<TreeDoc>),
    CrossUnion(Vec<TreeDoc>),
    CrossIntersection(Vec<TreeDoc>),
    ReplaceUnion(Vec<TreeDoc>),
    ReplaceIntersection(Vec<TreeDoc>),
    Difference(Vec<TreeDoc>),
    Strongest(Vec<TreeDoc>),
    Weakest(Vec<TreeDoc>),
    Minimum(Vec<TreeDoc>),
    Maximum(Vec<TreeDoc>),
    Instances {
        prototype: Box<TreeDoc>,
        at: Vec<AnchorDoc>,
    },
    Scaled {
        tree: Box<TreeDoc>,
        by: ScalarDoc,
        #[serde(default, skip_serializing_if = "AnchorDoc::is_world")]
        at: AnchorDoc,
    },
    Limited {
        tree: Box<TreeDoc>,
        to: Num,
    },
    Layers(Vec<LayerDoc>),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct LayerDoc {
    tree: TreeDoc,
    #[serde(default)]
    priority: i32,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    replacing: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    stopping: bool,
}

crate::choice::one_of!(TreeDoc, "tree");

/// The operators, each with its name in files.
macro_rules! operations {
    ($($operator:ident: $name:literal,)*) => {
        fn operation(operator: Operator, operands: Vec<TreeDoc>) -> TreeDoc {
            match operator {
                $(Operator::$operator => TreeDoc::$operator(operands),)*
            }
        }

        impl TreeDoc {
            /// The operator, its name and its operands, if it is an operation.
            fn as_operation(&self) -> Option<(Operator, &'static str, &[TreeDoc])> {
                match self {
                    $(TreeDoc::$operator(operands) => Some((Operator::$operator, $name, operands)),)*
                    _ => None,
                }
            }
        }
    };
}

operations! {
    SumUnion: "sum-union",
    SumIntersection: "sum-intersection",
    CrossUnion: "cross-union",
    CrossIntersection: "cross-intersection",
    ReplaceUnion: "replace-union",
    ReplaceIntersection: "replace-intersection",
    Difference: "difference",
    Strongest: "strongest",
    Weakest: "weakest",
    Minimum: "minimum",
    Maximum: "maximum",
}

impl TreeDoc {
    /// The direct subtrees, each with its path in this tree.
    fn parts(&self) -> Vec<(String, &TreeDoc)> {
        if let Some((_, name, operands)) = self.as_operation() {
            let numbered = operands.iter().enumerate();
            return numbered
                .map(|(number, operand)| (format!("{name}[{number}]"), operand))
                .collect();
        }
        match self {
            TreeDoc::Instances { prototype, .. } => {
                vec![("instances.prototype".to_owned(), &**prototype)]
            }
            TreeDoc::Scaled { tree, .. } => vec![("scaled.tree".to_owned(), &**tree)],
            TreeDoc::Limited { tree, .. } => vec![("limited.tree".to_owned(), &**tree)],
            TreeDoc::Layers(layers) => {
                let numbered = layers.iter().enumerate();
                numbered
                    .map(|(number, layer)| (format!("layers[{number}].tree"), &layer.tree))
                    .collect()
            }
            _ => Vec::new(),
        }
    }

    pub(super) fn read(&self, scene: &Names<'_>) -> Result<Tree, FileError> {
        let mut parts = Vec::new();
        for (path, part) in self.parts() {
            parts.push(part.read(scene).map_err(|error| error.within(&path))?);
        }
        if let Some((operator, ..)) = self.as_operation() {
            return Ok(Tree::fold(operator, parts));
        }
        let only = parts.pop().unwrap_or_default();
        let within = |name: &'static str| move |error: FileError| error.within(name);
        match self {
            TreeDoc::Field(field) => {
                let field = field.read(scene).map_err(within("field"))?;
                Ok(field.into())
            }
            TreeDoc::Use(name) => scene.definition(name).map_err(within("use")),
            TreeDoc::Instances { at, .. } => {
                let mut anchors = Vec::with_capacity(at.len());
                for (number, anchor) in at.iter().enumerate() {
                    let here = |error: FileError| error.within(&format!("instances.at[{number}]"));
                    anchors.push(anchor.read(scene).map_err(here)?);
                }
                Ok(Tree::instances(only, anchors))
            }
            TreeDoc::Scaled { by, at, .. } => {
                let scale = scalar::read(by).map_err(within("scaled.by"))?;
                let anchor = at.read(scene).map_err(within("scaled.at"))?;
                Ok(only.scaled_at(scale, anchor))
            }
            TreeDoc::Limited { to, .. } => Ok(only.limited_to(to.0)),
            TreeDoc::Layers(layers) => {
                parts.push(only);
                let layers = layers.iter().zip(parts);
                Ok(Tree::layers(layers.map(|(layer, tree)| layer.layer(tree))))
            }
            _ => Ok(Tree::empty()),
        }
    }

    /// The error of a refused tree with its place in the file: the innermost subtree that is refused by
    /// itself for the same kind of reason.
    pub(super) fn blame(&self, scene: &Names<'_>, axes: &[&str], error: BuildError) -> FileError {
        let alike =
            |other: &BuildError| std::mem::discriminant(other) == std::mem::discriminant(&error);
        for (path, part) in self.parts() {
            let refused = part
                .read(scene)
                .ok()
                .and_then(|tree| tree.check(axes).err());
            if let Some(own) = refused.filter(alike) {
                return part.blame(scene, axes, own).within(&path);
            }
        }
        let whole = content(error.to_string());
        match self {
            TreeDoc::Field(_) => whole.within("field"),
            _ => whole,
        }
    }

    pub(super) fn write(tree: &Tree, scene: Option<&Directory>) -> Result<Self, FileError> {
        super::check_depth(tree.depth())?;
        // Operands come before the nodes that use them, and each is used once.
        let mut done: Vec<TreeDoc> = Vec::new();
        for (place, node) in (0..).zip(tree.nodes_view()) {
            let mut take =
                |operand: &u32| std::mem::replace(&mut done[*operand as usize], TreeDoc::Empty);
            let label = || tree.node_label(place);
            let named = |error: FileError| error.of_field(&label()).within(&label());
            let doc = match node {
                NodeView::Field(field) => {
                    TreeDoc::Field(Box::new(FieldDoc::write(field, &label(), scene)?))
                }
                NodeView::Operation { operator, operands } => {
                    operation(operator, operands.iter().map(take).collect())
                }
                NodeView::Instances { prototype, anchors } => {
                    let anchors = anchors.iter().map(|anchor| AnchorDoc::write(anchor, scene));
                    TreeDoc::Instances {
                        prototype: Box::new(take(&prototype)),
                        at: anchors.collect::<Result<_, _>>().map_err(named)?,
                    }
                }
                NodeView::Limited { operand, length } => TreeDoc::Limited {
                    tree: Box::new(take(&operand)),
                    to: Num(length),
                },
                NodeView::Scaled {
                    operand,
                    scale,
                    anchor,
                } => TreeDoc::Scaled {
                    tree: Box::new(take(&operand)),
                    by: scalar::write(scale).map_err(named)?,
                    at: AnchorDoc::write(anchor, scene).map_err(named)?,
                },
                NodeView::Layers { operands, modes } => {
                    let count = operands.len() as i32;
                    let layers = operands.iter().zip(modes.iter()).zip(1..);
                    let layers = layers.map(|((operand, mode), place)| {
                        LayerDoc::write(take(operand), *mode, count - place)
                    });
                    TreeDoc::Layers(layers.collect())
                }
                _ => return Err(named(content("this cannot stand in a file"))),
            };
            done.push(doc);
        }
        Ok(done.pop().unwrap_or(TreeDoc::Empty))
    }
}

impl LayerDoc {
    fn layer(&self, tree: Tree) -> Layer {
        let layer = Layer::new(tree).priority(self.priority);
        layer.mode(Override {
            replaces: self.replacing,
            stops: self.stopping,
        })
    }

    /// A tree keeps only the order of its layers; any priorities that give this order are equivalent.
    fn write(tree: TreeDoc, mode: Override, priority: i32) -> Self {
        LayerDoc {
            tree,
            priority,
            replacing: mode.replaces,
            stopping: mode.stops,
        }
    }
}
