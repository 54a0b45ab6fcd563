//! The settings of a box of ammonia, and how it is built.

use super::super::{SceneError, check_count, check_range, empty_world, insert_box};
use super::fields;
use crate::random::Random;
use fields::math::{DPose3, DVec3, Pose, Real, Rotation, Vector, from_dvec3, from_f64, to_f64};
use fields::rapier::prelude::PhysicsWorld;

use super::{BOLTZMANN, BoxOfAmmonia, MASS, PRINCIPAL_INERTIA, SITES, insert_molecule};

/// Radius of a sphere about the centre of mass that contains all hard spheres, Å.
const REACH: f64 = 1.79;
/// Orientations drawn for a molecule before its cell counts as too small.
const MAX_DRAWS: usize = 1000;

/// Settings of a box of ammonia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AmmoniaSettings {
    /// Number of molecules.
    pub count: usize,
    /// Spacing of the cubic lattice on which the molecules start, Å. The box consists of its cells.
    pub spacing: Real,
    /// Temperature of the velocities, K.
    pub temperature: Real,
    /// Time step, ps.
    pub dt: Real,
    /// Seed of orientations and velocities.
    pub seed: u64,
}

impl Default for AmmoniaSettings {
    /// 216 molecules, 6 Å apart, at 300 K, in steps of 1 fs.
    fn default() -> Self {
        Self {
            count: 216,
            spacing: 6.0,
            temperature: 300.0,
            dt: 0.001,
            seed: 1,
        }
    }
}

impl AmmoniaSettings {
    /// Builds the box: molecules on a lattice in random orientations, with the velocities of an
    /// ideal gas of rigid rotors at the temperature, and total momentum zero.
    ///
    /// If `count` is not a cube, empty cells of the lattice are spread evenly.
    ///
    /// # Errors
    /// A setting is out of range, or random draws find no orientation without overlap.
    pub fn build(&self) -> Result<BoxOfAmmonia, SceneError> {
        check_count(self.count)?;
        check_range("spacing", self.spacing, 1.0, 1e3)?;
        check_range("temperature", self.temperature, 0.0, 1e5)?;
        check_range("dt", self.dt, 1e-6, 1.0)?;

        let mut random = Random::new(self.seed);
        let mut side = 1;
        while side * side * side < self.count as u64 {
            side += 1;
        }
        let half_extent = 0.5 * side as f64 * to_f64(self.spacing);
        let poses = self.poses(&mut random, side, half_extent)?;
        let velocities = self.velocities(&mut random, &poses);

        let mut world = empty_world(self.dt);
        let half_extents = Vector::splat(from_f64(half_extent));
        let PhysicsWorld {
            bodies, colliders, ..
        } = &mut world;
        let walls = insert_box(bodies, colliders, half_extents);
        let molecules = poses
            .iter()
            .zip(velocities)
            .map(|(pose, (linvel, angvel))| {
                let (linvel, angvel) = (from_dvec3(linvel), from_dvec3(angvel));
                insert_molecule(bodies, colliders, round(pose), linvel, angvel)
            })
            .collect();
        Ok(BoxOfAmmonia {
            world,
            molecules,
            walls,
            half_extents,
        })
    }

    /// Positions on the lattice, each with an orientation that overlaps neither a molecule nor a wall.
    fn poses(
        &self,
        random: &mut Random,
        side: u64,
        half_extent: f64,
    ) -> Result<Vec<DPose3>, SceneError> {
        let spacing = to_f64(self.spacing);
        // If the spheres of radius `REACH` do not overlap, every orientation is free.
        let roomy = spacing >= 2.0 * REACH;
        let mut poses: Vec<DPose3> = Vec::with_capacity(self.count);
        for index in 0..self.count {
            let cell = index as u64 * side.pow(3) / self.count as u64;
            let [x, y, z] = [cell / side.pow(2), cell / side % side, cell % side]
                .map(|i| (i as f64 + 0.5) * spacing - half_extent);
            let pose = (0..MAX_DRAWS)
                .map(|_| DPose3::from_parts(DVec3::new(x, y, z), random.rotation()))
                .find(|pose| {
                    roomy
                        || (inside(pose, half_extent)
                            && !poses.iter().any(|other| overlap(pose, other)))
                })
                .ok_or(SceneError::Crowded {
                    index,
                    count: self.count,
                    attempts: MAX_DRAWS,
                    setting: "spacing",
                    value: self.spacing,
                })?;
            poses.push(pose);
        }
        Ok(poses)
    }

