//! Which fields can be evaluated as instances of one.

use std::hash::Hasher;

use super::formula::{Formula, Radial};
use super::leaf::Field;
use super::over_axes::Shape;
use super::region::{Region, Step};
use super::solid::Solid;
use crate::math::{Pose, Real, Vector, to_f64};

impl Field {
    /// Whether two fields that are on differ in name, anchor and strength at most.
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

    /// The same number for fields that are alike, and mostly another for those that are not.
    pub(crate) fn likeness(&self) -> u64 {
        let mut print = Fingerprint::default();
        print.formula(&self.formula);
        print.region(&self.region);
        print.write_u8(self.mode as u8);
        std::hash::Hash::hash(&self.coupling, &mut print);
        print.write_u64(self.lifetime.from.to_bits() ^ self.lifetime.until.to_bits());
        print.real(self.limit.unwrap_or(-1.0));
        print.write_u8(u8::from(self.scale.is_some()) + 2 * u8::from(self.reacts));
        print.finish()
    }
}

/// Mixes numbers; much faster than the hasher of the standard library, and as good for numbers
/// that nobody picks to collide.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fingerprint(u64);

impl Hasher for Fingerprint {
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(u64::from(*byte));
        }
    }

    fn write_u8(&mut self, number: u8) {
        self.write_u64(u64::from(number));
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
    /// Zeros of both signs count as one.
    fn real(&mut self, x: Real) {
        self.write_u64(to_f64(x + 0.0).to_bits());
    }

    fn reals(&mut self, list: &[Real]) {
        list.iter().for_each(|x| self.real(*x));
    }

    fn vector(&mut self, vector: Vector) {
        self.reals(&vector.to_array());
    }

    fn pose(&mut self, pose: &Pose) {
        self.vector(pose.translation);
        let turn = pose.rotation;
        self.reals(&[turn.x, turn.y, turn.z, turn.w]);
    }

    fn radial(&mut self, radial: &Radial) {
        let (strength, unit) = radial.unit();
        self.real(strength);
        for bits in unit.bits() {
            // A zero of either sign.
            self.write_u64(if bits == 1 << 63 { 0 } else { bits });
        }
    }

    fn formula(&mut self, formula: &Formula) {
        match formula {
            Formula::Uniform(law) => self.vector(law.vector),
            Formula::Radial(law) => self.radial(law),
            Formula::Nearest(law) => self.radial(&law.radial),
            Formula::Spring(law) => self.reals(&[law.stiffness, law.damping, law.rest_length]),
            Formula::Drag(law) => self.reals(&[law.linear, law.quadratic]),
            Formula::Wind(law) => {
                self.reals(&[law.drag.linear, law.drag.quadratic, law.speed_cap]);
                self.formula(&law.flow);
            }
            Formula::Magnetic(law) => self.vector(law.field),
            Formula::Swirl(law) => {
                self.reals(&[law.around, law.inward, law.along, law.power, law.core]);
            }
            Formula::Buoyancy(law) => self.reals(&[law.density, law.gravity]),
            Formula::Turbulence(law) => self.real(law.turnover),
            Formula::Path(law) => {
                self.reals(&[law.speed, law.look_ahead, law.stiffness, law.damping]);
            }
            Formula::Grid(law) => {
                self.vector(law.low);
                self.vector(law.high);
            }
            Formula::LinearKernel(law) => {
                self.vector(law.constant);
                self.vector(law.position_target);
                self.vector(law.velocity_target);
            }
            #[cfg(feature = "expression")]
            Formula::Expression(law) => {
                let mut texts = law.texts().iter();
                texts.by_ref().for_each(|text| self.write(text.as_bytes()));
            }
            // Equal to itself only.
            Formula::Closure(law) => self.write_usize(std::ptr::from_ref(&**law).addr()),
            Formula::Contact(_) => {}
        }
        self.write(formula.kind().as_bytes());
    }

    fn region(&mut self, region: &Region) {
        for step in &region.steps {
            match step {
                Step::Solid(solid, pose) => {
                    self.solid(solid);
                    self.pose(pose);
                }
                Step::Interval(axis, min, max) => {
                    std::hash::Hash::hash(axis, self);
                    self.reals(&[*min, *max]);
                }
                Step::OverAxes(set) => {
                    self.pose(&set.pose);
                    match &set.shape {
                        Shape::HalfSpace {
                            coefficients,
                            offset,
                        } => {
                            self.reals(coefficients);
                            self.real(*offset);
                        }
                        Shape::Ball { centre, radii } => {
                            self.reals(centre);
                            self.reals(radii);
                        }
                    }
                }
                Step::Everywhere => self.write_u8(1),
                Step::Predicate(_) => self.write_u8(2),
                Step::Union => self.write_u8(3),
                Step::Intersection => self.write_u8(4),
                Step::Difference => self.write_u8(5),
                Step::Complement => self.write_u8(6),
            }
        }
    }

    fn solid(&mut self, solid: &Solid) {
        match solid {
            Solid::Ball { radius } => self.real(*radius),
            Solid::Cuboid { half_extents } => self.vector(*half_extents),
            Solid::Cylinder {
                half_height,
                radius,
            }
            | Solid::Cone {
                half_height,
                radius,
            }
            | Solid::Capsule {
                half_height,
                radius,
            } => self.reals(&[*half_height, *radius]),
            Solid::HalfSpace { outward } => self.vector(*outward),
            Solid::Slab { axis, min, max } => {
                self.write_usize(*axis);
                self.reals(&[*min, *max]);
            }
            Solid::Shape(_) => self.write_u8(7),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_have_one_number_and_others_another() {
        let zone = |x: Real| Field::uniform(Vector::X * x).within(Region::ball(2.0));
        let number = |field: &Field| field.likeness();
        let named = zone(1.0).named("a").at(Vector::Y).strength(3.0);
        assert!(zone(1.0).is_like(&named));
        assert_eq!(number(&zone(1.0)), number(&named));
        assert!(zone(0.0).is_like(&zone(-0.0)));
        assert_eq!(number(&zone(0.0)), number(&zone(-0.0)));
        let numbers: std::collections::HashSet<u64> =
            (0..10_000).map(|k| number(&zone(k as Real))).collect();
        assert_eq!(numbers.len(), 10_000);
    }
}
