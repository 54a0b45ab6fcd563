//! Free rotations over a step, of eight bodies at a time.
//!
//! Rapier turns a body at constant angular velocity, over linearised substeps (see [`steady_angvel`]). Where one series
//! of the scaled axis Φ of the rotation is accurate to rounding, that velocity follows from Φ itself: it is
//! Φ/dt · tan(y)/y, as each substep turns by 2y = |Φ| / substeps.

use super::body::Body;
use super::principal_inertia::PrincipalInertia;
use super::rotation::{Inertia, steady_angvel, tangent_ratio};
use super::small_turn::{AxisCoupling, SeriesOrder, series_error};
use crate::math::{DVec3, Real, Rotation, Vector, from_dvec3, to_dquat, to_dvec3, to_f64};
use crate::number::{
    LANES, LaneMask, Lanes, Mask, Number, Quat, Vec3, each_lane, in_registers, length,
};

/// A body that turns freely from the beginning of a step on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeTop {
    attitude: Rotation,
    /// Its moments are positive and finite.
    inertia: PrincipalInertia,
    angvel: Vector,
    /// The angular impulse on the body at the beginning of the rotation.
    twist: DVec3,
    /// The number of substeps in which Rapier turns the body.
    substeps: u32,
}

/// A free rotation over a step, as Rapier carries it out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SteadySpin {
    /// The angular momentum, in world axes.
    pub momentum: DVec3,
    /// The constant angular velocity, in world axes.
    pub angvel: Vector,
}

/// The rotations of eight tops, and the lanes in which one series gives them to rounding.
struct LaneSpins {
    momentum: Vec3<Lanes>,
    angvel: Vec3<Lanes>,
    is_small: LaneMask,
}

impl FreeTop {
    pub(crate) fn new(body: &Body, twist: DVec3, substeps: u32) -> Self {
        FreeTop {
            attitude: body.pose.rotation,
            inertia: body.principal_inertia,
            angvel: body.angvel,
            twist,
            substeps: body.iterations(substeps).max(1),
        }
    }

    /// The rotations over `dt` of up to eight tops.
    pub(crate) fn turn_all(tops: &[FreeTop], dt: Real) -> impl Iterator<Item = SteadySpin> {
        let spins = in_registers(
            #[inline(always)]
            || LaneSpins::of(tops, to_f64(dt)),
        );
        tops.iter().enumerate().map(move |(lane, top)| {
            let momentum = spins.momentum.lane(lane);
            let angvel = if spins.is_small.is_set(lane) {
                from_dvec3(spins.angvel.lane(lane))
            } else {
                top.steady_angvel(momentum, dt)
            };
            SteadySpin { momentum, angvel }
        })
    }

    /// The angular velocity by which Rapier carries out a rotation of any size.
    fn steady_angvel(&self, momentum: DVec3, dt: Real) -> Vector {
        let Some(inertia) = Inertia::of_principal(self.inertia) else {
            return self.angvel;
        };
        let rotation = inertia.free_rotation(to_dquat(self.attitude), momentum, to_f64(dt));
        steady_angvel(rotation, dt, self.substeps)
    }
}

impl LaneSpins {
    /// Lanes after the last top repeat the first top.
    #[inline(always)]
    fn of(tops: &[FreeTop], dt: f64) -> Self {
        let tops = each_lane(|lane| tops.get(lane).unwrap_or(&tops[0]));
        let attitude = quaternions(&tops, |it| it.attitude);
        let to_world = attitude
            .after(quaternions(&tops, |it| it.inertia.frame))
            .normalized();
        let to_principal = to_world.inverse();
        let inverse_moments = vectors(&tops, |it| to_dvec3(it.inertia.inverse));
        let moments = inverse_moments.map(Lanes::recip);
        let angvel = to_principal.rotate(vectors(&tops, |it| to_dvec3(it.angvel)));
        let twist = vectors(&tops, |it| it.twist);
        let spun = moments.times(angvel);
        let momentum = to_world.rotate(spun) + twist;
        let turn = inverse_moments.times(spun + to_principal.rotate(twist)) * dt.into();
        let coupling = AxisCoupling::new(moments, inverse_moments);
        let (longest, error) = (coupling.longest(length(turn)), series_error());
        let is_short = coupling.keeps(SeriesOrder::Fourth, longest, error);
        let is_small = is_short | coupling.keeps(SeriesOrder::Sixth, longest, error);
        if !is_small.any() {
            let angvel = Vec3::zero();
            return LaneSpins {
                momentum,
                angvel,
                is_small,
            };
        }
        let axis = coupling.scaled_axis(turn, is_small & !is_short);
        let substeps = Lanes::from_fn(|lane| f64::from(tops[lane].substeps));
        let half = Lanes::from(0.5) / substeps;
        let rate = tangent_ratio(axis.dot(axis) * half * half) * dt.recip();
        LaneSpins {
            momentum,
            angvel: to_world.rotate(axis * rate),
            is_small,
        }
    }
}

