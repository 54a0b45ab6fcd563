//! A run that is saved and restored goes on bit for bit like the uninterrupted one: the world by Rapier's own serde,
//! its fields by a snapshot.

use std::time::{Duration, Instant};

use crate::lab::scenes::ammonia::AmmoniaSettings;
use crate::lab::scenes::flock::FlockSettings;
use crate::lab::scenes::spheres::SpheresSettings;
use ciborium::Value;
use rapier3d_fields::prelude::*;

use crate::support::bits::bits;
use crate::support::formats::{FORMATS, Format};

type Run = (PhysicsWorld, Fields);

/// The run, written and read again, with a fresh pipeline. Rapier's world is always in postcard, which it can read.
fn restored((world, fields): &Run, format: Format) -> Run {
    let world = Format::Postcard.write(world).expect("what can be written");
    let world = Format::Postcard.read(&world).expect("what was written");
    let saved = (&fields.set, &fields.settings, &fields.state);
    let saved = format.write(&saved).expect("fields without code");
    let (set, settings, state) = format.read(&saved).expect("what was written");
    let fields = Fields::from_parts(set, settings, state).expect("the fields of this world");
    (world, fields)
}

fn step((world, fields): &mut Run) {
    fields.step(world).expect("a step");
}

/// Results of the last step besides the state of the bodies.
fn results((world, fields): &Run) -> Vec<u64> {
    let handles = world.bodies.iter().map(|(handle, _)| handle);
    let wrenches = handles.filter_map(|body| fields.wrench(body));
    let numbers = wrenches.flat_map(|w| [w.force.to_array(), w.torque.to_array()].concat());
    let bits = numbers.map(|x| rapier3d_fields::math::to_f64(x).to_bits());
    let contacts = fields.contacts().len() as u64;
    bits.chain([contacts, fields.time().to_bits()]).collect()
}

/// Saves and restores a run after each of these numbers of steps, and compares until `steps` after the last.
#[track_caller]
fn goes_on(what: &str, build: impl Fn() -> Run, interrupted_after: &[usize], steps: usize) {
    let mut whole = build();
    let mut others: Vec<(usize, Run)> = Vec::new();
    let last = interrupted_after.iter().max().copied().unwrap_or(0);
    for now in 0..last + steps {
        if interrupted_after.contains(&now) {
            others.extend(FORMATS.map(|format| (now, restored(&whole, format))));
        }
        step(&mut whole);
        for (after, other) in &mut others {
            step(other);
            let place = format!(
                "{what}: saved after {after} steps, differs after {}",
                now + 1
            );
            assert_eq!(bits(&whole.0), bits(&other.0), "{place}");
            assert_eq!(results(&whole), results(other), "{place}");
        }
    }
}

fn ammonia(scheme: Scheme, detection: Detection) -> Run {
    let settings = AmmoniaSettings {
        count: 20,
        ..AmmoniaSettings::default()
    };
    let scene = settings.build().expect("valid settings");
    // These are refused where fields answer hits, unless all fields are constant.
    let one = [
        Scheme::Kick,
        Scheme::ExternalForce,
        Scheme::LinearlyImplicit,
    ];
    let law = if one.contains(&scheme) {
        ContactLaw::Observe
    } else {
        ContactLaw::elastic()
    };
    let tree = scene.tree(Some(8.0), law);
    let builder = Fields::builder(tree).scheme(scheme).detection(detection);
    let fields = scene.fields(builder).expect("a valid tree");
    (scene.world, fields)
}

fn schemes() -> [Scheme; 7] {
    [
        Scheme::KickDriftKick,
        Scheme::Kick,
        Scheme::ExternalForce,
        Scheme::substeps(3),
        Scheme::LinearlyImplicit,
        Scheme::Forward4,
        Scheme::auto(1e-3),
    ]
}

#[test]
fn molecules_are_restored_under_every_scheme() {
    for scheme in schemes() {
        let build = || ammonia(scheme, Detection::Discrete);
        goes_on(&format!("{scheme:?}"), build, &[0, 1, 40], 40);
    }
}

