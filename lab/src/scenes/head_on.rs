//! Bodies driven towards each other's positions: two head-on, or four at a crossing.
//!
//! With repulsion alone, bodies in exact symmetry come to rest where drive and repulsion balance. The cross product of
//! the repulsion with the vertical pushes every body to its own right, so that they pass.

use super::fields;
use crate::random::Random;
use fields::math::{DVec3, InteractionGroups, Real, RigidBodyHandle, Vector, to_dvec3};
use fields::rapier::geometry::Group;
use fields::rapier::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder};
use fields::{Axis, Field, Operator, Region, Scalar, Tree};

use super::{SceneError, check_range, empty_world};

/// Radius of a body.
pub const RADIUS: Real = 0.3;

/// Distance within which a body pushes others away.
const REACH: Real = 2.0;
/// Force of the repulsion where two bodies touch.
const REPULSION: Real = 8.0;
/// Largest force of the drive towards the goal, and the force per velocity that opposes it: they
/// give a cruising speed of 1.
const DRIVE: Real = 2.0;
const DRAG: Real = 2.0;

/// Two bodies head-on, or four at a crossing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meeting {
    /// Two, head-on.
    Pair,
    /// Four, at a crossing.
    Crossing,
}

/// The field that keeps bodies apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Avoidance {
    /// A repulsion along the line of centres.
    Repulsion,
    /// The same, plus its cross product with the vertical while two approach each other.
    WithCross,
}

/// Settings of a meeting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadOnSettings {
    /// Two bodies head-on, or four at a crossing.
    pub meeting: Meeting,
    /// The field that keeps bodies apart.
    pub avoidance: Avoidance,
    /// Distance of starts and goals from the middle.
    pub distance: Real,
    /// Standard deviation of each coordinate of the starts; zero is exact symmetry.
    pub spread: Real,
    /// Seed of the starts.
    pub seed: u64,
    /// Time step.
    pub dt: Real,
}

impl Default for HeadOnSettings {
    /// An exactly symmetric pair, with the cross product, in steps of 1/60.
    fn default() -> Self {
        Self {
            meeting: Meeting::Pair,
            avoidance: Avoidance::WithCross,
            distance: 5.0,
            spread: 0.0,
            seed: 1,
            dt: 1.0 / 60.0,
        }
    }
}

/// A meeting, in the plane of x and z.
pub struct HeadOn {
    /// The physics world, without gravity. Rapier finds no contacts, so that bodies can overlap.
    pub world: PhysicsWorld,
    /// The drives and the avoidance.
    pub tree: Tree,
    /// The bodies.
    pub bodies: Vec<RigidBodyHandle>,
    /// The goal of each body.
    pub goals: Vec<Vector>,
    /// The fields on a body without others: a drive to its goal, and drag.
    drives: Tree,
}

impl HeadOnSettings {
    /// Builds the meeting.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn build(&self) -> Result<HeadOn, SceneError> {
        check_range("distance", self.distance, REACH, 1e3)?;
        check_range("spread", self.spread, 0.0, 1.0)?;
        check_range("dt", self.dt, 1e-6, 1.0)?;
        let directions = [Vector::X, -Vector::X, Vector::Z, -Vector::Z];
        let directions = match self.meeting {
            Meeting::Pair => &directions[..2],
            Meeting::Crossing => &directions[..],
        };
        let mut random = Random::new(self.seed);
        let mut scene = HeadOn {
            world: empty_world(self.dt),
            tree: Tree::empty(),
            drives: Tree::empty(),
            bodies: Vec::new(),
            goals: Vec::new(),
        };
        let mut drives = Vec::new();
        for (number, direction) in directions.iter().enumerate() {
            let mut aside = || random.normal() as Real * self.spread;
            let start = *direction * -self.distance + Vector::new(aside(), 0.0, aside());
            let goal = *direction * self.distance;
            let own = Group::from_bits_truncate(1 << number);
            let groups = InteractionGroups {
                memberships: own,
                filter: own,
                ..InteractionGroups::all()
            };
            scene.bodies.push(insert(&mut scene.world, start, groups));
            scene.goals.push(goal);
            let drive = Field::spring(2.0 * DRIVE).limited_to(DRIVE).at(goal);
            drives.push(drive.groups(groups).named("drive"));
        }
        let drag = Field::drag(DRAG, 0.0).named("drag");
        scene.drives = Tree::fold(Operator::SumUnion, drives).sum_union(drag);
        scene.tree = scene.with(self.avoidance.tree());
        Ok(scene)
    }
}

fn repulsion() -> Field {
    let softly = Scalar::distance().ramp(REACH, 2.0 * RADIUS);
    Field::radial(REPULSION, 0.0)
        .within(Region::ball(REACH))
        .scaled_by(softly)
        .named("repulsion")
}

