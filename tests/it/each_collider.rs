//! A field acts on each collider of a body by the properties of that collider, however the body is sampled: collision
//! groups, charge, mass, radius, user axes, functions.
//!
//! The expected wrench is that of `Reference` for the field without the filter, at the samples of the colliders that
//! the filter admits.

use rapier3d_fields::Wrench;
use rapier3d_fields::math::{DVec3, to_dvec3};
use rapier3d_fields::pipeline::BodySample;
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

use crate::support::{assert_at_most, either, weightless};

/// A condition by which a field acts on one of two colliders only.
type Filter = (&'static str, fn(Field) -> Field);

pub(crate) const IRON: Group = Group::GROUP_1;
const WOOD: Group = Group::GROUP_2;

pub(crate) fn groups(of: Group) -> InteractionGroups {
    InteractionGroups::new(of, Group::ALL, Default::default())
}

pub(crate) fn only_iron(field: Field) -> Field {
    field.groups(InteractionGroups::new(Group::ALL, IRON, Default::default()))
}

/// Each admits the first collider of [`dumbbell`] and not the second.
const FILTERS: [Filter; 10] = [
    ("groups", only_iron),
    ("charge", |field| {
        within(field, Region::interval(Axis::Charge, 0.5, 2.0))
    }),
    ("mass", |field| {
        within(field, Region::interval(Axis::Mass, 0.0, 2.0))
    }),
    ("radius", |field| {
        within(field, Region::interval(Axis::Radius, 0.0, 0.6))
    }),
    ("a user's axis", |field| {
        within(field, Region::interval("delta", 0.5, 1.5))
    }),
    ("a half-space over axes", |field| {
        let coefficients = [(Axis::named("delta"), 1.0), (Axis::Charge, -1.0)];
        within(field, Region::half_space_over(coefficients, 1.0))
    }),
    ("a ball over axes", |field| {
        within(field, Region::ball_over([(Axis::Charge, 1.0, 0.5)]))
    }),
    ("a predicate", |field| {
        within(field, Region::predicate([], |sample| sample.charge > 0.0))
    }),
    ("a scale over an axis", |field| {
        field.scaled_by(Scalar::axis("delta").ramp(5.0, 1.0))
    }),
    ("a scale by a function", |field| {
        let is_iron = |sample: &Sample<'_>| if sample.charge > 0.0 { 1.0 } else { 0.0 };
        field.scaled_by(Scalar::closure([], is_iron))
    }),
];

/// The field within both its own region and another one.
pub(crate) fn within(field: Field, region: Region) -> Field {
    let both = field.region.clone().intersection(region);
    field.within(both)
}

/// Two cubes on one body: of iron, with charge 1 and δ = 1, and a larger one of wood, with charge −1 and
/// δ = 5. It turns, so that its parts have velocities of their own.
pub(crate) fn dumbbell() -> (PhysicsWorld, RigidBodyHandle, [ColliderHandle; 2]) {
    let mut world = weightless(1.0 / 64.0);
    let body = RigidBodyBuilder::dynamic()
        .translation(Vector::new(0.5, 2.0, -0.25))
        .linvel(Vector::new(0.25, -0.5, 0.125))
        .angvel(Vector::new(0.5, 0.25, -1.0))
        .can_sleep(false);
    let body = world.bodies.insert(body);
    let mut part = |x: Real, half: Real, mass: Real, group: Group| {
        let collider = ColliderBuilder::cuboid(half, half, half)
            .translation(Vector::X * x)
            .mass(mass)
            .collision_groups(groups(group));
        let (bodies, colliders) = (&mut world.bodies, &mut world.colliders);
        colliders.insert_with_parent(collider, body, bodies)
    };
    let parts = [part(-1.0, 0.25, 1.0, IRON), part(1.0, 0.5, 3.0, WOOD)];
    let (bodies, colliders) = (&mut world.bodies, &world.colliders);
    bodies[body].recompute_mass_properties_from_colliders(colliders);
    (world, body, parts)
}

pub(crate) fn fields(tree: impl Into<Tree>, parts: [ColliderHandle; 2]) -> Fields {
    let fields = Fields::builder(tree).axis("delta", 7.0).build();
    let mut fields = fields.expect("a sound tree");
    for (collider, charge, delta) in [(parts[0], 1.0, 1.0), (parts[1], -1.0, 5.0)] {
        let properties = ColliderProperties::new()
            .charge(charge)
            .axis("delta", delta);
        let set = fields.set.set_properties(collider, properties);
        set.expect("sound properties");
    }
    fields
}

/// All laws that may be sampled anywhere, the presets among them.
pub(crate) fn laws() -> Vec<(&'static str, Field)> {
    let everywhere = || Region::ball(50.0);
    vec![
        ("uniform", Field::uniform(Vector::new(1.0, -2.0, 3.0))),
        (
            "gravity zone",
            Field::gravity_zone(Vector::Y * 4.0, everywhere()),
        ),
        (
            "wind zone",
            Field::wind_zone(Vector::X * 3.0, 0.5, 0.25, everywhere()),
        ),
        (
            "conveyor",
            Field::conveyor(Vector::X * 2.0, 4.0, everywhere()),
        ),
        ("magnet", Field::magnet(3.0, 0.5, 50.0)),
        ("explosion", Field::explosion(3.0, 50.0)),
        ("point gravity", Field::point_gravity(4.0)),
        ("vortex", Field::vortex(2.0, -1.0).smoothed(0.5)),
        ("drag", Field::drag(0.5, 0.25)),
        (
            "closure",
            Field::closure([], |sample| sample.local_point * 0.5),
        ),
    ]
}

pub(crate) const SAMPLINGS: [Sampling; 5] = [
    Sampling::Auto,
    Sampling::Centre,
    Sampling::Parts,
    Sampling::Volume,
    Sampling::Surface,
];

/// The kind of samples that a law takes if `asked` is its sampling.
pub(crate) fn kind(law: &str, asked: Sampling) -> Sampling {
    match asked {
        Sampling::Auto if matches!(law, "wind zone" | "drag") => Sampling::Surface,
        Sampling::Auto => Sampling::Volume,
        other => other,
    }
}

/// The force and torque of a tree on the given samples, by `Reference`.
pub(crate) fn literal<'a>(
    tree: &Tree,
    world: &PhysicsWorld,
    body: RigidBodyHandle,
    samples: impl Iterator<Item = &'a BodySample>,
) -> [DVec3; 2] {
    let reference = Reference::new(tree).expect("a sound tree");
    let frames = WorldRef::from(world);
    let com = to_dvec3(world.bodies[body].center_of_mass());
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for sample in samples {
        let one = reference
            .force(&frames, &sample.query)
            .unwrap_or(DVec3::ZERO);
        force += one;
        torque += (sample.query.world_point - com).cross(one);
    }
    [force, torque]
}

