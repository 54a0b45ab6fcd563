//! Searches a set for a piece.

use std::collections::BTreeSet;
use std::rc::Rc;

use super::cone::{is_clear_of, wide_direction};
use super::diagram::{Diagram, NOWHERE, Set, WHOLE};
use super::plane::{Hyperplane, Normal, dot};

/// The rest of a set on one side of one more plane.
struct Branch {
    set: Set,
    /// The number of sides chosen before this one.
    depth: usize,
    /// The plane, and true for its side behind. `None` for free planes, which need no test.
    side: Option<(usize, bool)>,
    /// A direction that is clear of the sides chosen before.
    direction: Rc<Normal>,
}

/// Returns true if a piece lies in a set: if the sides that a path through its nodes chooses intersect. Paths that
/// reach the same node with the same sides are followed once.
pub(super) fn holds_a_piece(sets: &Diagram, set: Set, planes: &[Hyperplane]) -> bool {
    let mut followed = BTreeSet::new();
    let mut taken: Vec<(usize, bool)> = Vec::new();
    let mut open = vec![Branch {
        set,
        depth: 0,
        side: None,
        direction: Rc::default(),
    }];
    while let Some(branch) = open.pop() {
        if branch.set == NOWHERE {
            continue;
        }
        taken.truncate(branch.depth);
        taken.extend(branch.side);
        let Some(direction) = direction_on(&taken, planes, &branch) else {
            continue;
        };
        let Some(question) = sets.question(branch.set) else {
            debug_assert_eq!(branch.set, WHOLE);
            return true;
        };
        if !followed.insert((branch.set, taken.clone())) {
            continue;
        }
        let plane = &planes[question.plane];
        // Last in, first out: the side that the direction is already on is more likely to succeed.
        let likelier = dot(&plane.normal, &direction) < 0.0;
        for behind in [!likelier, likelier] {
            open.push(Branch {
                set: if behind {
                    question.behind
                } else {
                    question.beyond
                },
                depth: taken.len(),
                side: (!plane.is_free).then_some((question.plane, behind)),
                direction: direction.clone(),
            });
        }
    }
    false
}

/// A direction that is clear of all sides chosen, the last of which is the branch's own; `None` if there is
/// none.
fn direction_on(
    taken: &[(usize, bool)],
    planes: &[Hyperplane],
    branch: &Branch,
) -> Option<Rc<Normal>> {
    let inward = |(plane, behind): (usize, bool)| planes[plane].inward(behind);
    let is_clear = |side| is_clear_of(&inward(side), &branch.direction);
    if branch.side.is_none_or(is_clear) {
        return Some(branch.direction.clone());
    }
    let sides: Vec<Normal> = taken.iter().copied().map(inward).collect();
    wide_direction(&sides).map(Rc::new)
}
