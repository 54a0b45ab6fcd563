//! Fields that follow edits equal fields made anew from the same set, bit for bit.
//!
//! Random trees are edited at random. After edits, the plan and the wrenches on all bodies equal those of fields made
//! from the set at once, and the wrenches equal those of the reference within rounding.

use crate::support::cases;
use crate::support::trees::{self, Numbers, TermPlan, rounding};
use crate::support::worlds::{self, World, bodies};

use proptest::prelude::*;
use rapier3d_fields::math::{Pose, Real, to_dvec3};
use rapier3d_fields::plan::Plan;
use rapier3d_fields::prelude::*;
use rapier3d_fields::{StepError, Wrench};

/// An edit; the number of its target wraps around.
#[derive(Clone, Debug)]
enum Edit {
    Strength(usize, i8),
    Enabled(usize, bool),
    Move(usize, [i32; 3]),
    Attach(usize, usize),
    Radius(usize, i8),
    Life(usize, u8),
    Replace(usize, usize),
    RemoveField(usize),
    RemoveTree(usize),
    Insert(TermPlan),
    InsertMany(TermPlan, u8),
    InsertField(TermPlan),
    Sample(usize, u8),
    Axis(i8),
}

fn edit() -> impl Strategy<Value = Edit> {
    let leaf = 0..1000_usize;
    let place = || proptest::array::uniform3(-4..=4);
    let term = || trees::term(Numbers::Fractional);
    prop_oneof![
        4 => (leaf.clone(), -2..=3_i8).prop_map(|(leaf, s)| Edit::Strength(leaf, s)),
        2 => (leaf.clone(), any::<bool>()).prop_map(|(leaf, on)| Edit::Enabled(leaf, on)),
        3 => (leaf.clone(), place()).prop_map(|(leaf, place)| Edit::Move(leaf, place)),
        1 => (leaf.clone(), 0..9_usize).prop_map(|(leaf, body)| Edit::Attach(leaf, body)),
        2 => (leaf.clone(), 0..6_i8).prop_map(|(leaf, radius)| Edit::Radius(leaf, radius)),
        2 => (leaf.clone(), 0..5_u8).prop_map(|(leaf, life)| Edit::Life(leaf, life)),
        2 => (leaf.clone(), leaf.clone()).prop_map(|(leaf, by)| Edit::Replace(leaf, by)),
        2 => leaf.clone().prop_map(Edit::RemoveField),
        2 => leaf.clone().prop_map(Edit::RemoveTree),
        2 => term().prop_map(Edit::Insert),
        1 => (term(), 2..40_u8).prop_map(|(term, count)| Edit::InsertMany(term, count)),
        2 => trees::leaf(Numbers::Fractional).prop_map(|l| Edit::InsertField(TermPlan::Leaf(l))),
        1 => (leaf, 0..4_u8).prop_map(|(body, sampling)| Edit::Sample(body, sampling)),
        1 => (-3..=3_i8).prop_map(Edit::Axis),
    ]
}

/// Fields under edit, in a world that stands still.
struct Bench {
    world: World,
    fields: Fields,
    trees: Vec<TreeHandle>,
}

impl Bench {
    fn new(mut world: World, terms: &[TermPlan]) -> Self {
        world.physics.integration_parameters.dt = 0.0;
        // Fields cannot be built from an empty tree, but their set may become empty.
        let mut fields = world.fields(&Field::uniform(Vector::X).into());
        fields.set.clear();
        fields.set.insert(Tree::fold(
            Operator::SumUnion,
            terms.iter().map(|term| term.term(&world)),
        ));
        fields.settings.scheme = Scheme::Kick;
        Bench {
            world,
            fields,
            trees: Vec::new(),
        }
    }

