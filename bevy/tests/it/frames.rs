//! The frames of fields: world, bodies, colliders, parents.

use crate::support::*;

#[test]
fn a_field_without_a_body_is_where_its_transform_is() {
    let mut app = app(fixed());
    let turned = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
    let at = Transform::from_xyz(5.0, 0.0, 0.0).with_rotation(turned);
    let push = Field::uniform(Vec3::X)
        .within(Region::ball(1.0))
        .at(Vec3::X * 2.0);
    let field = app.world_mut().spawn((ForceField::new(push), at)).id();
    // At a distance of 2 along the turned x axis.
    let near = app.world_mut().spawn(ball(Vec3::new(5.0, 2.0, 0.0))).id();
    let far = app.world_mut().spawn(ball(Vec3::new(7.0, 0.0, 0.0))).id();
    app.update();
    assert_near(velocity(&mut app, near), Vec3::Y * DT, 1e-6);
    assert_eq!(velocity(&mut app, far), Vec3::ZERO);

    let moved = Transform::from_xyz(5.0, 0.0, 0.0);
    app.world_mut().entity_mut(field).insert(moved);
    app.update();
    assert_near(velocity(&mut app, near), Vec3::Y * DT, 1e-6);
    assert_near(velocity(&mut app, far), Vec3::X * DT, 1e-6);
}

#[test]
fn a_field_of_a_child_follows_its_parent() {
    let mut app = app(fixed());
    let field = ForceField::new(Field::uniform(Vec3::X).within(Region::ball(1.0)));
    let parent = app
        .world_mut()
        .spawn(Transform::from_xyz(0.0, 5.0, 0.0))
        .id();
    let child = (field, Transform::from_xyz(0.0, 1.0, 0.0), ChildOf(parent));
    app.world_mut().spawn(child);
    let first = app.world_mut().spawn(ball(Vec3::Y * 6.0)).id();
    let second = app.world_mut().spawn(ball(Vec3::Y * -4.0)).id();
    app.update();
    app.world_mut()
        .entity_mut(parent)
        .insert(Transform::from_xyz(0.0, -5.0, 0.0));
    app.update();
    assert_near(velocity(&mut app, first), Vec3::X * DT, 1e-6);
    assert_near(velocity(&mut app, second), Vec3::X * DT, 1e-6);
}

#[test]
fn a_field_on_a_body_moves_with_it_and_does_not_push_it() {
    for on_a_child in [false, true] {
        let mut app = app(fixed());
        let carrier = (ball(Vec3::ZERO), Velocity::linear(Vec3::X * 6.0));
        let carrier = app.world_mut().spawn(carrier).id();
        let push = Field::uniform(Vec3::Z).within(Region::ball(0.5));
        if on_a_child {
            let at = Transform::from_xyz(0.0, 1.0, 0.0);
            app.world_mut()
                .spawn((ForceField::new(push), at, ChildOf(carrier)));
        } else {
            let push = push.at(Vec3::Y);
            app.world_mut()
                .entity_mut(carrier)
                .insert(ForceField::new(push));
        }
        // The field passes over the ball in a sixth of a second, over one length unit.
        let passed = app.world_mut().spawn(ball(Vec3::new(3.0, 1.0, 0.0))).id();
        frames(&mut app, 60);
        let speed = velocity(&mut app, passed);
        assert_near(speed, Vec3::Z / 6.0, 1.1 * DT);
        assert_near(velocity(&mut app, carrier), Vec3::X * 6.0, 1e-5);
    }
}

