//! Formulas by the names of their constructors.

mod laws;
mod radial;
mod text;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use laws::{KernelDoc, PathDoc, SwirlDoc, TurbulenceDoc};
use radial::{
    CoulombDoc, GaussianDoc, HertzDoc, LennardJonesDoc, MorseDoc, PointGravityDoc, PowerDoc,
    YukawaDoc, is_zero, write_radial,
};
#[cfg(feature = "expression")]
use text::check_texts;
use text::expression;

use super::error::{FileError, content};
use super::number::{Num, Triple, triple, unless, vector};
use super::shape::ShapeDoc;
use crate::field::{ContactLaw, Field, ForceMode, Formula, Grid, Nearest, Profile};
use crate::math::Real;

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(
    rename_all = "kebab-case",
    rename_all_fields = "kebab-case",
    deny_unknown_fields
)]
pub(super) enum FormulaDoc {
    Uniform {
        vector: Triple,
    },
    Radial(PowerDoc),
    PointGravity(PointGravityDoc),
    Coulomb(CoulombDoc),
    LennardJones(LennardJonesDoc),
    Yukawa(YukawaDoc),
    Morse(MorseDoc),
    Gaussian(GaussianDoc),
    Hertz(HertzDoc),
    Around {
        shape: ShapeDoc,
        formula: Box<FormulaDoc>,
    },
    Spring {
        stiffness: Num,
        #[serde(default, skip_serializing_if = "is_zero")]
        damping: Num,
        #[serde(default, skip_serializing_if = "is_zero")]
        rest_length: Num,
    },
    Drag {
        #[serde(default)]
        linear: Num,
        #[serde(default)]
        quadratic: Num,
    },
    Wind {
        flow: Box<FormulaDoc>,
        #[serde(default)]
        linear: Num,
        #[serde(default)]
        quadratic: Num,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        speed_cap: Option<Num>,
    },
    Magnetic {
        field: Triple,
    },
    Swirl(SwirlDoc),
    Buoyancy {
        density: Num,
        gravity: Num,
    },
    Turbulence(TurbulenceDoc),
    Path(PathDoc),
    Grid {
        low: Triple,
        high: Triple,
        counts: [usize; 3],
        values: Vec<Triple>,
    },
    LinearKernel(Box<KernelDoc>),
    /// Needs the feature `expression`.
    Expression([String; 3]),
    Contact {
        law: ContactLaw,
    },
    Closure(Value),
}

impl FormulaDoc {
    /// The field that the constructor of that name makes.
    pub(super) fn read(&self) -> Result<Field, FileError> {
        let within = |name: &'static str| move |error: FileError| error.within(name);
        Ok(match self {
            FormulaDoc::Uniform { vector: v } => Field::uniform(vector(*v)),
            FormulaDoc::Radial(d) => {
                let field = Field::radial(d.strength.0, d.power.0);
                d.ended(field.softened(d.softening.0))
            }
            FormulaDoc::PointGravity(d) => {
                d.ended(Field::point_gravity(d.mu.0).softened(d.softening.0))
            }
            FormulaDoc::Coulomb(d) => {
                let field = Field::coulomb(d.constant.0, d.charge.0);
                d.ended(field.softened(d.softening.0))
            }
            FormulaDoc::LennardJones(d) => d.ended(Field::lennard_jones(d.epsilon.0, d.sigma.0)),
            FormulaDoc::Yukawa(d) => d.ended(Field::yukawa(d.strength.0, d.screening.0)),
            FormulaDoc::Morse(d) => {
                d.ended(Field::morse(d.depth.0, d.stiffness.0, d.rest_length.0))
            }
            FormulaDoc::Gaussian(d) => d.ended(Field::gaussian(d.height.0, d.width.0)),
            FormulaDoc::Hertz(d) => d.ended(Field::hertz(d.stiffness.0, d.diameter.0)),
            FormulaDoc::Around { shape, formula } => {
                let shape = shape.read().map_err(within("around.shape"))?;
                let radial = formula.read().map_err(within("around.formula"))?;
                if !matches!(radial.formula, Formula::Radial(_)) {
                    let message =
                        format!("expected a radial formula, found {}", radial.formula.kind());
                    return Err(content(message).within("around.formula"));
                }
                radial.around(shape)
            }
            FormulaDoc::Spring {
                stiffness,
                damping,
                rest_length,
            } => Field::spring_damper(stiffness.0, damping.0, rest_length.0),
            FormulaDoc::Drag { linear, quadratic } => Field::drag(linear.0, quadratic.0),
            FormulaDoc::Wind {
                flow,
                linear,
                quadratic,
                speed_cap,
            } => {
                let flow = flow.read().map_err(within("wind.flow"))?;
                let wind = flow.as_wind(linear.0, quadratic.0);
                match speed_cap {
                    Some(cap) => wind.speed_cap(cap.0),
                    None => wind,
                }
            }
            FormulaDoc::Magnetic { field } => Field::magnetic(vector(*field)),
            FormulaDoc::Swirl(d) => Field::swirl(d.read()),
            FormulaDoc::Buoyancy { density, gravity } => Field::buoyancy(density.0, gravity.0),
            FormulaDoc::Turbulence(d) => Field::turbulence(d.read()),
            FormulaDoc::Path(d) => Field::path(d.read()),
            FormulaDoc::Grid {
                low,
                high,
                counts,
                values,
            } => Field::grid(Grid {
                low: vector(*low),
                high: vector(*high),
                counts: *counts,
                values: values.iter().map(|value| vector(*value)).collect(),
            }),
            FormulaDoc::LinearKernel(d) => Field::linear_kernel(d.read()),
            FormulaDoc::Expression(texts) => expression(texts)?,
            FormulaDoc::Contact { law } => Field::contact(*law),
            FormulaDoc::Closure(_) => return Err(closure()),
        })
    }

