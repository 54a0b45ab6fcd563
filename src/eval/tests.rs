//! One suite of tests for every evaluator; see [`BatchEvaluator`].

use fearless_simd::Level;

use super::constants::Constants;
use super::contract::{BatchEvaluator, Summing, Sums};
use super::frames::FrameCache;
use super::one_way::OneWayRadials;
use super::pairwise::PairwiseRadials;
use super::programs::Programs;
use super::radial::Radials;
use super::sampled_world::SampledWorld;
use crate::Fields;
use crate::bridge::{WorldRef, is_movable};
use crate::compile::{Compiled, ConstantField, Ordered, Program, RadialBatch};
use crate::diagnose::SampledFields;
use crate::field::region::Region;
use crate::field::{Anchor, ColliderProperties, Field, FieldSet, ForceMode, Lifetime, Span, Tree};
use crate::integrate::Scheme;
use crate::math::{Pose, Real, Vector, to_dvec3, to_f64};
use crate::number::FORCED;
use crate::pipeline::{FieldSettings, FieldState};
use crate::rapier::prelude::{
    ColliderBuilder, PhysicsWorld, RigidBody, RigidBodyBuilder, RigidBodyHandle,
};
use crate::rigid::{Body, Lookup, Wrench};
use crate::sample::{Gatherer, Moment, Properties, Samples};

mod linearised;

/// Fields, and a world of bodies on which they act.
struct Stage {
    set: FieldSet,
    compiled: Compiled,
    world: PhysicsWorld,
    time: f64,
}

/// Two bodies of two balls each, one of a single ball, and a box.
fn world() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    let places = [[0.0, 0.0, 0.0], [2.5, 0.5, 0.0], [-1.0, 2.0, 1.5]];
    for (number, place) in places.into_iter().enumerate() {
        let body = RigidBodyBuilder::dynamic()
            .translation(Vector::from_array(place.map(|x: f64| x as Real)))
            .linvel(Vector::new(0.5, -0.25, number as Real))
            .angvel(Vector::new(0.0, 1.0, -0.5));
        let body = world.insert_body(body);
        for x in [-0.5, 0.5]
            .into_iter()
            .take(if number == 2 { 1 } else { 2 })
        {
            let ball = ColliderBuilder::ball(0.25)
                .translation(Vector::X * x)
                .mass(2.0);
            world.insert_collider(ball, Some(body));
        }
    }
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::new(1.0, -2.0, 0.5))
        .rotation(Vector::new(0.3, -0.5, 0.2));
    let body = world.insert_body(body);
    world.insert_collider(
        ColliderBuilder::cuboid(0.5, 0.25, 0.125).mass(3.0),
        Some(body),
    );
    weigh(&mut world);
    world
}

/// Computes the masses, as Rapier does in its first step.
fn weigh(world: &mut PhysicsWorld) {
    let PhysicsWorld {
        bodies, colliders, ..
    } = world;
    for (_, body) in bodies.iter_mut() {
        body.recompute_mass_properties_from_colliders(colliders);
    }
}

impl Stage {
    fn new(fields: fn(&PhysicsWorld) -> Vec<Tree>) -> Self {
        Stage::of(world(), fields)
    }

    fn of(world: PhysicsWorld, fields: fn(&PhysicsWorld) -> Vec<Tree>) -> Self {
        let mut set = FieldSet::new();
        for (number, (collider, _)) in world.colliders.iter().enumerate() {
            let charge = ColliderProperties::new().charge(number as Real - 2.0);
            set.set_properties(collider, charge).expect("finite");
        }
        for tree in fields(&world) {
            set.insert(tree);
        }
        set.validate_changes().expect("valid");
        Stage {
            compiled: Compiled::new(&set),
            set,
            world,
            time: 0.0,
        }
    }

    fn handles(&self) -> Vec<RigidBodyHandle> {
        self.world.bodies.iter().map(|(handle, _)| handle).collect()
    }

    fn samples(&self) -> Samples {
        let view = WorldRef::new(&self.world.bodies, &self.world.colliders);
        let movable = view.bodies().filter(|(_, body)| is_movable(body));
        let bodies: Vec<Body> = movable
            .map(|(handle, body)| Body::of(handle, body))
            .collect();
        let mut properties = Properties::default();
        properties.update(&self.set);
        let mut samples = Samples::default();
        let wanted = self.compiled.requirements;
        Gatherer::default().make(&mut samples, &properties, wanted, &bodies, &view);
        samples.place(&bodies);
        samples
    }

