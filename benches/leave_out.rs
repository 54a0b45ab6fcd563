//! The cost of parts that a scene does not use, which must be none: each scene beside the same one without the part.
//!
//! `cargo bench --bench leave_out [-- NAME]`. In each round every variant makes a stretch of steps, in rotating order;
//! a ratio is of two stretches of one round. Prints medians, and quartiles of the ratios to the first variant.

mod paired;

use paired::{Variant, alone, balls, compare, variant, with};
use rapier3d_fields::Detection;
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::pipeline::PhysicsHooks;
use rapier3d_fields_lab::single::scenes::spheres::SpheresSettings;
use std::hint::black_box;

/// Fields out of reach of all bodies.
fn out_of_reach(count: usize) -> Vec<Variant> {
    let far = Field::point_gravity(1.0).within(Region::ball(10.0));
    let zones = (0..100).map(|i| {
        let zone = Field::drag(1.0, 0.0).within(Region::ball(10.0));
        zone.at(Vector::X * (1e4 + 100.0 * i as Real))
    });
    let zones = Tree::fold(Operator::SumUnion, zones);
    let kdk = Scheme::KickDriftKick;
    vec![
        alone(balls(count)),
        with(
            "one far field",
            balls(count),
            far.at(Vector::X * 1e4),
            Scheme::default(),
        ),
        with("100 far zones", balls(count), zones, kdk),
    ]
}

/// Bodies that have come to rest on a floor under gravity and, if one is given, a field.
fn asleep(count: usize, boxes: bool, tree: Option<Tree>) -> (PhysicsWorld, Fields) {
    let mut world = PhysicsWorld::new();
    let side = (count as f64).sqrt().ceil() as usize;
    let half = 2.0 * side as Real;
    world.insert_collider(
        ColliderBuilder::cuboid(half, 1.0, half).translation(Vector::Y * -1.0),
        None,
    );
    for i in 0..count {
        let cell = Vector::new((i % side) as Real, 0.0, (i / side) as Real);
        let place = cell * 3.0 - Vector::new(half * 0.75, -0.5, half * 0.75);
        let body = RigidBodyBuilder::dynamic().translation(place);
        let shape = match boxes {
            true => ColliderBuilder::cuboid(0.5, 0.5, 0.5),
            false => ColliderBuilder::ball(0.5),
        };
        world.insert(body, shape);
    }
    // A field of strength zero acts on no body.
    let tree = tree.unwrap_or_else(|| Field::uniform(Vector::ZERO).into());
    let mut fields = Fields::new(tree).expect("a sound tree");
    for _ in 0..600 {
        fields.step(&mut world).expect("finite fields");
    }
    let awake = world.bodies.iter().filter(|(_, body)| !body.is_sleeping());
    assert_eq!(awake.count(), 0, "everything came to rest");
    (world, fields)
}

fn sleeping(count: usize, boxes: bool, tree: Tree) -> Vec<Variant> {
    let (mut world, mut fields) = asleep(count, boxes, Some(tree));
    vec![
        alone(asleep(count, boxes, None).0),
        variant("one unchanged field", move || {
            fields.step(&mut world).expect("finite fields");
        }),
    ]
}

/// A world of a hundred balls among `leaves` small zones, one of which is edited before each step.
fn edits(leaves: usize) -> Vec<Variant> {
    let place = |k: usize| {
        let [x, y, z] = [k % 100, k / 100 % 100, k / 10_000].map(|n| 3.0 * n as Real);
        Vector::new(x, y, z)
    };
    let leaf = move |k: usize| {
        let zone = Region::ball(1.4);
        Field::radial((1.0 + k as Real) * 1e-9, -2.0)
            .within(zone)
            .at(place(k))
    };
    type Edit = fn(&mut FieldSet, FieldHandle, &dyn Fn(usize) -> Field, usize);
    let edited = move |name: &'static str, edit: Edit| {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        for k in 0..100 {
            let at = Vector::new(3.0 * k as Real, 0.2, 15.0);
            let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
            world.insert(body, ColliderBuilder::ball(0.3));
        }
        let tree = Tree::fold(Operator::SumUnion, (0..leaves).map(leaf));
        let mut fields = Fields::new(tree).expect("a sound tree");
        let handles: Vec<_> = fields.set.iter().map(|(handle, _)| handle).collect();
        let mut count = 0;
        variant(name, move || {
            count += 1;
            let handle = handles[(count * 2411 + 7) % leaves];
            edit(&mut fields.set, handle, &leaf, count);
            fields.step(&mut world).expect("finite fields");
        })
    };
    vec![
        edited("no edit", |_, _, _, _| ()),
        edited("strength of one", |set, handle, _, count| {
            set[handle].strength = 1.0 + 1e-3 * count as Real;
        }),
        edited("place of one", |set, handle, _, count| {
            let along = Vector::X * (1e-3 * count as Real);
            set[handle].anchor = along.into();
        }),
        edited("one switched", |set, handle, _, _| {
            set[handle].enabled = !set[handle].enabled;
        }),
        edited("one added", |set, _, leaf, count| {
            black_box(set.insert_field(leaf(count)));
        }),
        edited("one removed, one added", |set, handle, leaf, count| {
            if set.remove_field(handle).is_some() {
                black_box(set.insert_field(leaf(count)));
            }
        }),
    ]
}

