//! Contacts that detection fields find, and those that they do not.

use rapier3d_fields::contact::FieldContact;
use rapier3d_fields::math::{Real, Vector, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::collide::*;
use crate::support::{assert_close, largest};

/// The contacts of a world at its present poses, by a tree.
fn found(world: &mut PhysicsWorld, tree: impl Into<Tree>) -> Vec<FieldContact> {
    let mut fields = Fields::new(tree).expect("a valid tree");
    step(&mut fields, world);
    fields.contacts().to_vec()
}

/// Two pairs of touching balls: one around x = -5, one around x = 5.
fn two_pairs() -> (PhysicsWorld, Vec<Thing>) {
    let mut world = still_arena();
    let places = [-5.4, -4.6, 4.6, 5.4].map(from_f64);
    let things = places.map(|x| ball(&mut world, 1.0, Vector::X * x, Vector::ZERO));
    (world, things.to_vec())
}

/// Fails unless a tree finds this pair, and no other, of [`two_pairs`].
#[track_caller]
fn assert_finds_only(pair: [usize; 2], tree: impl FnOnce(Tree) -> Tree) {
    let (mut world, things) = two_pairs();
    let all: Vec<&Thing> = things.iter().collect();
    assert_eq!(found(&mut world, touch(parts(&all), ELASTIC)).len(), 2);
    let contacts = found(&mut world, tree(touch(parts(&all), ELASTIC)));
    let pairs: Vec<_> = contacts.iter().map(|c| c.colliders).collect();
    assert_eq!(pairs, [pair.map(|i| things[i].parts[0])]);
}

#[test]
fn detection_fields_can_be_replaced_and_cut_out() {
    let left = || Region::ball(2.0).at(Vector::X * -5.0);
    let hole = || Field::uniform(Vector::ZERO).within(left());
    assert_finds_only([2, 3], |tree| tree.replace_union(hole()));
    assert_finds_only([2, 3], |tree| tree.difference(hole()));
    assert_finds_only([0, 1], |tree| tree.sum_intersection(hole()));
}

#[test]
fn detection_fields_can_be_restricted_in_space_and_time() {
    // The region is in the frame of the field, which acts on its +x side.
    let (mut world, things) = two_pairs();
    let ahead = Region::half_space(-Vector::X, 0.0);
    let field = |i: usize| Field::contact(ELASTIC).at(things[i].parts[0]);
    let finds = |world: &mut PhysicsWorld, i: usize| {
        !found(world, field(i).within(ahead.clone())).is_empty()
    };
    assert!(finds(&mut world, 0) && !finds(&mut world, 1));

    let dt = from_f64(1.0 / 64.0);
    world.integration_parameters.dt = dt;
    let during = Region::interval("time", 2.5 * dt, 4.5 * dt);
    let mut fields = Fields::new(field(0).within(during)).expect("a valid tree");
    let contacts: Vec<usize> = (0..6).map(|_| step(&mut fields, &mut world)).collect();
    assert_eq!(contacts, [0, 0, 1, 1, 0, 0]);
}

#[test]
fn known_overlaps_have_known_numbers() {
    let mut world = still_arena();
    let radii = [0.5, 1.5];
    let places = [Vector::new(1.0, 2.0, 3.0), Vector::new(1.9, 2.0, 4.2)];
    let velocities = [Vector::Z, Vector::X];
    let things = [0, 1].map(|i| {
        let body = RigidBodyBuilder::dynamic().linvel(velocities[i]);
        let part = ColliderBuilder::ball(from_f64(radii[i]));
        insert(&mut world, body.translation(places[i]), [part])
    });
    unsolved(&mut world, &[&things[0], &things[1]]);
    // A tree names them in the other order.
    let tree = touch(parts(&[&things[1], &things[0]]), ContactLaw::Observe);
    let contacts = found(&mut world, tree);
    let [contact] = contacts[..] else {
        panic!("{contacts:?}")
    };
    let normal = Vector::new(0.6, 0.0, 0.8);
    assert_eq!(contact.colliders, [things[0].parts[0], things[1].parts[0]]);
    assert_eq!(contact.bodies, [Some(things[0].body), Some(things[1].body)]);
    assert_close(to_f64(contact.depth), 0.5, rounding(), "depth");
    assert_near(contact.world_normal, normal, rounding(), "to the second");
    // The overlap reaches from 0 to 0.5 along the line from the first centre.
    let middle = places[0] + normal * 0.25;
    assert_near(contact.world_point, middle, 4.0 * rounding(), "point");
    assert_close(to_f64(contact.approach_speed), 0.2, rounding(), "approach");
    assert_eq!(contact.law, ContactLaw::Observe);
}

#[test]
fn contacts_come_in_the_order_of_handles() {
    let mut world = still_arena();
    let place = |i: i32| Vector::X * (from_f64(0.8) * ((i * 7) % 12) as Real);
    let things: Vec<Thing> = (0..12)
        .map(|i| ball(&mut world, 1.0, place(i), Vector::ZERO))
        .collect();
    let all: Vec<&Thing> = things.iter().rev().collect();
    let contacts = found(&mut world, touch(parts(&all), ContactLaw::Observe));
    assert_eq!(contacts.len(), 11);
    let keys = contacts
        .iter()
        .map(|c| c.colliders.map(|c| c.into_raw_parts()));
    let keys: Vec<_> = keys.collect();
    assert!(
        keys.is_sorted() && keys.iter().all(|[a, b]| a < b),
        "{keys:?}"
    );
}

#[test]
fn one_field_is_enough() {
    let (mut world, [a, b]) = overlapping([Vector::X, -Vector::X], [1.0; 2]);
    for part in parts(&[&a, &b]) {
        assert_eq!(
            found(&mut world, touch([part], ContactLaw::Observe)).len(),
            1
        );
    }
}

#[test]
fn parts_of_one_body_and_fixed_bodies_do_not_touch() {
    let mut world = still_arena();
    let balls = || [ColliderBuilder::ball(0.5), ColliderBuilder::ball(0.7)];
    let double = insert(&mut world, RigidBodyBuilder::dynamic(), balls());
    let far = Vector::X * 20.0;
    let fixed = [0, 1].map(|_| {
        let body = RigidBodyBuilder::fixed().translation(far);
        insert(&mut world, body, balls())
    });
    let moving = RigidBodyBuilder::kinematic_velocity_based().translation(far);
    let moving = insert(&mut world, moving, balls());
    let all = parts(&[&double, &fixed[0], &fixed[1], &moving]);
    assert!(found(&mut world, touch(all, ELASTIC)).is_empty());
}

#[test]
fn sensors_and_what_is_disabled_are_ignored() {
    let switches: [fn(&mut PhysicsWorld, &Thing); 3] = [
        |world, thing| world.colliders[thing.parts[0]].set_sensor(true),
        |world, thing| world.colliders[thing.parts[0]].set_enabled(false),
        |world, thing| world.bodies[thing.body].set_enabled(false),
    ];
    for switch in switches {
        let (mut world, [a, b]) = overlapping([Vector::ZERO; 2], [1.0; 2]);
        let mut fields = detect(&[&a, &b], ContactLaw::Observe);
        assert_eq!(step(&mut fields, &mut world), 1);
        switch(&mut world, &b);
        assert_eq!(step(&mut fields, &mut world), 0);
    }
}

#[test]
fn removal_during_a_run_ends_contacts() {
    let mut world = still_arena();
    let place = |x: f64| Vector::X * from_f64(x);
    let [a, b, c] = [0.0, 0.9, 1.8].map(|x| ball(&mut world, 1.0, place(x), Vector::ZERO));
    let tree = touch(parts(&[&a]), ContactLaw::Observe);
    let mut fields = Fields::new(tree).expect("a valid tree");
    assert_eq!(step(&mut fields, &mut world), 1);
    world.remove_body(b.body);
    assert_eq!(step(&mut fields, &mut world), 0);
    // A new body may get an old index, but not the old handle.
    let again = ball(&mut world, 1.0, place(-0.9), Vector::ZERO);
    assert_eq!(again.body.into_raw_parts().0, b.body.into_raw_parts().0);
    assert_eq!(step(&mut fields, &mut world), 1);
    assert_eq!(
        fields.contacts()[0].bodies,
        [Some(a.body), Some(again.body)]
    );
    let _ = c;
}

#[test]
fn coincident_centres_part() {
    let mut world = still_arena();
    let [a, b] = [0, 1].map(|_| ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO));
    let contacts = found(&mut world, touch(parts(&[&a, &b]), ELASTIC));
    assert_eq!(contacts[0].depth, 1.0);
    assert_near(contacts[0].world_normal, Vector::Y, rounding(), "normal");
    assert!(linvel(&world, &a).is_finite());
}

