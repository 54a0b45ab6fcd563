//! The operators that combine fields.

use std::fmt;

use super::query::QueryNumber;
use super::sets::Sets;
use crate::number::{Number, Plain, Vec3};

/// The operators of the algebra.
///
/// Seven are those of the paper's Figure 1: an algebraic operation (sum, cross product,
/// replacement) on a set operation (union, intersection), and the difference.
///
/// For a field U on the set E and a field V on the set G:
///
/// | operator | defined on | value |
/// |---|---|---|
/// | [`SumUnion`](Operator::SumUnion) +∪ | E∪G | U on E−G, V on G−E, U+V on E∩G |
/// | [`SumIntersection`](Operator::SumIntersection) +∩ | E∩G | U+V |
/// | [`CrossUnion`](Operator::CrossUnion) ×∪ | E∪G | U on E−G, V on G−E, U×V on E∩G |
/// | [`CrossIntersection`](Operator::CrossIntersection) ×∩ | E∩G | U×V |
/// | [`ReplaceUnion`](Operator::ReplaceUnion) →∪ | E∪G | U on E−G, V on G |
/// | [`ReplaceIntersection`](Operator::ReplaceIntersection) →∩ | E∩G | V |
/// | [`Difference`](Operator::Difference) − | E−G | U |
///
/// And four that other engines have:
///
/// | operator | defined on | value |
/// |---|---|---|
/// | [`Strongest`](Operator::Strongest) | E∪G | U on E−G, V on G−E, the longer of the two on E∩G |
/// | [`Weakest`](Operator::Weakest) | E∪G | U on E−G, V on G−E, the shorter of the two on E∩G |
/// | [`Minimum`](Operator::Minimum) | E∪G | U on E−G, V on G−E, the lesser of each component on E∩G |
/// | [`Maximum`](Operator::Maximum) | E∪G | U on E−G, V on G−E, the greater of each component on E∩G |
///
/// Where both are equally long, the value is U. Components are along the world's axes. Masks need no operators of their
/// own: `mask.replace_intersection(field)` is the field where the mask is defined, and `field.difference(mask)` where
/// it is not.
///
/// `a + b`, of fields or trees, is the sum of union, and so is `sum()` over an iterator:
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let planet = Field::point_gravity(50.0).within(Region::ball(20.0));
/// let lamps = (0..10).map(|i| Field::radial(-1.0, -1.0).at(Vector::X * i as Real));
/// let tree = planet + Field::drag(0.1, 0.0) + lamps.sum::<Tree>();
/// assert_eq!(tree.field_count(), 12);
/// ```
///
/// The sets are closed and regularised; see [`boundary`](crate::field::boundary) for samples on a boundary.
/// Vectors are forces here, whatever the fields' own [`ForceMode`](crate::ForceMode). The value of a cross product
/// depends on their units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
pub enum Operator {
    /// The sum where both are defined, either where only one is. Commutes and associates.
    SumUnion,
    /// The sum, where both are defined. Commutes and associates.
    SumIntersection,
    /// Cross product where both are defined, either where only one is. Does not associate.
    CrossUnion,
    /// Cross product, where both are defined. Does not associate.
    CrossIntersection,
    /// The right operand wherever it is defined, the left one elsewhere. Associates.
    ReplaceUnion,
    /// The right operand, where both are defined. Associates.
    ReplaceIntersection,
    /// The left operand, where the right one is not defined.
    Difference,
    /// The longer vector where both are defined, either where only one is. Associates.
    Strongest,
    /// The shorter vector where both are defined, either where only one is. Associates.
    Weakest,
    /// The lesser of each component where both are defined, either where only one is. Commutes and associates.
    Minimum,
    /// The greater of each component where both are defined, either where only one is. Commutes and associates.
    Maximum,
}

impl Operator {
    /// All operators, in the order of the tables.
    pub const ALL: [Operator; 11] = [
        Operator::SumUnion,
        Operator::SumIntersection,
        Operator::CrossUnion,
        Operator::CrossIntersection,
        Operator::ReplaceUnion,
        Operator::ReplaceIntersection,
        Operator::Difference,
        Operator::Strongest,
        Operator::Weakest,
        Operator::Minimum,
        Operator::Maximum,
    ];

    /// Returns true if operands may be regrouped; the operator then takes any number of them (§3.1.2).
    pub fn is_associative(self) -> bool {
        use Operator::*;
        !matches!(self, CrossUnion | CrossIntersection | Difference)
    }

    /// The set of the result, given the sets of the operands.
    #[inline(always)]
    pub(crate) fn set<T: QueryNumber, S: Sets<T>>(self, e: S::Set, g: S::Set, here: &S) -> S::Set {
        match self {
            Operator::Difference => here.difference(e, g),
            _ if self.is_intersection() => here.intersection(e, g),
            _ => here.union(e, g),
        }
    }

    /// The vector where both operands are defined.
    #[inline(always)]
    pub(crate) fn vector<T: Number>(self, u: Vec3<T>, v: Vec3<T>) -> Vec3<T> {
        use Operator::*;
        match self {
            SumUnion | SumIntersection => u + v,
            CrossUnion | CrossIntersection => u.cross(v),
            ReplaceUnion | ReplaceIntersection => v,
            Difference => u,
            Strongest => Vec3::select(v.dot(v).re().above(u.dot(u).re()), v, u),
            Weakest => Vec3::select(v.dot(v).re().below(u.dot(u).re()), v, u),
            Minimum => u.zip(v, T::lesser),
            Maximum => u.zip(v, T::greater),
        }
    }

    /// Returns true if the result is defined only where both operands are.
    pub(crate) fn is_intersection(self) -> bool {
        use Operator::*;
        matches!(
            self,
            SumIntersection | CrossIntersection | ReplaceIntersection
        )
    }

    /// The paper's sign for the operator.
    pub fn symbol(self) -> &'static str {
        match self {
            Operator::SumUnion => "+∪",
            Operator::SumIntersection => "+∩",
            Operator::CrossUnion => "×∪",
            Operator::CrossIntersection => "×∩",
            Operator::ReplaceUnion => "→∪",
            Operator::ReplaceIntersection => "→∩",
            Operator::Difference => "−",
            Operator::Strongest => "strongest",
            Operator::Weakest => "weakest",
            Operator::Minimum => "minimum",
            Operator::Maximum => "maximum",
        }
    }
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}