pub(crate) fn agree(found: Wrench, expected: [DVec3; 2], place: &str) {
    let size = expected[0].length().max(expected[1].length()).max(1.0);
    let bound = either(2e-5, 1e-12) * size;
    let [force, torque] = expected;
    assert_at_most(
        (to_dvec3(found.force) - force).length(),
        bound,
        format!("{place}: force"),
    );
    assert_at_most(
        (to_dvec3(found.torque) - torque).length(),
        bound,
        format!("{place}: torque"),
    );
}

/// Regression: on a body sampled at its centre, fields whose groups exclude it acted in full; a region over a user axis
/// read the world's value there, and one over charge the sum of the charges. Each collider must count by itself, under
/// every sampling of the field or of the body, in `sample` and in `explain`.
#[test]
fn fields_act_only_on_the_colliders_they_admit() {
    let (world, body, parts) = dumbbell();
    for (law, field) in laws() {
        for asked in SAMPLINGS {
            // Whether the sampling is set for the body and not for the field.
            for of_body in [false, true] {
                if of_body && (asked == Sampling::Auto || law == "conveyor") {
                    continue;
                }
                for (filter, only) in FILTERS {
                    let place = format!("{law}, {asked:?} (of the body: {of_body}), {filter}");
                    let mut plain = field.clone();
                    if !of_body && asked != Sampling::Auto {
                        plain = plain.sampled(asked);
                    }
                    let mut fields = fields(only(plain.clone()), parts);
                    if of_body {
                        let set = fields.set_sampling(body, asked, &world.bodies);
                        set.expect("it is there");
                    }
                    let samples = fields.samples(body, &world);
                    let asked = match (law, asked) {
                        ("conveyor", Sampling::Auto) => Sampling::Centre,
                        _ => kind(law, asked),
                    };
                    let is_iron = |sample: &&BodySample| {
                        let iron = sample.query.groups == groups(IRON);
                        sample.sampling == asked && iron
                    };
                    let uniform = matches!(law, "uniform" | "gravity zone");
                    let iron: Vec<_> = samples.iter().filter(is_iron).collect();
                    let plain = Tree::from(plain);
                    let expected = match iron.is_empty() {
                        // Cut in pieces: a uniform force acts at the middle of the part.
                        true => {
                            assert!(uniform, "{place}: no samples");
                            let parts = samples.iter().filter(|sample| {
                                let iron = sample.query.groups == groups(IRON);
                                sample.sampling == Sampling::Parts && iron
                            });
                            literal(&plain, &world, body, parts)
                        }
                        false => literal(&plain, &world, body, iron.into_iter()),
                    };
                    assert!(expected[0].length() > 0.01, "{place}: {expected:?}");
                    let found = fields.sample(body, &world);
                    agree(found.expect("finite").expect("sampled"), expected, &place);
                    let told = fields.explain(body, &world).expect("sampled");
                    agree(told.wrench, expected, &format!("{place}, explained"));
                }
            }
        }
    }
}

