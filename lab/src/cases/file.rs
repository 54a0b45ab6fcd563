//! A scene from a file, compared with its own run in 64 bits at a much shorter step.

use std::sync::{Arc, OnceLock};

use super::files::{Document, SceneFile};
use super::simulation::{Driver, Simulation};
use super::{About, Case, fields, run, scheme};
use crate::study::{Measured, Method, Metric, Run, State, StudyError};
use fields::math::{RigidBodyHandle, from_f64, to_dpose3, to_dvec3, to_f64};

/// A scene without a known solution. Its reference is its own run at steps so short that shorter ones change little.
#[derive(Clone)]
pub struct Filed {
    about: About,
    text: Arc<str>,
    file: SceneFile,
    reference: Arc<OnceLock<Reference>>,
}

/// Final states of the bodies, their root mean square displacement, and the change of the ends by the last halving of
/// the step, relative to that displacement.
#[derive(Clone, Debug)]
struct Reference {
    ends: Vec<State>,
    way: f64,
    doubt: f64,
}

/// Number of steps if no duration is given.
const STEPS: f64 = 600.0;
/// Number of time steps of a study: the step of the file, and halves of it.
const HALVINGS: usize = 5;
/// Steps of the reference in the shortest step of a study.
const FINER: f64 = 8.0;

impl Filed {
    /// The scenes of this project: a planet, the paper's Figures 3 and 4, a flock before its gust, bodies that meet
    /// head-on, and a level with wind, a pool and sleeping crates.
    pub fn all() -> Vec<Filed> {
        let scenes = [
            (
                "planet",
                include_str!("../../../examples/scenes/planet.json"),
                4.0,
            ),
            (
                "Figure 3",
                include_str!("../../../examples/scenes/figure_3.json"),
                4.0,
            ),
            (
                "Figure 4",
                include_str!("../../../examples/scenes/figure_4.json"),
                4.0,
            ),
            (
                "flock",
                include_str!("../../../examples/scenes/flock.json"),
                4.0,
            ),
            (
                "head-on",
                include_str!("../../../examples/scenes/head_on.json"),
                8.0,
            ),
            (
                "level",
                include_str!("../../../examples/scenes/level.json"),
                4.0,
            ),
        ];
        let read = |(name, text, time)| Filed::new(name, text, Some(time));
        let scenes = scenes.map(|it| read(it).expect("scenes that the tests read"));
        scenes.into()
    }

    /// The scene called `name` of a file with content `text`. It simulates `duration`, in the unit of time of the scene
    /// and rounded to whole steps, or 600 steps if that is `None`.
    ///
    /// # Errors
    /// The file is invalid, the name is empty or holds a comma or a line break, or the duration is less than a step.
    pub fn new(name: &str, text: &str, duration: Option<f64>) -> Result<Self, StudyError> {
        let file = SceneFile::from_json(text)?;
        let dt = to_f64(file.build()?.world.integration_parameters.dt);
        let asked = duration.unwrap_or(STEPS * dt);
        let steps = (asked / dt).round();
        if !(dt > 0.0 && steps >= 1.0) || name.is_empty() || name.contains([',', '\n']) {
            let (case, simulated) = (name.to_owned(), asked);
            return Err(StudyError::TimeStep {
                case,
                dt,
                simulated,
            });
        }
        Ok(Filed {
            about: About {
                name: name.to_owned(),
                description: "A scene of a file; against its own run in f64 at an eighth of the shortest step.",
                time_unit: "time unit",
                duration: steps * dt,
                longest: dt,
                halvings: HALVINGS,
                views: vec![(Metric::OwnPosition, 1e-2), (Metric::OwnPosition, 1e-3)],
            },
            text: text.into(),
            file,
            reference: Arc::default(),
        })
    }

    /// Change of the reference by the last halving of its step, relative as errors are: smaller errors are not
    /// significant. Infinite if the reference cannot be run to its end.
    pub fn doubt(&self) -> f64 {
        self.reference().doubt
    }

