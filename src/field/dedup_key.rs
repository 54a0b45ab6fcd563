//! A hash of fields, to find those that can be evaluated as instances of one.

use std::hash::{Hash, Hasher};
use std::sync::LazyLock;

use super::closure::Closure;
use super::formula::Formula;
use super::leaf::Field;
use super::query::{LocalQuery, Query};
use super::region::RegionStep;
use super::solid::Solid;
use crate::math::{DQuat, DVec3, to_f64};
use crate::number::{constant, real};

impl Field {
    /// Returns true if two enabled fields differ at most in name, anchor and strength.
    pub(crate) fn is_like(&self, other: &Field) -> bool {
        self.formula == other.formula
            && self.lifetime == other.lifetime
            && self.region == other.region
            && self.mode == other.mode
            && self.coupling == other.coupling
            && self.scale == other.scale
            && self.limit == other.limit
            && self.groups == other.groups
            && self.reacts == other.reacts
            && self.sampling == other.sampling
    }

    /// A hash that is equal for fields that are alike, and rarely for others. It is made of the vector at one point
    /// and the distances of another point from the surfaces of the region.
    pub(crate) fn dedup_key(&self) -> u64 {
        let mut print = Fingerprint::default();
        std::mem::discriminant(&self.formula).hash(&mut print);
        match code(&self.formula) {
            // A closure is equal to itself only.
            Some(closure) => print.write_usize(std::ptr::from_ref(closure).addr()),
            None => print.numbers(&real(self.formula.vector(&seen_from(NEAR))).to_array()),
        }
        let far = seen_from(FAR);
        for step in &self.region.steps {
            std::mem::discriminant(step).hash(&mut print);
            match step {
                // Left out, since distances from a Parry shape are slow to compute.
                RegionStep::Solid(Solid::Shape(_), _) | RegionStep::Predicate(_) => {}
                RegionStep::Solid(solid, pose) => {
                    let far = constant(FAR);
                    solid.for_each_surface(far, pose, |surface| print.number(surface.distance));
                }
                RegionStep::Interval(axis, min, max) => {
                    axis.hash(&mut print);
                    print.numbers(&[*min, *max].map(to_f64));
                }
                set => print.number(set.depth(&far)),
            }
        }
        self.mode.hash(&mut print);
        self.coupling.hash(&mut print);
        print.numbers(&[self.lifetime.from, self.lifetime.until]);
        print.number(to_f64(self.limit.unwrap_or(-1.0)));
        (self.scale.is_some(), self.reacts).hash(&mut print);
        print.finish()
    }
}

/// A place within the range of most formulas, and below the surface of fluids.
const NEAR: DVec3 = DVec3::new(0.137, -0.291, 0.173);

/// A place outside of most regions: there the distance from a round surface depends on all lengths of the
/// solid.
const FAR: DVec3 = DVec3::new(1031.7, -1519.3, 977.1);

/// A sample at a place of the field's own frame, with no property that is zero.
fn seen_from(local_point: DVec3) -> LocalQuery<'static> {
    static SAMPLE: LazyLock<Query> = LazyLock::new(|| Query {
        time: 0.7,
        radius: 0.3,
        charge: 1.3,
        volume: 0.9,
        ..Query::default()
    });
    LocalQuery {
        point: constant(local_point),
        velocity: constant(DVec3::new(0.419, 0.353, -0.761)),
        rotation: DQuat::IDENTITY,
        collider: None,
        query: &SAMPLE,
    }
}

/// The user's function in a formula.
fn code(formula: &Formula) -> Option<&Closure> {
    match formula {
        Formula::Closure(closure) => Some(closure),
        Formula::Wind(wind) => code(&wind.flow),
        _ => None,
    }
}

/// Mixes numbers. Much faster than the hasher of the standard library, and sufficient for numbers that are not
/// chosen to collide.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fingerprint(u64);

impl Hasher for Fingerprint {
    fn write(&mut self, bytes: &[u8]) {
        for bytes in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..bytes.len()].copy_from_slice(bytes);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u32(&mut self, number: u32) {
        self.write_u64(u64::from(number));
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = (self.0.rotate_left(5) ^ number).wrapping_mul(0x517c_c1b7_2722_0a95);
    }

    fn write_usize(&mut self, number: usize) {
        self.write_u64(number as u64);
    }

    fn finish(&self) -> u64 {
        // Single-precision numbers end in zeros, which a product keeps.
        let mixed = (self.0 ^ (self.0 >> 32)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        mixed ^ (mixed >> 33)
    }
}

impl Fingerprint {
    /// Zeros of both signs count as equal.
    fn number(&mut self, x: f64) {
        self.write_u64((x + 0.0).to_bits());
    }

    fn numbers(&mut self, list: &[f64]) {
        list.iter().for_each(|x| self.number(*x));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::region::Region;
    use crate::math::{Real, Vector};

    #[test]
    fn fields_that_are_alike_have_equal_hashes_and_others_do_not() {
        let zone = |x: Real| Field::uniform(Vector::X * x).within(Region::ball(2.0));
        let number = |field: &Field| field.dedup_key();
        let named = zone(1.0).named("a").at(Vector::Y).strength(3.0);
        assert!(zone(1.0).is_like(&named));
        assert_eq!(number(&zone(1.0)), number(&named));
        assert!(zone(0.0).is_like(&zone(-0.0)));
        assert_eq!(number(&zone(0.0)), number(&zone(-0.0)));
        let numbers: std::collections::HashSet<u64> =
            (0..10_000).map(|k| number(&zone(k as Real))).collect();
        assert_eq!(numbers.len(), 10_000);
    }

    /// Regions that differ in one length have different hashes.
    #[test]
    fn each_length_of_a_region_counts() {
        let makes: [fn(Real) -> Region; 11] = [
            Region::ball,
            |x| Region::cuboid(Vector::new(x, 1.0, 1.0)),
            |x| Region::cuboid(Vector::new(1.0, 1.0, x)),
            |x| Region::cylinder(x, 1.0),
            |x| Region::cylinder(1.0, x),
            |x| Region::cone(x, 1.0),
            |x| Region::cone(1.0, x),
            |x| Region::capsule(x, 1.0),
            |x| Region::interval("x", -1.0, x),
            |x| Region::interval("speed", -x, 1.0),
            |x| Region::ball(9.0).difference(Region::half_space(Vector::Y, x)),
        ];
        for (place, make) in makes.iter().enumerate() {
            let field = |k: u16| Field::uniform(Vector::X).within(make(1.0 + Real::from(k) * 1e-3));
            let numbers: std::collections::HashSet<u64> =
                (0..1000).map(|k| field(k).dedup_key()).collect();
            assert_eq!(numbers.len(), 1000, "{place}");
        }
    }
}
