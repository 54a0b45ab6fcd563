//! Contact fields beside a user's hooks, platforms, controllers, dominance groups, joints and skins.

use super::*;
use rapier3d_fields::rapier::prelude::{
    ActiveHooks, ContactModificationContext, PairFilterContext, PhysicsHooks,
    PrismaticJointBuilder, SolverFlags,
};

fn falling() -> Scene {
    let stuff = Stuff {
        restitution: 0.5,
        friction: 0.5,
    };
    let mut scene = Scene::new(stuff, 60);
    scene.floor();
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 1.5);
    scene.add(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    scene
}

/// Hooks that remove all contacts.
struct Nothing;

impl PhysicsHooks for Nothing {
    fn filter_contact_pair(&self, _: &PairFilterContext<'_>) -> Option<SolverFlags> {
        None
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        if let Some(manifold) = context.rigid_mut() {
            manifold.solver_contacts.clear();
        }
    }
}

#[test]
fn a_contact_that_the_users_hooks_remove_is_not_answered() {
    for way in FIELDS {
        for bits in [
            ActiveHooks::FILTER_CONTACT_PAIRS,
            ActiveHooks::MODIFY_SOLVER_CONTACTS,
        ] {
            for asked in [false, true] {
                let mut scene = falling();
                let collider = scene.world.bodies[scene.bodies[0]].colliders()[0];
                if asked {
                    scene.world.colliders[collider].set_active_hooks(bits);
                }
                let mut fields = scene.fields(way, None);
                for _ in 0..180 {
                    let outcome = fields.step_with(&mut scene.world, &Nothing, &());
                    outcome.expect("a step");
                }
                let through = scene.places()[0].y < -1.0;
                assert_eq!(through, asked, "{way:?}, {bits:?}");
            }
        }
    }
}

#[test]
fn removed_fields_give_contacts_back_to_rapier() {
    for way in FIELDS {
        for groups_are_kept in [false, true] {
            let mut scene = falling();
            let collider = scene.world.bodies[scene.bodies[0]].colliders()[0];
            let own = ActiveHooks::FILTER_INTERSECTION_PAIR;
            scene.world.colliders[collider].set_active_hooks(own);
            let mut fields = scene.fields(way, None);
            // In the middle of a rebound, so that the last contacts were taken off Rapier's solver.
            for _ in 0..28 {
                fields.step(&mut scene.world).expect("a step");
            }
            if groups_are_kept {
                drop(fields);
                (0..300).for_each(|_| scene.world.step());
            } else {
                let nothing = Field::uniform(Vector::ZERO);
                fields.set_tree(nothing).expect("a valid tree");
                for _ in 0..300 {
                    fields.step(&mut scene.world).expect("a step");
                }
                let hooks = scene.world.colliders[collider].active_hooks();
                assert_eq!(hooks, own, "the user's bits are back");
            }
            let height = to_f64(scene.places()[0].y);
            assert_close(height, 0.5, 0.01, "it rests by Rapier's solver");
        }
    }
}

#[test]
fn a_box_on_a_moving_platform_stays_there() {
    let slip = |way| {
        let stuff = Stuff {
            restitution: 0.0,
            friction: 0.7,
        };
        let mut scene = Scene::new(stuff, 60);
        let platform = RigidBodyBuilder::kinematic_position_based();
        let slab = stuff.of(ColliderBuilder::cuboid(3.0, 0.25, 3.0));
        let (platform, _) = scene.world.insert(platform, slab);
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.75);
        scene.add(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
        let mut fields = scene.fields(way, None);
        for number in 1..=600 {
            let time = f64::from(number) / 60.0;
            let place = Vector::new(
                from_f64(time.sin()),
                from_f64(0.2 * (1.3 * time).sin()),
                0.0,
            );
            scene.world.bodies[platform].set_next_kinematic_translation(place);
            fields.step(&mut scene.world).expect("a step");
        }
        let under = scene.world.bodies[platform].translation();
        let off = scene.places()[0] - under - Vector::Y * 0.75;
        to_f64(off.length())
    };
    let theirs = slip(Way::Rapier);
    for way in FIELDS {
        let ours = slip(way);
        assert!(ours < 1.1 * theirs + 1e-3, "{way:?}: {ours} for {theirs}");
    }
}

