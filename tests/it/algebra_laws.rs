//! The algebra of the paper's §3.1, law by law, for `Reference`. All numbers are integers, so the tolerance is zero.

use proptest::prelude::*;
use rapier3d_fields::math::DVec3;
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::cases;
use crate::support::model::model as composite;
use crate::support::model::{
    self, Point, apply, figure_1, force, leaf, nested, operator, points, query, same, vector,
};

proptest! {
    #![proptest_config(cases(250))]

    /// Any composite equals its independent derivation by the paper's figure 1: inside, outside and on boundaries.
    #[test]
    fn composites_equal_figure_1(model in composite(), points in points()) {
        let tree = model.tree();
        for at in &points {
            prop_assert_eq!(force(&tree, at), model.force(at), "at {:?} halves", at);
        }
    }

    /// Each operator alone, so that a failure is easy to read.
    #[test]
    fn each_operator_equals_its_line_of_figure_1(
        operator in operator(), u in leaf(), v in leaf(), points in points(),
    ) {
        let tree = Tree::fold(operator, [u.tree(), v.tree()]);
        for at in &points {
            let (cells, vector) = figure_1(operator, u.at(at), v.at(at));
            let expected = (cells != 0).then_some(vector);
            prop_assert_eq!(force(&tree, at), expected, "{} at {:?} halves", operator, at);
        }
    }

    /// A region is the set of its definition, for all combinations of primitives.
    #[test]
    fn regions_equal_their_sets(set in model::set(), points in points()) {
        let field = Field::uniform(Vector::X).within(set.region()).into();
        for at in &points {
            let expected = set.cells(at) != 0;
            prop_assert_eq!(force(&field, at).is_some(), expected, "at {:?} halves", at);
        }
    }

    #[test]
    fn sums_commute(u in composite(), v in composite(), points in points()) {
        let (u, v) = (u.tree(), v.tree());
        for operator in [Operator::SumUnion, Operator::SumIntersection] {
            let (left, right) = (apply(operator, &u, &v), apply(operator, &v, &u));
            same(operator.symbol(), &left, &right, &points)?;
        }
    }

    #[test]
    fn plus_is_the_sum_of_union(u in composite(), v in composite(), points in points()) {
        let (u, v) = (u.tree(), v.tree());
        let sum = apply(Operator::SumUnion, &u, &v);
        let mut grown = u.clone();
        grown += v.clone();
        same("+=", &sum, &grown, &points)?;
        same("+", &sum, &(u.clone() + v.clone()), &points)?;
        same("sum", &sum, &[u, v].into_iter().sum(), &points)?;
    }

    /// An operator of many operands also equals its nested form.
    #[test]
    fn sums_and_replacements_associate(
        u in composite(), v in composite(), w in composite(), points in points(),
    ) {
        let trees = [u.tree(), v.tree(), w.tree()];
        let [u, v, w] = &trees;
        for operator in Operator::ALL.into_iter().filter(|operator| operator.is_associative()) {
            let left = apply(operator, &apply(operator, u, v), w);
            let right = apply(operator, u, &apply(operator, v, w));
            same(&format!("grouping of {operator}"), &left, &right, &points)?;
            let flat = Tree::fold(operator, trees.clone());
            same(&format!("chain of {operator}"), &left, &flat, &points)?;
        }
    }

    /// "Whether the set operation be union, intersection, or difference" (§3.1.2): cutting one
    /// set after the other is cutting both, in either order, however the cutters are combined.
    #[test]
    fn successive_differences_cut_the_union(
        u in composite(), v in composite(), w in composite(), points in points(),
    ) {
        let (u, v, w) = (u.tree(), v.tree(), w.tree());
        let cut = |u: &Tree, v: &Tree| apply(Operator::Difference, u, v);
        let both = cut(&cut(&u, &v), &w);
        same("(U−V)−W = (U−W)−V", &both, &cut(&cut(&u, &w), &v), &points)?;
        for union in [Operator::SumUnion, Operator::CrossUnion, Operator::ReplaceUnion] {
            let law = format!("(U−V)−W = U−(V {union} W)");
            same(&law, &both, &cut(&u, &apply(union, &v, &w)), &points)?;
        }
        for meet in [Operator::SumIntersection, Operator::ReplaceIntersection] {
            let law = format!("U−(V {meet} W) = (U−V) →∪ (U−W)");
            let either = apply(Operator::ReplaceUnion, &cut(&u, &v), &cut(&u, &w));
            same(&law, &cut(&u, &apply(meet, &v, &w)), &either, &points)?;
        }
    }

    #[test]
    fn cross_products_anticommute_where_both_are_defined(
        u in composite(), v in composite(), points in points(),
    ) {
        for operator in [Operator::CrossUnion, Operator::CrossIntersection] {
            let uv = apply(operator, &u.tree(), &v.tree());
            let vu = apply(operator, &v.tree(), &u.tree());
            for at in &points {
                let both = u.force(at).is_some() && v.force(at).is_some();
                let sign = if both { -1.0 } else { 1.0 };
                let expected = force(&vu, at).map(|vector| vector * sign);
                prop_assert_eq!(force(&uv, at), expected, "{} at {:?} halves", operator, at);
            }
        }
    }

    /// The empty tree is the empty set, with every operator and on either side.
    #[test]
    fn the_empty_tree_is_defined_nowhere(u in composite(), points in points()) {
        let u = u.tree();
        for operator in Operator::ALL {
            let right = Tree::fold(operator, [u.clone(), Tree::empty()]);
            let left = Tree::fold(operator, [Tree::empty(), u.clone()]);
            for (tree, own, other) in [(right, true, false), (left, false, true)] {
                for at in &points {
                    let value = |present: bool| {
                        let force = if present { force(&u, at) } else { None };
                        (u64::from(force.is_some()), force.unwrap_or(DVec3::ZERO))
                    };
                    let (cells, vector) = figure_1(operator, value(own), value(other));
                    let expected = (cells != 0).then_some(vector);
                    let found = if tree.field_count() == 0 { None } else { force(&tree, at) };
                    prop_assert_eq!(found, expected, "{} at {:?} halves", operator, at);
                }
            }
        }
    }

    /// Instances equal the sum of union of moved copies of the prototype.
    #[test]
    fn instances_are_sums_of_moved_copies(
        set_u in model::set(), set_v in model::set(), operator in operator(),
        shifts in proptest::collection::vec(proptest::array::uniform3(-2..=2), 1..4),
        points in points(),
    ) {
        let part = |set: &model::Set, v: Vector, shift: Vector| {
            Field::uniform(v).within(set.region()).at(shift)
        };
        let at_shift = |shift: Vector| {
            let u = part(&set_u, Vector::X, shift);
            Tree::fold(operator, [u, part(&set_v, Vector::new(0.0, 2.0, 1.0), shift)])
        };
        let shifts: Vec<Vector> = shifts.into_iter().map(vector).collect();
        let instances = Tree::instances(at_shift(Vector::ZERO), shifts.clone());
        let copies = Tree::fold(Operator::SumUnion, shifts.iter().map(|shift| nested(&at_shift(*shift))));
        same("instances", &instances, &copies, &points)?;
    }
}

