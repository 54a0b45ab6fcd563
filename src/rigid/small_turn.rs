//! Torque-free rotation over a short time, as a series of its scaled axis.
//!
//! With the angular velocity in body axes as a Taylor series Σ wₖ tᵏ, the scaled axis Φ of the rotation obeys
//! Φ' = ω + ½ Φ×ω + ¹⁄₁₂ Φ×(Φ×ω) − ¹⁄₇₂₀ Φ×(Φ×(Φ×(Φ×ω))) + …, so that its terms follow from those before
//! (Magnus, Commun. Pure Appl. Math. 7 (1954) 649).

use crate::math::{DQuat, DVec3, Real, to_f64};
use crate::number::{Mask, Plain, Vec3, constant, real};

/// The error (rad) of a series of order n is below this × angleⁿ⁺¹ × coupling, or couplingⁿ if that is larger, as long
/// as coupling × angle is below one. Nearly twice the values 0.0102 and 0.0013 that fit the largest errors of 800,000
/// random tops, with moments up to a factor of 10⁶ apart.
const ERROR_OF_FOURTH: f64 = 0.02;
const ERROR_OF_SIXTH: f64 = 0.0025;

/// Largest angle (rad) of one series: sine and cosine of half the angle are series, too.
const MOST: f64 = 0.2;

/// The largest number of series in a row: seven take about as long as the Taylor series for the same turn.
const MOST_STEPS: u32 = 8;

/// The error (rad) of the rotation over a step that counts as rounding.
pub(super) fn series_error() -> f64 {
    0.01 * to_f64(Real::EPSILON)
}

/// The coupling of the principal axes in a free rotation: w' = coupling · (w.y w.z, w.z w.x, w.x w.y), by components.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisCoupling<N>(Vec3<N>);

/// The order of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SeriesOrder {
    Fourth,
    Sixth,
}

/// The number of series that keep an error, and their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SeriesPlan {
    pub steps: u32,
    order: SeriesOrder,
}

impl<N: Plain> AxisCoupling<N> {
    /// From the principal moments and their reciprocals.
    #[inline(always)]
    pub(super) fn new(moments: Vec3<N>, inverse_moments: Vec3<N>) -> Self {
        let Vec3 { x, y, z } = moments;
        AxisCoupling(Vec3::new(y - z, z - x, x - y).times(inverse_moments))
    }

    #[inline(always)]
    fn strongest(self) -> N {
        let Vec3 { x, y, z } = self.0.map(N::abs);
        x.greater(y).greater(z)
    }

    #[inline(always)]
    fn coupled(self, products: Vec3<N>) -> Vec3<N> {
        self.0.times(products)
    }

    /// An upper bound of the turn (rad) in the time in which the angular velocity of the start, if constant, would turn
    /// the body by `angle`: |w| grows at a rate of at most coupling · |w|² / √3. Infinite or NaN if there is no bound.
    #[inline(always)]
    pub(super) fn longest(self, angle: N) -> N {
        let slack = N::from(1.0) - self.strongest() * angle * (1.0 / 3.0_f64.sqrt());
        N::select(slack.above(0.0), angle / slack, f64::INFINITY.into())
    }

    /// True in the lanes in which one series of this order keeps `error` (rad) over a turn of at most `longest` (rad).
    #[inline(always)]
    pub(super) fn keeps(self, order: SeriesOrder, longest: N, error: f64) -> N::Mask {
        let (coupling, x) = (self.strongest(), longest);
        let (c2, x2) = (coupling * coupling, x * x);
        let (constant, power, omitted) = match order {
            SeriesOrder::Fourth => (ERROR_OF_FOURTH, c2 * c2, x2 * x2 * x),
            SeriesOrder::Sixth => (ERROR_OF_SIXTH, c2 * c2 * c2, x2 * x2 * x2 * x),
        };
        let omitted = coupling.greater(power) * omitted * constant;
        x.at_most(MOST) & (coupling * x).at_most(1.0) & omitted.at_most(error)
    }

