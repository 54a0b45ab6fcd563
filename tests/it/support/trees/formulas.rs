//! One plan for each formula, as plain data.
//!
//! With [`Numbers::Integer`] a plan gives integers at integers. With [`Numbers::Fractional`] no
//! formula is singular, or jumps, at points whose coordinates are odd multiples of a quarter.

use proptest::prelude::*;
use rapier3d_fields::field::{Coordinates, Grid, LinearKernel, Path, Registry, Turbulence};
use rapier3d_fields::math::to_f64;
use rapier3d_fields::prelude::*;

use super::super::worlds::vector;
use super::{Numbers, triple};

/// The length parameter of the laws that have one.
const LENGTH: Real = 1.5;

/// A law of the distance.
#[derive(Clone, Debug)]
pub enum LawPlan {
    Power {
        strength: i32,
        power: i32,
        softened: bool,
    },
    LennardJones(i32),
    Yukawa(i32),
    Morse(i32),
    Gaussian(i32),
    /// Stiffness and diameter.
    Hertz(i32, i32),
}

#[derive(Clone, Debug)]
pub enum FormulaPlan {
    Uniform([i32; 3]),
    Radial {
        law: LawPlan,
        cutoff: Option<i32>,
        nearest: Option<i32>,
    },
    /// Strength, power and half the edge of a cube.
    Around(i32, i32, i32),
    Spring {
        stiffness: i32,
        damping: i32,
        rest_length: i32,
    },
    Drag {
        linear: i32,
        quadratic: i32,
    },
    Wind {
        velocity: [i32; 3],
        linear: i32,
        quadratic: i32,
        cap: Option<i32>,
    },
    Magnetic([i32; 3]),
    Spin(i32),
    Vortex {
        strength: i32,
        power: i32,
        smoothed: bool,
        as_wind: bool,
    },
    Updraft(i32, i32),
    Buoyancy(i32),
    /// Seed, and whether it drags.
    Turbulence(u8, bool),
    Path {
        closed: bool,
        look_ahead: i32,
        stiffness: i32,
        damping: i32,
        speed: i32,
    },
    /// Factor of the sampled function.
    Grid(i32),
    Kernel {
        coordinates: u8,
        constant: [i32; 3],
        target: [i32; 3],
        place: i32,
        velocity: i32,
        falloff: i32,
    },
    /// The number of an expression.
    Expression(u8),
    /// The number of a closure.
    Closure(u8),
}

fn real(i: i32) -> Real {
    i as Real
}

/// Sizes of the fractional family.
fn size(i: i32) -> Real {
    real(i) + 0.37
}

impl LawPlan {
    fn field(&self) -> Field {
        match *self {
            LawPlan::Power {
                strength,
                power,
                softened,
            } => {
                let field = Field::radial(real(strength), real(power));
                if softened { field.softened(0.5) } else { field }
            }
            LawPlan::LennardJones(epsilon) => Field::lennard_jones(real(epsilon), 0.75),
            LawPlan::Yukawa(strength) => Field::yukawa(real(strength), LENGTH),
            LawPlan::Morse(depth) => Field::morse(real(depth), 1.0, LENGTH),
            LawPlan::Gaussian(height) => Field::gaussian(real(height), LENGTH),
            LawPlan::Hertz(stiffness, diameter) => Field::hertz(real(stiffness), size(diameter)),
        }
    }

    /// The sum of the magnitudes of the law's terms at a distance, each times its sensitivity to a relative error of
    /// the distance.
    fn magnitude(&self, r: f64) -> f64 {
        let length = to_f64(LENGTH);
        let strength = |i: i32| f64::from(i).abs();
        match *self {
            LawPlan::Power {
                strength: k,
                power,
                softened,
            } => {
                let rho = if softened { r.hypot(0.5) } else { r };
                strength(k) * r * rho.powi(power - 1)
            }
            LawPlan::LennardJones(epsilon) => {
                let s6 = (0.75 / r).powi(6);
                24.0 * strength(epsilon) * (2.0 * s6 * s6 + s6) / r
            }
            LawPlan::Yukawa(k) => {
                let plain = strength(k) * (-r / length).exp() * (1.0 / r + 1.0 / length) / r;
                plain * (1.0 + r / length)
            }
            LawPlan::Morse(depth) => {
                let decay = (length - r).exp();
                2.0 * strength(depth) * (decay * decay + decay) * (1.0 + r + length)
            }
            LawPlan::Gaussian(height) => {
                let t2 = (r / length).powi(2);
                strength(height) * r / length.powi(2) * (-t2 / 2.0).exp() * (1.0 + t2)
            }
            LawPlan::Hertz(stiffness, diameter) => {
                strength(stiffness) * to_f64(size(diameter)).max(r).powf(1.5)
            }
        }
    }
}