#[inline(always)]
fn vectors(tops: &[&FreeTop; LANES], of: impl Fn(&FreeTop) -> DVec3) -> Vec3<Lanes> {
    let all = each_lane(|lane| of(tops[lane]));
    Vec3::new(
        Lanes::from_fn(|lane| all[lane].x),
        Lanes::from_fn(|lane| all[lane].y),
        Lanes::from_fn(|lane| all[lane].z),
    )
}

#[inline(always)]
fn quaternions(tops: &[&FreeTop; LANES], of: impl Fn(&FreeTop) -> Rotation) -> Quat<Lanes> {
    let w = Lanes::from_fn(|lane| to_f64(of(tops[lane]).w));
    let axis = |it: &FreeTop| of(it).xyz();
    Quat {
        xyz: vectors(tops, |it| to_dvec3(axis(it))),
        w,
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotation::tests::Random;
    use super::*;
    use crate::math::{DQuat, from_f64};
    use crate::number::{FORCED, lanes_of};

    /// A top with positive moments that turns over a step of unit length by about 10⁻³ to 10¹ rad.
    fn random_top(random: &mut Random) -> FreeTop {
        let quaternion = |random: &mut Random| {
            let [x, y, z, w] = [(); 4].map(|()| from_f64(random.next()));
            Rotation::from_xyzw(x, y, z, w).normalize()
        };
        let masses = random.vector() * 0.9 + DVec3::ONE;
        let moments = DVec3::new(
            masses.y + masses.z,
            masses.x + masses.z,
            masses.x + masses.y,
        );
        let speed = 10_f64.powf(2.0 * random.next() - 1.0);
        FreeTop {
            attitude: quaternion(random),
            inertia: PrincipalInertia {
                inverse: from_dvec3(moments.recip()),
                frame: quaternion(random),
            },
            angvel: from_dvec3(random.vector() * speed),
            twist: random.vector() * speed * 0.1,
            substeps: 1 + (random.next().abs() * 5.0) as u32,
        }
    }

    /// The same rotation without lanes.
    fn alone(top: &FreeTop) -> SteadySpin {
        let inertia = Inertia::of_principal(top.inertia).expect("positive moments");
        let attitude = to_dquat(top.attitude);
        let momentum = inertia.angular_momentum(attitude, to_dvec3(top.angvel)) + top.twist;
        let rotation: DQuat = inertia.free_rotation(attitude, momentum, 1.0);
        let angvel = steady_angvel(rotation, 1.0, top.substeps);
        SteadySpin { momentum, angvel }
    }

    #[test]
    fn tops_turn_together_as_each_does_alone() {
        let (mut random, mut small) = (Random(5), 0);
        for case in 0..2_000 {
            let count = 1 + case % LANES;
            let tops: Vec<FreeTop> = (0..count).map(|_| random_top(&mut random)).collect();
            let is_small = LaneSpins::of(&tops, 1.0).is_small.bits();
            small += lanes_of(is_small).filter(|lane| *lane < count).count();
            for (top, found) in tops.iter().zip(FreeTop::turn_all(&tops, 1.0)) {
                let expected = alone(top);
                let off = (found.momentum - expected.momentum).length();
                assert!(
                    off <= 1e-14 * expected.momentum.length(),
                    "{off:e}: {top:?}"
                );
                let off = (found.angvel - expected.angvel).length();
                // The series leave a rounding of `Real` for a turn of one radian. The roundings of the momentum grow
                // with the turn, and with the tangents of its substeps.
                let size = 1.0 + expected.angvel.length();
                let bound =
                    2.0 * Real::EPSILON * size + from_f64(64.0 * f64::EPSILON) * size * size;
                assert!(off <= bound, "{off:e}: {top:?}");
            }
        }
        assert!(
            (1_000..8_000).contains(&small),
            "{small} of 9,000 are small turns"
        );
    }

    #[test]
    fn neighbours_and_instruction_sets_change_no_bit() {
        let mut random = Random(9);
        let tops: Vec<FreeTop> = (0..LANES).map(|_| random_top(&mut random)).collect();
        let bits = |spin: SteadySpin| (spin.momentum, spin.angvel);
        let expected: Vec<_> = FreeTop::turn_all(&tops, 1.0).map(bits).collect();
        for (top, expected) in tops.iter().zip(&expected) {
            let single = FreeTop::turn_all(std::slice::from_ref(top), 1.0).map(bits);
            assert_eq!(single.collect::<Vec<_>>(), [*expected]);
        }
        FORCED.set(Some(fearless_simd::Level::baseline()));
        let found: Vec<_> = FreeTop::turn_all(&tops, 1.0).map(bits).collect();
        FORCED.set(None);
        assert_eq!(found, expected);
    }
}
