//! Bodies that are sampled over their volume, and over their surface.

use std::f64::consts::{PI, TAU};

use crate::lab::random::Random;
use rapier3d_fields::math::{DVec3, Rotation, SharedShape, from_dvec3, from_f64, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::{assert_at_most, assert_close, either, largest, weightless};

/// A weightless world of one body, which never sleeps.
pub fn one(
    position: Vector,
    rotation: Rotation,
    collider: ColliderBuilder,
) -> (PhysicsWorld, RigidBodyHandle) {
    let mut world = weightless(1.0 / 240.0);
    let body = RigidBodyBuilder::dynamic()
        .pose(Pose::from_parts(position, rotation))
        .can_sleep(false);
    let (body, _) = world.insert(body, collider);
    let (bodies, colliders) = (&mut world.bodies, &world.colliders);
    bodies[body].recompute_mass_properties_from_colliders(colliders);
    (world, body)
}

pub fn wrench(fields: &mut Fields, world: &PhysicsWorld, body: RigidBodyHandle) -> (DVec3, DVec3) {
    let wrench = fields.sample(body, world);
    let wrench = wrench.expect("finite").expect("sampled");
    (to_dvec3(wrench.force), to_dvec3(wrench.torque))
}

pub fn shapes() -> Vec<(&'static str, SharedShape)> {
    let slanted = [
        [0.0, 0.0, 0.0],
        [2.0, 0.3, 0.1],
        [0.2, 1.0, 0.0],
        [0.1, 0.2, 0.8],
    ];
    let slanted = SharedShape::convex_hull(&slanted.map(Vector::from_array)).expect("a hull");
    let part = (Pose::from_translation(Vector::X), SharedShape::ball(0.4));
    let other = (
        Pose::from_translation(Vector::Y),
        SharedShape::cuboid(0.5, 0.3, 0.2),
    );
    vec![
        ("ball", SharedShape::ball(0.7)),
        ("cuboid", SharedShape::cuboid(1.0, 0.5, 0.25)),
        ("long bar", SharedShape::cuboid(5.0, 0.2, 0.1)),
        ("plate", SharedShape::cuboid(2.0, 0.01, 2.0)),
        ("cylinder", SharedShape::cylinder(0.8, 0.5)),
        ("cone", SharedShape::cone(0.8, 0.5)),
        ("capsule", SharedShape::capsule_y(0.8, 0.5)),
        ("round cylinder", SharedShape::round_cylinder(0.8, 0.5, 0.1)),
        ("tetrahedron", slanted),
        ("compound", SharedShape::compound(vec![part, other])),
    ]
}

/// Both rules, of at least 27 points and of 4 for linear fields, keep the moments of Parry's mass properties.
#[test]
fn volume_samples_have_the_moments_of_the_shape() {
    for (name, shape) in shapes() {
        let collider = ColliderBuilder::new(shape).density(1.0);
        let (world, body) = one(Vector::ZERO, Rotation::IDENTITY, collider);
        for (power, fewest, most) in [(2.0, 27, usize::MAX), (1.0, 4, 4)] {
            let pull = Field::radial(1.0, power).sampled(Sampling::Volume);
            let fields = Fields::new(pull).expect("a sound tree");
            let samples = fields.samples(body, &world);
            let samples: Vec<_> = samples
                .iter()
                .filter(|s| s.sampling == Sampling::Volume)
                .collect();
            let count = samples.len();
            assert!((fewest..=most).contains(&count), "{name}: {count}");
            let properties = &world.bodies[body].mass_properties().local_mprops;
            let (com, mass) = (to_dvec3(properties.local_com), to_f64(properties.mass()));
            let inertia = properties.reconstruct_inertia_matrix();
            let size = to_f64(inertia.x_axis.x.max(inertia.y_axis.y).max(inertia.z_axis.z)) / mass;
            let sum: f64 = samples.iter().map(|s| s.query.fraction).sum();
            let first: DVec3 = samples
                .iter()
                .map(|s| (s.query.world_point - com) * s.query.fraction)
                .sum();
            let rounding = either(3e-6, 1e-9);
            assert_close(sum, 1.0, rounding, name);
            assert_at_most(first.length(), rounding * size.sqrt(), name);
            for (axis, column) in [
                (DVec3::X, inertia.x_axis),
                (DVec3::Y, inertia.y_axis),
                (DVec3::Z, inertia.z_axis),
            ] {
                let turned = samples.iter().map(|s| {
                    let arm = s.query.world_point - com;
                    (axis * arm.length_squared() - arm * arm.dot(axis)) * s.query.fraction
                });
                let error = turned.sum::<DVec3>() - to_dvec3(column) / mass;
                assert_at_most(error.length(), rounding * size, format!("{name}: inertia"));
            }
        }
    }
}

/// A limit that is never reached makes a copy of each field be sampled at many points.
#[test]
fn linear_forces_sum_alike_at_few_and_at_many_points() {
    let mut random = Random::new(31);
    let mut vector = |size: f64| from_dvec3(random.unit_vector() * size);
    for (name, shape) in shapes() {
        for sampling in [Sampling::Auto, Sampling::Volume, Sampling::Surface] {
            let collider = ColliderBuilder::new(shape.clone()).density(1.0);
            let local_pose = Pose::new(vector(0.5), vector(2.0));
            let at = Rotation::from_scaled_axis(vector(2.0));
            let (mut world, body) = one(vector(3.0), at, collider.position(local_pose));
            world.bodies[body].set_linvel(vector(2.0), true);
            world.bodies[body].set_angvel(vector(3.0), true);
            let carrier = RigidBodyBuilder::kinematic_velocity_based();
            let carrier = carrier.linvel(vector(1.0)).angvel(vector(1.0));
            let carrier = world.bodies.insert(carrier);
            let fields = [
                Field::drag(0.7, 0.0),
                Field::drag(0.7, 0.0).at(carrier),
                Field::wind(vector(4.0), 0.3, 0.0).force_mode(ForceMode::Acceleration),
                Field::spring(2.0).at(vector(1.0)),
                Field::radial(-2.0, 1.0)
                    .coupled_to(Coupling::Each)
                    .at(carrier),
                Field::magnetic(vector(2.0)),
                // Not linear in the position, so sampled at all points.
                Field::drag(0.7, 0.0).coupled_to_axis(Axis::X),
                Field::uniform(vector(1.0)).coupled_to_axis(Axis::Distance),
            ];
            for field in fields {
                let field = field.sampled(sampling);
                let mut few = Fields::new(field.clone()).expect("a sound tree");
                let tree = Tree::from(field.clone()).limited_to(1e6);
                let limited = Fields::new(tree).expect("a sound tree");
                let mut many = Fields::new(field.limited_to(1e6)).expect("a sound tree");
                let count = |fields: &Fields| {
                    let samples = fields.samples(body, &world);
                    samples.len()
                };
                assert!(count(&few) <= count(&many), "{name}");
                assert_eq!(count(&limited), count(&many), "{name}: a limited tree");
                let (few, many) = (
                    wrench(&mut few, &world, body),
                    wrench(&mut many, &world, body),
                );
                let size = many.0.length() + many.1.length() + 1.0;
                let error = (few.0 - many.0).length() + (few.1 - many.1).length();
                let place = format!("{name}, {sampling:?}: {few:?} and {many:?}");
                assert_at_most(error, either(2e-5, 1e-11) * size, place);
            }
        }
    }
}

/// The integral of x² over known surfaces; facets of the mesh cost 0.1 %.
#[test]
fn surface_samples_have_the_area_and_moments_of_the_surface() {
    let (r, h) = (0.5, 0.8);
    // ⟨x²⟩: r⁴π/4 from each cap, r²/2 times the area of the mantle; ⟨y²⟩: from the caps, and along the mantle.
    let area = 2.0 * PI * r * r + 4.0 * PI * r * h;
    let x2 = (2.0 * PI * r.powi(4) / 4.0 + 4.0 * PI * r * h * r * r / 2.0) / area;
    let y2 = (2.0 * PI * r * r * h * h + 4.0 * PI * r * h * h * h / 3.0) / area;
    let cube = (1.0 + 2.0 / 3.0) / 3.0;
    let cases = [
        (
            SharedShape::cylinder(from_f64(h), from_f64(r)),
            DVec3::new(x2, y2, x2),
            1.5e-3,
        ),
        (SharedShape::cuboid(1.0, 1.0, 1.0), DVec3::splat(cube), 1e-6),
        (SharedShape::ball(2.0), DVec3::splat(4.0 / 3.0), 1e-6),
    ];
    // Linear drag is sampled at few points, quadratic drag at all.
    let twice = cases.iter().flat_map(|case| [0.0, 0.5].map(|c| (case, c)));
    for ((shape, second, relative), quadratic) in twice {
        let (second, relative) = (*second, *relative);
        let (world, body) = one(
            Vector::ZERO,
            Rotation::IDENTITY,
            ColliderBuilder::new(shape.clone()),
        );
        let tree = Field::drag(1.0, quadratic).sampled(Sampling::Surface);
        let fields = Fields::new(tree).expect("a sound tree");
        let samples = fields.samples(body, &world);
        let surface = samples.iter().filter(|s| s.sampling == Sampling::Surface);
        let found: DVec3 = surface
            .map(|s| s.query.world_point * s.query.world_point * s.query.fraction)
            .sum();
        let error = ((found - second) / second).length();
        assert_at_most(error, relative, format!("{found} and {second}"));
    }
}

/// The reference's forces, summed over the samples of each kind, are the wrench of the evaluators.
#[test]
fn evaluators_agree_with_the_reference_over_the_samples() {
    let mut random = Random::new(5);
    let kinds = [
        Sampling::Centre,
        Sampling::Parts,
        Sampling::Volume,
        Sampling::Surface,
    ];
    for (name, shape) in shapes() {
        for asked in kinds {
            let position = from_dvec3(random.unit_vector() * 3.0);
            let rotation = Rotation::from_scaled_axis(from_dvec3(random.unit_vector()));
            let (mut world, body) = one(position, rotation, ColliderBuilder::new(shape.clone()));
            world.bodies[body].set_angvel(Vector::new(0.3, -0.2, 0.9), true);
            let pull = Field::point_gravity(4.0).sampled(asked);
            let zone = Field::vortex(2.0, 0.0)
                .smoothed(0.5)
                .within(Region::ball(3.0));
            let wind = Field::drag(0.4, 0.2).sampled(asked);
            let terms = [pull, zone.sampled(asked), wind];
            let tree = Tree::fold(Operator::SumUnion, terms.clone());
            let mut fields = Fields::new(tree.clone()).expect("a sound tree");
            let (force, torque) = wrench(&mut fields, &world, body);
            let frames = WorldRef::from(&world);
            let reference = Reference::new(&tree).expect("a sound tree");
            let com = to_dvec3(world.bodies[body].center_of_mass());
            let (mut sum, mut turn, mut size) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for sample in fields.samples(body, &world) {
                if sample.sampling != asked {
                    continue;
                }
                let force = reference
                    .force(&frames, &sample.query)
                    .unwrap_or(DVec3::ZERO);
                sum += force;
                turn += (sample.query.world_point - com).cross(force);
                size += force.length();
            }
            let bound = either(1e-5, 1e-13) * size.max(1e-3) * 10.0;
            assert!(size > 0.0, "{name}, {asked:?}");
            assert_at_most((force - sum).length(), bound, format!("{name}, {asked:?}"));
            assert_at_most(
                (torque - turn).length(),
                bound,
                format!("{name}, {asked:?}: torque"),
            );
        }
    }
}

#[test]
fn uniform_fields_turn_nothing() {
    for (name, shape) in shapes() {
        let (world, body) = one(Vector::X, Rotation::IDENTITY, ColliderBuilder::new(shape));
        let zone = Field::uniform(Vector::Z).within(Region::ball(9.0));
        let mut fields = Fields::new(zone).expect("a sound tree");
        let (force, torque) = wrench(&mut fields, &world, body);
        assert_eq!((force, torque), (DVec3::Z, DVec3::ZERO), "{name}");
    }
}

/// Balls are sampled once, at their centre; fields that ask for the volume or the surface get more points.
#[test]
fn balls_are_sampled_once_unless_fields_ask_for_more() {
    let (world, body) = one(
        Vector::X * 3.0,
        Rotation::IDENTITY,
        ColliderBuilder::ball(1.0),
    );
    let count = |field: Field| {
        let fields = Fields::new(field).expect("a sound tree");
        fields.samples(body, &world).len()
    };
    let drag = || Field::drag(1.0, 0.0);
    assert_eq!(count(drag()), 2, "the centre and the site");
    assert_eq!(count(Field::point_gravity(1.0)), 2);
    assert_eq!(count(drag().sampled(Sampling::Surface)), 2 + 4);
    let quadratic = Field::drag(1.0, 0.5).sampled(Sampling::Surface);
    assert_eq!(count(quadratic), 2 + 6);
    // By Newton's shell theorem; the error of the rule is of fourth order in size/distance.
    let pull = Field::point_gravity(9.0);
    let force = |field: Field| wrench(&mut Fields::new(field).expect("sound"), &world, body).0;
    let mass = to_f64(world.bodies[body].mass());
    let exact = DVec3::NEG_X * mass;
    assert_at_most(
        (force(pull.clone()) - exact).length(),
        1e-6 * mass,
        "at the centre",
    );
    let over = force(pull.sampled(Sampling::Volume));
    assert_at_most((over - exact).length(), mass / 81.0, "over the volume");
    assert_ne!(over, exact);
}

/// Gravity turns a bar towards the line to the attractor: 3 μ/r³ (I₁ − I₃) sin θ cos θ, with a relative error of order
/// (size/r)².
#[test]
fn tide_turns_a_bar() {
    let (mu, r, half) = (50.0, 40.0, 1.0_f64);
    let shapes = [
        ("bar", SharedShape::cuboid(1.0, 0.1, 0.1)),
        ("cylinder", SharedShape::cylinder(1.0, 0.1)),
        ("capsule", SharedShape::capsule_y(1.0, 0.1)),
    ];
    for (name, shape) in shapes {
        for angle in [0.3, 0.7, 1.2] {
            let turned = Rotation::from_rotation_z(angle);
            let place = Vector::X * from_f64(r);
            let (world, body) = one(place, turned, ColliderBuilder::new(shape.clone()));
            let mut fields = Fields::new(Field::point_gravity(from_f64(mu))).expect("sound");
            let (_, torque) = wrench(&mut fields, &world, body);
            let inertia = world.bodies[body]
                .mass_properties()
                .local_mprops
                .principal_inertia();
            // The long axis has the least inertia; the angle is between it and x.
            let difference = to_f64(inertia.z - inertia.x.min(inertia.y));
            let along_x = inertia.x < inertia.y;
            let angle = to_f64(angle) + if along_x { 0.0 } else { PI / 2.0 };
            let exact = -3.0 * mu / r.powi(3) * difference * angle.sin() * angle.cos();
            let relative = (torque.z - exact).abs() / exact.abs();
            println!("tide on a {name}: relative error {relative:.1e}");
            assert_at_most(relative, 3.0 * (half / r).powi(2) + either(2e-3, 0.0), name);
        }
    }
}

/// The share of a cuboid that is inside x < 0, and the first moment of that part about the cuboid's middle: in units of
/// the edges, with n·u < t for 0 ≤ u ≤ 1, ∫ du = Σ ± (t − n·v)₊³/(6 n₁ n₂ n₃) over the corners v, and likewise ∫ uᵢ du.
pub fn cuboid_in_half_space(half: DVec3, at: DVec3, turn: Rotation) -> (f64, DVec3) {
    let axes = [Vector::X, Vector::Y, Vector::Z].map(|axis| to_dvec3(turn * axis));
    // Edges are taken to point along +x.
    let edges = [0, 1, 2].map(|k| axes[k] * (2.0 * half[k] * axes[k].x.signum()));
    let n = DVec3::new(edges[0].x, edges[1].x, edges[2].x);
    let lowest = at - (edges[0] + edges[1] + edges[2]) * 0.5;
    let t = -lowest.x;
    let (mut share, mut first) = (0.0, DVec3::ZERO);
    for corner in 0..8_usize {
        let v = DVec3::new(0.0, 1.0, 2.0).map(|k| (corner >> k as usize & 1) as f64);
        let sign = if corner.count_ones() % 2 == 0 {
            1.0
        } else {
            -1.0
        };
        let above = (t - n.dot(v)).max(0.0);
        share += sign * above.powi(3) / 6.0;
        first += (v * above.powi(3) / 6.0 + above.powi(4) / (24.0 * n)) * sign;
    }
    let product = n.element_product();
    let (share, first) = (share / product, first / product - 0.5 * share / product);
    (
        share,
        edges[0] * first.x + edges[1] * first.y + edges[2] * first.z,
    )
}

#[test]
fn a_bar_half_in_the_wind_gets_half_the_force() {
    for shape in [
        SharedShape::cuboid(2.0, 0.5, 0.5),
        SharedShape::cylinder(2.0, 0.5),
        SharedShape::ball(1.0),
    ] {
        let is_x = shape.as_cuboid().is_some();
        let middle = if let Some(ball) = shape.as_ball() {
            3.0 / 8.0 * to_f64(ball.radius)
        } else {
            1.0
        };
        let axis = if is_x { Vector::X } else { Vector::Y };
        let zone = Region::half_space(axis, 0.0);
        let wind = Field::uniform(Vector::Z * 3.0).within(zone);
        let (world, body) = one(
            Vector::ZERO,
            Rotation::IDENTITY,
            ColliderBuilder::new(shape),
        );
        let mut fields = Fields::new(wind).expect("a sound tree");
        let (force, torque) = wrench(&mut fields, &world, body);
        let lever = to_dvec3(axis).cross(DVec3::Z) * -middle * 1.5;
        println!("half in the wind: {force}, {torque} (exact {lever})");
        let error = (force - DVec3::Z * 1.5).length();
        assert_at_most(error, 0.015 * 1.5, "force");
        let error = (torque - lever).length();
        assert_at_most(error, 0.01 * lever.length(), "torque");
    }
}

/// Linear drag c over the surface of a box: c ⟨x² + y²⟩ over the surface slows its spin about z.
#[test]
fn surface_drag_slows_a_spin() {
    let collider = ColliderBuilder::cuboid(1.0, 1.0, 1.0);
    let (mut world, body) = one(Vector::ZERO, Rotation::IDENTITY, collider.clone());
    world.bodies[body].set_angvel(Vector::Z * 2.0, true);
    let c = 0.8;
    let mut fields = Fields::new(Field::drag(from_f64(c), 0.0)).expect("a sound tree");
    let (_, torque) = wrench(&mut fields, &world, body);
    assert_close(
        torque.z,
        -c * 2.0 * 10.0 / 9.0,
        either(1e-6, 1e-12),
        "torque",
    );
    // ⟨x²⟩ over the surface of the cube: (1 + 2/3)/3.
    let inertia = to_f64(world.bodies[body].mass()) * 2.0 / 3.0;
    let exact = 2.0 * (-c * 2.0 * (5.0 / 9.0) / inertia).exp();
    let slowed = |steps: usize| {
        let (mut world, body) = one(Vector::ZERO, Rotation::IDENTITY, collider.clone());
        world.integration_parameters.dt = (steps as Real).recip();
        world.bodies[body].set_angvel(Vector::Z * 2.0, true);
        let mut fields = Fields::new(Field::drag(from_f64(c), 0.0)).expect("a sound tree");
        (0..steps).for_each(|_| {
            fields.step(&mut world).expect("finite");
        });
        to_f64(world.bodies[body].angvel().z)
    };
    for steps in [15, 60, 240] {
        let error = (slowed(steps) - exact).abs();
        println!("spin after 1 s in {steps} steps: error {error:.1e}");
        // Of second order in the step, and the roundings of every step.
        let order = 1e-4 * (15.0 / steps as f64).powi(2);
        assert_at_most(error, order + either(1e-6 * steps as f64, 0.0), "spin");
    }
}

const WATER: f64 = 1000.0;
const G: f64 = 9.81;

fn water() -> Tree {
    let weight = Field::uniform(Vector::Y * from_f64(-G)).force_mode(ForceMode::Acceleration);
    let lift = Field::buoyancy(from_f64(WATER), from_f64(G));
    weight.sum_union(lift)
}

/// The period of small heave: 2π √(m/(ρ g A)).
fn heave_period(shape: SharedShape, density: f64, rest: f64, amplitude: f64) -> f64 {
    let collider = ColliderBuilder::new(shape).density(from_f64(density));
    let place = Vector::Y * from_f64(rest + amplitude);
    let (mut world, body) = one(place, Rotation::IDENTITY, collider);
    let mut fields = Fields::new(water()).expect("a sound tree");
    let (mut crossings, mut last) = (Vec::new(), amplitude);
    for step in 1..=4000 {
        fields.step(&mut world).expect("finite");
        let y = to_f64(world.bodies[body].translation().y) - rest;
        if last > 0.0 && y <= 0.0 {
            crossings.push((step as f64 - 1.0 + last / (last - y)) / 240.0);
        }
        last = y;
        if crossings.len() == 4 {
            break;
        }
    }
    (crossings[3] - crossings[0]) / 3.0
}

#[test]
fn cuboids_and_balls_float_at_their_depth_and_heave_in_their_period() {
    for density in [300.0, 500.0, 800.0] {
        // A cube of edge 2 floats with its middle where the part below the surface displaces its weight.
        let rest = 1.0 - 2.0 * density / WATER;
        let place = Vector::Y * from_f64(rest);
        let collider = ColliderBuilder::cuboid(1.0, 1.0, 1.0).density(from_f64(density));
        let (world, body) = one(place, Rotation::IDENTITY, collider);
        let mut fields = Fields::new(water()).expect("a sound tree");
        let (force, _) = wrench(&mut fields, &world, body);
        let off = force.y / (WATER * G * 4.0);
        println!("cube of density {density}: floats {off:.3} off its depth");
        assert_at_most(off.abs(), 0.06, "depth");
        let exact = TAU * (8.0 * density / (WATER * G * 4.0)).sqrt();
        let found = heave_period(SharedShape::cuboid(1.0, 1.0, 1.0), density, rest, 0.05);
        println!("cube of density {density}: period {found:.4}, exact {exact:.4}");
        assert_at_most((found / exact - 1.0).abs(), 0.05, "period");
    }
    // A ball of half the density floats half way in; A = π r².
    let exact = TAU * (4.0 / 3.0 * 500.0 / (WATER * G)).sqrt();
    let found = heave_period(SharedShape::ball(1.0), 500.0, 0.0, 0.02);
    println!("ball: period {found:.5}, exact {exact:.5}");
    assert_at_most((found / exact - 1.0).abs(), 1e-3, "period of a ball");
}

/// A flat raft: the metacentre is far above, so a tilt of θ meets the torque ρ g (I_A − V d) sin θ.
#[test]
fn a_tilted_raft_rights_itself() {
    let half = DVec3::new(2.0, 0.25, 1.0);
    let density = 500.0;
    let tilt = 0.05_f64;
    let turned = Rotation::from_rotation_z(from_f64(tilt));
    let raft = || {
        let shape = ColliderBuilder::cuboid(from_f64(half.x), from_f64(half.y), from_f64(half.z));
        shape.density(from_f64(density))
    };
    let (world, body) = one(Vector::ZERO, turned, raft());
    let mut fields = Fields::new(water()).expect("a sound tree");
    let (_, torque) = wrench(&mut fields, &world, body);
    // I_A = ∫ x² over the waterline; V of the submerged half, whose middle is a quarter deep.
    let waterline = 2.0 * half.z * (2.0 * half.x).powi(3) / 12.0;
    let (volume, depth) = (half.element_product() * 4.0, half.y * 0.5);
    let exact = -WATER * G * (waterline - volume * depth) * tilt.sin();
    println!("righting torque {:.1}, exact {exact:.1}", torque.z);
    assert_at_most((torque.z / exact - 1.0).abs(), 0.15, "righting torque");
    // With drag the raft comes to rest flat.
    let (mut world, body) = one(Vector::ZERO, Rotation::from_rotation_z(0.3), raft());
    let tree = water().sum_union(Field::drag(4000.0, 0.0));
    let mut fields = Fields::new(tree).expect("a sound tree");
    for _ in 0..2400 {
        fields.step(&mut world).expect("finite");
    }
    let up = to_dvec3(*world.bodies[body].rotation() * Vector::Y);
    println!("after 10 s the raft's up is {up}");
    assert_at_most(1.0 - up.y, 1e-3, "flat");
}

/// A body's own sampling applies to fields that set none, and does not override fields that set one.
#[test]
fn a_bodys_sampling_applies_to_fields_that_set_none() {
    let (world, body) = one(
        Vector::X * 3.0,
        Rotation::IDENTITY,
        ColliderBuilder::cuboid(1.0, 0.2, 0.2),
    );
    let pull = Field::point_gravity(9.0);
    let force = |field: &Field, own: Option<Sampling>| {
        let mut fields = Fields::new(field.clone()).expect("a sound tree");
        fields
            .set_sampling(body, own, &world.bodies)
            .expect("it is there");
        wrench(&mut fields, &world, body)
    };
    let at = |sampling| force(&pull.clone().sampled(sampling), None);
    for own in [
        Sampling::Centre,
        Sampling::Parts,
        Sampling::Volume,
        Sampling::Surface,
    ] {
        let ((force, torque), (asked, turn)) = (force(&pull, Some(own)), at(own));
        let rounding = either(1e-6, 1e-14);
        assert_at_most((force - asked).length(), rounding, format!("{own:?}"));
        assert_at_most(
            (torque - turn).length(),
            rounding,
            format!("{own:?}: torque"),
        );
    }
    for own in [Sampling::Centre, Sampling::Volume] {
        let fixed = pull.clone().sampled(Sampling::Parts);
        assert_eq!(force(&fixed, Some(own)), at(Sampling::Parts), "{own:?}");
    }
    assert_eq!(force(&pull, None), at(Sampling::Volume));
    assert_ne!(at(Sampling::Volume), at(Sampling::Parts));
    let sites = Field::lennard_jones(1.0, 1.0);
    assert_eq!(force(&sites, Some(Sampling::Volume)), force(&sites, None));
}

#[test]
fn a_body_that_is_gone_is_refused() {
    let (mut world, body) = one(Vector::ZERO, Rotation::IDENTITY, ColliderBuilder::ball(1.0));
    world.remove_body(body);
    let mut fields = Fields::new(Field::uniform(Vector::X)).expect("a sound tree");
    let set = fields.set_sampling(body, Sampling::Volume, &world.bodies);
    assert_eq!(set, Err(PropertyError::NoSuchBody { body }));
}

/// A shape that is changed in place is sampled anew.
#[test]
fn changed_shapes_are_noticed() {
    let (mut world, body) = one(
        Vector::X * 3.0,
        Rotation::IDENTITY,
        ColliderBuilder::cuboid(1.0, 0.2, 0.2),
    );
    let mut fields = Fields::new(Field::point_gravity(9.0)).expect("a sound tree");
    let extent = |fields: &mut Fields, world: &PhysicsWorld| {
        let samples = fields.samples(body, world);
        largest(samples.iter().map(|s| (s.query.world_point.x - 3.0).abs()))
    };
    let before = extent(&mut fields, &world);
    let collider = world.bodies[body].colliders()[0];
    let shape = world.colliders[collider].shape_mut();
    shape.as_cuboid_mut().expect("a cuboid").half_extents.x = 2.0;
    let after = extent(&mut fields, &world);
    assert_close(after, 2.0 * before, 1e-5, "twice as long");
}
