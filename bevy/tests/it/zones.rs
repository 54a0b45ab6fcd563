//! Zones made of colliders.

use crate::support::*;

fn zone(shape: Collider, at: Transform) -> impl Bundle {
    let field = ForceField::new(Field::uniform(Vec3::X));
    (shape, Sensor, WithinCollider, field, at)
}

#[test]
fn a_field_within_a_sensor_acts_inside_of_it_only() {
    let mut app = app(fixed());
    let turned = Quat::from_rotation_z(std::f32::consts::FRAC_PI_4);
    let at = Transform::from_xyz(0.0, 4.0, 0.0).with_rotation(turned);
    app.world_mut()
        .spawn(zone(Collider::cuboid(2.0, 0.2, 0.2), at));
    let along = app.world_mut().spawn(ball(Vec3::new(1.0, 5.0, 0.0))).id();
    let beside = app.world_mut().spawn(ball(Vec3::new(1.0, 3.0, 0.0))).id();
    app.update();
    let push = turned * Vec3::X * DT;
    assert_near(velocity(&mut app, along), push, 1e-6);
    assert_eq!(velocity(&mut app, beside), Vec3::ZERO);
}

#[test]
fn a_zone_is_as_large_as_its_scaled_collider_and_follows_it() {
    let mut app = app(fixed());
    let at = Transform::from_scale(Vec3::splat(3.0));
    let zone = app.world_mut().spawn(zone(Collider::ball(1.0), at)).id();
    let body = app.world_mut().spawn(ball(Vec3::Y * 2.5)).id();
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * DT, 1e-6);
    app.world_mut().entity_mut(zone).insert(Collider::ball(0.5));
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * DT, 1e-6);
    app.world_mut().entity_mut(zone).insert(Collider::ball(1.5));
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * 2.0 * DT, 1e-6);
}

#[test]
fn a_region_of_the_field_is_intersected_with_the_collider() {
    let mut app = app(fixed());
    let field = Field::uniform(Vec3::X)
        .within(Region::ball(1.0))
        .at(Vec3::X * 2.0);
    let zone = (
        Collider::ball(2.0),
        Sensor,
        WithinCollider,
        ForceField::new(field),
    );
    app.world_mut()
        .spawn((zone, Transform::from_xyz(0.0, 1.0, 0.0)));
    let places = [1.5, 2.5, -1.0].map(|x| Vec3::new(x, 1.0, 0.0));
    let bodies = places.map(|place| app.world_mut().spawn(ball(place)).id());
    app.update();
    let speeds = bodies.map(|body| velocity(&mut app, body).x > 0.0);
    assert_eq!(speeds, [true, false, false]);
}

#[test]
fn without_a_collider_there_is_no_zone() {
    let mut app = app(fixed());
    let field = ForceField::new(Field::uniform(Vec3::X));
    let zone = app.world_mut().spawn((WithinCollider, field)).id();
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    app.update();
    assert_eq!(velocity(&mut app, body), Vec3::ZERO);
    app.world_mut()
        .entity_mut(zone)
        .insert((Collider::ball(1.0), Sensor));
    app.update();
    assert_near(velocity(&mut app, body), Vec3::X * DT, 1e-6);
}

#[test]
fn a_zone_follows_its_sensor() {
    let mut app = app(fixed());
    let zone = app
        .world_mut()
        .spawn(zone(Collider::ball(1.0), Transform::default()))
        .id();
    let bodies = [0.0, 5.0].map(|y| app.world_mut().spawn(ball(Vec3::Y * y)).id());
    for y in [0.0, 5.0, 9.0] {
        app.world_mut()
            .entity_mut(zone)
            .insert(Transform::from_xyz(0.0, y, 0.0));
        app.update();
    }
    for body in bodies {
        assert_near(velocity(&mut app, body), Vec3::X * DT, 1e-6);
    }
}

#[test]
fn a_floor_with_a_contact_field_answers() {
    let mut app = app(fixed());
    app.world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::Y * -5.0)));
    let contact = ForceField::new(Field::contact(ContactLaw::elastic()));
    let at = Transform::from_xyz(0.0, -1.0, 0.0);
    app.world_mut()
        .spawn((Collider::cuboid(5.0, 1.0, 5.0), contact, at));
    let body = app.world_mut().spawn(ball(Vec3::Y * 1.1)).id();
    let fall = (2.0_f32 / 5.0).sqrt();
    let mut highest = 0.0_f32;
    for frame in 0..240_u8 {
        app.update();
        if f32::from(frame) * DT > 1.5 * fall {
            highest = highest.max(place(&app, body).y);
        }
    }
    assert!((highest - 1.1).abs() < 0.05, "as high as before: {highest}");
}
