//! Tests that steps at centres of mass move bodies like steps that sample each body. The audit, which needs samples,
//! changes nothing else.

use proptest::prelude::*;

use super::*;
use crate::field::region::Region;
use crate::field::{
    Axis, Coupling, Field, FieldSet, ForceMode, Lifetime, Operator, Sampling, Tree, Turbulence,
};
use crate::math::{Real, RigidBodyHandle, Vector};
use crate::pipeline::FieldSettings;
use crate::rapier::dynamics::{RigidBodyBuilder, RigidBodyType};
use crate::rapier::geometry::ColliderBuilder;
use crate::rapier::pipeline::PhysicsWorld;
use crate::{Scalar, StepWarning};

/// A world with its fields, and for each step so far true if it was made at centres of mass.
struct Run {
    world: PhysicsWorld,
    set: FieldSet,
    settings: FieldSettings,
    state: FieldState,
    pipeline: FieldPipeline,
    at_centres: Vec<bool>,
}

impl Run {
    fn new(world: PhysicsWorld, tree: Tree, scheme: Scheme, audit: bool) -> Self {
        let mut set = FieldSet::new();
        set.insert(tree);
        let settings = FieldSettings {
            scheme,
            audit,
            ..FieldSettings::default()
        };
        Run {
            world,
            set,
            settings,
            state: FieldState::default(),
            pipeline: FieldPipeline::new(),
            at_centres: Vec::new(),
        }
    }

    fn step(&mut self) {
        let fields = &Definition {
            set: &self.set,
            settings: &self.settings,
        };
        let (state, pipeline) = (&mut self.state, &mut self.pipeline);
        let open = pipeline.begin_step(fields, state, (&mut self.world).into(), true);
        let open = open.expect("a sound step");
        self.at_centres.push(open.at_centres);
        self.world.step();
        let done = pipeline.finish_step(fields, state, open, (&mut self.world).into());
        done.expect("a sound step");
    }

    fn touches(&self) -> bool {
        let mut pairs = self.world.narrow_phase.contact_pairs();
        pairs.any(|pair| pair.has_any_active_contact())
    }

    /// The largest difference of positions or velocities.
    fn apart(&self, other: &Run) -> Real {
        let differences = self.world.bodies.iter().map(|(handle, body)| {
            let other = &other.world.bodies[handle];
            let apart = body.translation() - other.translation();
            let faster = body.linvel() - other.linvel();
            apart.length().max(faster.length())
        });
        differences.fold(0.0, Real::max)
    }
}

/// The factor by which small steps are smaller.
const SMALLER: usize = 16;

/// The choices from which a world is made.
#[derive(Clone, Debug)]
struct Scene {
    gravity: bool,
    damped: bool,
    floor: bool,
    spinning: bool,
    fields: Vec<u8>,
    /// True for bodies with settings of their own.
    various: bool,
    seed: u64,
}

/// Bodies with settings of their own; one of them carries fields.
fn varied(mut body: RigidBodyBuilder, place: usize, velocity: Vector) -> RigidBodyBuilder {
    if place == CARRIER {
        body.body_type = RigidBodyType::KinematicVelocityBased;
        return body.linvel(velocity);
    }
    match place % 6 {
        0 => body.gravity_scale(-0.3),
        2 => body.enabled_translations(false, true, true),
        3 => body.additional_solver_iterations(3),
        4 => body.dominance_group(1),
        _ => body,
    }
}

/// The number of the body that carries fields.
const CARRIER: usize = 5;

/// Numbers from −1 to 1.
fn numbers(seed: u64) -> impl FnMut() -> Real {
    let mut state = seed | 1;
    move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((state >> 33) as f64 / f64::from(1u32 << 30) - 1.0) as Real
    }
}

