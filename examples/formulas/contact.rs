//! The panel of the detection field, which is no force: two balls before an impact, and the impulses that answer it.

use rapier3d_fields::prelude::*;

use super::support::AnyError;
use super::{PALE, caption, point};
use rapier3d_fields_lab::drawing::arrows::{Arrow, Panel};

const RADIUS: Real = 0.5;

pub fn draw(svg: &mut String, panel: &Panel) -> Result<(), AnyError> {
    let panel = &Panel {
        pivot: 0.0,
        ..*panel
    };
    caption(
        svg,
        panel,
        "contact(law)",
        "who touches; answer: impulses ±J n",
    );
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let mut ball = |place: Vector, velocity: Vector| {
        let body = RigidBodyBuilder::dynamic()
            .translation(place)
            .linvel(velocity);
        world.insert(body, ColliderBuilder::ball(RADIUS))
    };
    let balls = [
        ball(Vector::new(-0.53, -0.25, 0.0), Vector::new(2.0, 0.3, 0.0)),
        ball(Vector::new(0.4, 0.2, 0.0), Vector::new(-1.0, 0.2, 0.0)),
    ];
    let law = ContactLaw::elastic();
    let around = balls.map(|(_, collider)| Field::contact(law).at(collider));
    let mut fields = Fields::new(Tree::fold(Operator::SumUnion, around))?;

    for (number, (body, _)) in balls.iter().enumerate() {
        let body = &world.bodies[*body];
        let center = point(body.translation());
        let style = ["fill=\"#e4e9f1\"", "fill=\"#eef1f6\""][number];
        panel.circle(svg, center, f64::from(RADIUS), style);
        let arrow = Arrow {
            point: center,
            vector: point(body.linvel()),
        };
        let length = 26.0 * arrow.vector.length();
        panel.draw_pale(svg, &[arrow], length, PALE);
    }
    fields.step(&mut world)?;
    let contact = fields
        .contacts()
        .first()
        .ok_or("the two balls do not touch")?;
    let impulses = contact.impulses.iter().zip(contact.bodies);
    for (impulse, body) in impulses {
        let body = body.and_then(|body| world.bodies.get(body));
        let center = body.map_or(contact.world_point, |body| body.translation());
        let arrow = Arrow {
            point: point(center),
            vector: point(*impulse),
        };
        panel.draw_arrows(svg, &[arrow], 60.0, None);
    }
    Ok(())
}
