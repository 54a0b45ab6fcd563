//! Bodies across borders: a field that is uniform within its region acts on the part of a body inside, and a fluid
//! lifts a body by the weight displaced.

use std::f64::consts::PI;

use crate::lab::random::Random;
use rapier3d_fields::math::{DVec3, Rotation, SharedShape, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::lab::stability::SCHEMES;
use crate::sampling::{cuboid_in_half_space, one, shapes, wrench};
use crate::support::{assert_at_most, assert_close, build, either, weightless};

/// The wrench on a single body in fields.
fn on(tree: impl Into<Tree>, pose: Pose, collider: ColliderBuilder) -> (DVec3, DVec3) {
    let (world, body) = one(pose.translation, pose.rotation, collider);
    let mut fields = Fields::new(tree).expect("a sound tree");
    wrench(&mut fields, &world, body)
}

fn at(place: DVec3, turn: DVec3) -> Pose {
    Pose::new(from_dvec3(place), from_dvec3(turn))
}

/// 37.5 % of a bar of length 4 is inside.
#[test]
fn a_field_acts_on_the_part_of_a_bar_inside_of_it() {
    let zone = Field::uniform(Vector::Y * 8.0).within(Region::cuboid(Vector::splat(3.0)));
    let bar = || ColliderBuilder::cuboid(2.0, 0.1, 0.1);
    let place = Pose::from_translation(Vector::X * 3.5);
    let (force, torque) = on(zone.clone(), place, bar());
    // The part inside reaches from 1.5 to 3, so its middle is 2.25 − 3.5 from that of the bar.
    let rounding = either(1e-6, 1e-14);
    assert_at_most((force - DVec3::Y * 3.0).length(), rounding, "force");
    assert_at_most(
        (torque + DVec3::Z * 3.75).length(),
        rounding * 4.0,
        "torque",
    );
    // Sampled at its centre, which is outside, the bar gets no force.
    let at_centre = zone.clone().sampled(Sampling::Centre);
    assert_eq!(on(at_centre, place, bar()), (DVec3::ZERO, DVec3::ZERO));
    // Clear of the border, all or nothing, and no torque.
    for (x, share) in [(0.99, 1.0), (5.01, 0.0)] {
        let found = on(zone.clone(), Pose::from_translation(Vector::X * x), bar());
        assert_eq!(found, (DVec3::Y * 8.0 * share, DVec3::ZERO));
    }
}

#[test]
fn a_field_acts_on_the_part_of_a_box_behind_a_plane() {
    let half = DVec3::new(2.0, 0.5, 0.3);
    let force = DVec3::new(0.4, 2.0, -0.7);
    let zone = Field::uniform(from_dvec3(force)).within(Region::half_space(Vector::X, 0.0));
    let collider = || ColliderBuilder::cuboid(from_f64(half.x), from_f64(half.y), from_f64(half.z));
    let mut random = Random::new(21);
    for case in 0..300 {
        let place = DVec3::new((random.uniform() - 0.5) * 4.0, random.uniform(), 0.0);
        let pose = at(place, random.unit_vector() * (random.uniform() * 3.0));
        let (share, lever) = cuboid_in_half_space(half, to_dvec3(pose.translation), pose.rotation);
        let (found, torque) = on(zone.clone(), pose, collider());
        let rounding = either(2e-6, 1e-8) * force.length();
        assert_at_most(
            (found - force * share).length(),
            rounding,
            format!("case {case}"),
        );
        let error = (torque - lever.cross(force)).length();
        assert_at_most(error, 3.0 * rounding, format!("case {case}: torque"));
    }
}

/// The share of a ball behind a plane, and the first moment of that part about the ball's centre, along the plane's
/// normal. The centre is at `height` above the plane.
fn ball_behind(radius: f64, height: f64) -> (f64, f64) {
    let t = (height / radius).clamp(-1.0, 1.0);
    let share = (2.0 - 3.0 * t + t.powi(3)) / 4.0;
    (share, -3.0 / 16.0 * radius * (1.0 - t * t).powi(2))
}

#[test]
fn a_field_acts_on_the_part_of_a_ball_behind_a_plane() {
    let force = DVec3::new(0.4, 2.0, -0.7);
    let mut random = Random::new(22);
    for case in 0..100 {
        let (normal, radius) = (random.unit_vector(), 0.2 + random.uniform());
        let normal = to_dvec3(from_dvec3(normal)).normalize();
        let region = Region::half_space(from_dvec3(normal), 0.0);
        let place = random.unit_vector() * (radius * 1.2 * random.uniform());
        let height = to_dvec3(from_dvec3(place)).dot(normal);
        let collider = ColliderBuilder::ball(from_f64(radius));
        let zone = Field::uniform(from_dvec3(force)).within(region);
        let (found, torque) = on(zone, at(place, DVec3::ZERO), collider);
        let (share, first) = ball_behind(radius, height);
        let rounding = either(3e-6, 1e-12) * force.length();
        assert_at_most(
            (found - force * share).length(),
            rounding,
            format!("case {case}"),
        );
        let error = (torque - normal.cross(force) * first).length();
        assert_at_most(error, rounding, format!("case {case}: torque"));
    }
}

/// The expected share is the intersection of two balls, integrated in slices.
#[test]
fn a_field_acts_on_the_part_of_a_ball_in_a_sphere() {
    let rounding = either(2e-5, 1e-9);
    for (radius, zone, x, tolerance) in [
        (0.5, 0.5, 0.4, rounding),
        (0.5, 3.0, 3.2, rounding),
        (0.5, 3.0, 2.6, rounding),
        (0.5, 100.0, 100.1, rounding),
        (1.0, 0.25, 0.9, rounding),
        (1.0, 0.25, 0.3, rounding),
        // Most of the ball surrounds the sphere, so it is cut as a mesh.
        (1.0, 0.7, 0.0, 5e-3),
        (1.0, 0.7, 0.2, 5e-3),
        (1.0, 0.9, 0.4, 5e-3),
    ] {
        let slices = 200_000;
        let (mut share, mut first) = (0.0, 0.0);
        for slice in 0..slices {
            let u = ((f64::from(slice) + 0.5) / f64::from(slices) * 2.0 - 1.0) * radius;
            let own = radius * radius - u * u;
            let others = zone * zone - (x + u) * (x + u);
            let area = own.min(others).max(0.0) * (2.0 * radius / f64::from(slices));
            share += area * 0.75 / radius.powi(3);
            first += area * 0.75 / radius.powi(3) * u;
        }
        let field = Field::uniform(Vector::Y).within(Region::ball(from_f64(zone)));
        let collider = ColliderBuilder::ball(from_f64(radius));
        let (force, torque) = on(field, at(DVec3::X * x, DVec3::ZERO), collider);
        let what = format!("{radius} in {zone} at {x}");
        assert_close(force.y, share, tolerance, &what);
        assert_close(torque.z, first, tolerance, format!("{what}: torque"));
    }
}

/// The share of a shape in a region, the first moment of that part, and the middle of the shape, by points of a grid.
fn by_points(
    shape: &SharedShape,
    pose: &Pose,
    inside: impl Fn(DVec3) -> bool,
) -> (f64, DVec3, DVec3) {
    let bounds = shape.compute_local_aabb();
    let (low, high) = (to_dvec3(bounds.mins), to_dvec3(bounds.maxs));
    let count = 64;
    let (mut all, mut share, mut middle, mut first) = (0.0, 0.0, DVec3::ZERO, DVec3::ZERO);
    for n in 0..count * count * count {
        let place = [n % count, n / count % count, n / count / count];
        let place = DVec3::from_array(place.map(|n| (f64::from(n) + 0.5) / f64::from(count)));
        let local_point = from_dvec3(low + (high - low) * place);
        if shape.contains_local_point(local_point) {
            let world_point = to_dvec3(pose.transform_point(local_point));
            all += 1.0;
            middle += world_point;
            if inside(world_point) {
                share += 1.0;
                first += world_point;
            }
        }
    }
    (share / all, first / all, middle / all)
}

#[test]
fn a_field_acts_on_the_part_of_any_shape_in_any_region() {
    let mut random = Random::new(23);
    let far = |region: Region, way: DVec3| region.at(from_dvec3(way));
    type Test = Box<dyn Fn(DVec3) -> bool>;
    let regions: Vec<(&str, Region, Test)> = vec![
        (
            "half-space",
            Region::half_space(Vector::X, 0.1),
            Box::new(|p| p.x < 0.1),
        ),
        (
            "corner",
            far(Region::cuboid(Vector::splat(2.0)), DVec3::splat(-2.1)),
            Box::new(|p| p.max_element() < -0.1),
        ),
        (
            "ball",
            far(Region::ball(2.0), DVec3::X * -2.0),
            Box::new(|p| (p + DVec3::X * 2.0).length() < 2.0),
        ),
        (
            "large ball",
            far(Region::ball(50.0), DVec3::X * -50.1),
            Box::new(|p| (p + DVec3::X * 50.1).length() < 50.0),
        ),
        (
            "outside a cylinder",
            far(Region::cylinder(5.0, 3.0), DVec3::X * -3.0).complement(),
            Box::new(|p| DVec3::new(p.x + 3.0, 0.0, p.z).length() > 3.0),
        ),
        (
            "shell",
            Region::ball(4.0)
                .difference(Region::ball(3.6))
                .at(Vector::X * -3.8),
            Box::new(|p| {
                let r = (p + DVec3::X * 3.8).length();
                3.6 < r && r < 4.0
            }),
        ),
        (
            "capsule",
            far(Region::capsule(2.0, 2.0), DVec3::X * -2.0),
            Box::new(|p| {
                let p = p + DVec3::X * 2.0;
                (p - DVec3::Y * p.y.clamp(-2.0, 2.0)).length() < 2.0
            }),
        ),
        (
            "shape",
            Region::shape(SharedShape::cuboid(4.0, 4.0, 4.0)).at(Vector::X * -4.0),
            Box::new(|p| (p + DVec3::X * 4.0).abs().max_element() < 4.0),
        ),
        // Two faces of the first pass through every body, and all faces of the second.
        (
            "shape, thin",
            Region::shape(SharedShape::cuboid(0.15, 4.0, 4.0)),
            Box::new(|p| p.x.abs() < 0.15),
        ),
        (
            "shape, within",
            Region::shape(SharedShape::cuboid(0.3, 0.2, 0.25)),
            Box::new(|p| (p.abs() / DVec3::new(0.3, 0.2, 0.25)).max_element() < 1.0),
        ),
    ];
    let mut worst = [0.0_f64; 2];
    // Round shapes are left out: Parry computes their mass properties without the margin.
    let whole = |name: &str| !name.starts_with("round");
    for (name, shape) in shapes().into_iter().filter(|(name, _)| whole(name)) {
        for (where_, region, inside) in &regions {
            let turn = random.unit_vector() * (random.uniform() * 3.0);
            let pose = at(random.unit_vector() * 0.2, turn);
            let (share, first, middle) = by_points(&shape, &pose, inside);
            let zone = Field::uniform(Vector::Z).within(region.clone());
            let (force, torque) = on(zone, pose, ColliderBuilder::new(shape.clone()));
            let size = to_f64(shape.compute_local_bounding_sphere().radius);
            let lever = (first - middle * share).cross(DVec3::Z);
            let error = (force.z - share).abs();
            let turned = (torque - lever).length() / size;
            let worst = &mut worst[usize::from(where_.starts_with("shape"))];
            *worst = worst.max(error).max(turned);
            println!("{name}, {where_}: {share:.4}, off by {error:.1e}, {turned:.1e}");
        }
    }
    println!("worst {worst:?}");
    assert_at_most(worst[0], 1e-2, "shares");
    assert_at_most(worst[1], 2e-2, "shares of any shape");
}

#[test]
fn operators_act_in_each_piece_of_a_cut_body() {
    let (half, pose) = (
        DVec3::new(1.0, 0.4, 0.3),
        at(DVec3::X * 0.3, DVec3::new(0.2, 0.4, -0.3)),
    );
    let collider = || ColliderBuilder::cuboid(from_f64(half.x), from_f64(half.y), from_f64(half.z));
    let (share, lever) = cuboid_in_half_space(half, to_dvec3(pose.translation), pose.rotation);
    let (u, v) = (DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.3, 0.7, 4.0));
    let of = |vector: DVec3| Tree::from(Field::uniform(from_dvec3(vector)));
    let behind = || Field::uniform(from_dvec3(v)).within(Region::half_space(Vector::X, 0.0));
    let cases = [
        ("sum", of(u).sum_union(behind()), u, u + v),
        ("replacement", of(u).replace_union(behind()), u, v),
        (
            "intersection",
            of(u).sum_intersection(behind()),
            DVec3::ZERO,
            u + v,
        ),
        ("difference", of(u).difference(behind()), u, DVec3::ZERO),
        ("cross", of(u).cross_union(behind()), u, u.cross(v)),
        (
            "limit",
            of(u).sum_union(behind()).limited_to(1.5),
            u.normalize() * 1.5,
            (u + v).normalize() * 1.5,
        ),
    ];
    for (name, tree, outside, inside) in cases {
        let (force, torque) = on(tree, pose, collider());
        let rounding = either(1e-5, 1e-12);
        let exact = outside * (1.0 - share) + inside * share;
        assert_at_most((force - exact).length(), rounding, name);
        let exact = lever.cross(inside - outside);
        assert_at_most(
            (torque - exact).length(),
            rounding,
            format!("{name}: torque"),
        );
    }
}