    fn edit(&mut self, edit: &Edit) {
        let (world, set) = (&self.world, &mut self.fields.set);
        let leaf = |number: usize| -> Option<FieldHandle> {
            let count = set.len();
            set.iter()
                .nth(number % count.max(1))
                .map(|(handle, _)| handle)
        };
        match edit {
            Edit::Insert(term) => self.trees.push(set.insert(term.term(world))),
            Edit::InsertMany(term, count) => {
                let moved = |k: u8| {
                    let pose = Vector::new(Real::from(k % 5), Real::from(k % 3), 0.5);
                    Tree::instances(term.tree(world), [pose])
                };
                let many = Tree::fold(Operator::SumUnion, (0..*count).map(moved));
                self.trees.push(set.insert(many));
            }
            Edit::InsertField(term) => {
                if let TermPlan::Leaf(_) = term {
                    self.trees.push(set.insert(term.tree(world)));
                }
            }
            Edit::RemoveTree(number) => {
                if !self.trees.is_empty() {
                    let tree = self.trees.swap_remove(number % self.trees.len());
                    assert!(set.remove(tree).is_some());
                    assert!(set.remove(tree).is_none(), "once only");
                }
            }
            Edit::Sample(body, sampling) => {
                let body = world.bodies[body % world.bodies.len()];
                let all = [
                    None,
                    Some(Sampling::Centre),
                    Some(Sampling::Parts),
                    Some(Sampling::Volume),
                ];
                let sampling = all[*sampling as usize];
                set.set_sampling(body, sampling);
            }
            Edit::Axis(value) => {
                set.set_axis("delta", Real::from(*value)).expect("declared");
            }
            Edit::RemoveField(number) => {
                if let Some(handle) = leaf(*number) {
                    assert!(set.remove_field(handle).is_some());
                    assert!(set.get(handle).is_none(), "gone");
                }
            }
            Edit::Replace(number, by) => {
                if let (Some(handle), Some(by)) = (leaf(*number), leaf(*by)) {
                    set[handle] = set[by].clone();
                }
            }
            Edit::Strength(number, _)
            | Edit::Enabled(number, _)
            | Edit::Move(number, _)
            | Edit::Attach(number, _)
            | Edit::Radius(number, _)
            | Edit::Life(number, _) => {
                if let Some(handle) = leaf(*number) {
                    let world = &self.world;
                    change(&mut set[handle], edit, world);
                }
            }
        }
    }

    /// Compiles the edits into the fields, as a step does, and abandons the step.
    fn follow(&mut self) {
        let physics = &mut self.world.physics;
        match self.fields.begin(WorldMut::from(&mut *physics)) {
            Err(StepError::Unfinished) => {
                let step = self.fields.begin(WorldMut::from(physics));
                drop(step.expect("a valid set"));
            }
            step => drop(step.expect("a valid set")),
        }
    }

    fn wrenches(&self, fields: &Fields) -> Vec<(RigidBodyHandle, Wrench)> {
        let physics = &self.world.physics;
        let all = fields.sample_all(1.0, physics);
        all.expect("finite")
    }

    /// Fields made from the same set at once.
    fn anew(&self) -> Fields {
        let mut fields = self.world.fields(&Tree::from(Field::uniform(Vector::X)));
        fields.set = self.fields.set.clone();
        fields.settings = self.fields.settings.clone();
        fields
    }

