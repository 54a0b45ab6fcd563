//! Fields drawn as gizmos.

use bevy::prelude::*;
use bevy_rapier3d::prelude::{PhysicsSet, RapierContextColliders, RapierRigidBodySet};
use rapier3d_fields::WorldRef;
use rapier3d_fields::debug_render::FieldDebugRenderPipeline;
use rapier3d_fields::rapier::prelude::{DebugColor, DebugRenderBackend, DebugRenderObject, Vector};

use crate::context::RapierContextFields;

/// Draws the fields of all contexts as gizmos: regions, arrows, stream lines, wrenches on bodies, contacts. It needs
/// Bevy's plugins for gizmos, which `DefaultPlugins` includes. Width and depth of the lines are those of the group
/// [`FieldGizmos`].
#[derive(Default)]
pub struct RapierFieldsDebugRenderPlugin;

/// The gizmo group of fields, to be configured in Bevy's `GizmoConfigStore`.
#[derive(Default, Reflect, GizmoConfigGroup)]
pub struct FieldGizmos;

/// The mode and the style in which fields are drawn.
#[derive(Resource)]
pub struct FieldsDebugRender {
    /// Whether fields are drawn.
    pub enabled: bool,
    /// The mode, which selects what is drawn, and the style.
    pub pipeline: FieldDebugRenderPipeline,
    /// Whether the warning that lines are missing has been logged.
    warned: bool,
}

impl Default for FieldsDebugRender {
    fn default() -> Self {
        FieldsDebugRender {
            enabled: true,
            pipeline: FieldDebugRenderPipeline::default(),
            warned: false,
        }
    }
}

impl Plugin for RapierFieldsDebugRenderPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<FieldsDebugRender>();
        app.init_gizmo_group::<FieldGizmos>();
        app.add_systems(PostUpdate, draw.after(PhysicsSet::Writeback));
    }
}

struct Lines<'a, 'w, 's>(&'a mut Gizmos<'w, 's, FieldGizmos>);

impl DebugRenderBackend for Lines<'_, '_, '_> {
    fn draw_line(&mut self, _: DebugRenderObject, a: Vector, b: Vector, color: DebugColor) {
        let [hue, saturation, lightness, alpha] = color;
        self.0
            .line(a, b, Color::hsla(hue, saturation, lightness, alpha));
    }
}

fn draw(
    contexts: Query<(
        &RapierContextFields,
        &RapierRigidBodySet,
        &RapierContextColliders,
    )>,
    mut settings: ResMut<FieldsDebugRender>,
    mut gizmos: Gizmos<FieldGizmos>,
) {
    if !settings.enabled {
        return;
    }
    for (fields, bodies, colliders) in &contexts {
        let world = WorldRef::new(&bodies.bodies, &colliders.colliders);
        let mut lines = Lines(&mut gizmos);
        let outcome = settings.pipeline.render(&mut lines, fields.fields(), world);
        if outcome.limit_reached && !std::mem::replace(&mut settings.warned, true) {
            log::warn!(
                "fields are drawn only in part: `style.max_lines` is {}",
                outcome.lines
            );
        }
    }
}
