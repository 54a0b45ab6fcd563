//! Close passes by attracting centres: what a step cannot resolve, it tells.

use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::numbers::Numbers;
use crate::support::{assert_at_most, build, insert_ball, weightless};

const DT: f64 = 1.0 / 60.0;

/// A unit mass that flies by a centre of attraction which is fixed or a body of its own.
struct Pass {
    world: PhysicsWorld,
    ball: RigidBodyHandle,
    centre: Option<RigidBodyHandle>,
    strength: f64,
}

impl Pass {
    /// At a distance of about one, towards a point beside the centre.
    fn new(numbers: &mut Numbers, is_fixed: bool) -> Self {
        let strength = numbers.within(1.0, 100.0);
        let mut world = weightless(from_f64(DT));
        let (ahead, miss) = (numbers.within(1.0, 1.03), numbers.within(1e-4, 1.0));
        let start = Vector::new(from_f64(ahead), from_f64(miss), 0.0);
        let mut insert = |mass, place, linvel| {
            let ball = insert_ball(&mut world, from_f64(mass), place, linvel);
            let collider = world.bodies[ball].colliders()[0];
            world.colliders[collider].set_collision_groups(InteractionGroups::none());
            ball
        };
        let ball = insert(1.0, start, Vector::X * -2.0);
        let centre = (!is_fixed).then(|| insert(strength, Vector::ZERO, Vector::ZERO));
        Pass {
            world,
            ball,
            centre,
            strength,
        }
    }

    fn tree(&self) -> Tree {
        let field = Field::point_gravity(from_f64(self.strength));
        match self.centre {
            Some(body) => field.reacting().at(body).into(),
            None => field.into(),
        }
    }

    /// The kinetic energy, and that together with the potential one.
    fn energies(&self) -> [f64; 2] {
        let kinetic = |mass: f64, body: RigidBodyHandle| {
            0.5 * mass * to_f64(self.world.bodies[body].linvel().length_squared())
        };
        let place = |body: RigidBodyHandle| self.world.bodies[body].translation();
        let centre = self.centre.map_or(Vector::ZERO, place);
        let distance = to_f64((place(self.ball) - centre).length());
        let moving = self.centre.map_or(0.0, |body| kinetic(self.strength, body));
        let kinetic = moving + kinetic(1.0, self.ball);
        [kinetic, kinetic - self.strength / distance]
    }

    /// The kinetic energy at the closest approach, from the energy and the angular momentum of the two bodies.
    fn largest_kinetic_energy(&self) -> f64 {
        let mass = self
            .centre
            .map_or(1.0, |_| self.strength / (self.strength + 1.0));
        let ball = &self.world.bodies[self.ball];
        let turning = mass * to_f64(ball.translation().cross(ball.linvel()).length());
        let [kinetic, energy] = self.energies();
        let relative = energy - (1.0 - mass) * kinetic;
        let root = self.strength.powi(2) + 2.0 * relative * turning.powi(2) / mass;
        let closest = turning.powi(2) / mass / (self.strength + root.sqrt());
        energy + self.strength / closest
    }
}

/// The error of the energy, as a share of the largest kinetic energy, is about the tolerance at most, or a step warns:
/// also where the closest distance is a few roundings of the positions.
#[test]
fn a_pass_keeps_its_energy_or_warns() {
    let mut numbers = Numbers::new(3);
    let (mut told, count) = (0, 600);
    for case in 0..count {
        let mut pass = Pass::new(&mut numbers, case % 2 == 0);
        let tolerance = numbers.within(1e-4, 3e-2);
        let (largest, [_, before]) = (pass.largest_kinetic_energy(), pass.energies());
        let mut fields = build(pass.tree(), Scheme::auto(from_f64(tolerance)));
        let steps = (0..45).map(|_| fields.step(&mut pass.world).expect("a step").warnings);
        if steps.sum::<usize>() > 0 {
            told += 1;
            continue;
        }
        let share = (pass.energies()[1] - before).abs() / largest;
        assert_at_most(share / tolerance, 8.0, format!("{case}: {tolerance}"));
    }
    let share = f64::from(told) / f64::from(count);
    assert_at_most(share, 0.4, "share of warned passes");
}
