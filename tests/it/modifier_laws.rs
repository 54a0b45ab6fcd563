//! Laws of the operations beyond the paper: minima and maxima, layers, masks and scales. The reference evaluates them
//! on integers, so the tolerance is zero, but for limits.

use proptest::prelude::*;
use rapier3d_fields::math::DVec3;
use rapier3d_fields::prelude::*;

use crate::support::cases;
use crate::support::model::model as composite;
use crate::support::model::{apply, force, nested, points, same};

/// One to four random composites.
fn composites() -> impl Strategy<Value = Vec<Tree>> {
    proptest::collection::vec(composite().prop_map(|model| model.tree()), 1..5)
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn minima_and_maxima_commute_and_absorb(u in composite(), v in composite(), points in points()) {
        let (u, v) = (u.tree(), v.tree());
        for (operator, other) in [
            (Operator::Minimum, Operator::Maximum), (Operator::Maximum, Operator::Minimum),
        ] {
            let uv = apply(operator, &u, &v);
            same(&format!("{operator} commutes"), &uv, &apply(operator, &v, &u), &points)?;
            same(&format!("{operator} of the same"), &apply(operator, &u, &u), &u, &points)?;
            // Where U is defined, max(U, min(U, V)) is U; elsewhere V remains.
            let absorbed = apply(other, &u, &uv).masked_by(u.clone());
            same(&format!("{operator} is absorbed"), &absorbed, &u.clone().masked_by(u.clone()), &points)?;
        }
    }

    /// Each picks one of two vectors, and together they pick both.
    #[test]
    fn strongest_and_weakest_share_their_operands(
        u in composite(), v in composite(), points in points(),
    ) {
        let (u, v) = (u.tree(), v.tree());
        let [strong, weak] = [Operator::Strongest, Operator::Weakest].map(|o| apply(o, &u, &v));
        for at in &points {
            let (Some(a), Some(b)) = (force(&u, at), force(&v, at)) else {
                prop_assert_eq!(force(&strong, at), force(&weak, at));
                continue;
            };
            let (Some(s), Some(w)) = (force(&strong, at), force(&weak, at)) else {
                return Err(TestCaseError::fail("defined where both are"));
            };
            let tie = a.length_squared() == b.length_squared();
            let picked = if tie { s == a && w == a } else { s + w == a + b };
            prop_assert!(picked, "{s} and {w} of {a} and {b}");
            prop_assert!(s.length_squared() >= w.length_squared());
        }
    }

    #[test]
    fn layers_that_only_add_are_a_sum(trees in composites(), points in points()) {
        let layers = Tree::layers(trees.iter().map(|tree| Layer::new(nested(tree))));
        let sum = Tree::fold(Operator::SumUnion, trees.iter().map(nested));
        same("layers", &layers, &sum, &points)?;
    }

    /// With "replace and stop" the highest wins; with "replace" the lowest.
    #[test]
    fn layers_that_replace_are_replacements(trees in composites(), points in points()) {
        let replacing = || trees.iter().map(|tree| Layer::new(nested(tree)).replacing());
        let forward = Tree::fold(Operator::ReplaceUnion, trees.iter().map(nested));
        let backward = Tree::fold(Operator::ReplaceUnion, trees.iter().rev().map(nested));
        same("replace", &Tree::layers(replacing()), &forward, &points)?;
        let stopping = Tree::layers(replacing().map(Layer::stopping));
        same("replace and stop", &stopping, &backward, &points)?;
        // Stopping alone does not replace the first layer, either.
        let stopping = trees.iter().map(|tree| Layer::new(nested(tree)).stopping());
        same("stop", &Tree::layers(stopping), &backward, &points)?;
    }

    /// The order of a list does not matter where priorities differ.
    #[test]
    fn priorities_order_layers(trees in composites(), points in points()) {
        let layer = |(k, tree): (usize, &Tree)| {
            let layer = Layer::new(nested(tree)).priority(-(k as i32));
            if k % 2 == 0 { layer.replacing() } else { layer }
        };
        let forward = Tree::layers(trees.iter().enumerate().map(layer));
        let backward: Vec<Layer> = trees.iter().enumerate().map(layer).collect();
        let backward = Tree::layers(backward.into_iter().rev());
        same("priorities", &forward, &backward, &points)?;
    }

    #[test]
    fn scales_multiply(u in composite(), v in composite(), k in -3..=3, points in points()) {
        let (u, v) = (u.tree(), v.tree());
        let (factor, k) = (f64::from(k), k as Real);
        for at in &points {
            let scaled = force(&u.clone().scaled_by(k), at);
            let expected = force(&u, at).map(|vector| vector * factor);
            prop_assert_eq!(scaled, expected, "{} at {:?} halves", k, at);
        }
        let twice = |tree: &Tree, a: Real, b: Real| tree.clone().scaled_by(a).scaled_by(b);
        same("k k", &twice(&u, k, 2.0), &u.clone().scaled_by(2.0 * k), &points)?;
        for operator in [Operator::SumUnion, Operator::ReplaceUnion, Operator::Difference] {
            let scaled = |tree: &Tree| tree.clone().scaled_by(k);
            let after = scaled(&apply(operator, &u, &v));
            let before = apply(operator, &scaled(&u), &scaled(&v));
            same(&format!("scale of {operator}"), &after, &before, &points)?;
        }
    }

    /// A limited vector keeps its direction; its length is the smaller of its own and the limit.
    #[test]
    fn limits_shorten(u in composite(), limit in 0..=4, points in points()) {
        let tree = u.tree();
        let limited = tree.clone().limited_to(limit as Real);
        for at in &points {
            let (found, whole) = (force(&limited, at), force(&tree, at));
            prop_assert_eq!(found.is_some(), whole.is_some());
            let (Some(found), Some(whole)) = (found, whole) else { continue };
            let length = whole.length();
            let shortened = length.min(f64::from(limit));
            // A root, a reciprocal and two products.
            let rounding = 8.0 * f64::EPSILON * length;
            prop_assert!((found.length() - shortened).abs() <= rounding, "{found} of {whole}");
            prop_assert!(found.cross(whole).length() <= rounding * length, "{found} of {whole}");
        }
    }

    #[test]
    fn masks_are_intersections_of_sets(
        u in composite(), m in composite(), n in composite(), points in points(),
    ) {
        let [u, m, n] = [u, m, n].map(|model| model.tree());
        let masked = |u: &Tree, m: &Tree| nested(u).masked_by(nested(m));
        same("(U|M)|N = (U|N)|M", &masked(&masked(&u, &m), &n), &masked(&masked(&u, &n), &m), &points)?;
        same("(U|M)|M = U|M", &masked(&masked(&u, &m), &m), &masked(&u, &m), &points)?;
        same("U|U = U", &masked(&u, &u), &u, &points)?;
        // The parts inside and outside of a mask make up the field.
        let parts = apply(Operator::ReplaceUnion, &masked(&u, &m), &apply(Operator::Difference, &u, &m));
        same("U|M →∪ (U−M) = U", &parts, &u, &points)?;
    }
}

/// A bound holds after scaling, in whichever order the two were set, for every formula.
#[test]
fn bounds_hold_after_scaling() {
    let cube = SharedShape::cuboid(0.5, 0.5, 0.5);
    for field in [
        Field::uniform(Vector::X * 4.0),
        Field::radial(4.0, 0.0),
        Field::radial(4.0, 0.0).around(cube),
    ] {
        let first = Tree::from(field.clone().limited_to(1.0).scaled_by(3.0));
        let last = Tree::from(field.scaled_by(3.0).limited_to(1.0));
        for tree in [first, last] {
            assert_eq!(force(&tree, &[4, 0, 0, 0, 0]), Some(DVec3::X));
        }
    }
}

/// Regression: `-x^2` was (−x)².
#[test]
fn powers_in_expressions_bind_more_tightly_than_signs() {
    let tree = Tree::from(Field::expression(["-x^2", "(-x)^2", "0 - x^2"]));
    let expected = DVec3::new(-4.0, 4.0, -4.0);
    assert_eq!(force(&tree, &[4, 0, 0, 0, 0]), Some(expected));
}
