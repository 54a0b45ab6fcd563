//! Worlds that are edited as they run, rolled back and run again have the same bits.

use rapier3d_fields::prelude::*;
use serde::{Deserialize, Serialize};

use crate::lab::stability::SCHEMES;
use crate::support::bits::bits;
use crate::support::formats::Format;

/// All that a step reads.
#[derive(Serialize, Deserialize)]
struct Saved<W, S, T, U> {
    world: W,
    set: S,
    settings: T,
    state: U,
}

type Read = Saved<PhysicsWorld, FieldSet, FieldSettings, FieldState>;

fn save(world: &PhysicsWorld, fields: &Fields) -> Vec<u8> {
    let saved = Saved {
        world,
        set: &fields.set,
        settings: &fields.settings,
        state: &fields.state,
    };
    Format::Bincode.write(&saved).expect("fields without code")
}

fn read(bytes: &[u8]) -> Read {
    Format::Bincode.read(bytes).expect("what was written")
}

/// A pile, joints of both kinds, a stiff well on a body, a wind, contacts that fields answer.
fn build(scheme: Scheme) -> (PhysicsWorld, Fields) {
    let mut world = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    world.insert(floor, ColliderBuilder::cuboid(30.0, 0.5, 30.0));
    let body =
        |x: Real, y: Real, z: Real| RigidBodyBuilder::dynamic().translation(Vector::new(x, y, z));
    let part = || ColliderBuilder::cuboid(0.5, 0.4, 0.3);
    for k in 0..4 {
        let k = k as Real;
        world.insert(body(0.1 * k, 0.4 + 0.9 * k, 0.0), part());
    }
    let a = world.insert(body(5.0, 4.0, 0.0), part()).0;
    let b = world.insert(body(6.5, 4.0, 0.0), part()).0;
    let joint = RevoluteJointBuilder::new(Vector::Z).local_anchor2(Vector::X * -1.5);
    world.impulse_joints.insert(a, b, joint, true);
    let c = world.insert(body(-5.0, 4.0, 0.0), part()).0;
    let d = world.insert(body(-6.0, 4.0, 0.0), part()).0;
    let joint = SphericalJointBuilder::new().local_anchor2(Vector::X * 1.0);
    let link = world.multibody_joints.insert(c, d, joint, true);
    link.expect("a chain");
    let (star, _) = world.insert(
        body(0.0, 8.0, 6.0).gravity_scale(0.0),
        ColliderBuilder::ball(0.3).mass(5.0),
    );
    let (_, ball) = world.insert(
        body(1.0, 8.0, 6.0).linvel(Vector::Y * 5.0),
        ColliderBuilder::ball(0.3),
    );
    let well = Field::spring(400.0).within(Region::ball(4.0)).at(star);
    let wind = Field::wind(Vector::X * 3.0, 0.3, 0.1).named("wind");
    let push = Field::gravity_zone(Vector::Z, Region::ball(9.0)).named("push");
    let answers = ![
        Scheme::Kick,
        Scheme::ExternalForce,
        Scheme::LinearlyImplicit,
    ]
    .contains(&scheme);
    // The other schemes are refused with contact fields, except for springs.
    let law = match answers {
        true => ContactLaw::restitution(0.8),
        false => ContactLaw::Penalty {
            stiffness: 2000.0,
            damping: 1.0,
        },
    };
    let tree = well + wind + push + Field::contact(law).at(ball);
    let fields = Fields::builder(tree).scheme(scheme).build();
    (world, fields.expect("a valid tree"))
}