/// A body of a ball and a box, with additional mass.
#[test]
fn a_force_is_shared_out_among_parts_by_mass() {
    let (world, body) = {
        let mut world = weightless(1.0 / 240.0);
        let body = RigidBodyBuilder::dynamic().additional_mass(3.0);
        let (body, _) = world.insert(body, ColliderBuilder::ball(0.5).mass(1.0));
        let beside = ColliderBuilder::cuboid(0.5, 0.5, 0.5)
            .mass(3.0)
            .translation(Vector::X * 2.0);
        world.insert_collider(beside, Some(body));
        let (bodies, colliders) = (&mut world.bodies, &world.colliders);
        bodies[body].recompute_mass_properties_from_colliders(colliders);
        (world, body)
    };
    let found = |offset: f64| {
        let region = Region::half_space(Vector::X, from_f64(offset));
        let zone = Field::uniform(Vector::Y * 4.0).within(region);
        wrench(&mut Fields::new(zone).expect("sound"), &world, body)
    };
    // About the centre of the parts, at 1.5.
    for (offset, force, torque) in [
        (-0.6, 0.0, 0.0),
        (0.0, 0.5, -0.5 * (1.5 + 0.1875)),
        (1.0, 1.0, -1.5),
        (2.0, 2.5, -1.5 + 1.5 * 0.25),
        (2.6, 4.0, 0.0),
    ] {
        let (f, t) = found(offset);
        let rounding = either(1e-6, 1e-14);
        assert_at_most((f - DVec3::Y * force).length(), rounding, offset);
        assert_at_most((t - DVec3::Z * torque).length(), 5.0 * rounding, offset);
    }
}

