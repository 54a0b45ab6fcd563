//! What the names in expressions stand for.

use std::collections::HashMap;
use std::f64::consts::{E, PI, TAU};

use crate::field::axis::Axis;

/// The number of that name, if it is a constant.
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
pub(super) struct Names {
    axes: Vec<Axis>,
    numbers: HashMap<String, usize>,
}

impl Names {
    /// The number of the axis of that name.
    pub(super) fn axis(&mut self, name: &str) -> usize {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.axes.len();
        self.axes.push(Axis::named(name));
        self.numbers.insert(name.to_owned(), number);
        number
    }

    /// All of them, by their numbers.
    pub(super) fn into_axes(self) -> Vec<Axis> {
        self.axes
    }
}