/// The user's edit before a frame, which depends on the number of the frame only.
fn edit(frame: u64, world: &mut PhysicsWorld, fields: &mut Fields) {
    let turn = (frame % 17) as Real / 17.0;
    match frame % 12 {
        0 => fields["wind"].strength = turn,
        2 => drop(
            fields
                .set
                .insert_field(Field::explosion(30.0, 4.0).at(Vector::new(turn, 0.0, 0.0))),
        ),
        3 => fields["push"].region = Region::cuboid(Vector::new(9.0 * turn + 0.5, 8.0, 9.0)),
        5 => {
            let gust = Field::uniform(Vector::Y * 20.0).within(Region::ball(2.0 + turn));
            fields.set.insert_field(gust.named("gust"));
        }
        7 => {
            let body = RigidBodyBuilder::dynamic().translation(Vector::new(3.0 * turn, 5.0, 2.0));
            world.insert(body, ColliderBuilder::ball(0.4));
        }
        8 => {
            let (body, _) = world.bodies.iter().last().expect("a body");
            world.bodies[body].apply_impulse(Vector::Z * turn, true);
        }
        9 => {
            if let Some(gust) = fields.set.handle("gust") {
                fields.set.remove_field(gust);
            }
        }
        10 => {
            let (collider, _) = world.colliders.iter().nth(3).expect("a collider");
            let properties = ColliderProperties::new().charge(turn);
            let set = fields.set_properties(collider, properties, &world.colliders);
            set.expect("there");
        }
        11 if frame % 24 == 11 => {
            let (body, _) = world.bodies.iter().last().expect("a body");
            world.remove_body(body);
        }
        _ => {}
    }
}

fn frame(number: u64, world: &mut PhysicsWorld, fields: &mut Fields) -> Vec<Vec<u64>> {
    edit(number, world, fields);
    fields.step(world).expect("a step");
    bits(world)
}

/// A frame to which a run can go back: the world as bytes and as a copy, the fields as bytes.
struct Kept {
    saved: Vec<u8>,
    copy: PhysicsWorld,
    /// The state after the frame.
    seen: Vec<Vec<u64>>,
}

/// The number of frames by which a run goes back.
const BACK: usize = 8;

/// Goes back in every frame, as a game does on a late message, and makes the frames since again: from bytes or from a
/// copy of the world, into new fields or into those that have made other steps since.
fn go_back_in_every_frame(frames: u64, scheme: Scheme, detection: Detection) {
    let (mut world, mut fields) = build(scheme);
    fields.settings.detection = detection;
    let mut kept: std::collections::VecDeque<Kept> = std::collections::VecDeque::new();
    for now in 0..frames {
        let (saved, copy) = (save(&world, &fields), fields.predict(&world).world);
        let seen = frame(now, &mut world, &mut fields);
        kept.push_back(Kept { saved, copy, seen });
        if kept.len() < BACK {
            continue;
        }
        let first = kept.front().expect("as many");
        let back = read(&first.saved);
        let (bytes, anew) = (now % 2 == 0, now % 3 == 0);
        let then = kept.pop_front().expect("as many");
        world = if bytes { back.world } else { then.copy };
        if anew {
            let again = Fields::from_parts(back.set, back.settings, back.state);
            fields = again.expect("what a step left behind");
        } else {
            (fields.set, fields.settings, fields.state) = (back.set, back.settings, back.state);
        }
        let seen = std::iter::once(&then.seen).chain(kept.iter().map(|it| &it.seen));
        for (seen, number) in seen.zip(now + 1 - BACK as u64..) {
            let same = *seen == frame(number, &mut world, &mut fields);
            let what = format!("{scheme:?}, {detection:?}, bytes: {bytes}, anew: {anew}");
            assert!(same, "{what}: frame {number}, back from {now}");
        }
    }
    assert!(fields.time() > 0.0);
}

/// In 95daff4 the recipe saved the state alone, so later edits stayed, the step returned `Ok`, and the world differed.
/// World, set, settings and state together go back bit for bit by eight steps in every frame, with joints of both kinds
/// and contacts that fields answer.
#[test]
fn going_back_eight_frames_in_every_frame_gives_the_same_bits() {
    for scheme in SCHEMES {
        for detection in [Detection::Discrete, Detection::Swept] {
            go_back_in_every_frame(24, scheme, detection);
        }
    }
}

