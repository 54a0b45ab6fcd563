//! Names in expressions: constants, and axes with their numbers.

use std::collections::HashMap;
use std::f64::consts::{E, PI, TAU};

use crate::field::axis::Axis;

/// The value of a constant with this name.
pub(super) fn constant(name: &str) -> Option<f64> {
    match name {
        "PI" | "π" => Some(PI),
        "E" | "e" => Some(E),
        "TAU" | "τ" => Some(TAU),
        _ => None,
    }
}

/// The axes that texts name, each once.
#[derive(Debug, Default)]
pub(super) struct Axes {
    axes: Vec<Axis>,
    numbers: HashMap<String, usize>,
}

impl Axes {
    /// The number of the axis with this name.
    pub(super) fn axis(&mut self, name: &str) -> usize {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.axes.len();
        self.axes.push(Axis::named(name));
        self.numbers.insert(name.to_owned(), number);
        number
    }

    /// All axes, in the order of their numbers.
    pub(super) fn into_axes(self) -> Vec<Axis> {
        self.axes
    }
}