    /// Linear and angular velocities (world axes) of the Maxwell–Boltzmann distribution.
    fn velocities(&self, random: &mut Random, poses: &[DPose3]) -> Vec<(DVec3, DVec3)> {
        let thermal = BOLTZMANN * to_f64(self.temperature);
        let sigma_v = (thermal / MASS).sqrt();
        let sigma_w =
            DVec3::from_array(PRINCIPAL_INERTIA.map(|inertia| (thermal / inertia).sqrt()));
        let mut velocities: Vec<_> = poses
            .iter()
            .map(|pose| {
                let linvel = sigma_v * random.normal_vector();
                (linvel, pose.rotation * (sigma_w * random.normal_vector()))
            })
            .collect();
        let mean = velocities.iter().map(|v| v.0).sum::<DVec3>() / velocities.len() as f64;
        velocities.iter_mut().for_each(|v| v.0 -= mean);
        velocities
    }
}

/// The centres and radii of a molecule's hard spheres.
fn spheres(pose: &DPose3) -> [(DVec3, f64); 4] {
    SITES.map(|site| {
        (
            pose.transform_point(DVec3::from_array(site.local_point)),
            site.hard_radius,
        )
    })
}

fn inside(pose: &DPose3, half_extent: f64) -> bool {
    spheres(pose)
        .iter()
        .all(|(center, radius)| center.abs().max_element() + radius <= half_extent)
}

fn overlap(a: &DPose3, b: &DPose3) -> bool {
    a.translation.distance(b.translation) < 2.0 * REACH
        && spheres(a)
            .iter()
            .any(|(p, r)| spheres(b).iter().any(|(q, s)| p.distance(*q) < r + s))
}

fn round(pose: &DPose3) -> Pose {
    let DPose3 {
        rotation: q,
        translation,
    } = *pose;
    let rotation = Rotation::from_xyzw(from_f64(q.x), from_f64(q.y), from_f64(q.z), from_f64(q.w));
    Pose::from_parts(from_dvec3(translation), rotation.normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::math::to_dpose3;

    fn poses(scene: &BoxOfAmmonia) -> Vec<DPose3> {
        scene
            .molecules
            .iter()
            .map(|m| to_dpose3(scene.world.bodies[m.body].position()))
            .collect()
    }

    #[test]
    fn reach_holds_every_hard_sphere() {
        assert!(
            spheres(&DPose3::IDENTITY)
                .iter()
                .all(|(p, r)| p.length() + r < REACH)
        );
    }

    #[test]
    fn default_box_is_full_and_thermal() {
        let settings = AmmoniaSettings::default();
        let scene = settings.build().unwrap();
        assert_eq!(scene.molecules.len(), settings.count);
        assert_eq!(scene.world.bodies.len(), settings.count + 1);
        assert_eq!(scene.world.colliders.len(), 4 * settings.count + 6);
        assert!(poses(&scene).iter().all(|pose| inside(pose, 18.0)));
        assert!(scene.momentum().length() < 1e-2, "{}", scene.momentum());
        // 3 kT per molecule, relative standard error sqrt(2 / 6 count) = 4 %.
        let expected = 3.0 * BOLTZMANN * 300.0 * settings.count as f64;
        let found = scene.kinetic_energy();
        assert!(
            (found / expected - 1.0).abs() < 0.15,
            "{found}, expected {expected}"
        );
    }

    #[test]
    fn a_tight_lattice_has_no_overlap() {
        // At this spacing only some orientations fit.
        let settings = AmmoniaSettings {
            count: 50,
            spacing: 3.4,
            ..Default::default()
        };
        let poses = poses(&settings.build().unwrap());
        assert_eq!(poses.len(), 50);
        for (i, a) in poses.iter().enumerate() {
            for b in &poses[..i] {
                for (p, r) in spheres(a) {
                    // Up to the rounding of `f32` poses.
                    assert!(
                        spheres(b)
                            .iter()
                            .all(|(q, s)| p.distance(*q) > r + s - 1e-5)
                    );
                }
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_scene() {
        let state = |seed| {
            let scene = AmmoniaSettings {
                count: 10,
                seed,
                ..Default::default()
            }
            .build()
            .unwrap();
            (poses(&scene), scene.angular_momentum())
        };
        assert_eq!(state(7), state(7));
        assert_ne!(state(7), state(8));
    }

    #[test]
    fn bad_settings_are_errors() {
        let good = AmmoniaSettings::default();
        let error = |settings: AmmoniaSettings| settings.build().err().unwrap().to_string();
        assert_eq!(
            error(AmmoniaSettings { count: 0, ..good }),
            "count is 0, must be from 1 to 1000000"
        );
        assert_eq!(
            error(AmmoniaSettings {
                temperature: -1.0,
                ..good
            }),
            "temperature is -1, must be from 0 to 100000"
        );
        assert!(
            error(AmmoniaSettings {
                dt: Real::NAN,
                ..good
            })
            .contains("dt is NaN")
        );
        assert!(
            error(AmmoniaSettings {
                spacing: 2.9,
                ..good
            })
            .contains("no free place")
        );
    }
}
