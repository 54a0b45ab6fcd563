//! The cost of each way of sampling bodies, on the same scene.
//!
//! `cargo bench --bench sampling`. Compare the ratios to "parts" within one run; each figure is that of whole steps,
//! Rapier's part included, which "Rapier alone" measures.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use rapier3d_fields::prelude::*;

/// Steps in one measured stretch.
const STRETCH: usize = 10;
const COUNT: usize = 1000;

/// Free cubes on a wide lattice, at rest, without gravity.
fn cubes() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    for i in 0..COUNT {
        let cell = [i % 10, i / 10 % 10, i / 100].map(|n| n as Real);
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::from_array(cell) * 5.0)
            .can_sleep(false);
        world.insert(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5));
    }
    // The first step builds Rapier's structures.
    world.step();
    world
}

/// An attractor whose border passes through the 100 cubes of one layer.
fn attractor(sampling: Sampling) -> Field {
    let place = Vector::splat(-15.0);
    let zone = Region::half_space(Vector::X, 20.1 - place.x);
    Field::point_gravity(1.0)
        .within(zone)
        .at(place)
        .sampled(sampling)
}

/// A uniform field in a region, whose border passes through the 100 cubes of one layer, or through
/// none.
fn wind(region: Region, sampling: Sampling) -> Field {
    Field::uniform(Vector::Y * 1e-3)
        .within(region)
        .sampled(sampling)
}

fn sampling(criterion: &mut Criterion) {
    let kinds = [
        ("parts", Sampling::Parts),
        ("centre", Sampling::Centre),
        ("volume", Sampling::Volume),
        ("surface", Sampling::Surface),
    ];
    let attractors = kinds.map(|(name, kind)| (name, attractor(kind)));
    compare(criterion, "attractor with a border, 1000 cubes", attractors);
    let (clear, across) = (Region::ball(1e3), Region::half_space(Vector::X, 20.1));
    let round = || Region::ball(1e3).at(Vector::X * -979.9);
    let winds = [
        ("centre", wind(clear.clone(), Sampling::Centre)),
        ("cut, clear of the border", wind(clear, Sampling::Auto)),
        ("cut at a plane", wind(across, Sampling::Auto)),
        ("cut at a sphere", wind(round(), Sampling::Auto)),
    ];
    compare(criterion, "wind in a region, 1000 cubes", winds);
}

fn compare<const N: usize>(criterion: &mut Criterion, name: &str, fields: [(&str, Field); N]) {
    let mut group = criterion.benchmark_group(name);
    group.bench_function("Rapier alone", |bencher| {
        let step = |world: &mut PhysicsWorld| (0..STRETCH).for_each(|_| world.step());
        bencher.iter_batched_ref(cubes, step, BatchSize::LargeInput);
    });
    for (name, field) in fields {
        group.bench_function(name, |bencher| {
            let start = || {
                let (mut world, fields) = (cubes(), Fields::new(field.clone()));
                let mut fields = fields.expect("a sound tree");
                fields.step(&mut world).expect("finite fields");
                (world, fields)
            };
            let step = |(world, fields): &mut (PhysicsWorld, Fields)| {
                for _ in 0..STRETCH {
                    fields.step(world).expect("finite fields");
                }
            };
            bencher.iter_batched_ref(start, step, BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = sampling
}
criterion_main!(benches);
