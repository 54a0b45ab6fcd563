//! A wrapper of Parry's shapes that makes them comparable.

use crate::math::SharedShape;

/// A shape of Parry's. It is equal only to a clone that shares its memory.
#[derive(Clone)]
pub struct AnyShape(pub SharedShape);

impl PartialEq for AnyShape {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(&*self.0, &*other.0)
    }
}

impl std::fmt::Debug for AnyShape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.0.shape_type())
    }
}
