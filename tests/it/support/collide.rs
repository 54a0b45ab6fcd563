//! Small worlds in which bodies collide, and their energy and momenta, summed in `f64`.

use rapier3d_fields::math::{DVec3, Real, Vector, from_f64, to_dpose3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, either, weightless};

/// Newton's law without loss.
pub const ELASTIC: ContactLaw = ContactLaw::elastic();

/// A step so short that nothing moves by as much as rounding.
pub const INSTANT: Real = 1e-17;

/// A body with its colliders.
#[derive(Clone, Debug)]
pub struct Thing {
    pub body: RigidBodyHandle,
    pub parts: Vec<ColliderHandle>,
}

/// A world without gravity, in which Rapier's contacts are exact.
pub fn arena(dt: Real) -> PhysicsWorld {
    let mut world = weightless(dt);
    world.integration_parameters.contact_recycling = false;
    world.integration_parameters.max_ccd_substeps = 0;
    world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
    world
}

/// An [`arena`] with steps of negligible length.
pub fn still_arena() -> PhysicsWorld {
    arena(INSTANT)
}

/// A frictionless ball of radius 0.5, elastic for Rapier.
pub fn ball(world: &mut PhysicsWorld, mass: Real, position: Vector, linvel: Vector) -> Thing {
    let body = RigidBodyBuilder::dynamic().linvel(linvel).can_sleep(false);
    insert_ball(world, body.translation(position), mass)
}

/// Keeps Rapier's solver, but not the fields, from answering the contacts of some things.
pub fn unsolved(world: &mut PhysicsWorld, things: &[&Thing]) {
    for part in parts(things) {
        world.colliders[part].set_solver_groups(InteractionGroups::none());
    }
}

/// Keeps Rapier, but not the fields, from detecting the contacts of a thing.
pub fn unseen(world: &mut PhysicsWorld, thing: &Thing) {
    for part in &thing.parts {
        world.colliders[*part].set_active_collision_types(ActiveCollisionTypes::empty());
    }
}

/// A ball of radius 0.5 on a body.
pub fn insert_ball(world: &mut PhysicsWorld, body: RigidBodyBuilder, mass: Real) -> Thing {
    insert(
        world,
        body,
        [ColliderBuilder::ball(0.5).mass(mass).friction(0.0)],
    )
}

/// A body with any colliders.
pub fn insert(
    world: &mut PhysicsWorld,
    body: RigidBodyBuilder,
    parts: impl IntoIterator<Item = ColliderBuilder>,
) -> Thing {
    let body = world.bodies.insert(body);
    let parts = parts
        .into_iter()
        .map(|part| {
            world
                .colliders
                .insert_with_parent(part, body, &mut world.bodies)
        })
        .collect();
    // Rapier would do this in its next step.
    world.bodies[body].recompute_mass_properties_from_colliders(&world.colliders);
    Thing { body, parts }
}

/// Four balls of radius 0.5 at the corners of an irregular tetrahedron, on an asymmetric top.
pub fn asymmetric(world: &mut PhysicsWorld, body: RigidBodyBuilder, mass: Real) -> Thing {
    let inertia = Vector::new(0.7, 1.1, 1.5) * mass;
    let properties = MassProperties::new(Vector::ZERO, mass, inertia);
    let body = body
        .additional_mass_properties(properties)
        .allow_fast_rotation(true)
        .can_sleep(false);
    insert(world, body, corners())
}

fn corners() -> [ColliderBuilder; 4] {
    let places = [
        Vector::new(1.0, 0.1, 0.0),
        Vector::new(-0.8, 0.7, 0.1),
        Vector::new(-0.3, -0.9, 0.4),
        Vector::new(0.2, 0.1, -0.9),
    ];
    places.map(|place| ColliderBuilder::ball(0.5).translation(place).density(0.0))
}

/// Detection fields around colliders, all of one law.
pub fn touch(parts: impl IntoIterator<Item = ColliderHandle>, law: ContactLaw) -> Tree {
    let fields = parts
        .into_iter()
        .map(|part| Field::contact(law).at(part).into());
    Tree::fold::<Tree>(Operator::SumUnion, fields)
}

/// Fields that detect at all parts of some things.
pub fn detect(things: &[&Thing], law: ContactLaw) -> Fields {
    Fields::new(touch(parts(things), law)).expect("a valid tree")
}

/// The same, with the cross-check.
pub fn cross_checked(things: &[&Thing], law: ContactLaw) -> Fields {
    let builder = Fields::builder(touch(parts(things), law)).cross_check(true);
    builder.build().expect("a valid tree")
}

