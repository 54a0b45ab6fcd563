//! Windows shorter than a step, on bodies that are sampled or moved in other ways than a free ball.

use rapier3d_fields::math::{DVec3, to_dvec3};

use super::*;

/// Windows that begin and end anywhere in steps of 1/60.
const WINDOWS: [[f64; 2]; 4] = [[0.051, 0.056], [0.040, 0.050], [0.012, 0.104], [-1.0, 0.02]];
const FORCE: f64 = 12.0;

/// A world, and how to read the momentum of all that moves in it.
type Scene = (PhysicsWorld, Box<dyn Fn(&PhysicsWorld) -> DVec3>);

fn momentum_of(bodies: Vec<RigidBodyHandle>) -> Box<dyn Fn(&PhysicsWorld) -> DVec3> {
    Box::new(move |world| {
        let one = |body: &RigidBodyHandle| {
            let body = &world.bodies[*body];
            to_dvec3(body.linvel()) * to_f64(body.mass())
        };
        bodies.iter().map(one).sum()
    })
}

/// A long box, rotated, so that points of its volume and surface are sampled.
fn long_box() -> Scene {
    let mut world = weightless(1.0 / 60.0);
    let body = RigidBodyBuilder::dynamic().rotation(Vector::new(0.5, -0.25, 1.0));
    let part = ColliderBuilder::cuboid(2.0, 0.2, 0.3).mass(2.0);
    let (body, _) = world.insert(body.can_sleep(false), part);
    (world, momentum_of(vec![body]))
}

fn ball(world: &mut PhysicsWorld, at: Vector) -> RigidBodyHandle {
    insert_ball(world, 1.0, at, Vector::ZERO)
}

/// On a rail along x, by a joint or as the link of a multibody without damping.
fn on_a_rail(as_link: bool) -> Scene {
    let mut world = weightless(1.0 / 60.0);
    let post = world.bodies.insert(RigidBodyBuilder::fixed());
    let body = ball(&mut world, Vector::Y * 2.0);
    let rail = PrismaticJointBuilder::new(Vector::X).local_anchor1(Vector::Y * 2.0);
    match as_link {
        false => {
            world.impulse_joints.insert(post, body, rail, true);
        }
        true => {
            let joints = &mut world.multibody_joints;
            let joint = joints.insert(post, body, rail, true).expect("a joint");
            let (multibody, _) = joints.get_mut(joint).expect("it is there");
            multibody.damping_mut().fill(0.0);
        }
    }
    (world, momentum_of(vec![body]))
}

/// Two balls that a joint holds together.
fn coupled() -> Scene {
    let mut world = weightless(1.0 / 60.0);
    let pair = [
        ball(&mut world, Vector::ZERO),
        ball(&mut world, Vector::X * 2.0),
    ];
    let joint = FixedJointBuilder::new().local_anchor1(Vector::X * 2.0);
    world.impulse_joints.insert(pair[0], pair[1], joint, true);
    (world, momentum_of(pair.to_vec()))
}

fn soft_block() -> Scene {
    let mut world = weightless(1.0 / 60.0);
    let block = SoftBodyBuilder::cuboid(Vector::ZERO, Vector::splat(0.5), 3, 3, 3);
    let block = world.insert_soft_body(block.mass(2.0).can_sleep(false));
    let momentum = move |world: &PhysicsWorld| {
        let particles = world.soft_bodies[block].particles().iter();
        particles
            .map(|it| to_dvec3(it.velocity()) * to_f64(it.mass()))
            .sum()
    };
    (world, Box::new(momentum))
}

type Make<T> = fn() -> T;

