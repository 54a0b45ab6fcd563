//! A second, independent derivation of the algebra: sets of small integers, sampled by brute force.
//!
//! All surfaces are planes across an axis at integers, or diagonal ones ±x ± time = integer, and
//! samples stand on half-integers. So the neighbourhood of a sample falls into the 2⁵ orthants of
//! x, y, z, time and delta, each halved by a diagonal. Two points in each orthant, one nearer to
//! the sample along x and one along time, lie in general position: there, plain membership
//! decides. A regularised closed set holds a sample if it holds one of these 64 points (§3.1.1).

use proptest::prelude::*;
use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, Real, Vector};
use rapier3d_fields::reference::Reference;
use rapier3d_fields::{Anchor, Axis, Field, Layer, Operator, Region, Scalar, Tree, WorldRef};

/// x, y, z, time and the user's axis `delta`, in halves.
pub type Point = [i32; 5];

/// A set of the 64 half-orthants around a sample.
pub type Cells = u64;

/// A region whose points can be tested.
#[derive(Clone, Debug)]
pub enum Set {
    Everywhere,
    /// Centre and half-extents.
    Box([i32; 3], [i32; 3]),
    /// Number of the axis, lower and upper end.
    Interval(usize, i32, i32),
    /// `x[axis] · sign ≤ offset`.
    HalfSpace(usize, i32, i32),
    /// Behind a front that moves: `x · sign + time · sign ≤ offset`.
    Front([i32; 2], i32),
    Not(Box<Set>),
    Union(Box<Set>, Box<Set>),
    Intersection(Box<Set>, Box<Set>),
    Difference(Box<Set>, Box<Set>),
}

const AXES: [&str; 5] = ["x", "y", "z", "time", "delta"];

impl Set {
    pub fn region(&self) -> Region {
        let real = |i: i32| i as Real;
        match self {
            Set::Everywhere => Region::everywhere(),
            Set::Box(centre, half) => Region::cuboid(vector(*half)).at(vector(*centre)),
            Set::Interval(axis, low, high) => {
                Region::interval(AXES[*axis], real(*low), real(*high))
            }
            Set::HalfSpace(axis, sign, offset) => {
                let outward = Vector::AXES[*axis] * real(*sign);
                Region::half_space(outward, real(*offset))
            }
            Set::Front([x, time], offset) => {
                let coefficients = [(Axis::X, real(*x)), (Axis::Time, real(*time))];
                Region::half_space_over(coefficients, real(*offset))
            }
            Set::Not(a) => a.region().complement(),
            Set::Union(a, b) => a.region().union(b.region()),
            Set::Intersection(a, b) => a.region().intersection(b.region()),
            Set::Difference(a, b) => a.region().difference(b.region()),
        }
    }

    /// Plain membership of a point in general position.
    fn holds(&self, x: &[f64; 5]) -> bool {
        match self {
            Set::Everywhere => true,
            Set::Box(centre, half) => {
                (0..3).all(|i| (x[i] - f64::from(centre[i])).abs() < f64::from(half[i]))
            }
            Set::Interval(i, low, high) => f64::from(*low) < x[*i] && x[*i] < f64::from(*high),
            Set::HalfSpace(i, sign, offset) => x[*i] * f64::from(*sign) < f64::from(*offset),
            Set::Front(signs, offset) => {
                let [sx, st] = signs.map(f64::from);
                x[0] * sx + x[3] * st < f64::from(*offset)
            }
            Set::Not(a) => !a.holds(x),
            Set::Union(a, b) => a.holds(x) || b.holds(x),
            Set::Intersection(a, b) => a.holds(x) && b.holds(x),
            Set::Difference(a, b) => a.holds(x) && !b.holds(x),
        }
    }

    /// The half-orthants around a sample that lie in the set.
    pub fn cells(&self, at: &Point) -> Cells {
        (0..64_u32)
            .filter(|cell| {
                let near = if cell >> 5 & 1 == 1 { 0 } else { 3 };
                let size = |i: usize| if i == near { 0.125 } else { 0.25 };
                let step = |i: usize| {
                    if cell >> i & 1 == 1 {
                        size(i)
                    } else {
                        -size(i)
                    }
                };
                let x = std::array::from_fn(|i| f64::from(at[i]) / 2.0 + step(i));
                self.holds(&x)
            })
            .fold(0, |cells, cell| cells | 1 << cell)
    }
}

/// A composite field, as plain data.
#[derive(Clone, Debug)]
pub enum Model {
    Leaf(Set, [i32; 3]),
    Apply(Operator, Box<Model>, Box<Model>),
    /// The first where the second is defined.
    Masked(Box<Model>, Box<Model>),
    /// Times the coordinate along an axis.
    Scaled(Box<Model>, usize),
    /// Each with its priority, whether it replaces, and whether it stops.
    Layers(Vec<(Model, i32, bool, bool)>),
}

