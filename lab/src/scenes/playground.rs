//! The level of the animated picture: a planet with two moons, a wind that blows balls into a pool, a magnet that
//! attracts iron, and crates that sleep until an explosion wakes them.
//!
//! The floor is y = 0. Balls and pieces of iron are dropped at intervals.

use super::fields;
use fields::math::{
    InteractionGroups, Real, RigidBodyHandle, Rotation, SharedShape, Vector, from_f64,
};
use fields::rapier::prelude::{
    ColliderBuilder, Group, InteractionTestMode, PhysicsWorld, RigidBodyBuilder,
};
use fields::{Field, Fields, Region, StepError, Tree};

/// Steps per second.
pub const STEPS_PER_SECOND: usize = 50;
/// Steps after which the moons are back at their start and the picture repeats.
pub const STEPS: usize = 350;
/// Half the width (x, z) of the island's floor, and its thickness (y), m.
pub const ISLAND: Vector = Vector::new(9.0, 1.3, 4.6);
/// Middle of the water's surface, and half the size of the pool, whose depth is twice its y, m.
pub const POOL: Vector = Vector::new(5.6, -0.22, 1.9);
pub const POOL_SIZE: Vector = Vector::new(2.6, 0.5, 1.9);
/// Centre of the planet, its radius and the reach of its gravity, m.
pub const PLANET: Vector = Vector::new(-5.9, 3.3, -2.2);
pub const PLANET_RADIUS: Real = 0.95;
pub const PLANET_REACH: Real = 2.5;
/// Centre of the wind and half its size, m.
pub const WIND: Vector = Vector::new(-3.0, 0.95, 2.3);
pub const WIND_SIZE: Vector = Vector::new(5.6, 0.95, 1.5);
/// Centre and reach of the magnet's pull, m.
pub const MAGNET: Vector = Vector::new(6.6, 1.0, -2.6);
pub const MAGNET_REACH: Real = 3.6;
/// Step, centre and reach (m) of the explosion.
pub const BLAST_STEP: usize = 116;
pub const BLAST: Vector = Vector::new(-0.3, -0.9, -1.3);
pub const BLAST_REACH: Real = 5.0;

/// Steps between two drops of balls, and of pieces of iron.
const DROP_STEPS: usize = 38;

/// The group of bodies of iron.
const IRON: Group = Group::GROUP_2;

/// The kind of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Moon,
    Crate,
    Raft,
    Ball,
    Iron,
}

/// A body that moves.
#[derive(Clone, Copy, Debug)]
pub struct Thing {
    pub body: RigidBodyHandle,
    pub kind: Kind,
    /// The step before which it was inserted.
    pub since: usize,
}

/// The running level.
pub struct Playground {
    pub world: PhysicsWorld,
    pub fields: Fields,
    pub things: Vec<Thing>,
    pub step: usize,
}

impl Playground {
    /// Builds the level.
    ///
    /// # Errors
    /// See [`BuildError`](fields::BuildError); none is expected.
    pub fn new() -> Result<Self, fields::BuildError> {
        let mut level = Self {
            world: PhysicsWorld::new(),
            fields: Fields::new(tree())?,
            things: Vec::new(),
            step: 0,
        };
        level.world.integration_parameters.dt = 1.0 / STEPS_PER_SECOND as Real;
        level.insert_ground();
        level.insert_moons();
        level.insert_crates();
        level.insert_rafts();
        Ok(level)
    }

    /// Makes a step. Drops bodies and starts the explosion before it if they are due.
    ///
    /// # Errors
    /// See [`StepError`].
    pub fn step(&mut self) -> Result<(), StepError> {
        self.drop_things();
        if self.step == BLAST_STEP {
            let blast = Field::explosion(9.0, BLAST_REACH).at(BLAST);
            self.fields.set.insert_field(blast.named("explosion"));
        }
        self.fields.step(&mut self.world)?;
        self.step += 1;
        Ok(())
    }

    fn insert(&mut self, kind: Kind, body: RigidBodyBuilder, collider: ColliderBuilder) {
        let (body, _) = self.world.insert(body, collider);
        let since = self.step;
        self.things.push(Thing { body, kind, since });
    }

