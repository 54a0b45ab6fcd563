//! The samples of the bodies that are moved together, at their present poses.

use crate::eval::{Evaluator, Lineariser};
use crate::integrate::coupling::{ExternalTerms, LinearisedWrench};
use crate::math::{DQuat, DVec3, RigidBodyHandle, from_dvec3, to_dvec3};
use crate::rapier::na::Vector6;
use crate::rigid::{Mobility, RigidState, Wrench};
use crate::sample::{SamplePoint, Samples};

/// The samples and wrenches of the bodies that are moved; its buffers are reused.
#[derive(Default)]
pub(super) struct Group {
    /// The samples of the moved bodies, in the order of their states.
    pub samples: Samples,
    pub wrenches: Vec<Wrench>,
    /// The kick of each body, where forces read velocities.
    pub solutions: Vec<Solution>,
    /// The bodies with contributions left out in the last evaluation, in order.
    pub left_out: Vec<usize>,
    /// The poses to restore after wrenches were taken at shifted ones.
    pub poses: Vec<(DVec3, DQuat)>,
    /// The bodies that were linearised last, and the squares of their frequencies.
    pub found: Vec<(usize, f64)>,
    pub evaluator: Evaluator,
    pub lineariser: Lineariser,
}

/// A kick of a body for forces that read velocities.
pub(super) struct Solution {
    /// About the velocities at the start of the kick.
    pub coupling: LinearisedWrench,
    pub mobility: Mobility,
    /// The other causes of motion, at the start.
    pub external: ExternalTerms,
    /// The mean over the kick of all forces, or the forces in the middle of it.
    pub wrench: Vector6<f64>,
    /// The velocities in the middle of the kick.
    pub velocities: (DVec3, DVec3),
    /// The square of the highest frequency of vibrations; `None` unless it is needed.
    pub omega2: Option<f64>,
}

impl Group {
    /// Removes all bodies, and takes over the settings of the samples.
    pub fn begin(&mut self, samples: &Samples) {
        self.wrenches.clear();
        self.samples.clear();
        self.samples.apart = samples.apart;
        self.samples.user.clone_from(&samples.user);
    }

    /// Adds a body with its samples.
    pub fn take(&mut self, handle: RigidBodyHandle, place: usize, all: &Samples) {
        let body = self.samples.bodies.len() as u32;
        let sites = all.sites_of(place);
        let own = &mut self.samples;
        let moved = |sample: &SamplePoint| SamplePoint { body, ..*sample };
        own.attitudes.extend(all.attitudes.get(place));
        own.bulks.extend(all.bulks.get(place));
        if let Some(shapes) = all.shapes.get(sites.clone()) {
            own.shapes.extend_from_slice(shapes);
        }
        own.sites.extend(all.sites[sites].iter().map(moved));
        for run in all.runs_of(place) {
            own.take_run(run, all, body);
        }
        own.centres.push(moved(&all.centres[place]));
        own.overrides.extend(all.overrides.get(place));
        own.bodies.push(handle);
    }

    /// Moves the samples to the present poses of their bodies, with velocities of the middle of the kick if `midway`.
    pub fn place(&mut self, states: &[RigidState], midway: bool) {
        let solutions = midway.then_some(&self.solutions);
        let velocity = |body: usize, state: &RigidState| {
            solutions.map_or((state.linvel, state.angvel), |all| all[body].velocities)
        };
        for sample in &mut self.samples.sites {
            let state = &states[sample.body as usize];
            let (linvel, angvel) = velocity(sample.body as usize, state);
            let arm = state.attitude * to_dvec3(sample.local_arm);
            sample.arm = from_dvec3(arm);
            sample.world_point = from_dvec3(state.position + arm);
            sample.velocity = from_dvec3(linvel + angvel.cross(arm));
        }
        self.samples.turn_spreads(|body| states[body].attitude);
        for (body, attitude) in self.samples.attitudes.iter_mut().enumerate() {
            let state = &states[body];
            attitude.rotation = state.attitude;
            attitude.angvel = from_dvec3(velocity(body, state).1);
        }
        for (body, centre) in self.samples.centres.iter_mut().enumerate() {
            let state = &states[body];
            centre.world_point = from_dvec3(state.position);
            centre.velocity = from_dvec3(velocity(body, state).0);
        }
    }
}
