//! Messages of zones and contacts.

use crate::support::*;

#[derive(Resource, Default)]
struct Heard {
    zones: Vec<FieldZoneEvent>,
    contacts: Vec<FieldContactEvent>,
    collisions: usize,
}

fn hearing(mode: TimestepMode) -> App {
    let mut app = app(mode);
    app.init_resource::<Heard>();
    app.insert_resource(RapierFieldsSettings {
        zone_events: true,
        contact_events: true,
        ..default()
    });
    app.add_systems(
        Last,
        |mut heard: ResMut<Heard>,
         mut zones: MessageReader<FieldZoneEvent>,
         mut contacts: MessageReader<FieldContactEvent>,
         mut collisions: MessageReader<CollisionEvent>| {
            heard.zones.extend(zones.read());
            heard.contacts.extend(contacts.read());
            heard.collisions += collisions.read().count();
        },
    );
    app
}

#[test]
fn zone_messages_name_the_field_the_body_and_the_time() {
    for substeps in [1, 4] {
        let mut app = hearing(TimestepMode::Fixed { dt: DT, substeps });
        let zone = Field::uniform(Vec3::ZERO)
            .within(Region::ball(1.0))
            .at(Vec3::X * 2.0);
        let zone = app.world_mut().spawn(ForceField::new(zone)).id();
        let body = (ball(Vec3::ZERO), Velocity::linear(Vec3::X * 3.0));
        let body = app.world_mut().spawn(body).id();
        frames(&mut app, 90);
        let heard = app.world().resource::<Heard>();
        let [entered, left] = heard.zones[..] else {
            panic!("{:?}", heard.zones);
        };
        let FieldZoneEvent::Entered {
            field,
            body: who,
            time,
        } = entered
        else {
            panic!("{entered:?}");
        };
        assert_eq!((field, who), (zone, body));
        assert!((time - 1.0 / 3.0).abs() < 1e-5);
        let FieldZoneEvent::Left {
            field,
            body: who,
            time,
        } = left
        else {
            panic!("{left:?}");
        };
        assert_eq!((field, who), (zone, body));
        assert!((time - 1.0).abs() < 1e-5);
    }
}

#[test]
fn a_despawned_entity_is_named_in_the_message_that_it_left() {
    for field_goes in [false, true] {
        let mut app = hearing(fixed());
        let zone = Field::uniform(Vec3::ZERO).within(Region::ball(1.0));
        let zone = app.world_mut().spawn(ForceField::new(zone)).id();
        let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
        frames(&mut app, 3);
        app.world_mut()
            .despawn(if field_goes { zone } else { body });
        frames(&mut app, 3);
        let zones = &app.world().resource::<Heard>().zones;
        let [
            _,
            FieldZoneEvent::Left {
                field, body: who, ..
            },
        ] = zones[..]
        else {
            panic!("{zones:?}");
        };
        assert_eq!((field, who), (zone, body));
    }
}

#[test]
fn an_edit_in_place_sends_no_zone_messages() {
    let mut app = hearing(fixed());
    let zone = Field::uniform(Vec3::ZERO)
        .within(Region::ball(1.0))
        .named("zone");
    let zone = app.world_mut().spawn(ForceField::new(zone)).id();
    app.world_mut().spawn(ball(Vec3::ZERO));
    for strength in [1.0, 2.0, 3.0] {
        app.update();
        let mut field = app
            .world_mut()
            .get_mut::<ForceField>(zone)
            .expect("it has one");
        field["zone"].strength = strength;
    }
    frames(&mut app, 3);
    assert_eq!(app.world().resource::<Heard>().zones.len(), 1);
}

#[test]
fn contacts_of_fields_are_reported_beside_those_of_rapier() {
    let mut app = hearing(fixed());
    let mut spawn = |x: f32, speed: f32| {
        let field = ForceField::new(Field::contact(ContactLaw::elastic()));
        let events = ActiveEvents::COLLISION_EVENTS;
        let start = Velocity::linear(Vec3::X * speed);
        app.world_mut()
            .spawn((ball(Vec3::X * x), field, events, start))
            .id()
    };
    let pair = [spawn(-0.5, 1.0), spawn(0.5, 0.0)];
    frames(&mut app, 90);
    assert_near(velocity(&mut app, pair[0]), Vec3::ZERO, 1e-5);
    assert_near(velocity(&mut app, pair[1]), Vec3::X, 1e-5);
    let heard = app.world().resource::<Heard>();
    let [started, stopped] = heard.contacts[..] else {
        panic!("{:?}", heard.contacts);
    };
    let FieldContactEvent::Started {
        colliders, impulse, ..
    } = started
    else {
        panic!("{started:?}");
    };
    assert_eq!(colliders, pair);
    assert_near(impulse, Vec3::X, 1e-5);
    assert!(matches!(stopped, FieldContactEvent::Stopped { colliders, .. } if colliders == pair));
    assert_eq!(heard.collisions, 2, "Rapier's own: started and stopped");
}

#[test]
fn no_messages_are_sent_unless_they_are_enabled() {
    let mut app = hearing(fixed());
    app.insert_resource(RapierFieldsSettings::default());
    let zone = Field::uniform(Vec3::ZERO).within(Region::ball(1.0));
    app.world_mut().spawn(ForceField::new(zone));
    app.world_mut().spawn(ball(Vec3::ZERO));
    frames(&mut app, 3);
    assert!(app.world().resource::<Heard>().zones.is_empty());
}