/// One zone, and a hundred unlike ones.
#[test]
fn zones_that_do_not_hold_the_centre_act() {
    let collider = || ColliderBuilder::cuboid(1.0, 0.2, 0.2);
    for count in [1, 100] {
        let zones = (0..count).map(|n| {
            let half = Vector::splat(1.0 + from_f64(f64::from(n) * 1e-3));
            let corner = Vector::X * (half.x - 0.5) + Vector::Y * (half.y - 1.0);
            let place = corner + Vector::X * from_f64(1.0 + f64::from(n) * 5.0);
            Field::uniform(Vector::Z)
                .within(Region::cuboid(half))
                .at(place)
        });
        let tree = Tree::fold(Operator::SumUnion, zones);
        let (force, torque) = on(tree, Pose::IDENTITY, collider());
        assert_close(force.z, 0.25, either(1e-6, 1e-14), "force");
        assert_close(torque.y, -0.25 * 0.75, either(1e-6, 1e-14), "torque");
    }
}

const WATER: f64 = 1000.0;
const G: f64 = 9.81;

fn lift() -> Field {
    Field::buoyancy(from_f64(WATER), from_f64(G))
}

/// At any tilt.
#[test]
fn a_box_in_the_water_displaces_what_is_below_the_surface() {
    let half = DVec3::new(0.5, 0.4, 0.7);
    let collider = || ColliderBuilder::cuboid(from_f64(half.x), from_f64(half.y), from_f64(half.z));
    let volume = half.element_product() * 8.0;
    // So that the surface is x = 0, as the closed form has it.
    let turn = Rotation::from_rotation_z(from_f64(-PI / 2.0));
    let mut random = Random::new(24);
    for case in 0..200 {
        let y = if case % 2 == 0 {
            0.0
        } else {
            (random.uniform() - 0.5) * 1.2
        };
        let pose = at(
            DVec3::Y * y,
            random.unit_vector() * (random.uniform() * 3.0),
        );
        let place = to_dvec3(turn * pose.translation);
        let (share, lever) = cuboid_in_half_space(half, place, turn * pose.rotation);
        let lever = to_dvec3(turn.inverse() * from_dvec3(lever));
        let (force, torque) = on(lift(), pose, collider());
        let weight = volume * WATER * G;
        let rounding = either(4e-6, 1e-7) * weight;
        let exact = DVec3::Y * share * weight;
        assert_at_most((force - exact).length(), rounding, format!("case {case}"));
        let exact = lever.cross(DVec3::Y) * weight;
        assert_at_most(
            (torque - exact).length(),
            rounding,
            format!("case {case}: torque"),
        );
    }
}

