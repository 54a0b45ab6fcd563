//! Apps for tests.

pub use std::time::Duration;

pub use bevy::app::Plugins;
pub use bevy::prelude::*;
pub use bevy::time::TimeUpdateStrategy;
pub use bevy_rapier3d::prelude::*;
pub use bevy_rapier3d_fields::prelude::*;

pub const DT: f32 = 1.0 / 60.0;

/// An app whose frames take 1/60 s, without gravity.
pub fn app(mode: TimestepMode) -> App {
    app_with(mode, RapierFieldsPlugin::<NoUserData>::default())
}

pub fn app_with<M>(mode: TimestepMode, plugins: impl Plugins<M>) -> App {
    let mut app = App::new();
    let mut world = RapierContextInitialization::default();
    if let RapierContextInitialization::InitializeDefaultRapierContext {
        rapier_configuration,
        ..
    } = &mut world
    {
        rapier_configuration.gravity = Vec3::ZERO;
    }
    app.insert_resource(world);
    app.add_plugins((MinimalPlugins, TransformPlugin))
        .insert_resource(mode)
        .add_plugins(plugins)
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(
            DT,
        )));
    app.finish();
    app.cleanup();
    app
}

pub fn fixed() -> TimestepMode {
    TimestepMode::Fixed {
        dt: DT,
        substeps: 1,
    }
}

/// A ball of mass 1.
pub fn ball(place: Vec3) -> impl Bundle {
    (
        RigidBody::Dynamic,
        Collider::ball(0.1),
        ColliderMassProperties::Mass(1.0),
        Transform::from_translation(place),
    )
}

pub fn frames(app: &mut App, number: usize) {
    (0..number).for_each(|_| app.update());
}

pub fn place(app: &App, entity: Entity) -> Vec3 {
    app.world()
        .get::<Transform>(entity)
        .expect("it is placed")
        .translation
}

/// The velocity in Rapier, which needs no component.
pub fn velocity(app: &mut App, entity: Entity) -> Vec3 {
    let handle = app
        .world()
        .get::<RapierRigidBodyHandle>(entity)
        .expect("a body")
        .0;
    let mut sets = app.world_mut().query::<&RapierRigidBodySet>();
    let set = sets.single(app.world()).expect("one context");
    set.bodies[handle].linvel()
}

pub fn context(app: &mut App) -> Entity {
    let mut contexts = app
        .world_mut()
        .query_filtered::<Entity, With<RapierContextFields>>();
    contexts.single(app.world()).expect("one context")
}

#[track_caller]
pub fn assert_near(found: Vec3, expected: Vec3, tolerance: f32) {
    let off = (found - expected).length();
    assert!(off <= tolerance, "{found} is {off} off {expected}");
}