/// The cost of `Auto` without stiff bodies, and with some.
fn choice(count: usize) -> Vec<Variant> {
    let soft = || Field::spring(1.0).force_mode(ForceMode::Acceleration);
    // dt·ω is 0.017, and 10 for the few bodies within the ball-shaped region of the stiff field.
    let stiff = Field::spring(3.6e5).within(Region::ball(12.0));
    let partly = soft().sum_union(stiff.force_mode(ForceMode::Acceleration));
    let auto = Scheme::auto(1e-2);
    let schemes = [
        ("kick-drift-kick", Scheme::KickDriftKick),
        ("auto", auto),
        ("4 substeps", Scheme::substeps(4)),
        ("fourth order", Scheme::Forward4),
        ("linearly implicit", Scheme::LinearlyImplicit),
    ];
    let each = schemes.map(|(name, scheme)| with(name, balls(count), soft(), scheme));
    let some = with("stiff for some, auto", balls(count), partly, auto);
    each.into_iter().chain([some]).collect()
}

/// The cost of second order if forces depend on velocities: a derivative and a linear equation for each body.
fn drag(count: usize) -> Vec<Variant> {
    let moving = || {
        let mut world = balls(count);
        for (_, body) in world.bodies.iter_mut() {
            body.set_linvel(Vector::X, true);
        }
        world
    };
    let drag = || Field::drag(0.1, 0.0);
    vec![
        with("kick", moving(), drag(), Scheme::Kick),
        with("kick-drift-kick", moving(), drag(), Scheme::KickDriftKick),
    ]
}

/// The cost of Rapier's change tracking: its next step takes longer if bodies were written to. Velocities are written
/// as they are, so that nothing else differs.
fn change_tracking(count: usize) -> Vec<Variant> {
    let touched = |name, every: usize| {
        let mut world = balls(count);
        let handles: Vec<_> = world.bodies.iter().map(|(handle, _)| handle).collect();
        variant(name, move || {
            for handle in handles.iter().step_by(every) {
                let body = &mut world.bodies[*handle];
                let linvel = body.linvel();
                body.set_linvel(linvel, false);
            }
            world.step();
        })
    };
    vec![
        alone(balls(count)),
        touched("one written", count),
        touched("half written", 2),
        touched("all written", 1),
    ]
}

