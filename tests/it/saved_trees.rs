//! Trees in every format of serde: written and read they are the same to the last bit; damaged bytes give an error or
//! some other tree, and never a panic.
use proptest::prelude::*;
use rapier3d_fields::field::Registry;
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::parry::shape::{HeightField, HeightFieldCellStatus};
use rapier3d_fields::rapier::parry::utils::Array2;
use rapier3d_fields_lab::random::Random;

use crate::support::cases;
use crate::support::formats::{FORMATS, Format};
use crate::support::trees::{self, Numbers, TermPlan};
use crate::support::worlds::{World, bodies};

/// For each body the bits of its wrench, or the error.
fn wrenches(world: &World, tree: &Tree) -> Vec<Result<Option<[u64; 6]>, String>> {
    let fields = world.fields(tree);
    let handles: Vec<_> = world.physics.bodies.iter().map(|(body, _)| body).collect();
    let wrench = |body| {
        let physics = &world.physics;
        let wrench = fields.sample(body, physics);
        let wrench = wrench.map_err(|error| error.to_string())?;
        let bits = |x: Real| rapier3d_fields::math::to_f64(x).to_bits();
        Ok(wrench.map(|wrench| {
            let [fx, fy, fz] = wrench.force.to_array();
            let [tx, ty, tz] = wrench.torque.to_array();
            [fx, fy, fz, tx, ty, tz].map(bits)
        }))
    };
    handles.into_iter().map(wrench).collect()
}

fn comes_back(
    plans: &[crate::support::worlds::BodyPlan],
    terms: &[TermPlan],
) -> Result<(), TestCaseError> {
    let world = World::new(plans);
    let tree = Tree::fold(
        Operator::SumUnion,
        terms.iter().map(|term| term.term(&world)),
    );
    let expected = wrenches(&world, &tree);
    for format in FORMATS {
        let failed = |error: String| TestCaseError::fail(format!("{format:?}: {error}"));
        let written = format.write(&tree).map_err(failed)?;
        let mut read: Tree = format.read(&written).map_err(failed)?;
        prop_assert_eq!(&format.write(&read).map_err(failed)?, &written);
        let resolved = read.resolve(&trees::registry());
        resolved.map_err(|error| failed(error.to_string()))?;
        prop_assert_eq!(&wrenches(&world, &read), &expected, "{:?}", format);
    }
    Ok(())
}

fn terms(numbers: Numbers) -> impl Strategy<Value = Vec<TermPlan>> {
    proptest::collection::vec(trees::term(numbers), 1..=3)
}

proptest! {
    #![proptest_config(cases(500))]

    #[test]
    fn trees_of_integers_come_back(
        plans in bodies(3, 1..=3), terms in terms(Numbers::Integer),
    ) {
        comes_back(&plans, &terms)?;
    }

    #[test]
    fn trees_of_fractions_come_back(
        plans in bodies(3, 1..=3), terms in terms(Numbers::Fractional),
    ) {
        comes_back(&plans, &terms)?;
    }
}

/// A tree of rarer shapes and settings: infinite ends, an oriented mesh, a height field with a hole, a hull, layers.
fn rarities() -> Tree {
    let mesh = SharedShape::cuboid(1.0, 2.0, 0.5);
    let (points, triangles) = mesh.as_cuboid().expect("a cuboid").to_trimesh();
    let flags = rapier3d_fields::rapier::parry::shape::TriMeshFlags::ORIENTED;
    let mesh = SharedShape::trimesh_with_flags(points.clone(), triangles, flags);
    let part = (Pose::from_translation(Vector::X), SharedShape::ball(0.5));
    let compound = SharedShape::compound(vec![part, (Pose::IDENTITY, SharedShape::cone(1.0, 0.5))]);
    let hull = SharedShape::convex_hull(&points).expect("a hull");
    let line = SharedShape::polyline(points, None);
    let push = || Field::uniform(Vector::new(1.0, 2.0, 3.0));
    let pull = |shape| Field::radial(-2.0, -1.0).no_nearer_than(0.25).around(shape);
    let since = Region::interval("time", 1.0, Real::INFINITY);
    let below = Region::interval("y", -Real::INFINITY, 3.0);
    let layers = Tree::layers([
        Layer::new(push().within(since.union(below))),
        Layer::new(pull(hull)).priority(3).stopping(),
    ]);
    let mesh = push().within(Region::shape(mesh.expect("a mesh")).at(Vector::Z));
    let ground = Region::shape(SharedShape::new(hills())).at(Vector::Y);
    let wind = push().as_wind(0.5, 0.25).as_wind(1.0, 0.0).speed_cap(9.0);
    layers
        .sum_union(mesh.limited_to(2.0))
        .sum_union(pull(compound).groups(InteractionGroups::none()))
        .sum_union(pull(line).sampled(Sampling::Volume))
        .sum_union(wind)
        .sum_union(push().within(ground))
}

