//! All `TimestepMode`s: the fields act in each of Rapier's steps, for the length of the step.

use bevy_rapier3d::rapier::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder};

use crate::support::*;

fn modes() -> [TimestepMode; 6] {
    let (dt, max_dt, time_scale) = (DT, 1.0, 1.0);
    let of = |substeps| {
        [
            TimestepMode::Fixed { dt, substeps },
            TimestepMode::Variable {
                max_dt,
                time_scale,
                substeps,
            },
            TimestepMode::Interpolated {
                dt,
                time_scale,
                substeps,
            },
        ]
    };
    let ([a, b, c], [d, e, f]) = (of(1), of(3));
    [a, b, c, d, e, f]
}

#[test]
fn a_uniform_force_gives_its_velocity_in_all_modes() {
    for mode in modes() {
        let mut app = app(mode);
        app.world_mut()
            .spawn(ForceField::new(Field::uniform(Vec3::X * 2.0)));
        let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
        // In the first frame no time has passed, so a variable step has no length.
        frames(&mut app, 61);
        let steps = match mode {
            TimestepMode::Fixed { .. } => 61.0,
            _ => 60.0,
        };
        let expected = 2.0 * steps * DT;
        let found = velocity(&mut app, body);
        // In this mode, roundings of the clock may put physics one step behind or ahead.
        let slack = if matches!(mode, TimestepMode::Interpolated { .. }) {
            2.1 * DT
        } else {
            1e-4
        };
        assert_near(found, Vec3::X * expected, slack);
    }
}

/// Boxes that fall on a floor, with interpolated transforms.
fn falling(mode: TimestepMode, plugin: impl Plugin) -> (App, Vec<Entity>) {
    let mut app = app_with(mode, plugin);
    let floor = (
        Collider::cuboid(9.0, 0.5, 9.0),
        Transform::from_xyz(0.0, -0.5, 0.0),
    );
    app.world_mut().spawn(floor);
    let bodies = (0..12_u8).map(|number| {
        let [x, y] = [number % 3, number / 3].map(f32::from);
        let at = Transform::from_xyz(x * 0.3, 1.0 + y, x * 0.2);
        let body = (RigidBody::Dynamic, Collider::cuboid(0.3, 0.2, 0.25), at);
        let speed = Velocity::linear(Vec3::NEG_Y * 3.0);
        let bounce = Restitution::coefficient(0.4);
        // All have the same components: otherwise the order of their insertion into Rapier differs from app to app.
        let drawn = TransformInterpolation::default();
        app.world_mut().spawn((body, speed, bounce, drawn)).id()
    });
    let bodies = bodies.collect();
    (app, bodies)
}

#[test]
fn without_fields_all_frames_equal_those_of_rapiers_own_plugin() {
    let slow = |time_scale| TimestepMode::Interpolated {
        dt: DT,
        time_scale,
        substeps: 2,
    };
    let no_step = TimestepMode::Variable {
        max_dt: 0.02,
        time_scale: 0.0,
        substeps: 1,
    };
    for mode in modes().into_iter().chain([slow(0.5), slow(0.0), no_step]) {
        let (mut ours, bodies) = falling(mode, RapierFieldsPlugin::<NoUserData>::default());
        let (mut theirs, others) = falling(mode, RapierPhysicsPlugin::<NoUserData>::default());
        for frame in 0..90_u32 {
            let length = Duration::from_micros(u64::from(3_000 + 1_997 * (frame * 7 % 16)));
            for app in [&mut ours, &mut theirs] {
                app.insert_resource(TimeUpdateStrategy::ManualDuration(length));
                app.update();
            }
            for (body, other) in bodies.iter().zip(&others) {
                let found = ours.world().get::<Transform>(*body);
                let expected = theirs.world().get::<Transform>(*other);
                assert_eq!(found, expected, "{mode:?}, {frame}");
            }
        }
        let dt = |app: &mut App| {
            let mut contexts = app.world_mut().query::<&RapierContextSimulation>();
            let context = contexts.single(app.world()).expect("one context");
            context.integration_parameters.dt
        };
        assert_eq!(dt(&mut ours), dt(&mut theirs), "{mode:?}");
    }
}

#[test]
fn an_orbit_stays_circular_in_frames_of_uneven_length() {
    for substeps in [1, 2] {
        let mut app = app(TimestepMode::Variable {
            max_dt: 1.0,
            time_scale: 1.0,
            substeps,
        });
        app.world_mut()
            .spawn(ForceField::new(Field::point_gravity(4.0)));
        let moon = (ball(Vec3::X * 4.0), Velocity::linear(Vec3::Y));
        let moon = app.world_mut().spawn(moon).id();
        for frame in 0..1_500_u32 {
            // 5 to 20 ms.
            let length = Duration::from_micros(u64::from(5_000 + 997 * (frame * 7 % 16)));
            app.insert_resource(TimeUpdateStrategy::ManualDuration(length));
            app.update();
        }
        let distance = place(&app, moon).length();
        assert!(
            (distance - 4.0).abs() < 2e-3,
            "a circular orbit: {distance}"
        );
    }
}

