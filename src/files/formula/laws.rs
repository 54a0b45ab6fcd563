//! Formulas of many settings.

use serde::{Deserialize, Serialize};

use super::super::number::{Num, Triple, triple, vector};
use crate::field::{Coordinates, LinearKernel, Path, Swirl, Turbulence};
use crate::math::{Vector, from_dvec3};

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(in crate::files) struct SwirlDoc {
    #[serde(default)]
    around: Num,
    #[serde(default)]
    inward: Num,
    #[serde(default)]
    along: Num,
    power: Num,
    #[serde(default)]
    core: Num,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(in crate::files) struct TurbulenceDoc {
    seed: u64,
    speed: Num,
    size: Num,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    detail: Option<Num>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    turnover: Option<Num>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(in crate::files) struct PathDoc {
    points: Vec<Triple>,
    #[serde(default)]
    closed: bool,
    #[serde(default)]
    speed: Num,
    #[serde(default)]
    look_ahead: Num,
    #[serde(default = "one")]
    stiffness: Num,
    #[serde(default)]
    damping: Num,
}

fn is_usual<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

fn one() -> Num {
    Num(1.0)
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(in crate::files) struct KernelDoc {
    #[serde(default, skip_serializing_if = "is_usual")]
    coordinates: CoordinatesDoc,
    #[serde(default, skip_serializing_if = "is_usual")]
    constant: Triple,
    #[serde(default, skip_serializing_if = "is_usual")]
    position_target: Triple,
    #[serde(default, skip_serializing_if = "is_usual")]
    position_multiplier: [Triple; 3],
    #[serde(default, skip_serializing_if = "is_usual")]
    velocity_target: Triple,
    #[serde(default, skip_serializing_if = "is_usual")]
    velocity_multiplier: [Triple; 3],
    #[serde(default, skip_serializing_if = "is_usual")]
    noise: Triple,
    #[serde(default, skip_serializing_if = "is_usual")]
    falloff_linear: Triple,
    #[serde(default, skip_serializing_if = "is_usual")]
    falloff_quadratic: Triple,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(in crate::files) enum CoordinatesDoc {
    #[default]
    Cartesian,
    Spherical,
    Cylindrical,
    Toroidal {
        radius: Num,
    },
}

impl SwirlDoc {
    pub(super) fn read(&self) -> Swirl {
        Swirl {
            around: self.around.0,
            inward: self.inward.0,
            along: self.along.0,
            power: self.power.0,
            core: self.core.0,
        }
    }

    pub(super) fn write(law: &Swirl) -> Self {
        SwirlDoc {
            around: Num(law.around),
            inward: Num(law.inward),
            along: Num(law.along),
            power: Num(law.power),
            core: Num(law.core),
        }
    }
}

impl TurbulenceDoc {
    pub(super) fn write(law: &Turbulence) -> Self {
        TurbulenceDoc {
            seed: law.seed,
            speed: Num(law.speed),
            size: Num(law.size),
            detail: Some(Num(law.detail)),
            turnover: Some(Num(law.turnover)),
        }
    }

    pub(super) fn read(&self) -> Turbulence {
        let mut eddies = Turbulence::new(self.seed, self.speed.0, self.size.0);
        if let Some(ratio) = self.detail {
            eddies = eddies.detail(ratio.0);
        }
        match self.turnover {
            Some(rate) => eddies.turnover(rate.0),
            None => eddies,
        }
    }
}

impl PathDoc {
    pub(super) fn read(&self) -> Path {
        let mut path = Path::new(self.points.iter().map(|point| vector(*point)), self.closed);
        path.speed = self.speed.0;
        path.look_ahead = self.look_ahead.0;
        path.stiffness = self.stiffness.0;
        path.damping = self.damping.0;
        path
    }

    pub(super) fn write(path: &Path) -> Self {
        // A closed path holds its first point twice.
        let distinct = path.points.len() - usize::from(path.closed && !path.points.is_empty());
        let points = path.points[..distinct].iter();
        PathDoc {
            points: points.map(|point| triple(from_dvec3(*point))).collect(),
            closed: path.closed,
            speed: Num(path.speed),
            look_ahead: Num(path.look_ahead),
            stiffness: Num(path.stiffness),
            damping: Num(path.damping),
        }
    }
}

impl KernelDoc {
    pub(super) fn read(&self) -> LinearKernel {
        let rows = |rows: [Triple; 3]| -> [Vector; 3] { rows.map(vector) };
        LinearKernel {
            coordinates: match self.coordinates {
                CoordinatesDoc::Cartesian => Coordinates::Cartesian,
                CoordinatesDoc::Spherical => Coordinates::Spherical,
                CoordinatesDoc::Cylindrical => Coordinates::Cylindrical,
                CoordinatesDoc::Toroidal { radius } => Coordinates::Toroidal { radius: radius.0 },
            },
            constant: vector(self.constant),
            position_target: vector(self.position_target),
            position_multiplier: rows(self.position_multiplier),
            velocity_target: vector(self.velocity_target),
            velocity_multiplier: rows(self.velocity_multiplier),
            noise: vector(self.noise),
            falloff_linear: vector(self.falloff_linear),
            falloff_quadratic: vector(self.falloff_quadratic),
        }
    }

    pub(super) fn write(law: &LinearKernel) -> Self {
        KernelDoc {
            coordinates: match law.coordinates {
                Coordinates::Cartesian => CoordinatesDoc::Cartesian,
                Coordinates::Spherical => CoordinatesDoc::Spherical,
                Coordinates::Cylindrical => CoordinatesDoc::Cylindrical,
                Coordinates::Toroidal { radius } => CoordinatesDoc::Toroidal {
                    radius: Num(radius),
                },
            },
            constant: triple(law.constant),
            position_target: triple(law.position_target),
            position_multiplier: law.position_multiplier.map(triple),
            velocity_target: triple(law.velocity_target),
            velocity_multiplier: law.velocity_multiplier.map(triple),
            noise: triple(law.noise),
            falloff_linear: triple(law.falloff_linear),
            falloff_quadratic: triple(law.falloff_quadratic),
        }
    }
}
