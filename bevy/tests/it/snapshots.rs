//! Prediction and rollback.

use bevy::ecs::system::RunSystemOnce;

use crate::support::*;

fn shaken() -> (App, Entity) {
    let mut app = app(fixed());
    app.world_mut().spawn(ForceField::new(Field::spring(9.0)));
    let swirl = Field::vortex(2.0, 0.0)
        .within(Region::ball(1.5))
        .at(Vec3::X);
    app.world_mut().spawn(ForceField::new(swirl));
    let contact = || ForceField::new(Field::contact(ContactLaw::restitution(0.7)));
    for place in [Vec3::Y, Vec3::NEG_X, Vec3::new(0.5, 0.5, 0.5)] {
        app.world_mut().spawn((ball(place), contact()));
    }
    let body = app.world_mut().spawn((ball(Vec3::X), contact())).id();
    let rope = RopeJointBuilder::new(0.7);
    let joint = ImpulseJoint::new(body, rope);
    app.world_mut().spawn((ball(Vec3::X * 1.5), joint));
    frames(&mut app, 50);
    (app, body)
}

#[test]
fn a_predicted_path_is_the_one_in_the_app() {
    let (mut app, body) = shaken();
    let ahead = move |ahead: PredictFields| ahead.path(body, 120).expect("a path");
    let path = app.world_mut().run_system_once(ahead).expect("it runs");
    assert_eq!(path.len(), 120);
    for place in path {
        app.update();
        let found = *app.world().get::<Transform>(body).expect("it is placed");
        assert_eq!(found, place);
    }
    let not_a_body = app.world_mut().spawn_empty().id();
    let ahead = move |ahead: PredictFields| ahead.path(not_a_body, 9).expect("a path");
    assert!(
        app.world_mut()
            .run_system_once(ahead)
            .expect("it runs")
            .is_empty()
    );
}

#[test]
fn with_two_substeps_every_second_predicted_pose_is_that_of_a_frame() {
    let (dt, substeps) = (DT, 2);
    let mut app = app(TimestepMode::Fixed { dt, substeps });
    app.world_mut().spawn(ForceField::new(Field::spring(9.0)));
    let body = app.world_mut().spawn(ball(Vec3::X)).id();
    frames(&mut app, 5);
    let ahead = move |ahead: PredictFields| ahead.path(body, 40).expect("a path");
    let path = app.world_mut().run_system_once(ahead).expect("it runs");
    for place in path.into_iter().skip(1).step_by(2) {
        app.update();
        assert_eq!(app.world().get::<Transform>(body), Some(&place));
    }
}

#[test]
fn a_restored_context_continues_as_before() {
    let (mut app, _) = shaken();
    let at = context(&mut app);
    let world = app.world();
    let simulation = world.get::<RapierContextSimulation>(at).expect("a context");
    let simulation = serde_json::to_string(simulation).expect("it can be saved");
    let sets = (
        world
            .get::<RapierContextColliders>(at)
            .expect("a set")
            .clone(),
        world.get::<RapierRigidBodySet>(at).expect("a set").clone(),
        world
            .get::<RapierContextFields>(at)
            .expect("fields")
            .clone(),
        world.get::<RapierContextJoints>(at).expect("a set").clone(),
    );
    let places = |app: &mut App| -> Vec<(Entity, Transform)> {
        let mut bodies = app
            .world_mut()
            .query_filtered::<(Entity, &Transform), With<RigidBody>>();
        let places = bodies.iter(app.world());
        places.map(|(body, place)| (body, *place)).collect()
    };
    let begin = places(&mut app);
    let run = |app: &mut App| -> Vec<_> {
        let mut frame = || {
            frames(app, 1);
            places(app)
        };
        (0..100).map(|_| frame()).collect()
    };
    let first = run(&mut app);
    assert!(first.windows(2).all(|frames| frames[0] != frames[1]));
    let simulation: RapierContextSimulation =
        serde_json::from_str(&simulation).expect("it can be read");
    let (colliders, bodies, fields, joints) = sets;
    app.world_mut()
        .entity_mut(at)
        .insert((simulation, colliders, bodies, fields, joints));
    for (body, place) in begin {
        app.world_mut().entity_mut(body).insert(place);
    }
    assert_eq!(first, run(&mut app));
}