    /// That of a field: a pull that is read as an acceleration is a gravity.
    pub(super) fn of(field: &Field) -> Result<Self, FileError> {
        if let Formula::Radial(law) = &field.formula
            && let Profile::Power {
                strength,
                power: -2.0,
                softening,
            } = law.profile
            && strength < 0.0
            && field.mode == ForceMode::Acceleration
        {
            let doc = PointGravityDoc::new(law, -strength, softening);
            return Ok(FormulaDoc::PointGravity(doc));
        }
        Self::write(&field.formula)
    }

    fn write(formula: &Formula) -> Result<Self, FileError> {
        Ok(match formula {
            Formula::Uniform(law) => FormulaDoc::Uniform {
                vector: triple(law.vector),
            },
            Formula::Radial(law) => write_radial(law),
            Formula::Nearest(Nearest { shape, radial }) => FormulaDoc::Around {
                shape: ShapeDoc::write(&shape.0)?,
                formula: Box::new(write_radial(radial)),
            },
            Formula::Spring(law) => FormulaDoc::Spring {
                stiffness: Num(law.stiffness),
                damping: Num(law.damping),
                rest_length: Num(law.rest_length),
            },
            Formula::Drag(law) => FormulaDoc::Drag {
                linear: Num(law.linear),
                quadratic: Num(law.quadratic),
            },
            Formula::Wind(law) => {
                super::check_depth(flow_depth(&law.flow))?;
                FormulaDoc::Wind {
                    flow: Box::new(FormulaDoc::write(&law.flow)?),
                    linear: Num(law.drag.linear),
                    quadratic: Num(law.drag.quadratic),
                    speed_cap: unless(law.speed_cap, Real::INFINITY).map(Num),
                }
            }
            Formula::Magnetic(law) => FormulaDoc::Magnetic {
                field: triple(law.field),
            },
            Formula::Swirl(law) => FormulaDoc::Swirl(SwirlDoc::write(law)),
            Formula::Buoyancy(law) => FormulaDoc::Buoyancy {
                density: Num(law.density),
                gravity: Num(law.gravity),
            },
            Formula::Turbulence(law) => FormulaDoc::Turbulence(TurbulenceDoc::write(law)),
            Formula::Path(law) => FormulaDoc::Path(PathDoc::write(law)),
            Formula::Grid(law) => FormulaDoc::Grid {
                low: triple(law.low),
                high: triple(law.high),
                counts: law.counts,
                values: law.values.iter().map(|value| triple(*value)).collect(),
            },
            Formula::LinearKernel(law) => FormulaDoc::LinearKernel(Box::new(KernelDoc::write(law))),
            #[cfg(feature = "expression")]
            Formula::Expression(law) => {
                check_texts(law.texts())?;
                FormulaDoc::Expression(law.texts().clone())
            }
            Formula::Contact(law) => FormulaDoc::Contact { law: *law },
            Formula::Closure(_) => return Err(closure()),
        })
    }
}

fn closure() -> FileError {
    FileError::Code {
        what: "formula".to_owned(),
        kind: "closure",
    }
}

/// How many winds blow in each other.
fn flow_depth(flow: &Formula) -> usize {
    let (mut depth, mut next) = (1, flow);
    while let Formula::Wind(wind) = next {
        (depth, next) = (depth + 1, &wind.flow);
    }
    depth
}
