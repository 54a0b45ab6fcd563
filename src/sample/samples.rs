//! Where fields are sampled, in the form the evaluators want.

use super::cloud::Clouds;
use super::part_shape::{Attitude, Bulk, PartShape};
use super::point::{Kind, Moment, SamplePoint, UserValues};
use crate::compile::{Weighting, unique};
use crate::field::{Axis, Coupling, ForceMode, Query, Sampling, SamplingRule};
use crate::math::{
    ColliderHandle, DMat3, Pose, Real, RigidBodyHandle, Vector, from_dvec3, from_f64, to_dpose3,
    to_dvec3, to_f64,
};
use crate::rigid::{Body, to_dquat};

/// The samples of one step.
#[derive(Debug, Default)]
pub(crate) struct Samples {
    /// First the sites, one per part; then what parts are sampled at otherwise. Of either, those
    /// of one body stand together. See [`Samples::placed`].
    pub list: Vec<SamplePoint>,
    /// The others once more.
    pub clouds: Clouds,
    /// How many of the list are sites.
    pub sites: usize,
    /// By body, how it stands; empty if none is ever cut or sampled at many points.
    pub attitudes: Vec<Attitude>,
    /// By body, where its parts are; empty if none is ever cut.
    pub bulks: Vec<Bulk>,
    /// By site, what is cut.
    pub shapes: Vec<PartShape>,
    /// By body, what it asks for in place of [`Sampling::Auto`]; empty if none does.
    pub overrides: Vec<Option<Sampling>>,
    /// Second moments, world axes; the first are zero.
    pub spreads: Vec<DMat3>,
    /// What the others are made of: the body, the frame of the collider on it, and the moments
    /// there.
    local_spreads: Vec<(u32, Pose, DMat3)>,
    /// For each body, one sample for it as a whole, at its centre of mass.
    pub centres: Vec<SamplePoint>,
    /// The sampled bodies.
    pub bodies: Vec<RigidBodyHandle>,
    pub user: Vec<UserValues>,
    /// Whether they were put anywhere since they were made.
    pub are_placed: bool,
    /// Whether nobody asks for single samples but for sites.
    pub only_sites: bool,
    /// Whether the list has the parts of every body once more, at its centre of mass.
    pub apart: bool,
    /// Whether the others have been left where they were.
    left: bool,
    /// Another whenever they were made anew: between, all but places and velocities stays.
    pub stamp: u64,
    /// By body, where its sites begin in the list, and its other samples; and where the last ones end.
    starts: [Vec<u32>; 2],
    /// By the index of a collider: the number of its sample.
    by_collider: Vec<u32>,
}

impl Clone for Samples {
    fn clone(&self) -> Self {
        let mut copy = Samples::default();
        copy.clone_from(self);
        copy
    }

