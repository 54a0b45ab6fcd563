//! Random trees over a world, as plain data that shrinks and prints well.
//!
//! Two families. [`Numbers::Integer`]: everything is an integer, points often stand on boundaries,
//! and sums are exact. [`Numbers::Fractional`]: fields stand at quarters and all sizes end in .37,
//! so that no integer point is within 10⁻³ of a boundary, and none on a singularity.

pub mod formulas;
mod scalars;

use proptest::prelude::*;
use rapier3d_fields::field::{Query, Registry};
use rapier3d_fields::math::{Pose, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::rapier::parry::utils::Array2;
use rapier3d_fields::reference::Reference;

pub use formulas::FormulaPlan;
pub use scalars::{ScalarPlan, scalar};

use super::worlds::{World, group, vector};
use formulas::formula;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    Integer,
    Fractional,
}

impl Numbers {
    /// The offset of fields from integer points.
    fn fraction(self) -> Real {
        match self {
            Numbers::Integer => 0.0,
            Numbers::Fractional => 0.25,
        }
    }
}

#[derive(Clone, Debug)]
pub enum RegionPlan {
    Everywhere,
    Ball(i32),
    Cuboid([i32; 3]),
    Cylinder(i32, i32),
    Cone(i32, i32),
    Capsule(i32, i32),
    HalfSpace(usize, i32),
    Interval(usize, i32, i32),
    Shape([i32; 3]),
    /// The same as a mesh without flags, and whether it is wound inwards.
    Mesh([i32; 3], bool),
    /// Below a height field of two by two cells; cannot be written to a file.
    Ground([i32; 9]),
    /// Coefficients of two axes, and the offset.
    HalfSpaceOver([(usize, i32); 2], i32),
    /// Centres and radii along axes.
    BallOver(Vec<(usize, i32, i32)>),
    /// The number of a predicate.
    Predicate(u8),
    Moved(Box<RegionPlan>, [i32; 3]),
    Complement(Box<RegionPlan>),
    Combined(u8, Box<RegionPlan>, Box<RegionPlan>),
}

/// An anchor: on the world (0), a body (1) or a collider (2), its number (numbers wrap around), its place, and quarter
/// turns about y.
pub type AnchorPlan = (u8, usize, [i32; 3], u8);

#[derive(Clone, Debug)]
pub struct LeafPlan {
    pub formula: FormulaPlan,
    pub region: RegionPlan,
    pub anchor: AnchorPlan,
    pub reading: ForceMode,
    pub coupling: Coupling,
    pub scale: Option<ScalarPlan>,
    pub limit: Option<i32>,
    /// Which of two groups of colliders it acts on.
    pub group: Option<u32>,
    pub numbers: Numbers,
}

/// A term: any tree but a bare sum of union.
#[derive(Clone, Debug)]
pub enum TermPlan {
    Leaf(LeafPlan),
    Apply(Operator, Box<TermPlan>, Box<TermPlan>),
    Instances(Box<TermPlan>, Vec<AnchorPlan>),
    Masked(Box<TermPlan>, Box<TermPlan>),
    Scaled(Box<TermPlan>, ScalarPlan, AnchorPlan),
    Limited(Box<TermPlan>, i32),
    Layers(Vec<LayerPlan>),
}

/// A layer: priority, replacing, stopping.
pub type LayerPlan = (TermPlan, i32, bool, bool);

pub const AXES: [&str; 12] = [
    "x", "y", "z", "time", "speed", "radius", "mass", "charge", "delta", "vx", "vy", "vz",
];

impl RegionPlan {
    /// Whether any part of it is a Parry shape.
    pub fn any_shape(&self) -> bool {
        match self {
            RegionPlan::Shape(_) | RegionPlan::Mesh(..) => true,
            RegionPlan::Moved(of, _) | RegionPlan::Complement(of) => of.any_shape(),
            RegionPlan::Combined(_, a, b) => a.any_shape() || b.any_shape(),
            _ => false,
        }
    }