/// A crate on a bed that a controller holds in the air by its velocity, as for drones and vehicles with rays for
/// wheels: no contact or joint shows that the bed does not fall with the crate.
#[test]
fn a_load_on_a_body_that_a_controller_holds_lies_still() {
    for restitution in [0.3, 0.8] {
        let stuff = Stuff {
            restitution,
            friction: 0.5,
        };
        for way in FIELDS {
            let mut scene = Scene::new(stuff, 60);
            let bed = ColliderBuilder::cuboid(1.5, 0.25, 1.5);
            scene.add(RigidBodyBuilder::dynamic(), bed);
            let load = RigidBodyBuilder::dynamic().translation(Vector::Y * 1.0);
            scene.add(load, ColliderBuilder::cuboid(0.3, 0.3, 0.3));
            let mut fields = scene.fields(way, None);
            let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
            for step in 0..600 {
                let bed = &mut scene.world.bodies[scene.bodies[0]];
                bed.set_linvel(Vector::ZERO, true);
                bed.set_angvel(Vector::ZERO, true);
                fields.step(&mut scene.world).expect("a step");
                let [bed, load] = [0, 1].map(|which| scene.places()[which].y);
                let gap = to_f64(load - bed) - 0.55;
                if step >= 400 {
                    [least, most] = [least.min(gap), most.max(gap)];
                }
            }
            // Rapier lets resting bodies overlap by up to 1e-3, and alone lets this one sink by 2e-4 in `f32`; a load
            // that jitters moves by 5e-4 and more.
            assert!(-1e-3 < least && most < 1e-3, "{restitution}, {way:?}");
            assert_at_most(most - least, 3e-4, format_args!("{restitution}, {way:?}"));
        }
    }
}

/// A bullet that Rapier's continuous detection stops at a wall must not pass through it when its contact is taken off
/// Rapier's solver.
#[test]
fn a_bullet_that_rapier_stops_is_answered() {
    for way in FIELDS {
        for speed in [10.0, 30.0, 100.0, 300.0] {
            for start in 0..10_u8 {
                let stuff = Stuff {
                    restitution: 0.5,
                    friction: 0.0,
                };
                let mut scene = Scene::new(stuff, 60);
                scene.world.gravity = Vector::ZERO;
                let wall = stuff.of(ColliderBuilder::cuboid(0.02, 2.0, 2.0));
                scene.world.insert(RigidBodyBuilder::fixed(), wall);
                let place = Vector::X * (-3.0 - 0.17 * Real::from(start));
                let body = RigidBodyBuilder::dynamic().translation(place);
                let body = body.linvel(Vector::X * speed).ccd_enabled(true);
                scene.add(body, ColliderBuilder::ball(0.1));
                let mut fields = scene.fields(way, None);
                for _ in 0..60 {
                    fields.step(&mut scene.world).expect("a step");
                }
                let body = &scene.world.bodies[scene.bodies[0]];
                let what = format!("{way:?}, {speed} m/s from {place}: {}", body.linvel());
                assert!(body.translation().x < 0.0, "it is through: {what}");
                let left = -to_f64(body.linvel().x) / to_f64(speed);
                assert!((left - 0.5).abs() < 1e-3, "{what}");
            }
        }
    }
}

/// A light body of a higher dominance group is not stopped by a heavy one, as with Rapier alone.
#[test]
fn a_dominant_body_is_not_stopped() {
    let after = |way| {
        let stuff = Stuff {
            restitution: 0.0,
            friction: 0.0,
        };
        let mut scene = Scene::new(stuff, 60);
        scene.world.gravity = Vector::ZERO;
        for (side, group, mass) in [(-1.0, 5, 1.0), (1.0, 0, 50.0)] {
            let body = RigidBodyBuilder::dynamic().translation(Vector::X * side);
            let body = body.linvel(-Vector::X * side).can_sleep(false);
            let ball = ColliderBuilder::ball(0.5).mass(mass);
            scene.add(body.dominance_group(group), ball);
        }
        let mut fields = scene.fields(way, None);
        for _ in 0..60 {
            fields.step(&mut scene.world).expect("a step");
        }
        let velocity = |body: &RigidBodyHandle| to_f64(scene.world.bodies[*body].linvel().x);
        [velocity(&scene.bodies[0]), velocity(&scene.bodies[1])]
    };
    let theirs = after(Way::Rapier);
    assert_close(theirs[0], 1.0, 1e-3, "it goes on");
    for way in FIELDS {
        for (ours, theirs) in after(way).into_iter().zip(theirs) {
            assert_close(ours, theirs, 1e-2, "as in Rapier alone");
        }
    }
}

/// Joints between two bodies that may touch or may not.
#[derive(Clone, Copy, Debug)]
enum Rail {
    Impulse { touch: bool },
    Multibody { touch: bool, by_joint: bool },
}

impl Rail {
    const ALL: [Rail; 5] = [
        Rail::Impulse { touch: false },
        Rail::Impulse { touch: true },
        Rail::Multibody {
            touch: false,
            by_joint: true,
        },
        Rail::Multibody {
            touch: false,
            by_joint: false,
        },
        Rail::Multibody {
            touch: true,
            by_joint: true,
        },
    ];

    fn touches(self) -> bool {
        match self {
            Rail::Impulse { touch } | Rail::Multibody { touch, .. } => touch,
        }
    }

    fn join(self, world: &mut PhysicsWorld, bodies: [RigidBodyHandle; 2]) {
        let [one, two] = bodies;
        let joint = |touch| {
            let joint = PrismaticJointBuilder::new(Vector::X).contacts_enabled(touch);
            // A link begins where the coordinates of its joint are zero.
            joint.local_anchor1(Vector::X * 1.8)
        };
        match self {
            Rail::Impulse { touch } => {
                world.impulse_joints.insert(one, two, joint(touch), true);
            }
            Rail::Multibody { touch, by_joint } => {
                let set = &mut world.multibody_joints;
                let link = set.insert(one, two, joint(touch || !by_joint), true);
                let (multibody, _) = set.get_mut(link.expect("a chain")).expect("its link");
                multibody.set_self_contacts_enabled(touch || by_joint);
            }
        }
    }
}

