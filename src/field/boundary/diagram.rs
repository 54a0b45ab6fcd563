//! Sets of pieces, as binary decision diagrams.
//!
//! A node tests whether a piece lies behind one plane or beyond it, and leads to another node in either case. Equal
//! nodes are shared. Planes are tested in falling order, so that surfaces that are added later become new top nodes.
//!
//! Diagrams contain no geometry: a set may combine sides of planes between which no piece lies.

use std::collections::BTreeMap;

/// A set: the number of its first node plus two. The sets without nodes are 0 and 1.
pub(super) type Set = u32;

/// The empty set.
pub(super) const NOWHERE: Set = 0;

/// All pieces.
pub(super) const WHOLE: Set = 1;

/// A node: a plane, and the rest of the set on either side of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Question {
    pub plane: usize,
    pub behind: Set,
    pub beyond: Set,
}

/// The rule by which two sets are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum SetRule {
    Either,
    Both,
    FirstOnly,
}

/// All sets made so far, with shared nodes.
#[derive(Debug, Default)]
pub(super) struct Diagram {
    questions: Vec<Question>,
    places: BTreeMap<Question, Set>,
    combined: BTreeMap<(SetRule, Set, Set), Set>,
}

impl Diagram {
    /// The first node of a set; `None` for the two sets without nodes.
    pub fn question(&self, set: Set) -> Option<Question> {
        let place = set.checked_sub(2)?;
        Some(self.questions[place as usize])
    }

    /// The number of nodes of all sets.
    #[cfg(test)]
    pub fn size(&self) -> usize {
        self.questions.len()
    }

    /// The pieces behind a plane, or those beyond it.
    pub fn side(&mut self, plane: usize, behind: bool) -> Set {
        let (behind, beyond) = if behind {
            (WHOLE, NOWHERE)
        } else {
            (NOWHERE, WHOLE)
        };
        self.ask(plane, behind, beyond)
    }

    fn ask(&mut self, plane: usize, behind: Set, beyond: Set) -> Set {
        if behind == beyond {
            return behind;
        }
        let question = Question {
            plane,
            behind,
            beyond,
        };
        let next = self.questions.len() as Set + 2;
        let place = *self.places.entry(question).or_insert(next);
        if place == next {
            self.questions.push(question);
        }
        place
    }

    /// Combines two sets. Pairs that wait for others are kept on a list, as recursion could be as deep as there are
    /// planes.
    pub fn combine(&mut self, rule: SetRule, a: Set, b: Set) -> Set {
        if let Some(set) = self.settled(rule, a, b) {
            return set;
        }
        let mut waiting = vec![(a, b)];
        loop {
            let (a, b) = waiting[waiting.len() - 1];
            let (plane, behind, beyond) = self.split(a, b);
            let settled = |(a, b)| self.settled(rule, a, b);
            let (half_behind, half_beyond) = match (settled(behind), settled(beyond)) {
                (Some(behind), Some(beyond)) => (behind, beyond),
                (None, _) => {
                    waiting.push(behind);
                    continue;
                }
                (_, None) => {
                    waiting.push(beyond);
                    continue;
                }
            };
            let set = self.ask(plane, half_behind, half_beyond);
            self.combined.insert((rule, a, b), set);
            waiting.pop();
            if waiting.is_empty() {
                return set;
            }
        }
    }

    /// The result of a rule, if it is trivial or was found before.
    fn settled(&self, rule: SetRule, a: Set, b: Set) -> Option<Set> {
        match (rule, a, b) {
            (SetRule::Either, NOWHERE, other) | (SetRule::Either, other, NOWHERE) => Some(other),
            (SetRule::Either, WHOLE, _) | (SetRule::Either, _, WHOLE) => Some(WHOLE),
            (SetRule::Both, WHOLE, other) | (SetRule::Both, other, WHOLE) => Some(other),
            (SetRule::Both, NOWHERE, _) | (SetRule::Both, _, NOWHERE) => Some(NOWHERE),
            (SetRule::FirstOnly, first, NOWHERE) => Some(first),
            (SetRule::FirstOnly, NOWHERE, _) | (SetRule::FirstOnly, _, WHOLE) => Some(NOWHERE),
            (SetRule::FirstOnly, a, b) if a == b => Some(NOWHERE),
            (_, a, b) if a == b => Some(a),
            _ => self.combined.get(&(rule, a, b)).copied(),
        }
    }

    /// The plane that a pair of sets tests first, and the pairs that remain on its two sides.
    fn split(&self, a: Set, b: Set) -> (usize, (Set, Set), (Set, Set)) {
        let (first_a, first_b) = (self.question(a), self.question(b));
        let planes = first_a
            .iter()
            .chain(&first_b)
            .map(|question| question.plane);
        let plane = planes.max().unwrap_or(0);
        let sides = |set: Set, first: Option<Question>| match first {
            Some(question) if question.plane == plane => (question.behind, question.beyond),
            _ => (set, set),
        };
        let ((a_behind, a_beyond), (b_behind, b_beyond)) = (sides(a, first_a), sides(b, first_b));
        (plane, (a_behind, b_behind), (a_beyond, b_beyond))
    }
}