    /// Whether, of two colliders of a body at one place, only one may be in it.
    fn reads_parts(&self) -> bool {
        let of_part = |axis: usize| matches!(AXES[axis], "radius" | "mass" | "charge" | "delta");
        match self {
            RegionPlan::Interval(axis, ..) => of_part(*axis),
            RegionPlan::HalfSpaceOver(axes, _) => axes.iter().any(|(axis, _)| of_part(*axis)),
            RegionPlan::BallOver(axes) => axes.iter().any(|(axis, ..)| of_part(*axis)),
            RegionPlan::Predicate(_) => true,
            RegionPlan::Moved(of, _) | RegionPlan::Complement(of) => of.reads_parts(),
            RegionPlan::Combined(_, a, b) => a.reads_parts() || b.reads_parts(),
            _ => false,
        }
    }

    fn region(&self, numbers: Numbers) -> Region {
        let size = |i: i32| {
            i as Real
                + if numbers == Numbers::Integer {
                    0.0
                } else {
                    0.37
                }
        };
        match self {
            RegionPlan::Everywhere => Region::everywhere(),
            RegionPlan::Ball(r) => Region::ball(size(*r)),
            RegionPlan::Cuboid(half) => Region::cuboid(Vector::from_array(half.map(size))),
            RegionPlan::Cylinder(h, r) => Region::cylinder(size(*h), size(*r)),
            RegionPlan::Cone(h, r) => Region::cone(size(*h), size(*r)),
            RegionPlan::Capsule(h, r) => Region::capsule(size(*h), size(*r)),
            RegionPlan::HalfSpace(axis, offset) => {
                Region::half_space(Vector::AXES[*axis], size(*offset))
            }
            RegionPlan::Interval(axis, low, length) => {
                Region::interval(AXES[*axis], size(*low), size(*low + *length))
            }
            RegionPlan::Shape(half) => {
                let [x, y, z] = half.map(size);
                Region::shape(SharedShape::cuboid(x, y, z))
            }
            RegionPlan::Mesh(half, inwards) => {
                let [x, y, z] = half.map(size);
                let shape = SharedShape::cuboid(x, y, z);
                let (points, mut triangles) = shape.as_cuboid().expect("a cuboid").to_trimesh();
                if *inwards {
                    triangles
                        .iter_mut()
                        .for_each(|triangle| triangle.swap(0, 1));
                }
                Region::shape(SharedShape::trimesh(points, triangles).expect("a mesh"))
            }
            RegionPlan::Ground(heights) => {
                let heights = heights.iter().map(|h| *h as Real).collect();
                let heights = Array2::new(3, 3, heights);
                Region::shape(SharedShape::heightfield(heights, Vector::splat(4.0)))
            }
            RegionPlan::HalfSpaceOver(coefficients, offset) => {
                let named = coefficients.map(|(axis, c)| (AXES[axis].into(), c as Real));
                Region::half_space_over(named, size(*offset))
            }
            RegionPlan::BallOver(axes) => {
                let named = axes.iter();
                Region::ball_over(
                    named.map(|(axis, c, r)| (AXES[*axis].into(), *c as Real, size(*r))),
                )
            }
            RegionPlan::Predicate(number) => predicate(*number),
            RegionPlan::Moved(region, by) => region.region(numbers).at(vector(*by)),
            RegionPlan::Complement(region) => region.region(numbers).complement(),
            RegionPlan::Combined(kind, a, b) => {
                let (a, b) = (a.region(numbers), b.region(numbers));
                match kind {
                    0 => a.union(b),
                    1 => a.intersection(b),
                    _ => a.difference(b),
                }
            }
        }
    }
}

fn predicate(number: u8) -> Region {
    match number {
        0 => Region::predicate_named("beyond", [], beyond),
        1 => Region::predicate_named("charged", [Axis::Charge], charged),
        _ => Region::predicate_named("below delta", ["delta".into()], below_delta),
    }
}

fn beyond(s: &Sample) -> bool {
    s.local_point.x > s.local_point.y
}

fn charged(s: &Sample) -> bool {
    s.axes[0] >= 0.0
}

fn below_delta(s: &Sample) -> bool {
    s.axes[0] > s.local_point.z
}