    fn check(&self) -> Result<(), TestCaseError> {
        let fresh = self.anew();
        let (plan, expected): (Plan, Plan) = (self.fields.plan(), fresh.plan());
        prop_assert_eq!(&plan, &expected, "\n{}\n{}", plan, expected);
        let want = self.wrenches(&fresh);
        let physics = &self.world.physics;
        for (found, (body, wrench)) in self.wrenches(&self.fields).iter().zip(&want) {
            prop_assert_eq!(found.0, *body);
            prop_assert!(
                same(&found.1, wrench),
                "{:?}: {:?} and {:?}\n{}",
                body,
                found.1,
                wrench,
                plan
            );
            // The wrench that the pipeline computed with all that it keeps from step to step.
            if let Some(kept) = self.fields.wrench(*body) {
                prop_assert!(
                    same(&kept, wrench),
                    "{:?}: kept {:?} and {:?}\n{}",
                    body,
                    kept,
                    wrench,
                    plan
                );
            }
            let why = self.fields.explain(*body, physics);
            let why = why.expect("a dynamic body");
            let sizes = why.contributions.iter().filter_map(|c| c.force);
            let size: f64 = sizes.map(|force| to_dvec3(force).length()).sum();
            // Scales and products of vectors enlarge roundings.
            let scale = 1000.0 * (1.0 + size) * (1.0 + size);
            let bound = rounding(256) * scale;
            let (force, torque) = (why.wrench.force, why.wrench.torque);
            let error = to_dvec3(wrench.force - force).length();
            prop_assert!(
                error <= bound,
                "{wrench:?}, reference {force}: {error:e} > {bound:e}\n{plan}"
            );
            let error = to_dvec3(wrench.torque - torque).length();
            prop_assert!(
                error <= bound * 4.0,
                "{wrench:?}, reference {torque}\n{plan}"
            );
        }
        Ok(())
    }
}

fn change(field: &mut Field, edit: &Edit, world: &World) {
    match edit {
        Edit::Strength(_, strength) => field.strength = Real::from(*strength) * 0.75,
        Edit::Enabled(_, on) => field.enabled = *on,
        Edit::Move(_, place) => {
            let quarter = Vector::splat(0.25);
            field.anchor = (worlds::vector(*place) + quarter).into();
        }
        Edit::Attach(_, body) => {
            let handle = world.bodies[body % world.bodies.len()];
            let local_pose = Pose::from_translation(Vector::splat(0.25));
            field.anchor = Anchor::Body { handle, local_pose };
        }
        Edit::Radius(_, 0) => field.region = Region::everywhere(),
        Edit::Radius(_, radius) => field.region = Region::ball(Real::from(*radius) + 0.37),
        Edit::Life(_, life) => {
            field.lifetime = [
                Lifetime::ALWAYS,
                Lifetime::between(-1.0, 1.0),
                Lifetime::between(1.0, 2.0),
                Lifetime::steps(3),
                Lifetime::steps(0),
            ][*life as usize];
        }
        _ => unreachable!("not of one leaf"),
    }
}

/// Bit for bit.
fn same(a: &Wrench, b: &Wrench) -> bool {
    let bits =
        |wrench: &Wrench| [wrench.force, wrench.torque].map(|v| v.to_array().map(Real::to_bits));
    bits(a) == bits(b)
}

fn run(world: World, terms: &[TermPlan], edits: &[Edit]) -> Result<(), TestCaseError> {
    let mut bench = Bench::new(world, terms);
    bench.follow();
    bench.check()?;
    for (number, edit) in edits.iter().enumerate() {
        bench.edit(edit);
        // One edit in three is followed together with the next.
        if number % 3 != 1 {
            bench.follow();
            bench.check()?;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases(300))]

    /// With edits of every kind of tree, in any order.
    #[test]
    fn fields_that_follow_edits_equal_fields_made_anew(
        plans in bodies(4, 1..=3),
        terms in proptest::collection::vec(trees::term(Numbers::Fractional), 1..=6),
        edits in proptest::collection::vec(edit(), 1..24),
    ) {
        run(World::new(&plans), &terms, &edits)?;
    }
}

/// Numbers below a bound that look random, the same in every run.
fn random() -> impl FnMut(usize) -> usize {
    let mut state = 1_usize;
    move |below| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % below
    }
}