/// Enough unlike fields that an index finds them by their places.
#[test]
fn many_fields_act_only_on_the_colliders_they_admit() {
    let (world, body, parts) = dumbbell();
    for asked in SAMPLINGS {
        let each = (0..40_u8).map(|number| {
            let size = 0.5 + 0.01 * Real::from(number);
            let vortex = Field::vortex(2.0, -1.0).smoothed(size);
            only_iron(vortex.within(Region::ball(9.0)).sampled(asked))
        });
        let each: Vec<Field> = each.collect();
        let felt = |some: &[Field]| {
            let mut fields = fields(some[0].clone(), parts);
            for field in &some[1..] {
                fields.set.insert(field.clone());
            }
            let found = fields.sample(body, &world);
            found.expect("finite").expect("sampled")
        };
        let alone = each.iter().map(|field| felt(std::slice::from_ref(field)));
        let sum = alone.fold([DVec3::ZERO; 2], |[force, torque], one| {
            [force + to_dvec3(one.force), torque + to_dvec3(one.torque)]
        });
        assert!(sum[0].length() > 0.1, "{asked:?}: {sum:?}");
        agree(felt(&each), sum, &format!("{asked:?}"));
    }
}

/// A field that replaces acts on one collider, and the replaced field on the other.
#[test]
fn composites_act_on_each_collider_by_itself() {
    let (world, body, parts) = dumbbell();
    let base = || Field::uniform(Vector::Z * 8.0).sampled(Sampling::Centre);
    for (filter, only) in FILTERS.into_iter().take(8) {
        let upper = || Field::uniform(Vector::X * 4.0).sampled(Sampling::Centre);
        let fields = fields(base().replace_union(only(upper())), parts);
        let found = fields.sample(body, &world);
        // A quarter of the mass is of iron.
        let expected = [DVec3::new(1.0, 0.0, 6.0), DVec3::ZERO];
        agree(found.expect("finite").expect("sampled"), expected, filter);
    }
}

/// Regression: in a step, fields acted in full on a body sampled at its centre that their groups exclude.
#[test]
fn no_scheme_moves_a_body_that_groups_exclude() {
    let schemes = [
        Scheme::KickDriftKick,
        Scheme::Kick,
        Scheme::ExternalForce,
        Scheme::LinearlyImplicit,
        Scheme::auto(1e-3),
        Scheme::substeps(4),
        Scheme::Forward4,
    ];
    for scheme in schemes {
        for (law, field) in laws() {
            for group in [IRON, WOOD] {
                let mut world = weightless(1.0 / 64.0);
                let body = RigidBodyBuilder::dynamic().translation(Vector::new(1.0, 2.0, 0.5));
                let cube = ColliderBuilder::cuboid(0.5, 0.5, 0.5).collision_groups(groups(group));
                let (body, _) = world.insert(body.linvel(Vector::Z), cube);
                let field = only_iron(field.clone().sampled(Sampling::Centre));
                let mut fields = Fields::new(field).expect("a sound tree");
                fields.settings.scheme = scheme;
                fields.step(&mut world).expect("a step");
                let pushed = world.bodies[body].linvel() != Vector::Z;
                assert_eq!(pushed, group == IRON, "{scheme:?}, {law}");
            }
        }
    }
}