/// A pyramid of boxes, or a heap of `heap` bodies of six shapes between walls; and the handles of all colliders.
fn piled(heap: Option<u16>, sleeps: bool) -> (PhysicsWorld, Vec<ColliderHandle>) {
    let mut world = PhysicsWorld::new();
    let slab = |x, y, z| ColliderBuilder::cuboid(x, y, z).friction(0.5);
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
    world.insert(floor, slab(30.0, 0.5, 30.0));
    let (side, wide) = match heap {
        Some(count) if count > 100 => (6, 4.2),
        _ => (4, 3.0),
    };
    for (x, z) in [(wide, 0.0), (-wide, 0.0), (0.0, wide), (0.0, -wide)] {
        let half = |along: Real| if along == 0.0 { wide + 0.5 } else { 0.5 };
        let wall = RigidBodyBuilder::fixed().translation(Vector::new(x, 10.0, z));
        if heap.is_some() {
            world.insert(wall, slab(half(x), 10.0, half(z)));
        }
    }
    let places: Vec<Vector> = if let Some(count) = heap {
        let middle = 0.5 * Real::from(side - 1);
        let along = |number: u16| (Real::from(number % side) - middle) * 1.1;
        let height = |number| Real::from(number / side / side) * 1.3 + 1.0;
        let place = |number| Vector::new(along(number), height(number), along(number / side));
        (0..count).map(place).collect()
    } else {
        let rows = (0..6_u8).flat_map(|row| (0..6 - row).map(move |number| (row, number)));
        let place = |(row, number): (u8, u8)| {
            let (row, number) = (Real::from(row), Real::from(number));
            Vector::new(number * 1.05 + row * 0.525, row + 0.5, 0.0)
        };
        rows.map(place).collect()
    };
    let corners = [Vector::X, Vector::Y, Vector::Z, -Vector::ONE].map(|corner| corner * 0.6);
    for (number, place) in places.into_iter().enumerate() {
        let collider = match number % 6 {
            _ if heap.is_none() => ColliderBuilder::cuboid(0.5, 0.5, 0.5),
            0 => ColliderBuilder::ball(0.45),
            1 => ColliderBuilder::cuboid(0.4, 0.45, 0.5),
            2 => ColliderBuilder::capsule_y(0.3, 0.3),
            3 => ColliderBuilder::cylinder(0.4, 0.4),
            4 => ColliderBuilder::cone(0.5, 0.45),
            _ => ColliderBuilder::convex_hull(&corners).expect("a hull"),
        };
        let body = RigidBodyBuilder::dynamic()
            .translation(place)
            .can_sleep(sleeps);
        world.insert(body, collider.friction(0.5));
    }
    let colliders = world.colliders.iter().map(|(handle, _)| handle).collect();
    (world, colliders)
}

/// Hooks that change nothing.
struct Idle;

impl PhysicsHooks for Idle {}

/// A world without fields, with idle hooks on all contacts, and with fields that answer them, after `before` steps.
fn answered(
    world: &dyn Fn() -> (PhysicsWorld, Vec<ColliderHandle>),
    law: ContactLaw,
    before: usize,
) -> Vec<Variant> {
    let listened = |name, hooks| {
        let (mut world, colliders) = world();
        for collider in colliders {
            world.colliders[collider].set_active_hooks(hooks);
        }
        (0..before).for_each(|_| world.step_with_events(&Idle, &()));
        variant(name, move || world.step_with_events(&Idle, &()))
    };
    let fields = |name, detection, check| {
        let (mut world, colliders) = world();
        let contact = |collider| Tree::from(Field::contact(law).at(collider));
        let tree = Tree::fold(Operator::SumUnion, colliders.into_iter().map(contact));
        let builder = Fields::builder(tree).detection(detection);
        let mut fields = builder.cross_check(check).build().expect("a sound tree");
        let mut step = move || {
            fields.step(&mut world).expect("finite fields");
        };
        (0..before).for_each(|_| step());
        variant(name, step)
    };
    let all = ActiveHooks::MODIFY_SOLVER_CONTACTS;
    let (discrete, swept) = (Detection::Discrete, Detection::Swept);
    vec![
        listened("Rapier alone", ActiveHooks::empty()),
        listened("hooks that do nothing", all),
        fields("fields, discrete", discrete, false),
        fields("fields, swept", swept, false),
        fields("fields, discrete, cross-checked", discrete, true),
        fields("fields, swept, cross-checked", swept, true),
    ]
}

/// Bodies that rest, or come to rest within some seconds.
fn contacts(heap: Option<u16>, sleeps: bool) -> Vec<Variant> {
    let law = ContactLaw::restitution(0.0).with_friction(0.5);
    // A heap of 200 is asleep after 13 s in the median, some heaps much later.
    let settling = if sleeps { 1800 } else { 600 };
    answered(&|| piled(heap, sleeps), law, settling)
}

/// Elastic balls in a closed box, without gravity.
fn gas(count: usize, half_extent: Real) -> Vec<Variant> {
    let settings = SpheresSettings {
        count,
        half_extent,
        ..SpheresSettings::default()
    };
    let world = || {
        let scene = settings.build().expect("the settings are in range");
        let spheres = scene.spheres.iter().map(|(_, collider)| *collider);
        let colliders = spheres.chain(scene.walls).collect();
        (scene.world, colliders)
    };
    answered(&world, ContactLaw::elastic(), 20)
}

type MakeShape = fn() -> SharedShape;

/// Makers of shapes: no two bodies share one.
const SHAPES: [(&str, MakeShape); 5] = [
    ("balls", || SharedShape::ball(0.5)),
    ("cubes", || SharedShape::cuboid(0.5, 0.5, 0.5)),
    ("capsules", || SharedShape::capsule_y(0.4, 0.3)),
    ("cylinders", || SharedShape::cylinder(0.5, 0.4)),
    ("hulls", || {
        let corners = [0.0, 2.1, 4.2].map(|turn: Real| Vector::new(turn.cos(), -0.4, turn.sin()));
        SharedShape::convex_hull(&[corners.as_slice(), &[Vector::Y]].concat()).expect("a hull")
    }),
];