    fn moment(&self) -> Moment {
        Moment {
            time: self.time,
            dt: 0.5,
            span: Span::at(self.time),
        }
    }

    /// The wrenches that an evaluator adds to sums that begin with `start`.
    fn evaluate<B: ?Sized>(
        &self,
        evaluator: &mut impl BatchEvaluator<B>,
        batches: fn(&Compiled) -> Vec<(u32, &B)>,
        start: Real,
    ) -> Vec<Wrench> {
        let samples = self.samples();
        let view = WorldRef::new(&self.world.bodies, &self.world.colliders);
        let mut frames = FrameCache::default();
        frames.clear(&self.compiled);
        let scene = SampledWorld::new(&self.compiled, &view, &samples, self.moment());
        let mut forces = vec![Vector::splat(start); samples.sites.len()];
        let begun = Wrench {
            force: Vector::splat(start),
            torque: Vector::ZERO,
        };
        let mut wrenches = vec![begun; samples.bodies.len()];
        let mut on = Summing {
            scene: &scene,
            frames: &mut frames,
            sums: Sums {
                forces: &mut forces,
                wrenches: &mut wrenches,
                slowings: None,
            },
        };
        evaluator.begin(&mut on);
        for (number, batch) in batches(&self.compiled) {
            evaluator.add(number, batch, &mut on);
        }
        for wrench in &mut wrenches {
            wrench.force -= Vector::splat(start);
        }
        for (sample, force) in samples.sites.iter().zip(forces) {
            let wrench = &mut wrenches[sample.body as usize];
            let added = force - Vector::splat(start);
            wrench.force += added;
            wrench.torque += sample.arm.cross(added);
        }
        wrenches
    }

    fn reference(&self) -> Vec<Wrench> {
        let samples = self.samples();
        let view = WorldRef::new(&self.world.bodies, &self.world.colliders);
        let bodies = 0..samples.bodies.len() as u32;
        let fields = SampledFields::new(&self.set, &view, &samples, self.moment());
        let explained = bodies.map(|body| fields.explain(body));
        explained.map(|explanation| explanation.wrench).collect()
    }
}

#[track_caller]
fn agree(found: &[Wrench], want: &[Wrench], scale: f64) {
    assert_eq!(found.len(), want.len());
    for (found, want) in found.iter().zip(want) {
        let error = to_dvec3(found.force - want.force).length()
            + to_dvec3(found.torque - want.torque).length();
        let bound = 512.0 * to_f64(Real::EPSILON) * scale;
        assert!(
            error <= bound,
            "{found:?}, reference {want:?}: {error:e} > {bound:e}"
        );
    }
}

fn size(wrenches: &[Wrench]) -> f64 {
    let size = |w: &Wrench| to_dvec3(w.force).length() + to_dvec3(w.torque).length();
    wrenches.iter().map(size).fold(1.0, f64::max)
}

fn bits(wrenches: &[Wrench]) -> Vec<[u64; 6]> {
    let numbers = |w: &Wrench| {
        let [a, b] = [w.force, w.torque].map(|v| to_dvec3(v).to_array().map(f64::to_bits));
        [a[0], a[1], a[2], b[0], b[1], b[2]]
    };
    wrenches.iter().map(numbers).collect()
}

fn constants(_: &PhysicsWorld) -> Vec<Tree> {
    let field = |vector, mode| Tree::from(Field::uniform(vector).force_mode(mode));
    vec![
        field(Vector::new(1.0, 2.0, 3.0), ForceMode::Force),
        field(Vector::Y * -9.81, ForceMode::Acceleration),
        field(Vector::X * 0.25, ForceMode::VelocityChange),
    ]
}

