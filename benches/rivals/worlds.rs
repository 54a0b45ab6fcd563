//! Worlds with contacts: a heap, mixed shapes in air and water, spheres whose contacts fields answer.

use rapier3d_fields::Detection;
use rapier3d_fields::field::Turbulence;
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::spheres::{BoxOfSpheres, SpheresSettings};

use super::paired::{Variant, alone, stepped, variant, with};

const WIND: Vector = Vector::new(1.0, 0.0, 0.5);
const RATE: Real = 0.01;
const ZONES: [Vector; 3] = [
    Vector::new(-3.0, 2.0, 0.0),
    Vector::new(3.0, 2.0, 1.0),
    Vector::new(0.0, 4.0, -3.0),
];
const RADIUS: Real = 6.0;
const STRENGTH: Real = 0.1;

/// A floor and four walls, `half` from the middle.
fn pit(half: Real) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed().translation(Vector::Y * -0.5),
        slab(Vector::new(20.0, 0.5, 20.0)),
    );
    for side in [Vector::X, -Vector::X, Vector::Z, -Vector::Z] {
        let size = Vector::new(half, 10.0, half) - side.abs() * (half - 0.5);
        let wall = RigidBodyBuilder::fixed().translation(side * half + Vector::Y * 10.0);
        world.insert(wall, slab(size));
    }
    world
}

fn slab(half: Vector) -> ColliderBuilder {
    ColliderBuilder::cuboid(half.x, half.y, half.z)
}

/// Boxes between four walls that have come to rest on each other, and may not sleep.
fn heap(count: usize) -> PhysicsWorld {
    let mut world = pit(6.0);
    for number in 0..count {
        let cell = [number % 10, number / 100, number / 10 % 10].map(|n| n as Real);
        let middle = Vector::new(4.5, -0.5, 4.5);
        let at = (Vector::from_array(cell) - middle) * Vector::new(1.05, 1.02, 1.05);
        let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
        world.insert(body, slab(Vector::splat(0.5)));
    }
    (0..120).for_each(|_| world.step());
    world
}

/// Mixed shapes that lie in a pit as they fell, and may not sleep.
fn jumble(count: usize) -> PhysicsWorld {
    let mut world = pit(2.5);
    for number in 0..count {
        let [x, y, z] = [number % 3, number / 9, number / 3 % 3].map(|n| n as Real);
        let turn = Vector::new(x, y, z) * 0.7;
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::new(1.2 * x - 1.2, 1.2 * y + 1.0, 1.2 * z - 1.2))
            .rotation(turn)
            .can_sleep(false)
            .ccd_enabled(true);
        world.insert(body, shape(number).friction(0.5));
    }
    (0..240).for_each(|_| world.step());
    world
}

/// A jumble whose contacts fields answer, and the same with Rapier's solver and its continuous detection.
pub fn jumbled(count: usize) -> Vec<Variant> {
    let fields = |name, detection| {
        let world = jumble(count);
        let law = ContactLaw::restitution(0.0).with_friction(0.5);
        let moves = |it: &(ColliderHandle, &Collider)| {
            let body = it.1.parent().and_then(|body| world.bodies.get(body));
            body.is_some_and(RigidBody::is_dynamic)
        };
        let moving = world.colliders.iter().filter(moves);
        let contacts = moving.map(|(handle, _)| Tree::from(Field::contact(law).at(handle)));
        let tree = contacts.reduce(Tree::sum_union).expect("bodies");
        let builder = Fields::builder(tree).detection(detection);
        stepped(name, builder.build().expect("a sound tree"), world)
    };
    vec![
        alone(jumble(count)),
        fields("fields, discrete", Detection::Discrete),
        fields("fields, swept", Detection::Swept),
    ]
}

