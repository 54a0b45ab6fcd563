//! Invalid input gives a typed error that names the field, no panic, and leaves the world unchanged.

use rapier3d_fields::math::Pose;
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::bits::bits;

const NAN: Real = Real::NAN;
const INFINITY: Real = Real::INFINITY;

/// A collider that never existed.
fn nobody() -> ColliderHandle {
    ColliderHandle::from_raw_parts(78, 0)
}

/// Values no length, stiffness or component may have.
const NOT_FINITE: [Real; 3] = [NAN, INFINITY, -INFINITY];

/// Asserts that `Fields` and `Reference` refuse the tree with the same error, and returns it.
fn refused(tree: impl Into<Tree>, what: &str) -> BuildError {
    let tree: Tree = tree.into();
    let error = Fields::new(tree.clone())
        .err()
        .unwrap_or_else(|| panic!("{what}: accepted"));
    let of_reference = Reference::new(&tree).err();
    // `Reference` accepts user axes that are not declared.
    if !matches!(error, BuildError::UnknownAxis { .. }) {
        assert_eq!(
            of_reference.map(|e| e.to_string()),
            Some(error.to_string()),
            "{what}"
        );
    }
    error
}

/// Asserts that `culprit` is refused for a parameter and named in the error, beside a valid field.
fn refuses_parameter(culprit: Field, what: &str) {
    let tree = Field::uniform(Vector::X)
        .named("innocent")
        .sum_union(culprit.named("culprit"));
    let error = refused(tree, what);
    assert!(
        matches!(error, BuildError::Parameter { .. }),
        "{what}: {error:?}"
    );
    assert!(error.to_string().contains("`culprit`"), "{what}: {error}");
}

#[test]
fn lengths_must_be_positive_and_finite() {
    let within = |region: Region| Field::uniform(Vector::X).within(region);
    for bad in [0.0, -0.0, -1.0, NAN, INFINITY, -INFINITY] {
        for (what, region) in [
            ("ball", Region::ball(bad)),
            ("cuboid x", Region::cuboid(Vector::new(bad, 1.0, 1.0))),
            ("cuboid z", Region::cuboid(Vector::new(1.0, 1.0, bad))),
            ("cylinder height", Region::cylinder(bad, 1.0)),
            ("cylinder radius", Region::cylinder(1.0, bad)),
            ("cone height", Region::cone(bad, 1.0)),
            ("cone radius", Region::cone(1.0, bad)),
            ("capsule height", Region::capsule(bad, 1.0)),
            ("capsule radius", Region::capsule(1.0, bad)),
            (
                "half-space",
                Region::half_space(Vector::X * (bad * 2.0), 0.0),
            ),
        ] {
            // The same within a composite region.
            let composite = Region::ball(1.0).union(region.clone().complement());
            refuses_parameter(within(region), &format!("{what} of {bad}"));
            refuses_parameter(within(composite), &format!("composite {what} of {bad}"));
        }
        refuses_parameter(Field::radial(1.0, 1.0).shifted_to_zero_at(bad), "a cutoff");
        refuses_parameter(Field::lennard_jones(1.0, bad), "sigma");
    }
    for bad in NOT_FINITE {
        refuses_parameter(within(Region::half_space(Vector::X, bad)), "an offset");
        refuses_parameter(
            within(Region::ball(1.0).at(Vector::Y * bad)),
            "a moved region",
        );
    }
    for (low, high) in [
        (1.0, 1.0),
        (2.0, 1.0),
        (NAN, 1.0),
        (0.0, NAN),
        (INFINITY, INFINITY),
    ] {
        for axis in ["x", "time"] {
            refuses_parameter(within(Region::interval(axis, low, high)), "an interval");
        }
    }
    refuses_parameter(
        within(Region::half_space(Vector::ZERO, 0.0)),
        "no direction",
    );
}