/// Three heights along z, two along x, and half of a cell removed.
fn hills() -> HeightField {
    let heights = [0, 3, 1, 2, -1, 4].map(|height| height as Real);
    let mut field = HeightField::new(Array2::new(3, 2, heights.to_vec()), Vector::splat(2.5));
    field.set_cell_status(1, 0, HeightFieldCellStatus::LEFT_TRIANGLE_REMOVED);
    field
}

#[test]
fn infinite_ends_shapes_and_layers_come_back() {
    let world = World::new(&[]);
    let tree = rarities();
    Fields::new(tree.clone()).expect("a valid tree");
    for format in FORMATS {
        let written = format.write(&tree).expect("what can be written");
        let read: Tree = format.read(&written).expect("what was written");
        let again = format.write(&read).expect("what can be written");
        assert_eq!(again, written, "{format:?}");
        assert_eq!(wrenches(&world, &read), wrenches(&world, &tree));
    }
}

#[test]
fn closures_are_saved_by_name() {
    let unnamed = Tree::from(Field::closure([], |_| Vector::X));
    let named = || Tree::from(Field::closure_named("push", [], |_| Vector::X).named("wind"));
    for format in FORMATS {
        let error = format.write(&unnamed).expect_err("code without a name");
        // Postcard has one message for all errors of types.
        let says = error.contains("closure without a name") || matches!(format, Format::Postcard);
        assert!(says, "{format:?}: {error}");
        let written = format.write(&named()).expect("a name");
        let mut read: Tree = format.read(&written).expect("a name");
        let error = Fields::new(read.clone()).err().expect("not resolved");
        let expected = "field `wind`: the formula `push` is a closure that was read by name";
        assert!(error.to_string().starts_with(expected), "{error}");
        let error = read.resolve(&Registry::new()).expect_err("no such name");
        let expected = "field `wind`: the registry has no formula of the name `push`";
        assert_eq!(error.to_string(), expected);
        let registry = Registry::new().formula("push", [], |_| Vector::X);
        read.resolve(&registry).expect("a known name");
        Fields::new(read).expect("a valid tree");
    }
}

#[test]
fn setters_that_do_not_fit_are_not_saved() {
    let tree = Tree::from(Field::uniform(Vector::X).softened(1.0));
    let error = Format::Json
        .write(&tree)
        .expect_err("a setter that does not fit");
    assert!(error.contains("`softened` does not apply"), "{error}");
}

