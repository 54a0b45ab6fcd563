//! Random trees over a world, as plain data that shrinks and prints well.
//!
//! Two families. [`Numbers::Integer`]: everything is an integer, points often stand on boundaries,
//! and sums are exact. [`Numbers::Fractional`]: fields stand at quarters and all sizes end in .37,
//! so that no integer point is within 10⁻³ of a boundary, and none on a singularity.

use proptest::prelude::*;
use rapier3d_fields::field::Query;
use rapier3d_fields::math::{Pose, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::worlds::{World, vector};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    Integer,
    Fractional,
}

#[derive(Clone, Debug)]
pub enum FormulaPlan {
    Uniform([i32; 3]),
    Radial {
        strength: i32,
        power: i32,
        softened: bool,
        cutoff: Option<i32>,
    },
    LennardJones {
        epsilon: i32,
        cutoff: Option<i32>,
    },
    Spring {
        stiffness: i32,
        damping: i32,
        rest_length: i32,
    },
    Drag {
        linear: i32,
        quadratic: i32,
    },
    Magnetic([i32; 3]),
    /// Number of one of a few closures.
    Closure(u8),
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
    Moved(Box<RegionPlan>, [i32; 3]),
    Complement(Box<RegionPlan>),
    Combined(u8, Box<RegionPlan>, Box<RegionPlan>),
}

/// What hangs on what: 0 the world, 1 a body, 2 a collider (numbers wrap around), its place, and
/// quarter turns about y.
pub type AnchorPlan = (u8, usize, [i32; 3], u8);

#[derive(Clone, Debug)]
pub struct LeafPlan {
    pub formula: FormulaPlan,
    pub region: RegionPlan,
    pub anchor: AnchorPlan,
    pub reading: Reading,
    pub coupling: Coupling,
    pub numbers: Numbers,
}

/// A term: anything but a bare sum of union.
#[derive(Clone, Debug)]
pub enum TermPlan {
    Leaf(LeafPlan),
    Apply(Operator, Box<TermPlan>, Box<TermPlan>),
    Instances(Box<TermPlan>, Vec<AnchorPlan>),
}

pub const AXES: [&str; 9] = [
    "x", "y", "z", "time", "speed", "radius", "mass", "charge", "delta",
];

impl FormulaPlan {
    fn field(&self) -> Field {
        let real = |i: i32| i as Real;
        match *self {
            FormulaPlan::Uniform(v) => Field::uniform(vector(v)),
            FormulaPlan::Radial {
                strength,
                power,
                softened,
                cutoff,
            } => {
                let field = Field::radial(real(strength), real(power));
                let field = if softened { field.softened(0.5) } else { field };
                match cutoff {
                    Some(cutoff) => field.shifted_to_zero_at(real(cutoff) + 0.37),
                    None => field,
                }
            }
            FormulaPlan::LennardJones { epsilon, cutoff } => {
                let field = Field::lennard_jones(real(epsilon), 0.75);
                match cutoff {
                    Some(cutoff) => field.shifted_to_zero_at(real(cutoff) + 0.37),
                    None => field,
                }
            }
            FormulaPlan::Spring {
                stiffness,
                damping,
                rest_length,
            } => Field::spring_damper(real(stiffness), real(damping), real(rest_length)),
            FormulaPlan::Drag { linear, quadratic } => Field::drag(real(linear), real(quadratic)),
            FormulaPlan::Magnetic(b) => Field::magnetic(vector(b)),
            FormulaPlan::Closure(0) => Field::closure([], |s: &Sample| s.local_point + Vector::X),
            FormulaPlan::Closure(1) => {
                Field::closure(["delta".into(), Axis::Time], |s: &Sample| {
                    Vector::new(s.axes[0], s.axes[1], s.charge)
                })
            }
            FormulaPlan::Closure(_) => Field::closure([Axis::Speed], |s: &Sample| {
                s.local_velocity.cross(s.local_point)
            }),
        }
    }

    fn cutoff(&self) -> Option<i32> {
        match self {
            FormulaPlan::Radial { cutoff, .. } | FormulaPlan::LennardJones { cutoff, .. } => {
                *cutoff
            }
            _ => None,
        }
    }