/// A heap on a floor in wind and three zones, under Rapier's gravity. The loop by hand sets forces anew in each step,
/// as Rapier's documentation shows it.
pub fn piled(count: usize) -> Vec<Variant> {
    let zone = |at| {
        let zone = Field::radial(-STRENGTH, -2.0).softened(0.5);
        zone.within(Region::ball(RADIUS)).at(at)
    };
    let centre = |field: Field| field.sampled(Sampling::Centre);
    let zones = Tree::fold(Operator::SumUnion, ZONES.map(|at| centre(zone(at))));
    let wind = centre(Field::wind(WIND, RATE, 0.0));
    let force = |body: &RigidBody| {
        let point = body.center_of_mass();
        let pull = |zone: &Vector| {
            let way = *zone - point;
            let r2 = way.length_squared();
            let soft = r2 + 0.25;
            (r2 <= RADIUS * RADIUS).then(|| way * (STRENGTH / (soft * soft.sqrt())))
        };
        let pulls: Vector = ZONES.iter().filter_map(pull).sum();
        (WIND - body.linvel()) * RATE + pulls
    };
    let mut looped = heap(count);
    let by_hand = variant("force by hand", move || {
        for (_, body) in looped.bodies.iter_mut().filter(|it| it.1.is_dynamic()) {
            body.reset_forces(true);
            let force = force(body);
            body.add_force(force, true);
        }
        looped.step();
    });
    vec![
        alone(heap(count)),
        by_hand,
        with("field", heap(count), zones + wind, Scheme::default()),
    ]
}

/// One of five shapes.
fn shape(number: usize) -> ColliderBuilder {
    let corners = [0.0, 2.1, 4.2].map(|turn: Real| Vector::new(turn.cos(), -0.4, turn.sin()));
    let corners = [corners.as_slice(), &[Vector::Y]].concat();
    match number % 5 {
        0 => ColliderBuilder::ball(0.5),
        1 => ColliderBuilder::cuboid(0.5, 0.4, 0.3),
        2 => ColliderBuilder::capsule_y(0.4, 0.3),
        3 => ColliderBuilder::cylinder(0.5, 0.4),
        _ => ColliderBuilder::convex_hull(&corners).expect("a hull"),
    }
}

/// Bodies of five shapes that float, half in water and half in gusts.
fn afloat(count: usize) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    for number in 0..count {
        let [x, z] = [number % 8, number / 8].map(|n| n as Real);
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::new(x * 3.0, 0.1, z * 3.0))
            .can_sleep(false);
        world.insert(body, shape(number).density(500.0));
    }
    world
}

/// Mixed shapes in wind, turbulence and a pool. Rapier alone has no gravity, so that the bodies stay where they are.
pub fn mixed(count: usize) -> Vec<Variant> {
    let mut plain = afloat(count);
    plain.gravity = Vector::ZERO;
    let half = Vector::new(40.0, 5.0, 40.0);
    let pool = Tree::pool(Vector::ZERO, half, 1000.0, 9.81, 1.0);
    let gusts = Field::turbulence(Turbulence::new(3, 2.0, 6.0)).as_wind(20.0, 0.0);
    let tree = pool + gusts + Field::wind(WIND, 20.0, 0.0);
    vec![
        alone(plain),
        with("field", afloat(count), tree, Scheme::default()),
    ]
}

/// Elastic spheres in a closed box: contacts by Rapier, and by fields.
pub fn spheres(count: usize) -> Vec<Variant> {
    let scene = || -> BoxOfSpheres {
        let settings = SpheresSettings {
            count,
            half_extent: 10.0,
            ..SpheresSettings::default()
        };
        settings.build().expect("the settings are in range")
    };
    let fields = |name, detection| {
        let scene = scene();
        let builder = Fields::builder(scene.tree(ContactLaw::elastic())).detection(detection);
        stepped(name, builder.build().expect("a sound tree"), scene.world)
    };
    vec![
        alone(scene().world),
        fields("fields, discrete", Detection::Discrete),
        fields("fields, swept", Detection::Swept),
    ]
}
