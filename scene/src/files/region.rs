//! Regions as nested documents; in memory, they are flat lists of steps.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::{FileError, content};
use super::fields::field::visit::{RegionStep, ShapeOverAxes, Solid};
use super::fields::math::{Pose, Real};
use super::fields::{Axis, Region};
use super::number::{Num, Quad, Triple, num, pose, quad, triple, unless_zero, vector};
use super::shape::ShapeDoc;

/// A region, by the names of the constructors of [`Region`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    remote = "Self",
    rename_all = "kebab-case",
    rename_all_fields = "kebab-case",
    deny_unknown_fields
)]
pub(super) enum RegionDoc {
    Everywhere,
    Ball {
        radius: Num,
    },
    Cuboid {
        half_extents: Triple,
    },
    Cylinder {
        half_height: Num,
        radius: Num,
    },
    Cone {
        half_height: Num,
        radius: Num,
    },
    Capsule {
        half_height: Num,
        radius: Num,
    },
    HalfSpace {
        outward: Triple,
        #[serde(default, skip_serializing_if = "is_zero")]
        offset: Num,
    },
    /// An end that is left out is infinite.
    Interval {
        axis: Axis,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        min: Option<Num>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        max: Option<Num>,
    },
    HalfSpaceOver {
        coefficients: Vec<(Axis, Num)>,
        offset: Num,
    },
    BallOver(Vec<RadiusDoc>),
    Shape(ShapeDoc),
    #[cfg_attr(feature = "schema", schemars(skip))]
    Predicate(Value),
    Moved {
        region: Box<RegionDoc>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        at: Option<Triple>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rotation: Option<Quad>,
    },
    Union(Vec<RegionDoc>),
    Intersection(Vec<RegionDoc>),
    Difference(Vec<RegionDoc>),
    Complement(Box<RegionDoc>),
}

crate::choice::one_of!(RegionDoc, "region");

#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct RadiusDoc {
    axis: Axis,
    centre: Num,
    radius: Num,
}

fn is_zero(number: &Num) -> bool {
    *number == Num(0.0)
}

impl RegionDoc {
    pub(super) fn read(&self) -> Result<Region, FileError> {
        Ok(match self {
            RegionDoc::Everywhere => Region::everywhere(),
            RegionDoc::Ball { radius } => Region::ball(radius.0),
            RegionDoc::Cuboid { half_extents } => Region::cuboid(vector(*half_extents)),
            RegionDoc::Cylinder {
                half_height,
                radius,
            } => Region::cylinder(half_height.0, radius.0),
            RegionDoc::Cone {
                half_height,
                radius,
            } => Region::cone(half_height.0, radius.0),
            RegionDoc::Capsule {
                half_height,
                radius,
            } => Region::capsule(half_height.0, radius.0),
            RegionDoc::HalfSpace { outward, offset } => {
                Region::half_space(vector(*outward), offset.0)
            }
            RegionDoc::Interval { axis, min, max } => Region::interval(
                axis.clone(),
                min.map_or(-Real::INFINITY, |min| min.0),
                max.map_or(Real::INFINITY, |max| max.0),
            ),
            RegionDoc::HalfSpaceOver {
                coefficients,
                offset,
            } => {
                let coefficients = coefficients.iter();
                let coefficients = coefficients.map(|(axis, c)| (axis.clone(), c.0));
                Region::half_space_over(coefficients, offset.0)
            }
            RegionDoc::BallOver(axes) => {
                let axes = axes.iter();
                Region::ball_over(axes.map(|a| (a.axis.clone(), a.centre.0, a.radius.0)))
            }
            RegionDoc::Shape(shape) => {
                Region::shape(shape.read().map_err(|error| error.within("shape"))?)
            }
            RegionDoc::Predicate(_) => {
                return Err(content(
                    "a predicate is code and cannot be written to a file",
                ));
            }
            RegionDoc::Moved {
                region,
                at,
                rotation,
            } => {
                let moved = region
                    .read()
                    .map_err(|error| error.within("moved.region"))?;
                moved.at(pose(*at, *rotation).map_err(|error| error.within("moved"))?)
            }
            RegionDoc::Union(regions) => fold("union", regions, Region::union)?,
            RegionDoc::Intersection(regions) => {
                fold("intersection", regions, Region::intersection)?
            }
            RegionDoc::Difference(regions) => fold("difference", regions, Region::difference)?,
            RegionDoc::Complement(region) => {
                let region = region.read().map_err(|error| error.within("complement"))?;
                region.complement()
            }
        })
    }

    pub(super) fn write(region: &Region) -> Result<Self, FileError> {
        // Each with its depth of nesting.
        let mut stack: Vec<(RegionDoc, usize)> = Vec::new();
        let empty = (RegionDoc::Union(Vec::new()), 0);
        for step in region.steps() {
            let next = match step {
                RegionStep::Complement => {
                    let (region, depth) = stack.pop().unwrap_or_else(|| empty.clone());
                    (RegionDoc::Complement(Box::new(region)), depth + 1)
                }
                RegionStep::Union | RegionStep::Intersection | RegionStep::Difference => {
                    let right = stack.pop().unwrap_or_else(|| empty.clone());
                    let left = stack.pop().unwrap_or_else(|| empty.clone());
                    combine(step, left, right)
                }
                simple => (write_simple(simple)?, 1),
            };
            super::check_depth(next.1)?;
            stack.push(next);
        }
        Ok(stack.pop().map_or(RegionDoc::Everywhere, |(doc, _)| doc))
    }
}