/// The paper's example of two domains (§3.1.1): one field over space and time, one over space and δ, together in R⁵.
/// Regression: with a δ of the collider the body ended at v = (0.99, 0, 0), since at its centre only the world's δ was
/// read.
#[test]
fn a_field_over_time_and_one_over_delta_act_together() {
    for sampling in [Sampling::Auto, Sampling::Centre, Sampling::Parts] {
        let mut world = weightless(0.01);
        let ball = ColliderBuilder::ball(0.5).mass(1.0);
        let (body, collider) = world.insert(RigidBodyBuilder::dynamic().can_sleep(false), ball);
        let over_time = Region::ball(9.0).intersection(Region::interval("time", -1.0, 2.0));
        let over_delta = Region::ball(9.0).intersection(Region::interval("delta", 0.0, 1.0));
        let first = Field::uniform(Vector::X)
            .within(over_time)
            .sampled(sampling);
        let second = Field::uniform(Vector::Y)
            .within(over_delta)
            .sampled(sampling);
        let near = ColliderProperties::new().axis("delta", 0.5);
        let fields = Fields::builder(first.sum_union(second)).axis("delta", 7.0);
        let mut fields = fields.build().expect("a sound tree");
        let set = fields.set.set_properties(collider, near);
        set.expect("sound properties");
        for _ in 0..100 {
            fields.step(&mut world).expect("a step");
        }
        let velocity = to_dvec3(world.bodies[body].linvel());
        // A hundred roundings of a hundredth each.
        let bound = either(1e-5, 1e-13);
        let error = (velocity - DVec3::new(1.0, 1.0, 0.0)).length();
        assert_at_most(error, bound, format!("{sampling:?}: {velocity}"));
    }
}

/// Regression: on two parts of charge ±1, a region over charge gave 0 where a function gave a half.
#[test]
fn a_region_over_charge_is_evaluated_for_each_part() {
    let (world, body, parts) = dumbbell();
    let region = Region::interval(Axis::Charge, 0.5, 2.0);
    let by_function = Region::predicate([Axis::Charge], |sample| sample.axes[0] >= 0.5);
    for region in [region, by_function] {
        let fields = fields(Field::uniform(Vector::X * 4.0).within(region), parts);
        let found = fields.sample(body, &world);
        let force = found.expect("finite").expect("sampled").force;
        assert_at_most(
            (to_dvec3(force) - DVec3::X).length(),
            either(1e-6, 1e-14),
            "a quarter",
        );
    }
}

/// Also for a body whose additional mass is away from its collider: a uniform force exerts no torque.
#[test]
fn groups_that_exclude_nothing_change_nothing() {
    let mut world = weightless(1.0 / 64.0);
    let ballast = MassProperties::new(Vector::X * 2.0, 3.0, Vector::splat(1.0));
    let body = RigidBodyBuilder::dynamic().additional_mass_properties(ballast);
    let (body, _) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5).mass(1.0));
    let (bodies, colliders) = (&mut world.bodies, &world.colliders);
    bodies[body].recompute_mass_properties_from_colliders(colliders);
    let wind = || Field::uniform(Vector::Y).within(Region::ball(20.0));
    for field in [
        wind(),
        only_iron(wind()),
        within(wind(), Region::predicate([], |_| true)),
    ] {
        let fields = Fields::new(field).expect("a sound tree");
        let found = fields.sample(body, &world);
        agree(
            found.expect("finite").expect("sampled"),
            [DVec3::Y, DVec3::ZERO],
            "ballast",
        );
    }
}
