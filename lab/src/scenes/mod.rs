//! Ready-made Rapier worlds: rigid ammonia and equal spheres, each in a closed box; the paper's
//! Figures 3 and 4; a flock in a gust; bodies that meet head-on.
//!
//! Every scene is a plain [`PhysicsWorld`] with the handles of its bodies and colliders. Its settings have a `build`
//! that checks every value, and the same seed gives the same scene.

pub mod ammonia;

pub mod figures;

pub mod flock;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
pub mod hard_spheres;

pub mod head_on;

pub mod level;

#[allow(missing_docs, reason = "of this repository only, and the names say it")]
pub mod playground;

pub mod spheres;

pub mod unification;

use super::fields;
use fields::math::{
    ColliderHandle, ColliderSet, DVec3, Real, RigidBodyHandle, RigidBodySet, Vector, to_dpose3,
    to_dvec3,
};
use fields::rapier::prelude::{
    CoefficientCombineRule, ColliderBuilder, IntegrationParameters, PhysicsWorld, RigidBodyBuilder,
};

/// The largest number of bodies a scene is built with.
pub const MAX_COUNT: usize = 1_000_000;

/// Why a scene could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// No bodies, or more than [`MAX_COUNT`].
    #[error("count is {count}, must be from 1 to {MAX_COUNT}")]
    Count {
        /// The number of bodies asked for.
        count: usize,
    },
    /// A setting is not a number, or out of its range.
    #[error("{setting} is {value}, must be from {min} to {max}")]
    OutOfRange {
        /// The name of the setting.
        setting: &'static str,
        /// Its value.
        value: Real,
        /// The least value allowed.
        min: Real,
        /// The greatest value allowed.
        max: Real,
    },
    /// A body found no free place.
    #[error(
        "body {index} of {count} found no free place in {attempts} attempts: widen {setting}, now {value}"
    )]
    Crowded {
        /// The body that did not fit, counted from 0.
        index: usize,
        /// The number of bodies asked for.
        count: usize,
        /// Number of places or orientations that were drawn for it.
        attempts: usize,
        /// The name of the setting that decides how much room there is.
        setting: &'static str,
        /// Its value.
        value: Real,
    },
}

/// Makes `collider` bounce without loss or friction, whatever it touches.
pub fn elastic(collider: ColliderBuilder) -> ColliderBuilder {
    collider
        .restitution(1.0)
        .restitution_combine_rule(CoefficientCombineRule::Max)
        .friction(0.0)
        .friction_combine_rule(CoefficientCombineRule::Min)
}

/// Inserts a closed, elastic box around the origin: six slabs on one fixed body.
///
/// `half_extents` are the distances from the origin to the walls. The colliders are, in order, the walls at -x, +x, -y,
/// +y, -z and +z. Half-spaces would have infinite bounds: Rapier would test every ball against every wall in every
/// step, which takes five times as long as the rest of the scene.
pub fn insert_box(
    bodies: &mut RigidBodySet,
    colliders: &mut ColliderSet,
    half_extents: Vector,
) -> [ColliderHandle; 6] {
    let body = bodies.insert(RigidBodyBuilder::fixed());
    let outward = [
        -Vector::X,
        Vector::X,
        -Vector::Y,
        Vector::Y,
        -Vector::Z,
        Vector::Z,
    ];
    // Walls are as thick as half the box and overlap at the edges, so that there is no gap.
    outward.map(|outward| {
        let axis = outward.abs();
        let slab = axis * (0.5 * half_extents) + (Vector::ONE - axis) * (2.0 * half_extents);
        let wall = ColliderBuilder::cuboid(slab.x, slab.y, slab.z)
            .translation(1.5 * outward * half_extents);
        colliders.insert_with_parent(elastic(wall), body, bodies)
    })
}