#[test]
fn parameters_of_formulas_must_be_finite() {
    for bad in NOT_FINITE {
        let contact = |restitution| Field::contact(ContactLaw::restitution(restitution));
        for (what, field) in [
            ("uniform", Field::uniform(Vector::Y * bad)),
            ("magnetic", Field::magnetic(Vector::Z * bad)),
            ("radial strength", Field::radial(bad, 1.0)),
            ("radial power", Field::radial(1.0, bad)),
            ("softening", Field::radial(1.0, -2.0).softened(bad)),
            ("gravity", Field::point_gravity(bad)),
            ("Coulomb constant", Field::coulomb(bad, 1.0)),
            ("Coulomb charge", Field::coulomb(1.0, bad)),
            ("epsilon", Field::lennard_jones(bad, 1.0)),
            ("stiffness", Field::spring(bad)),
            ("damping", Field::spring_damper(1.0, bad, 0.0)),
            ("rest length", Field::spring_damper(1.0, 0.0, bad)),
            ("linear drag", Field::drag(bad, 0.0)),
            ("quadratic drag", Field::drag(0.0, bad)),
            ("restitution", contact(bad).at(nobody())),
        ] {
            refuses_parameter(field, what);
        }
    }
    refuses_parameter(
        Field::radial(1.0, -2.0).softened(-1.0),
        "negative softening",
    );
    refuses_parameter(Field::coulomb(Real::MAX, 2.0), "a product that overflows");
    for restitution in [-0.1, 1.1] {
        let field = Field::contact(ContactLaw::restitution(restitution));
        refuses_parameter(field.at(nobody()), "restitution");
    }
}

#[test]
fn poses_must_be_finite() {
    let mut turned = Pose::IDENTITY;
    turned.rotation.x = NAN;
    let mut flat = Pose::IDENTITY;
    flat.rotation.w = 0.0;
    let bad = [
        ("NaN place", Pose::from_translation(Vector::X * NAN)),
        (
            "infinite place",
            Pose::from_translation(Vector::X * INFINITY),
        ),
        ("NaN rotation", turned),
        ("zero rotation", flat),
    ];
    for (what, local_pose) in bad {
        let body = Anchor::Body {
            handle: RigidBodyHandle::invalid(),
            local_pose,
        };
        let collider = Anchor::Collider {
            handle: nobody(),
            local_pose,
        };
        for anchor in [Anchor::World { local_pose }, body, collider] {
            refuses_parameter(Field::uniform(Vector::X).at(anchor), what);
            let culprit = Field::uniform(Vector::X).named("culprit");
            let instances = Tree::instances(culprit, [Anchor::WORLD, anchor]);
            let error = refused(instances, &format!("an instance with {what}"));
            assert!(error.to_string().contains("`culprit`"), "{what}: {error}");
        }
        refuses_parameter(
            Field::uniform(Vector::X).within(Region::ball(1.0).at(local_pose)),
            what,
        );
    }
}

#[test]
fn axes_must_be_declared_once() {
    let of_region = Field::uniform(Vector::X).within(Region::interval("warmth", 0.0, 1.0));
    let of_coupling = Field::uniform(Vector::X).coupled_to_axis("warmth");
    let of_closure = Field::closure(["warmth".into()], |s: &Sample| Vector::X * s.axes[0]);
    for field in [of_region, of_coupling, of_closure] {
        let tree: Tree = field.clone().named("culprit").into();
        let error = refused(tree.clone(), "an unknown axis");
        assert!(
            matches!(&error, BuildError::UnknownAxis { axis, .. } if axis == "warmth"),
            "{error:?}"
        );
        assert!(error.to_string().contains("`culprit`"), "{error}");
        let with = |names: &[&str]| {
            let builder = Fields::builder(tree.clone());
            names
                .iter()
                .fold(builder, |builder, name| builder.axis(name, 1.0))
                .build()
        };
        assert!(with(&["warmth"]).is_ok());
        let again = with(&["warmth", "warmth"]).err();
        assert_eq!(
            again,
            Some(BuildError::DuplicateAxis {
                axis: "warmth".into()
            })
        );
        let built_in = with(&["warmth", "time"]).err();
        assert_eq!(
            built_in,
            Some(BuildError::DuplicateAxis {
                axis: "time".into()
            })
        );
        // A new tree is checked against the same axes; if it is refused, the old tree stays.
        let mut fields = Fields::new(Field::uniform(Vector::X)).expect("valid");
        assert!(matches!(
            fields.set_tree(tree.clone()),
            Err(BuildError::UnknownAxis { .. })
        ));
        assert_eq!(fields.plan().fields, 1);
    }
    for bad in NOT_FINITE {
        let fields = Fields::builder(Field::uniform(Vector::X))
            .axis("warmth", bad)
            .build();
        let error = fields.err().expect("refused");
        assert!(error.to_string().contains("`warmth`"), "{error}");
    }
}

