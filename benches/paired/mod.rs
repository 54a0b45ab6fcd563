//! Variants of a scene, measured in paired rounds.

use rapier3d_fields::prelude::*;
use std::time::Instant;

const ROUNDS: usize = 31;

/// A world of its own that goes on from round to round.
pub struct Variant {
    pub name: &'static str,
    step: Box<dyn FnMut()>,
}

pub fn variant(name: &'static str, step: impl FnMut() + 'static) -> Variant {
    let step = Box::new(step);
    Variant { name, step }
}

fn quantile(values: &[f64], part: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(part * (sorted.len() - 1) as f64).round() as usize]
}

/// Makes stretches of `stretch` steps of each of `variants`, and prints what they take.
pub fn compare(scene: &str, stretch: usize, variants: impl FnOnce() -> Vec<Variant>) {
    // `cargo bench` adds an option of its own.
    let chosen = std::env::args().skip(1).find(|a| !a.starts_with("--"));
    if chosen.is_some_and(|chosen| !scene.contains(&chosen)) {
        return;
    }
    let mut variants = variants();
    let mut times = vec![Vec::new(); variants.len()];
    for round in 0..=ROUNDS {
        for turn in 0..variants.len() {
            let which = (turn + round) % variants.len();
            let start = Instant::now();
            (0..stretch).for_each(|_| (variants[which].step)());
            let micros = 1e6 * start.elapsed().as_secs_f64() / stretch as f64;
            // The first round warms up.
            if round > 0 {
                times[which].push(micros);
            }
        }
    }
    println!("{scene}");
    for (variant, own) in variants.iter().zip(&times) {
        let pairs = own.iter().zip(&times[0]);
        let ratios: Vec<f64> = pairs.clone().map(|(a, b)| a / b).collect();
        let added: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        println!(
            "  {:36} {:10.2} µs a step  {:+10.2} µs  × {:.3} ({:.3} to {:.3})",
            variant.name,
            quantile(own, 0.5),
            quantile(&added, 0.5),
            quantile(&ratios, 0.5),
            quantile(&ratios, 0.25),
            quantile(&ratios, 0.75),
        );
    }
    compare_added(&variants, &times);
}

/// What the fields add to Rapier's step, over what the loops by hand add.
fn compare_added(variants: &[Variant], times: &[Vec<f64>]) {
    let named = |part| {
        let all = variants.iter().zip(times);
        all.filter(move |(variant, _)| variant.name.contains(part))
    };
    for (by_hand, rival) in named("by hand") {
        for (field, own) in named("field") {
            let rounds = own.iter().zip(rival).zip(&times[0]);
            let ratios = rounds.map(|((own, rival), alone)| (own - alone) / (rival - alone));
            let ratios: Vec<f64> = ratios.collect();
            let [low, median, high] = [0.25, 0.5, 0.75].map(|part| quantile(&ratios, part));
            let [field, by_hand] = [field.name, by_hand.name];
            println!(
                "  added by {field} ÷ added by {by_hand}: {median:.2} ({low:.2} to {high:.2})"
            );
        }
    }
}

/// `count` free balls on a wide lattice, at rest, without gravity.
pub fn balls(count: usize) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let side = (count as f64).cbrt().ceil() as usize;
    for i in 0..count {
        let cell = [i % side, i / side % side, i / side / side].map(|n| n as Real);
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::from_array(cell) * 5.0)
            .can_sleep(false);
        world.insert(body, ColliderBuilder::ball(0.5));
    }
    // The first step builds Rapier's structures.
    world.step();
    world
}

pub fn alone(mut world: PhysicsWorld) -> Variant {
    variant("Rapier alone", move || world.step())
}

pub fn with(
    name: &'static str,
    world: PhysicsWorld,
    tree: impl Into<Tree>,
    scheme: Scheme,
) -> Variant {
    let fields = Fields::builder(tree).scheme(scheme).build();
    let mut fields = fields.expect("a sound tree");
    let mut world = world;
    variant(name, move || {
        fields.step(&mut world).expect("finite fields");
    })
}