/// A registry of all functions in the trees.
pub fn registry() -> Registry {
    formulas::registry()
        .predicate("beyond", [], beyond)
        .predicate("charged", [Axis::Charge], charged)
        .predicate("below delta", ["delta".into()], below_delta)
        .scalar(
            "height and mass",
            [Axis::Y, Axis::Mass],
            scalars::height_and_mass,
        )
}

/// The anchor of a plan, its place shifted by `fraction` along all axes.
fn anchor(plan: &AnchorPlan, fraction: Real, world: &World) -> Anchor {
    let (kind, number, place, turns) = *plan;
    let local_point = vector(place) + Vector::splat(fraction);
    let mut local_pose = Pose::from_translation(local_point);
    if turns > 0 {
        let angle = Real::from(turns) * std::f64::consts::FRAC_PI_2 as Real;
        local_pose.rotation = Rotation::from_axis_angle(Vector::Y, angle);
    }
    match kind {
        0 => Anchor::World { local_pose },
        1 => Anchor::Body {
            handle: world.bodies[number % world.bodies.len()],
            local_pose,
        },
        _ => Anchor::Collider {
            handle: world.colliders[number % world.colliders.len()],
            local_pose,
        },
    }
}

impl LeafPlan {
    fn dress(&self, field: Field, world: &World) -> Field {
        let field = field
            .at(anchor(&self.anchor, self.numbers.fraction(), world))
            .force_mode(self.reading)
            .coupled_to(self.coupling.clone());
        match self.group {
            Some(number) => field.groups(group(number)),
            None => field,
        }
    }

    fn field(&self, world: &World) -> Field {
        let mut field = self.dress(self.formula.field(), world);
        if let Some(scale) = &self.scale {
            field = field.scaled_by(scale.scalar());
        }
        if let Some(limit) = self.limit {
            field = field.limited_to(limit as Real);
        }
        if self.formula.brings_region() {
            return field;
        }
        field.within(self.region.region(self.numbers))
    }

    fn may_cut(&self) -> bool {
        matches!(
            self.formula,
            FormulaPlan::Uniform(_) | FormulaPlan::Buoyancy(_)
        )
    }

    fn acts_at_centre(&self) -> bool {
        matches!(self.formula, FormulaPlan::Uniform(_))
            && self.coupling == Coupling::Share
            && self.group.is_none()
            && !self.region.reads_parts()
            && self.scale.as_ref().is_none_or(ScalarPlan::is_uniform)
    }

    /// Whether it is evaluated in the precision of [`Real`] where it is a term by itself.
    fn is_bare_law(&self) -> bool {
        self.formula.radial_magnitude(1.0).is_some() && self.scale.is_none()
    }
}

fn layer(
    (term, priority, replaces, stops): &LayerPlan,
    world: &World,
    sampling: Sampling,
) -> Layer {
    let mut layer = Layer::new(term.sampled(world, sampling)).priority(*priority);
    if *replaces {
        layer = layer.replacing();
    }
    if *stops {
        layer = layer.stopping();
    }
    layer
}

impl TermPlan {
    pub fn tree(&self, world: &World) -> Tree {
        self.sampled(world, Sampling::Auto)
    }

    fn sampled(&self, world: &World, sampling: Sampling) -> Tree {
        let of = |term: &TermPlan| term.sampled(world, sampling);
        match self {
            TermPlan::Leaf(leaf) => leaf.field(world).sampled(sampling).into(),
            TermPlan::Apply(operator, a, b) => Tree::fold(*operator, [of(a), of(b)]),
            TermPlan::Instances(term, anchors) => {
                let anchors = anchors.iter().map(|a| anchor(a, 0.0, world));
                Tree::instances(of(term), anchors)
            }
            TermPlan::Masked(term, mask) => of(term).masked_by(of(mask)),
            TermPlan::Scaled(term, scale, at) => {
                of(term).scaled_at(scale.scalar(), anchor(at, 0.0, world))
            }
            TermPlan::Limited(term, limit) => of(term).limited_to(*limit as Real),
            TermPlan::Layers(layers) => {
                Tree::layers(layers.iter().map(|plan| layer(plan, world, sampling)))
            }
        }
    }

