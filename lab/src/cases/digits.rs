//! Galperin's billiard, whose number of collisions gives digits of π.

use super::answer::{answered, follow};
use super::fields;
use super::simulation::{Driver, Simulation, weightless};
use super::{About, Case, run};
use crate::study::{Measured, Method, Metric, Run, StudyError};
use fields::ContactLaw;
use fields::math::{Real, SharedShape, Vector, from_f64, to_f64};
use fields::rapier::prelude::{ColliderBuilder, RigidBodyBuilder};

/// A light ball at rest between a wall and an incoming ball of a hundred times its mass: 31 collisions.
#[derive(Clone, Copy, Debug)]
pub struct Galperin;

/// The mass of the heavy ball, that of the light one being 1.
const RATIO: f64 = 100.0;
/// Number of collisions between the balls, and of the light ball with the wall.
const COLLISIONS: f64 = 31.0;
/// Final velocities of the light and the heavy ball, in units of the heavy ball's initial speed, by arithmetic of 50
/// digits (`tests/data/h_stiff`).
const END: [f64; 2] = [0.477_860_208_205_885_9, 0.998_857_595_563_118_5];
/// Radius of both, m.
const RADIUS: f64 = 0.25;

impl Case for Galperin {
    fn about(&self) -> About {
        About {
            name: "Galperin".to_owned(),
            description: "A ball between a wall and one of 100 times its mass that comes in: 31 collisions, the first \
                          digits of π; against exact arithmetic.",
            time_unit: "s",
            // The last collision is at 6.62 s.
            duration: 7.0,
            longest: 0.125,
            halvings: 8,
            views: vec![(Metric::Velocity, 1e-2), (Metric::Count, 0.1)],
        }
    }

    fn methods(&self) -> &'static [Method] {
        &[
            Method::FieldsDiscrete,
            Method::FieldsSwept,
            Method::Rapier,
            Method::RapierCcd,
            Method::RapierSoftCcd,
        ]
    }

    fn set_up(&self, method: Method, dt: f64) -> Result<Vec<Simulation>, StudyError> {
        self.steps(dt)?;
        let mut world = weightless(from_f64(dt));
        let bouncing = |part: ColliderBuilder| part.restitution(1.0).friction(0.0);
        let wall = ColliderBuilder::new(SharedShape::halfspace(Vector::X));
        let mut parts = vec![world.colliders.insert(bouncing(wall))];
        let balls: [(Real, Real, f64); 2] = [(2.0, 0.0, 1.0), (4.0, -1.0, RATIO)];
        for (x, speed, mass) in balls {
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::X * x)
                .linvel(Vector::X * speed)
                .can_sleep(false);
            let ball = ColliderBuilder::ball(from_f64(RADIUS)).mass(from_f64(mass));
            parts.push(world.insert(body, bouncing(ball)).1);
        }
        let law = ContactLaw::elastic();
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
        let (mut count, mut last) = (0.0, velocities(&simulation));
        let (made, warned) = follow(&mut simulation, steps, |_, simulation| {
            let now = velocities(simulation);
            count += match &simulation.driver {
                Driver::Fields(fields) => {
                    let contacts = fields.contacts().iter();
                    contacts
                        .filter(|it| it.impulses != [Vector::ZERO; 2])
                        .count() as f64
                }
                // Rapier does not report collisions: each step that changes a velocity counts as one.
                _ => f64::from(u8::from(now != last)),
            };
            last = now;
        });
        let off = last
            .iter()
            .zip(END)
            .map(|(found, exact)| (found - exact).abs());
        // Relative to the speed of the light ball if it had all of the energy.
        let off = off.fold(0.0, f64::max) / RATIO.sqrt();
        let errors = vec![
            Measured::new(Metric::Velocity, off),
            Measured::new(Metric::Count, (count / COLLISIONS - 1.0).abs()),
        ];
        Ok(run(&about, (method, dt), (made, warned), 0, errors))
    }
}

/// Velocities of the light and the heavy ball, positive away from the wall.
fn velocities(simulation: &Simulation) -> [f64; 2] {
    let mut found = [f64::NAN; 2];
    for (_, body) in simulation.world.bodies.iter() {
        found[usize::from(body.mass() > 2.0)] = to_f64(body.linvel().x);
    }
    found
}
