//! The stability map: every scheme on every kind of scene, at twelve values of dt·ω, damped or not.

use super::super::fields;
use super::{DT, Damping, Fate, Kind, StabilityCell, fate};
use fields::prelude::*;

/// The schemes of the map.
pub const SCHEMES: [Scheme; 8] = [
    Scheme::KickDriftKick,
    Scheme::Kick,
    Scheme::ExternalForce,
    Scheme::substeps(3),
    Scheme::Substep(Substeps::PerBody { tolerance: 1e-3 }),
    Scheme::LinearlyImplicit,
    Scheme::Forward4,
    Scheme::auto(1e-3),
];

/// The values of dt·ω, where ω is the fastest rate of a scene.
pub const TURNS: [f64; 12] = [
    0.03, 0.1, 0.3, 0.9, 1.5, 1.9, 2.1, 3.0, 10.0, 30.0, 100.0, 1000.0,
];

/// The row of a scheme: a cell for each of [`TURNS`].
pub fn map(kind: Kind, damping: Damping, scheme: Scheme) -> Vec<StabilityCell> {
    let cell = |turn: &f64| {
        let fate = fate(kind.scene(turn / DT, damping), scheme);
        StabilityCell {
            precision: super::super::cases::PRECISION,
            kind: format!("{kind:?}"),
            damping: format!("{damping:?}"),
            scheme: format!("{scheme:?}").replace("tolerance: ", ""),
            turn: *turn,
            class: fate.class(damping),
            most: fate.most,
        }
    };
    TURNS.iter().map(cell).collect()
}

impl Fate {
    /// The class of a run in the map, see [`StabilityCell::LEGEND`].
    pub fn class(self, damping: Damping) -> char {
        let lost = damping == Damping::None && self.last < 0.9;
        match self {
            _ if self.is_silent() => '!',
            _ if self.refused => 'R',
            Fate {
                exploded: Some(_), ..
            } => 'X',
            Fate { told: Some(_), .. } => 'w',
            _ if self.most > 1.1 => '~',
            _ if lost => 'd',
            _ => '.',
        }
    }
}