impl Model {
    pub fn tree(&self) -> Tree {
        match self {
            Model::Leaf(set, v) => Field::uniform(vector(*v)).within(set.region()).into(),
            Model::Apply(operator, u, v) => Tree::fold(*operator, [u.tree(), v.tree()]),
            Model::Masked(u, mask) => u.tree().masked_by(mask.tree()),
            Model::Scaled(u, axis) => u.tree().scaled_by(Scalar::axis(AXES[*axis])),
            Model::Layers(layers) => {
                Tree::layers(layers.iter().map(|(u, priority, replaces, stops)| {
                    let layer = Layer::new(u.tree()).priority(*priority);
                    let layer = if *replaces { layer.replacing() } else { layer };
                    if *stops { layer.stopping() } else { layer }
                }))
            }
        }
    }

    /// Figure 1 of the paper: where the composite is defined, and its vector there.
    ///
    /// The cells follow from the orthants alone. On a boundary both operands count as present if the (closed) sets of
    /// both hold the sample.
    pub fn at(&self, at: &Point) -> (Cells, DVec3) {
        match self {
            Model::Leaf(set, v) => (set.cells(at), vector_f64(*v)),
            Model::Apply(operator, u, v) => {
                let ((e, u), (g, v)) = (u.at(at), v.at(at));
                figure_1(*operator, (e, u), (g, v))
            }
            Model::Masked(u, mask) => {
                let ((e, u), (g, _)) = (u.at(at), mask.at(at));
                (e & g, u)
            }
            Model::Scaled(u, axis) => {
                let (e, u) = u.at(at);
                (e, u * (f64::from(at[*axis]) / 2.0))
            }
            Model::Layers(layers) => gathered(layers, at),
        }
    }

    /// The force the model predicts.
    pub fn force(&self, at: &Point) -> Option<DVec3> {
        let (cells, vector) = self.at(at);
        (cells != 0).then_some(vector)
    }
}

/// The sum of the layers that count at a sample, from the highest priority down.
fn gathered(layers: &[(Model, i32, bool, bool)], at: &Point) -> (Cells, DVec3) {
    let mut sorted: Vec<_> = layers.iter().collect();
    sorted.sort_by_key(|(_, priority, ..)| -priority);
    let values = sorted.iter().map(|(u, ..)| u.at(at)).collect::<Vec<_>>();
    let cells = values.iter().fold(0, |cells, (e, _)| cells | e);
    let present: Vec<_> = (0..values.len()).filter(|k| values[*k].0 != 0).collect();
    // The first that stops ends the list, the last that replaces begins it.
    let stop = present.iter().position(|k| sorted[*k].3);
    let present = &present[..stop.map_or(present.len(), |stop| stop + 1)];
    let start = present.iter().rposition(|k| sorted[*k].2).unwrap_or(0);
    let counting = present[start..].iter();
    (cells, counting.map(|k| values[*k].1).sum())
}

/// U on E and V on G, combined.
pub fn figure_1(
    operator: Operator,
    (e, u): (Cells, DVec3),
    (g, v): (Cells, DVec3),
) -> (Cells, DVec3) {
    let both = |combined: DVec3| match (e != 0, g != 0) {
        (true, true) => combined,
        (true, false) => u,
        _ => v,
    };
    match operator {
        Operator::SumUnion => (e | g, both(u + v)),
        Operator::SumIntersection => (e & g, u + v),
        Operator::CrossUnion => (e | g, both(u.cross(v))),
        Operator::CrossIntersection => (e & g, u.cross(v)),
        Operator::ReplaceUnion => (e | g, both(v)),
        Operator::ReplaceIntersection => (e & g, v),
        Operator::Difference => (e & !g, u),
        // The rest is not in the figure, and is defined on the union of the sets.
        Operator::Strongest => (e | g, both(if shorter(u, v) { v } else { u })),
        Operator::Weakest => (e | g, both(if shorter(v, u) { v } else { u })),
        Operator::Minimum => (e | g, both(u.min(v))),
        Operator::Maximum => (e | g, both(u.max(v))),
    }
}

fn shorter(a: DVec3, b: DVec3) -> bool {
    a.length_squared() < b.length_squared()
}

pub fn vector([x, y, z]: [i32; 3]) -> Vector {
    Vector::new(x as Real, y as Real, z as Real)
}

