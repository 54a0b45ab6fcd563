//! Radial formulas: functions of the distance.

use serde::{Deserialize, Serialize};

use super::super::error::{FileError, content};
use super::super::number::Num;
use super::FormulaDoc;
use super::fields::Field;
use super::fields::field::{Profile, Radial};
use super::fields::math::Real;

/// The parameters of a radial formula, with the settings common to all radial formulas.
macro_rules! radial {
    ($($name:ident { $($(#[$attribute:meta])* $parameter:ident),* })*) => {$(
        #[derive(Clone, Debug, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(rename_all = "kebab-case", deny_unknown_fields)]
        pub(in super::super) struct $name {
            $($(#[$attribute])* pub $parameter: Num,)*
            #[serde(default, skip_serializing_if = "Option::is_none")]
            shifted_to_zero_at: Option<Num>,
            #[serde(default, skip_serializing_if = "Option::is_none")]
            no_nearer_than: Option<Num>,
            #[serde(default, skip_serializing_if = "Option::is_none")]
            limited_to: Option<Num>,
            #[serde(default, skip_serializing_if = "Option::is_none")]
            opening_angle: Option<Num>,
        }

        impl $name {
            #[allow(dead_code, reason = "a power law is written as such, whatever it was made as")]
            pub fn new(radial: &Radial, $($parameter: Real),*) -> Self {
                $name {
                    $($parameter: Num($parameter),)*
                    shifted_to_zero_at: radial.shifted_at.map(Num),
                    no_nearer_than: radial.nearest.map(Num),
                    limited_to: radial.strongest.map(Num),
                    opening_angle: radial.opening_angle.map(Num),
                }
            }

            pub fn ended(&self, mut field: Field) -> Field {
                if let Some(cutoff) = self.shifted_to_zero_at {
                    field = field.shifted_to_zero_at(cutoff.0);
                }
                if let Some(distance) = self.no_nearer_than {
                    field = field.no_nearer_than(distance.0);
                }
                if let Some(length) = self.limited_to {
                    field = field.limited_to(length.0);
                }
                match self.opening_angle {
                    Some(angle) => field.opening_angle(angle.0),
                    None => field,
                }
            }
        }
    )*};
}

radial! {
    PowerDoc {
        strength,
        power,
        #[serde(default, skip_serializing_if = "is_zero")] softening
    }
    PointGravityDoc {
        mu,
        #[serde(default, skip_serializing_if = "is_zero")]
        softening
    }
    CoulombDoc {
        constant,
        charge,
        #[serde(default, skip_serializing_if = "is_zero")]
        softening
    }
    LennardJonesDoc { epsilon, sigma }
    YukawaDoc { strength, screening }
    MorseDoc { depth, stiffness, rest_length }
    GaussianDoc { height, width }
    HertzDoc { stiffness, diameter }
}

pub(super) fn is_zero(number: &Num) -> bool {
    *number == Num(0.0)
}

pub(super) fn write_radial(radial: &Radial) -> Result<FormulaDoc, FileError> {
    Ok(match radial.profile {
        Profile::Power {
            strength,
            power,
            softening,
        } => FormulaDoc::Radial(PowerDoc::new(radial, strength, power, softening)),
        Profile::LennardJones { epsilon, sigma } => {
            FormulaDoc::LennardJones(LennardJonesDoc::new(radial, epsilon, sigma))
        }
        Profile::Yukawa {
            strength,
            screening,
        } => FormulaDoc::Yukawa(YukawaDoc::new(radial, strength, screening)),
        Profile::Morse {
            depth,
            stiffness,
            rest_length,
        } => FormulaDoc::Morse(MorseDoc::new(radial, depth, stiffness, rest_length)),
        Profile::Gaussian { height, width } => {
            FormulaDoc::Gaussian(GaussianDoc::new(radial, height, width))
        }
        Profile::Hertz {
            stiffness,
            diameter,
        } => FormulaDoc::Hertz(HertzDoc::new(radial, stiffness, diameter)),
        _ => return Err(content("this formula cannot stand in a file")),
    })
}
