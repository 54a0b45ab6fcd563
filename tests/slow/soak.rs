//! A small mixed world for ten million steps, with bodies that come and go.
//!
//! `SOAK_STEPS=10000000 cargo test --release --test slow soak -- --ignored --nocapture` prints a table to plot: the
//! time of a step, the memory in use, the number of bodies, the energy.

use std::collections::VecDeque;
use std::time::Instant;

use rapier3d_fields::prelude::*;

use crate::lab::random::Random;
use crate::support::bits::bits;

/// Rows of the table.
const ROWS: usize = 100;
/// Steps from one added body to the next. Beyond `MOST` bodies, the oldest is removed.
const EVERY: usize = 100;
const MOST: usize = 24;

struct Soak {
    world: PhysicsWorld,
    fields: Fields,
    guests: VecDeque<RigidBodyHandle>,
    random: Random,
    step: usize,
}

fn shape(kind: usize) -> SharedShape {
    match kind % 5 {
        0 => SharedShape::ball(0.3),
        1 => SharedShape::cuboid(0.3, 0.2, 0.25),
        2 => SharedShape::capsule_y(0.2, 0.2),
        3 => SharedShape::cylinder(0.25, 0.2),
        _ => SharedShape::cone(0.3, 0.25),
    }
}

impl Soak {
    fn new() -> Self {
        let mut world = PhysicsWorld::new();
        world.insert(
            RigidBodyBuilder::fixed().translation(Vector::Y * -0.5),
            ColliderBuilder::cuboid(12.0, 0.5, 12.0),
        );
        for (x, z) in [(12.0, 0.0), (-12.0, 0.0), (0.0, 12.0), (0.0, -12.0)] {
            let half = Vector::new(
                if x == 0.0 { 12.0 } else { 0.5 },
                4.0,
                if z == 0.0 { 12.0 } else { 0.5 },
            );
            world.insert(
                RigidBodyBuilder::fixed().translation(Vector::new(x, 4.0, z)),
                ColliderBuilder::cuboid(half.x, half.y, half.z),
            );
        }
        let wind = Field::wind(Vector::X * 3.0, 0.4, 0.0)
            .within(Region::cuboid(Vector::new(4.0, 3.0, 3.0)));
        let pull = Field::point_gravity(20.0)
            .softened(0.5)
            .within(Region::ball(6.0))
            .at(Vector::new(-5.0, 3.0, 4.0));
        let lift = Field::vortex(6.0, -1.0)
            .smoothed(0.5)
            .within(Region::cylinder(6.0, 3.0))
            .at(Vector::new(5.0, 3.0, -5.0));
        let fields = Fields::builder(wind + pull + lift)
            .build()
            .expect("a sound tree");
        Soak {
            world,
            fields,
            guests: VecDeque::new(),
            random: Random::new(7),
            step: 0,
        }
    }

    /// A copy by way of bytes, with a fresh pipeline.
    fn restored(&self) -> Self {
        let world = postcard::to_allocvec(&self.world).expect("what can be written");
        let state = (&self.fields.set, &self.fields.settings, &self.fields.state);
        let state = postcard::to_allocvec(&state).expect("fields without code");
        let (set, settings, state) = postcard::from_bytes(&state).expect("what was written");
        Soak {
            world: postcard::from_bytes(&world).expect("what was written"),
            fields: Fields::from_parts(set, settings, state).expect("the fields of this world"),
            guests: self.guests.clone(),
            random: self.random.clone(),
            step: self.step,
        }
    }

    fn advance(&mut self) {
        if self.step.is_multiple_of(EVERY) {
            let place = self.random.unit_vector() * 5.0;
            let place = rapier3d_fields::math::from_dvec3(place) + Vector::Y * 6.0;
            let body = RigidBodyBuilder::dynamic().translation(place);
            let collider = ColliderBuilder::new(shape(self.step / EVERY));
            self.guests.push_back(self.world.insert(body, collider).0);
            if self.guests.len() > MOST
                && let Some(oldest) = self.guests.pop_front()
            {
                self.world.remove_body(oldest);
            }
        }
        self.fields.step(&mut self.world).expect("a step");
        self.step += 1;
    }

    fn energy(&self) -> f64 {
        let bodies = self.world.bodies.iter();
        let kinetic = bodies.map(|(_, body)| rapier3d_fields::math::to_f64(body.kinetic_energy()));
        kinetic.sum()
    }
}

/// Kilobytes of memory in use, on systems that report it in `/proc`.
fn memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[test]
#[ignore = "ten million steps"]
fn a_mixed_world_runs_for_ten_million_steps() {
    let steps = std::env::var("SOAK_STEPS").map_or(10_000_000, |it| it.parse().expect("a number"));
    let stretch = steps / ROWS;
    let mut soak = Soak::new();
    let mut rows: Vec<f64> = Vec::new();
    println!("step,micros,kilobytes,bodies,kinetic");
    for row in 0..ROWS {
        let start = Instant::now();
        (0..stretch).for_each(|_| soak.advance());
        let micros = 1e6 * start.elapsed().as_secs_f64() / stretch as f64;
        let (used, energy) = (memory().unwrap_or(0.0), soak.energy());
        println!(
            "{},{micros:.2},{used},{},{energy:.3}",
            soak.step,
            soak.world.bodies.len()
        );
        rows.push(used);
        assert!(energy.is_finite() && energy < 1e4, "{energy}");
        assert_eq!(
            soak.world.bodies.len(),
            5 + MOST.min(soak.step.div_ceil(EVERY))
        );
        if row == ROWS / 2 {
            let mut again = soak.restored();
            for _ in 0..1000 {
                soak.advance();
                again.advance();
                assert_eq!(bits(&soak.world), bits(&again.world), "after {}", soak.step);
            }
        }
    }
    // Rapier's own counters may grow; memory that grew with each step would reach a hundred times this.
    let (early, late) = (rows[ROWS / 5], rows[ROWS - 1]);
    assert!(late <= 1.2 * early, "{early} kB became {late} kB");
}
