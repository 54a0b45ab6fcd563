//! Bodies with joints, which Rapier's solver moves after an impact.

use rapier3d_fields::StepWarning;

use super::*;
use crate::lab::random::Random;

/// The kind of the joints of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Link {
    Impulse,
    Multibody,
}

const LINKS: [Link; 2] = [Link::Impulse, Link::Multibody];

/// Four chains of four capsules each, and four boxes, dropped from random places onto a slab.
fn chains(seed: u64, link: Link, stuff: Stuff) -> Scene {
    let mut scene = Scene::new(stuff, 60);
    scene.floor();
    let mut random = Random::new(seed);
    let mut side = move || from_f64(2.0 * random.uniform() - 1.0);
    for chain in 0..4_u8 {
        let turn = Rotation::from_scaled_axis(Vector::new(side(), side(), side()) * 3.0);
        let place = Vector::new(side(), 3.0 + 4.0 * Real::from(chain), side());
        let mut last = None;
        for number in 0..4_u8 {
            let body = RigidBodyBuilder::dynamic()
                .translation(place + turn * (Vector::Y * Real::from(number)))
                .rotation(turn.to_scaled_axis());
            scene.add(body, ColliderBuilder::capsule_y(0.25, 0.2));
            let body = scene.bodies[scene.bodies.len() - 1];
            let joint = SphericalJointBuilder::new().local_anchor1(Vector::Y * 0.5);
            let joint = joint.local_anchor2(Vector::Y * -0.5);
            match last {
                Some(last) if link == Link::Impulse => {
                    scene.world.insert_impulse_joint(last, body, joint);
                }
                Some(last) => {
                    scene.world.insert_multibody_joint(last, body, joint);
                }
                None => {}
            }
            last = Some(body);
        }
        let place = Vector::new(side(), 20.0 + Real::from(chain), side());
        let body = RigidBodyBuilder::dynamic().translation(place);
        scene.add(body, ColliderBuilder::cuboid(0.3, 0.2, 0.4));
    }
    scene
}

/// The worst of a run.
#[derive(Debug, Default)]
struct Worst {
    /// The largest gain of energy, as a share of that at the start.
    gained: f64,
    /// The height of the lowest body at the end.
    lowest: Real,
    /// The number of steps that warned of a contact that deepened.
    deepened: usize,
}

fn worst(mut scene: Scene, way: Way) -> Worst {
    let mut fields = scene.fields(way, None);
    let (start, mut worst) = (scene.energy(), Worst::default());
    for _ in 0..360 {
        if way == Way::Rapier {
            scene.world.step();
        } else {
            fields.step(&mut scene.world).expect("a step");
            let deepens = |it: &StepWarning| matches!(it, StepWarning::ContactDeepens { .. });
            worst.deepened += usize::from(fields.warnings().iter().any(deepens));
        }
        worst.gained = worst.gained.max(scene.energy() / start - 1.0);
    }
    let heights = scene.places().into_iter().map(|place| place.y);
    worst.lowest = heights.fold(Real::INFINITY, Real::min);
    worst
}

/// Links of multibodies were answered as free bodies, although Rapier computes their velocities from their joints. So
/// chains gained up to 10²² times their energy with swept detection. Joints also undid the answers of bodies with
/// impulse joints, whose contacts deepened.
#[test]
fn chains_that_fall_on_a_floor_gain_no_energy() {
    for link in LINKS {
        for (seed, restitution) in [(1, 0.0), (2, 0.3), (3, 0.5), (4, 0.8)] {
            let stuff = Stuff {
                restitution,
                friction: 0.5,
            };
            let alone = worst(chains(seed, link, stuff), Way::Rapier);
            for way in FIELDS {
                let worst = worst(chains(seed, link, stuff), way);
                let name = format!("{link:?}, {way:?}, e {restitution}: {worst:?}, {alone:?}");
                assert!(worst.gained <= alone.gained.max(0.0) + 1e-2, "{name}");
                assert!(worst.lowest > 0.1, "{name}");
                assert_eq!(worst.deepened, 0, "{name}");
            }
        }
    }
}

/// Two balls side by side over a floor, joined.
fn joined(link: Link, stuff: Stuff, radius: Real) -> Scene {
    let mut scene = Scene::new(stuff, 240);
    scene.floor();
    for x in [-0.5, 0.5] {
        let body = RigidBodyBuilder::dynamic().translation(Vector::new(x, 2.0, 0.0));
        scene.add(body, ColliderBuilder::ball(radius));
    }
    let joint = SphericalJointBuilder::new().local_anchor1(Vector::X * 0.5);
    let joint = joint.local_anchor2(Vector::X * -0.5);
    let [one, other] = [scene.bodies[0], scene.bodies[1]];
    match link {
        Link::Impulse => {
            scene.world.insert_impulse_joint(one, other, joint);
        }
        Link::Multibody => {
            scene.world.insert_multibody_joint(one, other, joint);
        }
    }
    scene
}

