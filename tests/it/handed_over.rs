//! Pairs that the impulses of fields do not separate are handed over to Rapier's solver until they separate.

use rapier3d_fields::Detection;
use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_close, either, weightless};

/// The load that presses a body against the floor. Without gravity, fields cannot compute it from accelerations.
#[derive(Clone, Copy, Debug)]
enum Press {
    /// A plate that comes down at a constant speed.
    Plate,
    /// A plate that comes down in two steps of three, and goes up a little in the third.
    Sawtooth,
    /// The spring of a joint.
    Spring,
}

const HALF: Real = 0.5;
/// A little more than Rapier's allowed error, to which its solver lets bodies sink.
const SHALLOW: f64 = 0.006;

/// The state of a pair after a step.
#[derive(Clone, Copy, Debug)]
struct Moment {
    /// The overlap at the end of the step; 0 if there is none.
    depth: f64,
    /// The fields gave an impulse.
    answered: bool,
    /// The impulse of Rapier's solver.
    by_rapier: f64,
}

/// A body on a floor, under a load.
struct Scene {
    world: PhysicsWorld,
    fields: Fields,
    body: RigidBodyHandle,
    part: ColliderHandle,
    /// The floor, and the plate if there is one.
    sides: Vec<ColliderHandle>,
    plate: Option<RigidBodyHandle>,
    height: f64,
    press: Press,
    steps: usize,
}

impl Scene {
    fn new(press: Press, law: ContactLaw, detection: Detection, is_box: bool) -> Self {
        let mut world = weightless(1.0 / 60.0);
        let slab = || ColliderBuilder::cuboid(3.0, 0.5, 3.0).friction(0.0);
        let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -0.5);
        let (ground, floor) = world.insert(floor, slab());
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.51);
        let part = match is_box {
            false => ColliderBuilder::ball(HALF),
            true => ColliderBuilder::cuboid(HALF, HALF, HALF),
        };
        let part = part.mass(1.0).friction(0.0);
        let (body, part) = world.insert(body.can_sleep(false), part);
        let (mut plate, mut sides) = (None, vec![floor]);
        match press {
            Press::Plate | Press::Sawtooth => {
                let above = RigidBodyBuilder::kinematic_position_based();
                let (above, side) = world.insert(above.translation(Vector::Y * 1.55), slab());
                plate = Some(above);
                sides.push(side);
            }
            Press::Spring => {
                let spring = SpringJointBuilder::new(0.0, 400.0, 0.0)
                    .local_anchor1(Vector::Y * 0.5)
                    .contacts_enabled(true);
                world.impulse_joints.insert(ground, body, spring, true);
            }
        }
        let fields = Fields::builder(Field::contact(law).at(part)).detection(detection);
        Scene {
            world,
            fields: fields.build().expect("a valid tree"),
            body,
            part,
            sides,
            plate,
            height: 1.55,
            press,
            steps: 0,
        }
    }

    /// Makes a step, and returns the states of the pairs of the body with each side.
    fn step(&mut self) -> Vec<Moment> {
        self.height -= match (self.press, self.steps % 3) {
            (Press::Sawtooth, 2) => -0.01,
            _ => 0.02,
        };
        self.steps += 1;
        if let Some(plate) = self.plate {
            let place = Vector::Y * from_f64(self.height);
            self.world.bodies[plate].set_next_kinematic_translation(place);
        }
        self.fields.step(&mut self.world).expect("a step");
        self.sides.iter().map(|side| self.moment(*side)).collect()
    }

    fn moment(&self, side: ColliderHandle) -> Moment {
        let contacts = self.fields.contacts().iter();
        let (mut depth, mut answered) = (0.0_f64, false);
        for contact in contacts.filter(|it| it.colliders.contains(&side)) {
            answered |= contact.impulses != [Vector::ZERO; 2];
            if contact.time_of_impact.is_none() {
                depth = depth.max(to_f64(contact.depth));
            }
        }
        let pair = self.world.narrow_phase.contact_pair(side, self.part);
        Moment {
            depth,
            answered,
            by_rapier: pair.map_or(0.0, |pair| to_f64(pair.total_impulse_magnitude())),
        }
    }
}

/// Regression: only consecutive steps were counted, so Rapier's solver never got a ball that a plate squeezed down and
/// up, which went 0.36 deep into the floor in forty steps, nor one that a spring pulled, which went 0.22 deep.
#[test]
fn pairs_that_deepen_in_steps_that_are_not_consecutive_are_handed_over() {
    for (press, law) in [
        (Press::Sawtooth, ContactLaw::restitution(0.5)),
        (Press::Spring, ContactLaw::elastic()),
    ] {
        let mut scene = Scene::new(press, law, Detection::Discrete, false);
        let moments: Vec<_> = (0..40).map(|_| scene.step()[0]).collect();
        let held = |it: &Moment| it.by_rapier > 0.0 && it.depth > SHALLOW && !it.answered;
        assert!(moments.iter().any(held), "{press:?}: {moments:?}");
    }
}

/// After a pair has separated, fields answer its impacts again.
#[test]
fn fields_answer_a_pair_again_after_it_separated() {
    for law in [
        ContactLaw::restitution(0.0),
        ContactLaw::restitution(0.5),
        ContactLaw::elastic(),
    ] {
        for detection in [Detection::Discrete, Detection::Swept] {
            let mut scene =
                Scene::new(Press::Plate, ContactLaw::restitution(0.0), detection, false);
            let moments: Vec<_> = (0..12).map(|_| scene.step()[0]).collect();
            let place = format!("{law:?}, {detection:?}: {moments:?}");
            assert!(
                moments[11].by_rapier > 0.0 && !moments[11].answered,
                "{place}"
            );
            scene.height = 6.0;
            scene.step();
            let body = &mut scene.world.bodies[scene.body];
            body.set_translation(Vector::Y * 0.7, true);
            body.set_linvel(Vector::Y * -3.0, true);
            scene.fields.set.clear();
            scene.fields.set.insert(Field::contact(law).at(scene.part));
            let after: Vec<_> = (0..12).map(|_| scene.step()[0]).collect();
            let first = after.iter().find(|it| it.answered || it.by_rapier > 0.0);
            let first = first.unwrap_or_else(|| panic!("{place}: it hits the floor"));
            assert!(
                first.answered && first.by_rapier == 0.0,
                "{place}, then {after:?}"
            );
            let speed = to_f64(scene.world.bodies[scene.body].linvel().y);
            let ContactLaw::Impulse { restitution, .. } = law else {
                unreachable!()
            };
            let due = 3.0 * to_f64(restitution);
            assert_close(speed, due, either(1e-5, 1e-12), format!("{place}: speed"));
        }
    }
}
