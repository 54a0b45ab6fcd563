//! Changes while an app runs: fields are spawned, despawned, edited and moved.

use crate::support::*;

#[test]
fn a_field_acts_while_its_entity_exists() {
    let mut app = app(fixed());
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    frames(&mut app, 5);
    assert_eq!(velocity(&mut app, body), Vec3::ZERO);
    let field = app
        .world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::X)))
        .id();
    frames(&mut app, 30);
    app.world_mut().despawn(field);
    frames(&mut app, 30);
    assert_near(velocity(&mut app, body), Vec3::X * 30.0 * DT, 1e-5);
}

#[test]
fn removing_a_component_removes_its_fields() {
    let mut app = app(fixed());
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    let field = app
        .world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::X)))
        .id();
    app.update();
    app.world_mut().entity_mut(field).remove::<ForceField>();
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * DT, 1e-7);
    let context = context(&mut app);
    let fields = app
        .world()
        .get::<RapierContextFields>(context)
        .expect("it has fields");
    assert!(fields.set.is_empty());
}

#[test]
fn edits_take_effect_in_the_next_step() {
    let mut app = app(fixed());
    let wind = Field::uniform(Vec3::X).named("wind");
    let lee = Field::uniform(Vec3::ZERO)
        .within(Region::ball(1.0))
        .at(Vec3::Y * 9.0);
    let field = ForceField::new(wind.replace_union(lee));
    let field = app.world_mut().spawn(field).id();
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    app.update();
    let mut edited = app
        .world_mut()
        .get_mut::<ForceField>(field)
        .expect("it has one");
    edited["wind"].strength = -3.0;
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * -2.0 * DT, 1e-6);

    let mut edited = app
        .world_mut()
        .get_mut::<ForceField>(field)
        .expect("it has one");
    edited.set_enabled(false);
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * -2.0 * DT, 1e-6);

    let other = ForceField::new(Field::uniform(Vec3::Y));
    app.world_mut().entity_mut(field).insert(other);
    app.update();
    assert_near(
        velocity(&mut app, body),
        Vec3::new(-2.0, 1.0, 0.0) * DT,
        1e-6,
    );
}

#[test]
fn a_field_moves_to_another_body_and_goes_with_it() {
    let mut app = app(fixed());
    let push = Field::uniform(Vec3::Z)
        .within(Region::ball(0.5))
        .at(Vec3::Y);
    let carriers = [-4.0, 4.0].map(|x| app.world_mut().spawn(ball(Vec3::X * x)).id());
    let field = app
        .world_mut()
        .spawn((ForceField::new(push), ChildOf(carriers[0])))
        .id();
    let bodies = [-4.0, 4.0].map(|x| app.world_mut().spawn(ball(Vec3::new(x, 1.0, 0.0))).id());
    app.update();
    app.world_mut()
        .entity_mut(field)
        .insert(ChildOf(carriers[1]));
    app.update();
    for body in bodies {
        assert_near(velocity(&mut app, body), Vec3::Z * DT, 1e-6);
    }
    // The child is despawned with its body.
    app.world_mut().despawn(carriers[1]);
    frames(&mut app, 3);
    for body in bodies {
        assert_near(velocity(&mut app, body), Vec3::Z * DT, 1e-6);
    }
}

#[test]
fn edits_do_not_restart_the_lifetime_of_a_field() {
    let mut app = app(fixed());
    let kick = Field::uniform(Vec3::X)
        .lifetime(bevy_rapier3d_fields::fields::Lifetime::steps(4))
        .named("kick");
    let field = app.world_mut().spawn(ForceField::new(kick)).id();
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    frames(&mut app, 2);
    let mut edited = app
        .world_mut()
        .get_mut::<ForceField>(field)
        .expect("it has one");
    edited["kick"].strength = 2.0;
    frames(&mut app, 10);
    assert_near(velocity(&mut app, body), Vec3::X * 6.0 * DT, 1e-6);
}

#[test]
fn settings_of_the_resource_reach_the_context() {
    let mut app = app(fixed());
    app.world_mut().spawn(ForceField::new(Field::spring(4.0)));
    let body = app.world_mut().spawn(ball(Vec3::X)).id();
    frames(&mut app, 2);
    app.world_mut()
        .resource_mut::<RapierFieldsSettings>()
        .fields
        .scheme = Scheme::Forward4;
    frames(&mut app, 188);
    let context = context(&mut app);
    let fields = app
        .world()
        .get::<RapierContextFields>(context)
        .expect("it has fields");
    assert_eq!(fields.settings.scheme, Scheme::Forward4);
    // ω is 2. The two frames with the other scheme have no visible effect at this tolerance.
    let expected = (2.0 * 190.0 * DT).cos();
    assert!((place(&app, body).x - expected).abs() < 2e-3);
}
