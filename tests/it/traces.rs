//! `Reference::trace`: the contributions of the fields sum to the force of the tree.

use proptest::prelude::*;
use rapier3d_fields::field::Query;
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::{Contribution, Fate, Reference, Trace};

use crate::support::cases;
use crate::support::trees::{self, AnchorPlan, Numbers, TermPlan};
use crate::support::worlds::{World, bodies};

/// Operators that keep the vectors of their operands as they are, and add or choose among them.
const KEEPING: [Operator; 7] = [
    Operator::SumUnion,
    Operator::SumIntersection,
    Operator::ReplaceUnion,
    Operator::ReplaceIntersection,
    Operator::Difference,
    Operator::Strongest,
    Operator::Weakest,
];

/// Sums, replacements, differences, layers, masks and instances, up to four deep.
fn term() -> impl Strategy<Value = TermPlan> {
    let leaf = trees::leaf(Numbers::Integer).prop_map(TermPlan::Leaf);
    leaf.prop_recursive(4, 12, 3, |term| {
        let boxed = |term: TermPlan| Box::new(term);
        let operator = proptest::sample::select(&KEEPING[..]);
        let layer = (term.clone(), -1..=1, any::<bool>(), any::<bool>());
        let anchor = proptest::array::uniform3(-2..=2);
        let anchors = proptest::collection::vec(anchor, 1..3);
        let at = |place: [i32; 3]| -> AnchorPlan { (0, 0, place, 0) };
        prop_oneof![
            5 => (operator, term.clone(), term.clone())
                .prop_map(move |(operator, a, b)| TermPlan::Apply(operator, boxed(a), boxed(b))),
            2 => proptest::collection::vec(layer, 1..4).prop_map(TermPlan::Layers),
            1 => (term.clone(), term.clone())
                .prop_map(move |(a, mask)| TermPlan::Masked(boxed(a), boxed(mask))),
            1 => (term, anchors).prop_map(move |(term, places)| {
                TermPlan::Instances(boxed(term), places.into_iter().map(at).collect())
            }),
        ]
    })
}

fn defined(contributions: &[Contribution], place: u32) -> bool {
    let mut at_place = contributions.iter().filter(|c| c.place == place);
    at_place.any(|c| c.force.is_some())
}

/// Checks that hold for every trace.
fn check(trace: &Trace) -> Result<(), TestCaseError> {
    let contributions = &trace.contributions;
    let counting = contributions.iter().filter(|c| c.fate == Fate::Counts);
    let sum = counting.filter_map(|c| c.force).reduce(|a, b| a + b);
    prop_assert_eq!(sum, trace.force, "{:#?}", contributions);
    for contribution in contributions {
        let acts = contribution.force.is_some();
        let fits = match &contribution.fate {
            Fate::Counts | Fate::Unmatched { .. } | Fate::Cuts => acts,
            Fate::OutsideRegion | Fate::OwnBody | Fate::OtherGroups | Fate::AnchorGone => !acts,
            Fate::Overruled { by, .. } => {
                acts && !by.is_empty() && by.iter().all(|place| defined(contributions, *place))
            }
            _ => false,
        };
        prop_assert!(fits, "{contribution:?} of {contributions:#?}");
    }
    Ok(())
}

fn trace(tree: &Tree, world: &World, query: &Query) -> Trace {
    let frames = WorldRef::from(&world.physics);
    let reference = Reference::new(tree).expect("a valid tree");
    reference.trace(&frames, query)
}

proptest! {
    #![proptest_config(cases(3000))]

    /// The vectors that count sum to the force, and the fate of each field fits whether it acts.
    #[test]
    fn contributions_that_count_sum_to_the_force(plans in bodies(3, 1..=1), term in term()) {
        let world = World::new(&plans);
        let tree = term.term(&world);
        for body in &world.bodies {
            for (query, _) in world.samples(*body) {
                let trace = trace(&tree, &world, &query);
                prop_assert_eq!(trace.force, trees::reference(&tree, &world, &query));
                check(&trace)?;
            }
        }
    }

    /// In any tree every field is listed, once for each instance, and the forces agree.
    #[test]
    fn every_field_is_listed(
        plans in bodies(3, 1..=2), term in trees::term(Numbers::Fractional),
    ) {
        let world = World::new(&plans);
        let tree = term.term(&world);
        for body in &world.bodies {
            for (query, _) in world.samples(*body) {
                let trace = trace(&tree, &world, &query);
                prop_assert_eq!(trace.force, trees::reference(&tree, &world, &query));
                prop_assert_eq!(trace.contributions.len(), term.leaf_count());
            }
        }
    }
}

fn fates(tree: impl Into<Tree>) -> Vec<Fate> {
    let world = World::new(&[]);
    let trace = trace(&tree.into(), &world, &Query::default());
    trace.contributions.into_iter().map(|c| c.fate).collect()
}

/// Each case is one line of the table of fates, at the origin.
#[test]
fn fates_name_the_operator_and_the_fields_that_decided() {
    let here = |x: Real| Field::uniform(Vector::X * x).within(Region::ball(1.0));
    let away = || Field::uniform(Vector::Y).within(Region::ball(1.0).at(Vector::X * 9.0));
    let overruled = |operator, by| Fate::Overruled {
        operator,
        by: vec![by],
    };
    let unmatched = |operator| Fate::Unmatched { operator };
    let (counts, outside) = (Fate::Counts, Fate::OutsideRegion);
    let cases = [
        (
            here(1.0).sum_union(here(2.0)),
            [counts.clone(), counts.clone()],
        ),
        (
            here(1.0).replace_union(here(2.0)),
            [overruled("→∪", 1), counts.clone()],
        ),
        (
            here(1.0).replace_union(away()),
            [counts.clone(), outside.clone()],
        ),
        (
            here(1.0).sum_intersection(away()),
            [unmatched("+∩"), outside.clone()],
        ),
        (
            here(1.0).difference(here(2.0)),
            [overruled("−", 1), Fate::Cuts],
        ),
        (
            here(1.0).strongest(here(2.0)),
            [overruled("strongest", 1), counts.clone()],
        ),
        (
            here(1.0).weakest(here(2.0)),
            [counts.clone(), overruled("weakest", 0)],
        ),
        (
            Tree::layers([Layer::new(here(1.0)).stopping(), Layer::new(here(2.0))]),
            [counts.clone(), overruled("stop", 0)],
        ),
        (
            Tree::layers([Layer::new(here(1.0)), Layer::new(here(2.0)).replacing()]),
            [overruled("replace", 1), counts],
        ),
    ];
    for (number, (tree, expected)) in cases.into_iter().enumerate() {
        assert_eq!(fates(tree), expected, "case {number}");
    }
}
