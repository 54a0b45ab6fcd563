//! The time of the fields in a step on one thread and on two, and whether the worlds stay the same bit for bit.
//!
//! `cargo bench --features parallel --bench threads [-- NAME]`. Rapier's own step is not in the times. Rounds
//! are paired: each stretch on one thread stands beside one on two.

use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::ammonia::{AmmoniaSettings, interaction};
use std::time::Instant;

const ROUNDS: usize = 31;

struct Run {
    world: PhysicsWorld,
    fields: Fields,
    pool: rayon::ThreadPool,
}

impl Run {
    /// Makes a step; the time of the fields in it, in seconds.
    fn step(&mut self) -> f64 {
        let (world, fields) = (&mut self.world, &mut self.fields);
        self.pool.install(|| {
            let start = Instant::now();
            let open = fields.begin(WorldMut::from(&mut *world)).expect("finite");
            let begun = start.elapsed();
            world.step_with_events(&open.hooks(&()), &());
            let start = Instant::now();
            fields.finish(open, WorldMut::from(world)).expect("finite");
            (begun + start.elapsed()).as_secs_f64()
        })
    }

    fn places(&self) -> Vec<Pose> {
        let bodies = self.world.bodies.iter();
        bodies.map(|(_, body)| *body.position()).collect()
    }
}

fn median(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|part| values[(part * (values.len() - 1) as f64).round() as usize])
}

fn compare(name: &str, scene: impl Fn() -> (PhysicsWorld, Fields)) {
    let chosen = std::env::args().skip(1).find(|a| !a.starts_with("--"));
    if chosen.is_some_and(|chosen| !name.contains(&chosen)) {
        return;
    }
    let mut runs = [1, 2].map(|threads| {
        let (world, fields) = scene();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        Run {
            world,
            fields,
            pool,
        }
    });
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..=ROUNDS {
        for turn in 0..2 {
            let which = (round + turn) % 2;
            let time = runs[which].step();
            // The first round warms up.
            if round > 0 {
                times[which].push(time);
            }
        }
    }
    let same = runs[0].places() == runs[1].places();
    let ratios = times[0].iter().zip(&times[1]).map(|(one, two)| one / two);
    let [low, ratio, high] = median(ratios.collect());
    let [one, two] = times.map(|times| median(times)[1] * 1e6);
    println!(
        "{name:34} {one:10.0} µs on one thread, {two:10.0} on two: {ratio:.2} times as fast ({low:.2} to {high:.2}), \
         the same bits: {same}"
    );
}

/// Balls on a wide lattice that fly slowly, some of which carry fields.
fn balls(count: usize, tree: impl Fn(&[RigidBodyHandle]) -> Tree) -> (PhysicsWorld, Fields) {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let side = (count as f64).cbrt().ceil() as usize;
    let mut bodies = Vec::new();
    for i in 0..count {
        let cell = [i % side, i / side % side, i / side / side].map(|n| n as Real);
        let body = RigidBodyBuilder::dynamic().translation(Vector::from_array(cell) * 5.0);
        let body = body.linvel(Vector::new(0.05, 0.02, -0.03)).can_sleep(false);
        let (body, _) = world.insert(body, ColliderBuilder::ball(0.5));
        bodies.push(body);
    }
    let fields = Fields::new(tree(&bodies)).expect("a sound tree");
    (world, fields)
}

fn molecules(count: usize, spacing: Real) -> (PhysicsWorld, Fields) {
    let settings = AmmoniaSettings {
        count,
        spacing,
        ..AmmoniaSettings::default()
    };
    let scene = settings.build().expect("the settings are in range");
    let tree = interaction(scene.molecules.iter().map(|it| it.sites), Some(10.0));
    let fields = scene.fields(Fields::builder(tree)).expect("it fits");
    (scene.world, fields)
}

fn each(bodies: &[RigidBodyHandle], every: usize, field: &Field) -> Tree {
    let carriers = bodies.iter().step_by(every);
    Tree::fold(
        Operator::SumUnion,
        carriers.map(|body| field.clone().at(*body)),
    )
}

fn main() {
    compare("liquid, 1,000 molecules", || molecules(1_000, 3.6));
    compare("liquid, 10,000 molecules", || molecules(10_000, 3.6));
    compare("gas, 10,000 molecules", || molecules(10_000, 20.0));
    let gravity = Field::point_gravity(1.0);
    compare("all pairs, 10,000 balls", || {
        balls(10_000, |bodies| each(bodies, 1, &gravity))
    });
    let far = gravity.clone().opening_angle(0.5);
    compare("cells, 20,000 balls", || {
        balls(20_000, |bodies| each(bodies, 1, &far))
    });
    let zone = Field::radial(-1.0, -2.0).within(Region::ball(6.0));
    compare("1,000 moving zones, 10,000 balls", || {
        balls(10_000, |bodies| each(bodies, 10, &zone))
    });
    compare("quadratic drag, 10,000 balls", || {
        balls(10_000, |_| Field::drag(0.1, 0.1).into())
    });
    compare("nothing much, 100 balls", || {
        balls(100, |_| Field::drag(0.1, 0.1).into())
    });
}
