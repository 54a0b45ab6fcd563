//! The functions and operators of expressions.

use std::f64::consts::{LOG2_E, LOG10_E};

use super::exact::{self, by};
use crate::number::Number;

/// A function, or an operator that is evaluated like one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Function {
    Abs,
    Sign,
    Signum,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Sinh,
    Cosh,
    Tanh,
    Asinh,
    Acosh,
    Atanh,
    Floor,
    Ceil,
    Round,
    Trunc,
    Fract,
    Exp,
    Ln,
    Log2,
    Log10,
    Sqrt,
    Cbrt,
    Power,
    Hypot,
    Min,
    Max,
    Clamp,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    Unequal,
    And,
    Or,
    Not,
    /// Evaluates only one of two arguments, so the parser compiles it into jumps.
    If,
}

/// A function with its name and numbers of arguments.
pub(super) struct Named {
    pub name: &'static str,
    pub function: Function,
    pub fewest: usize,
    /// `None` without a limit.
    pub most: Option<usize>,
}

impl Named {
    pub(super) fn takes(&self, arguments: usize) -> bool {
        arguments >= self.fewest && self.most.is_none_or(|most| arguments <= most)
    }
}

const fn fixed(name: &'static str, function: Function, arguments: usize) -> Named {
    Named {
        name,
        function,
        fewest: arguments,
        most: Some(arguments),
    }
}

const fn any(name: &'static str, function: Function, fewest: usize) -> Named {
    Named {
        name,
        function,
        fewest,
        most: None,
    }
}

/// All functions with names.
static NAMED: [Named; 34] = [
    fixed("abs", Function::Abs, 1),
    fixed("sign", Function::Sign, 1),
    fixed("signum", Function::Signum, 1),
    any("min", Function::Min, 1),
    any("max", Function::Max, 1),
    fixed("clamp", Function::Clamp, 3),
    fixed("sqrt", Function::Sqrt, 1),
    fixed("cbrt", Function::Cbrt, 1),
    any("hypot", Function::Hypot, 1),
    fixed("pow", Function::Power, 2),
    fixed("exp", Function::Exp, 1),
    fixed("ln", Function::Ln, 1),
    fixed("log", Function::Ln, 1),
    fixed("log2", Function::Log2, 1),
    fixed("log10", Function::Log10, 1),
    fixed("sin", Function::Sin, 1),
    fixed("cos", Function::Cos, 1),
    fixed("tan", Function::Tan, 1),
    fixed("asin", Function::Asin, 1),
    fixed("acos", Function::Acos, 1),
    fixed("atan", Function::Atan, 1),
    fixed("atan2", Function::Atan2, 2),
    fixed("sinh", Function::Sinh, 1),
    fixed("cosh", Function::Cosh, 1),
    fixed("tanh", Function::Tanh, 1),
    fixed("asinh", Function::Asinh, 1),
    fixed("acosh", Function::Acosh, 1),
    fixed("atanh", Function::Atanh, 1),
    fixed("floor", Function::Floor, 1),
    fixed("ceil", Function::Ceil, 1),
    fixed("round", Function::Round, 1),
    fixed("trunc", Function::Trunc, 1),
    fixed("fract", Function::Fract, 1),
    fixed("if", Function::If, 3),
];

/// The function of that name.
pub(super) fn named(name: &str) -> Option<&'static Named> {
    NAMED.iter().find(|each| each.name == name)
}

/// The names of all functions.
pub(super) fn known() -> String {
    let names: Vec<&str> = NAMED.iter().map(|each| each.name).collect();
    names.join(", ")
}

/// Returns true if a number stands for true.
pub(super) fn holds<T: Number<Plain = f64>>(x: &T) -> bool {
    x.re() != 0.0
}