/// Sources that stand still keep their order, and only edited ones move in it: within their bounding box, at its
/// faces and beyond them, alone and as several of one term, in numbers too small for a grid and in larger ones.
#[test]
fn edits_of_sources_that_stand_still_are_followed() {
    let plans = [[0, 0, 0], [3, 1, 0], [-2, 2, 1]].map(|position| worlds::BodyPlan {
        position,
        linvel: [1, 0, 0],
        angvel: [0, 1, 0],
        parts: vec![([0; 3], 0, 1, None), ([1, 0, 0], 1, -1, None)],
    });
    let mut bench = Bench::new(World::new(&plans), &[]);
    let mut random = random();
    let mut at = move |beyond: usize| {
        let mut along = |cells: usize| random(cells * 4 + beyond) as Real * 0.25 - 3.1;
        Vector::new(along(7), along(5), along(3))
    };
    let star = |place: Vector| {
        let star = Field::radial(1.0 + place.x.abs(), -1.0).within(Region::ball(1.9));
        star.at(place)
    };
    let mut random = self::random();
    let set = &mut bench.fields.set;
    let mut handles: Vec<_> = (0..60).map(|_| set.insert_field(star(at(0)))).collect();
    let mut groups = Vec::new();
    for round in 0..400 {
        for _ in 0..=random(3) {
            let place = random(handles.len());
            let handle = handles[place];
            let set = &mut bench.fields.set;
            match random(9) {
                0 => set[handle].strength = random(4) as Real,
                1 | 2 => set[handle].anchor = at(random(40) / 39).into(),
                3 => set[handle].enabled = !set[handle].enabled,
                4 => {
                    set.remove_field(handle);
                    handles.swap_remove(place);
                }
                5 => {
                    let several = [at(0), at(0), at(0)];
                    groups.push(set.insert(Tree::instances(star(Vector::ZERO), several)));
                }
                6 if !groups.is_empty() => {
                    set.remove(groups.swap_remove(random(groups.len())));
                }
                _ => handles.push(set.insert_field(star(at(0)))),
            }
        }
        bench.follow();
        bench
            .check()
            .unwrap_or_else(|error| panic!("round {round}: {error}"));
    }
}

/// Many like and many unlike fields: some leave and enter the middle of batches, programs and hierarchies.
#[test]
fn edits_of_many_fields_are_followed() {
    let plans = [[0, 0, 0], [3, 1, 0], [-2, 2, 1]].map(|position| worlds::BodyPlan {
        position,
        linvel: [1, 0, 0],
        angvel: [0, 1, 0],
        parts: vec![([0; 3], 0, 1, None), ([1, 0, 0], 1, -1, None)],
    });
    let mut bench = Bench::new(World::new(&plans), &[]);
    let at = |k: usize| {
        Vector::new(
            (k % 7) as Real - 2.75,
            (k % 5) as Real - 1.75,
            (k % 3) as Real + 0.25,
        )
    };
    let zone = |k: usize| {
        Field::uniform(Vector::X)
            .within(Region::ball(1.37))
            .at(at(k))
    };
    let unlike = |k: usize| {
        let region = Region::ball(1.0 + k as Real * 0.01).difference(Region::ball(0.2));
        Field::spring(0.1 * k as Real).within(region).at(at(k))
    };
    let star = |k: usize| {
        Field::radial(1.0 + k as Real, -1.0)
            .within(Region::ball(4.0))
            .at(at(k))
    };
    let mut handles = Vec::new();
    for k in 0..90 {
        handles.push(bench.fields.set.insert_field(zone(k)));
        handles.push(bench.fields.set.insert_field(unlike(k)));
        handles.push(bench.fields.set.insert_field(star(k)));
    }
    let mut random = random();
    for round in 0..300 {
        for _ in 0..=random(3) {
            let place = random(handles.len());
            let handle = handles[place];
            let set = &mut bench.fields.set;
            match random(7) {
                0 => set[handle].strength = random(4) as Real,
                1 => set[handle].anchor = at(random(100)).into(),
                2 => set[handle].enabled = !set[handle].enabled,
                3 => set[handle].region = Region::ball(0.37 + random(3) as Real),
                4 => {
                    set.remove_field(handle);
                    handles.swap_remove(place);
                }
                5 => set[handle].anchor = bench.world.bodies[random(3)].into(),
                _ => {
                    let k = random(1000);
                    let field = [zone(k), unlike(k), star(k)][random(3)].clone();
                    handles.push(set.insert_field(field));
                }
            }
        }
        bench.follow();
        bench
            .check()
            .unwrap_or_else(|error| panic!("round {round}: {error}"));
    }
}