#[test]
fn swept_detection_and_impulses_are_restored() {
    let build = || ammonia(Scheme::KickDriftKick, Detection::Swept);
    goes_on("ammonia", build, &[7, 60], 60);
    let build = || {
        let settings = SpheresSettings {
            speed: 8.0,
            ..SpheresSettings::default()
        };
        let scene = settings.build().expect("valid settings");
        let law = ContactLaw::restitution(0.9).with_friction(0.3);
        let fields = Fields::builder(scene.tree(law)).detection(Detection::Swept);
        (
            scene.world,
            fields.cross_check(true).build().expect("a valid tree"),
        )
    };
    goes_on("spheres", build, &[1, 50, 133], 200);
}

/// Where fields read velocities, a step begins with the evaluation of the end of the last step, before its second half
/// kick: evaluating the restored world would give another.
#[test]
fn forces_that_read_velocities_are_restored() {
    for scheme in schemes() {
        let build = || {
            let mut world = PhysicsWorld::new();
            for k in 0..6 {
                let turn = Real::from(k as u8);
                let body = RigidBodyBuilder::dynamic()
                    .translation(Vector::new(2.0 * turn, 1.0, 0.0))
                    .linvel(Vector::new(0.3, turn, -1.0))
                    .angvel(Vector::new(1.0, 0.2 * turn, 3.0));
                world.insert(body, ColliderBuilder::cuboid(0.3, 0.5, 0.2).mass(1.5));
            }
            let tree = Field::magnetic(Vector::new(0.3, 2.0, 0.1))
                .coupled_to(rapier3d_fields::Coupling::Each)
                .sum_union(Field::wind(Vector::X * 3.0, 0.4, 0.2))
                .sum_union(Field::spring(30.0).at(Vector::Y));
            let fields = Fields::builder(tree).scheme(scheme).build();
            (world, fields.expect("a valid tree"))
        };
        goes_on(&format!("{scheme:?}"), build, &[1, 33], 60);
    }
}

/// Bodies sleep on a floor in a field that changes little, until it changes more: the wrench under which they fell
/// asleep must be restored, too.
#[test]
fn sleeping_bodies_are_restored_and_wake_alike() {
    let build = || {
        let mut world = PhysicsWorld::new();
        world.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::cuboid(10.0, 0.5, 10.0),
        );
        for k in 0..3 {
            let body = RigidBodyBuilder::dynamic().translation(Vector::new(
                3.0 * Real::from(k as u8),
                1.0,
                0.0,
            ));
            world.insert(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
        }
        // 1 until time 2, then a ramp to 10 at time 4.
        let slowly = Scalar::axis("time").ramp(-100.0, 0.0).plus(
            Scalar::axis("time")
                .ramp(2.0, 4.0)
                .times(Scalar::constant(9.0)),
        );
        let push = Field::uniform(Vector::X * 0.5).scaled_by(slowly);
        let policy = WakePolicy::OnChange { fraction: 0.5 };
        let fields = Fields::builder(push).wake(policy).build();
        (world, fields.expect("a valid tree"))
    };
    let mut run = build();
    let (mut slept, mut woke) = (false, false);
    for _ in 0..300 {
        step(&mut run);
        let asleep = run.0.bodies.iter().filter(|(_, body)| body.is_sleeping());
        let asleep = asleep.count();
        slept |= asleep >= 3;
        woke |= slept && asleep < 3;
    }
    assert!(slept && woke, "they fall asleep: {slept}, and wake: {woke}");
    goes_on("sleepers", build, &[20, 90, 120, 140, 200], 100);
}

#[test]
fn a_flock_with_path_gust_and_contacts_is_restored() {
    let build = || {
        let flock = FlockSettings {
            gust_start: 0.2,
            ..FlockSettings::default()
        };
        let flock = flock.build().expect("valid settings");
        (flock.world, Fields::new(flock.tree).expect("a valid tree"))
    };
    goes_on("flock", build, &[10, 100], 150);
}

