//! Input that is not valid is refused, and the previous state stays.

use bevy_rapier3d::rapier::prelude::RigidBodyHandle;

use crate::support::*;

#[test]
fn a_field_that_is_not_valid_does_not_stop_the_others() {
    let mut app = app(fixed());
    app.world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::X)));
    app.world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::X * f32::NAN)));
    // A contact field needs a collider.
    app.world_mut()
        .spawn(ForceField::new(Field::contact(ContactLaw::elastic())));
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    frames(&mut app, 60);
    assert_near(velocity(&mut app, body), Vec3::X, 1e-5);
}

#[test]
fn an_edit_that_is_not_valid_leaves_the_field_as_it_was() {
    let mut app = app(fixed());
    let field = ForceField::new(Field::uniform(Vec3::X).named("push"));
    let field = app.world_mut().spawn(field).id();
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    app.update();
    let mut edited = app
        .world_mut()
        .get_mut::<ForceField>(field)
        .expect("it has one");
    edited["push"].strength = f32::INFINITY;
    app.update();
    let other = ForceField::new(Field::uniform(Vec3::X * f32::NAN));
    app.world_mut().entity_mut(field).insert(other);
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * 3.0 * DT, 1e-6);
}

#[test]
fn properties_that_are_not_valid_are_refused() {
    let mut app = app(fixed());
    let field = Field::uniform(Vec3::X).coupled_to_axis(bevy_rapier3d_fields::fields::Axis::Charge);
    app.world_mut().spawn(ForceField::new(field));
    let charge = FieldProperties(ColliderProperties::new().charge(f32::NAN));
    let body = app.world_mut().spawn((ball(Vec3::ZERO), charge)).id();
    app.update();
    assert_eq!(velocity(&mut app, body), Vec3::ZERO);
}

#[test]
fn a_field_at_a_body_that_does_not_exist_does_not_act() {
    let mut app = app(fixed());
    let field = Field::uniform(Vec3::X).at(RigidBodyHandle::from_raw_parts(99, 0));
    app.world_mut().spawn(ForceField::new(field));
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    frames(&mut app, 3);
    assert_eq!(velocity(&mut app, body), Vec3::ZERO);
}

#[test]
fn settings_that_are_not_valid_are_refused() {
    let mut app = app(fixed());
    app.world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::X)));
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    app.update();
    let mut settings = app.world_mut().resource_mut::<RapierFieldsSettings>();
    settings.fields.scheme = Scheme::auto(-1.0);
    settings.fields.detection = Detection::Swept;
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * 2.0 * DT, 1e-6);
    let context = context(&mut app);
    let fields = app
        .world()
        .get::<RapierContextFields>(context)
        .expect("it has fields");
    assert_eq!(
        fields.settings.detection,
        Detection::default(),
        "all or nothing"
    );
}

#[test]
fn a_context_whose_fields_cannot_act_stands_still_until_they_can() {
    let mut app = app(fixed());
    let mut settings = app.world_mut().resource_mut::<RapierFieldsSettings>();
    settings.fields.on_fault = FaultPolicy::Refuse;
    app.world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::X)));
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    app.update();
    let bad = Field::closure([], |_: &Sample| Vec3::splat(f32::NAN));
    let bad = app.world_mut().spawn(ForceField::new(bad)).id();
    let before = place(&app, body);
    frames(&mut app, 5);
    assert_eq!(place(&app, body), before);
    app.world_mut().despawn(bad);
    frames(&mut app, 3);
    assert_near(velocity(&mut app, body), Vec3::X * 4.0 * DT, 1e-6);
}
