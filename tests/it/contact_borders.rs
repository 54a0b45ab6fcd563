//! A contact field whose region ends exactly where two parts touch resolves all of their impacts.

use rapier3d_fields::Detection;
use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, either};

mod oblique;

/// Half the size of all bodies: their centres are 1 apart when they touch.
const HALF: Real = 0.5;
/// Gaps at the start, as multiples of the approach per step: impacts fall anywhere within a step.
const GAPS: [f64; 4] = [0.25, 1.5, 2.0, 4.9];

/// Two bodies on a line, before they meet.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    detection: Detection,
    boxes: bool,
    hertz: f64,
    masses: [f64; 2],
    speeds: [f64; 2],
    gap: f64,
}

impl Meeting {
    /// The speeds after ten steps.
    fn run(&self) -> [f64; 2] {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        world.integration_parameters.dt = from_f64(self.hertz.recip());
        let [a, b] = self.speeds;
        let apart = 2.0 * to_f64(HALF) + self.gap * (a - b) / self.hertz;
        let mut bodies = Vec::new();
        let mut contacts = Vec::new();
        for side in [0, 1] {
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::X * from_f64(apart * side as f64))
                .linvel(Vector::X * from_f64(self.speeds[side]))
                .can_sleep(false);
            let shape = match self.boxes {
                false => ColliderBuilder::ball(HALF),
                true => ColliderBuilder::cuboid(HALF, HALF, HALF),
            };
            let shape = shape.mass(from_f64(self.masses[side]));
            let (body, collider) = world.insert(body, shape);
            bodies.push(body);
            let field = Field::contact(ContactLaw::elastic()).at(collider);
            contacts.push(Tree::from(field.within(Region::ball(2.0 * HALF))));
        }
        let fields = Fields::builder(Tree::fold(Operator::SumUnion, contacts));
        let mut fields = fields.detection(self.detection).build().expect("a tree");
        for _ in 0..10 {
            fields.step(&mut world).expect("a step");
        }
        [0, 1].map(|side| to_f64(world.bodies[bodies[side]].linvel().x))
    }

    /// The error of the speeds against an elastic impact on a line, as a share of the closing speed.
    fn error(&self) -> f64 {
        let ([m, n], [a, b]) = (self.masses, self.speeds);
        let mean = (m * a + n * b) / (m + n);
        let found = self.run();
        let off = (found[0] - (2.0 * mean - a)).hypot(found[1] - (2.0 * mean - b));
        off / (a - b)
    }
}

/// Regression: a ball of speed 1 that met one at rest went on with 0.0 (discrete) or −0.003 (swept), and the two had
/// lost half of their energy: the field was chosen by their positions at the start of the step, still outside of the
/// region, and not by where they touch.
#[test]
fn a_region_that_ends_where_bodies_touch_resolves_their_impacts() {
    for detection in [Detection::Discrete, Detection::Swept] {
        for boxes in [false, true] {
            for hertz in [60.0, 240.0] {
                for masses in [[1.0, 1.0], [1.0, 3.0], [20.0, 1.0]] {
                    for speeds in [[1.0, 0.0], [0.1, -0.1], [3.0, -2.0], [2.0, 1.5]] {
                        for gap in GAPS {
                            let meeting = Meeting {
                                detection,
                                boxes,
                                hertz,
                                masses,
                                speeds,
                                gap,
                            };
                            let error = meeting.error();
                            assert_at_most(error, either(1e-5, 1e-12), format!("{meeting:?}"));
                        }
                    }
                }
            }
        }
    }
}