    /// The same, wrapped so that a sum of union at its top is one term and not several; sampled at points, as in the
    /// paper, even if it could cut bodies at borders.
    pub fn term(&self, world: &World) -> Tree {
        let sampling = match (self.may_cut(), self.acts_at_centre()) {
            (false, _) => Sampling::Auto,
            (true, true) => Sampling::Centre,
            (true, false) => Sampling::Parts,
        };
        let tree = self.sampled(world, sampling);
        match self {
            TermPlan::Apply(Operator::SumUnion, ..) => Tree::instances(tree, [Anchor::WORLD]),
            _ => tree,
        }
    }

    /// Whether all its fields are uniform over a body except for their borders.
    fn may_cut(&self) -> bool {
        match self {
            TermPlan::Leaf(leaf) => leaf.may_cut(),
            _ => self.operands().iter().all(|term| term.may_cut()),
        }
    }

    /// Whether bodies are sampled once for this term, at their centre of mass: all its fields are uniform, shared out
    /// by mass, and read nothing that may differ between colliders.
    pub fn acts_at_centre(&self) -> bool {
        match self {
            TermPlan::Leaf(leaf) => leaf.acts_at_centre(),
            TermPlan::Apply(_, a, b) | TermPlan::Masked(a, b) => {
                a.acts_at_centre() && b.acts_at_centre()
            }
            TermPlan::Instances(term, _) | TermPlan::Limited(term, _) => term.acts_at_centre(),
            TermPlan::Scaled(term, scale, _) => scale.is_uniform() && term.acts_at_centre(),
            TermPlan::Layers(layers) => layers.iter().all(|(term, ..)| term.acts_at_centre()),
        }
    }

    /// The terms it is made of.
    fn operands(&self) -> Vec<&TermPlan> {
        match self {
            TermPlan::Leaf(_) => Vec::new(),
            TermPlan::Apply(_, a, b) | TermPlan::Masked(a, b) => vec![a, b],
            TermPlan::Instances(of, _) | TermPlan::Scaled(of, ..) | TermPlan::Limited(of, _) => {
                vec![of]
            }
            TermPlan::Layers(layers) => layers.iter().map(|(term, ..)| term).collect(),
        }
    }

    /// The number of fields, those of each instance counted.
    pub fn leaf_count(&self) -> usize {
        let below: usize = self.operands().into_iter().map(TermPlan::leaf_count).sum();
        match self {
            TermPlan::Leaf(_) => 1,
            TermPlan::Instances(_, anchors) => below * anchors.len(),
            _ => below,
        }
    }

    pub fn any_leaf(&self, is: &dyn Fn(&LeafPlan) -> bool) -> bool {
        let below = || self.operands().into_iter().any(|term| term.any_leaf(is));
        matches!(self, TermPlan::Leaf(leaf) if is(leaf)) || below()
    }

    pub fn any_scale(&self, is: &dyn Fn(&ScalarPlan) -> bool) -> bool {
        let own = match self {
            TermPlan::Leaf(leaf) => leaf.scale.as_ref(),
            TermPlan::Scaled(_, scale, _) => Some(scale),
            _ => None,
        };
        let below = || self.operands().into_iter().any(|term| term.any_scale(is));
        own.is_some_and(|scale| scale.any(is)) || below()
    }

    /// Whether it contains an operator that chooses between two vectors by their lengths.
    pub fn chooses_by_length(&self) -> bool {
        use Operator::{Strongest, Weakest};
        let below = || self.operands().into_iter().any(Self::chooses_by_length);
        matches!(self, TermPlan::Apply(Strongest | Weakest, ..)) || below()
    }

    /// The sum of the magnitudes of all fields and composites in it, at a sample.
    pub fn size(&self, world: &World, query: &Query) -> f64 {
        self.size_in(world, query, &|tree| tree)
    }

    fn size_in(&self, world: &World, query: &Query, wrap: &dyn Fn(Tree) -> Tree) -> f64 {
        let own = reference(&wrap(self.tree(world)), world, query).map_or(0.0, |f| f.length());
        let instances = match self {
            TermPlan::Instances(_, anchors) => &anchors[..],
            _ => &[(0, 0, [0; 3], 0)],
        };
        let mut sum = own;
        for plan in instances {
            let anchor = anchor(plan, 0.0, world);
            let within = |tree: Tree| wrap(Tree::instances(tree, [anchor]));
            let operands = self.operands().into_iter();
            sum += operands
                .map(|term| term.size_in(world, query, &within))
                .sum::<f64>();
        }
        sum
    }