fn fold(
    name: &str,
    regions: &[RegionDoc],
    combine: fn(Region, Region) -> Region,
) -> Result<Region, FileError> {
    let mut all: Option<Region> = None;
    for (number, region) in regions.iter().enumerate() {
        let here = |error: FileError| error.within(&format!("{name}[{number}]"));
        let next = region.read().map_err(here)?;
        all = Some(match all {
            Some(before) => combine(before, next),
            None => next,
        });
    }
    all.ok_or_else(|| content("expected at least one region").within(name))
}

/// A chain of one operation is one list, from left to right.
fn combine(
    step: &RegionStep,
    (left, left_depth): (RegionDoc, usize),
    (right, right_depth): (RegionDoc, usize),
) -> (RegionDoc, usize) {
    let (mut list, depth) = match (step, left) {
        (RegionStep::Union, RegionDoc::Union(list))
        | (RegionStep::Intersection, RegionDoc::Intersection(list))
        | (RegionStep::Difference, RegionDoc::Difference(list)) => (list, left_depth),
        (_, left) => (vec![left], left_depth + 1),
    };
    list.push(right);
    let doc = match step {
        RegionStep::Union => RegionDoc::Union(list),
        RegionStep::Intersection => RegionDoc::Intersection(list),
        _ => RegionDoc::Difference(list),
    };
    (doc, depth.max(right_depth + 1))
}

fn write_simple(step: &RegionStep) -> Result<RegionDoc, FileError> {
    Ok(match step {
        RegionStep::Solid(solid, pose) => moved(write_solid(solid)?, pose),
        RegionStep::Interval(axis, min, max) => RegionDoc::Interval {
            axis: axis.clone(),
            min: end(min, -Real::INFINITY),
            max: end(max, Real::INFINITY),
        },
        RegionStep::OverAxes(set) => {
            let axes = set.axes.iter().cloned();
            let doc = match &set.shape {
                ShapeOverAxes::HalfSpace {
                    coefficients,
                    offset,
                } => RegionDoc::HalfSpaceOver {
                    coefficients: axes.zip(coefficients.iter().map(num)).collect(),
                    offset: num(offset),
                },
                ShapeOverAxes::Ball { centre, radii } => {
                    let numbers = centre.iter().zip(radii);
                    let radius = |(axis, (centre, radius)): (Axis, (&Real, &Real))| RadiusDoc {
                        axis,
                        centre: num(centre),
                        radius: num(radius),
                    };
                    RegionDoc::BallOver(axes.zip(numbers).map(radius).collect())
                }
                _ => return Err(content("this region cannot stand in a file")),
            };
            moved(doc, &set.pose)
        }
        RegionStep::Predicate(_) => {
            return Err(FileError::Code {
                what: "region".to_owned(),
                kind: "predicate",
            });
        }
        _ => RegionDoc::Everywhere,
    })
}

/// An end of an interval; `None` if it is infinite.
fn end(value: &Real, none: Real) -> Option<Num> {
    (*value != none).then_some(Num(*value))
}

fn moved(region: RegionDoc, pose: &Pose) -> RegionDoc {
    let (at, rotation) = (unless_zero(pose.translation), quad(pose.rotation));
    if at.is_none() && rotation.is_none() {
        return region;
    }
    RegionDoc::Moved {
        region: Box::new(region),
        at,
        rotation,
    }
}

fn write_solid(solid: &Solid) -> Result<RegionDoc, FileError> {
    Ok(match solid {
        Solid::Ball { radius } => RegionDoc::Ball {
            radius: num(radius),
        },
        Solid::Cuboid { half_extents } => RegionDoc::Cuboid {
            half_extents: triple(*half_extents),
        },
        Solid::Cylinder {
            half_height,
            radius,
        } => RegionDoc::Cylinder {
            half_height: num(half_height),
            radius: num(radius),
        },
        Solid::Cone {
            half_height,
            radius,
        } => RegionDoc::Cone {
            half_height: num(half_height),
            radius: num(radius),
        },
        Solid::Capsule {
            half_height,
            radius,
        } => RegionDoc::Capsule {
            half_height: num(half_height),
            radius: num(radius),
        },
        Solid::HalfSpace { outward } => RegionDoc::HalfSpace {
            outward: triple(*outward),
            offset: Num(0.0),
        },
        Solid::Slab { axis, min, max } => RegionDoc::Interval {
            axis: [Axis::X, Axis::Y, Axis::Z][*axis].clone(),
            min: end(min, -Real::INFINITY),
            max: end(max, Real::INFINITY),
        },
        Solid::Shape(shape) => RegionDoc::Shape(ShapeDoc::write(shape.shape())?),
        _ => return Err(content("this region cannot stand in a file")),
    })
}
