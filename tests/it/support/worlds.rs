//! Small random worlds, and the queries at their bodies, derived independently.

use proptest::prelude::*;
use rapier3d_fields::field::Query;
use rapier3d_fields::math::{ColliderHandle, DVec3, RigidBodyHandle, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

/// One body: ball colliders at integer places.
#[derive(Clone, Debug)]
pub struct BodyPlan {
    pub position: [i32; 3],
    pub linvel: [i32; 3],
    pub angvel: [i32; 3],
    /// For each collider its place in the body, the power of two that is its mass, its charge,
    /// and its own value of `delta`, if it has one.
    pub parts: Vec<([i32; 3], u32, i32, Option<i32>)>,
}

/// The value of `delta` where no other is set.
pub const WORLD_DELTA: Real = 2.0;
const RADIUS: Real = 0.25;

/// The volume of a part.
fn volume() -> f64 {
    let volume = std::f64::consts::PI * 4.0 / 3.0 * to_f64(RADIUS).powi(3);
    to_f64(from_f64(volume))
}

/// One of two groups: colliders of even and of odd charge.
pub fn group(number: u32) -> InteractionGroups {
    let all = InteractionGroups::all();
    all.with_memberships(Group::from_bits_truncate(1 << number))
        .with_filter(Group::from_bits_truncate(1 << number))
}

fn group_of(charge: i32) -> InteractionGroups {
    group(charge.rem_euclid(2) as u32)
}

/// A world with its handles.
pub struct World {
    pub physics: PhysicsWorld,
    pub bodies: Vec<RigidBodyHandle>,
    pub colliders: Vec<ColliderHandle>,
    properties: Vec<(ColliderHandle, i32, Option<i32>)>,
}

pub fn vector([x, y, z]: [i32; 3]) -> Vector {
    Vector::new(x as Real, y as Real, z as Real)
}

/// Up to `most` bodies at different places. With a single part it stands at the body's origin.
pub fn bodies(
    most: usize,
    parts: std::ops::RangeInclusive<usize>,
) -> impl Strategy<Value = Vec<BodyPlan>> {
    let single = *parts.end() == 1;
    let triple = |size: i32| proptest::array::uniform3(-size..=size);
    let delta = proptest::option::of(0..=4);
    let part = (triple(1), 0..3_u32, -2..=2, delta);
    let body = (
        triple(4),
        triple(2),
        triple(2),
        proptest::collection::vec(part, parts),
    );
    proptest::collection::vec(body, 1..=most).prop_map(move |bodies| {
        let mut plans: Vec<BodyPlan> = Vec::new();
        for (position, linvel, angvel, mut parts) in bodies {
            if single {
                parts[0].0 = [0; 3];
            }
            if plans.iter().all(|plan| plan.position != position) {
                plans.push(BodyPlan {
                    position,
                    linvel,
                    angvel,
                    parts,
                });
            }
        }
        plans
    })
}

impl World {
    pub fn new(plans: &[BodyPlan]) -> Self {
        let mut world = World {
            physics: PhysicsWorld::new(),
            bodies: Vec::new(),
            colliders: Vec::new(),
            properties: Vec::new(),
        };
        for plan in plans {
            let body = RigidBodyBuilder::dynamic()
                .translation(vector(plan.position))
                .linvel(vector(plan.linvel))
                .angvel(vector(plan.angvel));
            let body = world.physics.insert_body(body);
            for (place, mass, charge, delta) in &plan.parts {
                let collider = ColliderBuilder::ball(RADIUS)
                    .translation(vector(*place))
                    .collision_groups(group_of(*charge))
                    .mass((1 << mass) as Real);
                let collider = world.physics.insert_collider(collider, Some(body));
                world.colliders.push(collider);
                world.properties.push((collider, *charge, *delta));
            }
            let PhysicsWorld {
                bodies, colliders, ..
            } = &mut world.physics;
            bodies[body].recompute_mass_properties_from_colliders(colliders);
            world.bodies.push(body);
        }
        world
    }

    /// Moves all bodies.
    pub fn move_by(&mut self, way: Vector) {
        for body in &self.bodies {
            let body = &mut self.physics.bodies[*body];
            body.set_translation(body.translation() + way, false);
        }
    }

    /// Fields for this world, with all properties set.
    pub fn fields(&self, tree: &Tree) -> Fields {
        let fields = Fields::builder(tree.clone())
            .axis("delta", WORLD_DELTA)
            .build();
        let mut fields = fields.expect("a valid tree");
        for (collider, charge, delta) in &self.properties {
            let mut properties = ColliderProperties::new().charge(*charge as Real);
            if let Some(delta) = delta {
                properties = properties.axis("delta", *delta as Real);
            }
            let set = fields.set_properties(*collider, properties, &self.physics.colliders);
            set.expect("valid properties");
        }
        fields
    }

    /// One query for each collider of a body, with the arm from the centre of mass to it.
    pub fn samples(&self, body: RigidBodyHandle) -> Vec<(Query, DVec3)> {
        let rigid_body = &self.physics.bodies[body];
        let total: Real = rigid_body
            .colliders()
            .iter()
            .map(|c| self.physics.colliders[*c].mass())
            .sum();
        let sample = |collider: &ColliderHandle| {
            let part = &self.physics.colliders[*collider];
            let place = part
                .position_wrt_parent()
                .map_or(Vector::ZERO, |pose| pose.translation);
            let arm = rigid_body.rotation() * (place - rigid_body.local_center_of_mass());
            let share = part.mass() / total;
            let (charge, delta) = self.properties_of(*collider);
            let query = Query {
                world_point: to_dvec3(self.centre_point(body) + arm),
                world_velocity: to_dvec3(rigid_body.linvel() + rigid_body.angvel().cross(arm)),
                radius: to_f64(RADIUS),
                mass: to_f64(share * rigid_body.mass()),
                share: to_f64(share),
                charge,
                volume: volume(),
                groups: part.collision_groups(),
                user: [("delta".into(), delta)].into(),
                body: Some(body),
                ..Query::default()
            };
            (query, to_dvec3(arm))
        };
        rigid_body.colliders().iter().map(sample).collect()
    }

    /// The query for a body as a whole, at its centre of mass.
    pub fn centre(&self, body: RigidBodyHandle) -> Query {
        let rigid_body = &self.physics.bodies[body];
        let samples = self.samples(body);
        let farthest = samples
            .iter()
            .map(|(_, arm)| arm.length())
            .fold(0.0, f64::max);
        Query {
            world_point: to_dvec3(self.centre_point(body)),
            world_velocity: to_dvec3(rigid_body.linvel()),
            radius: farthest + to_f64(RADIUS),
            mass: to_f64(rigid_body.mass()),
            charge: samples.iter().map(|(query, _)| query.charge).sum(),
            volume: samples.iter().map(|(query, _)| query.volume).sum(),
            user: [("delta".into(), to_f64(WORLD_DELTA))].into(),
            body: Some(body),
            ..Query::default()
        }
    }

    fn centre_point(&self, body: RigidBodyHandle) -> Vector {
        let body = &self.physics.bodies[body];
        body.position().transform_point(body.local_center_of_mass())
    }

    fn properties_of(&self, collider: ColliderHandle) -> (f64, f64) {
        let mut entries = self.properties.iter();
        let found = entries.find(|(known, ..)| *known == collider);
        let (_, charge, delta) = found.expect("a collider of this world");
        let delta = delta.map_or(to_f64(WORLD_DELTA), f64::from);
        (f64::from(*charge), delta)
    }
}
