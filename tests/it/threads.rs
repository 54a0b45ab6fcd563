//! With the feature `parallel`: the same bits on any number of threads.

use rapier3d_fields::math::from_f64;
use rapier3d_fields::prelude::*;

use crate::support::bits::bits;
use crate::support::weightless;

/// More bodies than one thread takes at a time, in no spatial order.
fn world(count: usize) -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = weightless(1e-3);
    let cells = 16 * 16 * 16;
    let bodies = (0..count).map(|n| {
        let cell = n * 577 % cells;
        let cell = [cell % 16, cell / 16 % 16, cell / 256];
        let jitter = |axis: usize| ((n * 7 + axis * 13) % 17) as f64 / 17.0;
        let at = [0, 1, 2].map(|axis| from_f64(2.5 * cell[axis] as f64 + jitter(axis)));
        let body = RigidBodyBuilder::dynamic().translation(Vector::from_array(at));
        let body = world.insert_body(body.linvel(Vector::new(1.0, 0.5, -0.25)).can_sleep(false));
        let ball = ColliderBuilder::ball(0.1).collision_groups(InteractionGroups::none());
        world.insert_collider(ball, Some(body));
        body
    });
    let bodies = bodies.collect();
    (world, bodies)
}

type Scene = (&'static str, fn(&PhysicsWorld, &[RigidBodyHandle]) -> Tree);

fn each(bodies: &[RigidBodyHandle], field: impl Fn(usize) -> Field) -> Tree {
    let fields = bodies
        .iter()
        .enumerate()
        .map(|(n, body)| field(n).at(*body));
    Tree::fold(Operator::SumUnion, fields)
}

fn scenes() -> Vec<Scene> {
    vec![
        ("all pairs", |_, bodies| {
            each(bodies, |_| Field::point_gravity(0.1))
        }),
        ("pairs in range", |world, _| {
            let atoms = world.colliders.iter().map(|(atom, _)| {
                let two = [
                    Field::lennard_jones(1e-3, 0.2)
                        .within(Region::ball(3.0))
                        .at(atom),
                    Field::radial(0.1, -2.0).within(Region::ball(3.0)).at(atom),
                ];
                Tree::fold(Operator::SumUnion, two)
            });
            Tree::fold(Operator::SumUnion, atoms)
        }),
        ("cells", |_, bodies| {
            each(bodies, |_| Field::point_gravity(0.1).opening_angle(0.7))
        }),
        ("few sources", |_, _| {
            let zone = |x| Field::radial(-1.0, -2.0).at(Vector::new(x, 20.0, 20.0));
            Tree::fold(Operator::SumUnion, [10.0, 20.0, 30.0].map(zone))
        }),
        ("programs", |_, bodies| {
            let zone = Field::uniform(Vector::Y).within(Region::ball(15.0));
            let zones = [0, 7, 900].map(|n| zone.clone().at(bodies[n]));
            let zones = Tree::fold(Operator::ReplaceUnion, zones);
            Tree::fold(Operator::SumUnion, [Field::drag(0.1, 0.2).into(), zones])
        }),
    ]
}

/// The bits of the world after three steps on a number of threads.
fn run(count: usize, (name, tree): Scene, threads: usize) -> Vec<Vec<u64>> {
    let (mut world, bodies) = world(count);
    let mut fields = Fields::new(tree(&world, &bodies)).expect(name);
    world.configure_thread_pool(threads).expect("threads");
    for _ in 0..3 {
        fields.step(&mut world).expect(name);
    }
    bits(&world)
}

#[test]
fn no_bit_depends_on_the_number_of_threads() {
    for scene in scenes() {
        let [one, others @ ..] = [1, 2, 3, 8].map(|threads| run(3000, scene, threads));
        for (other, threads) in others.iter().zip([2, 3, 8]) {
            assert!(*other == one, "{} on {threads} threads", scene.0);
        }
    }
}