    /// The scaled axis of the rotation in a unit of time that begins with this angular velocity; both in principal
    /// axes. By the series of sixth order where `is_long` is set, else by that of fourth order.
    #[inline(always)]
    pub(super) fn scaled_axis(self, angvel: Vec3<N>, is_long: N::Mask) -> Vec3<N> {
        // `tn` is the term of Φ with the n-th power of time.
        let w0 = angvel;
        let w1 = self.coupled(product(w0, w0));
        let w2 = self.coupled(both(w0, w1)) * HALF.into();
        let w3 = self.coupled(both(w0, w2) + product(w1, w1)) * THIRD.into();
        // The terms of Φ×ω are `cn`, those of Φ×(Φ×ω) are `dn`.
        let c2 = w0.cross(w1) * HALF.into();
        let [t1, t2] = [w0, w1 * HALF.into()];
        let t3 = (w2 + c2 * HALF.into()) * THIRD.into();
        let t4 = (w3 + w0.cross(w2) * THIRD.into()) * 0.25.into();
        let short = t1 + t2 + t3 + t4;
        if !is_long.any() {
            return short;
        }
        let w4 = self.coupled(both(w0, w3) + both(w1, w2)) * 0.25.into();
        let w5 = self.coupled(both(w0, w4) + both(w1, w3) + product(w2, w2)) * FIFTH.into();
        let d3 = w0.cross(c2);
        let c3 = w0.cross(w2) * (2.0 * THIRD).into() - d3 * SIXTH.into();
        let c4 = t1.cross(w3) + t2.cross(w2) + t3.cross(w1) + t4.cross(w0);
        let d4 = t1.cross(c3) + t2.cross(c2);
        let t5 = (w4 + c4 * HALF.into() + d4 * TWELFTH.into()) * FIFTH.into();
        let c5 = t1.cross(w4) + t2.cross(w3) + t3.cross(w2) + t4.cross(w1) + t5.cross(w0);
        let d5 = t1.cross(c4) + t2.cross(c3) + t3.cross(c2);
        let f5 = w0.cross(w0.cross(d3));
        let t6 = w5 + c5 * HALF.into() + d5 * TWELFTH.into() - f5 * (1.0 / 720.0).into();
        Vec3::select(is_long, short + (t5 + t6 * SIXTH.into()), short)
    }
}

impl AxisCoupling<f64> {
    /// The shortest plan for a turn by about `angle` with an error (rad) of at most `error`; `None` if there is none.
    pub(super) fn plan(self, angle: f64, error: f64) -> Option<SeriesPlan> {
        let longest = self.longest(angle);
        // False for NaN, too.
        let may_do = longest <= MOST * f64::from(MOST_STEPS);
        if !may_do {
            return None;
        }
        let order = SeriesOrder::Fourth;
        if self.keeps(order, longest, error) {
            return Some(SeriesPlan { steps: 1, order });
        }
        let order = SeriesOrder::Sixth;
        let does = |steps: &u32| {
            let steps = f64::from(*steps);
            self.keeps(order, longest / steps, error / steps)
        };
        let steps = (1..=MOST_STEPS).find(does)?;
        Some(SeriesPlan { steps, order })
    }

    /// The rotation in a unit of time that begins with this angular velocity; both in principal axes.
    pub(super) fn turn(self, angvel: DVec3, plan: SeriesPlan) -> DQuat {
        let is_long = plan.order == SeriesOrder::Sixth;
        small_rotation(real(self.scaled_axis(constant(angvel), is_long)))
    }
}

#[inline(always)]
fn product<N: Plain>(a: Vec3<N>, b: Vec3<N>) -> Vec3<N> {
    Vec3::new(a.y * b.z, a.z * b.x, a.x * b.y)
}

#[inline(always)]
fn both<N: Plain>(a: Vec3<N>, b: Vec3<N>) -> Vec3<N> {
    product(a, b) + product(b, a)
}

// Factors, since a multiplication takes a fraction of the time of a division.
const HALF: f64 = 0.5;
const THIRD: f64 = 1.0 / 3.0;
const FIFTH: f64 = 0.2;
const SIXTH: f64 = 1.0 / 6.0;
const TWELFTH: f64 = 1.0 / 12.0;

/// The rotation by a scaled axis of at most about [`MOST`].
fn small_rotation(axis: DVec3) -> DQuat {
    let x2 = axis.length_squared() * 0.25;
    let series = |terms: [f64; 5]| terms.iter().rev().fold(0.0, |sum, term| sum * x2 + term);
    let sine = series([1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0]);
    let cosine = series([1.0, -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0]);
    let half = axis * (0.5 * sine);
    DQuat::from_xyzw(half.x, half.y, half.z, cosine)
}

#[cfg(test)]
mod tests {
    use super::super::rotation::tests::Random;
    use super::super::taylor_rotation::Rotor;
    use super::*;

