//! The paper's Figure 4 as drawn: each ball has an attraction that a collision field replaces where balls touch, and
//! all of them are summed. The balls attract one another until they collide, and bounce.

use rapier3d_fields::Detection;
use rapier3d_fields::contact::FieldContact;
use rapier3d_fields::math::{DVec3, from_dvec3, from_f64, to_dvec3};
use rapier3d_fields::prelude::*;

use crate::support::numbers::Numbers;
use crate::support::weightless;

const RADIUS: f64 = 0.3;
/// The range of the attraction, which is `PULL`/r².
const REACH: f64 = 4.0;
const PULL: f64 = 0.2;
const STEPS_A_SECOND: usize = 60;

/// Balls of unit mass at random places in a cube.
struct Balls {
    world: PhysicsWorld,
    all: Vec<(RigidBodyHandle, ColliderHandle)>,
}

struct Totals {
    kinetic: f64,
    potential: f64,
    momentum: DVec3,
    /// The sum of the magnitudes of momentum.
    speeds: f64,
    /// The least distance between surfaces.
    gap: f64,
}

impl Balls {
    fn new(count: usize) -> Self {
        let mut world = weightless(from_f64((STEPS_A_SECOND as f64).recip()));
        let mut numbers = Numbers::new(count as u64);
        let side = 1.2 * (count as f64).cbrt();
        let mut centres: Vec<DVec3> = Vec::new();
        while centres.len() < count {
            let centre = numbers.vector() * (0.5 * side);
            if centres
                .iter()
                .all(|other| centre.distance(*other) > 2.1 * RADIUS)
            {
                centres.push(centre);
            }
        }
        let all = centres.iter().map(|centre| {
            let velocity = from_dvec3(numbers.vector() * 0.5);
            let body = RigidBodyBuilder::dynamic().translation(from_dvec3(*centre));
            let body = body.linvel(velocity).angvel(velocity.cross(Vector::Y));
            world.insert(
                body.can_sleep(false),
                ColliderBuilder::ball(from_f64(RADIUS)).mass(1.0),
            )
        });
        let all = all.collect();
        Balls { world, all }
    }

    fn colliders(&self) -> impl Iterator<Item = ColliderHandle> + '_ {
        self.all.iter().map(|(_, collider)| *collider)
    }

    fn totals(&self) -> Totals {
        let bodies: Vec<_> = self
            .all
            .iter()
            .map(|(it, _)| &self.world.bodies[*it])
            .collect();
        let centres: Vec<DVec3> = bodies.iter().map(|it| to_dvec3(it.translation())).collect();
        let velocities: Vec<DVec3> = bodies.iter().map(|it| to_dvec3(it.linvel())).collect();
        let mut totals = Totals {
            kinetic: velocities.iter().map(|it| 0.5 * it.length_squared()).sum(),
            potential: 0.0,
            momentum: velocities.iter().sum(),
            speeds: velocities.iter().map(|it| it.length()).sum(),
            gap: f64::INFINITY,
        };
        for (number, centre) in centres.iter().enumerate() {
            for other in &centres[..number] {
                let distance = centre.distance(*other);
                totals.gap = totals.gap.min(distance - 2.0 * RADIUS);
                // Beyond its reach there is no force.
                totals.potential -= (PULL / distance - PULL / REACH).max(0.0);
            }
        }
        totals
    }
}

/// The composite of one object, around the origin.
fn object() -> Tree {
    let reach = Region::ball(from_f64(REACH));
    let touching = Region::ball(from_f64(2.0 * RADIUS));
    let attraction = Field::radial(from_f64(-PULL), -2.0).within(reach);
    attraction.replace_union(Field::contact(ContactLaw::elastic()).within(touching))
}

fn fields(tree: Tree, detection: Detection) -> Fields {
    let builder = Fields::builder(tree).detection(detection);
    builder.cross_check(true).build().expect("a valid tree")
}

