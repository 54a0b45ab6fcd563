//! Formulas by the names of their constructors.

mod radial;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use radial::{
    CoulombDoc, GaussianDoc, HertzDoc, LennardJonesDoc, MorseDoc, PointGravityDoc, PowerDoc,
    YukawaDoc, write_radial,
};

use super::error::{FileError, content};
use super::fields;
use super::fields::field::{
    Buoyancy, Drag, Expression, Formula, Grid, LinearKernel, Magnetic, Path, Profile, Spring,
    Swirl, Turbulence, Uniform,
};
use super::fields::math::Real;
use super::fields::{ContactLaw, Field, ForceMode};
use super::number::{Num, unless};
use super::shape::ShapeDoc;

/// A formula. Where a file has the same settings as the type in memory, the variant holds that type.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    remote = "Self",
    rename_all = "kebab-case",
    rename_all_fields = "kebab-case",
    deny_unknown_fields
)]
pub(super) enum FormulaDoc {
    Uniform(Uniform),
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
    Spring(Spring),
    Drag(Drag),
    Wind {
        flow: Box<FormulaDoc>,
        #[serde(default)]
        linear: Num,
        #[serde(default)]
        quadratic: Num,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        speed_cap: Option<Num>,
    },
    Magnetic(Magnetic),
    Swirl(Swirl),
    Buoyancy(Buoyancy),
    Turbulence(Turbulence),
    Path(Path),
    Grid(Grid),
    LinearKernel(Box<LinearKernel>),
    Expression(Expression),
    Contact {
        law: ContactLaw,
    },
    #[cfg_attr(feature = "schema", schemars(skip))]
    Closure(Value),
}

crate::choice::one_of!(FormulaDoc, "formula");

impl FormulaDoc {
    /// The field made by the constructor of that name.
    pub(super) fn read(&self) -> Result<Field, FileError> {
        let within = |name: &'static str| move |error: FileError| error.within(name);
        Ok(match self {
            FormulaDoc::Uniform(law) => Field::uniform(law.vector),
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
                if !matches!(radial.view().formula, Formula::Radial(_)) {
                    let message = "expected a formula of the distance, such as `radial`";
                    return Err(content(message).within("around.formula"));
                }
                radial.around(shape)
            }
            FormulaDoc::Spring(law) => {
                Field::spring_damper(law.stiffness, law.damping, law.rest_length)
            }
            FormulaDoc::Drag(law) => Field::drag(law.linear, law.quadratic),
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
            FormulaDoc::Magnetic(law) => Field::magnetic(law.field),
            FormulaDoc::Swirl(law) => Field::swirl(*law),
            FormulaDoc::Buoyancy(law) => Field::buoyancy(law.density, law.gravity),
            FormulaDoc::Turbulence(law) => Field::turbulence(law.clone()),
            FormulaDoc::Path(law) => Field::path(law.clone()),
            FormulaDoc::Grid(law) => Field::grid(law.clone()),
            FormulaDoc::LinearKernel(law) => Field::linear_kernel(**law),
            FormulaDoc::Expression(law) => {
                let [x, y, z] = law.texts();
                Field::expression([x, y, z])
            }
            FormulaDoc::Contact { law } => Field::contact(*law),
            FormulaDoc::Closure(_) => {
                return Err(content("a closure is code and cannot be written to a file"));
            }
        })
    }

    /// The formula of a field. An inverse-square attraction that is an acceleration is written as `point-gravity`.
    pub(super) fn of(field: &Field) -> Result<Self, FileError> {
        let field = field.view();
        if let Formula::Radial(law) = field.formula
            && let Profile::Power {
                strength,
                power: -2.0,
                softening,
                ..
            } = law.profile
            && strength < 0.0
            && field.force_mode == ForceMode::Acceleration
        {
            let doc = PointGravityDoc::new(law, -strength, softening);
            return Ok(FormulaDoc::PointGravity(doc));
        }
        Self::write(field.formula)
    }

    fn write(formula: &Formula) -> Result<Self, FileError> {
        Ok(match formula {
            Formula::Uniform(law) => FormulaDoc::Uniform(*law),
            Formula::Radial(law) => write_radial(law)?,
            Formula::Nearest(nearest) => FormulaDoc::Around {
                shape: ShapeDoc::write(nearest.shape())?,
                formula: Box::new(write_radial(&nearest.radial)?),
            },
            Formula::Spring(law) => FormulaDoc::Spring(*law),
            Formula::Drag(law) => FormulaDoc::Drag(*law),
            Formula::Wind(law) => {
                super::check_depth(flow_depth(&law.flow))?;
                FormulaDoc::Wind {
                    flow: Box::new(FormulaDoc::write(&law.flow)?),
                    linear: Num(law.drag.linear),
                    quadratic: Num(law.drag.quadratic),
                    speed_cap: unless(law.speed_cap, Real::INFINITY).map(Num),
                }
            }
            Formula::Magnetic(law) => FormulaDoc::Magnetic(*law),
            Formula::Swirl(law) => FormulaDoc::Swirl(*law),
            Formula::Buoyancy(law) => FormulaDoc::Buoyancy(*law),
            Formula::Turbulence(law) => FormulaDoc::Turbulence((**law).clone()),
            Formula::Path(law) => FormulaDoc::Path((**law).clone()),
            Formula::Grid(law) => FormulaDoc::Grid((**law).clone()),
            Formula::LinearKernel(law) => FormulaDoc::LinearKernel(law.clone()),
            Formula::Expression(law) => FormulaDoc::Expression((**law).clone()),
            Formula::Contact(law) => FormulaDoc::Contact { law: *law },
            Formula::Closure(_) => return Err(closure()),
            _ => return Err(content("this formula cannot stand in a file")),
        })
    }
}

fn closure() -> FileError {
    FileError::Code {
        what: "formula".to_owned(),
        kind: "closure",
    }
}

/// The levels of formulas in the flow of a wind: one more than the winds nested in it.
fn flow_depth(flow: &Formula) -> usize {
    let (mut depth, mut next) = (1, flow);
    while let Formula::Wind(wind) = next {
        (depth, next) = (depth + 1, &wind.flow);
    }
    depth
}