/// Radial fields on colliders, on bodies and on the world, with and without a range.
fn radials(world: &PhysicsWorld) -> Vec<Tree> {
    let mut all = Vec::new();
    for (number, (collider, _)) in world.colliders.iter().enumerate() {
        let charge = number as Real - 1.5;
        all.push(Field::coulomb(1.0, charge).at(collider).into());
        let law = Field::lennard_jones(0.5, 1.0)
            .shifted_to_zero_at(3.0)
            .at(collider);
        all.push(law.into());
    }
    for (body, _) in world.bodies.iter() {
        all.push(Field::point_gravity(0.5).softened(0.5).at(body).into());
    }
    for k in 0..70 {
        let place = Vector::new(k as Real * 0.1 - 3.4, 0.3, (k % 7) as Real * 0.3);
        let star = Field::radial(0.1, -1.0).within(Region::ball(1.4)).at(place);
        all.push(star.lifetime(Lifetime::between(0.0, 1.0)).into());
    }
    all
}

/// Very many sources on bodies and the world, with an angle at which no cell acts as a whole.
fn far(world: &PhysicsWorld) -> Vec<Tree> {
    let pull = |k: usize| Field::point_gravity(0.01 * k as Real).opening_angle(1e-6);
    let still = (0..600).map(|k| {
        let place = [k % 7, k % 11, k % 13].map(|n| n as Real * 0.37 - 2.0);
        pull(k).softened(0.25).at(Vector::from_array(place))
    });
    let bodies: Vec<RigidBodyHandle> = world.bodies.iter().map(|(handle, _)| handle).collect();
    let carried = (0..600).map(|k| {
        let handle = bodies[k % bodies.len()];
        let way = [k % 5, k % 9, k % 17].map(|n| n as Real * 0.21 - 1.0);
        let local_pose = Pose::from_translation(Vector::from_array(way));
        pull(k)
            .softened(0.5)
            .at(Anchor::Body { handle, local_pose })
    });
    still.chain(carried).map(Tree::from).collect()
}

/// Composites, instances, fields that react, fields that are off, and many different fields.
fn programs(world: &PhysicsWorld) -> Vec<Tree> {
    let bodies: Vec<RigidBodyHandle> = world.bodies.iter().map(|(handle, _)| handle).collect();
    let pull = Field::radial(-1.0, 0.0).within(Region::ball(4.1));
    let push = Field::radial(10.0, 0.0).within(Region::ball(1.3));
    let mut all = vec![
        Tree::instances(pull.replace_union(push), bodies.iter().copied()),
        Tree::from(Field::spring(2.0).reacting().at(bodies[0])),
        Field::drag(0.5, 0.1)
            .sum_union(Field::spring(1.0))
            .limited_to(3.0),
        Field::uniform(Vector::Z)
            .within(Region::ball(2.7))
            .scaled_by(0.5)
            .into(),
        Tree::from(Field::spring(1.0).lifetime(Lifetime::between(0.0, 1.0))),
        Tree::from(Field::spring(9.0).enabled(false)),
    ];
    for k in 0..60 {
        let place = Pose::from_translation(Vector::X * (k as Real * 0.1 - 3.0));
        let zone = Region::ball(0.9 + k as Real * 0.01);
        all.push(
            Field::uniform(Vector::Y * k as Real)
                .within(zone)
                .at(place)
                .into(),
        );
    }
    all
}

fn all_constants(compiled: &Compiled) -> Vec<(u32, &[ConstantField])> {
    vec![(0, &compiled.constants[..])]
}

fn all_radials(compiled: &Compiled) -> Vec<(u32, &Ordered<RadialBatch>)> {
    vec![(0, &compiled.radials)]
}

fn all_programs(compiled: &Compiled) -> Vec<(u32, &Program)> {
    let programs = compiled.programs.iter();
    programs.filter(|(_, program)| program.has_force).collect()
}