#[test]
fn interpolated_steps_follow_the_clock_in_slow_and_fast_frames() {
    for frame in [1.0 / 240.0, 1.0 / 25.0] {
        let mut app = app(TimestepMode::Interpolated {
            dt: DT,
            time_scale: 1.0,
            substeps: 2,
        });
        let length = Duration::from_secs_f32(frame);
        app.insert_resource(TimeUpdateStrategy::ManualDuration(length));
        app.world_mut()
            .spawn(ForceField::new(Field::uniform(Vec3::Y)));
        let body = (ball(Vec3::ZERO), TransformInterpolation::default());
        let body = app.world_mut().spawn(body).id();
        let count = (2.0 / frame) as usize;
        frames(&mut app, count);
        let speed = velocity(&mut app, body).y;
        assert!((speed - 2.0).abs() < 2.0 * DT + frame, "{frame}: {speed}");
        let interpolation = app
            .world()
            .get::<TransformInterpolation>(body)
            .expect("it has one");
        let start = interpolation.start.expect("the last step began somewhere");
        let end = interpolation.end.expect("and ended");
        let way = (end.translation - start.translation).y;
        assert!((way - speed * DT).abs() < 0.1 * DT, "one whole step: {way}");
    }
}

#[test]
fn fixed_steps_equal_those_of_the_crate_without_bevy_bit_for_bit() {
    for substeps in [1, 2] {
        let planet = || Field::point_gravity(9.0).softened(0.1);
        let wind = || {
            Field::wind(Vec3::Z, 0.1, 0.05)
                .within(Region::ball(3.0))
                .at(Vec3::X * 2.0)
        };
        let contact = || Field::contact(ContactLaw::restitution(0.6));
        let places = [
            Vec3::X * 2.0,
            Vec3::new(2.5, 1.0, 0.0),
            Vec3::new(-1.0, 2.0, 0.5),
        ];

        let mut app = app(TimestepMode::Fixed { dt: DT, substeps });
        app.update();
        let at = context(&mut app);
        let configuration = app.world_mut().get_mut::<RapierConfiguration>(at);
        configuration.expect("a context has one").gravity = Vec3::Y * -2.0;
        let floor = (
            Collider::cuboid(9.0, 0.5, 9.0),
            Transform::from_xyz(0.0, -1.5, 0.0),
        );
        app.world_mut().spawn(floor);
        app.world_mut().spawn(ForceField::new(planet()));
        app.world_mut().spawn(ForceField::new(wind()));
        let bodies = places.map(|place| {
            let body = (RigidBody::Dynamic, Collider::cuboid(0.2, 0.1, 0.3));
            let spin = Velocity::angular(Vec3::new(0.3, 1.0, -0.2));
            let at = Transform::from_translation(place);
            let field = ForceField::new(contact());
            app.world_mut().spawn((body, spin, at, field)).id()
        });

        let mut world = PhysicsWorld::new();
        world.gravity = Vec3::Y * -2.0;
        world.integration_parameters.dt = DT / substeps as f32;
        let floor = ColliderBuilder::cuboid(9.0, 0.5, 9.0).translation(Vec3::Y * -1.5);
        world.colliders.insert(floor);
        let handles = places.map(|place| {
            let body = RigidBodyBuilder::dynamic().translation(place);
            let body = body.angvel(Vec3::new(0.3, 1.0, -0.2));
            world.insert(body, ColliderBuilder::cuboid(0.2, 0.1, 0.3))
        });
        let tree = planet().sum_union(wind());
        let contacts = handles.map(|(_, collider)| contact().at(collider));
        let contacts = contacts.map(Tree::from);
        let tree = Tree::fold(Operator::SumUnion, [tree].into_iter().chain(contacts));
        let mut fields = bevy_rapier3d_fields::fields::Fields::new(tree).expect("valid fields");

        for frame in 0..240 {
            app.update();
            for _ in 0..substeps {
                fields.step(&mut world).expect("a step");
            }
            for (entity, (body, _)) in bodies.iter().zip(handles) {
                let found = app.world().get::<Transform>(*entity).expect("it is placed");
                let expected = world.bodies[body].position();
                let at = (found.translation, found.rotation);
                assert_eq!(
                    at,
                    (expected.translation, expected.rotation),
                    "frame {frame}"
                );
            }
        }
    }
}

#[test]
fn no_force_acts_in_a_context_that_is_inactive_or_only_detects_collisions() {
    for only_detects in [false, true] {
        let mut app = app(fixed());
        app.world_mut()
            .spawn(ForceField::new(Field::uniform(Vec3::X)));
        let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
        app.update();
        let moved = velocity(&mut app, body);
        let context = context(&mut app);
        let configuration = app.world_mut().get_mut::<RapierConfiguration>(context);
        let mut configuration = configuration.expect("a context has one");
        if only_detects {
            configuration.simulation_mode = SimulationMode::CollisionOnly;
        } else {
            configuration.physics_pipeline_active = false;
        }
        frames(&mut app, 10);
        assert_eq!(velocity(&mut app, body), moved);
    }
}

#[test]
fn the_fixed_schedule_steps_as_often_as_it_runs() {
    let mut app = app_with(
        fixed(),
        RapierFieldsPlugin::<NoUserData>::default().in_fixed_schedule(),
    );
    app.insert_resource(Time::<Fixed>::from_hz(60.0));
    app.world_mut()
        .spawn(ForceField::new(Field::uniform(Vec3::X)));
    let body = app.world_mut().spawn(ball(Vec3::ZERO)).id();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(
        100,
    )));
    frames(&mut app, 21);
    let speed = velocity(&mut app, body).x;
    assert!((speed - 2.0).abs() < 0.11, "two seconds at 1 m/s²: {speed}");
}

#[test]
#[should_panic(expected = "in its place")]
fn rapiers_own_plugin_beside_it_is_refused() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin));
    app.add_plugins(RapierPhysicsPlugin::<NoUserData>::default());
    app.add_plugins(RapierFieldsPlugin::<NoUserData>::default());
}