fn vector_f64([x, y, z]: [i32; 3]) -> DVec3 {
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// The sample at a point.
pub fn query(at: &Point) -> Query {
    let [x, y, z, time, delta] = at.map(|x| f64::from(x) / 2.0);
    Query {
        world_point: DVec3::new(x, y, z),
        time,
        user: [("delta".into(), delta)].into(),
        ..Query::default()
    }
}

/// The reference's force of a tree at a point of an empty world.
pub fn force(tree: &Tree, at: &Point) -> Option<DVec3> {
    let world = rapier3d_fields::rapier::pipeline::PhysicsWorld::new();
    let reference = Reference::new(tree).expect("a valid tree");
    reference.force(&WorldRef::from(&world), &query(at))
}

pub fn point() -> impl Strategy<Value = Point> {
    // Even numbers are integers, where the surfaces are: two of three samples per axis.
    let coordinate = prop_oneof![2 => (-3..=3).prop_map(|i| 2 * i), 1 => -6..=6];
    proptest::array::uniform5(coordinate)
}

/// Enough points that a law is tried inside, outside and on boundaries of every operand.
pub fn points() -> impl Strategy<Value = Vec<Point>> {
    proptest::collection::vec(point(), 24)
}

fn sign() -> impl Strategy<Value = i32> {
    prop_oneof![Just(-1), Just(1)]
}

fn primitive() -> impl Strategy<Value = Set> {
    let triple = |range: std::ops::RangeInclusive<i32>| proptest::array::uniform3(range);
    let interval = (0..5_usize, -2..=2, 1..=3);
    prop_oneof![
        1 => Just(Set::Everywhere),
        6 => (triple(-1..=1), triple(1..=2)).prop_map(|(centre, half)| Set::Box(centre, half)),
        3 => interval.prop_map(|(axis, low, length)| Set::Interval(axis, low, low + length)),
        2 => (0..3_usize, sign(), -1..=1)
            .prop_map(|(axis, sign, offset)| Set::HalfSpace(axis, sign, offset)),
        2 => (sign(), sign(), -2..=2).prop_map(|(x, time, offset)| Set::Front([x, time], offset)),
    ]
}

/// Primitives, combined up to three deep.
pub fn set() -> impl Strategy<Value = Set> {
    primitive().prop_recursive(3, 8, 2, |set| {
        let pair = (set.clone(), set.clone());
        prop_oneof![
            set.prop_map(|a| Set::Not(Box::new(a))),
            pair.clone()
                .prop_map(|(a, b)| Set::Union(Box::new(a), Box::new(b))),
            pair.clone()
                .prop_map(|(a, b)| Set::Intersection(Box::new(a), Box::new(b))),
            pair.prop_map(|(a, b)| Set::Difference(Box::new(a), Box::new(b))),
        ]
    })
}

pub fn operator() -> impl Strategy<Value = Operator> {
    proptest::sample::select(Operator::ALL.to_vec())
}

pub fn leaf() -> impl Strategy<Value = Model> {
    (set(), proptest::array::uniform3(-3..=3)).prop_map(|(set, v)| Model::Leaf(set, v))
}

/// Fields combined up to four deep: cross products of such small integers stay exact in `f64`.
pub fn model() -> impl Strategy<Value = Model> {
    leaf().prop_recursive(4, 12, 3, |model| {
        let boxed = |model: Model| Box::new(model);
        let layer = (model.clone(), -1..=1, any::<bool>(), any::<bool>());
        prop_oneof![
            6 => (operator(), model.clone(), model.clone())
                .prop_map(move |(operator, u, v)| Model::Apply(operator, boxed(u), boxed(v))),
            1 => (model.clone(), model.clone())
                .prop_map(move |(u, mask)| Model::Masked(boxed(u), boxed(mask))),
            1 => (model, 0..5_usize).prop_map(move |(u, axis)| Model::Scaled(boxed(u), axis)),
            2 => proptest::collection::vec(layer, 1..4).prop_map(Model::Layers),
        ]
    })
}

/// The same tree as one operand, which no operator takes apart into a longer chain.
pub fn nested(tree: &Tree) -> Tree {
    Tree::instances(tree.clone(), [Anchor::WORLD])
}

pub fn apply(operator: Operator, u: &Tree, v: &Tree) -> Tree {
    Tree::fold(operator, [nested(u), nested(v)])
}

/// Fails unless two trees agree at all points, also in where they are not defined.
pub fn same(law: &str, left: &Tree, right: &Tree, points: &[Point]) -> Result<(), TestCaseError> {
    for at in points {
        let (l, r) = (force(left, at), force(right, at));
        prop_assert_eq!(l, r, "{} at {:?} halves", law, at);
    }
    Ok(())
}