/// A field with a lifetime of one step acts once and is removed; one with an interval of time acts within it.
#[test]
fn fields_act_within_their_lifetimes() {
    let plan = worlds::BodyPlan {
        position: [2, 0, 0],
        linvel: [0; 3],
        angvel: [0; 3],
        parts: vec![([0; 3], 0, 0, None)],
    };
    for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
        let mut world = World::new(std::slice::from_ref(&plan));
        world.physics.gravity = Vector::ZERO;
        let tree = Tree::from(Field::uniform(Vector::Y).enabled(false));
        let mut fields = world.fields(&tree);
        fields.settings.scheme = scheme;
        let push = Field::uniform(Vector::X * 3.0).force_mode(ForceMode::VelocityChange);
        let blast = fields.set.insert_field(push.lifetime(Lifetime::steps(1)));
        for _ in 0..4 {
            fields.step(&mut world.physics).expect("a step");
            assert!(fields.set.get(blast).is_none(), "gone after the first");
            let speed = world.physics.bodies[world.bodies[0]].linvel().x;
            assert!((speed - 3.0).abs() < 1e-5, "{scheme:?}: {speed}");
        }
    }
    let mut world = World::new(&[plan]);
    world.physics.gravity = Vector::ZERO;
    let dt = world.physics.integration_parameters.dt;
    let wind = Field::uniform(Vector::X).lifetime(Lifetime::between(0.1, 0.2));
    let mut fields = world.fields(&wind.into());
    fields.settings.scheme = Scheme::Kick;
    let mut pushed = 0;
    for _ in 0..30 {
        let before = world.physics.bodies[world.bodies[0]].linvel().x;
        fields.step(&mut world.physics).expect("a step");
        pushed += usize::from(world.physics.bodies[world.bodies[0]].linvel().x > before);
    }
    let expected = (0.1 / dt).round() as usize;
    assert!(
        pushed.abs_diff(expected) <= 1,
        "{pushed} steps of {expected}"
    );
}

/// Strength applies before any limit, and a strength of one changes no bit.
#[test]
fn strength_comes_before_limits() {
    let plan = worlds::BodyPlan {
        position: [2, 0, 0],
        linvel: [0; 3],
        angvel: [0; 3],
        parts: vec![([0; 3], 0, 0, None)],
    };
    let bench = |field: Field| {
        let bench = Bench::new(World::new(std::slice::from_ref(&plan)), &[]);
        let mut fields = bench.anew();
        fields.set.clear();
        fields.set.insert_field(field);
        bench.wrenches(&fields)[0].1.force.x
    };
    let spring = || Field::spring(-1.0);
    let radial = || Field::radial(1.0, 1.0);
    for field in [spring, radial] {
        assert_eq!(bench(field()), 2.0);
        assert_eq!(bench(field().strength(3.0)), 6.0);
        assert_eq!(bench(field().strength(3.0).limited_to(5.0)), 5.0);
        assert_eq!(bench(field().strength(2.0).limited_to(5.0)), 4.0);
        assert_eq!(bench(field().strength(-3.0).limited_to(5.0)), -5.0);
        assert_eq!(bench(field().enabled(false)), 0.0);
    }
}

fn body_at_origin() -> worlds::BodyPlan {
    worlds::BodyPlan {
        position: [0; 3],
        linvel: [0; 3],
        angvel: [0; 3],
        parts: vec![([0; 3], 0, 1, None)],
    }
}