    /// The sum of the magnitudes of what is added up in the precision of [`Real`] at a sample.
    pub fn magnitude(&self, world: &World, query: &Query) -> f64 {
        let wrap = |tree: Tree| tree;
        self.magnitude_in(world, query, &wrap)
    }

    fn magnitude_in(&self, world: &World, query: &Query, wrap: &dyn Fn(Tree) -> Tree) -> f64 {
        let length = |tree: Tree| reference(&wrap(tree), world, query).map_or(0.0, |f| f.length());
        match self {
            TermPlan::Instances(term, anchors) => {
                let each = anchors.iter().map(|plan| {
                    let anchor = anchor(plan, 0.0, world);
                    let wrap = |tree: Tree| wrap(Tree::instances(tree, [anchor]));
                    term.magnitude_in(world, query, &wrap)
                });
                each.sum()
            }
            TermPlan::Leaf(leaf) if leaf.is_bare_law() => {
                // A unit vector in its place gives the weight, a unit spring the distance.
                let weight = length(leaf.dress(Field::uniform(Vector::X), world).into());
                let spring = leaf.dress(Field::spring(1.0), world);
                let spring = spring
                    .coupled_to(Coupling::Each)
                    .force_mode(ForceMode::Force);
                let distance = length(spring.into());
                if weight == 0.0 || reference(&wrap(self.tree(world)), world, query).is_none() {
                    return 0.0;
                }
                leaf.formula
                    .radial_magnitude(distance)
                    .map_or(0.0, |law| law * weight)
            }
            _ => length(self.tree(world)),
        }
    }
}

/// The force by the reference.
pub fn reference(
    tree: &Tree,
    world: &World,
    query: &Query,
) -> Option<rapier3d_fields::math::DVec3> {
    let reference = Reference::new(tree).expect("a valid tree");
    reference.force(&WorldRef::from(&world.physics), query)
}

/// A relative error that this number of roundings in [`Real`] may cause.
pub fn rounding(count: usize) -> f64 {
    to_f64(Real::EPSILON) * count as f64
}

fn triple(size: i32) -> impl Strategy<Value = [i32; 3]> + Clone {
    proptest::array::uniform3(-size..=size)
}

fn region() -> impl Strategy<Value = RegionPlan> {
    let size = || 1..=4;
    let over = || (0..AXES.len(), prop_oneof![-2..=-1, 1..=2]);
    let primitive = prop_oneof![
        3 => Just(RegionPlan::Everywhere),
        4 => size().prop_map(RegionPlan::Ball),
        2 => proptest::array::uniform3(size()).prop_map(RegionPlan::Cuboid),
        1 => (size(), size()).prop_map(|(h, r)| RegionPlan::Cylinder(h, r)),
        1 => (size(), size()).prop_map(|(h, r)| RegionPlan::Cone(h, r)),
        1 => (size(), size()).prop_map(|(h, r)| RegionPlan::Capsule(h, r)),
        1 => (0..3_usize, -2..=2).prop_map(|(axis, offset)| RegionPlan::HalfSpace(axis, offset)),
        2 => (0..AXES.len(), -2..=2, 1..=4)
            .prop_map(|(axis, low, length)| RegionPlan::Interval(axis, low, length)),
        1 => proptest::array::uniform3(size()).prop_map(RegionPlan::Shape),
        1 => (proptest::array::uniform3(size()), any::<bool>())
            .prop_map(|(half, inwards)| RegionPlan::Mesh(half, inwards)),
        2 => ([over(), over()], -2..=4)
            .prop_map(|(axes, offset)| RegionPlan::HalfSpaceOver(axes, offset)),
        2 => proptest::collection::vec((0..AXES.len(), -1..=1, size()), 1..4)
            .prop_map(RegionPlan::BallOver),
        1 => (0..3_u8).prop_map(RegionPlan::Predicate),
    ];
    primitive.prop_recursive(2, 4, 2, |region| {
        let boxed = |region: RegionPlan| Box::new(region);
        prop_oneof![
            (region.clone(), triple(2)).prop_map(move |(a, by)| RegionPlan::Moved(boxed(a), by)),
            region
                .clone()
                .prop_map(move |a| RegionPlan::Complement(boxed(a))),
            (0..3_u8, region.clone(), region).prop_map(move |(kind, a, b)| RegionPlan::Combined(
                kind,
                boxed(a),
                boxed(b)
            )),
        ]
    })
}