/// Two boxes on a joint without contacts are not pushed apart where they overlap.
#[test]
fn bodies_on_a_joint_without_contacts_are_not_answered() {
    for way in FIELDS {
        for rail in Rail::ALL {
            let stuff = Stuff {
                restitution: 1.0,
                friction: 0.0,
            };
            let mut scene = Scene::new(stuff, 60);
            scene.world.gravity = Vector::ZERO;
            for side in [-1.0, 1.0] {
                let body = RigidBodyBuilder::dynamic().translation(Vector::X * (0.9 * side));
                scene.add(
                    body.can_sleep(false),
                    ColliderBuilder::cuboid(0.5, 0.5, 0.5),
                );
                let body = *scene.bodies.last().expect("one was added");
                scene.world.bodies[body].add_force(-Vector::X * (5.0 * side), true);
            }
            let pair = [scene.bodies[0], scene.bodies[1]];
            rail.join(&mut scene.world, pair);
            let mut fields = scene.fields(way, None);
            let mut nearest = Real::MAX;
            for _ in 0..48 {
                fields.step(&mut scene.world).expect("a step");
                let places = scene.places();
                nearest = nearest.min((places[1] - places[0]).x);
            }
            // They meet at a distance of one after 0.4 s, and would have passed each other at the end.
            assert_eq!(
                nearest > 0.8,
                rail.touches(),
                "{way:?}, {rail:?}: {nearest}"
            );
        }
    }
}

#[test]
fn contact_skins_count() {
    for way in FIELDS {
        let mut scene = falling();
        for (_, collider) in scene.world.colliders.iter_mut() {
            collider.set_contact_skin(0.05);
        }
        let end = run(scene, way, 10.0);
        let height = to_f64(end.scene.places()[0].y);
        assert_close(height, 0.6, 0.01, "it rests on two skins");
        assert!(end.asleep_at.is_some(), "{way:?}");
    }
}

#[test]
fn a_box_rests_alike_by_all_routes() {
    let heights: Vec<Vector> = (0..3)
        .map(|route| {
            let mut scene = falling();
            let mut fields = scene.fields(Way::Swept, None);
            for _ in 0..120 {
                let world = &mut scene.world;
                let outcome = match route {
                    0 => fields.step(world),
                    1 => fields.step_with(world, &(), &()),
                    _ => {
                        let open = fields.begin(WorldMut::from(&mut *world)).expect("a start");
                        world.step_with_events(&open.hooks(&()), &());
                        fields.finish(open, WorldMut::from(&mut *world))
                    }
                };
                outcome.expect("a step");
            }
            scene.places()[0]
        })
        .collect();
    assert!(
        heights.iter().all(|height| *height == heights[0]),
        "{heights:?}"
    );
}

/// The contact field is the last of 101 fields in one composite.
#[test]
fn a_field_that_is_cut_out_leaves_its_contact_to_rapier() {
    for way in FIELDS {
        for cut in [false, true] {
            let mut scene = falling();
            let collider = scene.world.bodies[scene.bodies[0]].colliders()[0];
            let far = (0..100_u8).map(|number| {
                let place = Vector::Y * (100.0 + Real::from(number));
                Field::uniform(Vector::X)
                    .within(Region::ball(0.1))
                    .at(place)
            });
            let contact = Field::contact(scene.stuff.law()).at(collider);
            let mut tree = Tree::fold(Operator::ReplaceUnion, far.chain([contact]));
            if cut {
                let hole = Field::uniform(Vector::ZERO).within(Region::ball(5.0));
                tree = tree.difference(hole);
            }
            let detection = match way {
                Way::Swept => Detection::Swept,
                _ => Detection::Discrete,
            };
            let mut fields = Fields::builder(tree)
                .detection(detection)
                .build()
                .expect("a tree");
            let mut seen = 0;
            for _ in 0..300 {
                seen += fields.step(&mut scene.world).expect("a step").contacts;
            }
            assert_eq!(seen > 0, !cut, "{way:?}: {seen}");
            let height = to_f64(scene.places()[0].y);
            assert_close(height, 0.5, 0.01, "it rests on the floor");
        }
    }
}

#[test]
fn the_plan_of_contacts_names_what_is_found() {
    let mut scene = falling();
    let ball = SharedShape::ball(0.5);
    scene.add(RigidBodyBuilder::dynamic(), ColliderBuilder::new(ball));
    let plan = scene.fields(Way::Swept, None).contact_plan(&scene.world);
    let said = plan.to_string();
    for line in [
        "whole of each step",
        "Ball and Ball: exact",
        "Ball and Cuboid: by Parry",
    ] {
        assert!(said.contains(line), "{said}");
    }
    let nothing = Fields::new(Field::uniform(Vector::X)).expect("a tree");
    assert!(nothing.contact_plan(&scene.world).pairs.is_empty());
}