/// How high the middle of a float comes to rest in a pool under gravity, and whether it sleeps.
fn settled(shape: SharedShape, density: f64, turn: DVec3, tree: Tree) -> (f64, bool) {
    let mut world = weightless(1.0 / 60.0);
    world.gravity = Vector::Y * from_f64(-G);
    let body = RigidBodyBuilder::dynamic()
        .pose(at(DVec3::Y * 0.4, turn))
        .lock_rotations();
    let collider = ColliderBuilder::new(shape).density(from_f64(density));
    let (float, _) = world.insert(body, collider);
    let mut fields = build(tree, Scheme::KickDriftKick);
    for _ in 0..3600 {
        fields.step(&mut world).expect("a valid step");
    }
    let body = &world.bodies[float];
    (to_f64(body.translation().y), body.is_sleeping())
}

/// Floats rest within 0.1 % of their size of the depth at which they displace their weight.
#[test]
fn floats_settle_in_balance_and_sleep() {
    let pool = || {
        Tree::pool(
            Vector::ZERO,
            Vector::splat(20.0),
            from_f64(WATER),
            from_f64(G),
            5.0,
        )
    };
    // The lift ends with the basin; the drag is everywhere.
    let air = || Field::drag(2.0, 0.0).force_mode(ForceMode::Acceleration);
    let basin = || Region::cuboid(Vector::splat(10.0)).at(Vector::Y * -10.0);
    let within = || Tree::from(lift().within(basin())).sum_union(air());
    let flat = DVec3::X * (PI / 2.0);
    for (name, shape, turn, density, exact) in [
        (
            "cube",
            SharedShape::cuboid(0.5, 0.5, 0.5),
            DVec3::ZERO,
            400.0,
            0.1,
        ),
        (
            "cube on an edge",
            SharedShape::cuboid(0.5, 0.5, 0.5),
            DVec3::Z * (PI / 4.0),
            500.0,
            0.0,
        ),
        // A quarter of a ball is below t = 0.3473.
        (
            "ball",
            SharedShape::ball(0.5),
            DVec3::ZERO,
            250.0,
            0.173_648_177_7,
        ),
        (
            "upright cylinder",
            SharedShape::cylinder(0.5, 0.3),
            DVec3::ZERO,
            800.0,
            -0.3,
        ),
        // A quarter of a disc is below t = 0.4040.
        (
            "log",
            SharedShape::cylinder(0.8, 0.5),
            flat,
            250.0,
            0.201_986_3,
        ),
        (
            "capsule",
            SharedShape::capsule_y(0.5, 0.3),
            flat,
            500.0,
            0.0,
        ),
    ] {
        for (where_, tree) in [("pool", pool()), ("basin", within())] {
            let (y, asleep) = settled(shape.clone(), density, turn, tree);
            println!("{name} in a {where_}: {y:.6}, exact {exact:.6}, asleep: {asleep}");
            assert_close(y, exact, 1e-3, format!("{name} in a {where_}"));
            assert!(asleep, "{name} in a {where_}");
        }
    }
}