/// Structures that would make evaluators panic or loop forever.
#[test]
fn broken_structure_is_refused_when_it_is_read() {
    let leaf = serde_json::to_value(Tree::from(Field::uniform(Vector::X))).expect("a tree");
    let leaf = &leaf["nodes"][0];
    let sum = |operands: &[u32]| serde_json::json!({ "Operation": { "operator": "sum-union", "operands": operands } });
    for (nodes, expected) in [
        (
            vec![sum(&[0, 1])],
            "node 0: its operand 0 does not stand before it",
        ),
        (
            vec![leaf.clone(), sum(&[0, 7])],
            "node 1: its operand 7 does not stand before it",
        ),
        (
            vec![leaf.clone(), sum(&[0, 0])],
            "node 0 is an operand twice",
        ),
        (
            vec![leaf.clone(), sum(&[0])],
            "node 1: the number of its operands does not fit",
        ),
        (vec![leaf.clone(), leaf.clone()], "node 0 is no operand"),
    ] {
        let text = serde_json::json!({ "nodes": nodes }).to_string();
        let error = Format::Json
            .read::<Tree>(text.as_bytes())
            .expect_err("a broken tree");
        assert!(error.starts_with(expected), "{error}");
    }
    let region = |steps: &str| serde_json::from_str::<Region>(&format!("{{\"steps\":{steps}}}"));
    for (steps, expected) in [
        (r#"["Union"]"#, "step 0 has too few operands"),
        (
            r#"["Everywhere", "Everywhere"]"#,
            "the steps leave 2 results instead of one",
        ),
        ("[]", "the steps leave 0 results instead of one"),
    ] {
        let error = region(steps).expect_err("a broken region").to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}

/// Parry panics when it computes the bounds of a round shape with a negative border.
#[test]
fn round_shapes_with_a_negative_border_are_refused() {
    for shape in [
        SharedShape::round_cuboid(1.0, 1.0, 1.0, 0.25),
        SharedShape::round_cylinder(1.0, 1.0, 0.25),
        SharedShape::round_cone(1.0, 1.0, 0.25),
    ] {
        let tree = Tree::from(Field::uniform(Vector::X).within(Region::shape(shape)));
        let text = serde_json::to_string(&tree).expect("a tree");
        assert!(serde_json::from_str::<Tree>(&text).is_ok());
        let thin = text.replace("\"border_radius\":0.25", "\"border_radius\":-0.25");
        let error = serde_json::from_str::<Tree>(&thin).expect_err("less than no border");
        let expected = "the border of a round shape must not be negative";
        assert!(error.to_string().starts_with(expected), "{error}");
    }
}

/// Sizes, indices and counts that no shape can have.
#[test]
fn shapes_of_impossible_sizes_are_refused() {
    let corners = || vec![Vector::ZERO, Vector::X, Vector::Y, Vector::Z];
    let mesh = || SharedShape::trimesh(corners(), vec![[0, 2, 1]]).expect("a mesh");
    let line = || SharedShape::polyline(corners(), None);
    let hull = || SharedShape::convex_hull(&corners()).expect("a hull");
    let plain = HeightField::new(Array2::new(2, 2, vec![0.25; 4]), Vector::splat(2.5));
    let ground = || SharedShape::new(plain.clone());
    let cases = [
        (
            SharedShape::ball(0.25),
            "\"radius\":0.25",
            "\"radius\":-0.25",
        ),
        (
            SharedShape::ball(0.25),
            "\"radius\":0.25",
            "\"radius\":1e39",
        ),
        (mesh(), "[[0,2,1]]", "[]"),
        (mesh(), "[[0,2,1]]", "[[0,4,1]]"),
        (mesh(), "[0.0,1.0,0.0]", "[0.0,1e39,0.0]"),
        (line(), "[[0,1],[1,2],[2,3]]", "[]"),
        (line(), "[0.0,1.0,0.0]", "[0.0,1e39,0.0]"),
        (hull(), "[0.0,0.0,1.0]", "[1.0,1.0,0.0]"),
        (ground(), "\"rows\":2", "\"rows\":1"),
        (ground(), "\"rows\":2", "\"rows\":4"),
        (ground(), "\"rows\":2", "\"rows\":3"),
        (ground(), "2.5,2.5,2.5", "2.5,1e39,2.5"),
        (ground(), "\"status\":[0]", "\"status\":[]"),
    ];
    for (shape, from, to) in cases {
        // In f64 there is such a number.
        if to.contains("1e39") && size_of::<Real>() == 8 {
            continue;
        }
        let tree = Tree::from(Field::radial(1.0, -1.0).around(shape));
        let text = serde_json::to_string(&tree).expect("a tree");
        assert!(serde_json::from_str::<Tree>(&text).is_ok());
        let damaged = text.replace(from, to);
        assert_ne!(damaged, text, "{from} is not in {text}");
        let read = serde_json::from_str::<Tree>(&damaged);
        assert!(read.is_err(), "{to} was accepted");
    }
}

/// Winds within winds are the only nesting in the data: a short text must not overflow the stack.
#[test]
fn winds_nested_too_deep_are_refused() {
    let deep = (0..40).fold(Field::uniform(Vector::X), |flow, _| flow.as_wind(1.0, 0.0));
    let error = Format::Json
        .write(&Tree::from(deep))
        .expect_err("a deep wind");
    assert!(error.contains("winds within each other"), "{error}");
    // In postcard, a wind within a wind is one byte: the number of the variant.
    let shallow = Tree::from(Field::uniform(Vector::X).as_wind(1.0, 0.0));
    let written = Format::Postcard.write(&shallow).expect("a wind");
    let mut refused = 0;
    for place in 0..written.len() {
        let mut hostile = written[..place].to_vec();
        hostile.extend(std::iter::repeat_n(5, 100_000));
        refused += usize::from(Format::Postcard.read::<Tree>(&hostile).is_err());
    }
    assert!(refused > 0, "what follows a whole tree is not read");
}

/// Reads damaged bytes and steps the tree, if there is one; counts whether it was read, and whether it was stepped.
fn survive(format: Format, bytes: &[u8]) -> [usize; 2] {
    let Ok(mut tree) = format.read::<Tree>(bytes) else {
        return [0, 0];
    };
    let _ = tree.resolve(&trees::registry());
    assert!(tree.depth() <= tree.field_count().max(bytes.len()));
    let Ok(mut fields) = Fields::builder(tree)
        .axis("delta", 0.5)
        .axis("epsilon", 0.5)
        .build()
    else {
        return [1, 0];
    };
    let mut world = PhysicsWorld::new();
    for x in [0.0, 1.5] {
        let body = RigidBodyBuilder::dynamic().translation(Vector::X * x);
        world.insert(body, ColliderBuilder::ball(0.5));
    }
    let _ = fields.step(&mut world);
    [1, 1]
}

#[test]
fn damaged_bytes_give_an_error_or_a_tree() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let mut random = Random::new(11);
    let (mut read, mut ran) = (0, 0);
    for _ in 0..cases(60).cases {
        let mut draw = |s: &mut dyn FnMut(&mut TestRunner)| s(&mut runner);
        let (mut plans, mut plan) = (Vec::new(), Vec::new());
        draw(&mut |runner| plans = bodies(3, 1..=3).new_tree(runner).expect("bodies").current());
        draw(&mut |runner| {
            plan = terms(Numbers::Integer)
                .new_tree(runner)
                .expect("terms")
                .current()
        });
        let world = World::new(&plans);
        let random_tree = Tree::fold(
            Operator::SumUnion,
            plan.iter().map(|term| term.term(&world)),
        );
        // A step with the tree of `rarities`, which cuts bodies along hills, takes long.
        for (tree, count) in [(random_tree, 20), (rarities(), 5)] {
            for format in FORMATS {
                let whole = format.write(&tree).expect("what can be written");
                for _ in 0..count {
                    let mut bytes = whole.clone();
                    for _ in 0..1 + random.bits() % 4 {
                        let place = (random.bits() % bytes.len() as u64) as usize;
                        match random.bits() % 4 {
                            0 => bytes[place] = random.bits() as u8,
                            1 => bytes[place] ^= 1 << (random.bits() % 8),
                            2 => bytes[place] = 0xff,
                            _ => bytes.truncate(place.max(1)),
                        }
                    }
                    let [was_read, was_run] = survive(format, &bytes);
                    (read, ran) = (read + was_read, ran + was_run);
                }
            }
        }
    }
    assert!(
        ran > 100 && read > ran,
        "only {read} were read, and {ran} ran"
    );
}