    /// Inserts the fixed bodies: an island with a basin, the planet and the magnet.
    fn insert_ground(&mut self) {
        let mut slab = |least: [Real; 3], greatest: [Real; 3]| {
            let (least, greatest) = (Vector::from_array(least), Vector::from_array(greatest));
            let half = 0.5 * (greatest - least);
            let collider = ColliderBuilder::cuboid(half.x, half.y, half.z).friction(0.6);
            let body = RigidBodyBuilder::fixed().translation(least + half);
            self.world.insert(body, collider);
        };
        let [x, z] = [ISLAND.x, ISLAND.z];
        let (near, far) = (POOL - POOL_SIZE, POOL + POOL_SIZE);
        let bottom = POOL.y - 2.0 * POOL_SIZE.y;
        slab([-x, -1.0, -z], [near.x, 0.0, z]);
        slab([far.x, -1.0, -z], [x, 0.0, z]);
        slab([near.x, -1.0, -z], [far.x, 0.0, near.z]);
        slab([near.x, -1.0, far.z], [far.x, 0.0, z]);
        slab([near.x, bottom - 1.0, near.z], [far.x, bottom, far.z]);
        let planet = RigidBodyBuilder::fixed().translation(PLANET);
        let collider = ColliderBuilder::ball(PLANET_RADIUS);
        self.world.insert(planet, collider);
        for part in magnet_parts() {
            let body = RigidBodyBuilder::fixed().translation(part.middle);
            let half = part.half_extents;
            let collider = ColliderBuilder::cuboid(half.x, half.y, half.z).friction(0.8);
            self.world.insert(body, collider);
        }
    }

    /// Inserts two moons, one with two and one with three revolutions in [`STEPS`].
    fn insert_moons(&mut self) {
        let turns: [Real; 2] = [2.0, 3.0];
        let tilts: [Real; 2] = [0.35, -0.6];
        for (turns, tilt) in turns.into_iter().zip(tilts) {
            let rate = orbit_rate(turns);
            let away = (planet_mu() / (rate * rate)).cbrt();
            let plane = Rotation::from_rotation_z(tilt) * Rotation::from_rotation_x(tilt);
            let moon = RigidBodyBuilder::dynamic()
                .translation(PLANET + plane * Vector::X * away)
                .linvel(plane * -Vector::Z * (away * rate))
                .gravity_scale(0.0);
            let radius = if turns < 2.5 { 0.3 } else { 0.2 };
            self.insert(Kind::Moon, moon, ColliderBuilder::ball(radius));
        }
    }

    /// Inserts two sleeping pyramids, one behind the other.
    fn insert_crates(&mut self) {
        let half: Real = 0.42;
        for back in 0..2 {
            for floor in 0..3 {
                for place in 0..3 - floor {
                    let across = place as Real - 0.5 * (2 - floor) as Real;
                    let at = Vector::new(
                        -0.3 + 2.06 * half * across,
                        half * (2 * floor + 1) as Real,
                        -1.0 - 2.1 * half * back as Real,
                    );
                    let body = RigidBodyBuilder::dynamic().translation(at).sleeping(true);
                    let shape = ColliderBuilder::cuboid(half, half, half).density(300.0);
                    self.insert(Kind::Crate, body, shape.friction(0.7));
                }
            }
        }
    }

    /// Inserts sleeping rafts on the water, at the depth at which they float.
    fn insert_rafts(&mut self) {
        for (x, z, turn) in [(-1.2, 0.7, 0.3), (0.9, -0.7, -0.5)] {
            let at = POOL + Vector::new(x, 0.0, z);
            let body = RigidBodyBuilder::dynamic()
                .translation(at)
                .rotation(Vector::Y * turn)
                .sleeping(true);
            let shape = ColliderBuilder::cuboid(0.75, 0.22, 0.5).density(500.0);
            self.insert(Kind::Raft, body, shape.friction(0.4));
        }
    }

    /// Drops a ball into the wind and a piece of iron near the magnet every [`DROP_STEPS`], as long as there is time
    /// for them to arrive.
    fn drop_things(&mut self) {
        if self.step >= 250 {
            return;
        }
        let number = self.step / DROP_STEPS;
        // Pseudo-random offsets.
        let aside = |factor: Real| (number as Real * factor).sin();
        if self.step.is_multiple_of(DROP_STEPS) {
            let at = WIND + Vector::new(-4.7, 1.2, 0.9 * aside(2.4));
            let ball = RigidBodyBuilder::dynamic().translation(at);
            let shape = ColliderBuilder::ball(0.36).density(260.0).restitution(0.35);
            self.insert(Kind::Ball, ball, shape);
        }
        if self.step % DROP_STEPS == DROP_STEPS / 2 {
            let at = Vector::new(4.3 + 0.5 * aside(1.7), 3.4, -2.5 + 0.9 * aside(4.1));
            let iron = RigidBodyBuilder::dynamic()
                .translation(at)
                .angvel(Vector::new(2.0, 1.0, 3.0));
            let shape = if number.is_multiple_of(2) {
                SharedShape::cuboid(0.24, 0.24, 0.24)
            } else {
                SharedShape::ball(0.26)
            };
            let groups =
                InteractionGroups::new(Group::GROUP_1 | IRON, Group::ALL, InteractionTestMode::And);
            let shape = ColliderBuilder::new(shape).density(500.0).friction(0.8);
            self.insert(Kind::Iron, iron, shape.collision_groups(groups));
        }
    }
}

