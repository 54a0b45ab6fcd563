//! The derivatives of composite trees: `Reference::linearised` equals central differences of
//! `Reference::force`, by place and by velocity, wherever the tree is smooth.
//!
//! A difference at step h is off by h² times the third derivative; one at h/2 by a quarter of it,
//! so their difference bounds the error. Where they differ by much, a border, a corner or a tie lies
//! between: such samples are skipped and counted.

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use rapier3d_fields::field::{Linearised, Query};
use rapier3d_fields::math::{DMat3, DVec3};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::cases;
use crate::support::trees::{
    self, FormulaPlan, LeafPlan, Numbers, ScalarPlan, TermPlan, reference,
};
use crate::support::worlds::{World, bodies};

/// Step of the differences.
const STEP: f64 = 1e-5;

/// Closures, and distances from shapes, are differentiated numerically: in `f64` to some 10⁻¹⁰ of
/// their size and that of their third derivatives.
const NUMERICAL: f64 = 1e-8;

/// The relative error of exact derivatives: the rounding of a hundred operations.
const EXACT: f64 = 1e-14;

/// The force at a sample moved along a component `k` of place (0–2) or velocity (3–5).
fn moved(tree: &Tree, world: &World, query: &Query, k: usize, by: f64) -> Option<DVec3> {
    let mut query = query.clone();
    if k < 3 {
        query.world_point[k] += by;
    } else {
        query.world_velocity[k - 3] += by;
    }
    reference(tree, world, &query)
}

/// The central difference.
fn slope(tree: &Tree, world: &World, query: &Query, k: usize, step: f64) -> Option<DVec3> {
    let moved = |by| moved(tree, world, query, k, by);
    Some((moved(step)? - moved(-step)?) / (2.0 * step))
}

/// The derivative by differences and a bound of its error; `None` where the tree is not smooth.
fn expected(
    tree: &Tree,
    world: &World,
    query: &Query,
    k: usize,
    size: f64,
) -> Option<(DVec3, f64)> {
    // Between vectors of equal length rounding chooses, here perhaps one and on both sides the other.
    let [before, here, after] = [-STEP, 0.0, STEP].map(|step| moved(tree, world, query, k, step));
    let bend = (before? + after?) * 0.5 - here?;
    if bend.length() > 1e-3 * STEP * size {
        return None;
    }
    let [wide, narrow] = [STEP, STEP / 2.0].map(|step| slope(tree, world, query, k, step));
    let (wide, narrow) = (wide?, narrow?);
    let truncation = (wide - narrow).length();
    // Rounding of forces, whose terms may cancel, over the step.
    let rounding = EXACT * size / STEP;
    let smooth = truncation <= 1e-6 * (narrow.length() + size) + rounding;
    smooth.then_some((narrow, 2.0 * truncation + 4.0 * rounding))
}

fn column(linearised: &Linearised, k: usize) -> DVec3 {
    let of = |matrix: &DMat3, k: usize| matrix.col(k);
    match k {
        0..3 => of(&linearised.by_position, k),
        _ => of(&linearised.by_velocity, k - 3),
    }
}

/// Compares at one sample; returns how many of the six columns were compared.
fn compare(
    plan: &TermPlan,
    world: &World,
    query: &Query,
    relative: f64,
) -> Result<u32, TestCaseError> {
    let tree = plan.term(world);
    let walk = Reference::new(&tree).expect("a valid tree");
    let frames = WorldRef::from(&world.physics);
    let Some(linearised) = walk.linearised(&frames, query) else {
        prop_assert_eq!(walk.force(&frames, query), None);
        return Ok(0);
    };
    // The terms of a law are not larger than ten or so where its force is small.
    let size = 10.0 + plan.size(world, query);
    let force = walk.force(&frames, query).unwrap_or(DVec3::NAN);
    let error = (linearised.force - force).length();
    let longer = (linearised.force.length() - force.length()).abs();
    if error > EXACT * size && longer <= EXACT * size && plan.chooses_by_length() {
        // Between vectors of equal length rounding chooses.
        return Ok(0);
    }
    prop_assert!(
        error <= EXACT * size,
        "{}, force alone {force}",
        linearised.force
    );
    let mut compared = 0;
    for k in 0..6 {
        let Some((want, bound)) = expected(&tree, world, query, k, size) else {
            continue;
        };
        let found = column(&linearised, k);
        let error = (found - want).length();
        let bound = bound + relative * (want.length() + size);
        prop_assert!(
            error <= bound,
            "column {k}: {found}, differences {want}; error {error:e}, bound {bound:e}"
        );
        compared += 1;
    }
    Ok(compared)
}

