//! A flock in a gust, the paper's example (§1): birds that avoid one another, hold together and follow a path, until a
//! strong wind makes them collide.
//!
//! Around each bird there is an attraction, replaced by a repulsion (avoidance) at short distance, and a contact field
//! for collisions. The gust blows for a while, and only on one side of the path: it drives the birds on that side into
//! those on the other.

use super::fields;
use crate::random::Random;
use fields::math::{
    ColliderHandle, DVec3, Real, RigidBodyHandle, Vector, from_dvec3, to_dvec3, to_f64,
};
use fields::rapier::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder};
use fields::{Axis, ContactLaw, Field, Operator, Region, Scalar, Tree, field::Path};

use super::{SceneError, check_count, check_range, empty_world};

/// Radius of a bird, of mass 1.
pub const RADIUS: Real = 0.25;

/// Distance below which birds avoid one another.
const PERSONAL_SPACE: Real = 1.6;
/// Distance below which birds attract one another.
const SIGHT: Real = 6.0;
/// Force of avoidance between two birds that touch.
const AVOIDANCE: Real = 6.0;
/// Force of cohesion, at the edge of the personal space.
const COHESION: Real = 0.15;
/// Damping, force per velocity, that keeps a bird at the speed of the flock.
const PACE: Real = 1.5;

/// Settings of a flock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlockSettings {
    /// Number of birds.
    pub count: usize,
    /// Speed of flight along the path.
    pub speed: Real,
    /// Speed of the gust, across the path.
    pub gust: Real,
    /// Time at which the gust begins.
    pub gust_start: Real,
    /// Duration of the gust.
    pub gust_length: Real,
    /// Time step.
    pub dt: Real,
    /// Seed of the positions.
    pub seed: u64,
}

impl Default for FlockSettings {
    /// 40 birds at speed 3; from time 8, for 1.5, a gust of speed 25.
    fn default() -> Self {
        Self {
            count: 40,
            speed: 3.0,
            gust: 25.0,
            gust_start: 8.0,
            gust_length: 1.5,
            dt: 1.0 / 120.0,
            seed: 1,
        }
    }
}

/// A flock in flight.
pub struct Flock {
    /// The physics world, without gravity.
    pub world: PhysicsWorld,
    /// Avoidance, cohesion, path, gust and detection: one tree.
    pub tree: Tree,
    /// The body and the collider of each bird.
    pub birds: Vec<(RigidBodyHandle, ColliderHandle)>,
}

impl FlockSettings {
    /// Builds the flock, at random positions around the start of the path and with its speed.
    ///
    /// # Errors
    /// A setting is out of range, or random draws find no place for a bird.
    pub fn build(&self) -> Result<Flock, SceneError> {
        check_count(self.count)?;
        check_range("speed", self.speed, 0.0, 1e3)?;
        check_range("gust", self.gust, 0.0, 1e3)?;
        check_range("gust_start", self.gust_start, 0.0, 1e6)?;
        check_range("gust_length", self.gust_length, 0.0, 1e6)?;
        check_range("dt", self.dt, 1e-6, 1.0)?;
        let mut world = empty_world(self.dt);
        let birds: Vec<_> = self
            .places()?
            .into_iter()
            .map(|place| {
                let body = RigidBodyBuilder::dynamic()
                    .translation(from_dvec3(place))
                    .linvel(Vector::X * self.speed)
                    .can_sleep(false);
                world.insert(body, ColliderBuilder::ball(RADIUS).mass(1.0))
            })
            .collect();
        let tree = self.tree(&birds);
        Ok(Flock { world, tree, birds })
    }

    /// Random positions in a ball, no two closer than the personal space.
    fn places(&self) -> Result<Vec<DVec3>, SceneError> {
        const ATTEMPTS: usize = 1000;
        let apart = to_f64(PERSONAL_SPACE);
        let radius = apart * (self.count as f64).cbrt();
        let mut random = Random::new(self.seed);
        let mut places: Vec<DVec3> = Vec::new();
        for index in 0..self.count {
            let free = |place: &DVec3| places.iter().all(|other| place.distance(*other) > apart);
            let mut draw = || random.unit_vector() * (radius * random.uniform().cbrt());
            let place = (0..ATTEMPTS).map(|_| draw()).find(free);
            places.push(place.ok_or(SceneError::Crowded {
                index,
                count: self.count,
                attempts: ATTEMPTS,
                setting: "count",
                value: self.count as Real,
            })?);
        }
        Ok(places)
    }

