//! `Auto` over hundreds of steps: random bodies in wells, on arms and under mutual forces keep their energy within the
//! tolerance, or a step warns.

use rapier3d_fields::math::{DVec3, Real, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::numbers::Numbers;
use crate::support::{build, either, weightless};

const DT: f64 = 1.0 / 60.0;
const STEPS: usize = 400;
/// Number of scenes of each kind.
const CASES: u64 = 56;
const CENTRE: DVec3 = DVec3::new(0.5, 0.2, -0.1);

/// The force between two points, or between a point and a centre, and its potential.
#[derive(Clone, Copy, Debug)]
enum Law {
    Spring {
        stiffness: f64,
    },
    RestLength {
        stiffness: f64,
        rest: f64,
    },
    Softened {
        strength: f64,
        softening: f64,
    },
    Morse {
        depth: f64,
        steepness: f64,
        rest: f64,
    },
    Gaussian {
        depth: f64,
        width: f64,
    },
    LennardJones {
        depth: f64,
        size: f64,
    },
    Hertz {
        stiffness: f64,
        diameter: f64,
    },
}

impl Law {
    fn field(self) -> Field {
        let field = match self {
            Law::Spring { stiffness } => Field::spring(from_f64(stiffness)),
            Law::RestLength { stiffness, rest } => {
                Field::spring_damper(from_f64(stiffness), 0.0, from_f64(rest))
            }
            Law::Softened {
                strength,
                softening,
            } => Field::radial(-from_f64(strength), -2.0).softened(from_f64(softening)),
            Law::Morse {
                depth,
                steepness,
                rest,
            } => Field::morse(from_f64(depth), from_f64(steepness), from_f64(rest)),
            Law::Gaussian { depth, width } => Field::gaussian(from_f64(-depth), from_f64(width)),
            Law::LennardJones { depth, size } => {
                Field::lennard_jones(from_f64(depth), from_f64(size))
            }
            Law::Hertz {
                stiffness,
                diameter,
            } => Field::hertz(from_f64(stiffness), from_f64(diameter)),
        };
        field.coupled_to(Coupling::Each)
    }

    /// Zero at its minimum.
    fn potential(self, r: f64) -> f64 {
        match self {
            Law::Spring { stiffness } => 0.5 * stiffness * r * r,
            Law::RestLength { stiffness, rest } => 0.5 * stiffness * (r - rest).powi(2),
            Law::Softened {
                strength,
                softening,
            } => strength * (1.0 / softening - 1.0 / r.hypot(softening)),
            Law::Morse {
                depth,
                steepness,
                rest,
            } => depth * (1.0 - (-steepness * (r - rest)).exp()).powi(2),
            Law::Gaussian { depth, width } => depth * (1.0 - (-0.5 * (r / width).powi(2)).exp()),
            Law::LennardJones { depth, size } => {
                let sixth = (size / r).powi(6);
                4.0 * depth * (sixth * sixth - sixth) + depth
            }
            Law::Hertz {
                stiffness,
                diameter,
            } => 0.4 * stiffness * (diameter - r).max(0.0).powf(2.5),
        }
    }
}

/// The bodies of a scene.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// A ball in a well.
    Ball,
    /// Two balls on one body of unequal moments of inertia, each in the well.
    Arm,
    /// Some balls that act on each other.
    Together(usize),
}

struct Scene {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    law: Law,
    is_well: bool,
    tolerance: f64,
}

impl Scene {
    fn new(kind: Kind, number: u64) -> Self {
        let mut random = Numbers::new(number);
        // In f32 the rounding of forces is not negligible.
        let tolerance = random.within(either(1e-3, 1e-4), 0.1);
        let omega = random.within(0.1, 3.0) / DT;
        let stiffness = omega * omega;
        let softening = random.within(0.2, 0.5);
        let law = match (kind, number % 7) {
            (_, 0) => Law::Spring { stiffness },
            // Not for arms and groups: they may pass r = 0, where this force jumps, between two points of their path.
            (Kind::Ball, 1) => Law::RestLength {
                stiffness,
                rest: random.within(0.2, 0.4),
            },
            (_, 2) => Law::Morse {
                depth: stiffness * 0.05,
                steepness: random.within(1.0, 8.0),
                rest: random.within(0.2, 0.4),
            },
            (_, 3) => {
                let width = random.within(0.2, 0.5);
                let depth = stiffness * width * width;
                Law::Gaussian { depth, width }
            }
            (_, 4) => {
                let size = random.within(0.15, 0.3);
                let depth = stiffness * size * size / 57.0;
                Law::LennardJones { depth, size }
            }
            (_, 5) => Law::Hertz {
                stiffness,
                diameter: random.within(0.4, 1.2),
            },
            _ => Law::Softened {
                strength: stiffness * softening.powi(3),
                softening,
            },
        };
        let mut world = weightless(from_f64(DT));
        world.integration_parameters.normalized_max_linear_velocity = Real::MAX;
        let mut scene = Scene {
            world,
            bodies: Vec::new(),
            law,
            is_well: !matches!(kind, Kind::Together(_)),
            tolerance,
        };
        let count = match kind {
            Kind::Together(count) => count,
            _ => 1,
        };
        for number in 0..count {
            scene.insert(kind, DVec3::X * number as f64, omega, &mut random);
        }
        // One step, so that Rapier computes the centres of mass.
        scene.world.step();
        scene
    }

