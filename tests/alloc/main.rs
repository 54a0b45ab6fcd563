//! A step allocates nothing once it has warmed up: no more than Rapier's own step in the same world.
//!
//! The allocator counts on the thread of the test only. Rapier's contacts allocate, so no bodies touch here.

#[cfg(feature = "f64")]
extern crate rapier3d_fields_f64 as rapier3d_fields;

use std::alloc::{GlobalAlloc, Layout, System};
use std::backtrace::Backtrace;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;

use rapier3d_fields::prelude::*;

/// The system's allocator, with a count of allocations.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
    /// Whether the callers of allocations are recorded.
    static TRACED: Cell<bool> = const { Cell::new(false) };
    static CALLERS: RefCell<BTreeMap<String, usize>> = const { RefCell::new(BTreeMap::new()) };
}

fn count() {
    // A thread may allocate while it ends, after its counter is gone.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
    if TRACED.try_with(|traced| traced.replace(false)) == Ok(true) {
        let trace = Backtrace::force_capture().to_string();
        CALLERS.with_borrow_mut(|callers| *callers.entry(caller(&trace)).or_default() += 1);
        TRACED.set(true);
    }
}

/// The innermost functions of this crate on the stack, innermost first.
fn caller(trace: &str) -> String {
    let names = trace
        .lines()
        .filter_map(|line| line.trim().split_once(": "));
    let ours = names.filter(|(_, name)| name.contains("rapier3d_fields"));
    let ours = ours.take(3).map(|(_, name)| name);
    ours.collect::<Vec<_>>().join(" < ")
}

/// The functions of this crate that allocate in `work`, each with its number of allocations.
fn callers(work: impl FnOnce()) -> Vec<(usize, String)> {
    TRACED.set(true);
    work();
    TRACED.set(false);
    let callers = CALLERS.take().into_iter();
    let mut callers: Vec<_> = callers.map(|(caller, count)| (count, caller)).collect();
    callers.retain(|(_, caller)| !caller.is_empty());
    callers.sort_unstable_by(|a, b| b.cmp(a));
    callers.truncate(12);
    callers
}

// SAFETY: every call is passed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// How often `work` allocates.
fn allocations(work: impl FnOnce()) -> usize {
    let before = COUNT.get();
    work();
    COUNT.get() - before
}

const WARM_UP: usize = 100;
const STEPS: usize = 100;
/// Additional allocations allowed in all steps: Rapier's own lists grow at other moments if bodies move differently.
const SLACK: usize = 5;
/// Balls along an edge of the lattice of [`balls`].
const EDGE: i32 = 5;

/// Small balls on a lattice that move in all directions and stay far from each other.
fn balls() -> (PhysicsWorld, Vec<(RigidBodyHandle, ColliderHandle)>) {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let places = (0..EDGE.pow(3)).map(|i| [i % EDGE, i / EDGE % EDGE, i / EDGE / EDGE]);
    let balls = places.map(|place| {
        let at = Vector::from_array(place.map(|i| i as Real * 1.5));
        let swing = Vector::new(at.z.sin(), at.x.sin(), at.y.sin());
        let body = RigidBodyBuilder::dynamic()
            .translation(at)
            .linvel(swing * 0.02)
            .angvel(swing)
            .can_sleep(false);
        world.insert(body, ColliderBuilder::ball(0.05).mass(1.0))
    });
    let balls = balls.collect();
    (world, balls)
}

/// A step with every body written to before and after: Rapier's list of such bodies grows anew after each step.
fn loop_by_hand(world: &mut PhysicsWorld) {
    let write = |world: &mut PhysicsWorld| {
        for (_, body) in world.bodies.iter_mut() {
            let linvel = body.linvel();
            body.set_linvel(linvel, false);
        }
    };
    write(world);
    world.step();
    write(world);
}

/// Steps without fields, then with them, after a warm-up. Returns a report if fields allocate more.
fn compared(tree: &Tree, world: &dyn Fn() -> PhysicsWorld, scheme: Scheme) -> Option<String> {
    let mut bare = world();
    (0..WARM_UP).for_each(|_| loop_by_hand(&mut bare));
    let without = allocations(|| (0..STEPS).for_each(|_| loop_by_hand(&mut bare)));

    let mut world = world();
    let mut fields = Fields::builder(tree.clone())
        .scheme(scheme)
        .build()
        .expect("a valid tree");
    let mut steps = |count: usize| {
        for _ in 0..count {
            fields.step(&mut world).expect("a finite step");
        }
    };
    steps(WARM_UP);
    let with = allocations(|| steps(STEPS));
    let pairs = world.narrow_phase.contact_pairs().count();
    assert_eq!(pairs, 0, "the scene is one without contacts");
    (with > without + SLACK).then(|| {
        let callers = callers(|| fields.step(&mut world).map(drop).expect("a finite step"));
        let lines = callers
            .iter()
            .map(|(count, caller)| format!("\n  {count:5} in {caller}"));
        let lines: String = lines.collect();
        format!("{scheme:?}: {with} allocations, {without} by hand; in one step{lines}")
    })
}