#[test]
fn the_potential_falls_by_the_work_of_buoyancy() {
    let energy = |y: f64| {
        let pose = at(DVec3::Y * y, DVec3::new(0.3, 0.5, -0.7));
        let collider = ColliderBuilder::cuboid(0.5, 0.4, 0.7);
        let (world, body) = one(pose.translation, pose.rotation, collider);
        let mut fields = Fields::new(lift()).expect("a sound tree");
        let energy = fields.potential_energy(&world);
        (energy.total, wrench(&mut fields, &world, body).0.y)
    };
    for y in [-0.3, 0.0, 0.2] {
        let step = 1.0 / 64.0;
        let (above, below) = (energy(y + step).0, energy(y - step).0);
        let slope = (below - above) / (2.0 * step);
        let force = energy(y).1;
        assert_close(slope / force, 1.0, 2e-3, format!("at {y}"));
    }
}

#[test]
fn explanations_of_cut_bodies_give_their_wrench() {
    let zone = || Field::uniform(Vector::Y * 4.0).within(Region::ball(2.0));
    let wall = Field::uniform(Vector::Z).within(Region::half_space(Vector::Y, 0.1));
    let replaced = Tree::from(zone().at(Vector::X * 2.3)).replace_union(wall);
    let places = [Vector::X * 2.3, Vector::new(-1.9, 0.4, 0.2)];
    // An explanation cuts a body by the borders of all instances at once, a step by those of each by itself: round
    // borders are approximated in other pieces.
    for (tree, rounding) in [
        (replaced.sum_union(lift()), either(1e-5, 1e-12)),
        (
            Tree::instances(zone(), places.map(Pose::from_translation)),
            1e-4,
        ),
    ] {
        let (world, body) = one(
            Vector::new(0.1, -0.1, 0.0),
            Rotation::from_scaled_axis(Vector::new(0.2, 0.9, -0.4)),
            ColliderBuilder::capsule_x(0.5, 0.3),
        );
        let mut fields = Fields::new(tree).expect("a sound tree");
        let (force, torque) = wrench(&mut fields, &world, body);
        let explanation = fields.explain(body, &world).expect("sampled");
        let size = force.length();
        let error = to_dvec3(explanation.wrench.force) - force;
        assert_at_most(error.length(), rounding * size, "force");
        let error = to_dvec3(explanation.wrench.torque) - torque;
        assert_at_most(error.length(), rounding * size, "torque");
        assert!(torque.length() > 1e-3 * size, "{torque}");
    }
}

