//! All samples of a set of bodies, as lists and columns for the evaluators.

use std::ops::Range;

use super::cloud::{BLOCK, BodyPlacement, CloudRun, Clouds, PlacedBlock};
use super::part_shape::{Attitude, Bulk, PartShape};
use super::point::{Kind, Moment, SamplePoint, UserValues};
use crate::compile::{Weighting, unique};
use crate::field::{Axis, Coupling, ForceMode, Query, Sampling, SamplingRule};
use crate::math::{
    ColliderHandle, DMat3, DQuat, Real, RigidBodyHandle, from_f64, to_dquat, to_dvec3, to_f64,
};
use crate::rigid::Body;

/// The samples of the bodies in one evaluation.
#[derive(Debug, Default)]
pub(crate) struct Samples {
    /// One sample for each part; those of one body are neighbours.
    pub sites: Vec<SamplePoint>,
    /// The other samples of parts: several points, or the centre of mass of the body.
    pub clouds: Clouds,
    /// The attitude of each body; empty if no body is cut or sampled at several points.
    pub attitudes: Vec<Attitude>,
    /// The size of each body; empty if no body is cut.
    pub bulks: Vec<Bulk>,
    /// The shape of each site; empty if no body is cut.
    pub shapes: Vec<PartShape>,
    /// The sampling that was set for each body in place of [`Sampling::Auto`]; empty if none was set.
    pub overrides: Vec<Option<Sampling>>,
    /// Second moments, in world axes; the first entry is zero.
    pub spreads: Vec<DMat3>,
    /// The data of the other entries.
    local_spreads: Vec<LocalSpread>,
    /// For each body, one sample of it as a whole, at its centre of mass.
    pub centres: Vec<SamplePoint>,
    /// The sampled bodies.
    pub bodies: Vec<RigidBodyHandle>,
    pub user: Vec<UserValues>,
    /// True if the samples have been placed since they were made.
    pub are_placed: bool,
    /// True if each part has a second sample, at the centre of mass of its body.
    pub apart: bool,
    /// Changes whenever the samples are made anew. In between, only places and velocities change.
    pub stamp: u64,
    /// For each body, the start of its sites, and of its runs; then the end of all.
    starts: [Vec<u32>; 2],
    /// By the index of a collider: the number of its site, or `u32::MAX`.
    by_collider: Vec<u32>,
}

/// Second moments of the pieces of a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalSpread {
    /// The number of the body.
    pub body: u32,
    /// The rotation of the collider on the body.
    pub rotation: DQuat,
    /// In the collider's frame.
    pub moments: DMat3,
}

impl Clone for Samples {
    fn clone(&self) -> Self {
        let mut copy = Samples::default();
        copy.clone_from(self);
        copy
    }

    /// Reuses the buffers.
    fn clone_from(&mut self, from: &Self) {
        self.are_placed = from.are_placed;
        self.apart = from.apart;
        self.stamp = from.stamp;
        self.sites.clone_from(&from.sites);
        self.clouds.clone_from(&from.clouds);
        self.attitudes.clone_from(&from.attitudes);
        self.bulks.clone_from(&from.bulks);
        self.shapes.clone_from(&from.shapes);
        self.overrides.clone_from(&from.overrides);
        self.spreads.clone_from(&from.spreads);
        self.local_spreads.clone_from(&from.local_spreads);
        self.centres.clone_from(&from.centres);
        self.bodies.clone_from(&from.bodies);
        self.user.clone_from(&from.user);
        self.starts.clone_from(&from.starts);
        self.by_collider.clone_from(&from.by_collider);
    }
}

impl Samples {
    /// No samples, for bodies whose samples are made elsewhere.
    pub(crate) fn made_elsewhere() -> Self {
        let mut samples = Samples::default();
        samples.clear();
        samples.user.push(Vec::new().into());
        samples
    }

    pub(crate) fn clear(&mut self) {
        self.sites.clear();
        self.clouds.clear();
        self.attitudes.clear();
        self.bulks.clear();
        self.shapes.clear();
        self.overrides.clear();
        self.spreads.clear();
        self.spreads.push(DMat3::ZERO);
        self.local_spreads.clear();
        self.are_placed = false;
        self.apart = false;
        self.centres.clear();
        self.bodies.clear();
        self.user.clear();
    }

