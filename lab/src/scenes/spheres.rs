//! Equal elastic spheres in a closed box, the paper's first simulation.
//!
//! Units are the caller's: any consistent set of length, mass and time.
//!
//! Rapier conserves the energy of a bounce between two bodies to rounding. A sphere that touches two bodies in one step
//! gains or loses energy: in a crowded box at 1/60, 5 % to 20 % of the total within 600 steps. Shorter steps make that
//! rarer.

use super::fields;
use fields::math::{
    ColliderHandle, ColliderSet, DVec3, Real, RigidBodyHandle, RigidBodySet, Vector, from_dvec3,
    to_f64,
};
use fields::rapier::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder};

use fields::{ContactLaw, Field, Operator, Tree};

use super::{Motion, SceneError, check_count, check_range, elastic, empty_world, insert_box};
use crate::random::Random;

/// Mass of a sphere.
pub const MASS: f64 = 1.0;

/// Positions drawn for a sphere before the box counts as full.
const MAX_DRAWS: usize = 1000;

/// Settings of a box of spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpheresSettings {
    /// Number of spheres.
    pub count: usize,
    /// Radius of a sphere.
    pub radius: Real,
    /// Distance from the centre of the box, the origin, to each wall.
    pub half_extent: Real,
    /// Speed of every sphere at the start; directions are random.
    pub speed: Real,
    /// Time step. A sphere that moves by more than its radius in a step may pass through another.
    pub dt: Real,
    /// Seed of positions and directions.
    pub seed: u64,
}

impl Default for SpheresSettings {
    /// 20 spheres of radius 0.5 and speed 1 in a box of side 10, in steps of 1/60.
    fn default() -> Self {
        Self {
            count: 20,
            radius: 0.5,
            half_extent: 5.0,
            speed: 1.0,
            dt: 1.0 / 60.0,
            seed: 1,
        }
    }
}

/// A closed box of spheres.
pub struct BoxOfSpheres {
    /// The physics world, without gravity and without any force but contacts.
    pub world: PhysicsWorld,
    /// The body and the collider of each sphere.
    pub spheres: Vec<(RigidBodyHandle, ColliderHandle)>,
    /// The walls at -x, +x, -y, +y, -z and +z.
    pub walls: [ColliderHandle; 6],
    /// Distances from the centre, the origin, to the walls.
    pub half_extents: Vector,
    /// Radius of a sphere.
    pub radius: Real,
}

impl SpheresSettings {
    /// Builds the box, with spheres at random positions that overlap neither each other nor a wall.
    ///
    /// # Errors
    /// A setting is out of range, or random draws find no place for a sphere.
    pub fn build(&self) -> Result<BoxOfSpheres, SceneError> {
        check_count(self.count)?;
        check_range("radius", self.radius, 1e-3, 1e3)?;
        check_range("half_extent", self.half_extent, self.radius, 1e4)?;
        check_range("speed", self.speed, 0.0, 1e6)?;
        check_range("dt", self.dt, 1e-6, 1.0)?;

        let mut random = Random::new(self.seed);
        let centers = self.centers(&mut random)?;

        let mut world = empty_world(self.dt);
        let half_extents = Vector::splat(self.half_extent);
        let PhysicsWorld {
            bodies, colliders, ..
        } = &mut world;
        let walls = insert_box(bodies, colliders, half_extents);
        let spheres = centers
            .iter()
            .map(|&center| {
                let linvel = self.speed * from_dvec3(random.unit_vector());
                insert_sphere(bodies, colliders, self.radius, from_dvec3(center), linvel)
            })
            .collect();
        Ok(BoxOfSpheres {
            world,
            spheres,
            walls,
            half_extents,
            radius: self.radius,
        })
    }

    fn centers(&self, random: &mut Random) -> Result<Vec<DVec3>, SceneError> {
        let radius = to_f64(self.radius);
        let room = to_f64(self.half_extent) - radius;
        let mut centers: Vec<DVec3> = Vec::with_capacity(self.count);
        for index in 0..self.count {
            let center = (0..MAX_DRAWS)
                .map(|_| {
                    let unit = DVec3::new(random.uniform(), random.uniform(), random.uniform());
                    room * (2.0 * unit - DVec3::ONE)
                })
                .find(|center| {
                    centers
                        .iter()
                        .all(|other| center.distance(*other) >= 2.0 * radius)
                })
                .ok_or(SceneError::Crowded {
                    index,
                    count: self.count,
                    attempts: MAX_DRAWS,
                    setting: "half_extent",
                    value: self.half_extent,
                })?;
            centers.push(center);
        }
        Ok(centers)
    }
}