impl FormulaPlan {
    pub fn field(&self) -> Field {
        match self {
            FormulaPlan::Radial {
                law,
                cutoff,
                nearest,
            } => {
                let field = law.field();
                let field = match nearest {
                    Some(nearest) => field.no_nearer_than(size(*nearest)),
                    None => field,
                };
                match cutoff {
                    Some(cutoff) => field.shifted_to_zero_at(size(*cutoff)),
                    None => field,
                }
            }
            FormulaPlan::Around(strength, power, half) => {
                let cube = SharedShape::cuboid(size(*half), size(*half), size(*half));
                let law = Field::radial(real(*strength), real(*power));
                law.no_nearer_than(0.37).around(cube)
            }
            FormulaPlan::Path { .. } | FormulaPlan::Grid(_) | FormulaPlan::Kernel { .. } => {
                self.sampled()
            }
            FormulaPlan::Expression(number) => expression(*number),
            FormulaPlan::Closure(number) => closure(*number),
            _ => self.plain(),
        }
    }

    fn plain(&self) -> Field {
        match *self {
            FormulaPlan::Uniform(v) => Field::uniform(vector(v)),
            FormulaPlan::Spring {
                stiffness,
                damping,
                rest_length,
            } => Field::spring_damper(real(stiffness), real(damping), real(rest_length)),
            FormulaPlan::Drag { linear, quadratic } => Field::drag(real(linear), real(quadratic)),
            FormulaPlan::Wind {
                velocity,
                linear,
                quadratic,
                cap,
            } => {
                let wind = Field::wind(vector(velocity), real(linear), real(quadratic));
                match cap {
                    Some(cap) => wind.speed_cap(real(cap)),
                    None => wind,
                }
            }
            FormulaPlan::Magnetic(b) => Field::magnetic(vector(b)),
            FormulaPlan::Spin(rate) => Field::spin(real(rate)),
            FormulaPlan::Vortex {
                strength,
                power,
                smoothed,
                as_wind,
            } => {
                let field = Field::vortex(real(strength), real(power));
                let field = if smoothed { field.smoothed(0.5) } else { field };
                if as_wind {
                    field.as_wind(1.0, 0.5)
                } else {
                    field
                }
            }
            FormulaPlan::Updraft(strength, inward) => Field::updraft(real(strength), real(inward)),
            FormulaPlan::Buoyancy(density) => Field::buoyancy(real(density), 9.75),
            FormulaPlan::Turbulence(seed, as_wind) => {
                let eddies = Turbulence::new(u64::from(seed), 2.0, 4.0).turnover(0.5);
                let field = Field::turbulence(eddies);
                if as_wind {
                    field.as_wind(1.0, 0.5)
                } else {
                    field
                }
            }
            _ => unreachable!("made elsewhere"),
        }
    }

