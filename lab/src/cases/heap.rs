//! Crates that fall into a heap.

use super::answer::{answered, follow};
use super::fields;
use super::rest::{floor, heavy};
use super::simulation::Simulation;
use super::{About, Case, run};
use crate::random::Random;
use crate::study::{Measured, Method, Metric, Run, StudyError};
use fields::ContactLaw;
use fields::math::{DVec3, Vector, from_dvec3, from_f64, to_f64};
use fields::rapier::parry::query;
use fields::rapier::prelude::{ColliderBuilder, RigidBodyBuilder};

/// Twenty-seven crates that fall onto a floor and each other.
#[derive(Clone, Copy, Debug)]
pub struct Heap;

/// Half the edge of a crate, m.
const HALF: f64 = 0.25;
const FRICTION: f64 = 0.5;
/// Bodies that are faster have not come to rest, m/s.
const RESTING: f64 = 0.1;

impl Case for Heap {
    fn about(&self) -> About {
        About {
            name: "heap".to_owned(),
            description: "27 crates fall onto a floor and each other under Rapier's gravity, friction 0.5, 6 s: how \
                          deep they lie in each other, how soon and how still they rest.",
            time_unit: "s",
            duration: 6.0,
            longest: 1.0 / 60.0,
            halvings: 4,
            views: vec![(Metric::Overlap, 0.05), (Metric::Unrest, 0.05)],
        }
    }

    fn methods(&self) -> &'static [Method] {
        &[
            Method::FieldsDiscrete,
            Method::FieldsSwept,
            Method::Rapier,
            Method::RapierCcd,
        ]
    }

    fn is_quick(&self) -> bool {
        false
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.steps(dt)?;
        let mut world = heavy(dt);
        let mut parts = vec![floor(&mut world, Vector::Y, [0.0, FRICTION])];
        let mut random = Random::new(3);
        for number in 0..27 {
            let [x, y, z] = [number % 3, number / 9, number / 3 % 3].map(|it| it as f64 - 1.0);
            let aside = 0.1 * random.unit_vector();
            let at = DVec3::new(0.7 * x, 1.9 + 0.9 * y, 0.7 * z) + aside;
            let body = RigidBodyBuilder::dynamic()
                .translation(from_dvec3(at))
                .rotation(from_dvec3(0.3 * random.unit_vector()));
            let half = from_f64(HALF);
            let cube = ColliderBuilder::cuboid(half, half, half).friction(from_f64(FRICTION));
            parts.push(world.insert(body, cube).1);
        }
        let law = ContactLaw::Impulse {
            restitution: 0.0,
            friction: from_f64(FRICTION),
        };
        Ok(vec![answered(
            &self.about().name,
            method,
            world,
            &parts,
            law,
        )?])
    }

    fn run(&self, method: Method, dt: f64) -> Result<Run, StudyError> {
        let (about, steps) = (self.about(), self.steps(dt)?);
        let mut simulation = self.set_up(method, dt)?.swap_remove(0);
        let (mut settled, mut unrest) = (0.0, 0.0_f64);
        let (made, warned) = follow(&mut simulation, steps, |step, simulation| {
            let time = step as f64 * dt;
            let speeds = simulation.world.bodies.iter();
            let speeds = speeds.map(|(_, body)| to_f64(body.linvel().length()));
            let fastest = speeds.fold(0.0, f64::max);
            if fastest > RESTING {
                settled = time;
            }
            if time > about.duration - 1.0 {
                unrest = unrest.max(fastest);
            }
        });
        let errors = vec![
            Measured::new(Metric::Overlap, deepest(&simulation) / (2.0 * HALF)),
            Measured::new(Metric::Unrest, unrest),
            Measured::new(Metric::Settling, settled),
        ];
        Ok(run(&about, (method, dt), (made, warned), 0, errors))
    }
}

/// The deepest overlap of any two colliders at their present poses.
fn deepest(simulation: &Simulation) -> f64 {
    let all: Vec<_> = simulation.world.colliders.iter().map(|it| it.1).collect();
    let mut deepest = 0.0_f64;
    for (number, a) in all.iter().enumerate() {
        for b in &all[..number] {
            let found = query::contact(a.position(), a.shape(), b.position(), b.shape(), 0.0);
            let depth = found.ok().flatten().map_or(0.0, |it| -to_f64(it.dist));
            deepest = deepest.max(depth);
        }
    }
    deepest
}
