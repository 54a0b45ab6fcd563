//! Colliders get hooks where an impact may happen, and nowhere else.

use rapier3d_fields::rapier::pipeline::ActiveHooks;

use super::*;

const STUFF: Stuff = Stuff {
    restitution: 0.0,
    friction: 0.5,
};

/// Three boxes on each other, at rest from the start, in a world that recycles contacts.
fn stack(stuff: Stuff) -> Scene {
    let mut scene = Scene::new(stuff, 60);
    scene.floor();
    for height in [0.5, 1.5, 2.5] {
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * height);
        let body = body.can_sleep(false);
        scene.add(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    }
    assert!(scene.world.integration_parameters.contact_recycling);
    scene
}

fn listening(scene: &Scene) -> usize {
    let colliders = scene.world.colliders.iter();
    let heard = colliders.filter(|(_, it)| it.active_hooks() != ActiveHooks::empty());
    heard.count()
}

#[test]
fn resting_bodies_are_rapiers_bit_for_bit_without_hooks() {
    let run = |way| {
        let mut scene = stack(STUFF);
        let mut fields = scene.fields(way, None);
        for _ in 0..240 {
            match way {
                Way::Rapier => scene.world.step(),
                _ => drop(fields.step(&mut scene.world).expect("a step")),
            }
            assert_eq!(listening(&scene), 0, "{way:?}");
        }
        scene.places()
    };
    let alone = run(Way::Rapier);
    for way in FIELDS {
        assert_eq!(run(way), alone, "{way:?}");
    }
}

/// The friction of the law replaces that of the colliders, by a hook.
#[test]
fn colliders_of_another_friction_than_the_laws_get_hooks() {
    for way in FIELDS {
        let mut scene = stack(STUFF);
        for (_, collider) in scene.world.colliders.iter_mut() {
            collider.set_friction(0.9);
        }
        let mut fields = scene.fields(way, None);
        for _ in 0..10 {
            fields.step(&mut scene.world).expect("a step");
        }
        assert_eq!(listening(&scene), 4, "{way:?}");
        let pairs = scene.world.narrow_phase.contact_pairs();
        let manifolds = pairs.flat_map(|pair| pair.manifolds());
        let touching = manifolds.filter(|it| !it.data.solver_contacts.is_empty());
        let frictions: Vec<Real> = touching.map(|it| it.data.friction).collect();
        assert_eq!(frictions, [0.5; 3], "{way:?}");
    }
}

/// A ball that falls on resting boxes gets a hook when it comes, is answered by the fields, and is left to Rapier again
/// when it lies.
#[test]
fn bodies_that_are_hit_get_hooks() {
    for way in FIELDS {
        let mut scene = stack(STUFF);
        let mut fields = scene.fields(way, None);
        for _ in 0..30 {
            fields.step(&mut scene.world).expect("a step");
        }
        let ball = RigidBodyBuilder::dynamic().translation(Vector::Y * 5.0);
        scene.add(ball, ColliderBuilder::ball(0.4));
        let colliders = scene.world.colliders.iter().map(|(handle, _)| handle);
        let contacts = colliders.map(|it| Field::contact(STUFF.law()).at(it));
        let tree = Tree::fold(Operator::SumUnion, contacts.map(Tree::from));
        fields.set_tree(tree).expect("a valid tree");
        let (mut answered, mut most) = (false, 0);
        for _ in 0..240 {
            fields.step(&mut scene.world).expect("a step");
            most = most.max(listening(&scene));
            let impulses = fields.contacts().iter().map(|contact| contact.impulses);
            answered |= impulses.flatten().any(|impulse| impulse.length() > 1.0);
        }
        assert!(answered, "{way:?}: the fields answer the impact");
        assert!(most > 0, "{way:?}: nobody listened");
        assert_eq!(listening(&scene), 0, "{way:?}: it lies");
        assert!(scene.overlap() < 0.01, "{way:?}: {}", scene.overlap());
    }
}