fn insert_shape(world: &mut PhysicsWorld, number: usize, shape: SharedShape) -> RigidBodyHandle {
    let cell = [number % 20, number / 20 % 20, number / 400].map(|n| n as Real);
    let body = RigidBodyBuilder::dynamic().translation(Vector::from_array(cell) * 3.0);
    world
        .insert(body.can_sleep(false), ColliderBuilder::new(shape))
        .0
}

/// The first step of fields in a world whose bodies share no shapes.
fn first_steps(count: usize) -> Vec<Variant> {
    let first = |(name, shape): (&'static str, MakeShape)| {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        for number in 0..count {
            insert_shape(&mut world, number, shape());
        }
        world.step();
        variant(name, move || {
            let wind = Field::wind(Vector::X * 1e-3, 0.1, 0.0);
            let mut fields = Fields::new(wind).expect("a sound tree");
            fields.step(&mut world).expect("finite fields");
        })
    };
    SHAPES.map(first).into()
}

/// Bodies of all shapes in drag, of which five are replaced before each step.
fn comings_and_goings(count: usize) -> Vec<Variant> {
    let rate: Real = 0.1;
    let coming = |name, mut step: Box<dyn FnMut(&mut PhysicsWorld)>| {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        let of = |number: usize| SHAPES[number % SHAPES.len()].1();
        let bodies = (0..count).map(|number| insert_shape(&mut world, number, of(number)));
        let mut bodies: Vec<_> = bodies.collect();
        let mut next = 0;
        variant(name, move || {
            for number in (0..5).map(|more| (next + more) % count) {
                world.remove_body(bodies[number]);
                bodies[number] = insert_shape(&mut world, number, of(number));
            }
            next = (next + 5) % count;
            step(&mut world);
        })
    };
    let by_hand = move |world: &mut PhysicsWorld| {
        let left = (-rate * world.integration_parameters.dt).exp();
        for (_, body) in world.bodies.iter_mut() {
            let velocity = body.linvel() * left;
            body.set_linvel(velocity, false);
        }
        world.step();
    };
    let drag = Field::drag(rate, 0.0).force_mode(ForceMode::Acceleration);
    let mut fields = Fields::new(drag).expect("a sound tree");
    vec![
        coming("by hand", Box::new(by_hand)),
        coming("Rapier alone", Box::new(PhysicsWorld::step)),
        coming(
            "drag",
            Box::new(move |world| {
                fields.step(world).expect("finite fields");
            }),
        ),
    ]
}

fn main() {
    for (name, sleeps) in [("awake", false), ("that may sleep", true)] {
        let [few, many] = if sleeps { [500, 100] } else { [50, 10] };
        compare(&format!("contacts, pyramid of 21 {name}"), few, || {
            contacts(None, sleeps)
        });
        compare(&format!("contacts, heap of 60 {name}"), 2 * many, || {
            contacts(Some(60), sleeps)
        });
        compare(&format!("contacts, heap of 200 {name}"), many, || {
            contacts(Some(200), sleeps)
        });
    }
    compare("contacts, 10,000 balls, dense", 2, || gas(10_000, 14.0));
    compare("contacts, 10,000 balls, thin", 2, || gas(10_000, 22.0));
    compare("nothing in reach, 10,000 balls", 20, || {
        out_of_reach(10_000)
    });
    compare("asleep, 10,000 balls, uniform field", 200, || {
        sleeping(10_000, false, Field::uniform(Vector::Y * -0.1).into())
    });
    compare("asleep, 10,000 boxes, point gravity", 200, || {
        let pull = Field::point_gravity(1e3).softened(10.0);
        sleeping(10_000, true, pull.at(Vector::Y * -100.0).into())
    });
    compare("edits among 100,000 leaves", 5, || edits(100_000));
    compare("wells, 2,000 balls", 20, || choice(2_000));
    compare("drag, 2,000 balls", 20, || drag(2_000));
    compare("first steps of 2,000 bodies", 1, || first_steps(2_000));
    compare("five of 2,000 bodies go and come", 5, || {
        comings_and_goings(2_000)
    });
    compare("change tracking, 2,000 balls", 20, || {
        change_tracking(2_000)
    });
}