impl Scene {
    fn world(&self) -> PhysicsWorld {
        let mut number = numbers(self.seed);
        let mut vector = || Vector::new(number(), number(), number());
        let mut world = PhysicsWorld::new();
        world.gravity = if self.gravity {
            Vector::Y * -9.81
        } else {
            Vector::ZERO
        };
        if self.floor {
            let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -9.0);
            world.insert(floor, ColliderBuilder::cuboid(50.0, 1.0, 50.0));
        }
        for place in 0..19 {
            let cell = Vector::new((place % 5) as Real, (place / 5) as Real, 0.0) * 3.0;
            let spin = if self.spinning {
                vector()
            } else {
                Vector::ZERO
            };
            let damping = if self.damped { 0.3 } else { 0.0 };
            let body = RigidBodyBuilder::dynamic()
                .translation(cell + vector() - Vector::X * 6.0)
                .linvel(vector() * 2.0)
                .angvel(spin)
                .linear_damping(damping)
                .angular_damping(damping);
            let body = if self.various {
                varied(body, place, vector())
            } else {
                body
            };
            let collider = ColliderBuilder::ball(0.4).density(1.0 + vector().x * 0.5);
            let (handle, _) = world.insert(body, collider);
            if self.various && place % 6 == 1 {
                world.bodies[handle].add_force(vector(), true);
            }
        }
        world
    }

    fn tree(&self) -> Tree {
        let mut number = numbers(self.seed ^ 0x5555);
        let mut vector = || Vector::new(number(), number(), number());
        let fields = self.fields.iter().map(|kind| {
            let at = vector() * 5.0;
            match kind {
                0 => Field::radial(-3.0, -2.0)
                    .softened(1.0)
                    .within(Region::ball(6.0))
                    .at(at),
                1 => Field::drag(0.3, 0.0),
                2 => Field::drag(0.1, 0.4).force_mode(ForceMode::Acceleration),
                3 => Field::wind(at, 0.2, 0.1).within(Region::ball(5.0)).at(at),
                4 => Field::uniform(at),
                5 => Field::turbulence(Turbulence::new(3, 2.0, 6.0)).as_wind(0.2, 0.0),
                6 => Field::vortex(1.0, -1.0).within(Region::ball(7.0)).at(at),
                8 => Field::radial(-0.02, -2.0)
                    .softened(1.0)
                    .coupled_to(Coupling::Axis(Axis::Mass))
                    .force_mode(ForceMode::VelocityChange)
                    .at(at),
                9 => Field::uniform(at).lifetime(Lifetime::between(0.05, 0.2)),
                10 => Field::spring(2.0).limited_to(0.7).at(at),
                11 => {
                    let body = RigidBodyHandle::from_raw_parts(CARRIER as u32, 0);
                    Field::radial(-3.0, -2.0).softened(1.0).at(body)
                }
                12 => Field::uniform(at)
                    .scaled_by(Scalar::constant(0.5))
                    .force_mode(ForceMode::Acceleration),
                _ => Field::spring(0.5).at(at),
            }
        });
        Tree::fold(Operator::SumUnion, fields)
    }
}

