//! What a scene does not use must cost nothing: each part beside the same scene without it.
//!
//! `cargo bench --bench leave_out`. Ratios within one run are what counts.

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, Criterion, criterion_group, criterion_main};
use rapier3d_fields::prelude::*;

/// Steps in one measured stretch.
const STRETCH: usize = 20;

/// `count` free balls on a wide lattice, at rest, without gravity.
fn balls(count: usize) -> PhysicsWorld {
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

fn measure<S>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    make: impl Fn() -> S,
    step: impl Fn(&mut S),
) {
    group.bench_function(name, |bencher| {
        bencher.iter_batched_ref(
            || {
                let mut state = make();
                step(&mut state);
                state
            },
            |state| (0..STRETCH).for_each(|_| step(state)),
            BatchSize::LargeInput,
        );
    });
}

fn with(tree: impl Into<Tree>, scheme: Scheme, count: usize) -> (PhysicsWorld, Fields) {
    let fields = Fields::builder(tree).scheme(scheme).build();
    (balls(count), fields.expect("a sound tree"))
}

fn step((world, fields): &mut (PhysicsWorld, Fields)) {
    fields.step(world).expect("finite fields");
}

/// One uniform field against the loop that does the same by hand, and against Rapier's gravity.
fn uniform(criterion: &mut Criterion) {
    const COUNT: usize = 2000;
    let g = Vector::Y * -9.81;
    let mut group = criterion.benchmark_group("uniform field, 2000 balls");
    measure(
        &mut group,
        "Rapier's gravity",
        || {
            let mut world = balls(COUNT);
            world.gravity = g;
            world
        },
        PhysicsWorld::step,
    );
    measure(
        &mut group,
        "impulse loop by hand",
        || balls(COUNT),
        |world| {
            let dt = world.integration_parameters.dt;
            for (_, body) in world.bodies.iter_mut() {
                let impulse = g * (body.mass() * dt);
                body.apply_impulse(impulse, true);
            }
            world.step();
        },
    );
    let uniform = || Field::uniform(g).force_mode(ForceMode::Acceleration);
    measure(
        &mut group,
        "field, kick",
        || with(uniform(), Scheme::Kick, COUNT),
        step,
    );
    measure(
        &mut group,
        "field, kick-drift-kick",
        || with(uniform(), Scheme::KickDriftKick, COUNT),
        step,
    );
    group.finish();
}

/// Fields that reach nobody, and bodies that feel nothing, beside the world without fields.
fn out_of_reach(criterion: &mut Criterion) {
    const COUNT: usize = 2000;
    let mut group = criterion.benchmark_group("nothing in reach, 2000 balls");
    measure(
        &mut group,
        "Rapier alone",
        || balls(COUNT),
        PhysicsWorld::step,
    );
    let far = || {
        Field::point_gravity(1.0)
            .within(Region::ball(10.0))
            .at(Vector::X * 1e4)
    };
    measure(
        &mut group,
        "one far field",
        || with(far(), Scheme::KickDriftKick, COUNT),
        step,
    );
    let many = || {
        Tree::fold(
            Operator::SumUnion,
            (0..100).map(|i| {
                Field::drag(1.0, 0.0)
                    .within(Region::ball(10.0))
                    .at(Vector::X * (1e4 + 100.0 * i as Real))
            }),
        )
    };
    measure(
        &mut group,
        "100 far zones",
        || with(many(), Scheme::KickDriftKick, COUNT),
        step,
    );
    group.finish();
}

/// What the choice of `Auto` costs where nothing is stiff, and what stiff bodies cost.
fn choice(criterion: &mut Criterion) {
    const COUNT: usize = 2000;
    let mut group = criterion.benchmark_group("wells, 2000 balls");
    let soft = || Field::spring(1.0).force_mode(ForceMode::Acceleration);
    // dt·ω is 0.017 and, in the stiff ball that holds a few of them, 10.
    let partly = || {
        let stiff = Field::spring(3.6e5).within(Region::ball(12.0));
        soft().sum_union(stiff.force_mode(ForceMode::Acceleration))
    };
    let auto = Scheme::Auto { tolerance: 1e-2 };
    let schemes = [
        ("kick-drift-kick", Scheme::KickDriftKick),
        ("auto", auto),
        ("4 substeps", Scheme::Substep(Substeps::Fixed(4))),
        ("Suzuki's fourth order", Scheme::Suzuki4),
        ("linearly implicit", Scheme::LinearlyImplicit),
    ];
    for (name, scheme) in schemes {
        let make = || with(soft(), scheme, COUNT);
        measure(&mut group, &format!("soft, {name}"), make, step);
    }
    measure(
        &mut group,
        "stiff for some, auto",
        || with(partly(), auto, COUNT),
        step,
    );
    group.finish();
}

/// What the second order costs where forces depend on velocities: a derivative and a linear equation
/// for each body.
fn drag(criterion: &mut Criterion) {
    const COUNT: usize = 2000;
    let mut group = criterion.benchmark_group("drag, 2000 balls");
    for (name, scheme) in [
        ("kick", Scheme::Kick),
        ("kick-drift-kick", Scheme::KickDriftKick),
    ] {
        let make = || {
            let (mut world, fields) = with(Field::drag(0.1, 0.0), scheme, COUNT);
            for (_, body) in world.bodies.iter_mut() {
                body.set_linvel(Vector::X, true);
            }
            (world, fields)
        };
        measure(&mut group, name, make, step);
    }
    group.finish();
}

/// What Rapier's next step costs more after bodies were written to: its change tracking. Written
/// are velocities as they are, so that nothing else differs.
fn change_tracking(criterion: &mut Criterion) {
    const COUNT: usize = 2000;
    let mut group = criterion.benchmark_group("change tracking, 2000 balls");
    let touch = |world: &mut PhysicsWorld, every: usize| {
        let handles: Vec<_> = world.bodies.iter().map(|(handle, _)| handle).collect();
        for handle in handles.into_iter().step_by(every) {
            if let Some(body) = world.bodies.get_mut(handle) {
                let linvel = body.linvel();
                body.set_linvel(linvel, false);
            }
        }
    };
    measure(
        &mut group,
        "none written",
        || balls(COUNT),
        |world| {
            let handles: Vec<_> = world.bodies.iter().map(|(handle, _)| handle).collect();
            std::hint::black_box(handles);
            world.step();
        },
    );
    for (name, every) in [
        ("one written", COUNT),
        ("half written", 2),
        ("all written", 1),
    ] {
        measure(
            &mut group,
            name,
            || balls(COUNT),
            |world| {
                touch(world, every);
                world.step();
            },
        );
    }
    group.finish();
}

criterion_group! {
    name = leave_out;
    config = Criterion::default().sample_size(20);
    targets = uniform, out_of_reach, choice, drag, change_tracking
}
criterion_main!(leave_out);