macro_rules! keeps_the_contract {
    ($($name:ident: $fresh:expr, $fields:expr, $batches:expr;)*) => {$(
        mod $name {
            use super::*;

            #[test]
            fn adds_what_the_reference_gives() {
                let mut stage = Stage::new($fields);
                assert!(!$batches(&stage.compiled).is_empty());
                // Before, within and after the lifetimes.
                for time in [-0.5, 0.25, 1.0] {
                    stage.time = time;
                    let want = stage.reference();
                    let found = stage.evaluate(&mut $fresh, $batches, 0.0);
                    agree(&found, &want, size(&want));
                    let more = stage.evaluate(&mut $fresh, $batches, 8.0);
                    agree(&more, &want, 60.0 + size(&want));
                }
            }

            #[test]
            fn leaves_out_fields_of_removed_bodies() {
                let mut stage = Stage::new($fields);
                let gone = stage.handles()[1];
                stage.world.remove_body(gone);
                let want = stage.reference();
                let found = stage.evaluate(&mut $fresh, $batches, 0.0);
                agree(&found, &want, size(&want));
            }

            #[test]
            fn kept_buffers_change_no_bits() {
                let mut stage = Stage::new($fields);
                let mut kept = $fresh;
                for step in 0..6 {
                    let fresh = stage.evaluate(&mut $fresh, $batches, 0.0);
                    let again = stage.evaluate(&mut kept, $batches, 0.0);
                    assert_eq!(bits(&fresh), bits(&again), "step {step}");
                    for (number, (_, body)) in stage.world.bodies.iter_mut().enumerate() {
                        let way = Vector::new(2.0, -0.3 * step as Real, 0.2 * number as Real);
                        body.set_translation(body.translation() + way, false);
                    }
                }
            }

            #[test]
            fn follows_edits() {
                let mut stage = Stage::new($fields);
                let mut kept = $fresh;
                for round in 0..12 {
                    let handles: Vec<_> = stage.set.iter().map(|(handle, _)| handle).collect();
                    // All constants are removed after a few rounds.
                    let Some(handle) = handles.get(round * 7 % handles.len().max(1)) else {
                        break;
                    };
                    let handle = *handle;
                    match round % 4 {
                        0 => stage.set[handle].strength = 2.0,
                        1 => stage.set[handle].enabled = false,
                        2 => stage.set[handle].anchor = Pose::translation(9.0, 0.0, 0.0).into(),
                        _ => drop(stage.set.remove_field(handle)),
                    }
                    stage.set.validate_changes().expect("valid");
                    stage.compiled.update(&stage.set);
                    let view = WorldRef::new(&stage.world.bodies, &stage.world.colliders);
                    let anew = Compiled::new(&stage.set).reach(&view);
                    assert_eq!(stage.compiled.reach(&view), anew, "round {round}");
                    let fresh = stage.evaluate(&mut $fresh, $batches, 0.0);
                    let again = stage.evaluate(&mut kept, $batches, 0.0);
                    assert_eq!(bits(&fresh), bits(&again), "round {round}");
                }
            }
        }
    )*};
}

keeps_the_contract! {
    constants_at_once: Constants, constants, all_constants;
    radials_one_way: OneWayRadials::default(), radials, all_radials;
    radials_pair_by_pair: PairwiseRadials::default(), radials, all_radials;
    radials_in_the_better_way: Radials::default(), radials, all_radials;
    radials_in_cells: Radials::default(), far, all_radials;
    programs_in_lanes_and_by_the_interpreter: Programs::default(), programs, all_programs;
}

/// The instruction sets of this machine.
fn levels() -> Vec<Level> {
    let best = Level::new();
    let mut all = vec![best];
    #[cfg(target_arch = "x86_64")]
    {
        all.extend(best.as_sse2().map(Level::Sse2));
        all.extend(best.as_sse4_2().map(Level::Sse4_2));
        all.extend(best.as_avx2().map(Level::Avx2));
        all.extend(best.as_avx512().map(Level::Avx512));
    }
    all
}

/// Radial fields of all kinds on many bodies of one to six parts.
fn many(world: &PhysicsWorld) -> Vec<Tree> {
    let mut all = Vec::new();
    for (number, (collider, _)) in world.colliders.iter().enumerate() {
        let charge = number as Real % 5.0 - 1.5;
        all.push(
            Field::coulomb(1.0, charge)
                .shifted_to_zero_at(4.0)
                .at(collider),
        );
        let law = Field::lennard_jones(0.5, 1.0).shifted_to_zero_at(4.0);
        all.push(law.at(collider));
        all.push(Field::point_gravity(0.5).softened(0.5).at(collider));
        all.push(
            Field::radial(0.1, -1.0)
                .within(Region::ball(4.0))
                .at(collider),
        );
    }
    all.push(Field::radial(1.0, -2.0).at(Vector::new(-9.0, 1.0, 2.0)));
    all.into_iter().map(Tree::from).collect()
}

