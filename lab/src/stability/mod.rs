//! Scenes of known energy in which a scheme may be unstable, at any ratio of time step to period, and the outcome of
//! their runs.
//!
//! Nothing in the scenes adds energy: any gain is an error of the scheme.

mod map;
mod scenes;

pub use map::{SCHEMES, TURNS, map};

use super::fields;
use crate::study::StabilityCell;
use fields::math::{from_f64, to_dvec3, to_f64};
use fields::prelude::*;
use scenes::*;

pub const DT: f64 = 1.0 / 60.0;
/// Steps of a run, in which `ExternalForce` doubles the energy of an oscillation with dt·ω = 0.1.
pub const STEPS: usize = 200;
/// A run has exploded if its energy exceeds the initial one by this factor.
pub const EXPLODED: f64 = 2.0;
/// A run ends if its energy exceeds the initial one by this factor.
const GONE: f64 = 1e12;

/// A kind of scene that oscillates, rotates or slows down at a given rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A ball on a spring.
    Spring,
    /// A ball that oscillates slowly along a trough with stiff walls.
    Trough,
    /// A dumbbell that a field rotates.
    Rotor,
    /// Two bodies of this ratio of masses, joined by a spring field that acts on both.
    Pair(f64),
    /// Ten bodies in a row, joined by spring fields that act on both ends; every other one is heavier by this factor.
    Chain(f64),
    /// A ball that bounces between walls, by the penalty law.
    PenaltyWalls,
    /// Two balls of this ratio of masses that collide, by the penalty law.
    PenaltyPair(f64),
    /// Five balls compressed between two walls, by the penalty law.
    PenaltyRow,
    /// An atom at half of the Lennard-Jones σ from a fixed one.
    OverlapFixed,
    /// Two atoms at half of the Lennard-Jones σ from each other.
    OverlapPair,
    /// A body on an eccentric orbit, whose rate is that at its pericentre.
    Comet,
    /// A charge in a magnetic field.
    Gyration,
    /// A charge in a magnetic field and on a spring of the same rate.
    Trap,
    /// A ball that linear drag slows down.
    Drag,
    /// The same with quadratic drag, whose rate is that at the initial speed.
    QuadraticDrag,
    /// A ball on an arm, pulled by a spring.
    Pendulum,
    /// Two bodies with a fixed joint, on a spring.
    Rod,
    /// The pendulum as a multibody.
    Link,
}

impl Kind {
    pub const ALL: [Kind; 21] = [
        Kind::Spring,
        Kind::Trough,
        Kind::Rotor,
        Kind::Pair(1.0),
        Kind::Pair(100.0),
        Kind::Chain(1.0),
        Kind::Chain(100.0),
        Kind::PenaltyWalls,
        Kind::PenaltyPair(1.0),
        Kind::PenaltyPair(100.0),
        Kind::PenaltyRow,
        Kind::OverlapFixed,
        Kind::OverlapPair,
        Kind::Comet,
        Kind::Gyration,
        Kind::Trap,
        Kind::Drag,
        Kind::QuadraticDrag,
        Kind::Pendulum,
        Kind::Rod,
        Kind::Link,
    ];

    /// The scene whose fastest rate is `omega`.
    pub fn scene(self, omega: f64, damping: Damping) -> Scene {
        let mut scene = match self {
            Kind::Spring => spring(omega),
            Kind::Trough => trough(omega),
            Kind::Rotor => rotor(omega),
            Kind::Pair(ratio) => chain(omega, &[1.0, ratio]),
            Kind::Chain(ratio) => chain(omega, &[1.0, ratio].repeat(5)),
            Kind::PenaltyWalls => penalty_walls(omega, damping),
            Kind::PenaltyPair(ratio) => penalty_pair(omega, ratio, damping),
            Kind::PenaltyRow => penalty_row(omega, damping),
            Kind::OverlapFixed => overlap_fixed(omega),
            Kind::OverlapPair => overlap_pair(omega),
            Kind::Comet => comet(omega),
            Kind::Gyration => gyration(omega),
            Kind::Trap => trap(omega),
            Kind::Drag => drag(omega, false),
            Kind::QuadraticDrag => drag(omega, true),
            Kind::Pendulum => pendulum(omega, false),
            Kind::Link => pendulum(omega, true),
            Kind::Rod => rod(omega),
        };
        if !self.touches() || matches!(damping, Damping::Rapier(_)) {
            scene.damp(omega, damping);
        }
        scene
    }

    /// Whether its contacts are damped by their law.
    fn touches(self) -> bool {
        matches!(
            self,
            Kind::PenaltyWalls | Kind::PenaltyPair(_) | Kind::PenaltyRow
        )
    }
}

