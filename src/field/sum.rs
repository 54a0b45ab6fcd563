//! The operator `+` on fields and trees, which is the sum of union.

use std::iter::Sum;
use std::ops::{Add, AddAssign};

use super::leaf::Field;
use super::operator::Operator;
use super::tree::Tree;

impl<T: Into<Tree>> Add<T> for Field {
    type Output = Tree;

    /// The [sum of union](Operator::SumUnion).
    fn add(self, other: T) -> Tree {
        self.sum_union(other)
    }
}

impl<T: Into<Tree>> Add<T> for Tree {
    type Output = Tree;

    /// The [sum of union](Operator::SumUnion).
    fn add(self, other: T) -> Tree {
        self.sum_union(other)
    }
}

impl<T: Into<Tree>> AddAssign<T> for Tree {
    /// The [sum of union](Operator::SumUnion).
    fn add_assign(&mut self, other: T) {
        *self = std::mem::take(self).sum_union(other);
    }
}

impl<T: Into<Tree>> Sum<T> for Tree {
    /// The [sum of union](Operator::SumUnion) of all; the [empty](Tree::empty) tree for none.
    fn sum<I: Iterator<Item = T>>(operands: I) -> Tree {
        Tree::fold(Operator::SumUnion, operands)
    }
}