/// Loads on bodies that are held in a wind depend on those of the last two steps.
#[test]
fn bodies_that_are_slowed_and_held_go_on_from_bytes() {
    for scheme in [Scheme::KickDriftKick, Scheme::Kick] {
        let (mut world, mut fields) = crate::routes::rolling(scheme);
        let mut resumed: Vec<(PhysicsWorld, Fields)> = Vec::new();
        for step in 0..120 {
            if step % 20 == 10 {
                let back = read(&save(&world, &fields));
                let again = Fields::from_parts(back.set, back.settings, back.state);
                resumed.push((back.world, again.expect("what a step left behind")));
            }
            fields.step(&mut world).expect("a step");
            for (number, (other, again)) in resumed.iter_mut().enumerate() {
                again.step(other).expect("a step");
                assert!(bits(&world) == bits(other), "{scheme:?}, {step}, {number}");
            }
        }
    }
}

/// The same for ten seconds.
#[test]
#[ignore = "takes minutes"]
fn going_back_eight_frames_in_each_of_six_hundred_gives_the_same_bits() {
    for scheme in SCHEMES {
        for detection in [Detection::Discrete, Detection::Swept] {
            go_back_in_every_frame(600, scheme, detection);
        }
    }
}

/// A prediction makes the steps that the world makes afterwards, and leaves the world as it is.
#[test]
fn a_prediction_equals_the_later_steps() {
    for scheme in SCHEMES {
        let (mut world, mut fields) = build(scheme);
        for start in [0, 30] {
            for number in start..start + 30 {
                frame(number, &mut world, &mut fields);
            }
            let before = (bits(&world), fields.time());
            let mut ahead = fields.predict(&world);
            let (body, _) = world.bodies.iter().nth(9).expect("a body");
            let path = ahead.path(body, 20).expect("steps");
            assert_eq!(before, (bits(&world), fields.time()));
            let (mut other, mut copy) = (fields.predict(&world).world, fields.clone());
            for pose in path {
                copy.step(&mut other).expect("a step");
                assert_eq!(*other.bodies[body].position(), pose, "{scheme:?}");
            }
            let mut real = fields.predict(&world);
            for _ in 0..20 {
                fields.step(&mut world).expect("a step");
                real.step().expect("a step");
                assert_eq!(bits(&world), bits(&real.world), "{scheme:?}");
            }
            assert_eq!(bits(&world), bits(&ahead.world), "{scheme:?}");
        }
    }
}

/// The copy is known to be of the same world, even if its only body is not where the last step left it.
#[test]
fn a_world_is_predicted_after_its_only_body_was_placed_elsewhere() {
    for scheme in SCHEMES {
        let mut world = PhysicsWorld::new();
        let body = RigidBodyBuilder::dynamic().linvel(Vector::X);
        let (body, _) = world.insert(body, ColliderBuilder::ball(0.5));
        let well = Tree::from(Field::spring(2.0));
        let mut fields = Fields::builder(well)
            .scheme(scheme)
            .build()
            .expect("a field");
        fields.step(&mut world).expect("a step");
        world.bodies[body].set_translation(Vector::new(3.0, 1.0, 0.0), true);
        let mut ahead = fields.predict(&world);
        ahead.step().expect("the same world");
        fields.step(&mut world).expect("a step");
        assert_eq!(bits(&world), bits(&ahead.world), "{scheme:?}");
    }
}

/// A field has no reaction any more to a body that was disabled at the end of a step, neither in the next step nor in a
/// prediction.
#[test]
fn a_step_after_a_quarantine_is_predicted() {
    for scheme in SCHEMES {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        let ball = |x: Real, speed: Real| {
            let at = Vector::X * x;
            RigidBodyBuilder::dynamic()
                .translation(at)
                .linvel(Vector::X * speed)
        };
        let (bad, _) = world.insert(ball(0.0, 12.0), ColliderBuilder::ball(0.1));
        let (other, _) = world.insert(ball(-4.0, 0.0), ColliderBuilder::ball(0.1));
        let wall = Field::closure([], |_: &Sample| Vector::splat(Real::NAN));
        let wall = wall.within(Region::half_space(-Vector::X, -0.1));
        let pull = Field::spring(0.01).at(other).reacting();
        let mut fields = Fields::builder(wall.sum_union(pull))
            .scheme(scheme)
            .on_fault(FaultPolicy::Quarantine)
            .build()
            .expect("fields");
        let pulled = |world: &PhysicsWorld| world.bodies[other].linvel().x;
        while world.bodies[bad].is_enabled() {
            fields.step(&mut world).expect("a step");
        }
        let speed = pulled(&world);
        let mut ahead = fields.predict(&world);
        ahead.step().expect("a step");
        fields.step(&mut world).expect("a step");
        assert_eq!(bits(&world), bits(&ahead.world), "{scheme:?}");
        assert_eq!(pulled(&world), speed, "{scheme:?}");
    }
}