#[test]
fn cross_products_do_not_associate() {
    let [x, y] = [Vector::X, Vector::Y].map(|v| Tree::from(Field::uniform(v)));
    for operator in [Operator::CrossUnion, Operator::CrossIntersection] {
        let right = apply(operator, &x, &apply(operator, &x, &y));
        let left = apply(operator, &apply(operator, &x, &x), &y);
        assert_eq!(
            force(&right, &[0; 5]),
            Some(DVec3::NEG_Y),
            "{operator}: x × (x × y)"
        );
        assert_eq!(
            force(&left, &[0; 5]),
            Some(DVec3::ZERO),
            "{operator}: (x × x) × y"
        );
    }
}

/// §3.1.1's example: R⁴ with time and R⁴ with δ make R⁵; each operand is constant along the axis
/// it does not name, and slices along the others give it back.
#[test]
fn operands_are_constant_along_axes_they_do_not_name() {
    let ball = || Region::ball(2.0);
    let early =
        Field::uniform(Vector::X).within(ball().intersection(Region::interval("time", 0.0, 2.0)));
    let close =
        Field::uniform(Vector::Y).within(ball().intersection(Region::interval("delta", 1.0, 3.0)));
    let tree = early.clone().sum_union(close.clone());
    let (early, close) = (Tree::from(early), Tree::from(close));
    for time in -1..=6 {
        for delta in -1..=8 {
            for x in -1..=5 {
                let at = [x, 0, 0, time, delta];
                let (in_time, near) = ((0..=4).contains(&time), (2..=6).contains(&delta));
                let inside = x <= 4;
                let terms = [(in_time, DVec3::X), (near, DVec3::Y)];
                let present = terms.into_iter().filter(|(acts, _)| inside && *acts);
                let expected = present.map(|(_, vector)| vector).reduce(|u, v| u + v);
                assert_eq!(force(&tree, &at), expected, "at {at:?} halves");
                // The extrusions: moving along the other operand's axis changes nothing.
                assert_eq!(force(&early, &at), force(&early, &[x, 0, 0, time, 0]));
                assert_eq!(force(&close, &at), force(&close, &[x, 0, 0, 0, delta]));
            }
        }
    }
}

