//! Trees of every formula, region, operator, anchor and law; settings of every kind.

use rapier3d_fields::cross_check::CrossCheck;
use rapier3d_fields::field::{Grid, LinearKernel, Path, Swirl, Turbulence};
use rapier3d_fields::math::Real;
use rapier3d_fields::prelude::*;

use crate::draw::Draw;

/// The bodies and colliders to which fields can be anchored. Later edits may remove some.
struct Carriers {
    bodies: Vec<RigidBodyHandle>,
    colliders: Vec<ColliderHandle>,
}

fn formula(draw: &mut Draw) -> Field {
    let [a, b, c] = [draw.number(), draw.number(), draw.number()];
    let few = |draw: &mut Draw| draw.between(0.0, 3.0);
    match draw.below(26) {
        0 => Field::uniform(draw.numbers()),
        1 => Field::uniform(draw.numbers()).force_mode(ForceMode::Acceleration),
        2 => Field::radial(a, draw.of(&[-2.0, -1.0, 0.0, 1.0, -7.0])),
        3 => Field::point_gravity(a.abs())
            .softened(few(draw))
            .opening_angle(0.5),
        4 => Field::coulomb(a, b).shifted_to_zero_at(draw.size()),
        5 => Field::lennard_jones(a.abs(), draw.size()),
        6 => Field::lennard_jones(a.abs(), draw.size()).shifted_to_zero_at(3.0),
        7 => Field::spring(a.abs()),
        8 => Field::spring_damper(a.abs(), b.abs(), few(draw)),
        9 => Field::drag(a.abs(), few(draw)),
        10 => Field::wind(draw.numbers(), few(draw), few(draw)),
        11 => Field::magnetic(draw.numbers()).coupled_to(Coupling::Each),
        12 => Field::yukawa(a, draw.size()),
        13 => Field::morse(a.abs(), b.abs(), draw.size()),
        14 => Field::gaussian(a, draw.size()),
        15 => Field::hertz(a.abs(), draw.size()),
        16 => Field::vortex(a, draw.of(&[0.0, -1.0, 1.0])).smoothed(draw.size()),
        17 => Field::swirl(Swirl {
            around: a,
            inward: b,
            along: c,
            power: -1.0,
            core: draw.size(),
        }),
        18 => Field::updraft(a, b),
        19 => Field::buoyancy(a.abs(), 9.81),
        20 => Field::turbulence(Turbulence::new(
            draw.below(9) as u64,
            draw.size(),
            draw.size(),
        )),
        21 => Field::turbulence(Turbulence::new(3, 2.0, 1.0))
            .as_wind(few(draw), few(draw))
            .speed_cap(b.abs()),
        22 => {
            let points: Vec<_> = (0..4).map(|_| draw.vector(5.0)).collect();
            let path = Path::new(points, draw.once_in(2)).stiffness(a.abs());
            Field::path(path.damping(few(draw), b))
        }
        23 => {
            let high = Vector::splat(draw.size());
            let mut grid = Grid::sampled(-high, high, [3; 3], |at| at);
            grid.values.fill_with(|| draw.vector(3.0));
            Field::grid(grid)
        }
        24 => Field::linear_kernel(LinearKernel {
            constant: draw.numbers(),
            ..LinearKernel::default()
        }),
        _ => Field::closure([Axis::Time], move |s: &Sample| {
            Vector::new(a, b * s.axes[0], c)
        }),
    }
}

fn region(draw: &mut Draw, depth: usize) -> Region {
    let [a, b] = [draw.size() * 3.0, draw.size() * 3.0];
    let region = match draw.below(if depth == 0 { 9 } else { 13 }) {
        0..2 => Region::ball(a),
        2 => Region::cuboid(Vector::new(a, b, draw.size())),
        3 => Region::cylinder(a, b),
        4 => Region::cone(a, b),
        5 => Region::capsule(a, b),
        6 => Region::half_space(draw.unit(), draw.between(-3.0, 3.0)),
        7 => {
            let axis = draw.of(&["speed", "time", "x", "mass", "radius", "y"]);
            Region::interval(axis, draw.between(-3.0, 0.5), draw.between(0.6, 6.0))
        }
        8 => Region::shape(SharedShape::round_cuboid(a, b, 1.0, 0.2)),
        9 => region(draw, depth - 1).union(region(draw, depth - 1)),
        10 => region(draw, depth - 1).intersection(region(draw, depth - 1)),
        11 => region(draw, depth - 1).difference(region(draw, depth - 1)),
        _ => region(draw, depth - 1).complement(),
    };
    if draw.once_in(3) {
        region.at(draw.pose(2.0))
    } else {
        region
    }
}

fn anchored(draw: &mut Draw, field: Field, carriers: &Carriers) -> Field {
    let local_pose = draw.pose(1.0);
    match draw.below(5) {
        0 | 1 if !carriers.bodies.is_empty() => {
            let handle = draw.of(&carriers.bodies);
            let field = field.at(Anchor::Body { handle, local_pose });
            if draw.once_in(3) {
                field.reacting()
            } else {
                field
            }
        }
        2 if !carriers.colliders.is_empty() => {
            let handle = draw.of(&carriers.colliders);
            field.at(Anchor::Collider { handle, local_pose })
        }
        3 => field.at(draw.pose(5.0)),
        _ => field,
    }
}

