//! A random flow without sources, as a sum of plane waves.

use std::f64::consts::TAU;

use super::Law;
use super::random::Random;
use crate::field::error::{BuildError, all_finite, positive, require};
use crate::field::query::{LocalQuery, QueryNumber, QueryProperties};
use crate::math::{DVec3, Real, to_f64};
use crate::number::{LANES, Lanes, Plain, Vec3, chain, constant, sin_cos};

/// A random flow without sources, the curl of a random vector potential: a sum of plane waves
/// Σ (aₙ cos φₙ + bₙ sin φₙ), φₙ = kₙ·d + ωₙ t, with aₙ and bₙ across kₙ.
///
/// Random directions and phases come from the seed; lengths of the waves fall geometrically from
/// `size` to `size`/`detail`, their energies like Kolmogorov's k^(−5/3) spectrum, and their
/// frequencies grow with k^(2/3) as eddies turn over. (Kraichnan, Phys. Fluids 13, 1970; Fung,
/// Hunt, Malik and Perkins, J. Fluid Mech. 236, 1992.) The mean square of the flow is `speed`².
/// Smooth and without divergence everywhere; no potential.
#[derive(Clone, Debug, PartialEq)]
#[must_use = "setters and operators take the value and return the changed one"]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(from = "TurbulenceSettings", into = "TurbulenceSettings")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Turbulence {
    pub(crate) seed: u64,
    pub(crate) speed: Real,
    pub(crate) size: Real,
    pub(crate) detail: Real,
    pub(crate) turnover: Real,
    pub(crate) waves: Box<Waves>,
}

/// The number of waves: enough for a flow that looks the same in all directions.
const WAVES: usize = 32;

/// One number for each wave.
type Each = [f64; WAVES];

/// The waves in columns, so that several fit into a register.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Waves {
    /// kₙ.
    pub along: [Each; 3],
    /// ωₙ.
    pub frequency: Each,
    /// aₙ and bₙ.
    pub cosine: [Each; 3],
    pub sine: [Each; 3],
}

/// One wave, or several.
struct Wave<P> {
    along: Vec3<P>,
    frequency: P,
    cosine: Vec3<P>,
    sine: Vec3<P>,
}

fn set(vectors: &mut [Each; 3], n: usize, vector: DVec3) {
    for (axis, numbers) in vectors.iter_mut().enumerate() {
        numbers[n] = vector[axis];
    }
}

impl Turbulence {
    /// A flow of root mean square `speed` whose largest eddies have the length `size`.
    pub fn new(seed: u64, speed: Real, size: Real) -> Self {
        Turbulence {
            seed,
            speed,
            size,
            detail: 8.0,
            turnover: 0.0,
            waves: Box::default(),
        }
        .made()
    }

    /// Sets the ratio of the largest to the smallest eddies. Eight by default.
    pub fn detail(mut self, ratio: Real) -> Self {
        self.detail = ratio;
        self.made()
    }

    /// Sets the rate at which the largest eddies change, per time. None by default: the flow is
    /// frozen.
    pub fn turnover(mut self, rate: Real) -> Self {
        self.turnover = rate;
        self.made()
    }

    /// The flow at a point, and its derivatives. Compiled once, for the instruction set of the build.
    #[inline(never)]
    fn sums(&self, point: DVec3, time: f64) -> Sums<f64> {
        self.waves.at_one(point, time)
    }

    fn made(mut self) -> Self {
        let mut random = Random::new(self.seed);
        let largest = TAU / to_f64(self.size);
        let mut energy = 0.0;
        for n in 0..WAVES {
            let ratio = to_f64(self.detail).powf(n as f64 / (WAVES - 1) as f64);
            let along = random.unit_vector();
            // Evenly spaced in log k, so a wave's share of k^(-5/3) dk goes like k^(-2/3).
            let amplitude = ratio.powf(-1.0 / 3.0);
            let mut across = || along.cross(random.unit_vector()) * amplitude;
            let (cosine, sine) = (across(), across());
            energy += (cosine.length_squared() + sine.length_squared()) / 2.0;
            set(&mut self.waves.along, n, along * (largest * ratio));
            set(&mut self.waves.cosine, n, cosine);
            set(&mut self.waves.sine, n, sine);
            self.waves.frequency[n] = TAU * to_f64(self.turnover) * ratio.powf(2.0 / 3.0);
        }
        let scale = to_f64(self.speed) / energy.sqrt();
        let [cosine, sine] = [&mut self.waves.cosine, &mut self.waves.sine];
        for number in cosine.iter_mut().chain(sine).flatten() {
            *number *= scale;
        }
        self
    }
}

/// The settings of the flow, as they are saved. The waves follow from them.
#[cfg(feature = "serde-serialize")]
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct TurbulenceSettings {
    seed: u64,
    speed: Real,
    size: Real,
    #[serde(default = "usual_detail")]
    detail: Real,
    #[serde(default)]
    turnover: Real,
}

#[cfg(feature = "serde-serialize")]
fn usual_detail() -> Real {
    8.0
}

#[cfg(feature = "serde-serialize")]
impl From<TurbulenceSettings> for Turbulence {
    fn from(settings: TurbulenceSettings) -> Self {
        Turbulence {
            detail: settings.detail,
            turnover: settings.turnover,
            ..Turbulence::new(settings.seed, settings.speed, settings.size)
        }
        .made()
    }
}