#[test]
fn detection_fields_need_a_collider_and_an_operator_that_keeps_vectors() {
    let contact = || Field::contact(ContactLaw::Observe).named("culprit");
    let here = || contact().at(nobody());
    let other = || Field::uniform(Vector::X);
    let there = || Tree::instances(other().sum_union(contact()), [nobody()]);
    let in_world = Tree::instances(contact(), [Anchor::WORLD]);
    for tree in [
        there(),
        Tree::instances(there(), [Anchor::WORLD]),
        Tree::instances(in_world, [nobody()]),
    ] {
        assert!(Fields::new(tree).is_ok());
    }
    let at_body = Anchor::from(RigidBodyHandle::invalid());
    for tree in [
        contact().into(),
        contact().at(Vector::X).into(),
        contact().at(RigidBodyHandle::invalid()).into(),
        Tree::instances(contact(), [Anchor::WORLD]),
        Tree::instances(contact(), [at_body]),
        Tree::instances(other().sum_union(contact()), [nobody().into(), at_body]),
        Tree::instances(there().sum_union(contact()), [Anchor::WORLD]),
        Tree::instances(contact().at(RigidBodyHandle::invalid()), [nobody()]),
    ] {
        let error = refused(tree, "no collider");
        assert!(
            matches!(error, BuildError::DetectionAnchor { .. }),
            "{error:?}"
        );
        assert!(error.to_string().contains("`culprit`"), "{error}");
    }
    for operator in Operator::ALL {
        for operands in [
            [Tree::from(here()), other().into()],
            [other().into(), here().difference(other())],
        ] {
            let tree = Tree::fold(operator, operands);
            use Operator::{CrossIntersection, CrossUnion, Maximum, Minimum, Strongest, Weakest};
            let mixing = [
                CrossUnion,
                CrossIntersection,
                Strongest,
                Weakest,
                Minimum,
                Maximum,
            ];
            if mixing.contains(&operator) {
                let error = refused(tree, operator.symbol());
                assert!(
                    matches!(error, BuildError::DetectionOperand { .. }),
                    "{error:?}"
                );
                assert!(error.to_string().contains("`culprit`"), "{error}");
            } else {
                assert!(Fields::new(tree).is_ok(), "{operator}");
            }
        }
    }
}

#[test]
fn an_empty_tree_is_refused() {
    assert_eq!(refused(Tree::empty(), "nothing"), BuildError::Empty);
    let nothing = Tree::fold(Operator::SumUnion, Vec::<Tree>::new());
    assert_eq!(refused(nothing, "no operands"), BuildError::Empty);
    let instances = Tree::instances(Field::uniform(Vector::X), Vec::<Anchor>::new());
    assert_eq!(refused(instances, "no instances"), BuildError::Empty);
}

/// Building, cloning, printing and dropping a tree must not recurse to its depth.
#[test]
fn depth_cannot_exhaust_the_stack() {
    const DEEP: usize = 100_000;
    let leaf = || Field::uniform(Vector::X);
    let alternating = [
        Operator::CrossUnion,
        Operator::Difference,
        Operator::CrossIntersection,
        Operator::SumUnion,
    ];
    let operator = |level: usize| alternating[level % alternating.len()];
    let start = || Tree::from(leaf());
    let left = (1..DEEP).fold(start(), |tree, i| {
        Tree::fold(operator(i), [tree, leaf().into()])
    });
    let right = (1..DEEP).fold(start(), |tree, i| {
        Tree::fold(operator(i), [leaf().into(), tree])
    });
    // The outermost sum of union separates terms and is no level, so a difference goes around it.
    let under = |tree: Tree| tree.difference(leaf());
    let [left, right] = [left, right].map(under);
    let instances = (1..DEEP).fold(start(), |tree, _| Tree::instances(tree, [Anchor::WORLD]));
    let instances = under(instances);
    for (what, tree) in [("left", left), ("right", right), ("instances", instances)] {
        let copy = tree.clone();
        assert!(
            matches!(refused(tree, what), BuildError::TooDeep { depth: DEEP, .. }),
            "{what}"
        );
        assert!(format!("{copy:?}").len() > DEEP, "{what}");
    }
    let mut fields = Fields::new(leaf()).expect("valid");
    let deep = (0..DEEP).fold(start(), |tree, _| tree.difference(leaf()));
    assert!(fields.set_tree(deep).is_err());
}

/// On the default stack of a thread.
#[test]
fn the_deepest_accepted_trees_work() {
    let leaf = |v: Vector| Field::uniform(v).within(Region::ball(1.0));
    let nest = |tree: Tree, _| tree.cross_union(leaf(Vector::Y));
    let left = (0..512).fold(Tree::from(leaf(Vector::X)), nest);
    let right = (0..512).fold(Tree::from(leaf(Vector::X)), |tree, _| {
        leaf(Vector::Y).cross_union(tree)
    });
    for tree in [left, right] {
        assert_eq!(tree.depth(), 512);
        let mut world = PhysicsWorld::new();
        let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
        let mut fields = Fields::new(tree).expect("at the limit");
        let wrench = fields.sample(body, &world).expect("finite");
        let length = wrench.expect("sampled").force.length();
        assert!(
            (length - 1.0).abs() < 1e-5,
            "{length}: X turned about Y again and again"
        );
        fields.step(&mut world).expect("a step");
    }
}