#[test]
fn charges_and_samplings_are_components() {
    let mut app = app(fixed());
    let field = Field::uniform(Vec3::X).coupled_to_axis(bevy_rapier3d_fields::fields::Axis::Charge);
    app.world_mut().spawn(ForceField::new(field));
    let charge = FieldProperties(ColliderProperties::new().charge(-2.0));
    let charged = app.world_mut().spawn((ball(Vec3::ZERO), charge)).id();
    let neutral = app.world_mut().spawn(ball(Vec3::Y)).id();
    app.update();
    assert_near(velocity(&mut app, charged), Vec3::X * -2.0 * DT, 1e-6);
    assert_eq!(velocity(&mut app, neutral), Vec3::ZERO);

    app.world_mut()
        .get_mut::<FieldProperties>(charged)
        .expect("it has one")
        .charge = 2.0;
    app.update();
    assert_near(velocity(&mut app, charged), Vec3::ZERO, 1e-6);
    app.world_mut()
        .entity_mut(charged)
        .remove::<FieldProperties>();
    app.update();
    assert_near(velocity(&mut app, charged), Vec3::ZERO, 1e-6);

    let context = context(&mut app);
    app.world_mut()
        .entity_mut(charged)
        .insert(FieldSampling(Sampling::Centre));
    app.update();
    let fields = app
        .world()
        .get::<RapierContextFields>(context)
        .expect("it has fields");
    assert_eq!(fields.set.samplings().count(), 1);
    app.world_mut()
        .entity_mut(charged)
        .remove::<FieldSampling>();
    app.update();
    let fields = app
        .world()
        .get::<RapierContextFields>(context)
        .expect("it has fields");
    assert_eq!(fields.set.samplings().count(), 0);
}

#[test]
fn user_defined_axes_are_settings() {
    let mut app = app(fixed());
    let settings = RapierFieldsSettings {
        axes: vec![("heat".into(), 3.0)],
        ..default()
    };
    app.insert_resource(settings);
    let heat = Field::closure(["heat".into()], |at: &Sample| Vec3::Y * at.axes[0]);
    app.world_mut().spawn(ForceField::new(heat));
    let hot = FieldProperties(ColliderProperties::new().axis("heat", 5.0));
    let hot = app.world_mut().spawn((ball(Vec3::ZERO), hot)).id();
    let mild = app.world_mut().spawn(ball(Vec3::X)).id();
    app.update();
    assert_near(velocity(&mut app, hot), Vec3::Y * 5.0 * DT, 1e-6);
    assert_near(velocity(&mut app, mild), Vec3::Y * 3.0 * DT, 1e-6);

    let mut settings = app.world_mut().resource_mut::<RapierFieldsSettings>();
    settings.axes[0].1 = -3.0;
    app.update();
    assert_near(velocity(&mut app, mild), Vec3::ZERO, 1e-6);
    assert_near(velocity(&mut app, hot), Vec3::Y * 10.0 * DT, 1e-6);
}

#[test]
fn a_second_context_has_fields_of_its_own() {
    let mut app = app(fixed());
    app.update();
    let second = app
        .world_mut()
        .spawn(RapierContextSimulation::default())
        .id();
    let mut configuration = RapierConfiguration::new(1.0);
    configuration.gravity = Vec3::ZERO;
    app.world_mut().entity_mut(second).insert(configuration);
    let link = RapierContextEntityLink(second);
    app.world_mut()
        .spawn((ForceField::new(Field::uniform(Vec3::X)), link));
    let inside = app.world_mut().spawn((ball(Vec3::ZERO), link)).id();
    let outside = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    frames(&mut app, 30);
    assert!(place(&app, inside).x > 0.1);
    assert_eq!(place(&app, outside), Vec3::ZERO);
}

#[test]
fn prototypes_of_instances_are_placed_by_their_instances() {
    let mut app = app(fixed());
    let push = Field::uniform(Vec3::X).within(Region::ball(1.0));
    let places = [Vec3::ZERO, Vec3::Y * 4.0].map(Anchor::from);
    let field = ForceField::new(Tree::instances(push, places));
    let at = Transform::from_xyz(0.0, 0.0, 50.0);
    app.world_mut().spawn((field, at));
    let bodies = [0.0, 4.0, 8.0].map(|y| app.world_mut().spawn(ball(Vec3::Y * y)).id());
    app.update();
    let speeds = bodies.map(|body| velocity(&mut app, body).x > 0.0);
    assert_eq!(speeds, [true, true, false]);
}