/// Where no value is given along an axis, a region over it is empty.
#[test]
fn a_sample_without_a_coordinate_is_outside() {
    let tree = Field::uniform(Vector::X)
        .within(Region::interval("delta", -1.0, 1.0))
        .into();
    let world = PhysicsWorld::new();
    let mut query = query(&[0; 5]);
    let reference = Reference::new(&tree).expect("valid");
    let frames = WorldRef::from(&world);
    assert_eq!(reference.force(&frames, &query), Some(DVec3::X));
    query.user = [].into();
    assert_eq!(reference.force(&frames, &query), None);
}

/// Where a field is carried by the sampled body, operators treat it as absent, not as zero.
#[test]
fn own_fields_never_act_on_their_body() {
    let mut world = PhysicsWorld::new();
    let (own, collider) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(1.0));
    let (other, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(1.0));
    let loose = world.insert_collider(ColliderBuilder::ball(1.0), None);
    for (anchor, is_own) in [
        (Anchor::from(own), true),
        (Anchor::from(collider), true),
        (Anchor::from(other), false),
        (Anchor::from(loose), false),
        (Anchor::WORLD, false),
    ] {
        let there = Field::uniform(Vector::X);
        let anchored = Field::uniform(Vector::Y * 2.0).at(anchor);
        for operator in Operator::ALL {
            let tree = Tree::fold(operator, [there.clone(), anchored.clone()]);
            let mut sample = query(&[0; 5]);
            sample.body = Some(own);
            let found = Reference::new(&tree)
                .expect("valid")
                .force(&WorldRef::from(&world), &sample);
            let g = (u64::from(!is_own), DVec3::Y * 2.0);
            let (cells, vector) = figure_1(operator, (1, DVec3::X), g);
            assert_eq!(
                found,
                (cells != 0).then_some(vector),
                "{operator}, {anchor:?}"
            );
        }
        let instances = Tree::instances(Field::uniform(Vector::Y), [anchor]);
        let reference = Reference::new(&instances).expect("valid");
        let mut sample = query(&[0; 5]);
        sample.body = Some(own);
        let found = reference.force(&WorldRef::from(&world), &sample);
        assert_eq!(found.is_none(), is_own, "an instance at {anchor:?}");
    }
}

fn unit_box(x: Real, y: Real, z: Real) -> Region {
    Region::cuboid(Vector::splat(1.0)).at(Vector::new(x, y, z))
}

fn holds(region: &Region, at: Point) -> bool {
    force(
        &Field::uniform(Vector::X).within(region.clone()).into(),
        &at,
    )
    .is_some()
}

/// Boxes share a face, an edge or a corner: its middle is in both, in their union and in their difference, but not in
/// their intersection.
#[test]
fn boxes_that_only_touch_intersect_in_nothing() {
    let shared = [
        ([1.0, 0.0, 0.0], "face"),
        ([1.0, 1.0, 0.0], "edge"),
        ([1.0; 3], "corner"),
    ];
    for ([x, y, z], what) in shared {
        let (a, b) = (unit_box(-x, -y, -z), unit_box(x, y, z));
        let middle = [0; 5];
        assert!(holds(&a, middle) && holds(&b, middle), "{what}");
        assert!(holds(&a.clone().union(b.clone()), middle), "{what}");
        assert!(holds(&a.clone().difference(b.clone()), middle), "{what}");
        assert!(!holds(&a.clone().intersection(b.clone()), middle), "{what}");
        for operator in [
            Operator::SumIntersection,
            Operator::CrossIntersection,
            Operator::ReplaceIntersection,
        ] {
            let [u, v] = [&a, &b].map(|set| Field::uniform(Vector::X).within(set.clone()));
            let tree = Tree::fold(operator, [u, v]);
            assert_eq!(force(&tree, &middle), None, "{operator} at a common {what}");
        }
    }
}