#[test]
fn a_deep_region_works() {
    let deep =
        |grow: fn(Region) -> Region| (0..100_000).fold(Region::ball(1.0), |region, _| grow(region));
    let ball = || Region::ball(1.0);
    let left = deep(Region::complement);
    let cut = deep(|region| {
        region
            .difference(Region::ball(2.0))
            .union(Region::ball(1.0))
    });
    let right = (0..1_000).fold(ball(), |region, _| ball().union(region.complement()));
    for (what, region) in [("left", left), ("cut", cut), ("right", right)] {
        let copy = region.clone().at(Vector::ZERO);
        let mut world = PhysicsWorld::new();
        let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
        // Inside, and on the surface, where the neighbourhood decides.
        for x in [0.0, 1.0] {
            world.bodies[body].set_translation(Vector::X * x, true);
            let field = Field::uniform(Vector::Y).within(copy.clone());
            let fields = Fields::new(field.sampled(Sampling::Centre)).expect("valid");
            let wrench = fields.sample(body, &world).expect("finite");
            assert_eq!(wrench.map(|w| w.force), Some(Vector::Y), "{what} at {x}");
        }
    }
}

/// A region of any shape that Parry can construct may be empty, but must not panic.
#[test]
fn hostile_shapes_do_not_panic() {
    let mut world = PhysicsWorld::new();
    let (body, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
    let before = bits(&world);
    for bad in [NAN, INFINITY, 0.0, Real::MAX, Real::MIN_POSITIVE] {
        let shapes = [
            SharedShape::ball(bad),
            SharedShape::cuboid(bad, 1.0, bad),
            SharedShape::cylinder(bad, bad),
            SharedShape::cone(1.0, bad),
            SharedShape::capsule_y(bad, 1.0),
            SharedShape::triangle(Vector::X * bad, Vector::Y, Vector::Z),
        ];
        for shape in shapes {
            let kind = shape.shape_type();
            for x in [0.0, 1.0, bad] {
                let region = Region::shape(shape.clone()).at(Vector::X);
                let field = Field::uniform(Vector::Y).within(region);
                let field = if x.is_finite() {
                    field.at(Vector::X * x)
                } else {
                    field
                };
                // Either the build fails or the wrench is finite.
                let Ok(fields) = Fields::new(field) else {
                    continue;
                };
                let wrench = fields.sample(body, &world);
                let finite = wrench.is_ok_and(|wrench| wrench.is_some_and(|w| w.is_finite()));
                assert!(finite, "{kind:?} of {bad} at {x}");
            }
        }
    }
    assert_eq!(bits(&world), before);
}

/// Regression: the table of laws by collider was as long as the largest index. An invalid handle has the largest
/// possible one, so 64 GB were requested and the process aborted.
#[test]
fn a_detection_field_on_an_invalid_handle_can_be_built() {
    let contact = Field::contact(ContactLaw::Observe).at(ColliderHandle::invalid());
    assert!(Fields::new(contact).is_ok());
}

#[test]
#[should_panic(expected = "the set has no field named `pool`; there are `earth`, `belt`")]
fn an_index_that_finds_no_field_lists_the_names() {
    let named = |name| Field::uniform(Vector::X).named(name);
    let fields = Fields::new(named("earth") + named("belt")).expect("a valid tree");
    let _ = &fields["pool"];
}

#[test]
fn a_pool_in_which_everything_would_sink_is_refused() {
    let (half_extents, gravity) = (Vector::splat(4.0), -9.81);
    let pool = Tree::pool(Vector::ZERO, half_extents, 1000.0, gravity, 1.0);
    let error = Fields::new(pool).err().expect("a gravity below zero");
    let expected = "field #0 (buoyancy): the gravity must be zero or more, and finite, but is -9.8";
    assert!(error.to_string().starts_with(expected), "{error}");
}

#[test]
fn a_time_that_is_not_finite_is_refused_when_it_is_set() {
    let mut fields = Fields::new(Field::uniform(Vector::X)).expect("a valid tree");
    fields.state.set_time(2.5).expect("a finite time");
    for time in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = fields.state.set_time(time).expect_err("not finite");
        assert!(
            error
                .to_string()
                .starts_with("the value of axis `time` must be finite")
        );
        assert_eq!(fields.time(), 2.5);
    }
}
