//! Programs: composite terms, evaluated at one probe at a time.

use crate::compile::{AnchorId, IndexKind, Program, Step};
use crate::field::{Frame, LocalQuery, Neighbourhood, Normal, Operator, Pieces, Query};
use crate::math::{DVec3, Real, Vector};
use crate::rapier::parry::bounding_volume::Aabb;
use crate::rapier::parry::partitioning::{Bvh, BvhBuildStrategy};

/// A composite at a sample.
#[derive(Clone, Copy, Debug)]
struct Value {
    defined: Pieces,
    vector: DVec3,
    /// Bit n: the vector would hold that of leaf n, were it not zero. Leaves beyond the 64th are
    /// not told apart.
    leaves: u64,
}

/// What a program gives at a sample where it is defined.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    /// The force, world axes.
    pub force: DVec3,
    /// Bit n: leaf n contributes to it.
    pub leaves: u64,
}

/// Evaluates programs; keeps its stack between calls.
#[derive(Debug, Default)]
pub(crate) struct Machine {
    stack: Vec<Value>,
    normals: Vec<Normal>,
}

impl Machine {
    /// The program's instance at a sample; nothing where it is not defined.
    pub(crate) fn run(
        &mut self,
        program: &Program,
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
    ) -> Option<Outcome> {
        let open = Neighbourhood::open();
        let outcome = self.walk(program, instance, frames, query, &open);
        if !open.met_a_surface() {
            return outcome;
        }
        // The sample lies on a surface: find the pieces around it, and walk again.
        self.normals.clear();
        for leaf in 0..program.leaves.len() {
            if let Some(local) = acting(program, instance, leaf, frames, query) {
                program.leaves[leaf]
                    .region
                    .touched(&local, &mut self.normals);
            }
        }
        let here = Neighbourhood::of(&self.normals);
        self.walk(program, instance, frames, query, &here)
    }

    fn walk(
        &mut self,
        program: &Program,
        instance: usize,
        frames: &[Option<Frame>],
        query: &Query,
        here: &Neighbourhood,
    ) -> Option<Outcome> {
        self.stack.clear();
        for step in &program.steps {
            let value = match *step {
                Step::Leaf(leaf) => leaf_value(program, instance, leaf, frames, query, here),
                Step::Apply(operator, count) => {
                    let operands = self.stack.split_off(self.stack.len() - count as usize);
                    let combined = operands
                        .into_iter()
                        .reduce(|u, v| apply(operator, u, v, here));
                    combined.unwrap_or(UNDEFINED)
                }
            };
            self.stack.push(value);
        }
        let value = self.stack.pop()?;
        value.defined.any().then_some(Outcome {
            force: value.vector,
            leaves: value.leaves,
        })
    }
}

const UNDEFINED: Value = Value {
    defined: Pieces::NONE,
    vector: DVec3::ZERO,
    leaves: 0,
};

/// The sample as a leaf sees it, if the leaf is there and does not belong to the probe's body.
fn acting<'a>(
    program: &Program,
    instance: usize,
    leaf: usize,
    frames: &[Option<Frame>],
    query: &'a Query,
) -> Option<LocalQuery<'a>> {
    let anchor = program.anchors[instance * program.leaves.len() + leaf];
    let frame = frames[anchor as usize].as_ref()?;
    let own = frame.body.is_some() && frame.body == query.body;
    (!own).then(|| LocalQuery::new(query, frame))
}

fn leaf_value(
    program: &Program,
    instance: usize,
    leaf: u32,
    frames: &[Option<Frame>],
    query: &Query,
    here: &Neighbourhood,
) -> Value {
    let Some(local) = acting(program, instance, leaf as usize, frames, query) else {
        return UNDEFINED;
    };
    let field = &program.leaves[leaf as usize];
    let defined = field.region.pieces(&local, here);
    if !defined.any() {
        return UNDEFINED;
    }
    Value {
        defined,
        vector: local.rotation * field.formula.vector(&local) * field.weight(&local),
        leaves: 1_u64.checked_shl(leaf).unwrap_or(0),
    }
}

