//! Formulas by the names of their constructors.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::error::{FileError, content};
use super::number::{Num, Triple, triple, unless, vector};
use super::shape::ShapeDoc;
use crate::field::{
    ContactLaw, Coordinates, Field, Formula, Grid, LinearKernel, Nearest, Path, Profile, Radial,
    Reading, Swirl, Turbulence,
};
use crate::math::{Real, Vector, from_dvec3};

/// A radial formula's parameters, with what all radial formulas can be given.
macro_rules! radial {
    ($($name:ident { $($(#[$attribute:meta])* $parameter:ident),* })*) => {$(
        #[derive(Clone, Debug, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case", deny_unknown_fields)]
        pub(super) struct $name {
            $($(#[$attribute])* $parameter: Num,)*
            #[serde(default, skip_serializing_if = "Option::is_none")]
            shifted_to_zero_at: Option<Num>,
            #[serde(default, skip_serializing_if = "Option::is_none")]
            no_nearer_than: Option<Num>,
            #[serde(default, skip_serializing_if = "Option::is_none")]
            limited_to: Option<Num>,
        }

        impl $name {
            #[allow(dead_code, reason = "a power law is written as such, whatever it was made as")]
            fn new(radial: &Radial, $($parameter: Real),*) -> Self {
                $name {
                    $($parameter: Num($parameter),)*
                    shifted_to_zero_at: radial.shifted_at.map(Num),
                    no_nearer_than: radial.nearest.map(Num),
                    limited_to: radial.strongest.map(Num),
                }
            }

            fn ended(&self, mut field: Field) -> Field {
                if let Some(cutoff) = self.shifted_to_zero_at {
                    field = field.shifted_to_zero_at(cutoff.0);
                }
                if let Some(distance) = self.no_nearer_than {
                    field = field.no_nearer_than(distance.0);
                }
                match self.limited_to {
                    Some(length) => field.limited_to(length.0),
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

fn is_zero(number: &Num) -> bool {
    *number == Num(0.0)
}

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
    LinearKernel(KernelDoc),
    /// Needs the feature `expression`.
    Expression([String; 3]),
    Contact {
        law: ContactLaw,
    },
    Closure(Value),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct SwirlDoc {
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
pub(super) struct TurbulenceDoc {
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
pub(super) struct PathDoc {
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
pub(super) struct KernelDoc {
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
pub(super) enum CoordinatesDoc {
    #[default]
    Cartesian,
    Spherical,
    Cylindrical,
    Toroidal {
        radius: Num,
    },
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
            FormulaDoc::Swirl(d) => Field::swirl(Swirl {
                around: d.around.0,
                inward: d.inward.0,
                along: d.along.0,
                power: d.power.0,
                core: d.core.0,
            }),
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
            && field.reading == Reading::Acceleration
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
            Formula::Swirl(law) => FormulaDoc::Swirl(SwirlDoc {
                around: Num(law.around),
                inward: Num(law.inward),
                along: Num(law.along),
                power: Num(law.power),
                core: Num(law.core),
            }),
            Formula::Buoyancy(law) => FormulaDoc::Buoyancy {
                density: Num(law.density),
                gravity: Num(law.gravity),
            },
            Formula::Turbulence(law) => FormulaDoc::Turbulence(TurbulenceDoc {
                seed: law.seed,
                speed: Num(law.speed),
                size: Num(law.size),
                detail: Some(Num(law.detail)),
                turnover: Some(Num(law.turnover)),
            }),
            Formula::Path(law) => FormulaDoc::Path(PathDoc::write(law)),
            Formula::Grid(law) => FormulaDoc::Grid {
                low: triple(law.low),
                high: triple(law.high),
                counts: law.counts,
                values: law.values.iter().map(|value| triple(*value)).collect(),
            },
            Formula::LinearKernel(law) => FormulaDoc::LinearKernel(KernelDoc::write(law)),
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

#[cfg(feature = "expression")]
fn expression(texts: &[String; 3]) -> Result<Field, FileError> {
    check_texts(texts)?;
    let [x, y, z] = texts;
    Ok(Field::expression([x, y, z]))
}

/// Readers of expressions call themselves for each bracket.
#[cfg(feature = "expression")]
fn check_texts(texts: &[String; 3]) -> Result<(), FileError> {
    const LONGEST: usize = 4096;
    const DEEPEST: usize = 64;
    for (place, text) in texts.iter().enumerate() {
        let mut depth = 0_usize;
        let mut deepest = 0;
        for c in text.chars() {
            match c {
                '(' => depth += 1,
                ')' => depth = depth.saturating_sub(1),
                _ => {}
            }
            deepest = deepest.max(depth);
        }
        if text.len() > LONGEST || deepest > DEEPEST {
            let message = format!(
                "expected at most {LONGEST} characters and {DEEPEST} levels of brackets, found {} \
                 and {deepest}",
                text.len()
            );
            return Err(content(message).within(&format!("expression[{place}]")));
        }
    }
    Ok(())
}

#[cfg(not(feature = "expression"))]
fn expression(_: &[String; 3]) -> Result<Field, FileError> {
    let message = "expressions need the feature `expression` of this crate";
    Err(content(message).within("expression"))
}

/// How many winds blow in each other.
fn flow_depth(flow: &Formula) -> usize {
    let (mut depth, mut next) = (1, flow);
    while let Formula::Wind(wind) = next {
        (depth, next) = (depth + 1, &wind.flow);
    }
    depth
}

fn write_radial(radial: &Radial) -> FormulaDoc {
    match radial.profile {
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
    }
}

impl TurbulenceDoc {
    fn read(&self) -> Turbulence {
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
    fn read(&self) -> Path {
        let mut path = Path::new(self.points.iter().map(|point| vector(*point)), self.closed);
        path.speed = self.speed.0;
        path.look_ahead = self.look_ahead.0;
        path.stiffness = self.stiffness.0;
        path.damping = self.damping.0;
        path
    }

    fn write(path: &Path) -> Self {
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
    fn read(&self) -> LinearKernel {
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

    fn write(law: &LinearKernel) -> Self {
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
