//! The paper's §3.4: avoidance and collision in one tree. Around a fixed ball, a static field pushes bodies away; close
//! to its surface, a contact field replaces it. Slow bodies turn back without contact; fast ones collide.

use super::fields;
use fields::math::{Real, RigidBodyHandle, Vector};
use fields::prelude::*;

use super::{SceneError, check_range, elastic, empty_world};

/// Radius of the fixed ball in the middle.
pub const OBSTACLE: Real = 1.0;
/// Radius of the bodies, of mass 1.
pub const RADIUS: Real = 0.3;
/// Distances from the centre of the ball at which the avoidance begins, and at which the contact field replaces it.
pub const REACH: [Real; 2] = [4.0, 1.6];

/// Settings of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct UnificationSettings {
    /// Strength of the avoidance, a force.
    pub push: Real,
    /// Position and velocity of each body.
    pub bodies: Vec<(Vector, Vector)>,
    /// Time step.
    pub dt: Real,
}

impl Default for UnificationSettings {
    /// Two fast bodies and two slow ones, aimed at or past the centre.
    fn default() -> Self {
        let x = |y: Real| Vector::new(-6.5, y, 0.0);
        UnificationSettings {
            push: 1.0,
            bodies: vec![
                (x(0.0), Vector::X * 3.0),
                (x(0.8), Vector::X * 3.0),
                (Vector::new(6.5, -0.4, 0.0), -Vector::X * 1.4),
                (Vector::new(0.3, -6.5, 0.0), Vector::Y * 1.8),
            ],
            dt: 1.0 / 240.0,
        }
    }
}

/// The scene.
pub struct Unification {
    /// The physics world, without gravity.
    pub world: PhysicsWorld,
    /// Both fields.
    pub tree: Tree,
    /// The bodies that move.
    pub bodies: Vec<RigidBodyHandle>,
    /// The fixed ball.
    pub obstacle: RigidBodyHandle,
}

impl UnificationSettings {
    /// Builds the scene.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn build(&self) -> Result<Unification, SceneError> {
        check_range("push", self.push, 0.0, 1e6)?;
        check_range("dt", self.dt, 1e-6, 1.0)?;
        let mut world = empty_world(self.dt);
        let middle = elastic(ColliderBuilder::ball(OBSTACLE));
        let (obstacle, surface) = world.insert(RigidBodyBuilder::fixed(), middle);
        let mut insert = |(place, velocity): &(Vector, Vector)| {
            let body = RigidBodyBuilder::dynamic().translation(*place);
            let body = body.linvel(*velocity).can_sleep(false);
            let ball = elastic(ColliderBuilder::ball(RADIUS).mass(1.0));
            world.insert(body, ball).0
        };
        let bodies = self.bodies.iter().map(&mut insert).collect();
        let avoid = Field::radial(self.push, 0.0).within(Region::ball(REACH[0]));
        let collide = Field::contact(ContactLaw::elastic()).within(Region::ball(REACH[1]));
        let tree = avoid
            .at(surface)
            .named("avoidance")
            .replace_union(collide.at(surface).named("collision"));
        Ok(Unification {
            world,
            tree,
            bodies,
            obstacle,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fields::math::to_f64;

    /// The smallest distance of each body from the centre, whether it touched, and its final speed.
    fn run() -> Vec<(f64, bool, f64)> {
        let mut scene = UnificationSettings::default().build().unwrap();
        let builder = Fields::builder(scene.tree.clone()).detection(Detection::Swept);
        let mut fields = builder.build().unwrap();
        let mut seen = vec![(f64::INFINITY, false, 0.0); scene.bodies.len()];
        for _ in 0..240 * 10 {
            fields.step(&mut scene.world).unwrap();
            for (body, seen) in scene.bodies.iter().zip(&mut seen) {
                let found = &scene.world.bodies[*body];
                seen.0 = seen.0.min(to_f64(found.translation().length()));
                seen.1 |= fields
                    .contacts()
                    .iter()
                    .any(|it| it.bodies.contains(&Some(*body)));
                seen.2 = to_f64(found.linvel().length());
            }
        }
        seen
    }

    #[test]
    fn slow_bodies_turn_back_and_fast_ones_collide() {
        let seen = run();
        let surface = to_f64(OBSTACLE + RADIUS);
        for (number, (nearest, touched, speed)) in seen.into_iter().enumerate() {
            // The push has a potential: a body leaves at the speed at which it came.
            let (fast, start) = match number {
                0 | 1 => (true, 3.0),
                2 => (false, 1.4),
                _ => (false, 1.8),
            };
            assert_eq!(touched, fast, "body {number} came to {nearest}");
            assert!(
                (speed - start).abs() < 0.02 * start,
                "body {number}: {speed}"
            );
            if fast {
                assert!((nearest - surface).abs() < 0.02, "body {number}: {nearest}");
            } else {
                assert!(nearest > to_f64(REACH[1]), "body {number}: {nearest}");
            }
        }
    }
}