    /// In the buffers it has.
    fn clone_from(&mut self, from: &Self) {
        self.sites = from.sites;
        self.are_placed = from.are_placed;
        self.only_sites = from.only_sites;
        self.apart = from.apart;
        self.left = from.left;
        self.stamp = from.stamp;
        self.list.clone_from(&from.list);
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
    /// For bodies whose samples are made elsewhere.
    pub(crate) fn made_elsewhere() -> Self {
        let mut samples = Samples::default();
        samples.clear();
        samples.user.push(Vec::new().into());
        samples
    }

    pub(crate) fn clear(&mut self) {
        self.list.clear();
        self.clouds.clear();
        self.attitudes.clear();
        self.bulks.clear();
        self.shapes.clear();
        self.overrides.clear();
        self.spreads.clear();
        self.spreads.push(DMat3::ZERO);
        self.local_spreads.clear();
        self.sites = 0;
        self.are_placed = false;
        self.only_sites = false;
        self.apart = false;
        self.left = false;
        self.centres.clear();
        self.bodies.clear();
        self.user.clear();
    }

    /// Adds second moments in the frame of a collider; returns their number.
    pub(crate) fn add_spread(&mut self, body: u32, local_pose: Pose, spread: DMat3) -> u32 {
        self.local_spreads.push((body, local_pose, spread));
        self.spreads.push(DMat3::ZERO);
        self.spreads.len() as u32 - 1
    }

    /// Moves the samples that are asked for one by one to where their bodies are, with velocities
    /// (linear and angular) of their own or those given.
    pub(crate) fn place(&mut self, bodies: &[Body], velocities: Option<&[(Vector, Vector)]>) {
        self.are_placed = true;
        self.left = self.only_sites && self.list.len() > self.sites;
        let velocity = |body: usize| match velocities {
            Some(velocities) => velocities[body],
            None => (bodies[body].linvel, bodies[body].angvel),
        };
        for (number, (centre, body)) in self.centres.iter_mut().zip(bodies).enumerate() {
            centre.world_point = body.world_com();
            centre.velocity = velocity(number).0;
        }
        let placed = self.placed().len();
        for sample in &mut self.list[..placed] {
            let number = sample.body as usize;
            let (linvel, angvel) = velocity(number);
            if sample.kind == Kind::Centre {
                // There, whatever turns.
                sample.world_point = self.centres[number].world_point;
                sample.velocity = linvel;
                continue;
            }
            sample.arm = bodies[number].pose.rotation * sample.local_arm;
            sample.world_point = self.centres[number].world_point + sample.arm;
            sample.velocity = linvel + angvel.cross(sample.arm);
        }
        let spreads = self.spreads[1..].iter_mut();
        for (spread, (body, local_pose, local)) in spreads.zip(&self.local_spreads) {
            let pose = bodies[*body as usize].pose * *local_pose;
            let turned = DMat3::from_quat(to_dpose3(&pose).rotation);
            *spread = turned * *local * turned.transpose();
        }
        for (number, (attitude, body)) in self.attitudes.iter_mut().zip(bodies).enumerate() {
            attitude.rotation = to_dquat(body.pose.rotation);
            attitude.angvel = velocity(number).1;
        }
    }

    /// The samples of the list that are where their bodies are: of others [`Samples::at`] tells.
    pub(crate) fn placed(&self) -> &[SamplePoint] {
        match self.left {
            true => &self.list[..self.sites],
            false => &self.list,
        }
    }

    /// A sample, by its number, where its body is.
    pub(crate) fn at(&self, number: usize) -> SamplePoint {
        let sample = self.list[number];
        if number < self.placed().len() {
            return sample;
        }
        let (centre, attitude) = (
            &self.centres[sample.body as usize],
            &self.attitudes[sample.body as usize],
        );
        let arm = match sample.kind {
            Kind::Centre => sample.arm,
            _ => from_dvec3(attitude.rotation * to_dvec3(sample.local_arm)),
        };
        SamplePoint {
            arm,
            world_point: centre.world_point + arm,
            velocity: centre.velocity + attitude.angvel.cross(arm),
            ..sample
        }
    }

    /// Moves those samples that were left to where their bodies are.
    pub(crate) fn place_all(&mut self) {
        for number in self.placed().len()..self.list.len() {
            self.list[number] = self.at(number);
        }
        self.left = false;
    }

    /// Numbers the sites by their colliders, and puts what is no site in columns, once all are there.
    pub(crate) fn number(&mut self) {
        self.stamp = unique();
        self.clouds.fill(self.sites, &self.list[self.sites..]);
        let [sites, others] = &mut self.starts;
        let count = self.bodies.len();
        let (first, last) = self.list.split_at(self.sites);
        note_starts(sites, (0, first), count);
        note_starts(others, (self.sites, last), count);
        self.by_collider.clear();
        for (number, sample) in self.list[..self.sites].iter().enumerate() {
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

    /// The number of a body, if it was sampled.
    pub(crate) fn of_body(&self, body: RigidBodyHandle) -> Option<usize> {
        let index = |handle: &RigidBodyHandle| handle.into_raw_parts().0;
        // Bodies are gathered in the order of their indices.
        let place = self
            .bodies
            .binary_search_by_key(&index(&body), index)
            .ok()?;
        (self.bodies[place] == body).then_some(place)
    }

    /// The samples of a body in the list: its sites, and the others.
    pub(crate) fn of(&self, body: usize) -> [std::ops::Range<usize>; 2] {
        let starts = self.starts.each_ref();
        starts.map(|starts| starts[body] as usize..starts[body + 1] as usize)
    }

    /// How a body is sampled in terms like this.
    pub(crate) fn sampling(&self, how: SamplingRule, body: u32) -> SamplingRule {
        match self.overrides.get(body as usize) {
            Some(Some(own)) if how.overridable => SamplingRule::own(*own),
            _ => how,
        }
    }

    /// Whether a term that is sampled like this asks bodies as a whole.
    pub(crate) fn asks_whole(&self, how: SamplingRule) -> bool {
        how.sampling == Sampling::Centre && !(how.apart && self.apart)
    }

    /// Whether a term that is sampled like this takes a sample.
    pub(crate) fn takes(&self, how: SamplingRule, sample: &SamplePoint) -> bool {
        let how = self.sampling(how, sample.body);
        let kind = match how.points() {
            Some(_) if how.auto && sample.is_ball => Kind::Site,
            Some(points) => Kind::Several(points),
            None if how.sampling == Sampling::Centre => Kind::Centre,
            None => Kind::Site,
        };
        // The whole of a particle is the centre, which is another sample.
        let is_particle = sample.kind == Kind::Particle && kind != Kind::Centre;
        is_particle || kind == sample.kind
    }

    /// Whether a term that is sampled like this takes any samples but sites.
    pub(crate) fn any_cloud(&self, how: SamplingRule) -> bool {
        let mut runs = self.clouds.runs.iter();
        runs.any(|run| self.takes(how, &self.list[run.first as usize]))
    }

    /// The bodies as a whole that a program takes.
    pub(crate) fn centres_for(&self, how: SamplingRule) -> impl Iterator<Item = &SamplePoint> {
        let centres = match self.asks_whole(how) {
            true => &self.centres[..],
            false => &[],
        };
        centres.iter().filter(move |centre| self.takes(how, centre))
    }

    /// The samples of the list that a program takes, with their numbers.
    pub(crate) fn samples_for(
        &self,
        how: SamplingRule,
    ) -> impl Iterator<Item = (usize, &SamplePoint)> {
        let list = match self.takes_listed(how) {
            true => self.placed(),
            false => &[],
        };
        let list = list.iter().enumerate();
        list.filter(move |(_, sample)| self.takes_of_list(how, sample))
    }

    /// Whether a program may take any sample of the list.
    fn takes_listed(&self, how: SamplingRule) -> bool {
        !self.asks_whole(how) || !self.overrides.is_empty()
    }

    /// Whether a program takes a sample of the list.
    pub(crate) fn takes_of_list(&self, how: SamplingRule, sample: &SamplePoint) -> bool {
        // The centres in the list are for terms that ask colliders one by one, there or elsewhere.
        let is_other = self.asks_whole(how) && sample.kind == Kind::Centre;
        self.takes_listed(how) && self.takes(how, sample) && !is_other
    }

    /// The number of a collider's sample, if it has one.
    pub(crate) fn of_collider(&self, collider: ColliderHandle) -> Option<usize> {
        let number = *self.by_collider.get(collider.into_raw_parts().0 as usize)? as usize;
        (self.list.get(number)?.collider == Some(collider)).then_some(number)
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

    /// The number that turns the vector of a field into a force on the sample.
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

    /// The sample's coordinate along an axis; only those that do not depend on the frame of the
    /// field.
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
            // What differs from field to field is no number of the sample.
            _ => Real::NAN,
        }
    }
}

/// Notes where the samples of each body begin, of samples whose numbers begin with `start`; and where
/// the last ones end.
fn note_starts(starts: &mut Vec<u32>, (start, samples): (usize, &[SamplePoint]), bodies: usize) {
    starts.clear();
    for (number, sample) in samples.iter().enumerate() {
        let first = (start + number) as u32;
        starts.resize(starts.len().max(sample.body as usize + 1), first);
    }
    starts.resize(bodies + 1, (start + samples.len()) as u32);
}
