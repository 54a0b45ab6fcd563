//! Worlds of every kind of body, shape and joint.

use rapier3d_fields::prelude::*;

use crate::draw::Draw;

fn shape(draw: &mut Draw, is_fixed: bool) -> SharedShape {
    let [a, b, c] = [draw.size(), draw.size(), draw.size()];
    let points = |draw: &mut Draw| (0..8).map(|_| draw.vector(1.0)).collect::<Vec<_>>();
    match draw.below(if is_fixed { 14 } else { 11 }) {
        0..3 => SharedShape::ball(a),
        3..5 => SharedShape::cuboid(a, b, c),
        5 => SharedShape::capsule_y(a, b),
        6 => SharedShape::cylinder(a, b),
        7 => SharedShape::cone(a, b),
        8 => SharedShape::round_cuboid(a, b, c, 0.1),
        9 => {
            let points = points(draw);
            SharedShape::convex_hull(&points).unwrap_or_else(|| SharedShape::ball(a))
        }
        10 => {
            let parts = [SharedShape::ball(a), SharedShape::cuboid(b, b, c)];
            SharedShape::compound(parts.map(|part| (draw.pose(1.0), part)).into())
        }
        11 => SharedShape::halfspace(Vector::Y),
        12 => {
            let heights = Array2::new(5, 5, (0..25).map(|_| draw.between(-0.5, 0.5)).collect());
            SharedShape::heightfield(heights, Vector::new(20.0, 1.0, 20.0))
        }
        _ => {
            let points = points(draw);
            let faces = vec![[0, 1, 2], [2, 3, 4], [4, 5, 6], [6, 7, 0]];
            SharedShape::trimesh(points, faces).unwrap_or_else(|_| SharedShape::ball(a))
        }
    }
}

fn collider(draw: &mut Draw, is_fixed: bool) -> ColliderBuilder {
    let mut collider = ColliderBuilder::new(shape(draw, is_fixed))
        .friction(draw.between(0.0, 1.0))
        .restitution(draw.between(0.0, 1.0))
        .sensor(draw.once_in(12))
        .enabled(!draw.once_in(20));
    collider = match draw.below(12) {
        0 => collider.density(0.0),
        1 => collider.mass(1e6),
        2 => collider.mass(1e-6),
        3 => collider.position(draw.pose(1.0)),
        4 => collider.collision_groups(InteractionGroups::none()),
        _ => collider,
    };
    collider
}

pub fn body(draw: &mut Draw) -> (RigidBodyBuilder, Vec<ColliderBuilder>) {
    let kind = draw.below(8);
    let builder = match kind {
        0 => RigidBodyBuilder::fixed(),
        1 => RigidBodyBuilder::kinematic_position_based(),
        2 => RigidBodyBuilder::kinematic_velocity_based(),
        _ => RigidBodyBuilder::dynamic(),
    };
    let speed = draw.of(&[0.0, 1.0, 1.0, 10.0, 200.0]);
    let mut builder = builder
        .pose(draw.pose(6.0))
        .linvel(draw.vector(speed))
        .angvel(draw.vector(speed))
        .can_sleep(!draw.once_in(4))
        .sleeping(draw.once_in(8))
        .ccd_enabled(draw.once_in(6))
        .gravity_scale(draw.of(&[1.0, 1.0, 0.0, -1.0, 3.0]))
        .enabled(!draw.once_in(20));
    builder = match draw.below(14) {
        0 => builder.lock_rotations(),
        1 => builder.lock_translations(),
        2 => builder.enabled_rotations(true, false, true),
        3 => builder.linear_damping(draw.between(0.0, 20.0)),
        4 => builder.angular_damping(draw.between(0.0, 20.0)),
        5 => builder.dominance_group(1),
        6 => builder.additional_mass(draw.between(0.0, 50.0)),
        7 => builder.soft_ccd_prediction(1.0),
        8 => builder.gyroscopic_forces_enabled(true),
        _ => builder,
    };
    let count = draw.of(&[0, 1, 1, 1, 1, 2, 3]);
    let colliders = (0..count).map(|_| collider(draw, kind == 0));
    (builder, colliders.collect())
}

pub fn insert(draw: &mut Draw, world: &mut PhysicsWorld) -> RigidBodyHandle {
    let (body, colliders) = body(draw);
    let body = world.insert_body(body);
    for collider in colliders {
        world.insert_collider(collider, Some(body));
    }
    if draw.once_in(10) {
        let body = &mut world.bodies[body];
        body.add_force(draw.vector(10.0), true);
        body.add_torque(draw.vector(1.0), true);
    }
    body
}

/// Joins two bodies by an impulse joint, or, with `links`, as links of a multibody if both are dynamic.
fn join(draw: &mut Draw, world: &mut PhysicsWorld, all: &[RigidBodyHandle], links: bool) {
    let (a, b) = (draw.of(all), draw.of(all));
    if a == b {
        return;
    }
    let [at, there] = [draw.vector(1.0), draw.vector(1.0)];
    let joint: GenericJoint = match draw.below(4) {
        0 => SphericalJointBuilder::new()
            .local_anchor1(at)
            .local_anchor2(there)
            .into(),
        1 => RevoluteJointBuilder::new(Vector::Z)
            .local_anchor1(at)
            .local_anchor2(there)
            .into(),
        2 => PrismaticJointBuilder::new(Vector::X)
            .local_anchor1(at)
            .local_anchor2(there)
            .into(),
        _ => FixedJointBuilder::new().into(),
    };
    // Rapier panics at links that are not dynamic, and at some bodies with joints of both kinds.
    let is_dynamic = |body: RigidBodyHandle| world.bodies[body].is_dynamic();
    if !links {
        world.impulse_joints.insert(a, b, joint, true);
    } else if is_dynamic(a) && is_dynamic(b) {
        let _ = world.multibody_joints.insert(a, b, joint, true);
    }
}

pub fn world(draw: &mut Draw) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = draw.of(&[
        Vector::Y * -9.81,
        Vector::Y * -9.81,
        Vector::ZERO,
        Vector::X * 3.0,
    ]);
    world.integration_parameters.dt = draw.of(&[1.0 / 60.0, 1.0 / 60.0, 1e-3, 0.1, 0.0, 1e-6]);
    world.integration_parameters.num_solver_iterations = draw.of(&[4, 4, 1, 8]);
    if draw.once_in(2) {
        let floor = world.insert_body(RigidBodyBuilder::fixed());
        let ground = ColliderBuilder::cuboid(20.0, 1.0, 20.0).translation(Vector::Y * -4.0);
        world.insert_collider(ground, Some(floor));
    }
    let count = 1 + draw.below(9);
    let all: Vec<_> = (0..count).map(|_| insert(draw, &mut world)).collect();
    if draw.once_in(3) {
        let links = draw.once_in(3);
        for _ in 0..1 + draw.below(4) {
            join(draw, &mut world, &all, links);
        }
    }
    if draw.once_in(10) {
        let alone = collider(draw, true);
        world.insert_collider(alone, None);
    }
    world
}