    fn sampled(&self) -> Field {
        match *self {
            FormulaPlan::Path {
                closed,
                look_ahead,
                stiffness,
                damping,
                speed,
            } => {
                let corners = [[-2, 0, 0], [2, 0, 0], [2, 0, 2], [-2, 0, 2]].map(vector);
                let path = Path::new(corners, closed).look_ahead(real(look_ahead));
                Field::path(
                    path.stiffness(real(stiffness))
                        .damping(real(damping), real(speed)),
                )
            }
            FormulaPlan::Grid(factor) => {
                let wave =
                    move |p: Vector| Vector::new(p.y * p.z, p.z + p.x, p.x * p.y) * real(factor);
                let (low, high) = (Vector::splat(-4.0), Vector::splat(4.0));
                Field::grid(Grid::sampled(low, high, [5, 9, 9], wave))
            }
            FormulaPlan::Kernel {
                coordinates,
                constant,
                target,
                place,
                velocity,
                falloff,
            } => {
                let rows =
                    |k: i32| [Vector::X, Vector::Y + Vector::Z, Vector::Z].map(|row| row * real(k));
                Field::linear_kernel(LinearKernel {
                    coordinates: match coordinates {
                        0 => Coordinates::Cartesian,
                        1 => Coordinates::Spherical,
                        2 => Coordinates::Cylindrical,
                        _ => Coordinates::Toroidal { radius: 1.5 },
                    },
                    constant: vector(constant),
                    position_target: vector(target),
                    position_multiplier: rows(place),
                    velocity_target: Vector::Y,
                    velocity_multiplier: rows(velocity),
                    noise: Vector::ZERO,
                    falloff_linear: Vector::new(0.0, real(falloff), 0.0),
                    falloff_quadratic: Vector::new(real(falloff), 0.0, 0.0),
                })
            }
            _ => unreachable!("made elsewhere"),
        }
    }

    fn cutoff(&self) -> Option<i32> {
        match self {
            FormulaPlan::Radial { cutoff, .. } => *cutoff,
            _ => None,
        }
    }

    /// Whether its constructor sets a region, which must stay.
    pub fn brings_region(&self) -> bool {
        self.cutoff().is_some() || matches!(self, FormulaPlan::Grid(_))
    }

    /// The sum of the magnitudes of a radial law's terms at a distance; the terms may cancel.
    pub fn radial_magnitude(&self, r: f64) -> Option<f64> {
        let FormulaPlan::Radial {
            law,
            cutoff,
            nearest,
        } = self
        else {
            return None;
        };
        let nearest = nearest.map_or(0.0, |nearest| to_f64(size(nearest)));
        let at_cutoff = cutoff.map_or(0.0, |cutoff| law.magnitude(to_f64(size(cutoff))));
        Some(law.magnitude(r.max(nearest)) + at_cutoff)
    }
}

fn expression(number: u8) -> Field {
    match number {
        0 => Field::expression(["2*y - x*z", "x + delta", "mass*z"]),
        1 => Field::expression(["vx*z", "vy - vz", "charge*x"]),
        _ => Field::expression(["sin(x)", "exp(-(y^2))*speed", "cos(time + z)"]),
    }
}

fn closure(number: u8) -> Field {
    match number {
        0 => Field::closure_named("beside", [], beside),
        1 => Field::closure_named("axes", ["delta".into(), Axis::Time], axes),
        _ => Field::closure_named("gyration", [Axis::Speed], gyration),
    }
}

fn beside(s: &Sample) -> Vector {
    s.local_point + Vector::X
}

fn axes(s: &Sample) -> Vector {
    Vector::new(s.axes[0], s.axes[1], s.charge)
}

fn gyration(s: &Sample) -> Vector {
    s.local_velocity.cross(s.local_point)
}

/// A registry of the functions of the formulas.
pub fn registry() -> Registry {
    Registry::new()
        .formula("beside", [], beside)
        .formula("axes", ["delta".into(), Axis::Time], axes)
        .formula("gyration", [Axis::Speed], gyration)
}

fn number() -> impl Strategy<Value = i32> + Clone {
    -3..=3
}

/// Formulas of both families.
fn common() -> impl Strategy<Value = FormulaPlan> {
    let kernel = (triple(2), triple(2), number(), number());
    let path = (any::<bool>(), 0..=3, number(), number(), 0..=2);
    prop_oneof![
        4 => triple(3).prop_map(FormulaPlan::Uniform),
        1 => triple(2).prop_map(FormulaPlan::Magnetic),
        2 => (0..3_u8).prop_map(FormulaPlan::Closure),
        2 => (0..2_u8).prop_map(FormulaPlan::Expression),
        1 => number().prop_map(FormulaPlan::Spin),
        1 => number().prop_map(|lift| FormulaPlan::Updraft(lift, 0)),
        1 => (triple(2), number()).prop_map(|(velocity, linear)| {
            FormulaPlan::Wind { velocity, linear, quadratic: 0, cap: None }
        }),
        1 => path.prop_map(|(closed, look_ahead, stiffness, damping, speed)| {
            FormulaPlan::Path { closed, look_ahead, stiffness, damping, speed }
        }),
        1 => number().prop_map(|factor| FormulaPlan::Grid(2 * factor)),
        1 => kernel.prop_map(|(constant, target, place, velocity)| FormulaPlan::Kernel {
            coordinates: 0, constant, target, place, velocity, falloff: 0,
        }),
    ]
}