/// Inserts one sphere of mass [`MASS`], which never sleeps.
///
/// Forces and impulses act on it even before the first step.
pub fn insert_sphere(
    bodies: &mut RigidBodySet,
    colliders: &mut ColliderSet,
    radius: Real,
    center: Vector,
    linvel: Vector,
) -> (RigidBodyHandle, ColliderHandle) {
    let body = bodies.insert(
        RigidBodyBuilder::dynamic()
            .translation(center)
            .linvel(linvel)
            .can_sleep(false),
    );
    let ball = elastic(ColliderBuilder::ball(radius).mass(1.0));
    let collider = colliders.insert_with_parent(ball, body, bodies);
    // Otherwise Rapier computes masses in its next step, and ignores impulses until then.
    bodies[body].recompute_mass_properties_from_colliders(colliders);
    (body, collider)
}

impl BoxOfSpheres {
    /// The tree of the paper's first simulation (§3.3, §4): around each sphere a contact field with `law`.
    ///
    /// The walls have contact fields too, always elastic: the paper's rule does not cover them.
    pub fn tree(&self, law: ContactLaw) -> Tree {
        let elastic = ContactLaw::elastic();
        let spheres = self.spheres.iter().map(|(_, sphere)| (*sphere, law));
        let walls = self.walls.iter().map(|wall| (*wall, elastic));
        let fields = spheres
            .chain(walls)
            .map(|(part, law)| Field::contact(law).at(part));
        Tree::fold(Operator::SumUnion, fields)
    }

    /// Kinetic energy of translation and rotation.
    pub fn kinetic_energy(&self) -> f64 {
        self.motion().kinetic_energy
    }

    /// Total momentum.
    pub fn momentum(&self) -> DVec3 {
        self.motion().momentum
    }

    /// Total angular momentum about the origin, orbital and spin.
    pub fn angular_momentum(&self) -> DVec3 {
        self.motion().angular_momentum
    }

    fn motion(&self) -> Motion {
        let inertia = 0.4 * MASS * to_f64(self.radius).powi(2);
        let handles = self.spheres.iter().map(|(body, _)| *body);
        Motion::of(&self.world.bodies, handles, MASS, DVec3::splat(inertia))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::Fields;
    use fields::math::to_dvec3;

    #[test]
    fn default_box_has_no_overlap_and_the_energy_of_its_settings() {
        let settings = SpheresSettings::default();
        let scene = settings.build().unwrap();
        let centers: Vec<DVec3> = scene
            .spheres
            .iter()
            .map(|(body, _)| to_dvec3(scene.world.bodies[*body].translation()))
            .collect();
        assert_eq!(centers.len(), 20);
        for (i, center) in centers.iter().enumerate() {
            assert!(center.abs().max_element() <= 4.5 + 1e-5);
            assert!(
                centers[..i]
                    .iter()
                    .all(|other| center.distance(*other) >= 1.0 - 1e-5)
            );
        }
        assert!((scene.kinetic_energy() - 10.0).abs() < 1e-5);
    }

    #[test]
    fn bounces_keep_energy() {
        // With more than two spheres, some touch two others in one step, where Rapier does not conserve energy.
        let settings = SpheresSettings {
            count: 2,
            half_extent: 2.0,
            ..Default::default()
        };
        let mut scene = settings.build().unwrap();
        let energy = scene.kinetic_energy();
        for _ in 0..1000 {
            scene.world.step();
        }
        let ratio = scene.kinetic_energy() / energy;
        assert!(
            (ratio - 1.0).abs() < 1e-3,
            "energy became {ratio} times what it was"
        );
    }

    #[test]
    fn newtons_law_keeps_energy_and_the_papers_rule_does_not() {
        let run = |law| {
            let mut scene = SpheresSettings::default().build().unwrap();
            let energy = scene.kinetic_energy();
            let mut fields = Fields::new(scene.tree(law)).unwrap();
            for _ in 0..600 {
                fields.step(&mut scene.world).unwrap();
            }
            scene.kinetic_energy() / energy
        };
        let newton = run(ContactLaw::elastic());
        assert!((newton - 1.0).abs() < 1e-5, "{newton}");
        let paper = run(ContactLaw::Paper);
        assert!((paper - 1.0).abs() > 0.05, "{paper}");
    }

    #[test]
    fn bad_settings_are_errors() {
        let good = SpheresSettings::default();
        let error = |settings: SpheresSettings| settings.build().err().unwrap().to_string();
        assert!(error(SpheresSettings { count: 0, ..good }).contains("count is 0"));
        assert!(
            error(SpheresSettings {
                radius: Real::NAN,
                ..good
            })
            .contains("radius is NaN")
        );
        assert!(
            error(SpheresSettings {
                half_extent: 0.4,
                ..good
            })
            .contains("half_extent is 0.4")
        );
        assert!(error(SpheresSettings { dt: -1.0, ..good }).contains("dt is -1"));
        assert!(
            error(SpheresSettings {
                count: 5000,
                ..good
            })
            .contains("no free place")
        );
    }
}
