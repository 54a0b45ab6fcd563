//! Scalars as pipelines: a source, then operations on its value, step by step.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::{FileError, content};
use super::fields::field::visit::{Curve, ScalarStep};
use super::fields::{Axis, Scalar};
use super::number::{Num, num};
use super::region::RegionDoc;

/// `[{"axis": "time"}, {"ramp": [0, 1]}]`.
pub(super) type ScalarDoc = Vec<StepDoc>;

#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(remote = "Self", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum StepDoc {
    // Sources.
    Constant(Num),
    Axis(Axis),
    Distance,
    Depth(Box<RegionDoc>),
    #[cfg_attr(feature = "schema", schemars(skip))]
    Closure(Value),
    // Curves.
    Ramp([Num; 2]),
    Smooth([Num; 2]),
    Power(Num),
    Exponential(Num),
    Gaussian(Num),
    Table(Vec<[Num; 2]>),
    // With another scalar.
    Plus(ScalarDoc),
    Times(ScalarDoc),
    Min(ScalarDoc),
    Max(ScalarDoc),
}

crate::choice::one_of!(StepDoc, "step of a scalar");

pub(super) fn read(steps: &ScalarDoc) -> Result<Scalar, FileError> {
    let mut scalar: Option<Scalar> = None;
    for (place, step) in steps.iter().enumerate() {
        let next = read_step(scalar.take(), step);
        scalar = Some(next.map_err(|error| error.within(&format!("[{place}]")))?);
    }
    scalar.ok_or_else(|| content("expected at least one step, such as {\"axis\": \"time\"}"))
}

fn read_step(before: Option<Scalar>, step: &StepDoc) -> Result<Scalar, FileError> {
    let source = match step {
        StepDoc::Constant(value) => Some(Scalar::constant(value.0)),
        StepDoc::Axis(axis) => Some(Scalar::axis(axis.clone())),
        StepDoc::Distance => Some(Scalar::distance()),
        StepDoc::Depth(region) => {
            let region = region.read().map_err(|error| error.within("depth"))?;
            Some(Scalar::depth(region))
        }
        StepDoc::Closure(_) => {
            return Err(content("a closure is code and cannot be written to a file"));
        }
        _ => None,
    };
    match (before, source) {
        (None, Some(source)) => Ok(source),
        (Some(before), None) => then(before, step),
        (None, None) => Err(content(
            "the first step must be a source: constant, axis, distance or depth",
        )),
        (Some(_), Some(_)) => Err(content(
            "only the first step can be a source; expected a curve, or plus, times, min or max",
        )),
    }
}

fn then(before: Scalar, step: &StepDoc) -> Result<Scalar, FileError> {
    let other = |steps, name| read(steps).map_err(|error: FileError| error.within(name));
    Ok(match step {
        StepDoc::Ramp([from, to]) => before.ramp(from.0, to.0),
        StepDoc::Smooth([from, to]) => before.smooth(from.0, to.0),
        StepDoc::Power(n) => before.power(n.0),
        StepDoc::Exponential(rate) => before.exponential(rate.0),
        StepDoc::Gaussian(width) => before.gaussian(width.0),
        StepDoc::Table(points) => before.table(points.iter().map(|[x, y]| (x.0, y.0))),
        StepDoc::Plus(steps) => before.plus(other(steps, "plus")?),
        StepDoc::Times(steps) => before.times(other(steps, "times")?),
        StepDoc::Min(steps) => before.min(other(steps, "min")?),
        StepDoc::Max(steps) => before.max(other(steps, "max")?),
        _ => before,
    })
}

pub(super) fn write(scalar: &Scalar) -> Result<ScalarDoc, FileError> {
    let mut stack: Vec<ScalarDoc> = Vec::new();
    for step in scalar.steps() {
        let source = match step {
            ScalarStep::Constant(value) => StepDoc::Constant(num(value)),
            ScalarStep::Axis(axis) => StepDoc::Axis(axis.clone()),
            ScalarStep::Distance => StepDoc::Distance,
            ScalarStep::Depth(region) => StepDoc::Depth(Box::new(RegionDoc::write(region)?)),
            ScalarStep::Function(_) => {
                return Err(FileError::Code {
                    what: "scale".to_owned(),
                    kind: "closure",
                });
            }
            ScalarStep::Curve(curve) => {
                let mut steps = stack.pop().unwrap_or_default();
                steps.push(write_curve(curve)?);
                stack.push(steps);
                continue;
            }
            combination => {
                let other = stack.pop().unwrap_or_default();
                let mut steps = stack.pop().unwrap_or_default();
                steps.push(match combination {
                    ScalarStep::Plus => StepDoc::Plus(other),
                    ScalarStep::Times => StepDoc::Times(other),
                    ScalarStep::Lesser => StepDoc::Min(other),
                    _ => StepDoc::Max(other),
                });
                super::check_depth(nesting(&steps))?;
                stack.push(steps);
                continue;
            }
        };
        stack.push(vec![source]);
    }
    Ok(stack.pop().unwrap_or_default())
}

fn write_curve(curve: &Curve) -> Result<StepDoc, FileError> {
    Ok(match curve {
        Curve::Ramp { from, to, smooth } => {
            let ends = [num(from), num(to)];
            if *smooth {
                StepDoc::Smooth(ends)
            } else {
                StepDoc::Ramp(ends)
            }
        }
        Curve::Power(n) => StepDoc::Power(num(n)),
        Curve::Exponential(rate) => StepDoc::Exponential(num(rate)),
        Curve::Gaussian(width) => StepDoc::Gaussian(num(width)),
        Curve::Table(points) => {
            StepDoc::Table(points.iter().map(|(x, y)| [num(x), num(y)]).collect())
        }
        _ => return Err(content("this curve cannot stand in a file")),
    })
}

/// How deeply scalars are nested in the last step, the only one that was not checked before.
fn nesting(steps: &ScalarDoc) -> usize {
    let (mut depth, mut next) = (1, steps.last());
    while let Some(StepDoc::Plus(s) | StepDoc::Times(s) | StepDoc::Min(s) | StepDoc::Max(s)) = next
    {
        depth += 1;
        next = s.last();
    }
    depth
}
