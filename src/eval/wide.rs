//! Programs on eight samples at a time: what the [interpreter](super::interpreter) gives, but for roundings of
//! an `f64`.
//!
//! Where these could decide (at borders, and between vectors of which the longer counts), and where a number
//! is not finite, a sample is *in doubt*, and the interpreter is asked.

mod asked;
mod chunk;
mod leaf;
mod local;
mod operators;
mod region;
mod scale;

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask};

use crate::compile::{DEPTH, Step};
use crate::math::{DVec3, Vector, from_dvec3};
use crate::sample::SamplePoint;

pub(super) use asked::Asked;
pub(super) use chunk::WIDTH;
use chunk::{Chunk, Mask, Value};

/// What an instance gives to up to eight samples; by bit, where it is defined, and who is in doubt.
#[derive(Debug, Default)]
pub(super) struct Found {
    forces: [[f64; WIDTH]; 3],
    pub defined: u64,
    pub doubtful: u64,
}

impl Found {
    /// The force on a sample on which it is defined.
    pub(super) fn force(&self, lane: usize) -> Vector {
        let [x, y, z] = &self.forces;
        from_dvec3(DVec3::new(x[lane], y[lane], z[lane]))
    }
}

impl Asked<'_> {
    /// Runs the instance on up to eight samples, and at least one.
    #[inline(always)]
    pub(super) fn on<S: Simd>(&self, simd: S, samples: &[&SamplePoint]) -> Found {
        let chunk = &Chunk::new(simd, samples);
        let mut doubt = chunk.none();
        let value = self.walk(chunk, &mut doubt);
        let zero = chunk.splat(0.0);
        let mut finite = chunk.here;
        for part in value.vector {
            finite &= part.is_finite();
        }
        let doubt = (doubt | (value.defined & !finite)) & chunk.here;
        let [x, y, z] = value
            .vector
            .map(|part| finite.select(part, zero).to_array());
        Found {
            forces: [x, y, z],
            defined: (value.defined & chunk.here & !doubt).to_bitmask(),
            doubtful: doubt.to_bitmask(),
        }
    }

    #[inline(always)]
    fn walk<S: Simd>(&self, chunk: &Chunk<'_, S>, doubt: &mut Mask<S>) -> Value<S> {
        let undefined = Value::undefined(chunk.simd);
        let mut stack = [undefined; DEPTH];
        let mut top = 0;
        for step in &self.program.steps {
            let (kept, value) = match *step {
                Step::Nowhere => (top, undefined),
                Step::Leaf(leaf) => (top, self.leaf(chunk, leaf as usize, doubt)),
                Step::Apply(operator, count) => {
                    let kept = top - count as usize;
                    let operands = &stack[kept..top];
                    (kept, operators::all(operator, operands, chunk, doubt))
                }
                Step::Layers(count, modes) => {
                    let kept = top - count as usize;
                    let modes = &self.program.modes[modes as usize];
                    (kept, operators::layers(&stack[kept..top], modes, chunk))
                }
                Step::Modify(number) => {
                    let value = stack[top - 1];
                    (top - 1, self.modified(chunk, number as usize, value, doubt))
                }
            };
            stack[kept] = value;
            top = kept + 1;
        }
        match top {
            0 => undefined,
            _ => stack[top - 1],
        }
    }
}

#[cfg(test)]
pub(super) mod tests;
