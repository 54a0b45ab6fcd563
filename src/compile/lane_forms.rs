//! Which programs can be run on several samples at once.

use super::program::{Program, Step};
use crate::field::{
    Axis, Coupling, Field, Formula, Modifier, Region, RegionStep, Scalar, ScalarStep, Solid,
};

/// How many operands may wait for their operator there, in a program, a region or a scale.
pub(crate) const DEPTH: usize = 16;

impl Program {
    /// Whether it can.
    pub(super) fn may_run_in_lanes(&self) -> bool {
        let grows = self.steps.iter().map(|step| match step {
            Step::Nowhere | Step::Leaf(_) => 1,
            Step::Apply(_, count) | Step::Layers(count, _) => 1 - *count as isize,
            Step::Modify(_) => 0,
        });
        fits(grows)
            && self.leaves.iter().all(leaf)
            && self.modifiers.iter().all(|modifier| match modifier {
                Modifier::Scale { scale, .. } => scalar(scale),
                Modifier::Limit(_) => true,
            })
    }
}

/// Whether no more operands wait than there is place for.
fn fits(mut grows: impl Iterator<Item = isize>) -> bool {
    let mut waiting = 0_isize;
    grows.all(|grown| {
        waiting += grown;
        waiting <= DEPTH as isize
    })
}

fn leaf(field: &Field) -> bool {
    let coupled = match &field.coupling {
        Coupling::Share | Coupling::Each => true,
        Coupling::Axis(axis) => matches!(axis, Axis::Radius | Axis::Mass | Axis::Charge),
    };
    coupled
        && formula(&field.formula)
        && region(&field.region)
        && field.scale.as_ref().is_none_or(scalar)
}

fn formula(formula: &Formula) -> bool {
    match formula {
        Formula::Uniform(_)
        | Formula::Radial(_)
        | Formula::Spring(_)
        | Formula::Drag(_)
        | Formula::Magnetic(_)
        | Formula::Swirl(_)
        | Formula::Turbulence(_) => true,
        Formula::Wind(wind) => {
            use Formula::{Swirl, Turbulence, Uniform};
            matches!(*wind.flow, Uniform(_) | Swirl(_) | Turbulence(_))
        }
        _ => false,
    }
}

fn region(region: &Region) -> bool {
    fits(region.steps.iter().map(|step| match step {
        RegionStep::Union | RegionStep::Intersection | RegionStep::Difference => -1,
        RegionStep::Complement => 0,
        _ => 1,
    })) && region.steps.iter().all(|step| match step {
        RegionStep::Solid(solid, _) => !matches!(solid, Solid::Shape(_)),
        RegionStep::Interval(axis, ..) => self::axis(axis),
        RegionStep::OverAxes(_) | RegionStep::Predicate(_) => false,
        _ => true,
    })
}

fn scalar(scalar: &Scalar) -> bool {
    fits(scalar.steps.iter().map(|step| match step {
        ScalarStep::Plus | ScalarStep::Times | ScalarStep::Lesser | ScalarStep::Greater => -1,
        ScalarStep::Curve(_) => 0,
        _ => 1,
    })) && scalar.steps.iter().all(|step| match step {
        ScalarStep::Axis(axis) => self::axis(axis),
        ScalarStep::Depth(depth) => region(depth),
        ScalarStep::Function(_) => false,
        _ => true,
    })
}

fn axis(axis: &Axis) -> bool {
    !axis.is_steep() && !matches!(axis, Axis::User(_))
}