/// A bar tumbles through a zone in free fall: borders do not lower the order of the scheme.
#[test]
fn tumbling_through_a_border_is_of_second_order() {
    let flight = |scheme: Scheme, steps: usize| {
        let mut world = weightless(from_f64(1.0 / steps as f64));
        world.gravity = Vector::Y * -9.81;
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::X * -1.5)
            .linvel(Vector::new(3.0, 4.0, 0.0))
            .angvel(Vector::new(0.7, 1.1, 3.0))
            .can_sleep(false);
        let (bar, _) = world.insert(body, ColliderBuilder::cuboid(1.0, 0.2, 0.1));
        let zone = Field::uniform(Vector::new(1.0, 3.0, 2.0) * 4.0)
            .force_mode(ForceMode::Acceleration)
            .within(Region::cuboid(Vector::splat(1.0)));
        let mut fields = build(zone, scheme);
        for _ in 0..steps {
            fields.step(&mut world).expect("a valid step");
        }
        let body = &world.bodies[bar];
        (
            to_dvec3(body.translation()),
            to_dvec3(*body.rotation() * Vector::X),
        )
    };
    // In `f32` the roundings of more steps add up.
    let finest = if size_of::<Real>() == 4 { 960 } else { 7680 };
    let exact = flight(Scheme::KickDriftKick, finest);
    let error =
        |(place, axis): (DVec3, DVec3)| (place - exact.0).length() + (axis - exact.1).length();
    let errors = [60, 120, 240, 480].map(|steps| error(flight(Scheme::KickDriftKick, steps)));
    println!("errors at 60, 120, 240, 480 Hz: {errors:?}");
    assert_at_most(errors[0], 0.02, "at 60 Hz");
    assert_at_most(errors[2], errors[0] / 6.0 + either(1e-4, 0.0), "at 240 Hz");
    for scheme in SCHEMES {
        let error = error(flight(scheme, 480));
        println!("{scheme:?}: {error:.1e}");
        assert_at_most(error, 0.05, format!("{scheme:?}"));
    }
}