/// A world without gravity, with parameters for exact free flight and elastic bounces.
fn empty_world(dt: Real) -> PhysicsWorld {
    PhysicsWorld {
        gravity: Vector::ZERO,
        integration_parameters: IntegrationParameters {
            dt,
            // A reused contact is up to 0.05 length units off, and some contacts are missed.
            contact_recycling: false,
            // Continuous detection moves a fast body back to its first touch and drops the rest of its step: energy is
            // conserved, but simulated time is lost.
            max_ccd_substeps: 0,
            // The default caps every speed at 400 length units per unit of time.
            normalized_max_linear_velocity: Real::MAX,
            ..IntegrationParameters::default()
        },
        ..PhysicsWorld::default()
    }
}

fn check_count(count: usize) -> Result<(), SceneError> {
    if (1..=MAX_COUNT).contains(&count) {
        Ok(())
    } else {
        Err(SceneError::Count { count })
    }
}

/// NaN is out of every range.
fn check_range(setting: &'static str, value: Real, min: Real, max: Real) -> Result<(), SceneError> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(SceneError::OutOfRange {
            setting,
            value,
            min,
            max,
        })
    }
}

/// Total energy and momenta of the bodies of a scene, which are all alike; summed in `f64`.
///
/// Mass and inertia are those of the model, not Rapier's, so that Rapier can be tested.
#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    kinetic_energy: f64,
    momentum: DVec3,
    /// About the origin.
    angular_momentum: DVec3,
}

impl Motion {
    /// Sums over `handles`. Each body has its centre of mass at its origin and its principal axes along its own x, y
    /// and z.
    fn of(
        bodies: &RigidBodySet,
        handles: impl Iterator<Item = RigidBodyHandle>,
        mass: f64,
        principal_inertia: DVec3,
    ) -> Self {
        let mut sum = Self::default();
        // The caller may have removed a body.
        for body in handles.filter_map(|handle| bodies.get(handle)) {
            let pose = to_dpose3(body.position());
            let momentum = mass * to_dvec3(body.linvel());
            let local_angvel = pose.rotation.inverse() * to_dvec3(body.angvel());
            let local_spin = principal_inertia * local_angvel;
            sum.kinetic_energy +=
                0.5 * (momentum.length_squared() / mass + local_spin.dot(local_angvel));
            sum.momentum += momentum;
            sum.angular_momentum += pose.translation.cross(momentum) + pose.rotation * local_spin;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_bounces_off_all_walls_and_stays_inside() {
        let mut world = empty_world(0.01);
        let half_extents = Vector::new(2.0, 3.0, 4.0);
        let walls = insert_box(&mut world.bodies, &mut world.colliders, half_extents);
        let start = Vector::new(1.0, 1.7, -2.3);
        let (ball, _) = spheres::insert_sphere(
            &mut world.bodies,
            &mut world.colliders,
            0.5,
            Vector::ZERO,
            start,
        );
        let mut hit = [false; 6];
        for _ in 0..2000 {
            world.step();
            for (hit, wall) in hit.iter_mut().zip(walls) {
                *hit |= world
                    .contact_pairs_with(wall)
                    .any(|pair| pair.has_any_active_contact());
            }
            let center = world.bodies[ball].translation();
            // In Rapier, a ball sinks in by about its motion in a step.
            let sunk = (center.abs() + 0.5 - half_extents).max_element();
            assert!(sunk < 0.05, "{center} is {sunk} inside a wall");
        }
        assert_eq!(hit, [true; 6]);
        let speeds = world.bodies[ball].linvel().abs();
        assert!((speeds - start.abs()).length() < 1e-3, "{speeds}");
    }

    #[test]
    fn check_range_rejects_nan_and_names_the_limits() {
        assert_eq!(check_range("dt", 0.5, 0.0, 0.5), Ok(()));
        assert!(check_range("dt", Real::NAN, 0.0, 0.5).is_err());
        let error = check_range("dt", -1.0, 0.0, 0.5).unwrap_err();
        assert_eq!(error.to_string(), "dt is -1, must be from 0 to 0.5");
    }
}
