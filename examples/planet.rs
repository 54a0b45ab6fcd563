//! A planet that pulls, a corridor of wind, and a body that keeps the user's own force.

use rapier3d_fields::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO; // The planet pulls instead.
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::ball(5.0));

    let mut ball = |name, position, velocity| {
        let body = RigidBodyBuilder::dynamic()
            .translation(position)
            .linvel(velocity);
        let (handle, _) = world.insert(body, ColliderBuilder::ball(0.5).mass(1.0));
        (name, handle)
    };
    let balls = [
        ball("moon", Vector::X * 10.0, Vector::Y * 5.0),
        ball("stone", Vector::Z * 15.0, Vector::ZERO),
        ball("leaf", Vector::new(-4.0, 50.0, 0.0), Vector::ZERO),
        ball("rocket", Vector::Y * -50.0, Vector::ZERO),
    ];
    let (_, rocket) = balls[3];
    world.bodies[rocket].add_force(Vector::Z * 2.0, true);

    let planet = Field::point_gravity(250.0) // 10 m/s² on the ground
        .within(Region::ball(30.0));
    let wind = Field::uniform(Vector::X * 3.0)
        .within(Region::cuboid(Vector::new(5.0, 2.0, 2.0)))
        .at(Vector::Y * 50.0);
    let mut fields = Fields::new(planet.sum_union(wind))?;

    for second in 0..=4 {
        println!("after {second} s");
        for (name, handle) in balls {
            let body = &world.bodies[handle];
            println!(
                "  {name:<7} at {:6.2}  moving at {:6.2}  own force {:.1}",
                body.translation(),
                body.linvel(),
                body.user_force()
            );
        }
        for _ in 0..60 {
            fields.step(&mut world)?;
        }
    }
    Ok(())
}