/// A fixed box.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub middle: Vector,
    pub half_extents: Vector,
    /// Whether it is one of the poles.
    pub is_pole: bool,
}

/// The magnet: a horseshoe that is open towards -x, with poles at the ends of its arms.
pub fn magnet_parts() -> [Part; 5] {
    let part = |x: Real, z: Real, half_x: Real, half_z: Real, is_pole: bool| Part {
        middle: MAGNET + Vector::new(x, 0.0, z),
        half_extents: Vector::new(half_x, 0.4, half_z),
        is_pole,
    };
    [
        part(1.0, 0.0, 0.36, 1.15, false),
        part(0.3, -0.83, 0.34, 0.32, false),
        part(0.3, 0.83, 0.34, 0.32, false),
        part(-0.32, -0.83, 0.28, 0.32, true),
        part(-0.32, 0.83, 0.28, 0.32, true),
    ]
}

/// Angular velocity of a moon with this number of revolutions in [`STEPS`], rad/s.
fn orbit_rate(turns: Real) -> Real {
    let turn = from_f64(std::f64::consts::TAU);
    turns * turn * STEPS_PER_SECOND as Real / STEPS as Real
}

/// The gravitational parameter with which the slower moon is 2.05 m from the centre, m³/s².
fn planet_mu() -> Real {
    let (rate, away): (Real, Real) = (orbit_rate(2.0), 2.05);
    rate * rate * away * away * away
}

fn tree() -> Tree {
    let planet = Field::point_gravity(planet_mu()).within(Region::ball(PLANET_REACH));
    let air = Region::cuboid(WIND_SIZE).at(WIND);
    let wind = Field::wind_zone(Vector::X * 4.5, 90.0, 0.0, air);
    let pool = Tree::pool(POOL, POOL_SIZE, 1000.0, 9.81, 1.6);
    let iron = InteractionGroups::new(IRON, IRON, InteractionTestMode::And);
    let magnet = Field::magnet(900.0, 0.7, MAGNET_REACH).groups(iron);
    pool + wind.named("wind")
        + planet.at(PLANET).named("planet")
        + magnet.at(MAGNET).named("magnet")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crates_wake_balls_and_iron_arrive_and_moons_stay_in_orbit() {
        let mut level = Playground::new().expect("fields that can be built");
        let sleepers = |level: &Playground, kind: Kind| {
            let things = level.things.iter().filter(|it| it.kind == kind);
            things
                .filter(|it| level.world.bodies[it.body].is_sleeping())
                .count()
        };
        while level.step < BLAST_STEP {
            level.step().expect("a step");
        }
        assert_eq!(sleepers(&level, Kind::Crate), 12);
        level.step().expect("the explosion");
        assert_eq!(sleepers(&level, Kind::Crate), 0, "all are awake");
        while level.step < STEPS {
            level.step().expect("a step");
        }
        let place = |thing: &Thing| level.world.bodies[thing.body].translation();
        let at = |kind: Kind| level.things.iter().filter(move |it| it.kind == kind);
        let (near, far) = (POOL - POOL_SIZE, POOL + POOL_SIZE);
        let swims = |at: Vector| near.x < at.x && at.x < far.x && at.y.abs() < 1.0;
        let swimming = at(Kind::Ball).filter(|it| swims(place(it))).count();
        assert!(swimming >= 5, "{swimming} balls in the pool");
        let caught = at(Kind::Iron).filter(|it| (place(it) - MAGNET).length() < 1.8);
        assert!(caught.count() >= 5, "pieces of iron at the magnet");
        assert!(sleepers(&level, Kind::Crate) >= 4, "some sleep again");
        for (moon, away) in at(Kind::Moon).zip([2.05, 1.564]) {
            let off = (place(moon) - PLANET).length() - away;
            assert!(off.abs() < 0.02, "{off} off its circle");
        }
    }
}
