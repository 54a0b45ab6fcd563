//! Stacks, pyramids and heaps, compared with Rapier alone.

use super::*;

const STUFF: Stuff = Stuff {
    restitution: 0.5,
    friction: 0.5,
};

fn stack(count: usize, boxes: bool, hertz: u32) -> Scene {
    let mut scene = Scene::new(STUFF, hertz);
    scene.floor();
    for number in 0..count {
        let place = Vector::Y * (number as Real + 0.5);
        let collider = match boxes {
            true => ColliderBuilder::cuboid(0.5, 0.5, 0.5),
            false => ColliderBuilder::ball(0.5),
        };
        scene.add(RigidBodyBuilder::dynamic().translation(place), collider);
    }
    scene
}

fn pyramid(hertz: u32) -> Scene {
    let mut scene = Scene::new(STUFF, hertz);
    scene.floor();
    for (row, number) in (0..6).flat_map(|row| (0..6 - row).map(move |number| (row, number))) {
        let x = f64::from(number) * 1.05 + f64::from(row) * 0.525;
        let place = Vector::new(from_f64(x), row as Real + 0.5, 0.0);
        let body = RigidBodyBuilder::dynamic().translation(place);
        scene.add(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    }
    scene
}

/// A heavy box or ball on a light one. Balls would roll off, so they may not turn.
fn heavy(boxes: bool, hertz: u32) -> Scene {
    let mut scene = Scene::new(STUFF, hertz);
    scene.floor();
    for (number, density) in [1.0, 100.0].into_iter().enumerate() {
        let body = RigidBodyBuilder::dynamic().translation(Vector::Y * (number as Real + 0.5));
        let (body, collider) = match boxes {
            true => (body, ColliderBuilder::cuboid(0.5, 0.5, 0.5)),
            false => (body.lock_rotations(), ColliderBuilder::ball(0.5)),
        };
        scene.add(body, collider.density(density));
    }
    scene
}

/// Fields hold a scene as Rapier alone does: bodies rest at the same places and fall asleep as soon.
fn compare(name: &str, scene: impl Fn() -> Scene, (hertz, seconds): (u32, f64)) {
    let theirs = run(scene(), Way::Rapier, seconds);
    let theirs_at = theirs.asleep_at.expect("Rapier's rests");
    for way in FIELDS {
        let ours = run(scene(), way, seconds);
        let what = format!("{name}, {hertz} Hz, {way:?}: {ours:?} beside {theirs:?}");
        assert!(ours.gained <= 1e-4, "{what}");
        let at = ours.asleep_at.unwrap_or_else(|| panic!("awake: {what}"));
        // Without Rapier's own restitution a scene sways differently at first.
        assert!(at <= theirs_at + hertz as usize / 2, "{what}");
        for (ours, theirs) in ours.scene.places().iter().zip(theirs.scene.places()) {
            let off = *ours - theirs;
            assert!(off.y.abs() < 0.002 && off.length() < 0.01, "{what}");
        }
    }
}

fn stacks(seconds: f64) {
    for hertz in [60, 240] {
        for boxes in [false, true] {
            for count in [2, 3, 5, 10] {
                let name = format!("{count} of boxes {boxes}");
                compare(&name, || stack(count, boxes, hertz), (hertz, seconds));
            }
        }
    }
}

fn pyramids(seconds: f64) {
    for hertz in [60, 240] {
        compare("pyramid", || pyramid(hertz), (hertz, seconds));
    }
}

fn heavy_on_light(seconds: f64) {
    for hertz in [60, 240] {
        for boxes in [false, true] {
            compare("1 to 100", || heavy(boxes, hertz), (hertz, seconds));
        }
    }
}

#[test]
fn stacks_stand() {
    stacks(20.0);
}

#[test]
fn a_pyramid_stands() {
    pyramids(20.0);
}

#[test]
fn a_heavy_body_rests_on_a_light_one() {
    heavy_on_light(20.0);
}

#[test]
#[ignore = "a minute each, and ten heaps"]
fn stacks_and_heaps_stand_for_a_minute() {
    stacks(60.0);
    pyramids(60.0);
    heavy_on_light(60.0);
    for start in 1..=5 {
        for hertz in [60, 240] {
            println!("heap {start} at {hertz} Hz");
            come_to_rest((hertz, start), 60.0);
        }
    }
}

/// Fifty shapes of five kinds, dropped in layers into a box, with other rotations for each start.
fn heap((hertz, start): (u32, u8)) -> Scene {
    let stuff = Stuff {
        restitution: 0.3,
        friction: 0.5,
    };
    let mut scene = Scene::new(stuff, hertz);
    scene.floor();
    for (x, z) in [(3.0, 0.0), (-3.0, 0.0), (0.0, 3.0), (0.0, -3.0)] {
        let half = |along: Real| if along == 0.0 { 3.5 } else { 0.5 };
        let wall = ColliderBuilder::cuboid(half(x), 5.0, half(z));
        scene.fixed(wall.translation(Vector::new(x, 5.0, z)));
    }
    for number in 0..50_u8 {
        let layer = |count: u8| Real::from(number / count % 4) * 1.1 - 1.6;
        let height = Real::from(number / 16) * 1.3 + 1.0;
        let (once, twice) = (Real::from(number), Real::from(number) * Real::from(start));
        let turn = Vector::new(once * 0.3, twice * 0.2, twice - once);
        let body = RigidBodyBuilder::dynamic();
        let body = body.translation(Vector::new(layer(1), height, layer(4)));
        let collider = match number % 5 {
            0 => ColliderBuilder::ball(0.45),
            1 => ColliderBuilder::cuboid(0.4, 0.45, 0.5),
            2 => ColliderBuilder::capsule_y(0.3, 0.3),
            3 => ColliderBuilder::cylinder(0.4, 0.4),
            _ => ColliderBuilder::cone(0.5, 0.45),
        };
        scene.add(body.rotation(turn), collider);
    }
    scene
}

#[test]
fn a_heap_of_mixed_shapes_comes_to_rest() {
    come_to_rest((60, 1), 12.0);
}

fn come_to_rest(heap_of: (u32, u8), seconds: f64) {
    let energies = |way| {
        let end = run(heap(heap_of), way, seconds);
        let bodies = end
            .scene
            .bodies
            .iter()
            .map(|body| &end.scene.world.bodies[*body]);
        let moving = bodies
            .map(|body| to_f64(body.kinetic_energy()))
            .sum::<f64>();
        let low = end
            .scene
            .places()
            .iter()
            .map(|place| place.y)
            .fold(9.0, Real::min);
        println!(
            "{way:?}: {moving} left, overlap {}, asleep {:?}",
            end.overlap, end.asleep_at
        );
        assert!(low > 0.2, "{way:?}: one is through the floor: {low}");
        println!("{way:?}: energy gained {:.1e}", end.gained);
        (moving, end.overlap, end.gained)
    };
    let theirs = energies(Way::Rapier);
    for way in FIELDS {
        let (moving, overlap, gained) = energies(way);
        // Rapier itself may push shapes apart that it let overlap.
        assert!(gained <= 1e-4_f64.max(theirs.2), "{way:?}: {gained}");
        // One body that rolls keeps a heap awake, with fields and with Rapier alone.
        assert!(moving < 0.05 + theirs.0, "{way:?}: {moving}");
        assert!(overlap < 0.02 + theirs.1, "{way:?}: {overlap}");
    }
}

#[test]
fn a_box_stays_on_a_slope_by_the_friction_of_the_law() {
    for degrees in [0.0_f64, 10.0, 20.0, 25.0] {
        let place = |way, friction| {
            let stuff = Stuff {
                restitution: 0.0,
                friction,
            };
            let mut scene = Scene::new(stuff, 60);
            let (sine, cosine) = degrees.to_radians().sin_cos();
            scene.world.gravity = Vector::new(from_f64(9.81 * sine), from_f64(-9.81 * cosine), 0.0);
            scene.floor();
            let body = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.5);
            scene.add(
                body.can_sleep(false),
                ColliderBuilder::cuboid(0.5, 0.5, 0.5),
            );
            // With fields the friction of the law counts, not that of the colliders.
            if way != Way::Rapier {
                for (_, collider) in scene.world.colliders.iter_mut() {
                    collider.set_friction(0.0);
                }
            }
            let end = run(scene, way, 10.0);
            to_f64((end.scene.places()[0] - end.start[0]).length())
        };
        let theirs = place(Way::Rapier, 0.5);
        for way in FIELDS {
            let ours = place(way, 0.5);
            assert!(
                ours <= theirs + 1e-4,
                "{degrees}, {way:?}: {ours} for {theirs}"
            );
            if degrees > 0.0 {
                assert!(place(way, 0.0) > 10.0, "nothing holds it");
            }
        }
    }
}