#[test]
fn sampling_within_bodies_and_stiff_wells_are_restored() {
    let build = |scheme| {
        move || {
            let mut world = PhysicsWorld::new();
            let mut bodies = Vec::new();
            for k in 0..4 {
                let body = RigidBodyBuilder::dynamic()
                    .translation(Vector::new(Real::from(k as u8), 0.2, 0.0))
                    .angvel(Vector::Z);
                bodies.push(world.insert(body, ColliderBuilder::cuboid(0.4, 0.3, 0.2)).0);
            }
            let half = Region::half_space(Vector::X, 1.5);
            let wind = Field::uniform(Vector::Y * 9.0)
                .within(half)
                .sampled(Sampling::Volume);
            let well = Field::spring(4000.0).within(Region::ball(2.0));
            let tree = wind.sum_union(well).sum_union(Field::buoyancy(0.5, 9.81));
            let fields = Fields::builder(tree).scheme(scheme).build();
            let mut fields = fields.expect("a valid tree");
            let set = fields.set_sampling(bodies[1], Sampling::Volume, &world.bodies);
            set.expect("a body of this world");
            (world, fields)
        }
    };
    for scheme in [Scheme::KickDriftKick, Scheme::auto(1e-3)] {
        goes_on(&format!("{scheme:?}"), build(scheme), &[3, 30], 40);
    }
}

/// After a body was removed and another added, handles have other generations.
#[test]
fn handles_of_any_generation_are_restored() {
    let build = || {
        let (mut world, _) = ammonia(Scheme::Kick, Detection::Discrete);
        let first = world.bodies.iter().nth(3).expect("many bodies").0;
        world.remove_body(first);
        let body = RigidBodyBuilder::dynamic().translation(Vector::splat(0.5));
        let (star, _) = world.insert(body, ColliderBuilder::ball(0.2).mass(50.0));
        let tree = Field::point_gravity(100.0)
            .softened(1.0)
            .at(star)
            .named("star");
        (world, Fields::new(tree).expect("a valid tree"))
    };
    goes_on("star", build, &[2, 20], 40);
}

/// A field of the second tree is edited after a step of the restored run, which has evaluated all trees by then.
#[test]
fn an_edit_after_a_reload_is_followed() {
    let mut run = (
        PhysicsWorld::new(),
        Fields::new(Field::uniform(Vector::X)).expect("valid"),
    );
    let body = RigidBodyBuilder::dynamic().additional_mass(2.0);
    let body = run.0.insert_body(body);
    let wind = Field::uniform(Vector::Y).within(Region::ball(9.0));
    let wind = run.1.set.insert_field(wind);
    step(&mut run);
    let mut other = restored(&run, Format::Json);
    for run in [&mut run, &mut other] {
        step(run);
        run.1.set.get_mut(wind).expect("the field").strength = 3.0;
        step(run);
        let wrench = run.1.wrench(body).expect("a wrench");
        assert_eq!(wrench.force, Vector::new(1.0, 3.0, 0.0));
    }
}

#[test]
fn closures_without_a_name_are_not_written() {
    let field = Field::closure([], |_: &rapier3d_fields::Sample| Vector::X).named("mine");
    let fields = Fields::new(field).expect("a valid tree");
    for format in FORMATS {
        let error = format
            .write(&fields.set)
            .expect_err("a closure without a name");
        // Postcard's errors have no details.
        let told = format == Format::Postcard || error.contains("closure");
        assert!(told, "{format:?}: {error}");
    }
}

