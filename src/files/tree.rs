//! Trees, nested for people to read.

use serde::{Deserialize, Serialize};

use super::error::FileError;
use super::field::{AnchorDoc, Directory, FieldDoc};
use super::number::Num;
use super::scalar::{self, ScalarDoc};
use crate::field::{Layer, Modifier, Node, Operator, Override, Tree};

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(
    rename_all = "kebab-case",
    rename_all_fields = "kebab-case",
    deny_unknown_fields
)]
pub(super) enum TreeDoc {
    /// Defined nowhere.
    Empty,
    Field(Box<FieldDoc>),
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

fn operation(operator: Operator, operands: Vec<TreeDoc>) -> TreeDoc {
    let make = match operator {
        Operator::SumUnion => TreeDoc::SumUnion,
        Operator::SumIntersection => TreeDoc::SumIntersection,
        Operator::CrossUnion => TreeDoc::CrossUnion,
        Operator::CrossIntersection => TreeDoc::CrossIntersection,
        Operator::ReplaceUnion => TreeDoc::ReplaceUnion,
        Operator::ReplaceIntersection => TreeDoc::ReplaceIntersection,
        Operator::Difference => TreeDoc::Difference,
        Operator::Strongest => TreeDoc::Strongest,
        Operator::Weakest => TreeDoc::Weakest,
        Operator::Minimum => TreeDoc::Minimum,
        Operator::Maximum => TreeDoc::Maximum,
    };
    make(operands)
}

impl TreeDoc {
    pub(super) fn read(&self, scene: Option<&Directory>) -> Result<Tree, FileError> {
        let fold = |name: &str, operator, operands: &[TreeDoc]| {
            let operands = operands.iter().enumerate();
            let operands = operands.map(|(number, operand)| {
                let tree = operand.read(scene);
                tree.map_err(|error| error.within(&format!("{name}[{number}]")))
            });
            let operands: Vec<Tree> = operands.collect::<Result<_, FileError>>()?;
            Ok(Tree::fold(operator, operands))
        };
        let within = |name: &'static str| move |error: FileError| error.within(name);
        match self {
            TreeDoc::Empty => Ok(Tree::empty()),
            TreeDoc::Field(field) => {
                let field = field.read(scene).map_err(within("field"))?;
                Ok(field.into())
            }
            TreeDoc::SumUnion(o) => fold("sum-union", Operator::SumUnion, o),
            TreeDoc::SumIntersection(o) => fold("sum-intersection", Operator::SumIntersection, o),
            TreeDoc::CrossUnion(o) => fold("cross-union", Operator::CrossUnion, o),
            TreeDoc::CrossIntersection(o) => {
                fold("cross-intersection", Operator::CrossIntersection, o)
            }
            TreeDoc::ReplaceUnion(o) => fold("replace-union", Operator::ReplaceUnion, o),
            TreeDoc::ReplaceIntersection(o) => {
                fold("replace-intersection", Operator::ReplaceIntersection, o)
            }
            TreeDoc::Difference(o) => fold("difference", Operator::Difference, o),
            TreeDoc::Strongest(o) => fold("strongest", Operator::Strongest, o),
            TreeDoc::Weakest(o) => fold("weakest", Operator::Weakest, o),
            TreeDoc::Minimum(o) => fold("minimum", Operator::Minimum, o),
            TreeDoc::Maximum(o) => fold("maximum", Operator::Maximum, o),
            TreeDoc::Instances { prototype, at } => {
                let prototype = prototype.read(scene);
                let prototype = prototype.map_err(within("instances.prototype"))?;
                let mut anchors = Vec::with_capacity(at.len());
                for (number, anchor) in at.iter().enumerate() {
                    let here = |error: FileError| error.within(&format!("instances.at[{number}]"));
                    anchors.push(anchor.read(scene).map_err(here)?);
                }
                Ok(Tree::instances(prototype, anchors))
            }
            TreeDoc::Scaled { tree, by, at } => {
                let tree = tree.read(scene).map_err(within("scaled.tree"))?;
                let scale = scalar::read(by).map_err(within("scaled.by"))?;
                let anchor = at.read(scene).map_err(within("scaled.at"))?;
                Ok(tree.scaled_at(scale, anchor))
            }
            TreeDoc::Limited { tree, to } => {
                let tree = tree.read(scene).map_err(within("limited.tree"))?;
                Ok(tree.limited_to(to.0))
            }
            TreeDoc::Layers(layers) => {
                let layers = layers.iter().enumerate();
                let layers = layers.map(|(number, layer)| {
                    let here = |error: FileError| error.within(&format!("layers[{number}].tree"));
                    layer.read(scene).map_err(here)
                });
                Ok(Tree::layers(layers.collect::<Result<Vec<_>, _>>()?))
            }
        }
    }

    pub(super) fn write(tree: &Tree, scene: Option<&Directory>) -> Result<Self, FileError> {
        super::check_depth(tree.depth())?;
        // Operands stand before the operators that use them, each of which is used once.
        let mut done: Vec<TreeDoc> = Vec::with_capacity(tree.nodes().0.len());
        for (place, node) in tree.nodes().0.iter().enumerate() {
            let mut take =
                |operand: &u32| std::mem::replace(&mut done[*operand as usize], TreeDoc::Empty);
            let named = |error: FileError| {
                let label = tree.nodes().label(place as u32);
                error.of_field(&label).within(&label)
            };
            let doc = match node {
                // Trees of users hold none, nor do those that sets give out.
                Node::Vacant => return Err(super::error::content("a field that was removed")),
                Node::Leaf(field) => {
                    let label = tree.nodes().label(place as u32);
                    TreeDoc::Field(Box::new(FieldDoc::write(field, &label, scene)?))
                }
                Node::Operation { operator, operands } => {
                    operation(*operator, operands.iter().map(take).collect())
                }
                Node::Instances { prototype, anchors } => {
                    let anchors = anchors.iter().map(|anchor| AnchorDoc::write(anchor, scene));
                    TreeDoc::Instances {
                        prototype: Box::new(take(prototype)),
                        at: anchors.collect::<Result<_, _>>().map_err(named)?,
                    }
                }
                Node::Modified { operand, modifier } => {
                    let tree = Box::new(take(operand));
                    match modifier {
                        Modifier::Limit(length) => TreeDoc::Limited {
                            tree,
                            to: Num(*length),
                        },
                        Modifier::Scale { scale, anchor } => TreeDoc::Scaled {
                            tree,
                            by: scalar::write(scale).map_err(named)?,
                            at: AnchorDoc::write(anchor, scene).map_err(named)?,
                        },
                    }
                }
                Node::Layers { operands, modes } => {
                    let count = operands.len() as i32;
                    let layers = operands.iter().zip(modes.iter()).zip(1..);
                    let layers = layers.map(|((operand, mode), place)| {
                        LayerDoc::write(take(operand), *mode, count - place)
                    });
                    TreeDoc::Layers(layers.collect())
                }
            };
            done.push(doc);
        }
        Ok(done.pop().unwrap_or(TreeDoc::Empty))
    }
}

impl LayerDoc {
    fn read(&self, scene: Option<&Directory>) -> Result<Layer, FileError> {
        Ok(Layer {
            tree: self.tree.read(scene)?,
            priority: self.priority,
            mode: Override {
                replaces: self.replacing,
                stops: self.stopping,
            },
        })
    }

    /// A tree remembers the order of its layers only; priorities that give it are as good.
    fn write(tree: TreeDoc, mode: Override, priority: i32) -> Self {
        LayerDoc {
            tree,
            priority,
            replacing: mode.replaces,
            stopping: mode.stops,
        }
    }
}