#[test]
fn a_difference_keeps_its_cut_boundary() {
    let (whole, part) = (Region::cuboid(Vector::splat(2.0)), unit_box(0.0, 0.0, 0.0));
    let hollow = whole.clone().difference(part.clone());
    assert!(holds(&hollow, [2, 0, 0, 0, 0]), "a cut face");
    assert!(holds(&hollow, [2, 2, 2, 0, 0]), "a cut corner");
    assert!(!holds(&hollow, [1, 1, 1, 0, 0]), "inside the cut");
    // A cut that ends flush with the whole leaves nothing on the common face …
    let flush = whole.clone().difference(unit_box(1.0, 0.0, 0.0));
    assert!(
        !holds(&flush, [4, 0, 0, 0, 0]),
        "the middle of the common face"
    );
    assert!(holds(&flush, [4, 2, 0, 0, 0]), "its edge");
    // … and cutting out of the cut brings it back.
    let nested = whole.difference(unit_box(1.0, 0.0, 0.0).difference(unit_box(1.0, 1.0, 0.0)));
    assert!(
        holds(&nested, [4, 1, 0, 0, 0]),
        "cut, and cut out of the cut"
    );
    assert!(!holds(&nested, [4, -1, 0, 0, 0]), "cut only");
}

/// Boxes with a face in the same plane, on the same side of it and on opposite sides.
#[test]
fn boxes_with_coplanar_faces_meet_only_on_the_same_side() {
    let wide = Region::cuboid(Vector::new(1.0, 2.0, 2.0));
    let (low, beside) = (unit_box(0.0, 0.0, 0.0), unit_box(2.0, 0.0, 0.0));
    let (middle, aside) = ([2, 0, 0, 0, 0], [2, 3, 0, 0, 0]);
    // From the same side, they share the smaller face …
    assert!(holds(&wide.clone().intersection(low.clone()), middle));
    assert!(!holds(&wide.clone().intersection(low.clone()), aside));
    assert!(!holds(&wide.clone().difference(low.clone()), middle));
    assert!(holds(&wide.clone().difference(low.clone()), aside));
    // … from both sides, nothing; and the union has no face there.
    assert!(!holds(&wide.clone().intersection(beside.clone()), middle));
    let both = wide.union(beside);
    assert!(holds(&both, middle) && !holds(&both.complement(), middle));
}

/// Until a front passes a face of a box, the region behind it only touches the box.
#[test]
fn a_moving_front_and_a_box_share_no_point_before_they_meet() {
    let behind = Region::half_space_over([(Axis::X, 1.0), (Axis::Time, -1.0)], 0.0);
    let region = behind.clone().intersection(unit_box(0.0, 0.0, 0.0));
    let at = |x: i32, time: i32| [x, 0, 0, time, 0];
    assert!(holds(&region, at(-2, -1)) && holds(&region, at(-1, -1)));
    assert!(!holds(&region, at(0, -1)), "ahead of the front");
    assert!(
        holds(&region, at(-2, -2)),
        "the front meets the face: just later it is past"
    );
    let before = Region::interval("time", -9.0, -1.0);
    assert!(
        !holds(&region.intersection(before), at(-2, -2)),
        "but never was before"
    );
    assert!(
        holds(&behind.complement(), at(-1, -1)),
        "the front itself is in both"
    );
}

#[test]
fn equal_boxes_intersect_in_themselves_and_leave_nothing() {
    let e = || unit_box(0.0, 0.0, 0.0);
    for at in [[0; 5], [2, 0, 0, 0, 0], [2, 2, 0, 0, 0], [-2, 2, -2, 0, 0]] {
        assert!(holds(&e().intersection(e()), at), "E ∩ E at {at:?} halves");
        assert!(!holds(&e().difference(e()), at), "E − E at {at:?} halves");
        assert!(
            !holds(&e().intersection(e().complement()), at),
            "E ∩ Eᶜ at {at:?} halves"
        );
        assert!(
            holds(&e().union(e().complement()), at),
            "E ∪ Eᶜ at {at:?} halves"
        );
    }
    assert!(
        holds(&e().complement(), [2, 0, 0, 0, 0]),
        "the complement keeps its boundary"
    );
    assert!(!holds(&e().complement(), [1, 0, 0, 0, 0]));
}

#[test]
fn intervals_of_time_that_only_touch_share_no_moment() {
    let (before, after) = (
        Region::interval("time", 0.0, 1.0),
        Region::interval("time", 1.0, 2.0),
    );
    let noon = [0, 0, 0, 2, 0];
    assert!(holds(&before, noon) && holds(&after, noon));
    assert!(!holds(&before.clone().intersection(after.clone()), noon));
    assert!(holds(&before.clone().difference(after.clone()), noon));
    assert!(holds(&before.union(after), noon));
}

