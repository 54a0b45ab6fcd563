//! The operators of the algebra.

use std::fmt;

/// The seven operators of the paper's Figure 1: an algebraic operation (sum, cross product,
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
/// The sets are closed and regularised: what happens on a boundary is said in
/// [`boundary`](crate::field::boundary). Vectors are forces here, whatever the fields' own
/// [`Reading`](crate::Reading). Where a field's vector enters a cross product, so does its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operator {
    /// Adds where both are defined, keeps either where only one is. Commutes and associates.
    SumUnion,
    /// Adds, where both are defined. Commutes and associates.
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
}

impl Operator {
    /// All operators, in the order of the table.
    pub const ALL: [Operator; 7] = [
        Operator::SumUnion,
        Operator::SumIntersection,
        Operator::CrossUnion,
        Operator::CrossIntersection,
        Operator::ReplaceUnion,
        Operator::ReplaceIntersection,
        Operator::Difference,
    ];

    /// Whether operands may be regrouped, and the operator so takes any number of them (§3.1.2).
    pub fn is_associative(self) -> bool {
        use Operator::*;
        matches!(
            self,
            SumUnion | SumIntersection | ReplaceUnion | ReplaceIntersection
        )
    }

    /// Whether the result is defined only where both operands are.
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
        }
    }
}

impl fmt::Display for Operator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}
