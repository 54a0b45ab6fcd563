//! Leaves and modifiers.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask};

use super::asked::Asked;
use super::chunk::{Chunk, Eight, Mask, Value, Vectors, WIDTH};
use super::local::{Local, length, square, times};
use super::operators::limited;
use super::region::holds;
use super::scale;
use crate::eval::lanes::lanes_of;
use crate::eval::waves::flow_at;
use crate::field::{
    Axis, Coupling, Drag, Field, ForceMode, Formula, Frame, Modifier, Profile, Radial, Spring,
    Swirl, Turbulence,
};
use crate::math::{DVec3, to_dvec3, to_f64};
use crate::sample::{Moment, SamplePoint, owner};

impl Asked<'_> {
    #[inline(always)]
    pub(super) fn leaf<S: Simd>(
        &self,
        chunk: &Chunk<'_, S>,
        leaf: usize,
        doubt: &mut Mask<S>,
    ) -> Value<S> {
        let field = &self.program.leaves[leaf];
        let Some(frame) = self.frame(leaf).filter(|_| field.is_on(self.moment.span)) else {
            return Value::undefined(chunk.simd);
        };
        let local = &Local::new(chunk, frame, self.moment);
        let acts = self.acts(chunk, field, frame);
        let defined = holds(&field.region, local, acts, doubt);
        if defined.all_false() {
            return Value::undefined(chunk.simd);
        }
        let strength = to_f64(self.program.strength(self.instance, leaf));
        let mut vector = vector(&field.formula, strength, local, defined, doubt);
        if let Some(scale) = &field.scale {
            vector = times(vector, scale::at(scale, local));
        }
        if let Some(limit) = field.limit {
            vector = limited(vector, to_f64(limit), defined, doubt);
        }
        let share = field.lifetime.share_of(self.moment.span);
        let weight = chunk.of_each(|sample| weight(field, sample, self.moment) * share);
        Value {
            defined,
            vector: times(local.to_world(vector), weight),
        }
    }

    /// The samples that a field acts on at all.
    #[inline(always)]
    fn acts<S: Simd>(&self, chunk: &Chunk<'_, S>, field: &Field, frame: &Frame) -> Mask<S> {
        let mut acts = chunk.here;
        if frame.body.is_some() {
            acts &= !chunk.owner.simd_eq(to_f64(owner(frame.body)));
        }
        if let Some(groups) = field.groups {
            let allowed = (0..WIDTH).filter(|lane| groups.test(chunk.samples[*lane].groups));
            let bits = allowed.fold(0, |bits, lane| bits | 1 << lane);
            acts &= Mask::<S>::from_bitmask(chunk.simd, bits);
        }
        acts
    }

    #[inline(always)]
    pub(super) fn modified<S: Simd>(
        &self,
        chunk: &Chunk<'_, S>,
        number: usize,
        value: Value<S>,
        doubt: &mut Mask<S>,
    ) -> Value<S> {
        let vector = match &self.program.modifiers[number] {
            Modifier::Scale { scale, .. } => {
                let frame = self.frame(self.program.leaves.len() + number);
                match frame.map(|frame| Local::new(chunk, frame, self.moment)) {
                    Some(local) => times(value.vector, scale::at(scale, &local)),
                    None => value.vector,
                }
            }
            Modifier::Limit(limit) => limited(value.vector, to_f64(*limit), value.defined, doubt),
        };
        Value { vector, ..value }
    }
}

/// What turns the vector of a field into a force on a sample.
fn weight(field: &Field, sample: &SamplePoint, moment: Moment) -> f64 {
    let coupled = match &field.coupling {
        Coupling::Axis(Axis::Radius) => to_f64(sample.radius),
        Coupling::Axis(Axis::Mass) => to_f64(sample.mass),
        Coupling::Axis(Axis::Charge) => to_f64(sample.charge),
        Coupling::Axis(_) => f64::NAN,
        Coupling::Share if field.mode == ForceMode::Force => to_f64(sample.share),
        Coupling::Share | Coupling::Each => 1.0,
    };
    let whole = match field.mode {
        ForceMode::Force => coupled,
        ForceMode::Acceleration => coupled * to_f64(sample.mass),
        ForceMode::VelocityChange => coupled * (to_f64(sample.mass) / to_f64(moment.dt)),
    };
    whole * to_f64(sample.fraction)
}

/// The vector of a formula, times a strength; see [`Program::in_lanes`](crate::compile::Program).
#[inline(always)]
fn vector<S: Simd>(
    formula: &Formula,
    strength: f64,
    local: &Local<'_, S>,
    defined: Mask<S>,
    doubt: &mut Mask<S>,
) -> Vectors<S> {
    let factor = local.chunk.splat(strength);
    match formula {
        Formula::Radial(law) => radial(law, factor, local, defined, doubt),
        formula => times(plain(formula, local), factor),
    }
}

#[inline(always)]
fn plain<S: Simd>(formula: &Formula, local: &Local<'_, S>) -> Vectors<S> {
    match formula {
        Formula::Spring(law) => spring(law, local),
        Formula::Drag(law) => drag(law, local.velocity),
        Formula::Wind(law) => {
            let ([u, v, w], flow) = (local.velocity, flow(&law.flow, local));
            let past = [u - flow[0], v - flow[1], w - flow[2]];
            let cap = to_f64(law.speed_cap);
            if cap == f64::INFINITY {
                return drag(&law.drag, past);
            }
            let speed = length(past);
            let (whole, part) = (local.chunk.splat(1.0), local.chunk.splat(cap) / speed);
            let factor = speed.simd_le(cap).select(whole, part);
            drag(&law.drag, times(past, factor))
        }
        Formula::Magnetic(law) => {
            let ([u, v, w], [a, b, c]) = (local.velocity, to_dvec3(law.field).to_array());
            [v * c - w * b, w * a - u * c, u * b - v * a]
        }
        formula => flow(formula, local),
    }
}

