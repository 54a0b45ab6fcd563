//! Plans of scalar fields. With [`Numbers::Integer`] they give integers at integers.

use proptest::prelude::*;
use rapier3d_fields::prelude::*;

use super::{AXES, Numbers, RegionPlan, region};

#[derive(Clone, Debug)]
pub enum ScalarPlan {
    Constant(i32),
    /// Number of the axis.
    Axis(usize),
    /// A ramp of the distance: where it starts, and how wide it is.
    Distance(i32, i32),
    /// A ramp of the depth in a region, which may be infinite: start and width.
    Depth(RegionPlan, Numbers, i32, i32),
    /// A ramp with or without corners.
    Ramp(Box<ScalarPlan>, i32, i32, bool),
    /// Values at −2, −1, 0, 1, 2.
    Table(Box<ScalarPlan>, [i32; 5]),
    Power(Box<ScalarPlan>, i32),
    Gaussian(Box<ScalarPlan>),
    Exponential(Box<ScalarPlan>),
    Closure,
    /// The sum, product, minimum or maximum, by number.
    Combined(u8, Box<ScalarPlan>, Box<ScalarPlan>),
}

pub fn height_and_mass(s: &Sample) -> Real {
    s.axes[0] + s.axes[1]
}

impl ScalarPlan {
    pub fn scalar(&self) -> Scalar {
        let real = |i: i32| i as Real;
        match self {
            ScalarPlan::Constant(value) => Scalar::constant(real(*value)),
            ScalarPlan::Axis(axis) => Scalar::axis(AXES[*axis]),
            ScalarPlan::Distance(from, width) => {
                Scalar::distance().ramp(real(*from) + 0.37, real(from + width) + 0.37)
            }
            ScalarPlan::Depth(region, numbers, from, width) => {
                let depth = Scalar::depth(region.region(*numbers));
                depth.ramp(real(*from), real(from + width))
            }
            ScalarPlan::Ramp(of, from, width, false) => {
                of.scalar().ramp(real(*from), real(from + width))
            }
            ScalarPlan::Ramp(of, from, width, true) => {
                of.scalar().smooth(real(*from), real(from + width))
            }
            ScalarPlan::Table(of, values) => {
                let points = values.iter().zip(-2..);
                of.scalar()
                    .table(points.map(|(value, at)| (real(at), real(*value))))
            }
            ScalarPlan::Power(of, n) => of.scalar().power(real(*n)),
            ScalarPlan::Gaussian(of) => of.scalar().gaussian(1.5),
            ScalarPlan::Exponential(of) => of.scalar().gaussian(4.0).exponential(-0.5),
            ScalarPlan::Closure => {
                Scalar::closure_named("height and mass", [Axis::Y, Axis::Mass], height_and_mass)
            }
            ScalarPlan::Combined(kind, a, b) => {
                let (a, b) = (a.scalar(), b.scalar());
                match kind {
                    0 => a.plus(b),
                    1 => a.times(b),
                    2 => a.min(b),
                    _ => a.max(b),
                }
            }
        }
    }

    /// Whether `is` holds for the scalar or any part of it.
    pub fn any(&self, is: &dyn Fn(&ScalarPlan) -> bool) -> bool {
        is(self)
            || match self {
                ScalarPlan::Ramp(of, ..)
                | ScalarPlan::Table(of, _)
                | ScalarPlan::Power(of, _)
                | ScalarPlan::Gaussian(of)
                | ScalarPlan::Exponential(of) => of.any(is),
                ScalarPlan::Combined(_, a, b) => a.any(is) || b.any(is),
                _ => false,
            }
    }

    /// Whether it is the same at all points of a body: made of constants and time only.
    pub fn is_uniform(&self) -> bool {
        match self {
            ScalarPlan::Constant(_) => true,
            ScalarPlan::Axis(axis) => AXES[*axis] == "time",
            ScalarPlan::Distance(..) | ScalarPlan::Depth(..) | ScalarPlan::Closure => false,
            ScalarPlan::Ramp(of, ..)
            | ScalarPlan::Table(of, _)
            | ScalarPlan::Power(of, _)
            | ScalarPlan::Gaussian(of)
            | ScalarPlan::Exponential(of) => of.is_uniform(),
            ScalarPlan::Combined(_, a, b) => a.is_uniform() && b.is_uniform(),
        }
    }
}

/// Regions whose depth at integers is an integer.
fn flat() -> impl Strategy<Value = RegionPlan> {
    prop_oneof![
        Just(RegionPlan::Everywhere),
        proptest::array::uniform3(1..=4).prop_map(RegionPlan::Cuboid),
        (0..3_usize, -2..=2).prop_map(|(axis, offset)| RegionPlan::HalfSpace(axis, offset)),
        (0..3_usize, -2..=2, 1..=4)
            .prop_map(|(axis, low, length)| RegionPlan::Interval(axis, low, length)),
    ]
}

fn source(numbers: Numbers) -> BoxedStrategy<ScalarPlan> {
    let (integer, fractional) = (Numbers::Integer, Numbers::Fractional);
    let axes = (0..AXES.len()).prop_filter("a fraction, or a root", move |axis| {
        numbers == fractional || !["speed", "radius"].contains(&AXES[*axis])
    });
    let common = prop_oneof![
        1 => (-3..=3).prop_map(ScalarPlan::Constant),
        2 => axes.prop_map(ScalarPlan::Axis),
        1 => Just(ScalarPlan::Closure),
    ];
    if numbers == integer {
        let depth = (flat(), -1..=2);
        let depth = depth.prop_map(move |(at, from)| ScalarPlan::Depth(at, integer, from, 1));
        return prop_oneof![3 => common, 1 => depth].boxed();
    }
    let depth = (region(), -1..=2, 1..=3);
    let depth =
        depth.prop_map(move |(at, from, width)| ScalarPlan::Depth(at, fractional, from, width));
    let distance = (0..=3, 1..=3).prop_map(|(from, width)| ScalarPlan::Distance(from, width));
    prop_oneof![3 => common, 2 => depth, 2 => distance].boxed()
}

pub fn scalar(numbers: Numbers) -> BoxedStrategy<ScalarPlan> {
    let widths = if numbers == Numbers::Integer {
        1..=1
    } else {
        1..=3
    };
    let boxed = |scalar: ScalarPlan| Box::new(scalar);
    let scalars = source(numbers).prop_recursive(2, 4, 2, move |of| {
        let ramp = (of.clone(), -2..=2, widths.clone(), any::<bool>());
        let values = proptest::array::uniform5(-2..=2);
        let exact = prop_oneof![
            2 => ramp.prop_map(move |(of, from, width, smooth)| {
                ScalarPlan::Ramp(boxed(of), from, width, smooth)
            }),
            1 => (of.clone(), values).prop_map(move |(of, v)| ScalarPlan::Table(boxed(of), v)),
            2 => (0..4_u8, of.clone(), of.clone())
                .prop_map(move |(kind, a, b)| ScalarPlan::Combined(kind, boxed(a), boxed(b))),
        ];
        if numbers == Numbers::Integer {
            return exact.boxed();
        }
        let rounded = prop_oneof![
            (of.clone(), 1..=2).prop_map(move |(of, n)| ScalarPlan::Power(boxed(of), n)),
            of.clone()
                .prop_map(move |of| ScalarPlan::Gaussian(boxed(of))),
            of.prop_map(move |of| ScalarPlan::Exponential(boxed(of))),
        ];
        prop_oneof![2 => exact, 1 => rounded].boxed()
    });
    scalars.boxed()
}