#[cfg(feature = "serde-serialize")]
impl From<Turbulence> for TurbulenceSettings {
    fn from(law: Turbulence) -> Self {
        TurbulenceSettings {
            seed: law.seed,
            speed: law.speed,
            size: law.size,
            detail: law.detail,
            turnover: law.turnover,
        }
    }
}

/// The flow of some waves, and its derivatives along x, y and z.
type Sums<P> = [Vec3<P>; 4];

/// Adds the flow of one wave, or of several, and its derivatives.
#[inline(always)]
fn flow_of<P: Plain>(wave: Wave<P>, point: Vec3<P>, time: f64, sums: &mut Sums<P>) {
    let (sin, cos) = sin_cos(wave.along.dot(point) + wave.frequency * time);
    sums[0] += wave.cosine * cos + wave.sine * sin;
    let turned = wave.sine * cos - wave.cosine * sin;
    for axis in 0..3 {
        sums[axis + 1] += turned * wave.along[axis];
    }
}

impl Waves {
    /// Some waves, taken from each column by `number`.
    #[inline(always)]
    fn wave<P: Plain>(&self, number: impl Fn(&Each) -> P) -> Wave<P> {
        let vector = |[x, y, z]: &[Each; 3]| Vec3::new(number(x), number(y), number(z));
        Wave {
            along: vector(&self.along),
            frequency: number(&self.frequency),
            cosine: vector(&self.cosine),
            sine: vector(&self.sine),
        }
    }

    /// The flow at one point, with its derivatives: eight waves at once.
    #[inline(always)]
    fn at_one(&self, point: DVec3, time: f64) -> Sums<f64> {
        let mut sums = [Vec3::zero(); 4];
        for first in (0..WAVES).step_by(LANES) {
            let wave = self.wave(|column| Lanes::from_fn(|lane| column[first + lane]));
            flow_of(wave, constant(point), time, &mut sums);
        }
        sums.map(|vector| vector.map(Lanes::total))
    }

    /// The flow at several points: wave by wave, added in the same order as in [`Self::at_one`].
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn at_several<P: Plain>(&self, point: Vec3<P>, time: f64) -> Vec3<P> {
        let mut flow = Vec3::zero();
        for lane in 0..LANES {
            let mut sums = [Vec3::zero(); 4];
            for n in (lane..WAVES).step_by(LANES) {
                flow_of(self.wave(|column| column[n].into()), point, time, &mut sums);
            }
            flow = if lane == 0 { sums[0] } else { flow + sums[0] };
        }
        flow
    }
}

impl Law for Turbulence {
    fn kind(&self) -> &'static str {
        "turbulence"
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn vector<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let (point, time) = (local.point, local.query.numbers().time);
        let Some(one) = local.single() else {
            return Vec3::of(self.waves.at_several(point.re(), time));
        };
        let [flow, slopes @ ..] = self.sums(one.local_point(), time);
        let of_single = |vector: Vec3<f64>| vector.map(T::Plain::from);
        chain(of_single(flow), [point.x, point.y, point.z], || {
            slopes.map(of_single)
        })
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        all_finite(
            field,
            &[
                ("the speed", self.speed),
                ("the turnover rate", self.turnover),
            ],
        )?;
        positive(field, "the size", self.size)?;
        let fits = self.detail >= 1.0 && self.detail.is_finite();
        let (quantity, value) = ("the detail", to_f64(self.detail));
        require(fits, field, quantity, "one or more, and finite", value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each wave has the length, the share of the energy and the frequency that are documented.
    #[test]
    fn energies_fall_like_kolmogorovs() {
        const DETAIL: f64 = 64.0;
        const SEEDS: u64 = 400;
        let mut energies: Each = [0.0; WAVES];
        let square = |vectors: &[Each; 3], n: usize| -> f64 {
            vectors.iter().map(|numbers| numbers[n] * numbers[n]).sum()
        };
        for seed in 0..SEEDS {
            let flow = Turbulence::new(seed, 3.0, 2.0).detail(64.0).turnover(0.5);
            let waves = &flow.waves;
            for (n, energy) in energies.iter_mut().enumerate() {
                let ratio = DETAIL.powf(n as f64 / 31.0);
                let length = TAU / square(&waves.along, n).sqrt();
                assert!((length * ratio - 2.0).abs() < 1e-12, "{n}: {length}");
                let frequency = waves.frequency[n] / (TAU * 0.5);
                assert!((frequency / ratio.cbrt().powi(2) - 1.0).abs() < 1e-12);
                *energy += (square(&waves.cosine, n) + square(&waves.sine, n)) / 2.0;
            }
        }
        let total: f64 = energies.iter().sum();
        assert!((total / SEEDS as f64 - 9.0).abs() < 1e-9, "{total}");
        // The mean over the seeds has a standard deviation of 1.6 %.
        let due: Each = std::array::from_fn(|n| DETAIL.powf(n as f64 / -46.5));
        let level = total / due.iter().sum::<f64>();
        for (n, (energy, due)) in energies.iter().zip(due).enumerate() {
            let off = energy / (level * due) - 1.0;
            assert!(off.abs() < 0.05, "{n}: {off}");
        }
    }
}