/// Damping, by its ratio to critical damping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    None,
    /// Rapier's damping of all bodies.
    Rapier(f64),
    /// A drag field, or for contacts the damping of their law.
    Field(f64),
}

impl Damping {
    pub const ALL: [Damping; 5] = [
        Damping::None,
        Damping::Rapier(0.05),
        Damping::Rapier(5.0),
        Damping::Field(0.05),
        Damping::Field(5.0),
    ];

    /// The damping of a contact law, for bodies of mass one.
    fn of_law(self, omega: f64) -> f64 {
        match self {
            Damping::Field(ratio) => 2.0 * ratio * omega,
            _ => 0.0,
        }
    }
}

/// The potential energy of a world.
type Potential = Box<dyn Fn(&PhysicsWorld) -> f64>;

/// A world with fields, and their potential energy.
pub struct Scene {
    world: PhysicsWorld,
    tree: Tree,
    charged: Vec<(ColliderHandle, f64)>,
    potential: Potential,
}

impl Scene {
    fn new(
        world: PhysicsWorld,
        tree: impl Into<Tree>,
        potential: impl Fn(&PhysicsWorld) -> f64 + 'static,
    ) -> Self {
        Scene {
            world,
            tree: tree.into(),
            charged: Vec::new(),
            potential: Box::new(potential),
        }
    }

    fn damp(&mut self, omega: f64, damping: Damping) {
        match damping {
            Damping::None => {}
            Damping::Rapier(ratio) => {
                for (_, body) in self.world.bodies.iter_mut() {
                    body.set_linear_damping(from_f64(2.0 * ratio * omega));
                    body.set_angular_damping(from_f64(2.0 * ratio * omega));
                }
            }
            Damping::Field(ratio) => {
                let drag = Field::drag(from_f64(2.0 * ratio * omega), 0.0);
                self.tree = std::mem::take(&mut self.tree).sum_union(drag);
            }
        }
    }

    fn energy(&self) -> f64 {
        let bodies = self.world.bodies.iter();
        let kinetic = bodies.map(|(_, body)| {
            let turning = body.mass_properties().local_mprops.principal_inertia();
            let spin = body.rotation().inverse() * body.angvel();
            let [moments, spin] = [turning, spin].map(to_dvec3);
            let speed2 = to_dvec3(body.linvel()).length_squared();
            to_f64(body.mass()) * speed2 + (moments * spin * spin).element_sum()
        });
        0.5 * kinetic.sum::<f64>() + (self.potential)(&self.world)
    }
}

/// The outcome of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fate {
    /// The largest and the last energy, relative to the initial one.
    pub most: f64,
    pub last: f64,
    /// The first step at which it had exploded.
    pub exploded: Option<usize>,
    /// The first step that gave a warning about stability, or that was refused.
    pub told: Option<usize>,
    pub refused: bool,
}

impl Fate {
    /// Whether it exploded before any warning.
    pub fn is_silent(self) -> bool {
        let told = self.told.unwrap_or(usize::MAX);
        self.exploded.is_some_and(|exploded| exploded < told)
    }
}

/// Runs a scene.
///
/// # Panics
/// If its fields are not valid; those of [`Kind::ALL`] are.
pub fn fate(mut scene: Scene, scheme: Scheme) -> Fate {
    let builder = Fields::builder(std::mem::take(&mut scene.tree)).scheme(scheme);
    let mut fields = builder.build().expect("a valid tree");
    for (part, charge) in &scene.charged {
        let charge = ColliderProperties::new().charge(from_f64(*charge));
        let set = fields.set_properties(*part, charge, &scene.world.colliders);
        set.expect("a collider of the world");
    }
    let first = scene.energy();
    let mut fate = Fate::default();
    for step in 0..STEPS {
        fate.refused = fields.step(&mut scene.world).is_err();
        if fate.refused || fields.warnings().iter().any(tells) {
            fate.told.get_or_insert(step);
        }
        let share = scene.energy() / first;
        let share = if share.is_nan() { f64::INFINITY } else { share };
        fate.last = share;
        fate.most = fate.most.max(share);
        if share > EXPLODED {
            fate.exploded.get_or_insert(step);
        }
        if fate.refused || share > GONE {
            break;
        }
    }
    fate
}

/// Whether a warning is about a scheme that cannot resolve its fields.
fn tells(warning: &StepWarning) -> bool {
    matches!(
        warning,
        StepWarning::Stiff { .. }
            | StepWarning::ToleranceMissed { .. }
            | StepWarning::HitInStiffField { .. }
    )
}
