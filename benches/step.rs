//! One step of the example `ammonia`, molecules in a box, by the fields and by hand.
//!
//! `cargo bench --bench step`. Each figure is the median time of a step, over stretches of a trajectory that starts
//! anew for each sample. Compare the ratios, since all figures are measured in one run. The rivals do less: they
//! neither detect contacts themselves nor keep the energy (see the README).

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, criterion_group, criterion_main};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::rivals::cell_list::CellList;
use rapier3d_fields_lab::single::rivals::vectorised::Vectorised;
use rapier3d_fields_lab::single::scenes::ammonia::{AmmoniaSettings, BoxOfAmmonia, interaction};

const CUTOFF: Real = 10.0;

/// Steps in one measured stretch.
const STRETCH: usize = 50;

fn scene(count: usize, spacing: Real) -> BoxOfAmmonia {
    let settings = AmmoniaSettings {
        count,
        spacing,
        ..AmmoniaSettings::default()
    };
    settings.build().expect("the settings are in range")
}

/// Measures stretches of steps, each from the start of the scene.
fn stretch<S>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    make: impl Fn() -> S,
    step: impl Fn(&mut S),
) {
    let warm = || {
        let mut state = make();
        // The first step builds Rapier's structures.
        step(&mut state);
        state
    };
    group.bench_function(name, |bencher| {
        bencher.iter_batched_ref(
            warm,
            |state| (0..STRETCH).for_each(|_| step(state)),
            BatchSize::LargeInput,
        );
    });
}

fn ammonia(criterion: &mut Criterion) {
    for (count, spacing, name) in [(216, 6.0, "ammonia 216"), (1000, 3.6, "ammonia 1000 dense")] {
        let mut group = criterion.benchmark_group(name);
        group.throughput(criterion::Throughput::Elements(STRETCH as u64));
        let elastic = ContactLaw::elastic();
        let with_fields = |check: bool, detect: bool| {
            let scene = scene(count, spacing);
            let tree = if detect {
                scene.tree(Some(CUTOFF), elastic)
            } else {
                interaction(scene.molecules.iter().map(|it| it.sites), Some(CUTOFF))
            };
            let builder = Fields::builder(tree).cross_check(check);
            let fields = scene.fields(builder).expect("the tree fits the scene");
            (scene, fields)
        };
        let step = |(scene, fields): &mut (BoxOfAmmonia, Fields)| {
            fields.step(&mut scene.world).expect("no field is singular");
        };
        stretch(&mut group, "fields", || with_fields(false, true), step);
        stretch(
            &mut group,
            "fields, cross-checked",
            || with_fields(true, true),
            step,
        );
        stretch(
            &mut group,
            "fields, Rapier's contacts",
            || with_fields(false, false),
            step,
        );
        stretch(
            &mut group,
            "by hand, cell list",
            || {
                let scene = scene(count, spacing);
                let forces = CellList::new(&scene, CUTOFF);
                (scene, forces)
            },
            |(scene, forces)| forces.step(&mut scene.world),
        );
        stretch(
            &mut group,
            "by hand, vectorised for this model",
            || {
                let scene = scene(count, spacing);
                let forces = Vectorised::new(&scene, CUTOFF);
                (scene, forces)
            },
            |(scene, forces)| forces.step(&mut scene.world),
        );
        stretch(
            &mut group,
            "Rapier alone",
            || scene(count, spacing),
            |scene| scene.world.step(),
        );
        group.finish();
    }
}

criterion_group! {
    name = step;
    config = Criterion::default().sample_size(20);
    targets = ammonia
}
criterion_main!(step);
