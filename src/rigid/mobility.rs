//! The response of a body to a wrench: its inverse mass matrix M⁻¹, in 64 bits, and conversions between pairs
//! of vectors and vectors of six.

use super::body::Body;
use super::taylor_rotation::Rotor;
use super::wrench::Wrench;
use crate::math::{DQuat, DVec3, Vector, from_dvec3, to_dquat, to_dvec3, to_f64};
use crate::rapier::math::AngularInertia;
use crate::rapier::na::{Matrix3, Matrix6, SymmetricEigen, U6, Vector3, Vector6};

/// The inverse mass and world inertia of a body, with zeros for locked axes and for bodies without mass or
/// inertia. As a matrix it has six dimensions: translation, then rotation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mobility {
    pub inv_mass: DVec3,
    pub inv_inertia: Matrix3<f64>,
}

impl Mobility {
    /// From the inverse mass and inertia that Rapier had for the body when the body was copied.
    pub(crate) fn of(body: &Body) -> Self {
        Mobility {
            inv_mass: to_dvec3(body.inv_mass),
            inv_inertia: symmetric(body.inv_inertia),
        }
    }

    /// M⁻¹ times a wrench: the acceleration, linear and angular.
    pub(crate) fn apply(&self, wrench: &Vector6<f64>) -> Vector6<f64> {
        let force = wrench.fixed_rows::<3>(0);
        let torque = self.inv_inertia * wrench.fixed_rows::<3>(3);
        let inv_mass = Vector3::from(self.inv_mass.to_array());
        join(force.component_mul(&inv_mass), torque)
    }

    /// M⁻¹ as a matrix.
    pub(crate) fn matrix(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        for (axis, inverse) in self.inv_mass.to_array().into_iter().enumerate() {
            matrix[(axis, axis)] = inverse;
        }
        matrix
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&self.inv_inertia);
        matrix
    }

    /// P and its pseudo-inverse, where P P = M⁻¹. The rotational part is zero if the inertia is not finite.
    pub(crate) fn roots(&self) -> (Matrix6<f64>, Matrix6<f64>) {
        let (mut root, mut inverse) = (Matrix6::zeros(), Matrix6::zeros());
        for (axis, value) in self.inv_mass.to_array().into_iter().enumerate() {
            root[(axis, axis)] = value.max(0.0).sqrt();
            inverse[(axis, axis)] = inverse_or_zero(root[(axis, axis)]);
        }
        let finite = self.inv_inertia.iter().all(|entry| entry.is_finite());
        let eigen = finite
            .then(|| SymmetricEigen::try_new(self.inv_inertia, f64::EPSILON, MOST_ROUNDS))
            .flatten();
        let Some(eigen) = eigen else {
            return (root, inverse);
        };
        let largest = eigen.eigenvalues.amax();
        let values = eigen
            .eigenvalues
            // A locked axis has an eigenvalue of zero, up to rounding.
            .map(|value| {
                if value > largest * 1e-12 {
                    value.sqrt()
                } else {
                    0.0
                }
            });
        let of = |values: Vector3<f64>| {
            eigen.eigenvectors * Matrix3::from_diagonal(&values) * eigen.eigenvectors.transpose()
        };
        root.fixed_view_mut::<3, 3>(3, 3).copy_from(&of(values));
        inverse
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&of(values.map(inverse_or_zero)));
        (root, inverse)
    }
}

/// Bound of the rounds of an eigenvalue iteration; matrices of finite entries need far fewer.
const MOST_ROUNDS: usize = 500;

/// The eigenvalues and eigenvectors of a symmetric matrix; `None` if an entry is not finite, since the
/// iteration would not end.
pub(crate) fn eigen(matrix: Matrix6<f64>) -> Option<SymmetricEigen<f64, U6>> {
    let finite = matrix.iter().all(|entry| entry.is_finite());
    let eigen = finite.then(|| SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_ROUNDS));
    eigen.flatten()
}

fn inverse_or_zero(x: f64) -> f64 {
    if x > 0.0 { x.recip() } else { 0.0 }
}