/// The height to which two joined balls rise again after they have fallen side by side.
fn rebound(link: Link, way: Way) -> Real {
    let dead = Stuff {
        restitution: 0.0,
        friction: 0.5,
    };
    let mut scene = joined(link, dead, 0.5);
    scene.stuff.restitution = 0.5;
    let mut fields = scene.fields(way, None);
    let (mut highest, mut last) = (0.0, Real::INFINITY);
    let mut falls = true;
    for _ in 0..480 {
        fields.step(&mut scene.world).expect("a step");
        let height = scene.places()[0].y - 0.5;
        falls &= height < last;
        highest = if falls { 0.0 } else { height.max(highest) };
        last = height;
    }
    highest
}

/// Rapier's solver answers these contacts, by the restitution of the law and not by that of the colliders, which is zero.
/// A fall of 1.5 m ends in a rebound of a quarter of that. With Rapier alone and that restitution, links rise by 0.40 m.
#[test]
fn jointed_bodies_rebound_by_the_restitution_of_the_law() {
    for link in LINKS {
        for way in FIELDS {
            let height = rebound(link, way);
            assert!(
                (height - 0.375).abs() < 0.025,
                "{link:?}, {way:?}: {height}"
            );
        }
    }
}

/// Whole steps and steps by their halves, with hooks and events of Rapier's own pipeline, are the same.
#[test]
fn chains_fall_alike_by_both_routes() {
    let stuff = Stuff {
        restitution: 0.5,
        friction: 0.5,
    };
    for link in LINKS {
        for way in FIELDS {
            let [mut whole, mut halves] = [(); 2].map(|()| chains(1, link, stuff));
            let [mut fields, mut by_halves] = [&whole, &halves].map(|it| it.fields(way, None));
            for _ in 0..120 {
                fields.step(&mut whole.world).expect("a step");
                let world = &mut halves.world;
                let open = by_halves
                    .begin(WorldMut::from(&mut *world))
                    .expect("a step");
                world.step_with_events(&open.hooks(&()), &());
                by_halves
                    .finish(open, WorldMut::from(world))
                    .expect("a step");
            }
            assert_eq!(whole.places(), halves.places(), "{link:?}, {way:?}");
        }
    }
}

/// The height to which the last of five pendulums side by side rises after the first one has fallen, as a share of the
/// height from which it fell.
fn last_of_five(way: Way) -> Real {
    let stuff = Stuff {
        restitution: 1.0,
        friction: 0.0,
    };
    let mut scene = Scene::new(stuff, 240);
    let post = scene.world.insert_body(RigidBodyBuilder::fixed());
    for number in 0..5_u8 {
        let angle: Real = if number == 0 { 0.8 } else { 0.0 };
        let arm = Vector::new(angle.sin(), -angle.cos(), 0.0);
        let hook = Vector::X * (-0.4 * Real::from(number));
        let body = RigidBodyBuilder::dynamic().translation(hook + arm);
        scene.add(body, ColliderBuilder::ball(0.2));
        let joint = SphericalJointBuilder::new().local_anchor1(hook);
        let body = scene.bodies[usize::from(number)];
        (scene.world).insert_impulse_joint(post, body, joint.local_anchor2(-arm));
    }
    let start = scene.places()[0].y + 1.0;
    let mut fields = scene.fields(way, None);
    let heights = (0..240).map(|_| {
        fields.step(&mut scene.world).expect("a step");
        scene.places()[4].y + 1.0
    });
    heights.fold(0.0, Real::max) / start
}

/// Under a law that loses no speed fields answer bodies with joints. Rapier's solver lifts the last one to 0.28 of the
/// height; fields to 0.95.
#[test]
fn the_last_of_five_pendulums_rises_as_high_as_the_first() {
    let (height, solved) = (last_of_five(Way::Swept), last_of_five(Way::Rapier));
    assert!(height > 0.9, "{height}");
    assert!(solved < 0.5, "the solver does so, too: {solved}");
}

/// Returns whether fields answer the impact of two balls that fall side by side, joined until step `until`.
fn is_answered(link: Link, way: Way, until: usize) -> bool {
    let stuff = Stuff {
        restitution: 0.5,
        friction: 0.5,
    };
    let mut scene = joined(link, stuff, 0.4);
    let mut fields = scene.fields(way, None);
    (0..240).any(|step| {
        if step == until {
            let joints: Vec<_> = scene.world.impulse_joints.iter().map(|it| it.0).collect();
            let world = &mut scene.world;
            for joint in joints {
                world.impulse_joints.remove(joint, true);
            }
            let articulated = &mut world.multibody_joints;
            articulated.remove_multibody_articulations(scene.bodies[0], true);
        }
        fields.step(&mut scene.world).expect("a step");
        let mut contacts = fields.contacts().iter();
        contacts.any(|it| it.impulses != [Vector::ZERO; 2])
    })
}

/// Bodies are answered as free ones again once their joint is gone.
#[test]
fn fields_answer_impacts_once_a_joint_is_removed() {
    for link in LINKS {
        for way in FIELDS {
            let name = format!("{link:?}, {way:?}");
            assert!(!is_answered(link, way, 240), "{name}: joined");
            assert!(is_answered(link, way, 40), "{name}: removed");
        }
    }
}
