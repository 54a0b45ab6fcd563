//! Cost of features that a scene does not need, each switched on by itself and timed in pairs of runs.

use std::time::Instant;

use super::simulation::{Driver, Simulation};
use super::{Case, PRECISION, fields};
use crate::study::{Ablation, Method, StudyError, quantile};
use fields::math::{DVec3, RigidBodyHandle, to_dvec3};
use fields::{ContactLaw, FaultPolicy, Field, Fields, Sampling};

/// Approximate time of one run of a pair, s.
const TURN: f64 = 0.01;

/// A feature that can be switched on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Switch {
    Nothing,
    CrossCheck,
    Audit,
    TakingBack,
    Volumes,
    Detection,
}

impl Switch {
    const ALL: [Switch; 6] = [
        Switch::Nothing,
        Switch::CrossCheck,
        Switch::Audit,
        Switch::TakingBack,
        Switch::Volumes,
        Switch::Detection,
    ];

    fn name(self) -> &'static str {
        match self {
            Switch::Nothing => "nothing",
            Switch::CrossCheck => "cross-check",
            Switch::Audit => "energy audit",
            Switch::TakingBack => "copies to take a step back",
            Switch::Volumes => "sampling of volumes",
            Switch::Detection => "detection of contacts",
        }
    }

    fn turn_on(self, fields: &mut Fields, world: &fields::rapier::prelude::PhysicsWorld) {
        fields.settings.on_fault = FaultPolicy::LeaveOut;
        match self {
            Switch::Nothing => (),
            Switch::CrossCheck => fields.settings.cross_check = true.into(),
            Switch::Audit => fields.settings.audit = true,
            Switch::TakingBack => fields.settings.on_fault = FaultPolicy::Refuse,
            Switch::Volumes => {
                for (body, _) in world.bodies.iter() {
                    let set = fields.set_sampling(body, Sampling::Volume, &world.bodies);
                    set.expect("a body of the world");
                }
            }
            Switch::Detection => {
                for (part, _) in world.colliders.iter() {
                    let observer = Field::contact(ContactLaw::Observe).at(part);
                    fields.set.insert(observer);
                }
            }
        }
    }
}

/// Cost of each feature in a case that the default scheme moves, from `rounds` pairs of timed runs.
///
/// # Errors
/// The default scheme cannot move the case, or a step fails.
pub fn leave_out(case: &dyn Case, rounds: usize) -> Result<Vec<Ablation>, StudyError> {
    let dt = case.about().longest * 0.25;
    let steps = turns(case, dt)?;
    let mut table = Vec::new();
    for switch in Switch::ALL {
        let (mut plain, mut ratios) = (Vec::new(), Vec::new());
        let mut change = 0.0;
        for round in 0..rounds {
            let mut times = [0.0; 2];
            let mut ends = [Vec::new(), Vec::new()];
            for turn in 0..2 {
                let with = (turn + round) % 2 == 1;
                let which = if with { switch } else { Switch::Nothing };
                (times[usize::from(with)], ends[usize::from(with)]) = go(case, dt, steps, which)?;
            }
            plain.push(times[0] / steps as f64);
            ratios.push(times[1] / times[0]);
            change = apart(&ends);
        }
        plain.sort_unstable_by(f64::total_cmp);
        ratios.sort_unstable_by(f64::total_cmp);
        table.push(Ablation {
            precision: PRECISION,
            case: case.about().name,
            switch: switch.name().to_owned(),
            rounds,
            step: quantile(&plain, 0.5),
            ratios: [0.25, 0.5, 0.75].map(|share| quantile(&ratios, share)),
            change,
        });
    }
    Ok(table)
}

/// Number of steps that take about [`TURN`].
fn turns(case: &dyn Case, dt: f64) -> Result<u64, StudyError> {
    const TRIAL: u64 = 8;
    let (seconds, _) = go(case, dt, TRIAL, Switch::Nothing)?;
    let steps = (TURN * TRIAL as f64 / seconds) as u64;
    Ok(steps.clamp(TRIAL, case.steps(dt)?.max(TRIAL)))
}

/// Time that `steps` steps take, s, and where each body begins and ends.
fn go(
    case: &dyn Case,
    dt: f64,
    steps: u64,
    switch: Switch,
) -> Result<(f64, Vec<[DVec3; 2]>), StudyError> {
    let simulation = case.set_up(Method::KickDriftKick, dt)?.swap_remove(0);
    let Simulation { mut world, driver } = simulation;
    let Driver::Fields(mut fields) = driver else {
        let (case, method) = (case.about().name, Method::KickDriftKick.name());
        return Err(StudyError::Method { case, method });
    };
    switch.turn_on(&mut fields, &world);
    let mut handles: Vec<RigidBodyHandle> = world.bodies.iter().map(|it| it.0).collect();
    handles.sort_unstable_by_key(|it| it.into_raw_parts());
    let places = |world: &fields::rapier::prelude::PhysicsWorld| -> Vec<DVec3> {
        let place = |it: &RigidBodyHandle| to_dvec3(world.bodies[*it].translation());
        handles.iter().map(place).collect()
    };
    let starts = places(&world);
    let clock = Instant::now();
    for _ in 0..steps {
        let step = fields.step(&mut world);
        step.map_err(|error| StudyError::Fields(error.to_string()))?;
    }
    let seconds = clock.elapsed().as_secs_f64();
    let ends = starts.into_iter().zip(places(&world));
    Ok((seconds, ends.map(|(start, end)| [start, end]).collect()))
}

/// Largest distance between ends of a body with and without the feature, relative to the largest displacement without.
fn apart([without, with]: &[Vec<[DVec3; 2]>; 2]) -> f64 {
    let way = without.iter().map(|[start, end]| start.distance(*end));
    let way = way.fold(f64::MIN_POSITIVE, f64::max);
    let pairs = without.iter().zip(with);
    let off = pairs.map(|(a, b)| a[1].distance(b[1]));
    off.fold(0.0, f64::max) / way
}
