//! A level of a game: crates and balls under Rapier's gravity, a wind over half of the floor, a pool, a
//! small planet with a moon, and crates that sleep.

use super::fields;
use fields::math::{Real, SharedShape, Vector};
use fields::rapier::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder};
use fields::{Field, Region, Tree};

/// Gravitational parameter of the planet, m³/s².
const PLANET: Real = 8.0;
/// Centre of the planet, m.
const CENTER: Vector = Vector::new(0.0, 3.5, -6.0);
/// Radius within which its gravity acts, m.
const REACH: Real = 2.5;

/// The level at its start.
pub fn build() -> (PhysicsWorld, Tree) {
    let mut world = PhysicsWorld::new();
    let ground = RigidBodyBuilder::fixed().translation(Vector::Y * -2.5);
    world.insert(ground, ColliderBuilder::cuboid(8.0, 0.5, 8.0));
    falling(&mut world);
    for floor in 0..4 {
        let at = Vector::new(-1.0, -1.6 + 0.8 * floor as Real, 7.0);
        let crate_ = RigidBodyBuilder::dynamic().translation(at).sleeping(true);
        world.insert(
            crate_,
            ColliderBuilder::cuboid(0.4, 0.4, 0.4).density(300.0),
        );
    }
    let planet = RigidBodyBuilder::fixed().translation(CENTER);
    world.insert(planet, ColliderBuilder::ball(0.6));
    let away: Real = 1.6;
    let moon = RigidBodyBuilder::dynamic()
        .translation(CENTER + Vector::X * away)
        .linvel(Vector::Z * (PLANET / away).sqrt())
        .gravity_scale(0.0);
    world.insert(moon, ColliderBuilder::ball(0.15));
    (world, tree())
}

/// Inserts crates, balls and planks that fall.
fn falling(world: &mut PhysicsWorld) {
    for number in 0..24 {
        let place = |k: i32| (k - 2) as Real * 2.2;
        let at = Vector::new(
            place(number % 5),
            2.0 + (number / 5) as Real,
            place(number / 5),
        );
        let body = RigidBodyBuilder::dynamic().translation(at);
        let shape = match number % 3 {
            0 => SharedShape::ball(0.45),
            1 => SharedShape::cuboid(0.4, 0.4, 0.4),
            _ => SharedShape::cuboid(0.6, 0.3, 0.4),
        };
        let density = if number % 2 == 0 { 300.0 } else { 600.0 };
        world.insert(body, ColliderBuilder::new(shape).density(density));
    }
}

fn tree() -> Tree {
    let over = |x: Real| Region::cuboid(Vector::new(3.0, 4.0, 8.0)).at(Vector::X * x);
    let wind = Field::wind_zone(Vector::Z * 9.0, 60.0, 0.0, over(-4.5)).named("wind");
    let pool = Tree::pool(
        Vector::new(4.5, -1.5, 0.0),
        Vector::new(3.0, 0.8, 8.0),
        1000.0,
        9.81,
        1.5,
    );
    let planet = Field::point_gravity(PLANET).within(Region::ball(REACH));
    pool + wind + planet.at(CENTER).named("planet")
}