/// Each with the number of bodies that are pushed, and the share of the impulse that rounding may cost.
fn scenes() -> [(&'static str, Make<Scene>, f64, f64); 5] {
    // Each step rounds velocities, and so does each iteration of Rapier's solver.
    let sharp = either(1e-5, 1e-12);
    [
        ("box", long_box, 1.0, sharp),
        ("on a rail", || on_a_rail(false), 1.0, sharp),
        ("link", || on_a_rail(true), 1.0, sharp),
        ("coupled", coupled, 2.0, sharp),
        ("soft", soft_block, 1.0, sharp),
    ]
}

/// However a body is moved, and at however many points it is sampled, the impulse of a window is force times overlap.
#[test]
fn windows_give_their_impulse_to_bodies_of_all_kinds() {
    let laws: [(&str, Make<Field>); 3] = [
        ("uniform", || Field::uniform(Vector::X * from_f64(FORCE))),
        ("over the volume", || {
            Field::closure([], |_| Vector::X * from_f64(FORCE)).sampled(Sampling::Volume)
        }),
        ("over the surface", || {
            Field::closure([], |_| Vector::X * from_f64(FORCE)).sampled(Sampling::Surface)
        }),
    ];
    for (name, scene, bodies, bound) in scenes() {
        for scheme in SCHEMES {
            for (law, field) in laws {
                for [from, until] in WINDOWS {
                    let (mut world, momentum) = scene();
                    let field = field().lifetime(Lifetime::between(from, until));
                    let still = Field::uniform(Vector::Y).within(Region::ball(0.1));
                    let tree = field.sum_union(still.at(Vector::Y * 1e3));
                    let mut fields = build(tree, scheme);
                    for _ in 0..8 {
                        fields.step(&mut world).expect("a step");
                    }
                    let expected = FORCE * bodies * (until - f64::max(from, 0.0));
                    let found = momentum(&world);
                    let error = (found - DVec3::X * expected).length();
                    let place = format!("{name}, {scheme:?}, {law}, {from} to {until}: {found}");
                    assert_at_most(error, bound * expected.max(1.0), place);
                }
            }
        }
    }
}

/// Fields that have left are not compiled: a set that a thousand fields have left has the plan and the wrenches of one
/// that never had them.
#[test]
fn a_thousand_fields_that_have_ended_leave_no_trace() {
    let boxes = || {
        let mut world = weightless(1.0 / 60.0);
        for number in 0..40_u8 {
            let at = Vector::X * (2.0 * Real::from(number));
            let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
            world.insert(body, ColliderBuilder::cuboid(0.5, 0.25, 0.5));
        }
        world
    };
    let wind = || Field::wind_zone(Vector::X * 3.0, 0.5, 0.25, Region::ball(30.0));
    let lasting = || wind().sum_union(Field::vortex(1.0, 0.5).smoothed(0.5));
    let [mut dead, mut never] = [(); 2].map(|()| Fields::new(lasting()).expect("a sound tree"));
    for number in 0..1000_u16 {
        let place = Vector::new(Real::from(number % 40), 1.0, 0.5);
        let vortex = Field::vortex(1.0, 0.0).smoothed(0.5).at(place);
        let ended = vortex.lifetime(Lifetime::between(0.0, 0.01));
        dead.set.insert_field(ended);
    }
    let mut worlds = [boxes(), boxes()];
    dead.step(&mut worlds[0]).expect("a step");
    never.step(&mut worlds[1]).expect("a step");
    assert_eq!(dead.plan().to_string(), never.plan().to_string());
    assert_eq!(dead.set.len(), never.set.len());
    let wrenches = [&dead, &never].map(|fields| fields.sample_all(1.0 / 60.0, &worlds[1]));
    assert_eq!(wrenches[0], wrenches[1]);
    let time = |fields: &mut Fields, world: &mut PhysicsWorld| {
        let start = std::time::Instant::now();
        for _ in 0..100 {
            fields.step(world).expect("a step");
        }
        start.elapsed() / 100
    };
    let [world, other] = &mut worlds;
    let times = [time(&mut dead, world), time(&mut never, other)];
    println!(
        "a step after 1,000 have ended {:?}, with none {:?}",
        times[0], times[1]
    );
}