/// What may blow as a wind. A function of its own, since one that calls itself is not inlined.
#[inline(always)]
fn flow<S: Simd>(formula: &Formula, local: &Local<'_, S>) -> Vectors<S> {
    let chunk = local.chunk;
    match formula {
        Formula::Uniform(law) => {
            let [x, y, z] = to_dvec3(law.vector).to_array();
            [chunk.splat(x), chunk.splat(y), chunk.splat(z)]
        }
        Formula::Swirl(law) => swirl(law, local),
        Formula::Turbulence(law) => turbulence(law, local),
        // None of those that have lanes.
        _ => [chunk.splat(f64::NAN); 3],
    }
}

#[inline(always)]
fn radial<S: Simd>(
    law: &Radial,
    strength: Eight<S>,
    local: &Local<'_, S>,
    defined: Mask<S>,
    doubt: &mut Mask<S>,
) -> Vectors<S> {
    let unbounded = Radial {
        strongest: None,
        ..*law
    };
    let r2 = square(local.point);
    let factor = match law.profile {
        Profile::Power {
            strength: own,
            power: -2.0,
            softening: 0.0,
        } if unbounded.is_plain() && law.shifted_at.is_none() => {
            local.chunk.splat(to_f64(own)) / (r2 * r2.sqrt())
        }
        _ => {
            let mut factors = r2.to_array();
            for lane in lanes_of(defined.to_bitmask()) {
                factors[lane] = factor_at(&unbounded, factors[lane]);
            }
            Eight::load_array(r2.simd, factors)
        }
    };
    let vector = times(local.point, factor * strength);
    match law.strongest {
        Some(bound) => limited(vector, to_f64(bound), defined, doubt),
        None => vector,
    }
}

// Not inlined: compiled once, so that it is the same whatever instructions the caller may use.
#[inline(never)]
fn factor_at(law: &Radial, r2: f64) -> f64 {
    law.factor(r2)
}

#[inline(always)]
fn spring<S: Simd>(law: &Spring, local: &Local<'_, S>) -> Vectors<S> {
    let stiffness = to_f64(law.stiffness);
    let pull = match to_f64(law.rest_length) {
        0.0 => times(local.point, local.chunk.splat(-stiffness)),
        rest => {
            let stretched = length(local.point);
            let there = stretched.simd_gt(0.0);
            let factor = (stretched - rest) * -stiffness / stretched;
            times(local.point, there.select(factor, local.chunk.splat(0.0)))
        }
    };
    if law.damping == 0.0 {
        return pull;
    }
    let [u, v, w] = local.velocity;
    let damping = to_f64(law.damping);
    [
        pull[0] - u * damping,
        pull[1] - v * damping,
        pull[2] - w * damping,
    ]
}

#[inline(always)]
fn drag<S: Simd>(law: &Drag, velocity: Vectors<S>) -> Vectors<S> {
    let linear = to_f64(law.linear);
    let rate = match to_f64(law.quadratic) {
        0.0 => Eight::splat(velocity[0].simd, -linear),
        quadratic => -(length(velocity) * quadratic + linear),
    };
    times(velocity, rate)
}

#[inline(always)]
fn turbulence<S: Simd>(law: &Turbulence, local: &Local<'_, S>) -> Vectors<S> {
    let [x, y, z] = local.point.map(|parts| parts.to_array());
    let (mut flow, simd) = ([[0.0; WIDTH]; 3], local.chunk.simd);
    for lane in lanes_of(local.chunk.here.to_bitmask()) {
        let point = DVec3::new(x[lane], y[lane], z[lane]);
        let here = flow_at(simd, law, point, local.moment.time);
        for (axis, parts) in flow.iter_mut().enumerate() {
            parts[lane] = here[axis];
        }
    }
    flow.map(|parts| Eight::load_array(simd, parts))
}

#[inline(always)]
fn swirl<S: Simd>(law: &Swirl, local: &Local<'_, S>) -> Vectors<S> {
    let (zero, one) = (local.chunk.splat(0.0), local.chunk.splat(1.0));
    let along = local.chunk.splat(to_f64(law.along));
    if law.around == 0.0 && law.inward == 0.0 {
        return [zero, along, zero];
    }
    let ([x, _, z], core, power) = (local.point, to_f64(law.core), to_f64(law.power));
    let s2 = x * x + z * z + core * core;
    let scale = match power {
        1.0 => one,
        0.0 => one / s2.sqrt(),
        -1.0 => one / s2,
        _ => {
            let mut numbers = s2.to_array();
            numbers
                .iter_mut()
                .for_each(|s2| *s2 = raised(*s2, (power - 1.0) / 2.0));
            Eight::load_array(s2.simd, numbers)
        }
    };
    let scale = match power >= 0.0 {
        true => s2.simd_gt(0.0).select(scale, zero),
        false => scale,
    };
    let (around, inward) = (scale * to_f64(law.around), scale * to_f64(law.inward));
    [z * around - x * inward, along, -(x * around) - z * inward]
}

// Not inlined: compiled once, so that it is the same whatever instructions the caller may use.
#[inline(never)]
fn raised(number: f64, power: f64) -> f64 {
    number.powf(power)
}
