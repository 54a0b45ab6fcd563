//! What combines composites.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat};

use super::chunk::{Chunk, Eight, Mask, Value, Vectors};
use super::local::{square, times};
use crate::field::{Operator, Override};

/// Squares of lengths outside of this are not relied upon.
const SMALLEST: f64 = f64::MIN_POSITIVE * 1e20;
const LARGEST: f64 = f64::MAX * 1e-20;

#[inline(always)]
fn choose<S: Simd>(which: Mask<S>, a: Vectors<S>, b: Vectors<S>) -> Vectors<S> {
    let [[x, y, z], [u, v, w]] = [a, b];
    [which.select(x, u), which.select(y, v), which.select(z, w)]
}

/// An operator on all operands, the first two first.
#[inline(always)]
pub(super) fn all<S: Simd>(
    operator: Operator,
    operands: &[Value<S>],
    chunk: &Chunk<'_, S>,
    doubt: &mut Mask<S>,
) -> Value<S> {
    let mut operands = operands.iter().copied();
    let Some(mut combined) = operands.next() else {
        return Value::undefined(chunk.simd);
    };
    for operand in operands {
        combined = apply(operator, combined, operand, doubt);
    }
    combined
}

/// See the table at [`Operator`].
#[inline(always)]
fn apply<S: Simd>(operator: Operator, u: Value<S>, v: Value<S>, doubt: &mut Mask<S>) -> Value<S> {
    let both = u.defined & v.defined;
    let defined = match operator {
        Operator::Difference => u.defined & !v.defined,
        _ if operator.is_intersection() => both,
        _ => u.defined | v.defined,
    };
    let alone = choose(u.defined, u.vector, v.vector);
    let together = meet(operator, u.vector, v.vector, both, doubt);
    Value {
        defined,
        vector: choose(both, together, alone),
    }
}

/// The vector where both operands are defined.
#[inline(always)]
fn meet<S: Simd>(
    operator: Operator,
    u: Vectors<S>,
    v: Vectors<S>,
    both: Mask<S>,
    doubt: &mut Mask<S>,
) -> Vectors<S> {
    use Operator::*;
    let [[a, b, c], [x, y, z]] = [u, v];
    match operator {
        SumUnion | SumIntersection => [a + x, b + y, c + z],
        CrossUnion | CrossIntersection => [b * z - c * y, c * x - a * z, a * y - b * x],
        ReplaceUnion | ReplaceIntersection => v,
        Difference => u,
        Strongest | Weakest => {
            let (long_u, long_v) = (square(u), square(v));
            let apart = (long_u - long_v).abs();
            let sum = long_u + long_v;
            let sure = apart.simd_gt(sum * (64.0 * f64::EPSILON))
                & sum.simd_gt(SMALLEST)
                & sum.simd_lt(LARGEST);
            *doubt |= both & !sure;
            let takes_v = match operator {
                Strongest => long_v.simd_gt(long_u),
                _ => long_v.simd_lt(long_u),
            };
            choose(takes_v, v, u)
        }
        Minimum => [
            x.simd_lt(a).select(x, a),
            y.simd_lt(b).select(y, b),
            z.simd_lt(c).select(z, c),
        ],
        Maximum => [
            x.simd_gt(a).select(x, a),
            y.simd_gt(b).select(y, b),
            z.simd_gt(c).select(z, c),
        ],
    }
}

/// The rule at [`Tree::layers`](crate::Tree::layers), for operands of falling priority.
#[inline(always)]
pub(super) fn layers<S: Simd>(
    operands: &[Value<S>],
    modes: &[Override],
    chunk: &Chunk<'_, S>,
) -> Value<S> {
    let zero = [chunk.splat(0.0); 3];
    let mut gathered = Value::undefined(chunk.simd);
    let mut stopped = chunk.none();
    for (value, mode) in operands.iter().zip(modes) {
        gathered.defined |= value.defined;
        let counts = value.defined & !stopped;
        let before = match mode.replaces {
            true => zero,
            false => gathered.vector,
        };
        let [[a, b, c], [x, y, z]] = [before, value.vector];
        gathered.vector = choose(counts, [a + x, b + y, c + z], gathered.vector);
        if mode.stops {
            stopped |= counts;
        }
    }
    gathered
}

/// Vectors no longer than this.
#[inline(always)]
pub(super) fn limited<S: Simd>(
    vector: Vectors<S>,
    limit: f64,
    defined: Mask<S>,
    doubt: &mut Mask<S>,
) -> Vectors<S> {
    let simd = vector[0].simd;
    if limit == 0.0 {
        return [Eight::splat(simd, 0.0); 3];
    }
    let long = square(vector);
    let [x, y, z] = vector;
    let nothing = x.simd_eq(0.0) & y.simd_eq(0.0) & z.simd_eq(0.0);
    let sure = nothing | (long.simd_gt(SMALLEST) & long.simd_lt(LARGEST));
    *doubt |= defined & !sure;
    let size = long.sqrt();
    let shortened = times(vector, Eight::splat(simd, limit) / size);
    choose(size.simd_gt(limit), shortened, vector)
}