fn integer() -> impl Strategy<Value = FormulaPlan> {
    let spring = (number(), number()).prop_map(|(stiffness, damping)| FormulaPlan::Spring {
        stiffness,
        damping,
        rest_length: 0,
    });
    let radial = (number(), prop_oneof![Just(1), Just(3)]).prop_map(|(strength, power)| {
        FormulaPlan::Radial {
            law: LawPlan::Power {
                strength,
                power,
                softened: false,
            },
            cutoff: None,
            nearest: None,
        }
    });
    let drag = number().prop_map(|linear| FormulaPlan::Drag {
        linear,
        quadratic: 0,
    });
    prop_oneof![5 => common(), 1 => spring, 2 => radial, 1 => drag]
}

fn fractional() -> impl Strategy<Value = FormulaPlan> {
    let spring = (number(), number(), 0..=2).prop_map(|(stiffness, damping, rest_length)| {
        FormulaPlan::Spring {
            stiffness,
            damping,
            rest_length,
        }
    });
    let wind = (triple(2), 0..=3, 0..=3, 0..=2);
    let vortex = (number(), -2..=1, any::<bool>(), any::<bool>());
    let kernel = (1..4_u8, triple(2), triple(2), number(), number(), 0..=2);
    let others = prop_oneof![
        2 => spring,
        2 => (number(), number())
            .prop_map(|(linear, quadratic)| FormulaPlan::Drag { linear, quadratic }),
        2 => (number(), -2..=1, 0..=2).prop_map(|(k, power, half)| FormulaPlan::Around(k, power, half)),
        2 => wind.prop_map(|(velocity, linear, quadratic, cap)| {
            FormulaPlan::Wind { velocity, linear, quadratic, cap: Some(cap) }
        }),
        2 => vortex.prop_map(|(strength, power, smoothed, as_wind)| {
            FormulaPlan::Vortex { strength, power, smoothed, as_wind }
        }),
        1 => (number(), number()).prop_map(|(lift, inward)| FormulaPlan::Updraft(lift, inward)),
        1 => number().prop_map(FormulaPlan::Buoyancy),
        1 => (0..3_u8, any::<bool>()).prop_map(|(seed, wind)| FormulaPlan::Turbulence(seed, wind)),
        2 => kernel.prop_map(|(coordinates, constant, target, place, velocity, falloff)| {
            FormulaPlan::Kernel { coordinates, constant, target, place, velocity, falloff }
        }),
        1 => Just(FormulaPlan::Expression(2)),
    ];
    prop_oneof![3 => common(), 3 => radial_law(), 4 => others]
}

pub fn formula(numbers: Numbers) -> BoxedStrategy<FormulaPlan> {
    match numbers {
        Numbers::Integer => integer().boxed(),
        Numbers::Fractional => fractional().boxed(),
    }
}

/// Every law of the distance; softened, shifted, with a nearest distance, or none of these.
pub fn radial_law() -> impl Strategy<Value = FormulaPlan> {
    let law = prop_oneof![
        8 => (-3..=3, -3..=2, any::<bool>()).prop_map(|(strength, power, softened)| {
            LawPlan::Power { strength, power, softened }
        }),
        2 => (1..=3).prop_map(LawPlan::LennardJones),
        1 => number().prop_map(LawPlan::Yukawa),
        1 => number().prop_map(LawPlan::Morse),
        1 => number().prop_map(LawPlan::Gaussian),
        1 => (number(), 1..=3).prop_map(|(k, diameter)| LawPlan::Hertz(k, diameter)),
    ];
    let nearest = prop_oneof![3 => Just(None), 1 => (0..=2).prop_map(Some)];
    (law, proptest::option::of(1..=4), nearest).prop_map(|(law, cutoff, nearest)| {
        FormulaPlan::Radial {
            law,
            cutoff,
            nearest,
        }
    })
}