#[test]
fn a_damaged_snapshot_is_an_error_or_runs() {
    let mut run = ammonia(Scheme::KickDriftKick, Detection::Discrete);
    step(&mut run);
    let saved = (&run.1.set, &run.1.settings, &run.1.state);
    for format in FORMATS {
        let saved = format.write(&saved).expect("fields without code");
        type Parts = (FieldSet, FieldSettings, FieldState);
        for cut in [0, 1, saved.len() / 2, saved.len() - 1] {
            let read: Result<Parts, _> = format.read(&saved[..cut]);
            assert!(read.is_err(), "{format:?}, cut after {cut} bytes");
        }
        // The anchors of these fields do not exist in another world.
        let (set, settings, state): Parts = format.read(&saved).expect("what was written");
        let mut empty = PhysicsWorld::new();
        let mut fields = Fields::from_parts(set, settings, state).expect("sound parts");
        let error = fields
            .step(&mut empty)
            .expect_err("a world that is not theirs");
        assert!(matches!(error, StepError::OtherWorld { .. }), "{error}");
    }
}

/// At commit 95daff4 `StepError::State` had no text, paces below zero or NaN were accepted, and a step from one took 70
/// s. Now the error names the value, and a state that is finite and in order runs, in at most a second a step, in every
/// format.
///
/// `DAMAGED=20000` tries 20,000 states.
#[test]
fn a_damaged_state_is_refused_or_runs() {
    let tried = std::env::var("DAMAGED").ok().and_then(|it| it.parse().ok());
    let tried: usize = tried.unwrap_or(200);
    let mut random = crate::lab::random::Random::new(11);
    for scheme in [Scheme::auto(1e-3), Scheme::KickDriftKick] {
        let mut run = ammonia(scheme, Detection::Discrete);
        let well = Field::spring(4000.0).within(Region::ball(2.0));
        run.1.set.insert_field(well);
        run.1.set.insert_field(Field::drag(0.3, 0.1));
        for _ in 0..3 {
            step(&mut run);
        }
        for format in FORMATS {
            let saved = format.write(&run.1.state).expect("plain data");
            let (mut refused, mut ran, mut longest) = (0, 0, Duration::ZERO);
            for _ in 0..tried / FORMATS.len() {
                let mut damaged = saved.clone();
                let place = (random.uniform() * saved.len() as f64) as usize;
                damaged[place] ^= 1 << (random.uniform() * 8.0) as u32;
                let Ok(state) = format.read::<FieldState>(&damaged) else {
                    continue;
                };
                let (set, settings) = (run.1.set.clone(), run.1.settings.clone());
                let mut copy = run.1.predict(&run.0).world;
                match Fields::from_parts(set, settings, state) {
                    Err(error) => {
                        assert!(matches!(error, StepError::State { .. }), "{error}");
                        refused += 1;
                    }
                    Ok(mut fields) => {
                        let start = Instant::now();
                        ran += usize::from(fields.step(&mut copy).is_ok());
                        longest = longest.max(start.elapsed());
                    }
                }
            }
            println!("{scheme:?}, {format:?}: {refused} refused, {ran} ran in {longest:?} at most");
            assert!(ran > 0, "{scheme:?}, {format:?}");
            let most = Duration::from_secs(1);
            assert!(longest < most, "{scheme:?}, {format:?}: {longest:?}");
        }
    }
}

/// The value at a path of names and indices, separated by dots.
fn at<'a>(value: &'a mut Value, path: &str) -> &'a mut Value {
    path.split('.').fold(value, |value, name| match value {
        Value::Map(entries) => {
            let named = |(key, _): &&mut (Value, Value)| key.as_text() == Some(name);
            let entry = entries.iter_mut().find(named);
            &mut entry.unwrap_or_else(|| panic!("no {name} of {path}")).1
        }
        Value::Array(entries) => {
            let place: usize = name.parse().expect("a place");
            &mut entries[place]
        }
        other => panic!("no {name} of {path} in {other:?}"),
    })
}

/// The floating-point numbers in a value, at any depth.
fn floats(value: &mut Value) -> Vec<&mut f64> {
    match value {
        Value::Float(number) => vec![number],
        Value::Array(entries) => entries.iter_mut().flat_map(floats).collect(),
        Value::Map(entries) => entries
            .iter_mut()
            .flat_map(|it| floats(&mut it.1))
            .collect(),
        _ => Vec::new(),
    }
}

