//! Rigid ammonia in a closed box, the paper's second simulation.
//!
//! The model is OPLS-AA with rigid geometry (N–H 1.01 Å, H–N–H 106.4°). Units throughout are ångström, atomic mass unit
//! and picosecond; an energy is in amu Å²/ps², 0.01 kJ/mol. In SI units, the inertia of a molecule underflows in `f32`,
//! and Rapier silently locks its rotation.

use super::fields;
use fields::math::{
    ColliderHandle, ColliderSet, DVec3, Pose, RigidBodyHandle, RigidBodySet, Vector, from_dvec3,
    from_f64,
};
use fields::rapier::prelude::{ColliderBuilder, MassProperties, PhysicsWorld, RigidBodyBuilder};

use super::{Motion, elastic};

mod contacts;
mod settings;
mod tree;

pub use contacts::{ContactKind, ContactKinds, KindTally};
pub use settings::AmmoniaSettings;
pub use tree::{DISPERSION, interaction, set_probes};

/// Mass of a molecule, amu.
pub const MASS: f64 = 17.0307;
/// Moments of inertia about the body's x, y and z axes, which are principal, amu Å².
pub const PRINCIPAL_INERTIA: [f64; 3] = [1.68672087031384, 1.68672087031384, 2.6371629045728437];
/// Lennard-Jones σ between two nitrogens, Å. It does not act on hydrogens.
pub const LJ_SIGMA: f64 = 3.42;
/// Lennard-Jones ε between two nitrogens, amu Å²/ps².
pub const LJ_EPSILON: f64 = 71.128;
/// Coulomb's constant, amu Å³/(ps² e²): the energy of two unit charges 1 Å apart.
pub const COULOMB: f64 = 138935.45764438197;
/// Boltzmann's constant, amu Å²/(ps² K).
pub const BOLTZMANN: f64 = 0.831446261815324;

/// One atom of a molecule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Name of the atom.
    pub name: &'static str,
    /// Position in the body's frame, whose origin is the centre of mass, Å.
    pub local_point: [f64; 3],
    /// Mass, amu. The whole mass of a molecule is on its body; colliders have none.
    pub mass: f64,
    /// Partial charge, e.
    pub charge: f64,
    /// Radius of the ball collider, Å: see [`SITES`].
    pub hard_radius: f64,
}

/// The atoms of a molecule, nitrogen first.
///
/// Hard radii are half the closest approaches of like atoms of this model without hard spheres: 3.0 Å of nitrogens
/// (2.97 in the bound clusters of `tests/data`), 1.6 Å of hydrogens (1.55 in a gas at 400 K). Hydrogens protrude from
/// the sphere of their nitrogen by 0.29 Å, so that every kind of pair can touch. A nitrogen and a hydrogen touch at 2.3
/// Å, slightly more than the shortest length of their hydrogen bond, 2.0 Å.
pub const SITES: [Site; 4] = [
    Site {
        name: "N",
        local_point: [0.0, 0.0, 0.06831449956531783],
        mass: 14.0067,
        charge: -1.02,
        hard_radius: 1.5,
    },
    hydrogen("H1", [0.9338509945829754, 0.0, -0.31642218950447665]),
    hydrogen(
        "H2",
        [
            -0.46692549729148747,
            0.808738684658221,
            -0.31642218950447665,
        ],
    ),
    hydrogen(
        "H3",
        [
            -0.4669254972914881,
            -0.8087386846582206,
            -0.31642218950447665,
        ],
    ),
];

const fn hydrogen(name: &'static str, local_point: [f64; 3]) -> Site {
    Site {
        name,
        local_point,
        mass: 1.008,
        charge: 0.34,
        hard_radius: 0.8,
    }
}

/// The handles of one molecule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Molecule {
    /// The body, its origin at the centre of mass.
    pub body: RigidBodyHandle,
    /// One ball collider per atom, in the order of [`SITES`].
    pub sites: [ColliderHandle; 4],
}