/// The contact of a ball of radius 0.5 with a turned box of half extents 2, 3 and 9, the ball's
/// centre at `local` in the frame of the box; its normal in that frame, away from the box.
fn at_box(local: Vector) -> Option<(f64, Vector)> {
    let mut world = still_arena();
    let pose = Pose::new(Vector::new(0.5, -1.0, 2.0), Vector::new(0.4, -0.3, 0.8));
    let wall = RigidBodyBuilder::fixed().pose(pose);
    let wall = insert(&mut world, wall, [ColliderBuilder::cuboid(2.0, 3.0, 9.0)]);
    ball(&mut world, 1.0, pose * local, Vector::ZERO);
    let contacts = found(&mut world, touch(wall.parts, ContactLaw::Observe));
    let contact = contacts.first()?;
    let normal = pose.rotation.inverse() * contact.world_normal;
    Some((to_f64(contact.depth), normal))
}

#[test]
fn balls_are_found_on_all_sides_of_a_box_and_inside() {
    let half = Vector::new(2.0, 3.0, 9.0);
    for axis in [
        Vector::X,
        Vector::Y,
        Vector::Z,
        -Vector::X,
        -Vector::Y,
        -Vector::Z,
    ] {
        let beside = Vector::new(0.3, 0.5, -0.7) * (Vector::ONE - axis.abs());
        for gap in [0.4, 0.25, -0.25, -0.75].map(from_f64) {
            let (depth, normal) = at_box(axis * (half + Vector::splat(gap)) + beside).unwrap();
            assert_close(depth, 0.5 - to_f64(gap), 16.0 * rounding(), "depth");
            assert_near(normal, axis, 32.0 * rounding(), "normal");
        }
        assert!(at_box(axis * (half + Vector::splat(from_f64(0.51))) + beside).is_none());
    }
    let corner = half + Vector::splat(0.25);
    let (depth, normal) = at_box(corner).expect("a corner");
    assert_close(depth, 0.5 - 0.25 * 3_f64.sqrt(), 16.0 * rounding(), "depth");
    assert_near(normal, Vector::ONE.normalize(), 64.0 * rounding(), "corner");
}

#[test]
fn a_centre_on_the_surface_has_a_normal() {
    let shapes = [
        SharedShape::cuboid(2.0, 2.0, 8.0),
        SharedShape::cylinder(4.0, 2.0),
        SharedShape::capsule_y(4.0, 2.0),
        SharedShape::halfspace(Vector::X),
    ];
    let errors = shapes.into_iter().enumerate().map(|(number, shape)| {
        let mut world = still_arena();
        let part = ColliderBuilder::new(shape);
        let wall = insert(&mut world, RigidBodyBuilder::fixed(), [part]);
        // Off the line through the middle, so that the way out from there is not the normal.
        let depth = if number == 3 { 0.0 } else { 2.0 };
        let place = Vector::new(depth, if number == 0 { 0.0 } else { 1.0 }, 0.0);
        ball(&mut world, 1.0, place, -Vector::X);
        let contacts = found(&mut world, touch(wall.parts, ELASTIC));
        to_f64((contacts[0].world_normal - Vector::X).length())
    });
    // The direction comes from points beside the surface, by the root of a rounding.
    assert_close(largest(errors), 0.0, 1e-3, "normal");
}