#[test]
fn a_bar_on_ice_half_in_the_wind_turns() {
    let mut world = weightless(1.0 / 60.0);
    world.gravity = Vector::Y * -9.81;
    let floor = ColliderBuilder::cuboid(50.0, 0.5, 50.0).friction(0.0);
    world.colliders.insert(floor.translation(Vector::Y * -0.5));
    let bar = ColliderBuilder::cuboid(1.0, 0.2, 0.2)
        .friction(0.0)
        .mass(3.0);
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.2);
    let (bar, _) = world.insert(body, bar);
    let wind = Field::uniform(Vector::Z * 0.6).within(Region::half_space(Vector::X, 0.0));
    let mut fields = build(wind, Scheme::KickDriftKick);
    for _ in 0..30 {
        fields.step(&mut world).expect("a valid step");
    }
    let body = &world.bodies[bar];
    // Half the force, at a quarter of the length: 0.3 · 0.5 about y, against 3 (1 + 0.04)/3.
    // A body on a floor shows the velocity of the solver's last iteration.
    assert_close(to_f64(body.linvel().z), 0.05, 5e-4, "linear");
    let exact = 0.15 / 1.04 * 0.5;
    assert_close(to_f64(body.angvel().y), exact, exact * 1e-2, "angular");
    assert_close(to_f64(body.translation().y), 0.2, 2e-3, "height");
}

/// On a floor, half in a gravity zone.
#[test]
fn a_body_at_rest_across_a_border_sleeps() {
    let mut world = weightless(1.0 / 60.0);
    world.gravity = Vector::Y * -9.81;
    let floor = ColliderBuilder::cuboid(50.0, 0.5, 50.0);
    world.colliders.insert(floor.translation(Vector::Y * -0.5));
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
    let (cube, _) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    let lift = Field::gravity_zone(Vector::Y * 4.0, Region::half_space(Vector::X, 0.1));
    let mut fields = build(lift, Scheme::KickDriftKick);
    for _ in 0..600 {
        fields.step(&mut world).expect("a valid step");
    }
    let body = &world.bodies[cube];
    assert!(body.is_sleeping());
    assert_at_most(to_f64(body.translation().x).abs(), 1e-3, "moved");
}

/// Where a force is linear over a body, points with its second moments give force and torque as the
/// closed form does: with F = F₀ + A (x − c), the force is F₀, and the torque ε : (A M) for
/// M = ∫ (x − c)(x − c)ᵀ per volume.
#[test]
fn linear_fields_agree_with_second_moments() {
    let mut random = Random::new(25);
    let kernel = |a: [DVec3; 3], offset: DVec3| {
        let rows = a.map(from_dvec3);
        Field::closure([Axis::X, Axis::Y, Axis::Z], move |sample| {
            let p = sample.local_point;
            from_dvec3(offset) + Vector::new(rows[0].dot(p), rows[1].dot(p), rows[2].dot(p))
        })
    };
    for (name, shape) in shapes() {
        if shape.as_ball().is_some() {
            continue;
        }
        let rows = [0; 3].map(|_| random.unit_vector());
        let offset = random.unit_vector();
        let pose = at(random.unit_vector(), random.unit_vector());
        let collider = ColliderBuilder::new(shape).density(1.0);
        let (world, body) = one(pose.translation, pose.rotation, collider.clone());
        let (force, torque) = on(kernel(rows, offset), pose, collider);
        let properties = &world.bodies[body].mass_properties().local_mprops;
        let com = to_dvec3(world.bodies[body].center_of_mass());
        let mass = to_f64(properties.mass());
        let inertia = properties.reconstruct_inertia_matrix();
        let columns = [inertia.x_axis, inertia.y_axis, inertia.z_axis].map(to_dvec3);
        let trace = columns[0].x + columns[1].y + columns[2].z;
        // M u = (tr I/2 u − I u)/m, in world axes.
        let second = |u: DVec3| {
            let local = to_dvec3(pose.rotation.inverse() * from_dvec3(u));
            let turned = columns[0] * local.x + columns[1] * local.y + columns[2] * local.z;
            to_dvec3(pose.rotation * from_dvec3((local * (trace / 2.0) - turned) / mass))
        };
        let exact = offset + DVec3::from_array(rows.map(|row| row.dot(com)));
        let turns = [0, 1, 2].map(|k| second(rows[k]));
        let turn = DVec3::new(
            turns[2].y - turns[1].z,
            turns[0].z - turns[2].x,
            turns[1].x - turns[0].y,
        );
        let size = trace / mass;
        let rounding = either(2e-5, 1e-9);
        assert_at_most(
            (force - exact).length(),
            rounding * (1.0 + com.length()),
            name,
        );
        assert_at_most(
            (torque - turn).length(),
            rounding * (1.0 + size),
            format!("{name}: torque"),
        );
    }
}