/// Regression: fields that are alike share a program. If two of them were changed in one step, so that one left the
/// program while the next, which was disabled, was still the first in it, none of them acted any more.
#[test]
fn two_edits_in_a_step_leave_others_as_they_are() {
    let plans = [body_at_origin()];
    for edit in [Edit::Strength(1, 3), Edit::Enabled(1, false)] {
        let mut bench = Bench::new(World::new(&plans), &[]);
        let alike = |at: Vector| {
            let field = Field::vortex(2.0, 0.5).at(at);
            Tree::from(field).limited_to(9.0)
        };
        let places = [
            Vector::X,
            Vector::Y * 2.0,
            Vector::Z * 3.0,
            -Vector::X * 2.0,
        ];
        let set = &mut bench.fields.set;
        let others = set.len();
        for at in places {
            set.insert(alike(at));
        }
        let handles: Vec<_> = set.iter().map(|(handle, _)| handle).skip(others).collect();
        assert_eq!(handles.len(), places.len());
        bench.follow();
        bench.check().expect("as made anew");
        bench.fields.set[handles[0]].enabled = false;
        let world = World::new(&plans);
        change(&mut bench.fields.set[handles[1]], &edit, &world);
        bench.follow();
        let [kept, anew] = [&bench.fields, &bench.anew()].map(|fields| bench.wrenches(fields));
        assert_eq!(kept, anew, "{edit:?}");
        bench.check().expect("as made anew");
    }
}

/// Regression: instances of instances of one field took the strength of the first field of their common program, or the
/// library panicked if that field had instances of its own.
#[test]
fn instances_of_instances_have_their_own_strengths() {
    let plans = [body_at_origin()];
    let mut bench = Bench::new(World::new(&plans), &[]);
    let zone = |strength: Real| {
        let push = Field::uniform(Vector::X).within(Region::half_space(Vector::X, 9.0));
        Tree::from(push.strength(strength))
    };
    let nested =
        |strength| Tree::instances(Tree::instances(zone(strength), [Vector::Y]), [Vector::Z]);
    let flat = |strength| Tree::instances(zone(strength), [Vector::Y]);
    let set = &mut bench.fields.set;
    let handles = [
        nested(1.0),
        flat(10.0),
        zone(100.0),
        nested(1000.0),
        flat(10000.0),
    ]
    .map(|tree| set.insert(tree))
    .map(|tree| set.fields_of(tree)[0]);
    for (handle, [strength, sum]) in handles.into_iter().rev().zip([
        [20000.0, 21111.0],
        [0.0, 20111.0],
        [200.0, 20211.0],
        [20.0, 20221.0],
        [2.0, 20222.0],
    ]) {
        bench.fields.set[handle].strength = strength;
        bench.follow();
        bench.check().expect("as made anew, and as the reference");
        let force = bench.wrenches(&bench.fields)[0].1.force;
        assert_eq!(force, Vector::X * sum);
    }
}

/// A contact field without an operator around it has no vector to be scaled either, whether it is built or edited so.
#[test]
fn an_edit_that_a_new_set_would_refuse_is_refused() {
    let mut world = PhysicsWorld::new();
    let (_, ball) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    let touch = || {
        Field::contact(ContactLaw::elastic())
            .at(ball)
            .named("touch")
    };
    for changed in [
        touch().strength(2.0),
        touch().limited_to(2.0),
        touch().scaled_by(2.0),
    ] {
        let refused = Fields::new(changed).err();
        assert!(
            matches!(refused, Some(BuildError::DetectionOperand { .. })),
            "{refused:?}"
        );
    }
    for beside in [None, Some(Field::spring(1.0))] {
        let alone = Tree::from(touch());
        let tree = match beside {
            Some(field) => alone.sum_union(field),
            None => alone,
        };
        let mut fields = Fields::new(tree).expect("valid fields");
        fields.step(&mut world).expect("a step");
        fields.set["touch"].strength = 2.0;
        let error = fields.step(&mut world).expect_err("no such field");
        let expected =
            |it: &StepError| matches!(it, StepError::Setting(BuildError::DetectionOperand { .. }));
        assert!(expected(&error), "{error}");
        fields.set["touch"].strength = 1.0;
        fields.step(&mut world).expect("it was corrected");
    }
}
