//! Heights of rebounds under Rapier's gravity and under a field.

use super::*;

/// The heights of a ball's rebounds from a fall of two metres, within `seconds`.
fn rebounds(way: Way, restitution: f64, hertz: u32, field: bool, seconds: usize) -> Vec<f64> {
    let stuff = Stuff {
        restitution,
        friction: 0.0,
    };
    let mut scene = Scene::new(stuff, hertz);
    scene.floor();
    let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 2.5);
    scene.add(body.can_sleep(false), ColliderBuilder::ball(0.5));
    let gravity = field.then(|| {
        scene.world.gravity = Vector::ZERO;
        let gravity = Field::uniform(Vector::Y * -9.81);
        Tree::from(gravity.force_mode(ForceMode::Acceleration))
    });
    let mut fields = scene.fields(way, gravity);
    let dt = to_f64(scene.world.integration_parameters.dt);
    let (mut apexes, mut known, mut rising) = (Vec::new(), [2.0; 2], false);
    for _ in 0..seconds * hertz as usize {
        fields.step(&mut scene.world).expect("a step");
        let height = to_f64(scene.places()[0].y) - 0.5;
        let [before, last] = known;
        if rising && last > height && last > 1e-3 {
            // The apex is between steps: on the parabola through three of them.
            let slope = (height - before) / (2.0 * dt);
            apexes.push(last + slope * slope / (2.0 * 9.81));
        }
        rising = height > last || rising && height == last;
        known = [last, height];
    }
    apexes
}

#[test]
fn elastic_balls_keep_their_height() {
    for hertz in [60, 240] {
        for way in FIELDS {
            for field in [false, true] {
                let apexes = rebounds(way, 1.0, hertz, field, 60);
                let what = format!("{way:?}, {hertz} Hz, by a field {field}: {apexes:?}");
                assert!(apexes.len() > 40, "{what}");
                let off = apexes.iter().map(|apex| (apex / 2.0 - 1.0).abs());
                assert!(off.fold(0.0, f64::max) < 5e-3, "{what}");
            }
        }
    }
}

#[test]
fn each_rebound_is_as_high_as_the_law_says() {
    for hertz in [60, 240] {
        for way in FIELDS {
            for field in [false, true] {
                for restitution in [0.0, 0.3, 0.5, 0.7, 0.9] {
                    let apexes = rebounds(way, restitution, hertz, field, 20);
                    let what = format!("{way:?}, {hertz} Hz, {field}, {restitution}: {apexes:?}");
                    let mut before = 2.0;
                    // Rest and rebounds can be told apart down to a few centimetres.
                    for apex in apexes {
                        let expected = restitution * restitution * before;
                        if expected < 0.05 {
                            assert!(apex < 0.06, "{what}");
                            break;
                        }
                        assert!((apex / expected - 1.0).abs() < 0.01, "{what}");
                        before = apex;
                    }
                    assert!(before * restitution * restitution < 0.05, "{what}");
                }
            }
        }
    }
}

#[test]
fn nine_elastic_balls_in_a_well_keep_their_energy() {
    let stuff = Stuff {
        restitution: 1.0,
        friction: 0.0,
    };
    let mut scene = Scene::new(stuff, 60);
    scene.world.gravity = Vector::ZERO;
    for number in 0..9_u8 {
        let turn = Real::from(number) * 2.4;
        let place = Vector::new(turn.cos(), turn.sin() * 0.7, (turn * 0.37).sin());
        let body = RigidBodyBuilder::dynamic().can_sleep(false);
        let body = body.translation(place * (1.5 + 0.4 * Real::from(number)));
        scene.add(body, ColliderBuilder::ball(0.3).mass(1.0));
    }
    let well = Field::spring(4.0);
    let mut fields = scene.fields(Way::Swept, Some(well.into()));
    let energy = |scene: &Scene| {
        let bodies = scene.bodies.iter().map(|body| &scene.world.bodies[*body]);
        let energy = |body: &RigidBody| {
            to_f64(body.kinetic_energy()) + 2.0 * to_f64(body.translation().length_squared())
        };
        bodies.map(energy).sum::<f64>()
    };
    let (start, mut off, mut hits) = (energy(&scene), 0.0_f64, 0);
    for _ in 0..20 * 60 {
        fields.step(&mut scene.world).expect("a step");
        off = off.max((energy(&scene) / start - 1.0).abs());
        hits += fields
            .contacts()
            .iter()
            .filter(|it| it.time_of_impact.is_some())
            .count();
    }
    println!("{hits} impacts, energy off by {off}");
    assert!(hits > 50, "{hits}");
    assert!(off < 5e-3, "{off}");
}

#[test]
fn an_elastic_ball_at_rest_stays() {
    for way in FIELDS {
        let stuff = Stuff {
            restitution: 1.0,
            friction: 0.0,
        };
        let mut scene = Scene::new(stuff, 60);
        scene.floor();
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
        scene.add(body.can_sleep(false), ColliderBuilder::ball(0.5));
        let end = run(scene, way, 60.0);
        let moved = to_f64((end.scene.places()[0] - end.start[0]).length());
        assert!(moved < 2e-3, "{way:?}: {moved}");
    }
}