#[test]
fn objects_attract_one_another_and_bounce() {
    for detection in [Detection::Discrete, Detection::Swept] {
        // Discrete detection turns balls back late, at the end of the step in which they overlap.
        let tolerance = match detection {
            Detection::Discrete => 2e-2,
            _ => 2e-3,
        };
        for (count, seconds) in [(2, 20), (3, 20), (10, 10), (100, 10)] {
            let about = format!("{count} balls, {detection:?}");
            let mut balls = Balls::new(count);
            let mut fields = fields(Tree::instances(object(), balls.colliders()), detection);
            let start = balls.totals();
            let (mut contacts, mut most) = (0, start.kinetic);
            for _ in 0..seconds * STEPS_A_SECOND {
                fields.step(&mut balls.world).expect("a step");
                contacts += fields.contacts().len();
                let now = balls.totals();
                most = most.max(now.kinetic);
                let gained = now.kinetic + now.potential - start.kinetic - start.potential;
                assert!(
                    gained.abs() <= tolerance * most,
                    "{about}: {gained} of {most}"
                );
                // Forces of a pair are equal and opposite, except after a hit within a step.
                let off = (now.momentum - start.momentum).length();
                assert!(off <= 3e-4 * now.speeds, "{about}: {off} of {}", now.speeds);
                let is_apart = detection == Detection::Discrete || now.gap >= -1e-5;
                assert!(is_apart, "{about}: {}", now.gap);
            }
            assert!(contacts > count / 4, "{about}: {contacts} contacts");
            let check = fields.cross_check().expect("it is on");
            assert_eq!(check.disagreed(), 0, "{about}: {check}");
        }
    }
}

/// The tree of the figure, node by node, is a sum of composites, each of the two fields of one object.
#[test]
fn instances_are_the_sum_of_their_objects() {
    for detection in [Detection::Discrete, Detection::Swept] {
        let mut runs = [true, false].map(|instances| {
            let balls = Balls::new(30);
            let at = |collider| Tree::instances(object(), [collider]);
            let tree = if instances {
                Tree::instances(object(), balls.colliders())
            } else {
                balls.colliders().map(at).sum()
            };
            let fields = fields(tree, detection);
            (balls, fields)
        });
        let mut contacts = 0;
        for step in 0..STEPS_A_SECOND {
            let [one, other] = runs.each_mut().map(|(balls, fields)| {
                fields.step(&mut balls.world).expect("a step");
                let bodies = balls.world.bodies.iter();
                let velocities: Vec<Vector> = bodies.map(|(_, it)| it.linvel()).collect();
                contacts += fields.contacts().len();
                (velocities, fields.contacts().to_vec())
            });
            assert_eq!(one.0, other.0, "step {step}");
            let pairs = |contacts: &[FieldContact]| -> Vec<[ColliderHandle; 2]> {
                contacts.iter().map(|it| it.colliders).collect()
            };
            assert_eq!(pairs(&one.1), pairs(&other.1), "step {step}");
        }
        assert!(contacts > 20, "{contacts} contacts");
    }
}

/// Detection fields keep to their own composite while others, inserted before it, come and go.
#[test]
fn contacts_are_found_beside_other_composites() {
    for detection in [Detection::Discrete, Detection::Swept] {
        for removed in [false, true] {
            let mut world = weightless(from_f64((STEPS_A_SECOND as f64).recip()));
            let balls = [-1.0, 1.0].map(|side| {
                let body = RigidBodyBuilder::dynamic().translation(Vector::X * side);
                let ball = ColliderBuilder::ball(from_f64(RADIUS)).mass(1.0);
                world.insert(body.linvel(Vector::X * -side), ball)
            });
            let [guard, core] = [Vector::Z, Vector::Y].map(Field::uniform);
            let guard = guard.within(Region::ball(1.0)).at(Vector::Y * 30.0);
            let core = core.within(Region::ball(0.5)).at(Vector::Y * 30.0);
            let far = guard.clone().at(Vector::Y * 60.0);
            let mut fields = fields(far.into(), detection);
            let guard = fields.set.insert(guard.replace_union(core));
            let objects = Tree::instances(object(), balls.map(|(_, ball)| ball));
            fields.set.insert(objects);
            for step in 0..90 {
                fields.step(&mut world).expect("a step");
                if removed && step == 20 {
                    drop(fields.set.remove(guard));
                }
            }
            let [one, other] = balls.map(|(body, _)| world.bodies[body].linvel().x);
            let place = format!("{detection:?}, {removed}: {one}, {other}");
            assert!(one < -0.5 && other > 0.5, "{place}");
            let report = fields.cross_check().expect("a report");
            assert_eq!(report.disagreed(), 0, "{place}: {report}");
        }
    }
}