fn scenes() -> impl Strategy<Value = Scene> {
    let flags = prop::array::uniform5(any::<bool>());
    (flags, prop::collection::vec(0u8..13, 1..4), any::<u64>()).prop_map(|(flags, fields, seed)| {
        let [gravity, damped, floor, spinning, various] = flags;
        Scene {
            gravity,
            damped,
            floor,
            spinning,
            fields,
            various,
            seed,
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    /// Both agree to rounding, until a contact enlarges the difference. Steps with samples keep the slope of a
    /// quadratic drag from one step to the next, so with such a drag both are compared with a run at small steps. Where
    /// the force jumps at the border of a region as well, the errors of both depend on where a step meets the border.
    #[test]
    fn visits_move_bodies_like_steps_with_samples(scene in scenes(), kicks_once in any::<bool>()) {
        let scheme = if kicks_once { Scheme::Kick } else { Scheme::KickDriftKick };
        let run = |audit| Run::new(scene.world(), scene.tree(), scheme, audit);
        let [mut fast, mut sampled, mut fine] = [false, true, true].map(run);
        fine.world.integration_parameters.dt /= SMALLER as Real;
        let is_quadratic = scene.fields.iter().any(|it| [2, 3].contains(it));
        let jumps = scene.fields.iter().any(|it| [0, 3, 6].contains(it));
        let most = if jumps { 4.0 } else { 1.5 };
        for step in 0..40 {
            fast.step();
            sampled.step();
            if fast.touches() || sampled.touches() {
                return Ok(());
            }
            if !is_quadratic {
                let apart = fast.apart(&sampled);
                prop_assert!(apart < 1e-4, "{step}: {apart}");
                continue;
            }
            for _ in 0..SMALLER {
                fine.step();
                if fine.touches() {
                    return Ok(());
                }
            }
            let [ours, theirs] = [&fast, &sampled].map(|it| it.apart(&fine));
            prop_assert!(ours <= theirs * most + 1e-4, "{step}: {ours} {theirs}");
        }
        prop_assert!(sampled.at_centres.iter().all(|it| !it));
    }
}

#[test]
fn plain_scenes_are_stepped_at_centres() {
    for fields in [
        vec![0, 0, 0],
        vec![1],
        vec![2],
        vec![3],
        vec![4],
        vec![5],
        vec![0, 1, 4],
        vec![2, 2, 4],
    ] {
        for falls in [false, true] {
            let scene = Scene {
                gravity: falls,
                damped: falls,
                floor: false,
                spinning: true,
                various: false,
                fields: fields.clone(),
                seed: 7,
            };
            for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
                let mut run = Run::new(scene.world(), scene.tree(), scheme, false);
                (0..20).for_each(|_| run.step());
                // The first step takes samples, because new fields may wake sleeping bodies.
                let later = &run.at_centres[1..];
                assert!(
                    later.iter().all(|it| *it),
                    "{fields:?} {scheme:?} {later:?}"
                );
            }
        }
    }
}

/// Two drags act like one whose strength is their sum, as instances of one program or as two programs.
#[test]
fn quadratic_drags_at_rest_add_up() {
    let drag = |part: Real| Field::drag(0.2 * part, 0.8 * part).force_mode(ForceMode::Acceleration);
    for parts in [[0.5, 0.5], [0.25, 0.75]] {
        for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
            let scene = Scene {
                gravity: true,
                damped: true,
                floor: false,
                spinning: false,
                various: false,
                fields: Vec::new(),
                seed: 4,
            };
            let halves = Tree::fold(Operator::SumUnion, parts.map(drag));
            let trees = [halves, drag(1.0).into()];
            let mut runs = trees.map(|tree| Run::new(scene.world(), tree, scheme, false));
            for _ in 0..40 {
                runs.iter_mut().for_each(Run::step);
                if runs[1].touches() {
                    break;
                }
                let apart = runs[0].apart(&runs[1]);
                assert!(apart < 1e-5, "{parts:?} {scheme:?} {apart}");
            }
            assert!(
                runs.iter()
                    .all(|run| run.at_centres[1..].iter().all(|it| *it))
            );
            assert!(runs[0].at_centres.len() > 5, "they meet later than that");
        }
    }
}

impl Run {
    /// Removes a ball, inserts another, and gives a third one a heavier collider in place of its own.
    fn exchange(&mut self, step: usize) {
        let world = &mut self.world;
        let balls: Vec<_> = world.bodies.iter().map(|(handle, _)| handle).collect();
        world.remove_body(balls[(step * 7) % balls.len()]);
        let at = Vector::new(-6.0 + step as Real * 1.5, 14.0, 0.0);
        let ball = RigidBodyBuilder::dynamic().translation(at);
        let ball = ball.additional_mass(0.2).linvel(Vector::Z);
        world.insert(ball, ColliderBuilder::ball(0.4));
        let changed = balls[(step * 5 + 1) % balls.len()];
        if let Some(body) = world.bodies.get(changed) {
            let collider = body.colliders()[0];
            world.remove_collider(collider);
            let heavier = ColliderBuilder::ball(0.4).density(2.0);
            world.insert_collider(heavier, Some(changed));
        }
    }
}

#[test]
fn bodies_may_be_added_and_removed_between_steps_at_centres() {
    for fields in [vec![0, 0], vec![1], vec![4], vec![6], vec![7]] {
        for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
            let scene = Scene {
                gravity: false,
                damped: false,
                floor: false,
                spinning: false,
                various: false,
                fields: fields.clone(),
                seed: 11,
            };
            let run = |audit| Run::new(scene.world(), scene.tree(), scheme, audit);
            let mut runs = [false, true].map(run);
            for step in 0..16 {
                for run in &mut runs {
                    run.exchange(step);
                    run.step();
                }
                let apart = runs[0].apart(&runs[1]);
                assert!(apart < 1e-4, "{fields:?} {scheme:?} {step}: {apart}");
            }
            assert!(!runs[0].touches());
            let later = &runs[0].at_centres[1..];
            assert!(later.iter().all(|it| *it), "{fields:?} {later:?}");
        }
    }
}