    /// Adds second moments; returns their number.
    pub(super) fn add_spread(&mut self, local: LocalSpread) -> u32 {
        self.local_spreads.push(local);
        self.spreads.push(DMat3::ZERO);
        self.spreads.len() as u32 - 1
    }

    /// Adds a run of other samples, as one of the body with this number.
    pub(crate) fn take_run(&mut self, run: &CloudRun, from: &Samples, body: u32) {
        let spread = run.whole.spread.checked_sub(1).map_or(0, |place| {
            let local = from.local_spreads[place as usize];
            self.add_spread(LocalSpread { body, ..local })
        });
        let whole = SamplePoint {
            body,
            spread,
            ..run.whole
        };
        self.clouds.take(run, &from.clouds, whole);
    }

    /// Turns the second moments of pieces with their bodies, whose rotations `attitude` returns.
    pub(crate) fn turn_spreads(&mut self, attitude: impl Fn(usize) -> DQuat) {
        let spreads = self.spreads[1..].iter_mut();
        for (spread, local) in spreads.zip(&self.local_spreads) {
            let turned = DMat3::from_quat(attitude(local.body as usize) * local.rotation);
            *spread = turned * local.moments * turned.transpose();
        }
    }

    /// Sets the places and velocities of the samples from the poses and velocities of their bodies.
    pub(crate) fn place(&mut self, bodies: &[Body]) {
        self.are_placed = true;
        for (centre, body) in self.centres.iter_mut().zip(bodies) {
            centre.world_point = body.world_com();
            centre.velocity = body.linvel;
        }
        for sample in &mut self.sites {
            let number = sample.body as usize;
            let body = &bodies[number];
            sample.arm = body.pose.rotation * sample.local_arm;
            sample.world_point = self.centres[number].world_point + sample.arm;
            sample.velocity = body.linvel + body.angvel.cross(sample.arm);
        }
        self.turn_spreads(|body| to_dquat(bodies[body].pose.rotation));
        for (attitude, body) in self.attitudes.iter_mut().zip(bodies) {
            attitude.rotation = to_dquat(body.pose.rotation);
            attitude.angvel = body.angvel;
        }
    }