impl Function {
    /// The value of the function; NaN for a number of arguments that it does not take.
    pub(super) fn of<T: Number<Plain = f64>>(self, arguments: &[T]) -> T {
        let truth = |yes: bool| T::from(f64::from(yes));
        match (self, arguments) {
            (Function::Abs, &[x]) => exact::abs(x),
            (Function::Sign, [x]) => sign(x.re()).into(),
            (Function::Signum, [x]) => x.re().signum().into(),
            (Function::Sin, &[x]) => by(x, f64::sin, f64::cos),
            (Function::Cos, &[x]) => by(x, f64::cos, |x| -x.sin()),
            (Function::Tan, &[x]) => by(x, f64::tan, |x| 1.0 + x.tan() * x.tan()),
            (Function::Asin, &[x]) => by(x, f64::asin, |x| 1.0 / (1.0 - x * x).sqrt()),
            (Function::Acos, &[x]) => by(x, f64::acos, |x| -1.0 / (1.0 - x * x).sqrt()),
            (Function::Atan, &[x]) => exact::atan(x),
            (Function::Atan2, &[y, x]) => exact::atan2(y, x),
            (Function::Sinh, &[x]) => by(x, f64::sinh, f64::cosh),
            (Function::Cosh, &[x]) => by(x, f64::cosh, f64::sinh),
            (Function::Tanh, &[x]) => by(x, f64::tanh, |x| (1.0 / x.cosh()).powi(2)),
            (Function::Asinh, &[x]) => by(x, f64::asinh, |x| 1.0 / x.hypot(1.0)),
            (Function::Acosh, &[x]) => by(x, f64::acosh, |x| {
                1.0 / ((x - 1.0).sqrt() * (x + 1.0).sqrt())
            }),
            (Function::Atanh, &[x]) => by(x, f64::atanh, |x| 1.0 / (1.0 - x * x)),
            (Function::Floor, [x]) => x.re().floor().into(),
            (Function::Ceil, [x]) => x.re().ceil().into(),
            (Function::Round, [x]) => x.re().round().into(),
            (Function::Trunc, [x]) => x.re().trunc().into(),
            (Function::Fract, &[x]) => x - x.re().trunc(),
            (Function::Exp, [x]) => x.exp(),
            (Function::Ln, [x]) => x.ln(),
            (Function::Log2, &[x]) => by(x, f64::log2, |x| LOG2_E / x),
            (Function::Log10, &[x]) => by(x, f64::log10, |x| LOG10_E / x),
            (Function::Sqrt, &[x]) => exact::sqrt(x),
            (Function::Cbrt, &[x]) => exact::cbrt(x),
            (Function::Power, &[x, y]) => exact::power(x, y),
            (Function::Hypot, all) => exact::hypot(all),
            (Function::Min, all) => chosen(all, |a, b| a < b),
            (Function::Max, all) => chosen(all, |a, b| a > b),
            (Function::Clamp, &[x, low, high]) => clamp(x, low, high),
            (Function::Less, [a, b]) => truth(a.re() < b.re()),
            (Function::LessOrEqual, [a, b]) => truth(a.re() <= b.re()),
            (Function::Greater, [a, b]) => truth(a.re() > b.re()),
            (Function::GreaterOrEqual, [a, b]) => truth(a.re() >= b.re()),
            (Function::Equal, [a, b]) => truth(a.re() == b.re()),
            (Function::Unequal, [a, b]) => truth(a.re() != b.re()),
            (Function::And, [a, b]) => truth(holds(a) && holds(b)),
            (Function::Or, [a, b]) => truth(holds(a) || holds(b)),
            (Function::Not, [x]) => truth(!holds(x)),
            _ => f64::NAN.into(),
        }
    }
}

/// The sign of x, zero at zero.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// The first argument that is better than all others; NaN is skipped.
fn chosen<T: Number<Plain = f64>>(all: &[T], better: fn(f64, f64) -> bool) -> T {
    let nan = T::from(f64::NAN);
    all.iter().fold(nan, |best, x| {
        let wins = best.re().is_nan() || better(x.re(), best.re());
        if wins { *x } else { best }
    })
}

/// x within its bounds. If the bounds are in the wrong order, the upper one is the result.
fn clamp<T: Number<Plain = f64>>(x: T, low: T, high: T) -> T {
    let raised = if x.re() < low.re() { low } else { x };
    if raised.re() > high.re() {
        high
    } else {
        raised
    }
}
