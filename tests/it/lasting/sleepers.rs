//! Random heaps: as many of them sleep as with Rapier alone, and as soon.

use super::*;
use crate::lab::random::Random;

/// Fifteen shapes of five kinds, dropped from random places into a box that is open above.
fn heap(seed: u64, restitution: f64) -> Scene {
    let stuff = Stuff {
        restitution,
        friction: 0.5,
    };
    let mut scene = Scene::new(stuff, 60);
    scene.floor();
    for (x, z) in [(2.0, 0.0), (-2.0, 0.0), (0.0, 2.0), (0.0, -2.0)] {
        let half = |along: Real| if along == 0.0 { 2.5 } else { 0.5 };
        let wall = ColliderBuilder::cuboid(half(x), 5.0, half(z));
        scene.fixed(wall.translation(Vector::new(x, 5.0, z)));
    }
    let mut random = Random::new(seed);
    for number in 0..15 {
        let mut side = || from_f64(2.0 * random.uniform() - 1.0);
        let place = Vector::new(side(), 1.0 + 0.5 * number as Real, side());
        let turn = Vector::new(side(), side(), side()) * 3.0;
        let collider = match number % 5 {
            0 => ColliderBuilder::ball(0.35),
            1 => ColliderBuilder::cuboid(0.3, 0.35, 0.4),
            2 => ColliderBuilder::capsule_y(0.25, 0.25),
            3 => ColliderBuilder::cylinder(0.3, 0.3),
            _ => ColliderBuilder::cone(0.4, 0.35),
        };
        let body = RigidBodyBuilder::dynamic().translation(place);
        scene.add(body.rotation(turn), collider);
    }
    // Rapier recycles no contact that has a hook, so recycling is off in both runs.
    scene.world.integration_parameters.contact_recycling = false;
    scene
}

const SECONDS: f64 = 15.0;

/// For each heap the times at which its bodies fell asleep, or the end of the run for bodies that are awake then.
fn asleep(seeds: u64, restitution: f64, way: Way) -> Vec<Vec<f64>> {
    let seeds = 0..seeds;
    let times = seeds.map(|seed| {
        let mut scene = heap(seed, restitution);
        let mut fields = scene.fields(way, None);
        let mut since = vec![None; scene.bodies.len()];
        for step in 0..(SECONDS * 60.0) as usize {
            match way {
                Way::Rapier => scene.world.step(),
                _ => drop(fields.step(&mut scene.world).expect("a step")),
            }
            for (since, body) in since.iter_mut().zip(&scene.bodies) {
                let sleeps = scene.world.bodies[*body].is_sleeping();
                *since = since.or(Some(step as f64 / 60.0)).filter(|_| sleeps);
            }
        }
        let times = since.into_iter().map(|it| it.unwrap_or(SECONDS));
        times.collect()
    });
    times.collect()
}

/// At each restitution at most as many heaps as with Rapier alone are awake in the end, up to chance, and half of the
/// bodies sleep as soon, up to a fifth. One body that rolls keeps its heap awake, so heaps are counted; of few heaps the medians are
/// chance.
#[test]
fn as_many_heaps_sleep_as_with_rapier_alone() {
    let seeds = 48;
    let awake = |heaps: &[Vec<f64>]| heaps.iter().filter(|it| it.contains(&SECONDS)).count() as f64;
    let median = |heaps: &[Vec<f64>]| {
        let mut times = heaps.concat();
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    for restitution in [0.3, 0.8] {
        let theirs = asleep(seeds, restitution, Way::Rapier);
        for way in FIELDS {
            let ours = asleep(seeds, restitution, way);
            let what = format!("e = {restitution}, {way:?}");
            let most = awake(&theirs) + 2.0 * awake(&theirs).sqrt() + 1.0;
            assert_at_most(awake(&ours), most, format_args!("awake, {what}"));
            let latest = 1.2 * median(&theirs);
            assert_at_most(median(&ours), latest, format_args!("asleep, {what}"));
        }
    }
}