/// The same through anchors and instances: what counts is where the sets are in the world.
#[test]
fn boundaries_meet_across_anchors_and_instances() {
    let part = |v: Vector| Field::uniform(v).within(unit_box(0.0, 0.0, 0.0));
    let row = |v: Vector, from: Real| {
        Tree::instances(part(v), [0.0, 4.0].map(|x| Vector::X * (from + x)))
    };
    let (u, v) = (row(Vector::X, 0.0), row(Vector::Y, 2.0));
    for x in [2, 6, 10] {
        let at = [x, 0, 0, 0, 0];
        assert_eq!(
            force(&u.clone().sum_intersection(v.clone()), &at),
            None,
            "x = {x} halves"
        );
    }
    assert_eq!(
        force(&u.clone().difference(v.clone()), &[2, 0, 0, 0, 0]),
        Some(DVec3::X)
    );
    assert_eq!(force(&u.clone().difference(u), &[2, 0, 0, 0, 0]), None);
}

/// Primitives of all kinds with integers for sizes and places, so that samples hit many boundaries.
fn solid() -> impl Strategy<Value = Region> {
    let size = || (1..=3).prop_map(|i| i as Real);
    let primitive = prop_oneof![
        size().prop_map(Region::ball),
        (size(), size(), size()).prop_map(|(x, y, z)| Region::cuboid(Vector::new(x, y, z))),
        (size(), size()).prop_map(|(h, r)| Region::cylinder(h, r)),
        (size(), size()).prop_map(|(h, r)| Region::cone(h, r)),
        (size(), size()).prop_map(|(h, r)| Region::capsule(h, r)),
        (0..3_usize).prop_map(|axis| Region::half_space(Vector::AXES[axis], 0.0)),
        (-1..=1).prop_map(|low| Region::interval("time", low as Real, low as Real + 1.0)),
    ];
    let centre = proptest::array::uniform3(-2..=2);
    (primitive, centre).prop_map(|(region, centre)| region.at(vector(centre)))
}

fn solids() -> impl Strategy<Value = Region> {
    solid().prop_recursive(2, 4, 2, |region| {
        (0..4, region.clone(), region).prop_map(|(kind, a, b)| match kind {
            0 => a.union(b),
            1 => a.intersection(b),
            2 => a.difference(b),
            _ => a.complement(),
        })
    })
}

proptest! {
    #![proptest_config(cases(1000))]

    /// Sets form a Boolean algebra at every sample, boundaries included.
    #[test]
    fn regions_form_a_boolean_algebra(
        e in solids(), f in solids(), g in solid(), points in points(),
    ) {
        let (e, f, g) = (|| e.clone(), || f.clone(), || g.clone());
        let everywhere = Region::everywhere;
        let laws = [
            ("(E∪F)ᶜ = Eᶜ∩Fᶜ", e().union(f()).complement(), e().complement().intersection(f().complement())),
            ("(E∩F)ᶜ = Eᶜ∪Fᶜ", e().intersection(f()).complement(), e().complement().union(f().complement())),
            ("E−F = E∩Fᶜ", e().difference(f()), e().intersection(f().complement())),
            ("Eᶜ = R−E", e().complement(), everywhere().difference(e())),
            ("Eᶜᶜ = E", e().complement().complement(), e()),
            ("E∩E = E", e().intersection(e()), e()),
            ("E∪F = F∪E", e().union(f()), f().union(e())),
            ("E∩(F∪G) = (E∩F)∪(E∩G)", e().intersection(f().union(g())),
                e().intersection(f()).union(e().intersection(g()))),
            ("E∪(F∩G) = (E∪F)∩(E∪G)", e().union(f().intersection(g())),
                e().union(f()).intersection(e().union(g()))),
        ];
        for (law, left, right) in &laws {
            for at in &points {
                let (l, r) = (holds(left, *at), holds(right, *at));
                prop_assert_eq!(l, r, "{} at {:?} halves", law, at);
            }
        }
        for at in &points {
            prop_assert!(!holds(&e().difference(e()), *at), "E−E at {:?} halves", at);
            prop_assert!(holds(&e().union(e().complement()), *at), "E∪Eᶜ at {:?} halves", at);
        }
    }
}