    /// The error of the plan for at most `error`, measured against a Taylor series; `None` if there is no plan.
    fn error_of(moments: DVec3, angvel: DVec3, error: f64) -> Option<(f64, SeriesPlan)> {
        let coupling = coupling_of(moments);
        let plan = coupling.plan(angvel.length(), error)?;
        let (mut momentum, mut all) = (moments * angvel, DQuat::IDENTITY);
        for _ in 0..plan.steps {
            let turn = coupling.turn(momentum / moments / f64::from(plan.steps), plan);
            all *= turn;
            momentum = turn.inverse() * momentum;
        }
        let rotor = Rotor {
            inverse_moments: moments.recip(),
            principal_to_body: DQuat::IDENTITY,
        };
        let momentum = moments * angvel;
        let exact = rotor.attitude_after(DQuat::IDENTITY, momentum, 1.0, 1e-18)?;
        Some((2.0 * (exact - all).length(), plan))
    }

    fn coupling_of(moments: DVec3) -> AxisCoupling<f64> {
        AxisCoupling::new(constant(moments), constant(moments.recip()))
    }

    /// Random numbers from 10 to the power of −`most` to 10 to the power of `most`.
    fn powers(random: &mut Random, most: f64) -> DVec3 {
        let exponents = random.vector() * most;
        DVec3::from_array(exponents.to_array().map(|x| 10_f64.powf(x)))
    }

    #[test]
    fn plans_keep_the_error_they_are_made_for() {
        let mut random = Random(11);
        let mut plans = [0; 10];
        for case in 0..30_000 {
            let mass = powers(&mut random, 1.0);
            let moments = if case % 2 == 0 {
                DVec3::new(mass.y + mass.z, mass.x + mass.z, mass.x + mass.y)
            } else {
                // No solid body has such moments, but users may set them.
                powers(&mut random, 3.0)
            };
            let angle = 10_f64.powf(2.0 * random.next() - 2.0);
            let angvel = random.vector().normalize() * angle;
            let error = 10_f64.powf(3.0 * random.next() - 10.0);
            let Some((found, plan)) = error_of(moments, angvel, error) else {
                plans[9] += 1;
                continue;
            };
            plans[match plan.order {
                SeriesOrder::Fourth => 0,
                SeriesOrder::Sixth => plan.steps as usize,
            }] += 1;
            // The Taylor series and the product of turns have rounding errors.
            assert!(
                found <= error + 1e-14,
                "{found:e} for {error:e}: {moments} {angvel} {plan:?}"
            );
        }
        assert!(plans.iter().all(|count| *count > 100), "{plans:?}");
    }

    #[test]
    fn the_two_series_are_of_fourth_and_sixth_order() {
        let (moments, way) = (DVec3::new(0.7, 1.1, 1.5), DVec3::new(0.5, -0.3, 0.8));
        let error = |order, angle: f64| {
            let plan = SeriesPlan { steps: 1, order };
            let coupling = coupling_of(moments);
            let turn = coupling.turn(way * angle, plan);
            let rotor = Rotor {
                inverse_moments: moments.recip(),
                principal_to_body: DQuat::IDENTITY,
            };
            let momentum = moments * way * angle;
            let exact = rotor.attitude_after(DQuat::IDENTITY, momentum, 1.0, 1e-18);
            (exact.expect("an attitude") - turn).length()
        };
        let cases = [
            (SeriesOrder::Fourth, 0.05, 5.0),
            (SeriesOrder::Sixth, 0.2, 7.0),
        ];
        for (order, angle, power) in cases {
            let measured: f64 = (error(order, angle) / error(order, 0.5 * angle)).log2();
            assert!((measured - power).abs() < 0.1, "{measured} for {power}");
        }
    }

    #[test]
    fn turns_that_are_too_fast_or_not_finite_have_no_plan() {
        let coupling = coupling_of(DVec3::new(0.7, 1.1, 1.5));
        for angle in [2.0, 1e9, f64::INFINITY, f64::NAN] {
            assert_eq!(coupling.plan(angle, 1e-9), None, "{angle}");
        }
        let broken = AxisCoupling(constant(DVec3::splat(f64::NAN)));
        assert_eq!(broken.plan(0.01, 1e-9), None);
        let still = coupling.plan(0.0, 1e-18).expect("no turn is a small one");
        assert_eq!(coupling.turn(DVec3::ZERO, still), DQuat::IDENTITY);
    }
}