/// Balls and boxes that slide and roll on a floor, and boxes that spin above it. Some of them may not move along an
/// axis.
fn sliding() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::Y * -1.0);
    world.insert(floor, ColliderBuilder::cuboid(50.0, 1.0, 50.0));
    for place in 0..18 {
        let flies = place % 3 == 2;
        let at = Vector::new(
            place as Real * 2.0 - 18.0,
            if flies { 9.0 } else { 0.4 },
            0.0,
        );
        let spin = if flies {
            Vector::new(1.0, 2.0, 0.5)
        } else {
            Vector::ZERO
        };
        let body = RigidBodyBuilder::dynamic()
            .translation(at)
            .linvel(Vector::new(0.5, 0.0, 1.0))
            .angvel(spin)
            .linear_damping(if place % 5 == 0 { 0.4 } else { 0.0 })
            .additional_solver_iterations(place % 2)
            .enabled_translations(place % 4 != 3, true, true);
        let collider = match place % 3 {
            0 => ColliderBuilder::ball(0.4),
            _ => ColliderBuilder::cuboid(0.6, 0.4, 0.4),
        };
        world.insert(body, collider.friction(0.3));
    }
    world
}

#[test]
fn bodies_that_are_held_precess_or_are_locked_are_slowed_in_visits() {
    for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
        let wind = Field::wind(Vector::new(-3.0, 1.0, 0.0), 0.8, 0.0);
        let gust = Field::wind(Vector::X * 9.0, 2.0, 0.0).within(Region::ball(4.0));
        let centre = |field: Field| field.sampled(Sampling::Centre);
        let tree = centre(wind) + centre(gust);
        let mut runs = [false, true].map(|audit| Run::new(sliding(), tree.clone(), scheme, audit));
        for step in 0..45 {
            runs.iter_mut().for_each(Run::step);
            let apart = runs[0].apart(&runs[1]);
            assert!(apart < 1e-4, "{scheme:?} {step}: {apart}");
        }
        assert!(runs[0].touches());
        // A body that has almost stopped moves less than the force there changes its way, which may be stiff.
        let visited = runs[0].at_centres.iter().filter(|it| **it).count();
        assert!(visited > 40, "{scheme:?} {visited}");
    }
}

/// A visit cannot measure how stiff a field is for a new body: if it may be stiff, the step is made with samples, and
/// warns.
#[test]
fn new_bodies_in_stiff_fields_give_a_warning() {
    let scene = Scene {
        gravity: false,
        damped: false,
        floor: false,
        spinning: false,
        various: false,
        fields: Vec::new(),
        seed: 3,
    };
    let hook = Field::spring(9e4).within(Region::ball(2.0));
    // The uniform field reaches all bodies.
    let tree = hook.at(Vector::Y * 30.0) + Field::uniform(Vector::X * 0.1);
    for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
        let mut run = Run::new(scene.world(), tree.clone(), scheme, false);
        (0..3).for_each(|_| run.step());
        let ball = RigidBodyBuilder::dynamic().translation(Vector::new(0.5, 30.0, 0.0));
        run.world.insert(ball, ColliderBuilder::ball(0.4).mass(1.0));
        run.step();
        assert_eq!(run.at_centres[1..], [true, true, false]);
        let warned = run.pipeline.warnings.iter();
        let mut stiff = warned.filter(|it| matches!(it, StepWarning::Stiff { .. }));
        assert!(stiff.next().is_some(), "{scheme:?}");
    }
}