const SCHEMES: [Scheme; 8] = [
    Scheme::KickDriftKick,
    Scheme::Kick,
    Scheme::ExternalForce,
    Scheme::substeps(3),
    // So strict that some bodies take substeps, in some scenes.
    Scheme::Substep(Substeps::PerBody { tolerance: 1e-6 }),
    Scheme::LinearlyImplicit,
    Scheme::Forward4,
    Scheme::auto(1e-6),
];

/// Fails unless the steps of each scheme allocate no more than a loop by hand.
fn assert_free(tree: &Tree, world: &dyn Fn() -> PhysicsWorld) {
    let wrong = SCHEMES
        .into_iter()
        .filter_map(|scheme| compared(tree, world, scheme));
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "in {STEPS} steps:\n{}", wrong.join("\n"));
}

fn all_balls() -> PhysicsWorld {
    balls().0
}

#[test]
fn allocations_are_counted() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1)))), 1);
    assert_eq!(allocations(|| drop(Vec::<u8>::new())), 0);
}

#[test]
fn a_uniform_field() {
    let tree = Field::uniform(Vector::Y * 0.01);
    assert_free(&tree.into(), &all_balls);
}

#[test]
fn expressions() {
    let texts = [
        "-0.01*x/(x^2 + 1)",
        "if(y < 3, 1e-3, -1e-3)*y",
        "abs(atan2(min(x, y, 1), hypot(z, vx) + 1))^2.5*1e-3",
    ];
    assert_free(&Field::expression(texts).into(), &all_balls);
}

#[test]
fn point_gravity_in_a_region() {
    let between_balls = Vector::splat(0.75);
    let tree = Field::point_gravity(0.01).within(Region::ball(5.0));
    assert_free(&tree.at(between_balls).into(), &all_balls);
}

#[test]
fn drag() {
    assert_free(&Field::drag(0.1, 0.1).into(), &all_balls);
}

/// A composite that takes a program, around every tenth ball.
#[test]
fn instances_of_a_composite() {
    let pull = Field::radial(-1e-3, 0.0).within(Region::ball(2.0));
    let push = Field::radial(1e-3, 0.0).within(Region::ball(1.0));
    let (_, balls) = balls();
    let bodies = balls.into_iter().map(|ball| ball.0).step_by(10);
    let tree = Tree::instances(pull.replace_union(push), bodies);
    assert_free(&tree, &all_balls);
}

/// Unlike fields on bodies, enough to be found by a hierarchy, which is rebuilt from time to time.
#[test]
fn unlike_fields_that_move() {
    let (_, balls) = balls();
    let spring = |(k, ball): (usize, (RigidBodyHandle, _))| {
        let region = Region::ball(1.0 + k as Real * 0.01);
        Field::spring(1e-4).within(region).at(ball.0)
    };
    let springs = balls.into_iter().take(40).enumerate().map(spring);
    assert_free(&Tree::fold(Operator::SumUnion, springs), &all_balls);
}

/// Every ball acts on its neighbours, whose list is rebuilt from time to time.
#[test]
fn a_gas_of_pairs() {
    let (_, balls) = balls();
    let law = |collider| {
        Field::lennard_jones(1e-4, 1.0)
            .within(Region::ball(3.0))
            .at(collider)
    };
    let fields = balls.into_iter().map(|ball| law(ball.1));
    assert_free(&Tree::fold(Operator::SumUnion, fields), &all_balls);
}

/// If a carrier moves otherwise than by forces, fields are evaluated anew before each step, and bodies examined ahead.
#[test]
fn a_field_on_a_kinematic_body() {
    let world = || {
        let mut world = all_balls();
        let led = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::X * 0.1);
        let led = world.bodies.insert(led);
        (world, led)
    };
    let spring = Field::spring(0.1).within(Region::ball(5.0));
    assert_free(&spring.at(world().1).into(), &|| world().0);
}

/// Rotating cuboids.
fn boxes() -> PhysicsWorld {
    let (mut world, balls) = balls();
    for (_, collider) in balls {
        world.colliders[collider].set_shape(SharedShape::cuboid(0.05, 0.08, 0.1));
    }
    world
}

/// Sampled at points of their surfaces.
#[test]
fn boxes_in_wind() {
    let wind = Field::wind(Vector::X * 0.1, 1.0, 0.5);
    assert_free(&wind.into(), &boxes);
}

/// Sampled at points of their volumes where the border passes through them.
#[test]
fn boxes_on_a_border() {
    let pull = Field::point_gravity(0.01).within(Region::ball(3.0));
    let pull = pull.sampled(Sampling::Volume);
    assert_free(&pull.at(Vector::splat(0.75)).into(), &boxes);
}

/// Cut at planes and spheres, where they stand and as they turn.
#[test]
fn boxes_and_balls_cut_at_borders() {
    let wind = || Field::uniform(Vector::Y * 0.01);
    let layer = wind().within(Region::cuboid(Vector::new(20.0, 20.0, 0.02)));
    let round = wind().within(Region::ball(4.0)).at(Vector::X * -4.0);
    let water = Field::buoyancy(1e-3, 0.1).at(Vector::Y * 1.52);
    let tree = Tree::from(layer).replace_union(round).sum_union(water);
    assert_free(&tree, &boxes);
    assert_free(&tree, &all_balls);
}
