//! Variants of a scene, measured in paired rounds.

use rapier3d_fields::math::to_dvec3;
use rapier3d_fields::prelude::*;
use std::time::Instant;

pub const ROUNDS: usize = 31;

/// A variant of a scene, whose own world continues from round to round.
pub struct Variant {
    pub name: &'static str,
    work: Work,
}

enum Work {
    Loop(Box<dyn FnMut()>),
    Fields(Box<(Fields, PhysicsWorld)>),
}

impl Work {
    fn step(&mut self) {
        match self {
            Work::Loop(step) => step(),
            Work::Fields(both) => {
                let (fields, world) = &mut **both;
                fields.step(world).expect("finite fields");
            }
        }
    }
}

pub fn variant(name: &'static str, step: impl FnMut() + 'static) -> Variant {
    let work = Work::Loop(Box::new(step));
    Variant { name, work }
}

/// A variant that steps a world with fields.
pub fn stepped(name: &'static str, fields: Fields, world: PhysicsWorld) -> Variant {
    let work = Work::Fields(Box::new((fields, world)));
    Variant { name, work }
}

impl Work {
    /// The largest error of the forces of fields on some bodies against the reference, relative to the sum of the
    /// magnitudes of single fields; `None` for a loop, or if no field acts.
    fn worst_error(&self) -> Option<f64> {
        const BODIES: usize = 50;
        let Work::Fields(both) = self else {
            return None;
        };
        let (fields, world) = &**both;
        let dt = world.integration_parameters.dt;
        let wrenches = fields.sample_all(dt, world);
        let wrenches = wrenches.expect("finite fields");
        let some = wrenches.iter().step_by(wrenches.len().div_ceil(BODIES));
        let errors = some.filter_map(|(body, found)| {
            let why = fields.explain(*body, world);
            let why = why.expect("a body that fields move");
            let terms = why.contributions.iter().filter_map(|it| it.force);
            let size: f64 = terms.map(|force| to_dvec3(force).length()).sum();
            let off = to_dvec3(found.force) - to_dvec3(why.wrench.force);
            (size > 0.0).then(|| off.length() / size)
        });
        errors.reduce(f64::max)
    }
}

fn quantile(values: &[f64], part: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(part * (sorted.len() - 1) as f64).round() as usize]
}

fn quartiles(values: Vec<f64>) -> [f64; 3] {
    [0.25, 0.5, 0.75].map(|part| quantile(&values, part))
}

/// The results of some variants: times by variant and round, in µs a step.
pub struct Measured {
    names: Vec<&'static str>,
    errors: Vec<Option<f64>>,
    times: Vec<Vec<f64>>,
}

/// Makes stretches of `stretch` steps of each variant in each round, in rotating order.
pub fn measure(stretch: usize, mut variants: Vec<Variant>) -> Measured {
    let mut times = vec![Vec::new(); variants.len()];
    for round in 0..=ROUNDS {
        for turn in 0..variants.len() {
            let which = (turn + round) % variants.len();
            let start = Instant::now();
            (0..stretch).for_each(|_| variants[which].work.step());
            let micros = 1e6 * start.elapsed().as_secs_f64() / stretch as f64;
            // The first round warms up.
            if round > 0 {
                times[which].push(micros);
            }
        }
    }
    Measured {
        names: variants.iter().map(|variant| variant.name).collect(),
        errors: variants.iter().map(|it| it.work.worst_error()).collect(),
        times,
    }
}

/// Whether the arguments select a scene. Options are skipped, since `cargo bench` adds one of its own.
pub fn is_chosen(scene: &str) -> bool {
    let chosen = std::env::args().skip(1).find(|a| !a.starts_with("--"));
    chosen.is_none_or(|chosen| scene.contains(&chosen))
}

/// Measures variants and prints their times, if the scene is selected.
pub fn compare(scene: &str, stretch: usize, variants: impl FnOnce() -> Vec<Variant>) {
    if is_chosen(scene) {
        println!("{scene}");
        measure(stretch, variants()).print();
    }
}

impl Measured {
    fn place(&self, name: &str) -> usize {
        let place = self.names.iter().position(|it| *it == name);
        place.unwrap_or_else(|| panic!("no variant is called {name}"))
    }

    fn of(&self, name: &str) -> &[f64] {
        &self.times[self.place(name)]
    }

    /// The error of a variant against the reference at the end, as text.
    pub fn error(&self, name: &str) -> String {
        let error = self.errors[self.place(name)];
        error.map_or_else(|| "–".to_owned(), |error| format!("{error:.1e}"))
    }

    /// Quartiles, the median second: the time that a variant adds to the step of the first variant, over the time that
    /// the rival adds; over the whole step of the first variant, if that is the rival.
    pub fn added(&self, variant: &str, rival: &str) -> [f64; 3] {
        let alone = &self.times[0];
        let of_all = rival == self.names[0];
        let rounds = self.of(variant).iter().zip(self.of(rival)).zip(alone);
        let ratios = rounds.map(|((own, rival), alone)| {
            let whole = if of_all { 0.0 } else { *alone };
            (own - alone) / (rival - whole)
        });
        quartiles(ratios.collect())
    }

    /// Quartiles of the ratio of whole steps.
    pub fn whole(&self, variant: &str, rival: &str) -> [f64; 3] {
        let rounds = self.of(variant).iter().zip(self.of(rival));
        quartiles(rounds.map(|(own, rival)| own / rival).collect())
    }

    /// Prints every variant beside the first, and the time that fields add over the time that loops by hand add.
    pub fn print(&self) {
        for (name, own) in self.names.iter().zip(&self.times) {
            let pairs = own.iter().zip(&self.times[0]);
            let added: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
            let [low, median, high] = self.whole(name, self.names[0]);
            println!(
                "  {name:36} {:10.2} µs a step  {:+10.2} µs  × {median:.3} ({low:.3} to {high:.3})  error {}",
                quantile(own, 0.5),
                quantile(&added, 0.5),
                self.error(name),
            );
        }
        let named = |part| self.names.iter().filter(move |name| name.contains(part));
        for by_hand in named("by hand") {
            for field in named("field") {
                let [low, median, high] = self.added(field, by_hand);
                println!(
                    "  added by {field} ÷ added by {by_hand}: {median:.2} ({low:.2} to {high:.2})"
                );
            }
        }
    }
}

/// `count` free bodies on a wide lattice, at rest, without gravity.
pub fn lattice(count: usize, collider: &ColliderBuilder) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let side = (count as f64).cbrt().ceil() as usize;
    for i in 0..count {
        let cell = [i % side, i / side % side, i / side / side].map(|n| n as Real);
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::from_array(cell) * 5.0)
            .can_sleep(false);
        world.insert(body, collider.clone());
    }
    // The first step builds Rapier's structures.
    world.step();
    world
}

/// `count` balls on the [`lattice`].
pub fn balls(count: usize) -> PhysicsWorld {
    lattice(count, &ColliderBuilder::ball(0.5))
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
    stepped(name, fields.expect("a sound tree"), world)
}
