//! The side that answers a contact, over the life of a ball on a floor: impacts, rest, sleep, lift-off, and edits.

use super::*;

/// The sides that acted on the ball in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Answer {
    Neither,
    Fields,
    Rapier,
    Both,
    Asleep,
}

/// A ball above a floor.
struct Life {
    scene: Scene,
    fields: Fields,
}

impl Life {
    fn new(way: Way) -> Self {
        let mut scene = Scene::new(
            Stuff {
                restitution: 0.5,
                friction: 0.3,
            },
            60,
        );
        scene.floor();
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 1.5);
        scene.add(body, ColliderBuilder::ball(0.5));
        let fields = scene.fields(way, None);
        Life { scene, fields }
    }

    fn ball(&mut self) -> &mut RigidBody {
        &mut self.scene.world.bodies[self.scene.bodies[0]]
    }

    fn step(&mut self) -> Answer {
        self.fields.step(&mut self.scene.world).expect("a step");
        if self.ball().is_sleeping() {
            return Answer::Asleep;
        }
        let mut found = self.fields.contacts().iter();
        let fields = found.any(|it| it.impulses != [Vector::ZERO; 2]);
        let mut pairs = self.scene.world.narrow_phase.contact_pairs();
        match (fields, pairs.any(|it| it.total_impulse_magnitude() > 0.0)) {
            (false, false) => Answer::Neither,
            (true, false) => Answer::Fields,
            (false, true) => Answer::Rapier,
            (true, true) => Answer::Both,
        }
    }

    /// The answers of the steps until the ball has fallen asleep, without repetitions.
    fn until_asleep(&mut self) -> Vec<Answer> {
        let mut answers: Vec<_> = (0..600).map(|_| self.step()).collect();
        answers.dedup();
        assert_eq!(answers.last(), Some(&Answer::Asleep), "{answers:?}");
        answers
    }

    /// Throws the ball up.
    fn lift(&mut self) {
        let impulse = Vector::Y * (self.ball().mass() * 4.0);
        self.ball().apply_impulse(impulse, true);
    }
}

/// Flights that end with impacts, then rest.
fn is_a_bouncing_ball(answers: &[Answer], impacts: Answer) -> bool {
    let [flights @ .., rest, asleep] = answers else {
        return false;
    };
    let is_one = |flight: &[Answer]| flight == [Answer::Neither, impacts];
    let flights = flights.strip_suffix(&[Answer::Neither]).unwrap_or(flights);
    let ends = [*rest, *asleep] == [Answer::Rapier, Answer::Asleep];
    flights.len() >= 4 && flights.chunks(2).all(is_one) && ends
}

#[test]
fn each_step_of_a_contact_has_one_owner() {
    for way in FIELDS {
        let mut life = Life::new(way);
        let fallen = life.until_asleep();
        assert!(
            is_a_bouncing_ball(&fallen, Answer::Fields),
            "{way:?} {fallen:?}"
        );
        life.lift();
        let lifted = life.until_asleep();
        assert!(
            is_a_bouncing_ball(&lifted, Answer::Fields),
            "{way:?} {lifted:?}"
        );
        // Without its fields a pair is Rapier's.
        let tree = life.fields.set.tree();
        life.fields.set.clear();
        life.lift();
        let without = life.until_asleep();
        assert!(!without.contains(&Answer::Fields), "{way:?} {without:?}");
        assert!(!without.contains(&Answer::Both), "{way:?} {without:?}");
        life.fields.set.insert(tree);
        life.lift();
        let again = life.until_asleep();
        assert!(
            is_a_bouncing_ball(&again, Answer::Fields),
            "{way:?} {again:?}"
        );
        assert!(life.fields.warnings().is_empty());
    }
}