fn pop(value: &mut Value, list: &str) {
    let last = at(value, list).as_array_mut().and_then(Vec::pop);
    assert!(last.is_some(), "{list} is empty");
}

/// The error by which a state is refused after one change.
fn refused(run: &Run, what: &str, damage: impl FnOnce(&mut Value)) -> String {
    let saved = Format::Cbor.write(&run.1.state).expect("plain data");
    let mut value: Value = Format::Cbor.read(&saved).expect("what was written");
    damage(&mut value);
    let damaged = Format::Cbor.write(&value).expect("plain data");
    let state = Format::Cbor.read(&damaged).expect("a state");
    let parts = (run.1.set.clone(), run.1.settings.clone());
    let error = Fields::from_parts(parts.0, parts.1, state).err();
    let error = error.unwrap_or_else(|| panic!("{what} is not refused"));
    assert!(matches!(error, StepError::State { .. }), "{error}");
    error.to_string()
}

/// Molecules that turn, in a stiff well and a drag.
fn stiff_run(scheme: Scheme) -> Run {
    let mut run = ammonia(scheme, Detection::Discrete);
    let well = Field::spring(4e5).within(Region::ball(20.0));
    run.1.set.insert_field(well);
    run.1.set.insert_field(Field::drag(0.3, 0.1));
    for _ in 0..3 {
        step(&mut run);
    }
    run
}

/// A state that no step can leave is refused, and the error names the value.
#[test]
fn a_state_that_no_step_can_leave_is_refused_by_value() {
    let run = stiff_run(Scheme::auto(1e-3));
    type Damage = fn(&mut Value);
    let damages: [(&str, Damage); 6] = [
        ("dt is -1", |it| {
            *at(it, "evaluation.dt") = (-1.0_f64).into()
        }),
        ("place 999", |it| {
            *at(it, "evaluation.stiff_methods.0.0") = 999_i32.into();
        }),
        ("omega2: -1.0", |it| {
            *at(it, "evaluation.stiff_methods.0.1.Resolve.path_rate.omega2") = (-1.0_f64).into();
        }),
        ("scale: -1.0", |it| {
            *at(it, "evaluation.stiff_methods.0.1.Resolve.balance.scale") = (-1.0_f64).into();
        }),
        ("wrenches has", |it| pop(it, "evaluation.wrenches")),
        ("records has", |it| pop(it, "records")),
    ];
    for (told, damage) in damages {
        let error = refused(&run, told, damage);
        assert!(error.contains(told), "{error}\nlacks {told}");
    }
}

/// A box on a floor that bounces, drawn by a spring on a kinematic body.
fn bouncing_run() -> Run {
    let mut world = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed();
    let (_, floor) = world.insert(floor, ColliderBuilder::cuboid(9.0, 0.5, 9.0));
    let chest = RigidBodyBuilder::dynamic().translation(Vector::Y * 1.05);
    world.insert(chest, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    let led = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::X);
    let (led, _) = world.insert(led.translation(Vector::Z * 5.0), ColliderBuilder::ball(0.5));
    let law = ContactLaw::restitution(0.5).with_friction(0.5);
    let tree = Field::spring(2.0).at(led) + Field::drag(0.3, 0.0) + Field::contact(law).at(floor);
    let fields = Fields::new(tree).expect("a valid tree");
    (world, fields)
}

/// A box that falls asleep on a floor, in a wind.
fn parked_run() -> Run {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed(),
        ColliderBuilder::cuboid(9.0, 0.5, 9.0),
    );
    let chest = RigidBodyBuilder::dynamic().translation(Vector::Y);
    world.insert(chest, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    let wind = Field::uniform(Vector::X * 0.1).within(Region::ball(50.0));
    let fields = Fields::new(wind).expect("a valid tree");
    (world, fields)
}