impl Avoidance {
    /// The field around one body.
    fn tree(self) -> Tree {
        let repulsion = repulsion();
        match self {
            Avoidance::Repulsion => repulsion.into(),
            Avoidance::WithCross => {
                // A region of positions and velocities: samples that come nearer.
                let approaching = Region::predicate([Axis::Speed], |sample| {
                    sample.local_velocity.dot(sample.local_point) < 0.0
                });
                passing(Field::uniform(Vector::Y).within(approaching), repulsion)
            }
        }
    }
}

/// A repulsion and, where the vertical is defined, a push to the right.
fn passing(vertical: Field, repulsion: Field) -> Tree {
    // For a body that faces the field's origin, ŷ × repulsion points to its right.
    let vertical = vertical.named("vertical");
    repulsion
        .clone()
        .sum_union(vertical.cross_intersection(repulsion))
}

fn insert(world: &mut PhysicsWorld, place: Vector, groups: InteractionGroups) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic()
        .translation(place)
        .lock_rotations()
        .can_sleep(false);
    let ball = ColliderBuilder::ball(RADIUS)
        .mass(1.0)
        .collision_groups(groups);
    world.insert(body, ball).0
}

impl HeadOn {
    fn with(&self, avoidance: Tree) -> Tree {
        let bodies = self.bodies.iter().copied();
        Tree::instances(avoidance, bodies).sum_union(self.drives.clone())
    }

    /// The tree of [`Avoidance::WithCross`], as plain data: instead of the predicate that tests for approach, the
    /// vertical is an expression, one during approach and zero otherwise. Unlike the other tree, it can be stored in a
    /// file.
    pub fn tree_as_text(&self) -> Tree {
        let vertical = Field::expression(["0", "x*vx + y*vy + z*vz < 0", "0"]);
        self.with(passing(vertical, repulsion()))
    }

    /// Whether all bodies are within half a length unit of their goals.
    pub fn is_over(&self) -> bool {
        let near = |(body, goal): (&RigidBodyHandle, &Vector)| {
            let place = self.world.bodies[*body].translation();
            (place - *goal).length() < 0.5
        };
        self.bodies.iter().zip(&self.goals).all(near)
    }

    /// Positions of the bodies.
    pub fn places(&self) -> Vec<DVec3> {
        let place = |body: &RigidBodyHandle| to_dvec3(self.world.bodies[*body].translation());
        self.bodies.iter().map(place).collect()
    }

    /// The least distance between two centres.
    pub fn nearest(&self) -> f64 {
        let places = self.places();
        let mut nearest = f64::INFINITY;
        for (k, place) in places.iter().enumerate() {
            let distances = places[..k].iter().map(|other| place.distance(*other));
            nearest = distances.fold(nearest, f64::min);
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::Fields;
    use fields::math::to_f64;

    /// A body alone reaches its goal in ten units of time; after a hundred, a run counts as a deadlock.
    const MAX_ITERATIONS: usize = 6000;

    /// Time to the goals, if they are reached, and the least distance between two bodies.
    fn run(settings: HeadOnSettings) -> (Option<f64>, f64) {
        let mut scene = settings.build().unwrap();
        let mut fields = Fields::new(scene.tree.clone()).unwrap();
        let mut nearest = f64::INFINITY;
        for _ in 0..MAX_ITERATIONS {
            fields.step(&mut scene.world).unwrap();
            nearest = nearest.min(scene.nearest());
            if scene.is_over() {
                return (Some(fields.time()), nearest);
            }
        }
        (None, nearest)
    }

    #[test]
    fn symmetric_bodies_deadlock_by_repulsion_alone_and_pass_with_the_cross_product() {
        for meeting in [Meeting::Pair, Meeting::Crossing] {
            let settings = |avoidance| HeadOnSettings {
                meeting,
                avoidance,
                ..Default::default()
            };
            let (time, _) = run(settings(Avoidance::Repulsion));
            assert_eq!(time, None, "{meeting:?} by repulsion alone");
            let (time, nearest) = run(settings(Avoidance::WithCross));
            let time = time.expect("the cross product leads them past each other");
            assert!(time < 20.0, "{meeting:?}: {time}");
            assert!(nearest > 2.0 * to_f64(RADIUS), "{meeting:?}: {nearest}");
        }
    }

    #[test]
    fn each_body_passes_on_its_own_right() {
        let mut scene = HeadOnSettings::default().build().unwrap();
        let mut fields = Fields::new(scene.tree.clone()).unwrap();
        let abreast = |places: &[DVec3]| places[0].x >= places[1].x;
        while !abreast(&scene.places()) {
            fields.step(&mut scene.world).unwrap();
            assert!(fields.time() < 20.0, "they do not pass");
        }
        let places = scene.places();
        // Heading along +x with y up, +z is to the right.
        assert!(places[0].z > 0.3 && places[1].z < -0.3, "{places:?}");
    }

    #[test]
    fn bad_settings_are_errors() {
        let settings = HeadOnSettings {
            spread: -1.0,
            ..Default::default()
        };
        assert!(settings.build().is_err());
    }
}