fn symmetric(m: AngularInertia) -> Matrix3<f64> {
    let [m11, m12, m13] = [m.m11, m.m12, m.m13].map(to_f64);
    let [m22, m23, m33] = [m.m22, m.m23, m.m33].map(to_f64);
    Matrix3::new(m11, m12, m13, m12, m22, m23, m13, m23, m33)
}

/// Force and torque, or linear and angular velocity, as one vector.
pub(crate) fn join(linear: Vector3<f64>, angular: Vector3<f64>) -> Vector6<f64> {
    let mut both = Vector6::zeros();
    both.fixed_rows_mut::<3>(0).copy_from(&linear);
    both.fixed_rows_mut::<3>(3).copy_from(&angular);
    both
}

/// [`join`] for glam's vectors.
pub(crate) fn six(linear: DVec3, angular: DVec3) -> Vector6<f64> {
    join(
        Vector3::from(linear.to_array()),
        Vector3::from(angular.to_array()),
    )
}

/// The two vectors that a [`six`] was made of, linear and angular.
pub(crate) fn pair(both: &Vector6<f64>) -> (DVec3, DVec3) {
    (
        DVec3::new(both[0], both[1], both[2]),
        DVec3::new(both[3], both[4], both[5]),
    )
}

pub(crate) fn of_wrench(wrench: Wrench) -> Vector6<f64> {
    six(to_dvec3(wrench.force), to_dvec3(wrench.torque))
}

/// The velocities of a body in the world, linear and angular.
pub(crate) fn velocities(body: &Body) -> Vector6<f64> {
    six(to_dvec3(body.linvel), to_dvec3(body.angvel))
}

/// The two vectors of a [`six`], rounded to [`Real`](crate::math::Real).
pub(crate) fn rounded(both: &Vector6<f64>) -> (Vector, Vector) {
    let (linear, angular) = pair(both);
    (from_dvec3(linear), from_dvec3(angular))
}

/// The matrix of u ↦ v × u.
pub(crate) fn cross_matrix(v: DVec3) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The parts of a body's inverse inertia from which the inverse inertia in world axes follows at any attitude.
pub(crate) fn turned_inertia(body: &Body) -> TurnedInertia {
    TurnedInertia {
        rotor: Rotor::of(body.principal_inertia),
        locked: body.rotation_locked,
    }
}

impl Body {
    /// Its angular momentum about the centre of mass, in world axes; see [`TurnedInertia::momentum`].
    pub(crate) fn angular_momentum_now(&self) -> DVec3 {
        let attitude = to_dquat(self.pose.rotation);
        turned_inertia(self).momentum(attitude, to_dvec3(self.angvel))
    }
}

/// Made by [`turned_inertia`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct TurnedInertia {
    rotor: Rotor,
    locked: [bool; 3],
}

impl TurnedInertia {
    /// The inverse inertia in world axes at an attitude. Locked axes are those of the world, as in Rapier.
    pub(crate) fn at(&self, attitude: DQuat) -> Matrix3<f64> {
        let to_world = self.rotor.principal_to_world(attitude);
        let columns = DVec3::AXES.map(|axis| to_world * axis);
        let mut inertia = Matrix3::zeros();
        for (column, inverse) in columns
            .into_iter()
            .zip(self.rotor.inverse_moments.to_array())
        {
            let column = Vector3::from(column.to_array());
            inertia += column * column.transpose() * inverse;
        }
        for axis in (0..3).filter(|axis| self.locked[*axis]) {
            inertia.row_mut(axis).fill(0.0);
            inertia.column_mut(axis).fill(0.0);
        }
        inertia
    }

    /// The angular momentum at an angular velocity, in world axes. A principal axis whose inverse moment is zero adds
    /// nothing to it.
    pub(crate) fn momentum(&self, attitude: DQuat, angvel: DVec3) -> DVec3 {
        let to_world = self.rotor.principal_to_world(attitude);
        let moments = self.rotor.inverse_moments.to_array().map(inverse_or_zero);
        to_world * (DVec3::from_array(moments) * (to_world.inverse() * angvel))
    }
}