/// One NaN in a state is refused, and the error names the list that holds it. Of long lists, forty numbers are tried.
#[test]
fn a_nan_in_a_state_is_refused_by_the_name_of_its_list() {
    let nan_in = |run: &Run, path: &str| {
        let saved = Format::Cbor.write(&run.1.state).expect("plain data");
        let mut saved: Value = Format::Cbor.read(&saved).expect("what was written");
        let count = floats(at(&mut saved, path)).len();
        assert!(count > 0, "no number in {path}");
        for number in (0..count).step_by(count.div_ceil(40)) {
            let error = refused(run, &format!("{path}, number {number}"), |value| {
                *floats(at(value, path))[number] = f64::NAN;
            });
            let list = path.split('.').next_back().expect("a name");
            assert!(error.contains(list), "{path}: {error}");
        }
    };
    let stiff = stiff_run(Scheme::auto(1e-3));
    for path in ["time", "evaluation.dt", "records", "evaluation.wrenches"] {
        nan_in(&stiff, path);
    }
    for path in ["evaluation.stiff_methods", "evaluation.couplings"] {
        nan_in(&stiff, path);
    }
    nan_in(&stiff_run(Scheme::Kick), "evaluation.centres");
    nan_in(&stiff_run(Scheme::LinearlyImplicit), "evaluation.estimates");
    let runs = [
        (bouncing_run(), &["carriers", "hand_over", "reactions"][..]),
        (parked_run(), &["drowsing", "resting"]),
    ];
    for (mut run, lists) in runs {
        let mut given = Vec::new();
        for _ in 0..60 {
            step(&mut run);
            let saved = serde_json::to_value(&run.1.state).expect("plain data");
            let some = |list: &str| saved[list].as_array().is_some_and(|it| !it.is_empty());
            for list in lists.iter().filter(|list| some(list)) {
                if !given.contains(list) {
                    nan_in(&run, list);
                    given.push(list);
                }
            }
        }
        assert_eq!(given.len(), lists.len(), "{given:?}");
    }
}

/// A set whose lists do not fit together is refused when it is read.
#[test]
fn a_set_whose_lists_disagree_is_refused() {
    let mut set = FieldSet::new();
    let pair = || Tree::from(Field::uniform(Vector::X)).replace_union(Field::spring(1.0));
    let gone = set.insert(pair());
    set.insert(pair());
    set.insert_field(Field::uniform(Vector::Y));
    set.insert(pair());
    drop(set.remove(gone));
    let saved = Format::Cbor.write(&set).expect("plain data");
    let whole: Value = Format::Cbor.read(&saved).expect("what was written");
    type Damage = fn(&mut Value);
    let damages: [(&str, Damage); 9] = [
        ("no damage", |_| ()),
        ("generations", |it| pop(it, "generations")),
        ("a free node", |it| {
            let used = at(it, "terms.0.root").clone();
            *at(it, "free.0") = used;
        }),
        ("a root", |it| *at(it, "terms.0.root") = 99_i32.into()),
        ("a tree", |it| *at(it, "terms.0.tree") = 99_i32.into()),
        ("a serial", |it| {
            let next = at(it, "next_serial").clone();
            *at(it, "terms.2.serial") = next;
        }),
        ("the order", |it| {
            let terms = at(it, "terms").as_array_mut();
            terms.expect("a list").swap(0, 1);
        }),
        ("a tree's term", |it| {
            *at(it, "trees.1.terms.0") = 99_i32.into();
        }),
        ("a free tree", |it| *at(it, "free_trees.0") = 1_i32.into()),
    ];
    for (what, damage) in damages {
        let mut value = whole.clone();
        damage(&mut value);
        let damaged = Format::Cbor.write(&value).expect("plain data");
        let read: Result<FieldSet, String> = Format::Cbor.read(&damaged);
        assert_eq!(read.is_ok(), what == "no damage", "{what}: {read:?}");
    }
}