    /// The sum of the magnitudes of what a radial law adds up at a distance; its terms may cancel.
    fn radial_magnitude(&self, r: f64) -> Option<f64> {
        let law = |r: f64| match *self {
            FormulaPlan::Radial {
                strength,
                power,
                softened,
                ..
            } => {
                let rho = if softened { r.hypot(0.5) } else { r };
                Some(f64::from(strength).abs() * r * rho.powi(power - 1))
            }
            FormulaPlan::LennardJones { epsilon, .. } => {
                let s6 = (0.75 / r).powi(6);
                Some(24.0 * f64::from(epsilon).abs() * (2.0 * s6 * s6 + s6) / r)
            }
            _ => None,
        };
        let at_cutoff = self
            .cutoff()
            .map_or(Some(0.0), |cutoff| law(f64::from(cutoff) + 0.37));
        Some(law(r)? + at_cutoff?)
    }
}

impl RegionPlan {
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
        let fraction = if self.numbers == Numbers::Integer {
            0.0
        } else {
            0.25
        };
        field
            .at(anchor(&self.anchor, fraction, world))
            .read_as(self.reading)
            .coupled_to(self.coupling.clone())
    }

    fn field(&self, world: &World) -> Field {
        let field = self.dress(self.formula.field(), world);
        // A cutoff brings its own ball.
        match self.formula.cutoff() {
            Some(_) => field,
            None => field.within(self.region.region(self.numbers)),
        }
    }
}

impl TermPlan {
    pub fn tree(&self, world: &World) -> Tree {
        match self {
            TermPlan::Leaf(leaf) => leaf.field(world).into(),
            TermPlan::Apply(operator, a, b) => {
                Tree::fold(*operator, [a.tree(world), b.tree(world)])
            }
            TermPlan::Instances(term, anchors) => Tree::instances(
                term.tree(world),
                anchors.iter().map(|a| anchor(a, 0.0, world)),
            ),
        }
    }

    /// The same, wrapped so that a sum of union at its top is one term and not several.
    pub fn term(&self, world: &World) -> Tree {
        match self {
            TermPlan::Apply(Operator::SumUnion, ..) => {
                Tree::instances(self.tree(world), [Anchor::WORLD])
            }
            _ => self.tree(world),
        }
    }

