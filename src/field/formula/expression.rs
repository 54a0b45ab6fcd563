//! A formula whose three components are expressions, given as text.

mod exact;
mod function;
mod names;
mod parse;
mod program;
mod token;

use names::Axes;
use program::StackCode;

use super::{Law, alone};
use crate::field::axis::Axis;
use crate::field::error::BuildError;
use crate::field::expression_error::ExpressionError;
use crate::field::query::{Alone, LocalQuery, Single};
use crate::math::DVec3;
use crate::number::{Vec3, constant};

/// The components of a vector, written as text: `"-x / (x^2 + y^2)"`.
///
/// Names are axes: the coordinates `x`, `y`, `z` and the velocity `vx`, `vy`, `vz` of the sample in
/// the field's frame, `time`, `speed`, `radius`, `mass`, `charge` and so on, and the axes of the
/// user. An axis whose name is not a word, or has another meaning, stands in braces: `{heat flux}`.
/// Constants are `PI`, `E`, `TAU` and `π`, `e`, `τ`. Numbers may have exponents: `1e-3`.
///
/// Operators, those that bind most tightly first:
///
/// | operator | |
/// |---|---|
/// | `a^b` | power, from right to left: `2^3^2` is 2⁹, `-x^2` is −(x²); `2^-x` may be written |
/// | `-a`, `+a` | sign |
/// | `a*b`, `a/b` | |
/// | `a+b`, `a-b` | |
/// | `<`, `<=`, `>`, `>=`, `==`, `!=` | 1 if so, 0 if not; `a < b < c` is an error |
/// | `not a`, `!a` | 1 if a is 0, else 0; a ends before the next `and` or `or` |
/// | `a and b`, `a && b` | 1 if neither is 0, else 0 |
/// | `a or b`, `a \|\| b` | 0 if both are 0, else 1 |
///
/// Functions:
///
/// | function | |
/// |---|---|
/// | `if(condition, a, b)` | a unless the condition is 0, else b; the other is not evaluated |
/// | `abs`, `sign`, `signum` | `sign(0)` is 0, `signum(0)` is 1 |
/// | `min`, `max` | of any number of arguments; NaN is skipped |
/// | `clamp(x, low, high)` | |
/// | `floor`, `ceil`, `round`, `trunc`, `fract` | halves are rounded away from zero; `fract(x)` is `x - trunc(x)` |
/// | `sqrt`, `cbrt`, `pow(a, b)`, `hypot` | `hypot` is the length of a vector of any dimension; `0^0` is 1 |
/// | `exp`, `ln`, `log`, `log2`, `log10` | `log` is `ln`, the natural logarithm |
/// | `sin`, `cos`, `tan`, `asin`, `acos`, `atan`, `atan2(y, x)` | in radians |
/// | `sinh`, `cosh`, `tanh`, `asinh`, `acosh`, `atanh` | |
///
/// Derivatives are exact. At corners they are those of one side: of `abs` on the right, of `min`
/// and `max` those of the first of equal arguments, of `if` those of the chosen argument. Step
/// functions (comparisons, `sign`, `floor`, …) have a derivative of zero, at their steps too. It is
/// also zero where a value has no finite derivative (`sqrt(0)`, `asin(1)`, `hypot(0, 0)`), and for
/// `a^b` along b where a is not positive.
///
/// A text has at most 65536 characters; brackets may be nested to any depth.
#[derive(Clone, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(from = "[String; 3]", into = "[String; 3]")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Expression {
    texts: [String; 3],
    programs: Result<[StackCode; 3], Box<ExpressionError>>,
    axes: Vec<Axis>,
}

impl Expression {
    /// Expressions for x, y and z. Faults in their texts are reported when the tree is validated.
    pub fn new(components: [&str; 3]) -> Self {
        let mut names = Axes::default();
        Expression {
            texts: components.map(str::to_owned),
            programs: programs(components, &mut names),
            axes: names.into_axes(),
        }
    }

    /// The three texts.
    pub fn texts(&self) -> &[String; 3] {
        &self.texts
    }
}

fn programs(texts: [&str; 3], names: &mut Axes) -> Result<[StackCode; 3], Box<ExpressionError>> {
    let mut programs: [StackCode; 3] = Default::default();
    for (component, text) in texts.into_iter().enumerate() {
        programs[component] = parse::parse(text, names).map_err(|fault| ExpressionError {
            component,
            text: text.to_owned(),
            position: text[..fault.at].chars().count() + 1,
            kind: fault.kind,
        })?;
    }
    Ok(programs)
}

#[cfg(feature = "serde-serialize")]
impl From<[String; 3]> for Expression {
    fn from([x, y, z]: [String; 3]) -> Self {
        Expression::new([&x, &y, &z])
    }
}

#[cfg(feature = "serde-serialize")]
impl From<Expression> for [String; 3] {
    fn from(expression: Expression) -> Self {
        expression.texts
    }
}

impl Alone for Expression {
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        let Ok([x, y, z]) = &self.programs else {
            return constant(DVec3::NAN);
        };
        let missing = || T::from(f64::NAN);
        let axis = |number: usize| {
            let value = local.coordinate(&self.axes[number]);
            value.unwrap_or_else(missing)
        };
        Vec3::new(x.value(axis), y.value(axis), z.value(axis))
    }
}

impl Law for Expression {
    fn kind(&self) -> &'static str {
        "expression"
    }

    alone!();

    fn reads_velocity(&self) -> bool {
        self.axes.iter().any(Axis::reads_velocity)
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        match &self.programs {
            Ok(_) => Ok(()),
            Err(error) => Err(BuildError::Expression {
                field: field.into(),
                error: error.clone(),
            }),
        }
    }
}

/// Equal if the texts are equal.
impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.texts == other.texts
    }
}

#[cfg(test)]
mod tests;
