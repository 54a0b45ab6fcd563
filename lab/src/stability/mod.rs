//! Scenes of known energy that a scheme may blow up, at any ratio of step to swing, and what comes of a run.
//!
//! In each of them nothing adds energy, so what has gained any has it from the scheme.

mod map;
mod scenes;

pub use map::{SCHEMES, TURNS, map};

use super::fields;
use crate::study::StabilityCell;
use fields::math::{from_f64, to_dvec3, to_f64};
use fields::prelude::*;
use scenes::*;

pub const DT: f64 = 1.0 / 60.0;
/// So long a run is: `ExternalForce` doubles the energy of a swing of dt·ω = 0.1 in it.
pub const STEPS: usize = 200;
/// What has so many times the energy of the start has exploded.
pub const EXPLODED: f64 = 2.0;
/// A run ends here: beyond there is nothing more to learn.
const GONE: f64 = 1e12;

/// What swings, turns or slows down at a rate that is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A ball in a spring.
    Spring,
    /// A ball that swings slowly along a trough whose walls are stiff.
    Trough,
    /// A dumbbell that a field turns.
    Rotor,
    /// Two bodies on a spring that reacts, of this ratio of masses.
    Pair(f64),
    /// Ten bodies in a row on springs that react, every other one so many times as heavy.
    Chain(f64),
    /// A ball to and fro between walls of the penalty law.
    PenaltyWalls,
    /// Two balls that meet, of this ratio of masses.
    PenaltyPair(f64),
    /// Five balls squeezed in between two walls.
    PenaltyRow,
    /// An atom half inside one that stands still.
    OverlapFixed,
    /// Two atoms half inside each other.
    OverlapPair,
    /// A planet that falls towards a centre; the rate is that where it is nearest.
    Comet,
    /// A charge in a magnetic field.
    Gyration,
    /// A charge in a magnetic field and in a spring of the same rate.
    Trap,
    /// A ball that linear drag slows down.
    Drag,
    /// The same of quadratic drag, at the first speed.
    QuadraticDrag,
    /// A ball on an arm, pulled by a spring.
    Pendulum,
    /// Two bodies that are joined, in a spring.
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

/// What takes energy, by the share of the damping that stops a swing from coming back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping {
    None,
    /// Rapier's own, of all bodies.
    Rapier(f64),
    /// A drag; of contacts, that of their law.
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

    /// The damping of a law of contacts, for bodies of mass one.
    fn of_law(self, omega: f64) -> f64 {
        match self {
            Damping::Field(ratio) => 2.0 * ratio * omega,
            _ => 0.0,
        }
    }
}

/// The potential energy of what is in a world.
type Potential = Box<dyn Fn(&PhysicsWorld) -> f64>;

/// A world with fields, and what energy they give it.
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

/// What came of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fate {
    /// The largest energy as a share of that of the start, and the last.
    pub most: f64,
    pub last: f64,
    /// The step at which it had exploded.
    pub exploded: Option<usize>,
    /// The first step with a warning that has to do with stability, or that was refused.
    pub told: Option<usize>,
    pub refused: bool,
}

impl Fate {
    /// Whether it exploded before anybody was told.
    pub fn is_silent(self) -> bool {
        let told = self.told.unwrap_or(usize::MAX);
        self.exploded.is_some_and(|exploded| exploded < told)
    }
}

/// Runs a scene.
///
/// # Panics
/// If its fields are not valid, which none of [`Kind::ALL`] is.
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

/// Whether a warning tells of a scheme that does not follow its fields.
fn tells(warning: &StepWarning) -> bool {
    matches!(
        warning,
        StepWarning::Stiff { .. }
            | StepWarning::ToleranceMissed { .. }
            | StepWarning::HitInStiffField { .. }
    )
}