/// An operator on the values of its operands; see the table at [`Operator`].
fn apply(operator: Operator, u: Value, v: Value, here: &Neighbourhood) -> Value {
    use Operator::*;
    let (e, g) = (u.defined, v.defined);
    let defined = match operator {
        SumUnion | CrossUnion | ReplaceUnion => e | g,
        SumIntersection | CrossIntersection | ReplaceIntersection => e & g,
        Difference => e & here.complement(g),
    };
    if !defined.any() {
        return UNDEFINED;
    }
    if !g.any() || operator == Difference {
        return Value { defined, ..u };
    }
    if !e.any() || matches!(operator, ReplaceUnion | ReplaceIntersection) {
        return Value { defined, ..v };
    }
    let vector = match operator {
        CrossUnion | CrossIntersection => u.vector.cross(v.vector),
        _ => u.vector + v.vector,
    };
    Value {
        defined,
        vector,
        leaves: u.leaves | v.leaves,
    }
}

/// Which instances of a program may act at a point.
#[derive(Debug, Default)]
pub(super) struct Reach {
    /// Holds all that any instance can reach.
    low: Vector,
    high: Vector,
    balls: Vec<Option<(Vector, Real)>>,
    bvh: Option<Bvh>,
    found: Vec<u32>,
}

impl Reach {
    /// Takes up where the instances are now.
    pub(super) fn refresh(&mut self, program: &Program, frames: &[Option<Frame>]) {
        let reach = program.reach.unwrap_or(Real::INFINITY);
        let ball = |centre: &AnchorId| match (&frames[*centre as usize], program.reach) {
            (Some(frame), _) => Some((frame.pose.translation, reach)),
            // Some field hangs elsewhere, and may be there still.
            (None, None) => Some((Vector::ZERO, reach)),
            (None, Some(_)) => None,
        };
        let balls = program.centres.iter().map(ball);
        // Zones that stand still keep their hierarchy.
        if balls.clone().eq(self.balls.iter().copied()) {
            return;
        }
        self.balls.clear();
        self.balls.extend(balls);
        let bounds = self
            .balls
            .iter()
            .enumerate()
            .filter_map(|(instance, ball)| {
                let (centre, radius) = (*ball)?;
                let extent = Vector::splat(radius);
                Some((instance, Aabb::from_half_extents(centre, extent)))
            });
        let infinity = Vector::splat(Real::INFINITY);
        (self.low, self.high) = bounds
            .clone()
            .fold((infinity, -infinity), |(low, high), (_, bounds)| {
                (low.min(bounds.mins), high.max(bounds.maxs))
            });
        self.bvh = (program.index_kind() == IndexKind::Bvh)
            .then(|| Bvh::from_iter(BvhBuildStrategy::Binned, bounds));
    }

    /// The instances that may act at a point, in their order.
    pub(super) fn at(&mut self, point: Vector) -> &[u32] {
        self.found.clear();
        if point.cmplt(self.low).any() || point.cmpgt(self.high).any() {
            return &self.found;
        }
        match &self.bvh {
            Some(bvh) => {
                let here = Aabb::new(point, point);
                self.found.extend(bvh.intersect_aabb(&here));
                // Sums must not depend on how the hierarchy was built.
                self.found.sort_unstable();
            }
            None => {
                let acts = |ball: &Option<(Vector, Real)>| {
                    ball.is_some_and(|(centre, radius)| {
                        (point - centre).abs().max_element() <= radius
                    })
                };
                let instances = self.balls.iter().enumerate();
                let acting = instances.filter(|(_, ball)| acts(ball));
                self.found
                    .extend(acting.map(|(instance, _)| instance as u32));
            }
        }
        &self.found
    }
}