/// A removed body has an empty path; the prediction returns the error of its step.
#[test]
fn a_path_ends_with_its_body() {
    let (mut world, fields) = build(Scheme::KickDriftKick);
    let (gone, _) = world.bodies.iter().nth(2).expect("a body");
    world.remove_body(gone);
    assert!(
        fields
            .predict(&world)
            .path(gone, 3)
            .expect("steps")
            .is_empty()
    );
    world.integration_parameters.dt = -1.0;
    let error = fields.predict(&world).step().expect_err("a step back");
    assert!(matches!(error, StepError::TimeStep { .. }), "{error}");
}

/// Changes a pile before a frame, after the last step of the fields.
fn meddle(frame: u64, world: &mut PhysicsWorld) {
    let bodies: Vec<_> = world.bodies.iter().map(|(handle, _)| handle).collect();
    let body = bodies[1 + frame as usize % (bodies.len() - 1)];
    let high = Vector::new(0.0, 9.0, (frame % 7) as Real);
    match frame % 9 {
        // A step without fields.
        1 | 2 => world.step(),
        3 => world.bodies[body].set_translation(high, true),
        // A flying body gets the slot in the arena of one that lay on others.
        4 => {
            world.remove_body(body);
            let other = RigidBodyBuilder::dynamic().translation(high);
            world.insert(other, ColliderBuilder::cuboid(0.5, 0.4, 0.3));
        }
        5 => world.bodies[body].wake_up(true),
        6 => world.bodies[body].sleep(),
        // A body is moved, and a step without fields follows.
        7 => {
            world.bodies[body].set_translation(high, true);
            world.step();
        }
        _ => {}
    }
}

/// The contacts that a step found are used by the next one, but only if no other step was made in between.
#[test]
fn contacts_are_those_of_the_last_step_of_rapier() {
    let wind = Field::wind(Vector::X * 3.0, 0.3, 0.0);
    let trees = [Tree::from(wind), Field::uniform(Vector::X * 0.3).into()];
    for (scheme, tree) in SCHEMES
        .iter()
        .flat_map(|it| trees.iter().map(move |tree| (*it, tree)))
    {
        let mut world = PhysicsWorld::new();
        let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        world.insert(floor, ColliderBuilder::cuboid(30.0, 0.5, 30.0));
        for k in 0..8 {
            let at = Vector::new(
                0.1 * k as Real,
                0.4 + 0.85 * (k / 2) as Real,
                (k % 2) as Real,
            );
            let body = RigidBodyBuilder::dynamic().translation(at);
            world.insert(body, ColliderBuilder::cuboid(0.5, 0.4, 0.3));
        }
        let fields = Fields::builder(tree.clone()).scheme(scheme).build();
        let mut fields = fields.expect("a valid tree");
        let mut fresh = fields.clone();
        for number in 0..150 {
            meddle(number, &mut world);
            // Other fields make the same step with the state alone, without buffers of the last step.
            let mut other = fields.predict(&world).world;
            fresh.state = fields.state.clone();
            fields.step(&mut world).expect("a step");
            fresh.step(&mut other).expect("a step");
            assert!(
                bits(&world) == bits(&other),
                "{scheme:?}, frame {number}: {tree:?}"
            );
        }
    }
}