fn leaf(draw: &mut Draw, carriers: &Carriers) -> Field {
    let mut field = formula(draw);
    if draw.once_in(2) {
        field = field.within(region(draw, 2));
    }
    field = match draw.below(16) {
        0 => field.limited_to(draw.size()),
        2 => field.coupled_to(Coupling::Each),
        3 => field.coupled_to_axis(draw.of(&["mass", "radius", "charge", "speed"])),
        4 => field.sampled(draw.of(&[
            Sampling::Centre,
            Sampling::Parts,
            Sampling::Volume,
            Sampling::Surface,
        ])),
        5 => field.sampled(Sampling::Volume),
        6 => field.strength(draw.number()),
        7 => field.enabled(false),
        8 => field.force_mode(ForceMode::VelocityChange),
        9 => field.scaled_by(Scalar::time()),
        _ => field,
    };
    anchored(draw, field, carriers)
}

/// A random tree of at most this depth.
pub fn tree(draw: &mut Draw, world: &PhysicsWorld, depth: usize) -> Tree {
    let carriers = Carriers {
        bodies: world.bodies.iter().map(|it| it.0).collect(),
        colliders: world.colliders.iter().map(|it| it.0).collect(),
    };
    of(draw, &carriers, depth)
}

fn of(draw: &mut Draw, carriers: &Carriers, depth: usize) -> Tree {
    if depth == 0 || draw.once_in(4) {
        return leaf(draw, carriers).into();
    }
    match draw.below(10) {
        0 if !carriers.bodies.is_empty() => {
            let prototype = leaf(draw, carriers).at(Anchor::WORLD);
            Tree::instances(prototype, carriers.bodies.iter().copied())
        }
        1 => {
            let layers = (0..3).map(|n| Layer::new(of(draw, carriers, depth - 1)).priority(n));
            let layers: Vec<_> = layers.collect();
            let last = draw.below(3);
            let kind = draw.below(3);
            Tree::layers(layers.into_iter().enumerate().map(|(n, layer)| match kind {
                0 if n == last => layer.replacing(),
                1 if n == last => layer.stopping(),
                _ => layer,
            }))
        }
        2 => of(draw, carriers, depth - 1).limited_to(draw.size()),
        3 => of(draw, carriers, depth - 1).scaled_by(draw.number()),
        _ => {
            let operator = draw.of(&Operator::ALL);
            let count = if operator.is_associative() {
                1 + draw.below(4)
            } else {
                2
            };
            Tree::fold(
                operator,
                (0..count)
                    .map(|_| of(draw, carriers, depth - 1))
                    .collect::<Vec<_>>(),
            )
        }
    }
}

fn law(draw: &mut Draw) -> ContactLaw {
    match draw.below(6) {
        0 => ContactLaw::Observe,
        1 => ContactLaw::Paper,
        2 => ContactLaw::PaperRelative,
        3 => ContactLaw::Penalty {
            stiffness: draw.between(0.0, 1e4),
            damping: draw.between(0.0, 10.0),
        },
        4 => ContactLaw::elastic(),
        _ => ContactLaw::restitution(draw.between(0.0, 1.0)).with_friction(draw.between(0.0, 1.0)),
    }
}

pub fn scheme(draw: &mut Draw) -> Scheme {
    let tolerance: Real = draw.of(&[1e-2, 1e-4, 0.1]);
    match draw.below(10) {
        0..3 => Scheme::KickDriftKick,
        3 => Scheme::Kick,
        4 => Scheme::ExternalForce,
        5 => Scheme::Substep(Substeps::Fixed(1 + draw.below(6) as u32)),
        6 => Scheme::Substep(Substeps::PerBody { tolerance }),
        7 => Scheme::LinearlyImplicit,
        8 => Scheme::Forward4,
        _ => Scheme::Auto { tolerance },
    }
}

pub fn fields(draw: &mut Draw, world: &PhysicsWorld) -> (Tree, FieldSettings) {
    let depth = draw.below(4);
    let mut tree = tree(draw, world, depth);
    if draw.once_in(3) {
        let law = law(draw);
        let touch = world
            .colliders
            .iter()
            .map(|it| it.0)
            .filter(|_| !draw.once_in(3));
        let touch: Vec<_> = touch.map(|part| Field::contact(law).at(part)).collect();
        if !touch.is_empty() {
            tree = tree.sum_union(Tree::fold(Operator::SumUnion, touch));
        }
    }
    let mut settings = FieldSettings::default();
    settings.scheme = scheme(draw);
    settings.detection = draw.of(&[Detection::Discrete, Detection::Swept]);
    settings.on_fault = draw.of(&[
        FaultPolicy::LeaveOut,
        FaultPolicy::Quarantine,
        FaultPolicy::Refuse,
    ]);
    settings.audit = draw.once_in(8);
    if draw.once_in(8) {
        settings.cross_check = CrossCheck::all();
    }
    (tree, settings)
}
