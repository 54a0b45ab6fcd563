//! The algebra of sets at one sample, or at several at once.

use std::cell::Cell;

use super::axis::Axis;
use super::boundary::{Neighbourhood, Pieces};
use super::over_axes::OverAxes;
use super::query::{LocalQuery, QueryNumber, Single};
use crate::number::{Number, Plain, Vec3, real};

/// A representation of sets close to one sample or several.
pub(crate) trait Sets<T: QueryNumber> {
    type Set: Copy;

    /// The whole neighbourhood of samples where the mask is set, nothing for others.
    fn all(&self, mask: T::Mask) -> Self::Set;
    fn union(&self, a: Self::Set, b: Self::Set) -> Self::Set;
    fn intersection(&self, a: Self::Set, b: Self::Set) -> Self::Set;
    fn difference(&self, a: Self::Set, b: Self::Set) -> Self::Set;
    /// The part behind a surface, given the distance from it.
    fn behind(
        &self,
        distance: T::Plain,
        outward: Outward<'_, T::Plain>,
        local: &LocalQuery<'_, T>,
    ) -> Self::Set;
    /// The samples that are in a set.
    fn any(&self, set: Self::Set) -> T::Mask;
}

/// The outward direction of a set, in the field's frame.
pub(crate) enum Outward<'a, P> {
    Space(Vec3<P>),
    /// Along growing values of an axis or, with a sign of −1, along falling ones.
    Along(&'a Axis, f64),
    OverAxes(&'a OverAxes),
}

/// Sets for samples away from all surfaces: each set either contains a sample or does not.
pub(crate) struct Open<T: Number> {
    on_a_surface: Cell<T::Mask>,
}

impl<T: Number> Open<T> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Open {
            on_a_surface: Cell::new(false.into()),
        }
    }

    /// The samples that lie on a surface, where only a [`Neighbourhood`] gives the right result.
    #[inline(always)]
    pub(crate) fn on_a_surface(&self) -> T::Mask {
        self.on_a_surface.get()
    }
}

impl<T: QueryNumber> Sets<T> for Open<T> {
    type Set = T::Mask;

    #[inline(always)]
    fn all(&self, mask: T::Mask) -> T::Mask {
        mask
    }

    #[inline(always)]
    fn union(&self, a: T::Mask, b: T::Mask) -> T::Mask {
        a | b
    }

    #[inline(always)]
    fn intersection(&self, a: T::Mask, b: T::Mask) -> T::Mask {
        a & b
    }

    #[inline(always)]
    fn difference(&self, a: T::Mask, b: T::Mask) -> T::Mask {
        a & !b
    }

    #[inline(always)]
    fn behind(
        &self,
        distance: T::Plain,
        _: Outward<'_, T::Plain>,
        _: &LocalQuery<'_, T>,
    ) -> T::Mask {
        let on = distance.equals(0.0);
        self.on_a_surface.set(self.on_a_surface.get() | on);
        on | distance.below(0.0)
    }

    #[inline(always)]
    fn any(&self, set: T::Mask) -> T::Mask {
        set
    }
}

impl<T: Single> Sets<T> for Neighbourhood {
    type Set = Pieces;

    fn all(&self, mask: bool) -> Pieces {
        if mask { Pieces::ALL } else { Pieces::NONE }
    }

    fn union(&self, a: Pieces, b: Pieces) -> Pieces {
        Neighbourhood::union(self, a, b)
    }

    fn intersection(&self, a: Pieces, b: Pieces) -> Pieces {
        Neighbourhood::intersection(self, a, b)
    }

    fn difference(&self, a: Pieces, b: Pieces) -> Pieces {
        Neighbourhood::difference(self, a, b)
    }

    fn behind(
        &self,
        distance: f64,
        outward: Outward<'_, f64>,
        local: &LocalQuery<'_, T>,
    ) -> Pieces {
        Neighbourhood::behind(self, distance, || match outward {
            Outward::Space(outward) => local.spatial_normal(real(outward)),
            Outward::Along(axis, sign) => local.normal_along(axis, sign),
            Outward::OverAxes(set) => set.outward(local),
        })
    }

    fn any(&self, set: Pieces) -> bool {
        set.any()
    }
}
