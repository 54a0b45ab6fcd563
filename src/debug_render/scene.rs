//! The fields and the world that are drawn.

use super::placed::{PlacedField, placed_fields};
use super::style::FieldDebugRenderStyle;
use super::view::{BoundingBall, View};
use crate::bridge::WorldRef;
use crate::fields::Fields;
use crate::math::{ColliderHandle, RigidBodyHandle};
use crate::rapier::pipeline::DebugRenderObject;

/// The input of each part of the drawing.
pub(super) struct DrawnScene<'a> {
    pub fields: &'a Fields,
    pub world: WorldRef<'a>,
    pub style: &'a FieldDebugRenderStyle,
    pub view: View,
}

impl<'a> DrawnScene<'a> {
    pub fn new(fields: &'a Fields, world: WorldRef<'a>, style: &'a FieldDebugRenderStyle) -> Self {
        let placed = placed_fields(&fields.set, world, fields.time());
        let balls: Vec<BoundingBall> = placed
            .filter_map(|placed| BoundingBall::around(&placed))
            .collect();
        DrawnScene {
            fields,
            world,
            style,
            view: View::new(style, world, &balls),
        }
    }

    /// The fields that act now.
    pub fn placed(&self) -> impl Iterator<Item = PlacedField<'a>> {
        placed_fields(&self.fields.set, self.world, self.fields.time())
    }

    pub fn body(&self, handle: RigidBodyHandle) -> Option<DebugRenderObject<'a>> {
        let body = self.world.bodies.get(handle)?;
        Some(DebugRenderObject::RigidBody(handle, body))
    }

    pub fn collider(&self, handle: ColliderHandle) -> Option<DebugRenderObject<'a>> {
        let collider = self.world.colliders.get(handle)?;
        Some(DebugRenderObject::Collider(handle, collider))
    }
}
