//! Fields as gizmos.

use std::any::TypeId;

use bevy::gizmos::{GizmoAsset, GizmoHandles};
use bevy_rapier3d_fields::fields::debug_render::FieldDebugRenderMode;

use crate::support::*;

/// The ends of all lines of fields in the last frame.
fn drawn(app: &App) -> Vec<Vec3> {
    let handles = app.world().resource::<GizmoHandles>().handles();
    let Some(Some(handle)) = handles.get(&TypeId::of::<FieldGizmos>()) else {
        return Vec::new();
    };
    let assets = app.world().resource::<Assets<GizmoAsset>>();
    assets
        .get(handle)
        .expect("it is there")
        .buffer()
        .list_positions
        .clone()
}

#[test]
fn the_outline_of_a_region_is_drawn_where_its_entity_is() {
    let assets = |app: &mut App| {
        app.init_asset::<GizmoAsset>();
    };
    let drawing = (
        AssetPlugin::default(),
        assets,
        RapierFieldsDebugRenderPlugin,
    );
    let rapier = RapierFieldsPlugin::<NoUserData>::default();
    let mut app = app_with(fixed(), (rapier, drawing));
    let mut settings = app.world_mut().resource_mut::<FieldsDebugRender>();
    settings.pipeline.mode = FieldDebugRenderMode::REGIONS;
    app.update();
    assert!(drawn(&app).is_empty());
    let zone = ForceField::new(Field::uniform(Vec3::X).within(Region::ball(2.0)));
    let zone = app
        .world_mut()
        .spawn((zone, Transform::from_xyz(0.0, 5.0, 0.0)))
        .id();
    app.update();
    let lines = drawn(&app);
    assert!(lines.len() > 20);
    for end in &lines {
        let distance = end.distance(Vec3::Y * 5.0);
        assert!(
            (distance - 2.0).abs() < 1e-4,
            "{end} is {distance} from the middle"
        );
    }
    app.world_mut()
        .entity_mut(zone)
        .insert(Transform::from_xyz(0.0, 6.0, 0.0));
    app.update();
    let moved = drawn(&app);
    assert_eq!(moved.len(), lines.len());
    assert_near(moved[0], lines[0] + Vec3::Y, 1e-5);

    app.world_mut().resource_mut::<FieldsDebugRender>().enabled = false;
    app.update();
    assert!(drawn(&app).is_empty());
}
