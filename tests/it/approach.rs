//! Axes of approach (relative velocity, distance, closing speed, closest point), and avoidance by them.

use rapier3d_fields::Axis;
use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::{assert_close, insert_ball, weightless};

/// The value of an axis for a sample, relative to a moving body at the origin.
fn value(axis: Axis, point: DVec3, velocity: DVec3) -> f64 {
    let mut world = weightless(1.0);
    let body = RigidBodyBuilder::dynamic().linvel(Vector::new(0.5, -1.0, 0.25));
    let body = world.insert_body(body);
    let field = Field::uniform(Vector::X).coupled_to_axis(axis).at(body);
    let tree = Tree::from(field);
    let query = Query {
        world_point: point,
        world_velocity: velocity + DVec3::new(0.5, -1.0, 0.25),
        ..Query::default()
    };
    let reference = Reference::new(&tree).expect("a valid tree");
    let force = reference.force(&WorldRef::from(&world), &query);
    force.expect("defined everywhere").x
}

#[test]
fn axes_of_approach_follow_their_definitions() {
    let point = DVec3::new(3.0, 4.0, 0.0);
    let velocity = DVec3::new(-2.0, 0.0, 1.0);
    let of = |axis| value(axis, point, velocity);
    let close = |axis: Axis, expected: f64| {
        let name = axis.name().to_owned();
        assert_close(of(axis), expected, 1e-12, name);
    };
    close(Axis::VelocityX, -2.0);
    close(Axis::VelocityY, 0.0);
    close(Axis::VelocityZ, 1.0);
    close(Axis::Distance, 5.0);
    close(Axis::ClosingSpeed, 6.0 / 5.0);
    close(Axis::TimeToClosest, 6.0 / 5.0);
    let nearest = point + velocity * (6.0 / 5.0);
    close(Axis::ClosestDistance, nearest.length());
    for axis in [Axis::Distance, Axis::ClosingSpeed, Axis::TimeToClosest] {
        let named = Axis::named(axis.name());
        assert_eq!(named, axis, "by its name");
    }
    assert_eq!(
        value(Axis::TimeToClosest, point, DVec3::ZERO),
        f64::INFINITY
    );
    assert_eq!(value(Axis::ClosestDistance, point, DVec3::ZERO), 5.0);
    assert_eq!(value(Axis::ClosingSpeed, DVec3::ZERO, velocity), 0.0);
}

/// Two bodies approach so that they miss each other by `miss`; if `on`, a field on each pushes bodies aside that will
/// soon be near. Returns their smallest distance and the sideways speed of the first at the end.
fn pass(miss: f64, on: bool) -> (f64, f64) {
    let mut world = weightless(1.0 / 60.0);
    let place = |side: f64| Vector::new(from_f64(-6.0 * side), from_f64(0.5 * miss * side), 0.0);
    let mut insert = |side: f64| {
        let velocity = Vector::X * from_f64(2.0 * side);
        insert_ball(&mut world, 1.0, place(side), velocity)
    };
    let bodies = [insert(1.0), insert(-1.0)];
    for (_, collider) in world.colliders.iter_mut() {
        collider.set_solver_groups(InteractionGroups::none());
    }
    // Sideways, to the right of the direction in which the other body comes.
    let soon = Region::interval(Axis::TimeToClosest, 0.0, 2.0);
    let near = Region::interval(Axis::ClosestDistance, -1.0, 1.5);
    let aside = Field::closure([Axis::VelocityX, Axis::VelocityY], |it: &Sample| {
        let along = Vector::new(it.axes[0], it.axes[1], 0.0).normalize_or_zero();
        along.cross(Vector::Z)
    });
    let field = aside.within(soon.intersection(near));
    let tree = Tree::instances(field, bodies.map(Anchor::from));
    let mut fields = Fields::new(tree).expect("a valid tree");
    let mut nearest = f64::INFINITY;
    for _ in 0..480 {
        if on {
            fields.step(&mut world).expect("a step");
        } else {
            world.step();
        }
        let [one, two] = bodies.map(|body| world.bodies[body].translation());
        nearest = nearest.min(to_f64((one - two).length()));
    }
    let velocity = world.bodies[bodies[0]].linvel();
    (nearest, to_f64(velocity.y.abs()))
}

#[test]
fn only_bodies_that_would_come_too_near_swerve() {
    let (nearest, _) = pass(0.2, false);
    assert!(nearest < 0.25, "on their own they meet: {nearest}");
    let (nearest, swerved) = pass(0.2, true);
    assert!(nearest > 1.3, "they keep away: {nearest}");
    assert!(swerved > 0.1, "{swerved}");
    let (nearest, swerved) = pass(2.0, true);
    assert_close(nearest, 2.0, 1e-3, "they pass as they would");
    assert_eq!(swerved, 0.0, "nobody pushed them");
}

#[test]
fn the_strongest_field_is_that_of_the_nearest_body() {
    let mut world = weightless(1.0);
    let places = [(1.0, 0.0), (-2.0, 1.0), (0.5, 3.0)].map(|(x, y)| Vector::new(x, y, 0.5));
    let bodies = places.map(|place| {
        let body = RigidBodyBuilder::dynamic().translation(place);
        world.insert_body(body)
    });
    let repels = |body| Field::radial(1.0, -2.0).at(body);
    let tree = Tree::fold(Operator::Strongest, bodies.map(repels));
    let reference = Reference::new(&tree).expect("a valid tree");
    for number in 0..50 {
        let turn = f64::from(number) * 0.7;
        let point = DVec3::new(turn.sin(), 1.0 + turn.cos(), 0.1 * turn) * 2.0;
        let query = Query {
            world_point: point,
            ..Query::default()
        };
        let force = reference.force(&WorldRef::from(&world), &query);
        let away = places.map(|place| point - to_dvec3(place));
        let nearest = away
            .into_iter()
            .min_by(|a, b| a.length().total_cmp(&b.length()));
        let nearest = nearest.expect("one of three");
        let expected = nearest.normalize() / nearest.length_squared();
        let error = (force.expect("defined everywhere") - expected).length();
        assert!(error < 1e-9, "{point}: {force:?} for {expected}");
    }
}