    /// Whether bodies are sampled once for this term, at their centre of mass: all its fields are
    /// uniform, and shared out by mass.
    pub fn acts_at_centre(&self) -> bool {
        match self {
            TermPlan::Leaf(leaf) => {
                matches!(leaf.formula, FormulaPlan::Uniform(_)) && leaf.coupling == Coupling::Share
            }
            TermPlan::Apply(_, a, b) => a.acts_at_centre() && b.acts_at_centre(),
            TermPlan::Instances(term, _) => term.acts_at_centre(),
        }
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
            TermPlan::Leaf(leaf) if leaf.formula.radial_magnitude(1.0).is_some() => {
                // Its weight is what becomes of a unit vector, its distance of a unit spring.
                let weight = length(leaf.dress(Field::uniform(Vector::X), world).into());
                let spring = leaf.dress(Field::spring(1.0), world);
                let spring = spring.coupled_to(Coupling::Each).read_as(Reading::Force);
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

/// What the reference says.
pub fn reference(
    tree: &Tree,
    world: &World,
    query: &Query,
) -> Option<rapier3d_fields::math::DVec3> {
    let reference = Reference::new(tree).expect("a valid tree");
    reference.force(&(&world.physics.bodies, &world.physics.colliders), query)
}

/// A relative error that rounding in [`Real`] may cause, by the number of roundings.
pub fn rounding(count: usize) -> f64 {
    to_f64(Real::EPSILON) * count as f64
}

fn triple(size: i32) -> impl Strategy<Value = [i32; 3]> + Clone {
    proptest::array::uniform3(-size..=size)
}

fn formula(numbers: Numbers) -> BoxedStrategy<FormulaPlan> {
    let number = || -3..=3;
    let common = prop_oneof![
        triple(3).prop_map(FormulaPlan::Uniform),
        triple(2).prop_map(FormulaPlan::Magnetic),
        (0..3_u8).prop_map(FormulaPlan::Closure),
    ];
    match numbers {
        Numbers::Integer => {
            let spring =
                (number(), number()).prop_map(|(stiffness, damping)| FormulaPlan::Spring {
                    stiffness,
                    damping,
                    rest_length: 0,
                });
            let radial = (number(), prop_oneof![Just(1), Just(3)]).prop_map(|(strength, power)| {
                FormulaPlan::Radial {
                    strength,
                    power,
                    softened: false,
                    cutoff: None,
                }
            });
            let drag = number().prop_map(|linear| FormulaPlan::Drag {
                linear,
                quadratic: 0,
            });
            prop_oneof![3 => common, 1 => spring, 2 => radial, 1 => drag].boxed()
        }
        Numbers::Fractional => {
            let spring =
                (number(), number(), 0..=2).prop_map(|(stiffness, damping, rest_length)| {
                    FormulaPlan::Spring {
                        stiffness,
                        damping,
                        rest_length,
                    }
                });
            let drag = (number(), number())
                .prop_map(|(linear, quadratic)| FormulaPlan::Drag { linear, quadratic });
            prop_oneof![3 => common, 1 => spring, 3 => radial_law(), 1 => drag].boxed()
        }
    }
}

/// Every radial law, softened, shifted or neither.
pub fn radial_law() -> impl Strategy<Value = FormulaPlan> {
    let cutoff = || proptest::option::of(1..=4);
    prop_oneof![
        4 => (-3..=3, -3..=2, any::<bool>(), cutoff()).prop_map(|(strength, power, softened, cutoff)| {
            FormulaPlan::Radial { strength, power, softened, cutoff }
        }),
        1 => (1..=3, cutoff()).prop_map(|(epsilon, cutoff)| FormulaPlan::LennardJones { epsilon, cutoff }),
    ]
}

fn region() -> impl Strategy<Value = RegionPlan> {
    let size = || 1..=4;
    let primitive = prop_oneof![
        3 => Just(RegionPlan::Everywhere),
        4 => size().prop_map(RegionPlan::Ball),
        2 => proptest::array::uniform3(size()).prop_map(RegionPlan::Cuboid),
        1 => (size(), size()).prop_map(|(h, r)| RegionPlan::Cylinder(h, r)),
        1 => (size(), size()).prop_map(|(h, r)| RegionPlan::Cone(h, r)),
        1 => (size(), size()).prop_map(|(h, r)| RegionPlan::Capsule(h, r)),
        1 => (0..3_usize, -2..=2).prop_map(|(axis, offset)| RegionPlan::HalfSpace(axis, offset)),
        2 => (0..9_usize, -2..=2, 1..=4)
            .prop_map(|(axis, low, length)| RegionPlan::Interval(axis, low, length)),
        1 => proptest::array::uniform3(size()).prop_map(RegionPlan::Shape),
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

fn anchors(numbers: Numbers) -> impl Strategy<Value = AnchorPlan> {
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

fn reading() -> impl Strategy<Value = Reading> {
    proptest::sample::select(vec![
        Reading::Force,
        Reading::Acceleration,
        Reading::VelocityChange,
    ])
}

pub fn leaf(numbers: Numbers) -> impl Strategy<Value = LeafPlan> {
    let parts = (
        formula(numbers),
        region(),
        anchors(numbers),
        reading(),
        coupling(numbers),
    );
    parts.prop_map(
        move |(formula, region, anchor, reading, coupling)| LeafPlan {
            formula,
            region,
            anchor,
            reading,
            coupling,
            numbers,
        },
    )
}

pub fn term(numbers: Numbers) -> impl Strategy<Value = TermPlan> {
    leaf(numbers).prop_map(TermPlan::Leaf).prop_recursive(2, 6, 3, move |term| {
        let operator = proptest::sample::select(Operator::ALL.to_vec());
        let at = proptest::collection::vec(anchors(numbers), 1..4);
        prop_oneof![
            3 => (operator, term.clone(), term.clone())
                .prop_map(|(operator, a, b)| TermPlan::Apply(operator, Box::new(a), Box::new(b))),
            1 => (term, at).prop_map(|(term, at)| TermPlan::Instances(Box::new(term), at)),
        ]
    })
}