fn crowd() -> Stage {
    let mut world = PhysicsWorld::new();
    for number in 0..90 {
        let cell = [number % 5, number / 5 % 5, number / 25].map(|n| n as Real * 2.25);
        let body = RigidBodyBuilder::dynamic().translation(Vector::from_array(cell));
        let body = world.insert_body(body);
        for part in 0..=number % 6 {
            let way = Vector::new(0.25 * part as Real, 0.125 * (part % 2) as Real, 0.0);
            let ball = ColliderBuilder::ball(0.1).translation(way).mass(1.0);
            world.insert_collider(ball, Some(body));
        }
    }
    weigh(&mut world);
    Stage::of(world, many)
}

/// They also agree with the reference.
#[test]
fn every_instruction_set_gives_the_same_bits() {
    let stage = crowd();
    let want = stage.reference();
    let (composites, far) = (Stage::new(programs), Stage::new(far));
    let mut first = None;
    for level in levels() {
        FORCED.set(Some(level));
        let found = stage.evaluate(&mut Radials::default(), all_radials, 0.0);
        agree(&found, &want, size(&want));
        let one_way = stage.evaluate(&mut OneWayRadials::default(), all_radials, 0.0);
        let several = composites.evaluate(&mut Programs::default(), all_programs, 0.0);
        let in_cells = far.evaluate(&mut Radials::default(), all_radials, 0.0);
        let found = [found, one_way, several, in_cells].map(|found| bits(&found));
        assert_eq!(*first.get_or_insert(found.clone()), found, "{level:?}");
    }
    FORCED.set(None);
}

/// The velocities and poses of all bodies, and the length of the step, after some whole steps.
fn stepped(stage: Stage, scheme: Scheme) -> Vec<u64> {
    let mut world = stage.world;
    let settings = FieldSettings {
        scheme,
        ..FieldSettings::default()
    };
    let fields = Fields::from_parts(stage.set, settings, FieldState::default());
    let mut fields = fields.expect("valid fields");
    for _ in 0..2 {
        fields.step(&mut world).expect("a step");
    }
    let numbers = |(_, body): (_, &RigidBody)| {
        let vectors = [body.translation(), body.linvel(), body.angvel()];
        let vectors = vectors.into_iter().flat_map(|it| it.to_array());
        vectors.chain(body.rotation().to_array())
    };
    let numbers = world.bodies.iter().flat_map(numbers);
    numbers.map(|x| to_f64(x).to_bits()).collect()
}

/// Besides the evaluators, the passes over bodies, the drift, and the rotation of many bodies at once.
#[test]
fn whole_steps_give_the_same_bits_on_every_instruction_set() {
    let stages = [crowd, || Stage::new(programs), || Stage::new(constants)];
    let auto = Scheme::Auto { tolerance: 1e-2 };
    for scheme in [Scheme::Kick, Scheme::KickDriftKick, Scheme::Forward4, auto] {
        for (number, stage) in stages.iter().enumerate() {
            let mut first = None;
            for level in levels() {
                FORCED.set(Some(level));
                let found = stepped(stage(), scheme);
                let first = first.get_or_insert(found.clone());
                assert!(*first == found, "{scheme:?}, {number}, {level:?}");
            }
        }
    }
    FORCED.set(None);
}

/// In a build for debugging, a function that all others are inlined into takes much stack: once 1.3 megabytes, more than
/// the main thread of Windows has. This program is compiled without optimisations.
#[test]
fn evaluators_take_little_stack_without_optimisations() {
    let evaluate = || {
        let (crowd, composites, far) = (crowd(), Stage::new(programs), Stage::new(far));
        for level in levels() {
            FORCED.set(Some(level));
            crowd.evaluate(&mut Radials::default(), all_radials, 0.0);
            crowd.evaluate(&mut OneWayRadials::default(), all_radials, 0.0);
            composites.evaluate(&mut Programs::default(), all_programs, 0.0);
            far.evaluate(&mut Radials::default(), all_radials, 0.0);
        }
    };
    let thread = std::thread::Builder::new().stack_size(512 << 10);
    let evaluated = thread.spawn(evaluate).expect("a thread").join();
    evaluated.expect("enough stack");
}