pub fn anchor_plan(numbers: Numbers) -> impl Strategy<Value = AnchorPlan> {
    let turns = if numbers == Numbers::Integer {
        0..=0_u8
    } else {
        0..=3
    };
    (0..3_u8, 0..8_usize, triple(4), turns)
}

fn coupling(numbers: Numbers) -> impl Strategy<Value = Coupling> {
    // A speed is a square root, and a radius here a fraction.
    let fits = |axis: &&str| numbers == Numbers::Fractional || !["speed", "radius"].contains(axis);
    let axes: Vec<&str> = AXES.into_iter().filter(fits).collect();
    prop_oneof![
        3 => Just(Coupling::Share),
        2 => Just(Coupling::Each),
        3 => proptest::sample::select(axes).prop_map(|axis| Coupling::Axis(axis.into())),
    ]
}

fn reading() -> impl Strategy<Value = ForceMode> {
    proptest::sample::select(vec![
        ForceMode::Force,
        ForceMode::Acceleration,
        ForceMode::VelocityChange,
    ])
}

/// Scale, limit and group: most fields have none.
fn extras(
    numbers: Numbers,
) -> impl Strategy<Value = (Option<ScalarPlan>, Option<i32>, Option<u32>)> {
    let rarely = |weight| proptest::option::weighted(weight, limit(numbers));
    (
        proptest::option::weighted(0.25, scalar(numbers)),
        rarely(0.15),
        proptest::option::weighted(0.15, 0..2_u32),
    )
}

/// Bounds of a vector's length. Shortening takes a root, except to zero.
fn limit(numbers: Numbers) -> std::ops::RangeInclusive<i32> {
    match numbers {
        Numbers::Integer => 0..=0,
        Numbers::Fractional => 0..=3,
    }
}

pub fn leaf(numbers: Numbers) -> impl Strategy<Value = LeafPlan> {
    let parts = (
        formula(numbers),
        region(),
        anchor_plan(numbers),
        reading(),
        coupling(numbers),
        extras(numbers),
    );
    parts.prop_map(
        move |(formula, region, anchor, reading, coupling, (scale, limit, group))| LeafPlan {
            formula,
            region,
            anchor,
            reading,
            coupling,
            scale,
            limit,
            group,
            numbers,
        },
    )
}

pub fn term(numbers: Numbers) -> impl Strategy<Value = TermPlan> {
    let boxed = |term: TermPlan| Box::new(term);
    leaf(numbers).prop_map(TermPlan::Leaf).prop_recursive(3, 8, 3, move |term| {
        let operator = proptest::sample::select(Operator::ALL.to_vec());
        let at = proptest::collection::vec(anchor_plan(numbers), 1..4);
        let layer = (term.clone(), -1..=1, any::<bool>(), any::<bool>());
        let scaled = (term.clone(), scalar(numbers), anchor_plan(numbers));
        prop_oneof![
            6 => (operator, term.clone(), term.clone())
                .prop_map(move |(operator, a, b)| TermPlan::Apply(operator, boxed(a), boxed(b))),
            2 => (term.clone(), at).prop_map(move |(term, at)| TermPlan::Instances(boxed(term), at)),
            1 => (term.clone(), term.clone())
                .prop_map(move |(term, mask)| TermPlan::Masked(boxed(term), boxed(mask))),
            2 => scaled.prop_map(move |(term, scale, at)| TermPlan::Scaled(boxed(term), scale, at)),
            1 => (term, limit(numbers)).prop_map(move |(term, to)| TermPlan::Limited(boxed(term), to)),
            2 => proptest::collection::vec(layer, 1..4).prop_map(TermPlan::Layers),
        ]
    })
}