    fn insert(&mut self, kind: Kind, near: DVec3, omega: f64, random: &mut Numbers) {
        let position = near + random.direction() * 0.2;
        // Across, so that it passes beside the centre.
        let across = random.direction().cross(position - CENTRE);
        let linvel = across * (0.5 * omega * random.within(0.5, 1.0));
        let angvel = random.direction() * (omega * random.within(0.05, 0.5));
        let body = RigidBodyBuilder::dynamic()
            .translation(from_dvec3(position))
            .linvel(from_dvec3(linvel))
            .angvel(from_dvec3(angvel))
            .can_sleep(false);
        let body = self.world.bodies.insert(body);
        self.world.bodies[body].set_allow_fast_rotation(true);
        let mass = random.within(0.3, 3.0);
        let axis = random.direction() * 0.3;
        let arms = match kind {
            Kind::Arm => vec![axis, random.direction() * 0.1 - axis],
            _ => vec![DVec3::ZERO],
        };
        for arm in arms {
            let ball = ColliderBuilder::ball(0.05)
                .translation(from_dvec3(arm))
                .mass(from_f64(mass))
                .collision_groups(InteractionGroups::none());
            let (colliders, bodies) = (&mut self.world.colliders, &mut self.world.bodies);
            colliders.insert_with_parent(ball, body, bodies);
        }
        self.bodies.push(body);
    }

    fn tree(&self) -> Tree {
        if self.is_well {
            return self.law.field().at(from_dvec3(CENTRE)).into();
        }
        let carried = |body: &RigidBodyHandle| self.law.field().reacting().at(*body);
        Tree::fold(Operator::SumUnion, self.bodies.iter().map(carried))
    }

    fn energy(&self) -> f64 {
        let bodies = self.bodies.iter().map(|body| &self.world.bodies[*body]);
        bodies.map(kinetic_energy).sum::<f64>() + self.potential_energy()
    }

    fn potential_energy(&self) -> f64 {
        let colliders = self.world.colliders.iter();
        let places: Vec<DVec3> = colliders
            .map(|(_, it)| to_dvec3(it.translation()))
            .collect();
        let between = |one: DVec3, other: DVec3| self.law.potential(one.distance(other));
        if self.is_well {
            return places.iter().map(|it| between(*it, CENTRE)).sum();
        }
        let pairs = places.iter().enumerate();
        let pairs = pairs.flat_map(|(at, one)| places[..at].iter().map(move |it| (*one, *it)));
        // Each of the two carries the field and reacts to it, so a pair counts twice.
        pairs.map(|(one, other)| 2.0 * between(one, other)).sum()
    }
}

fn kinetic_energy(body: &RigidBody) -> f64 {
    let properties = &body.mass_properties().local_mprops;
    let frame = *body.rotation() * properties.principal_inertia_local_frame;
    let angvel = to_dvec3(frame.inverse() * body.angvel());
    let spin = angvel.dot(to_dvec3(properties.principal_inertia()) * angvel);
    0.5 * (to_f64(body.mass()) * to_dvec3(body.linvel()).length_squared() + spin)
}

/// Runs a scene to its end or the first warning. Returns the largest error of its energy, and whether a step warned.
fn run(mut scene: Scene) -> (f64, bool) {
    let scheme = Scheme::auto(from_f64(scene.tolerance));
    let mut fields = build(scene.tree(), scheme);
    let first = scene.energy();
    let mut worst = 0.0_f64;
    for _ in 0..STEPS {
        fields.step(&mut scene.world).expect("a step");
        if !fields.warnings().is_empty() {
            return (worst, true);
        }
        let off = (scene.energy() - first).abs() / first;
        assert!(off.is_finite());
        worst = worst.max(off);
    }
    (worst, false)
}

fn keeps_its_word(kind: Kind) {
    let mut warned = 0;
    for number in 0..CASES {
        let scene = Scene::new(kind, number);
        let (law, tolerance, count) = (scene.law, scene.tolerance, scene.bodies.len());
        let (worst, is_warned) = run(scene);
        println!("{kind:?} {number}, {law:?}, {tolerance:e}: {worst:e}, warned: {is_warned}");
        // Each body may be off by the tolerance, and its energy oscillates by as much within a vibration.
        let bound = (1 + count) as f64 * tolerance;
        assert!(
            worst <= bound,
            "{kind:?} {number}, {law:?}: {worst:e}, tolerance {tolerance:e}"
        );
        warned += u64::from(is_warned);
    }
    assert!(warned <= CASES / 5, "{kind:?}: {warned} of {CASES} warned");
}

#[test]
fn balls_in_wells_keep_their_energy() {
    keeps_its_word(Kind::Ball);
}

#[test]
fn arms_in_wells_keep_their_energy() {
    keeps_its_word(Kind::Arm);
}

#[test]
fn pairs_of_balls_keep_their_energy() {
    keeps_its_word(Kind::Together(2));
}

#[test]
fn groups_of_balls_keep_their_energy() {
    keeps_its_word(Kind::Together(4));
}
