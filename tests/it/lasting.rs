//! Lasting contacts: bodies come to rest and sleep, compared with Rapier alone in the same world.

mod jointed;
mod matrix;
mod owners;
mod quiet;
mod rebounds;
mod sleepers;
mod stacks;
mod users;

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::{Detection, Responder};

use crate::support::*;

/// The side that answers contacts in a world; by fields, with their detection.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Rapier,
    Both,
    Discrete,
    Swept,
}

const FIELDS: [Way; 2] = [Way::Discrete, Way::Swept];

/// The material of both colliders of a contact.
#[derive(Clone, Copy, Debug)]
struct Stuff {
    restitution: f64,
    friction: f64,
}

impl Stuff {
    fn of(self, collider: ColliderBuilder) -> ColliderBuilder {
        collider
            .restitution(from_f64(self.restitution))
            .friction(from_f64(self.friction))
    }

    fn law(self) -> ContactLaw {
        let law = ContactLaw::restitution(from_f64(self.restitution));
        law.with_friction(from_f64(self.friction))
    }
}

/// A world under gravity, with the bodies to be examined.
struct Scene {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    stuff: Stuff,
}

impl Scene {
    fn new(stuff: Stuff, hertz: u32) -> Self {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::Y * -9.81;
        world.integration_parameters.dt = from_f64(f64::from(hertz).recip());
        Scene {
            world,
            bodies: Vec::new(),
            stuff,
        }
    }

    /// A slab whose upper side is at height zero.
    fn floor(&mut self) {
        let slab = ColliderBuilder::cuboid(30.0, 0.5, 30.0).translation(Vector::Y * -0.5);
        self.fixed(slab);
    }

    fn fixed(&mut self, collider: ColliderBuilder) {
        let collider = self.stuff.of(collider);
        self.world.insert(RigidBodyBuilder::fixed(), collider);
    }

    fn add(&mut self, body: RigidBodyBuilder, collider: ColliderBuilder) {
        let (body, _) = self.world.insert(body, self.stuff.of(collider));
        self.bodies.push(body);
    }

    /// Contact fields on all colliders that answer in a way, and a force on all bodies.
    fn fields(&self, way: Way, force: Option<Tree>) -> Fields {
        let law = self.stuff.law();
        let colliders = self.world.colliders.iter().map(|(handle, _)| handle);
        let contacts = colliders.map(|it| Tree::from(Field::contact(law).at(it)));
        let builder = Fields::builder(Tree::fold(Operator::SumUnion, contacts.chain(force)));
        let builder = match way {
            Way::Rapier => builder.responder(Responder::Rapier),
            Way::Both => builder.responder(Responder::Both),
            Way::Discrete => builder,
            Way::Swept => builder.detection(Detection::Swept),
        };
        builder.build().expect("a valid tree")
    }

    fn places(&self) -> Vec<Vector> {
        let bodies = self.bodies.iter();
        bodies
            .map(|body| self.world.bodies[*body].translation())
            .collect()
    }

    fn asleep(&self) -> bool {
        let mut bodies = self.bodies.iter();
        bodies.all(|body| self.world.bodies[*body].is_sleeping())
    }

    /// Kinetic and potential energy of all bodies.
    fn energy(&self) -> f64 {
        let bodies = self.bodies.iter().map(|body| &self.world.bodies[*body]);
        let energy = |body: &RigidBody| {
            to_f64(body.kinetic_energy()) + 9.81 * to_f64(body.mass() * body.center_of_mass().y)
        };
        bodies.map(energy).sum()
    }

    /// The deepest overlap of two colliders, by Rapier's own contacts.
    fn overlap(&self) -> f64 {
        let pairs = self.world.narrow_phase.contact_pairs();
        let manifolds = pairs.flat_map(|pair| pair.manifolds());
        let points = manifolds.flat_map(|manifold| &manifold.points);
        points.map(|point| -to_f64(point.dist)).fold(0.0, f64::max)
    }
}

/// How a scene ended.
#[derive(Debug)]
struct End {
    scene: Scene,
    start: Vec<Vector>,
    /// The step since which all bodies have slept.
    asleep_at: Option<usize>,
    /// The largest overlap at the end of a step, in the last half.
    overlap: f64,
    /// The largest gain of energy after any step, as a share of that at the start.
    gained: f64,
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} bodies", self.bodies.len())
    }
}

/// Runs a scene in a way for some seconds.
fn run(mut scene: Scene, way: Way, seconds: f64) -> End {
    // Rapier does not recycle contacts that have a hook; so that all ways are alike, it recycles none.
    scene.world.integration_parameters.contact_recycling = false;
    let mut fields = scene.fields(way, None);
    let steps = (seconds / to_f64(scene.world.integration_parameters.dt)).round() as usize;
    let (start, energy) = (scene.places(), scene.energy());
    let (mut asleep_at, mut overlap, mut gained) = (None, 0.0_f64, f64::NEG_INFINITY);
    for number in 0..steps {
        if way == Way::Rapier {
            scene.world.step();
        } else {
            let outcome = fields.step(&mut scene.world).expect("a step");
            assert!(!outcome.exhausted, "{way:?}, step {number}");
        }
        if !scene.asleep() {
            asleep_at = None;
        } else if asleep_at.is_none() {
            asleep_at = Some(number);
        }
        if number > steps / 2 {
            overlap = overlap.max(scene.overlap());
        }
        gained = gained.max(scene.energy() / energy - 1.0);
    }
    assert!(fields.warnings().is_empty(), "{:?}", fields.warnings());
    End {
        scene,
        start,
        asleep_at,
        overlap,
        gained,
    }
}
