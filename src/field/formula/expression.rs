//! Three expressions, given as text.

use exmex::{Differentiate, Express, FlatEx};

use super::Law;
use crate::field::axis::Axis;
use crate::field::error::BuildError;
use crate::field::number::{Number, Vec3, constant};
use crate::field::query::LocalQuery;
use crate::math::DVec3;

/// The components of a vector, written as text: `"-x / (x^2 + y^2)"`.
///
/// Variables are the coordinates `x`, `y`, `z` and the velocity `vx`, `vy`, `vz` of the sample in
/// the field's frame, the axes `time`, `speed`, `radius`, `mass`, `charge`, and the axes of the
/// user. Operators and functions are those of the crate `exmex`: `+ - * / ^`, `sin`, `exp`,
/// `sqrt`, `abs`, `atan2`, …, `PI`, `E`. A sign binds more tightly than `^`: `-x^2` is x², and
/// what most people mean is `-(x^2)`. Derivatives are exact: the text is differentiated.
#[derive(Clone, Debug)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "[String; 3]", into = "[String; 3]")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Expression {
    texts: [String; 3],
    parsed: Result<Vec<Component>, String>,
    axes: Vec<Axis>,
}

#[derive(Clone, Debug)]
struct Component {
    value: FlatEx<f64>,
    inputs: Vec<Axis>,
    /// The derivative by each input.
    slopes: Vec<FlatEx<f64>>,
}

impl Component {
    fn parse(text: &str) -> Result<Self, String> {
        check_size(text)?;
        let readable = |error: exmex::ExError| format!("`{text}`: {error}");
        let value = FlatEx::<f64>::parse(text).map_err(readable)?;
        let inputs = value.var_names().iter().map(|name| Axis::named(name));
        let inputs: Vec<Axis> = inputs.collect();
        let mut slopes = Vec::new();
        for k in 0..inputs.len() {
            let slope = value.clone().partial(k).map_err(readable)?;
            slopes.push(slope);
        }
        Ok(Component {
            value,
            inputs,
            slopes,
        })
    }

    fn at<T: Number>(&self, local: &LocalQuery<'_, T>) -> T {
        let value = |axis: &Axis| local.coordinate(axis).unwrap_or(f64::NAN.into());
        let inputs: Vec<T> = self.inputs.iter().map(value).collect();
        let values: Vec<f64> = inputs.iter().map(|input| input.re()).collect();
        let mut result = T::from(self.value.eval(&values).unwrap_or(f64::NAN));
        if T::NDERIV > 0 {
            for (slope, input) in self.slopes.iter().zip(inputs) {
                let slope = slope.eval(&values).unwrap_or(f64::NAN);
                result += (input - input.re()) * slope;
            }
        }
        result
    }
}

impl Expression {
    /// Expressions for x, y and z. What is wrong with them is told when the tree is compiled.
    pub fn new(components: [&str; 3]) -> Self {
        let parsed: Result<Vec<_>, _> = components.into_iter().map(Component::parse).collect();
        let mut axes: Vec<Axis> = Vec::new();
        for input in parsed.iter().flatten().flat_map(|c| &c.inputs) {
            if !axes.contains(input) {
                axes.push(input.clone());
            }
        }
        Expression {
            texts: components.map(str::to_owned),
            parsed,
            axes,
        }
    }

    /// The three texts.
    pub fn texts(&self) -> &[String; 3] {
        &self.texts
    }
}

/// The parser calls itself for each bracket, and derivatives grow with the text.
fn check_size(text: &str) -> Result<(), String> {
    const LONGEST: usize = 4096;
    const DEEPEST: usize = 64;
    let (mut depth, mut deepest) = (0_usize, 0);
    for c in text.chars() {
        match c {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    if text.len() <= LONGEST && deepest <= DEEPEST {
        return Ok(());
    }
    Err(format!(
        "expected at most {LONGEST} characters and {DEEPEST} levels of brackets, found {} and \
         {deepest}",
        text.len()
    ))
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

impl Law for Expression {
    fn kind(&self) -> &'static str {
        "expression"
    }

    fn vector<T: Number>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        match self.parsed.as_deref() {
            Ok([x, y, z]) => Vec3::new(x.at(local), y.at(local), z.at(local)),
            _ => constant(DVec3::NAN),
        }
    }

    fn reads_velocity(&self) -> bool {
        self.axes.iter().any(Axis::reads_velocity)
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn validate(&self, field: &str) -> Result<(), BuildError> {
        match &self.parsed {
            Ok(_) => Ok(()),
            Err(message) => Err(BuildError::Expression {
                field: field.into(),
                message: message.clone(),
            }),
        }
    }
}

/// Equal if the texts are.
impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.texts == other.texts
    }
}
