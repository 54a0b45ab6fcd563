//! The mean of a vector that changes at a rate linear in itself: φ₁(A) x = ∫₀¹ exp(s A) x ds (M.
//! Hochbruck and A. Ostermann, Acta Numerica 19 (2010) 209, §2).

use crate::rapier::na::{Const, DimMin, Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use crate::rigid::phi1;

/// φ₁(A) x of three components; `None` if it is not finite, or if A has no closed form and is beyond [`LARGEST`].
pub(super) fn mean3(rate: &Matrix3<f64>, x: Vector3<f64>) -> Option<Vector3<f64>> {
    let mean = if let Some(growth) = isotropic(rate) {
        x * phi1(growth)
    } else if let Some((growth, turn)) = spiral(rate) {
        spiral_mean(growth, turn, x)
    } else if let Some((across, along, axis)) = stretch(rate) {
        let part = axis * axis.dot(&x);
        (x - part) * phi1(across) + part * phi1(along)
    } else {
        by_exponential::<3, 4>(rate, &x)?
    };
    mean.iter().all(|x| x.is_finite()).then_some(mean)
}

/// φ₁(A) x of six components; `None` if it is not finite, or if A is beyond [`LARGEST`].
pub(super) fn mean6(rate: &Matrix6<f64>, x: &Vector6<f64>) -> Option<Vector6<f64>> {
    by_exponential::<6, 7>(rate, x)
}

/// nalgebra's exponential computes the tenth power of a matrix, and does not return if that overflows.
const LARGEST: f64 = 1e28;

/// φ₁(A) x by the series of φ₁; `None` where its terms would cancel.
fn by_series<const N: usize>(
    rate: &SMatrix<f64, N, N>,
    x: &SVector<f64, N>,
) -> Option<SVector<f64, N>> {
    let rows = rate.row_iter().map(|row| row.lp_norm(1));
    // False if anything is NaN.
    if !rows.into_iter().all(|sum| sum <= 0.5) {
        return None;
    }
    let (mut mean, mut term) = (*x, *x);
    let size = x.amax();
    for order in 2..20 {
        term = rate * term / f64::from(order);
        mean += term;
        if term.amax() <= f64::EPSILON * 0.125 * size {
            break;
        }
    }
    mean.iter().all(|x| x.is_finite()).then_some(mean)
}

/// φ₁(A) x as the last column of the exponential of the matrix (A, x; 0, 0).
fn by_exponential<const N: usize, const MORE: usize>(
    rate: &SMatrix<f64, N, N>,
    x: &SVector<f64, N>,
) -> Option<SVector<f64, N>>
where
    Const<MORE>: DimMin<Const<MORE>, Output = Const<MORE>>,
{
    if let Some(mean) = by_series(rate, x) {
        return Some(mean);
    }
    // Scaled, so that the precision does not depend on the size of x.
    let size = x.amax();
    if size == 0.0 {
        return Some(*x);
    }
    let mut both = SMatrix::<f64, MORE, MORE>::zeros();
    both.fixed_view_mut::<N, N>(0, 0).copy_from(rate);
    both.fixed_view_mut::<N, 1>(0, N).copy_from(&(x / size));
    // False if anything is NaN.
    if !both.iter().all(|entry| entry.abs() <= LARGEST) {
        return None;
    }
    let mean = both.exp().fixed_view::<N, 1>(0, N) * size;
    mean.iter().all(|x| x.is_finite()).then_some(mean)
}

/// The rate of growth if the matrix is this rate times the identity.
fn isotropic(rate: &Matrix3<f64>) -> Option<f64> {
    let growth = rate[(0, 0)];
    let is_it = *rate == Matrix3::from_diagonal_element(growth);
    (is_it && growth.is_finite()).then_some(growth)
}

/// The rates of growth and of turning of a matrix that is, to rounding, the sum of a multiple of the identity and an
/// antisymmetric matrix: an isotropic drag and a magnetic force.
fn spiral(rate: &Matrix3<f64>) -> Option<(f64, Vector3<f64>)> {
    let size = rate.amax();
    if !size.is_finite() {
        return None;
    }
    let growth = rate.trace() / 3.0;
    let stretch = (rate + rate.transpose()) * 0.5 - Matrix3::identity() * growth;
    let turn = Vector3::new(
        rate[(2, 1)] - rate[(1, 2)],
        rate[(0, 2)] - rate[(2, 0)],
        rate[(1, 0)] - rate[(0, 1)],
    );
    (stretch.amax() <= 4.0 * f64::EPSILON * size).then_some((growth, turn * 0.5))
}

/// φ₁(A) x for such a matrix, which across the axis of turning acts as a complex number z = k + iω.
fn spiral_mean(growth: f64, turn: Vector3<f64>, x: Vector3<f64>) -> Vector3<f64> {
    let rate = turn.norm();
    if rate == 0.0 {
        return x * phi1(growth);
    }
    let axis = turn / rate;
    let along = axis * axis.dot(&x);
    let across = x - along;
    // e^z − 1, without loss of digits where z is small.
    let (sine, cosine) = rate.sin_cos();
    let half = (0.5 * rate).sin();
    let real = growth.exp_m1() * cosine - 2.0 * half * half;
    let imaginary = growth.exp() * sine;
    // Divided by z, scaled so that its square is in range.
    let scale = rate.max(growth.abs());
    let (k, w) = (growth / scale, rate / scale);
    let square = (k * k + w * w) * scale;
    let (real, imaginary) = (
        (real * k + imaginary * w) / square,
        (imaginary * k - real * w) / square,
    );
    along * phi1(growth) + across * real + axis.cross(&across) * imaginary
}

/// The rates across an axis and along it, and the axis u, of a matrix that is a + b u uᵀ to rounding: a drag that grows
/// with the speed is stronger along the motion.
fn stretch(rate: &Matrix3<f64>) -> Option<(f64, f64, Vector3<f64>)> {
    let size = rate.amax();
    let scaled = rate / size;
    let mean = scaled.trace() / 3.0;
    // Its eigenvalues are 2b/3, −b/3, −b/3.
    let deviator = scaled - Matrix3::identity() * mean;
    let third = (deviator.norm_squared() / 6.0)
        .sqrt()
        .copysign(deviator.determinant());
    let along = deviator + Matrix3::identity() * third;
    let largest = (along.map_diagonal(f64::abs)).imax();
    let axis = along.column(largest).normalize();
    let off = along - axis * axis.transpose() * (3.0 * third);
    // False if anything is NaN.
    let rates = (size * (mean - third), size * (mean + 2.0 * third), axis);
    (off.amax() <= 4.0 * f64::EPSILON).then_some(rates)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigid::cross_matrix;

    /// φ₁(A) x by the midpoint rule in many parts.
    fn summed(rate: &Matrix3<f64>, x: Vector3<f64>) -> Vector3<f64> {
        let parts = 4000;
        let steps = (0..parts).map(|part| {
            let s = (f64::from(part) + 0.5) / f64::from(parts);
            (rate * s).exp() * x
        });
        steps.sum::<Vector3<f64>>() / f64::from(parts)
    }

    #[test]
    fn phi1_is_the_mean_of_the_exponential() {
        let x = Vector3::new(0.3, -1.2, 0.7);
        let turn = cross_matrix(crate::math::DVec3::new(0.4, 2.0, -1.1));
        let drag = Matrix3::identity() * -1.7;
        let uneven = Matrix3::from_diagonal(&Vector3::new(-3.0, -0.1, 0.0));
        let axis = Vector3::new(0.48, -0.6, 0.64);
        let along = axis * axis.transpose() * 2.3;
        for rate in [drag - along, drag + along, along * -1e-9] {
            let (across, within, of) = stretch(&rate).expect("one axis");
            assert!(
                (rate * axis - axis * within).norm() < 1e-15 && of.dot(&axis).abs() > 1.0 - 1e-15
            );
            assert!((across - (rate.trace() - within) * 0.5).abs() < 1e-15);
        }
        let other = Matrix3::from_diagonal(&Vector3::new(-3.0, -0.1, -3.0));
        assert!(stretch(&other).is_some() && stretch(&uneven).is_none());
        assert!(stretch(&(drag - along + turn)).is_none());
        let mut rounded = drag;
        rounded[(1, 1)] *= 1.0 + f64::EPSILON;
        assert!(isotropic(&rounded).is_none());
        let plain = [turn, drag, rounded, turn + drag, uneven, uneven + turn];
        let stretched = [drag - along, drag + along, other, other + turn];
        for rate in plain.into_iter().chain(stretched) {
            let mean = mean3(&rate, x).expect("finite");
            assert!((mean - summed(&rate, x)).norm() < 1e-6, "{rate}");
            let mut six = Matrix6::zeros();
            six.fixed_view_mut::<3, 3>(0, 0).copy_from(&rate);
            six.fixed_view_mut::<3, 3>(3, 3).copy_from(&rate);
            let both = Vector6::new(x.x, x.y, x.z, x.x, x.y, x.z);
            let whole = mean6(&six, &both).expect("finite");
            assert!((whole.fixed_rows::<3>(0) - mean).norm() < 1e-13, "{rate}");
            assert!((whole.fixed_rows::<3>(3) - mean).norm() < 1e-13, "{rate}");
        }
    }

    #[test]
    fn rates_that_are_not_finite_or_too_large_give_none() {
        let x = Vector3::new(0.3, -1.2, 0.7);
        for rate in [1e27, 1e29, 1e100, 1e300, f64::INFINITY, f64::NAN] {
            let uneven = Matrix3::from_diagonal(&Vector3::new(-3.0, -1.0, 0.0)) * rate;
            let mut six = Matrix6::zeros();
            six.fixed_view_mut::<3, 3>(3, 3).copy_from(&uneven);
            let both = Vector6::new(x.x, x.y, x.z, x.x, x.y, x.z);
            let (three, six) = (mean3(&uneven, x), mean6(&six, &both));
            assert_eq!(three.is_some(), rate < LARGEST, "{rate}");
            // Drag and magnetic forces have a closed form, as long as their squares are in range.
            let turn = cross_matrix(crate::math::DVec3::new(0.4, 2.0, -1.1)) * rate;
            let both = turn - Matrix3::identity() * rate;
            assert_eq!(mean3(&both, x).is_some(), rate < 1e150, "{rate}");
            assert_eq!(six.is_some(), rate < LARGEST, "{rate}");
            if let (Some(three), Some(six)) = (three, six) {
                assert!(three.x.abs() <= 1e-27 && (three.z - x.z).abs() < 1e-12);
                assert!((six.fixed_rows::<3>(0) - x).norm() < 1e-12, "{six}");
                assert!((six.fixed_rows::<3>(3) - three).norm() < 1e-12, "{six}");
            }
            // The growth at these rates is not finite.
            assert_eq!(mean3(&-uneven, x), None, "{rate}");
        }
        let nowhere = Vector6::repeat(f64::NAN);
        assert_eq!(mean6(&Matrix6::zeros(), &nowhere), None);
        assert_eq!(
            mean6(&Matrix6::zeros(), &Vector6::zeros()),
            Some(Vector6::zeros())
        );
    }

    #[test]
    fn a_turn_keeps_the_length_at_any_rate() {
        let x = Vector3::new(0.3, -1.2, 0.7);
        for rate in [1e-12, 1e-6, 1e-2, 1.0, 10.0, 100.0] {
            let turn = cross_matrix(crate::math::DVec3::new(0.4, 2.0, -1.1) * rate);
            let after = x + turn * mean3(&turn, x).expect("finite");
            assert!((after.norm() / x.norm() - 1.0).abs() < 1e-13, "{rate}");
        }
    }

    #[test]
    fn drag_of_any_strength_slows_and_never_reverses() {
        let x = Vector3::new(0.3, -1.2, 0.7);
        for rate in [1e-300, 1e-12, 1.0, 30.0, 1e6, 1e300] {
            let drag = Matrix3::identity() * -rate;
            let after = x + drag * mean3(&drag, x).expect("finite");
            let left = after.dot(&x) / x.norm_squared();
            assert!((-f64::EPSILON..=1.0).contains(&left), "{rate}: {left}");
            assert!((left - (-rate).exp()).abs() < 1e-13, "{rate}: {left}");
        }
    }
}
