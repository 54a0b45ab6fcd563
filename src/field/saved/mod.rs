//! Serialisation beyond serde's derives: infinite numbers, checks of the structure on reading, and a limit of
//! nesting.
//!
//! The derives use no feature that requires a self-describing format, so that any format works. Data that was read
//! has a valid structure: indices are in range, and operands are before operators. Its numbers are checked by
//! [`Tree::validate`](super::Tree), as for any tree.

mod shape;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::nodes::Node;
use super::region::{Region, RegionStep};
use super::scalar::{Scalar, ScalarStep};
use super::solid::Solid;
use super::tree::Tree;
use crate::math::Real;

/// A module that saves a number as an option: `None` for infinity, which means no end. JSON has no infinities.
macro_rules! end {
    ($name:ident: $Number:ty, $none:expr) => {
        pub(super) mod $name {
            use super::*;

            pub(crate) fn serialize<S: Serializer>(
                end: &$Number,
                serializer: S,
            ) -> Result<S::Ok, S::Error> {
                (*end != $none).then_some(*end).serialize(serializer)
            }

            pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
                deserializer: D,
            ) -> Result<$Number, D::Error> {
                let end = Option::<$Number>::deserialize(deserializer)?;
                Ok(end.unwrap_or($none))
            }
        }
    };
}

end!(upper: Real, Real::INFINITY);
end!(lower: Real, -Real::INFINITY);
end!(never_before: f64, f64::NEG_INFINITY);
end!(never_after: f64, f64::INFINITY);

/// A setter that did not fit. Such a field is refused when it is built, and cannot be saved.
pub(super) mod misfit {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(
        setter: &Option<&'static str>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match setter {
            None => serializer.serialize_unit(),
            Some(setter) => Err(serde::ser::Error::custom(format!(
                "a field whose `{setter}` does not apply to its formula cannot be saved"
            ))),
        }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<&'static str>, D::Error> {
        <()>::deserialize(deserializer).map(|()| None)
    }
}

/// The flow of a wind, which may be a wind again: the only data that nests. Its depth is limited, so that no
/// file can overflow the call stack.
pub(super) mod flow {
    use std::cell::Cell;

    use super::super::formula::Formula;
    use super::*;

    const MOST_WINDS: usize = 32;

    thread_local! {
        static WINDS: Cell<usize> = const { Cell::new(0) };
    }

    /// One level of nesting, until it is dropped.
    struct Level;

    impl Level {
        fn enter() -> Result<Self, String> {
            let depth = WINDS.get();
            if depth >= MOST_WINDS {
                return Err(format!("more than {MOST_WINDS} winds within each other"));
            }
            WINDS.set(depth + 1);
            Ok(Level)
        }
    }

    impl Drop for Level {
        fn drop(&mut self) {
            WINDS.set(WINDS.get() - 1);
        }
    }

    #[allow(clippy::borrowed_box, reason = "the signature that serde calls")]
    pub(crate) fn serialize<S: Serializer>(
        flow: &Box<Formula>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let _level = Level::enter().map_err(serde::ser::Error::custom)?;
        flow.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Box<Formula>, D::Error> {
        let _level = Level::enter().map_err(serde::de::Error::custom)?;
        Box::<Formula>::deserialize(deserializer)
    }
}

/// A tree as it is read, before its checks.
#[derive(Deserialize)]
pub(super) struct SavedNodes {
    nodes: Vec<Node>,
}

impl TryFrom<SavedNodes> for Tree {
    type Error = String;

    /// Operands must be before the operator that uses them, and each is used once.
    fn try_from(SavedNodes { nodes }: SavedNodes) -> Result<Tree, String> {
        let mut used = vec![false; nodes.len()];
        for (place, node) in nodes.iter().enumerate() {
            let operands = node.operands();
            for operand in operands {
                let operand = *operand as usize;
                if operand >= place {
                    return Err(format!(
                        "node {place}: its operand {operand} does not stand before it"
                    ));
                }
                if std::mem::replace(&mut used[operand], true) {
                    return Err(format!("node {operand} is an operand twice"));
                }
            }
            if !node.is_whole() {
                return Err(format!(
                    "node {place}: the number of its operands does not fit"
                ));
            }
        }
        // All but the root are used.
        let expected = nodes.len().saturating_sub(1);
        match used.iter().position(|used| !used) {
            Some(unused) if unused != expected => Err(format!("node {unused} is no operand")),
            _ => Ok(Tree { nodes }),
        }
    }
}

/// Checks a list of steps, each of which takes results of the steps before and leaves one.
fn check_postfix(takes: impl Iterator<Item = usize>) -> Result<(), String> {
    let mut results = 0_usize;
    for (place, taken) in takes.enumerate() {
        let left = results.checked_sub(taken);
        let left = left.ok_or_else(|| format!("step {place} has too few operands"))?;
        results = left + 1;
    }
    match results {
        1 => Ok(()),
        _ => Err(format!("the steps leave {results} results instead of one")),
    }
}

/// A region as it is read, before its checks.
#[derive(Deserialize)]
pub(super) struct RegionSteps {
    steps: Vec<RegionStep>,
}

impl TryFrom<RegionSteps> for Region {
    type Error = String;

    fn try_from(RegionSteps { steps }: RegionSteps) -> Result<Region, String> {
        for (place, step) in steps.iter().enumerate() {
            let fits = match step {
                RegionStep::Solid(Solid::Slab { axis, .. }, _) => *axis < 3,
                RegionStep::OverAxes(set) => set.has_equal_lengths(),
                _ => true,
            };
            if !fits {
                return Err(format!("step {place}: its axes do not fit"));
            }
        }
        check_postfix(steps.iter().map(|step| match step {
            RegionStep::Union | RegionStep::Intersection | RegionStep::Difference => 2,
            RegionStep::Complement => 1,
            _ => 0,
        }))?;
        Ok(Region { steps })
    }
}

/// A scalar as it is read, before its checks.
#[derive(Deserialize)]
pub(super) struct ScalarSteps {
    steps: Vec<ScalarStep>,
}

impl TryFrom<ScalarSteps> for Scalar {
    type Error = String;

    fn try_from(ScalarSteps { steps }: ScalarSteps) -> Result<Scalar, String> {
        check_postfix(steps.iter().map(|step| match step {
            ScalarStep::Plus | ScalarStep::Times | ScalarStep::Lesser | ScalarStep::Greater => 2,
            ScalarStep::Curve(_) => 1,
            _ => 0,
        }))?;
        Ok(Scalar { steps })
    }
}