/// The colliders of some things.
pub fn parts(things: &[&Thing]) -> Vec<ColliderHandle> {
    things
        .iter()
        .flat_map(|thing| thing.parts.clone())
        .collect()
}

/// Steps, and returns the number of contacts.
#[track_caller]
pub fn step(fields: &mut Fields, world: &mut PhysicsWorld) -> usize {
    fields.step(world).expect("a step").contacts
}

/// The velocity of a body.
pub fn linvel(world: &PhysicsWorld, thing: &Thing) -> Vector {
    world.bodies[thing.body].linvel()
}

/// Energy and momenta of all dynamic bodies.
#[derive(Clone, Copy, Debug, Default)]
pub struct Totals {
    pub energy: f64,
    pub momentum: DVec3,
    /// About the origin.
    pub angular_momentum: DVec3,
    /// Sums of the magnitudes of each body's momenta.
    pub momentum_scale: f64,
    pub angular_scale: f64,
}

impl Totals {
    /// Sums over all dynamic bodies, at their present poses.
    pub fn of(world: &PhysicsWorld) -> Self {
        let mut sum = Totals::default();
        for (_, body) in world.bodies.iter().filter(|(_, body)| body.is_dynamic()) {
            sum.add(body);
        }
        sum
    }

    fn add(&mut self, body: &RigidBody) {
        let pose = to_dpose3(body.position());
        let com = pose.transform_point(to_dvec3(body.local_center_of_mass()));
        let momentum = to_f64(body.mass()) * to_dvec3(body.linvel());
        let local = body.mass_properties().local_mprops;
        let frame = local.principal_inertia_local_frame;
        let axes = to_dpose3(&Pose::from_parts(Vector::ZERO, *body.rotation() * frame)).rotation;
        let angvel = to_dvec3(body.angvel());
        let spin = axes * (to_dvec3(local.principal_inertia()) * (axes.inverse() * angvel));
        self.energy += 0.5 * (momentum.dot(to_dvec3(body.linvel())) + spin.dot(angvel));
        self.momentum += momentum;
        self.angular_momentum += com.cross(momentum) + spin;
        self.momentum_scale += momentum.length();
        self.angular_scale += com.length() * momentum.length() + spin.length();
    }

    /// Fails unless momentum and angular momentum are the same up to `roundings` units in the last place of their
    /// scales.
    #[track_caller]
    pub fn assert_momenta_kept(&self, then: &Totals, roundings: f64) {
        self.assert_momentum_kept(then, roundings);
        self.assert_angular_momentum_kept(then, roundings * to_f64(Real::EPSILON));
    }

    /// The angular momentum alone, within a part of its scale.
    #[track_caller]
    pub fn assert_angular_momentum_kept(&self, then: &Totals, part: f64) {
        let angular = self.angular_momentum.distance(then.angular_momentum);
        let scale = self.angular_scale.max(then.angular_scale);
        assert_at_most(angular, part * scale, "angular momentum");
    }

    /// The linear momentum alone.
    #[track_caller]
    pub fn assert_momentum_kept(&self, then: &Totals, roundings: f64) {
        let unit = roundings * to_f64(Real::EPSILON);
        let linear = self.momentum.distance(then.momentum);
        let scale = self.momentum_scale.max(then.momentum_scale);
        assert_at_most(linear, unit * scale, "momentum");
    }

    /// Like [`assert_momenta_kept`](Self::assert_momenta_kept), for the energy as well.
    #[track_caller]
    pub fn assert_kept(&self, then: &Totals, roundings: f64) {
        self.assert_momenta_kept(then, roundings);
        let change = (then.energy - self.energy).abs();
        let unit = roundings * to_f64(Real::EPSILON);
        assert_at_most(change, unit * self.energy.max(then.energy), "energy");
    }
}

/// Fails unless two vectors are within `tolerance` of each other.
#[track_caller]
pub fn assert_near(found: Vector, expected: Vector, tolerance: f64, place: &str) {
    let error = to_dvec3(found).distance(to_dvec3(expected));
    assert!(
        error <= tolerance,
        "{place}: found {found}, expected {expected}, error {error:.1e} exceeds {tolerance:.1e}"
    );
}

/// A few roundings of numbers of the size of one.
pub fn rounding() -> f64 {
    either(2e-6, 4e-15)
}

/// Two balls of radius 0.5 that overlap by a tenth along x, and their world.
pub fn overlapping(velocities: [Vector; 2], masses: [Real; 2]) -> (PhysicsWorld, [Thing; 2]) {
    let mut world = still_arena();
    let places = [-0.45, 0.45].map(|x| Vector::X * from_f64(x));
    let things = [0, 1].map(|i| ball(&mut world, masses[i], places[i], velocities[i]));
    (world, things)
}