    fn reference(&self) -> &Reference {
        self.reference.get_or_init(|| {
            let (about, text) = (&self.about, &self.text);
            let twin = crate::double::cases::Filed::new(&about.name, text, Some(about.duration));
            let finest = f64::from(1 << (HALVINGS - 1)) * FINER;
            // Relative to the step of the twin, as the step of the file is rounded to the precision.
            let ends = |parts: f64| match &twin {
                Ok(twin) => twin.ends(parts),
                Err(error) => Err(error.clone()),
            };
            match (ends(finest), ends(0.5 * finest), ends(f64::INFINITY)) {
                (Ok(ends), Ok(coarser), Ok(starts)) => {
                    let way = distance(&ends, &starts);
                    let way = if way > 0.0 { way } else { 1.0 };
                    let doubt = distance(&ends, &coarser) / way;
                    Reference { ends, way, doubt }
                }
                _ => Reference {
                    ends: Vec::new(),
                    way: 1.0,
                    doubt: f64::INFINITY,
                },
            }
        })
    }

    /// Final states by `KickDriftKick` with the step of the file divided by `parts`; the initial states if `parts` is
    /// infinite.
    ///
    /// # Errors
    /// A step fails.
    pub fn ends(&self, parts: f64) -> Result<Vec<State>, StudyError> {
        let (dt, steps) = match parts.is_finite() {
            true => (
                self.about.longest / parts,
                self.steps(self.about.longest / parts)?,
            ),
            false => (self.about.longest, 0),
        };
        let (mut simulation, bodies) = self.simulation(Method::KickDriftKick, dt)?;
        if simulation.advance(steps) < steps {
            return Err(StudyError::Fields(
                "a step of the reference failed".to_owned(),
            ));
        }
        Ok(states(&simulation, &bodies))
    }

    fn simulation(
        &self,
        method: Method,
        dt: f64,
    ) -> Result<(Simulation, Vec<RigidBodyHandle>), StudyError> {
        let Some(scheme) = scheme(method) else {
            let (case, method) = (self.about.name.clone(), method.name());
            return Err(StudyError::Method { case, method });
        };
        let file = self.file.clone().dt(from_f64(dt)).scheme(scheme);
        let mut scene = file.build()?;
        if method.iterates_once() {
            scene.world.integration_parameters.num_solver_iterations = 1;
        }
        let driver = Driver::Fields(Box::new(scene.fields));
        let world = scene.world;
        let moved = |it: &RigidBodyHandle| world.bodies[*it].is_dynamic();
        let bodies = scene.bodies.into_iter().filter(moved).collect();
        Ok((Simulation { world, driver }, bodies))
    }
}

/// Centres of mass and rotations of the bodies.
fn states(simulation: &Simulation, bodies: &[RigidBodyHandle]) -> Vec<State> {
    let state = |handle: &RigidBodyHandle| {
        let body = &simulation.world.bodies[*handle];
        State {
            position: to_dvec3(body.center_of_mass()),
            rotation: to_dpose3(body.position()).rotation,
            ..State::default()
        }
    };
    bodies.iter().map(state).collect()
}

/// Root mean square distance between the positions in `a` and in `b`.
fn distance(a: &[State], b: &[State]) -> f64 {
    let squares = a
        .iter()
        .zip(b)
        .map(|(a, b)| a.position.distance_squared(b.position));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

impl Case for Filed {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn methods(&self) -> &'static [Method] {
        &[
            Method::KickDriftKick,
            Method::KickDriftKickOnce,
            Method::Kick,
            Method::ExternalForce,
            Method::Substep4,
            Method::Forward4,
            Method::LinearlyImplicit,
            Method::Auto,
            Method::AutoTight,
        ]
    }

    fn is_quick(&self) -> bool {
        false
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.steps(dt)?;
        Ok(vec![self.simulation(method, dt)?.0])
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let steps = self.steps(dt)?;
        let (mut simulation, bodies) = self.simulation(method, dt)?;
        let (made, warned) = super::answer::follow(&mut simulation, steps, |_, _| ());
        let (ends, exact) = (states(&simulation, &bodies), self.reference());
        let angles = ends.iter().zip(&exact.ends).map(|(a, b)| a.angle_to(b));
        let mut errors = vec![
            Measured::new(
                Metric::OwnPosition,
                distance(&ends, &exact.ends) / exact.way,
            ),
            Measured::new(Metric::OwnAttitude, angles.fold(0.0, f64::max)),
        ];
        if made < steps || exact.doubt.is_infinite() {
            errors.iter_mut().for_each(|it| it.value = f64::INFINITY);
        }
        Ok(run(&self.about, (method, dt), (made, warned), 0, errors))
    }
}