    fn tree(&self, birds: &[(RigidBodyHandle, ColliderHandle)]) -> Tree {
        let path = Path::new([-Vector::X * 1e3, Vector::X * 1e3], false)
            .stiffness(0.2)
            .damping(PACE, self.speed);
        let flight = Tree::instances(social(), birds.iter().map(|(body, _)| *body))
            .sum_union(Field::path(path).named("path"))
            .sum_union(self.gust_field());
        let law = ContactLaw::restitution(0.5);
        let contact = |(_, collider): &(_, ColliderHandle)| Field::contact(law).at(*collider);
        let detection = Tree::fold(Operator::SumUnion, birds.iter().map(contact));
        flight.sum_union(detection)
    }

    /// A wind across the path, towards −z, in the half space z > 0 during the gust.
    fn gust_field(&self) -> Field {
        let end = self.gust_start + self.gust_length;
        let blows = Region::interval(Axis::Time, self.gust_start, end);
        let windward = Region::half_space(-Vector::Z, 0.0);
        Field::wind(Vector::X * self.speed - Vector::Z * self.gust, 1.0, 0.0)
            .within(blows.intersection(windward))
            .named("gust")
    }
}

/// The forces between birds: the composite of the paper's Figure 3.
fn social() -> Tree {
    let nearness = Scalar::distance().ramp(PERSONAL_SPACE, 2.0 * RADIUS);
    let avoidance = Field::radial(AVOIDANCE, 0.0)
        .within(Region::ball(PERSONAL_SPACE))
        .scaled_by(nearness);
    let cohesion = Field::radial(-COHESION, 0.0)
        .within(Region::ball(SIGHT))
        .scaled_by(Scalar::distance().ramp(SIGHT, PERSONAL_SPACE));
    let cohesion = cohesion.named("cohesion");
    cohesion.replace_union(avoidance.named("avoidance"))
}

impl Flock {
    /// Positions of the birds.
    pub fn places(&self) -> Vec<DVec3> {
        let place =
            |(body, _): &(RigidBodyHandle, _)| to_dvec3(self.world.bodies[*body].translation());
        self.birds.iter().map(place).collect()
    }

    /// The least distance between the surfaces of two birds; negative if they overlap.
    pub fn nearest_gap(&self) -> f64 {
        let places = self.places();
        let mut nearest = f64::INFINITY;
        for (k, place) in places.iter().enumerate() {
            let distances = places[..k].iter().map(|other| place.distance(*other));
            nearest = distances.fold(nearest, f64::min);
        }
        nearest - 2.0 * to_f64(RADIUS)
    }

    /// Root mean square distance of the birds from their centre.
    pub fn spread(&self) -> f64 {
        let places = self.places();
        let count = places.len() as f64;
        let middle = places.iter().sum::<DVec3>() / count;
        let squares = places.iter().map(|place| place.distance_squared(middle));
        (squares.sum::<f64>() / count).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::Fields;

    /// Contacts before the gust, from then until 2 after it, and in the 8 that follow; the smallest gap before the
    /// gust; and the ratio of the final spread to that before the gust.
    fn run(seed: u64) -> ([usize; 3], f64, f64) {
        let settings = FlockSettings {
            seed,
            ..Default::default()
        };
        let mut flock = settings.build().unwrap();
        let mut fields = Fields::new(flock.tree.clone()).unwrap();
        let start = to_f64(settings.gust_start);
        let end = start + to_f64(settings.gust_length);
        let (mut contacts, mut gap, mut spread) = ([0; 3], f64::INFINITY, 0.0);
        while fields.time() < end + 10.0 {
            let found = fields.step(&mut flock.world).unwrap().contacts;
            let time = fields.time();
            // Birds may still be approaching each other when the gust ends.
            let phase = usize::from(time > start) + usize::from(time > end + 2.0);
            contacts[phase] += found;
            if phase == 0 {
                gap = gap.min(flock.nearest_gap());
                spread = flock.spread();
            }
        }
        (contacts, gap, flock.spread() / spread)
    }

    #[test]
    fn birds_collide_in_the_gust_only_and_regroup_after_it() {
        for seed in 1..=3 {
            let ([before, during, after], gap, ratio) = run(seed);
            assert_eq!(before, 0, "seed {seed}");
            assert!(gap > 0.0, "seed {seed}: {gap}");
            assert!(during > 0, "seed {seed}");
            assert_eq!(after, 0, "seed {seed}");
            let as_before = (0.8..1.25).contains(&ratio);
            assert!(as_before, "seed {seed}: {ratio} times as wide as before");
        }
    }

    #[test]
    fn birds_do_not_collide_without_the_gust() {
        let settings = FlockSettings {
            gust: 0.0,
            ..Default::default()
        };
        let mut flock = settings.build().unwrap();
        let mut fields = Fields::new(flock.tree.clone()).unwrap();
        for _ in 0..1200 {
            assert_eq!(fields.step(&mut flock.world).unwrap().contacts, 0);
        }
    }

    #[test]
    fn bad_settings_are_errors() {
        let settings = FlockSettings {
            count: 0,
            ..Default::default()
        };
        assert!(settings.build().is_err());
    }
}