/// Inserts one molecule, with its centre of mass at the origin of `pose`.
///
/// `linvel` is in Å/ps; `angvel` in rad/ps, along the world's axes. The molecule never sleeps. Forces and impulses act
/// on it even before the first step.
pub fn insert_molecule(
    bodies: &mut RigidBodySet,
    colliders: &mut ColliderSet,
    pose: Pose,
    linvel: Vector,
    angvel: Vector,
) -> Molecule {
    // Atoms overlap, so the mass cannot come from their volumes: all of it is on the body.
    let mass_properties = MassProperties::new(
        Vector::ZERO,
        from_f64(MASS),
        from_dvec3(DVec3::from_array(PRINCIPAL_INERTIA)),
    );
    let body = bodies.insert(
        RigidBodyBuilder::dynamic()
            .pose(pose)
            .linvel(linvel)
            .angvel(angvel)
            .additional_mass_properties(mass_properties)
            .can_sleep(false)
            // Otherwise Rapier caps rotation at 45° a step.
            .allow_fast_rotation(true),
    );
    let sites = SITES.map(|site| {
        let ball = ColliderBuilder::ball(from_f64(site.hard_radius))
            .translation(from_dvec3(DVec3::from_array(site.local_point)))
            .density(0.0);
        colliders.insert_with_parent(elastic(ball), body, bodies)
    });
    // Otherwise Rapier computes masses in its next step, and ignores impulses until then.
    bodies[body].recompute_mass_properties_from_colliders(colliders);
    Molecule { body, sites }
}

/// A closed box of ammonia.
pub struct BoxOfAmmonia {
    /// The physics world, without gravity and without any force between molecules but contacts.
    pub world: PhysicsWorld,
    /// The molecules.
    pub molecules: Vec<Molecule>,
    /// The walls at -x, +x, -y, +y, -z and +z.
    pub walls: [ColliderHandle; 6],
    /// Distances from the centre, the origin, to the walls, Å.
    pub half_extents: Vector,
}

impl BoxOfAmmonia {
    /// Kinetic energy of translation and rotation, amu Å²/ps².
    pub fn kinetic_energy(&self) -> f64 {
        self.motion().kinetic_energy
    }

    /// Total momentum, amu Å/ps.
    pub fn momentum(&self) -> DVec3 {
        self.motion().momentum
    }

    /// Total angular momentum about the origin, orbital and spin, amu Å²/ps.
    pub fn angular_momentum(&self) -> DVec3 {
        self.motion().angular_momentum
    }

    fn motion(&self) -> Motion {
        let handles = self.molecules.iter().map(|molecule| molecule.body);
        Motion::of(
            &self.world.bodies,
            handles,
            MASS,
            DVec3::from_array(PRINCIPAL_INERTIA),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::math::{to_dvec3, to_f64};

    #[test]
    fn constants_agree_with_each_other() {
        let mass: f64 = SITES.iter().map(|site| site.mass).sum();
        let charge: f64 = SITES.iter().map(|site| site.charge).sum();
        let points = SITES.map(|site| DVec3::from_array(site.local_point));
        let center = SITES
            .iter()
            .zip(points)
            .map(|(site, p)| site.mass * p)
            .sum::<DVec3>()
            / mass;
        let inertia = SITES
            .iter()
            .zip(points)
            .map(|(site, p)| site.mass * (DVec3::splat(p.length_squared()) - p * p))
            .sum::<DVec3>();
        assert!((mass - MASS).abs() < 1e-12);
        assert!(charge.abs() < 1e-12);
        assert!(center.length() < 1e-12, "{center}");
        assert!(
            inertia.distance(DVec3::from_array(PRINCIPAL_INERTIA)) < 1e-12,
            "{inertia}"
        );
    }

    #[test]
    fn rapier_has_the_mass_and_inertia_of_the_model_before_the_first_step() {
        let scene = AmmoniaSettings::default().build().unwrap();
        let body = &scene.world.bodies[scene.molecules[0].body];
        let properties = body.mass_properties().local_mprops;
        let inertia = to_dvec3(properties.principal_inertia());
        assert!((to_f64(body.mass()) / MASS - 1.0).abs() < 1e-6);
        assert!(
            inertia.distance(DVec3::from_array(PRINCIPAL_INERTIA)) < 1e-6,
            "{inertia}"
        );
        assert!(to_dvec3(body.local_center_of_mass()).length() < 1e-12);
    }

    #[test]
    fn free_flight_keeps_momentum_and_energy() {
        let mut scene = AmmoniaSettings {
            spacing: 20.0,
            ..Default::default()
        }
        .build()
        .unwrap();
        let (energy, momentum) = (scene.kinetic_energy(), scene.momentum());
        let angular_momentum = scene.angular_momentum();
        for _ in 0..50 {
            scene.world.step();
        }
        assert!((scene.kinetic_energy() / energy - 1.0).abs() < 2e-3);
        assert!(scene.momentum().distance(momentum) < 1e-2);
        let change = scene.angular_momentum().distance(angular_momentum);
        assert!(change < 1e-3 * angular_momentum.length(), "{change}");
    }
}