    /// The samples of a block of the clouds, placed where their body is.
    #[inline(always)]
    pub(crate) fn block(&self, block: u32) -> PlacedBlock<'_> {
        let run = self.clouds.run_of(block);
        let body = run.whole.body as usize;
        let (centre, attitude) = (&self.centres[body], &self.attitudes[body]);
        let turned = DMat3::from_quat(attitude.rotation);
        let placement = BodyPlacement {
            centre: centre.world_point,
            linvel: centre.velocity,
            angvel: attitude.angvel,
            axes: [turned.x_axis, turned.y_axis, turned.z_axis],
        };
        self.clouds.placed(run, block, &placement)
    }

    /// A bound of the distance of a run's samples from the centre of mass of its body, rounding of places included.
    pub(crate) fn extent_of(&self, run: &CloudRun) -> Real {
        let centre = self.centres[run.whole.body as usize].world_point;
        run.extent() + centre.abs().max_element() * Real::EPSILON
    }

    /// The samples of a run, placed where their body is.
    pub(crate) fn of_run(&self, run: &CloudRun) -> impl Iterator<Item = SamplePoint> + Clone {
        run.blocks().flat_map(|block| {
            let placed = self.block(block);
            let samples: [_; BLOCK] = std::array::from_fn(|lane| placed.sample(lane));
            samples.into_iter().take(placed.count)
        })
    }

    /// Sets the stamp, the numbers by collider, and the starts of bodies, after all samples were added.
    pub(crate) fn number(&mut self) {
        self.stamp = unique();
        let [sites, runs] = &mut self.starts;
        let count = self.bodies.len();
        note_starts(sites, self.sites.iter().map(|it| it.body), count);
        let of_runs = self.clouds.runs.iter().map(|run| run.whole.body);
        note_starts(runs, of_runs, count);
        self.by_collider.clear();
        for (number, sample) in self.sites.iter().enumerate() {
            let Some(collider) = sample.collider else {
                continue;
            };
            let index = collider.into_raw_parts().0 as usize;
            if self.by_collider.len() <= index {
                self.by_collider.resize(index + 1, u32::MAX);
            }
            self.by_collider[index] = number as u32;
        }
    }

    /// The number of a body among the sampled ones.
    pub(crate) fn of_body(&self, body: RigidBodyHandle) -> Option<usize> {
        let index = |handle: &RigidBodyHandle| handle.into_raw_parts().0;
        // Bodies are gathered in the order of their indices.
        let place = self
            .bodies
            .binary_search_by_key(&index(&body), index)
            .ok()?;
        (self.bodies[place] == body).then_some(place)
    }

    /// The numbers of a body's sites.
    pub(crate) fn sites_of(&self, body: usize) -> Range<usize> {
        let starts = &self.starts[0];
        starts[body] as usize..starts[body + 1] as usize
    }

    /// The runs of a body.
    pub(crate) fn runs_of(&self, body: usize) -> &[CloudRun] {
        let starts = &self.starts[1];
        &self.clouds.runs[starts[body] as usize..starts[body + 1] as usize]
    }

    /// All samples of a body but its centre.
    pub(crate) fn each_of(&self, body: usize) -> impl Iterator<Item = SamplePoint> + Clone {
        let sites = self.sites[self.sites_of(body)].iter().copied();
        let runs = self.runs_of(body).iter();
        sites.chain(runs.flat_map(|run| self.of_run(run)))
    }

    /// The sampling of a body in terms with this rule.
    pub(crate) fn sampling(&self, rule: SamplingRule, body: u32) -> SamplingRule {
        match self.overrides.get(body as usize) {
            Some(Some(own)) if rule.overridable => SamplingRule::own(*own),
            _ => rule,
        }
    }

    /// Returns true if terms with this rule sample bodies as a whole.
    pub(crate) fn asks_whole(&self, rule: SamplingRule) -> bool {
        rule.sampling == Sampling::Centre && !(rule.apart && self.apart)
    }

    /// Returns true if a term with this rule is sampled at `sample`.
    pub(crate) fn takes(&self, rule: SamplingRule, sample: &SamplePoint) -> bool {
        let rule = self.sampling(rule, sample.body);
        let kind = match rule.points() {
            Some(_) if rule.auto && sample.is_ball => Kind::Site,
            Some(points) => Kind::Several(points),
            None if rule.sampling == Sampling::Centre => Kind::Centre,
            None => Kind::Site,
        };
        // For terms at centres of mass a particle has another sample, in `centres`.
        let is_particle = sample.kind == Kind::Particle && kind != Kind::Centre;
        is_particle || kind == sample.kind
    }

    /// Returns true if a term with this rule is sampled at any samples of clouds.
    pub(crate) fn any_cloud(&self, rule: SamplingRule) -> bool {
        let mut runs = self.clouds.runs.iter();
        runs.any(|run| self.takes(rule, &run.whole))
    }

    /// The samples of bodies as a whole at which a program is sampled.
    pub(crate) fn centres_for(&self, rule: SamplingRule) -> impl Iterator<Item = &SamplePoint> {
        let whole = self.asks_whole(rule);
        let centres = if whole { &self.centres[..] } else { &[] };
        centres
            .iter()
            .filter(move |centre| self.takes(rule, centre))
    }

    /// The sites at which a program is sampled on bodies that it does not cut, with their numbers.
    pub(crate) fn uncut_sites_for(
        &self,
        rule: SamplingRule,
    ) -> impl Iterator<Item = (usize, &SamplePoint)> {
        let sites = self.sites.iter().enumerate();
        sites.filter(move |(_, site)| self.takes_uncut(rule, site))
    }

    /// Returns true if a program is sampled at a site or a run, on a body that it does not cut.
    pub(crate) fn takes_uncut(&self, rule: SamplingRule, part: &SamplePoint) -> bool {
        self.takes_part(rule, part) && self.cut(rule, part.body).is_none()
    }

    /// The runs at which a program is sampled on bodies that it does not cut, with their numbers.
    pub(crate) fn uncut_runs_for(
        &self,
        rule: SamplingRule,
    ) -> impl Iterator<Item = (u32, &CloudRun)> {
        let runs = (0..).zip(&self.clouds.runs);
        runs.filter(move |(_, run)| self.takes_uncut(rule, &run.whole))
    }

    /// Returns true if a program is sampled at a site or a run.
    pub(crate) fn takes_part(&self, rule: SamplingRule, part: &SamplePoint) -> bool {
        // Parts are sampled at the centre of mass for terms that sample colliders one by one.
        let is_other = self.asks_whole(rule) && part.kind == Kind::Centre;
        self.takes(rule, part) && !is_other
    }

    /// The number of a collider's site, if it has one.
    pub(crate) fn of_collider(&self, collider: ColliderHandle) -> Option<usize> {
        let number = *self.by_collider.get(collider.into_raw_parts().0 as usize)? as usize;
        (self.sites.get(number)?.collider == Some(collider)).then_some(number)
    }

    pub(crate) fn query(&self, sample: &SamplePoint, moment: Moment) -> Query {
        Query {
            world_point: to_dvec3(sample.world_point),
            world_velocity: to_dvec3(sample.velocity),
            time: moment.time,
            dt: to_f64(moment.dt),
            step: Some([moment.span.start, moment.span.end]),
            fraction: to_f64(sample.fraction),
            spread: self.spreads[sample.spread as usize],
            radius: to_f64(sample.radius),
            mass: to_f64(sample.mass),
            share: to_f64(sample.share),
            charge: to_f64(sample.charge),
            volume: to_f64(sample.volume),
            groups: sample.groups,
            user: self.user[sample.user as usize].clone(),
            body: Some(self.bodies[sample.body as usize]),
            touches: Vec::new(),
        }
    }

    /// The factor by which the vector of a field is multiplied to give the force on a sample.
    pub(crate) fn weight(
        &self,
        sample: &SamplePoint,
        weighting: &Weighting,
        moment: Moment,
    ) -> Real {
        if weighting
            .groups
            .is_some_and(|groups| !groups.test(sample.groups))
        {
            return 0.0;
        }
        let coupled = match &weighting.coupling {
            Coupling::Axis(axis) => self.axis(sample, axis, moment),
            Coupling::Share if weighting.mode == ForceMode::Force => sample.share,
            Coupling::Share | Coupling::Each => 1.0,
        };
        let whole = match weighting.mode {
            ForceMode::Force => coupled,
            ForceMode::Acceleration => coupled * sample.mass,
            ForceMode::VelocityChange => coupled * sample.mass / moment.dt,
        };
        whole * sample.fraction * from_f64(weighting.lifetime().share_of(moment.span))
    }

    /// The sample's coordinate along an axis that does not depend on the field's frame; NaN for other axes, and
    /// for user axes without a value.
    fn axis(&self, sample: &SamplePoint, axis: &Axis, moment: Moment) -> Real {
        match axis {
            Axis::Charge => sample.charge,
            Axis::Mass => sample.mass,
            Axis::Radius => sample.radius,
            Axis::Time => from_f64(moment.time),
            Axis::User(name) => {
                let values = self.user[sample.user as usize].iter();
                let found = values.clone().find(|(known, _)| known == name);
                found.map_or(Real::NAN, |(_, value)| from_f64(*value))
            }
            // A coordinate that depends on the field is not a property of the sample.
            _ => Real::NAN,
        }
    }
}

/// Sets the start of the entries of each body, given the bodies of all entries, and then the end of all.
fn note_starts(starts: &mut Vec<u32>, entries: impl Iterator<Item = u32>, bodies: usize) {
    starts.clear();
    let mut end = 0;
    for body in entries {
        starts.resize(starts.len().max(body as usize + 1), end);
        end += 1;
    }
    starts.resize(bodies + 1, end);
}