/// Whether a scale is a closure: the linearisation takes these as locally constant.
fn has_flat_scale(term: &TermPlan) -> bool {
    term.any_scale(&|scale| matches!(scale, ScalarPlan::Closure))
}

/// Whether nothing in it is differentiated numerically or computed in the precision of [`Real`], as user functions and
/// Parry's shapes are.
fn is_exact(term: &TermPlan) -> bool {
    use FormulaPlan::{Around, Closure};
    let by_parry = |scale: &ScalarPlan| match scale {
        ScalarPlan::Depth(region, ..) => region.any_shape(),
        _ => false,
    };
    let numerical = |leaf: &LeafPlan| matches!(leaf.formula, Around(..) | Closure(_));
    !term.any_leaf(&numerical) && !term.any_scale(&by_parry)
}

/// Place and velocity in 64ths, and charge, of a sample of no body, so that the fields of all bodies act.
type SamplePlan = ([i32; 3], [i32; 3], i32);

fn sample() -> impl Strategy<Value = SamplePlan> {
    let triple = |size: i32| proptest::array::uniform3(-size * 64..size * 64);
    (triple(5), triple(2), -2..=2)
}

fn query((place, velocity, charge): &SamplePlan) -> Query {
    // Off all borders and axes.
    let aside = DVec3::new(0.0031, 0.0053, 0.0071);
    let sixty_fourths = |plan: &[i32; 3]| DVec3::from_array(plan.map(|x| f64::from(x) / 64.0));
    Query {
        world_point: sixty_fourths(place) + aside,
        world_velocity: sixty_fourths(velocity) - aside,
        time: 0.3,
        charge: f64::from(*charge),
        radius: 0.3,
        mass: 1.5,
        share: 0.75,
        volume: 0.2,
        user: [("delta".into(), 1.1)].into(),
        ..Query::default()
    }
}

/// All formulas, regions, operators, scales, limits, layers and anchors, on bodies that move and
/// turn.
#[test]
fn derivatives_of_composites_equal_their_differences() {
    let config = ProptestConfig {
        // In single precision only terms that are exact are compared.
        max_global_rejects: u32::MAX,
        ..cases(3000)
    };
    let (compared, defined) = (Cell::new(0), Cell::new(0));
    let plans = (
        bodies(3, 1..=2),
        trees::term(Numbers::Fractional),
        proptest::collection::vec(sample(), 4),
    );
    let result = TestRunner::new(config).run(&plans, |(bodies, term, samples)| {
        let world = World::new(&bodies);
        let relative = if is_exact(&term) { EXACT } else { NUMERICAL };
        prop_assume!(!has_flat_scale(&term) && (cfg!(feature = "f64") || relative == EXACT));
        for query in &samples.iter().map(query).collect::<Vec<_>>() {
            let columns = compare(&term, &world, query, relative)?;
            compared.set(compared.get() + columns);
            let is_defined = reference(&term.term(&world), &world, query).is_some();
            defined.set(defined.get() + 6 * u32::from(is_defined));
        }
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    println!("{} of {} columns compared", compared.get(), defined.get());
    assert!(
        compared.get() * 10 > defined.get() * 9,
        "too few were smooth"
    );
}
