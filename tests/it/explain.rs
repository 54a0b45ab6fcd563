//! Explanations, the energy audit, and reactions on the bodies that carry fields.

use approx::assert_relative_eq;
use rapier3d_fields::math::{DVec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Fate;

use crate::support::either;

fn world() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world.integration_parameters.dt = 1.0 / 120.0;
    world
}

/// Two balls on one body, at x ± 1.
fn dumbbell(world: &mut PhysicsWorld, at: Vector) -> RigidBodyHandle {
    let body = RigidBodyBuilder::dynamic().translation(at).can_sleep(false);
    let (body, _) = world.insert(body, ColliderBuilder::ball(0.4).translation(Vector::X));
    let other = ColliderBuilder::ball(0.4).translation(-Vector::X);
    world
        .colliders
        .insert_with_parent(other, body, &mut world.bodies);
    body
}

/// Contributions that count sum to the wrench of a step; the others tell why they do not.
#[test]
fn an_explanation_sums_to_the_wrench() {
    let mut world = world();
    let body = dumbbell(&mut world, Vector::new(0.5, 0.25, 0.0));
    let wind = Field::radial(2.0, 1.0).named("wind");
    let lee = Field::radial(-3.0, 0.0)
        .within(Region::ball(1.0))
        .named("lee");
    let far = Field::uniform(Vector::X).within(Region::ball(1.0).at(Vector::X * 90.0));
    let away = Field::uniform(Vector::Y).at(body).named("own");
    let strong = Field::uniform(Vector::Z * 9.0).named("strong");
    let weak = Field::radial(0.1, 1.0).named("weak");
    let tree = wind
        .replace_union(lee)
        .sum_union(far)
        .sum_union(away)
        .sum_union(weak.strongest(strong));
    let fields = Fields::new(tree).expect("a valid tree");
    let why = fields.explain(body, &world).expect("a body in the fields");
    let wrench = fields
        .sample(body, &world)
        .expect("finite forces")
        .expect("a body in the fields");
    assert_relative_eq!(
        (why.wrench.force - wrench.force).length(),
        0.0,
        epsilon = 1e-5
    );
    assert_relative_eq!(
        (why.wrench.torque - wrench.torque).length(),
        0.0,
        epsilon = 1e-5
    );
    let fates = |name: &str| -> Vec<&Fate> {
        let label = format!("field `{name}`");
        let of_field = why.contributions.iter().filter(|c| c.field == &label[..]);
        of_field.map(|c| &c.fate).collect()
    };
    // One of the two balls is in the lee: the wind is replaced there, and counts at the other.
    assert_eq!(fates("wind").len(), 2);
    assert_eq!(
        fates("wind")
            .iter()
            .filter(|fate| ***fate == Fate::Counts)
            .count(),
        1
    );
    assert_eq!(fates("lee"), [&Fate::Counts]);
    assert!(fates("own").iter().all(|fate| **fate == Fate::OwnBody));
    let overruled = why
        .contributions
        .iter()
        .filter(|c| !c.overruled_by.is_empty());
    let by: Vec<&str> = overruled.map(|c| &*c.overruled_by[0].label).collect();
    assert_eq!(by, ["field `lee`", "field `strong`", "field `strong`"]);
    assert!(
        why.outside >= 2,
        "the far field, and the lee at the other ball"
    );
    assert!(
        why.to_string()
            .contains("overruled (strongest) by field `strong`")
    );
}

/// A damped spring, against closed forms.
#[test]
fn the_audit_attributes_energy_to_fields() {
    let drift = |dt: Real| {
        let mut world = world();
        world.integration_parameters.dt = dt;
        let ball = RigidBodyBuilder::dynamic()
            .translation(Vector::X * 2.0)
            .can_sleep(false);
        let (body, _) = world.insert(ball, ColliderBuilder::ball(0.5));
        world.bodies[body].recompute_mass_properties_from_colliders(&world.colliders);
        let mass = to_f64(world.bodies[body].mass());
        let spring = Field::spring(3.0).named("spring");
        let drag = Field::drag(0.2, 0.0).named("drag");
        let builder = Fields::builder(spring.sum_union(drag)).audit(true);
        let mut fields = builder.build().expect("a valid tree");
        for _ in 0..(2.0 / dt).round() as usize {
            fields.step(&mut world).expect("a quiet step");
        }
        let audit = fields.audit().expect("switched on");
        let body = &world.bodies[body];
        let (x, v) = (to_dvec3(body.translation()), to_dvec3(body.linvel()));
        let of = |name: &str| {
            let label = format!("field `{name}`");
            audit
                .fields
                .iter()
                .find(|f| f.field == &label[..])
                .expect("audited")
        };
        let stored = 1.5 * x.length_squared();
        assert_relative_eq!(of("spring").potential.unwrap(), stored, max_relative = 1e-5);
        assert_eq!(of("drag").potential, None);
        assert_relative_eq!(audit.initial, 6.0, max_relative = 1e-6);
        let now = 0.5 * mass * v.length_squared() + stored;
        assert_relative_eq!(of("drag").work, now - 6.0, max_relative = 0.01);
        assert!(of("drag").work < -0.5, "it takes energy");
        audit.drift.abs()
    };
    let (coarse, fine) = (drift(1.0 / 30.0), drift(1.0 / 120.0));
    // The energy of velocity Verlet oscillates by a share of (dt ω)²/4, 1.6e-3 here; drag adds an error.
    assert!(coarse < 5e-3 * 6.0, "{coarse}");
    // Second order: a quarter of the step, a sixteenth of the drift; f32 ends near 10⁻⁵.
    assert!(fine < coarse / 12.0 + 2e-5, "{coarse} {fine}");
}

/// A ball that a zone pushes through gains the potential between its two borders: that is their work, not an error of
/// the scheme.
#[test]
fn the_audit_counts_the_work_of_borders() {
    let mut world = world();
    world.integration_parameters.dt = 1e-3;
    let ball = RigidBodyBuilder::dynamic()
        .translation(Vector::X * -3.0)
        .linvel(Vector::X * 2.0)
        .can_sleep(false);
    let (body, _) = world.insert(ball, ColliderBuilder::ball(0.1).mass(1.0));
    let slab = Region::cuboid(Vector::new(1.0, 5.0, 5.0));
    let zone = Field::uniform(Vector::X * 6.0).within(slab).named("zone");
    let mut fields = Fields::builder(zone).audit(true).build().expect("a tree");
    let mut inside = 0.0;
    while world.bodies[body].translation().x < 3.0 {
        fields.step(&mut world).expect("a quiet step");
        if world.bodies[body].translation().x.abs() < 0.9 {
            let audit = fields.audit().expect("switched on");
            inside = audit.drift.abs().max(inside);
        }
    }
    let audit = fields.audit().expect("switched on");
    // 6 N over 2 m, each border within the distance of a step.
    assert_relative_eq!(audit.fields[0].border, 12.0, epsilon = 2.0 * 6.0 * 6e-3);
    let gained = audit.kinetic - 2.0;
    assert_relative_eq!(gained, 12.0, epsilon = 2.0 * 6.0 * 6e-3);
    // The rounding of some thousand steps, and two half kicks.
    let rest = inside.max(audit.drift.abs());
    assert!(rest < either(1e-3, 2e-5), "{rest}");
    assert_eq!(audit.potential, 0.0);
}

/// And angular momentum. Without a reaction, momentum is not conserved.
#[test]
fn reactions_conserve_momentum() {
    let run = |react: bool, crossed: bool| {
        let mut world = world();
        let left = dumbbell(&mut world, Vector::new(-9.0, 0.3, 0.0));
        let right = dumbbell(&mut world, Vector::new(9.0, -0.4, 0.5));
        let mut pull = Field::radial(-1.5, 1.0);
        let mut twist = Field::uniform(Vector::Z * 0.2).within(Region::ball(100.0));
        if react {
            (pull, twist) = (pull.reacting(), twist.reacting());
        }
        let atom: Tree = match crossed {
            true => pull.sum_union(Tree::from(twist).cross_union(Tree::empty())),
            false => pull.into(),
        };
        // Off its centre of mass, so that the reaction turns the carrier.
        let grip = Anchor::Body {
            handle: left,
            local_pose: Pose::from_translation(Vector::Y * 0.7),
        };
        let tree = Tree::instances(atom, [grip]);
        let mut fields = Fields::new(tree).expect("a valid tree");
        for _ in 0..60 {
            fields.step(&mut world).expect("a quiet step");
        }
        let (mut momentum, mut angular, mut size) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for body in [left, right] {
            let body = &world.bodies[body];
            let p = to_dvec3(body.linvel()) * to_f64(body.mass());
            let r = to_dvec3(body.center_of_mass());
            let inertia = body.mass_properties().effective_angular_inertia();
            momentum += p;
            angular += r.cross(p) + to_dvec3(inertia * body.angvel());
            size += p.length();
        }
        (momentum.length() / size, angular.length() / size)
    };
    // Sums of some hundred rounded terms.
    let tolerance = 100.0 * to_f64(Real::EPSILON);
    for crossed in [false, true] {
        let (momentum, angular) = run(true, crossed);
        assert!(momentum < tolerance, "momentum {momentum}");
        // While torques act, the rotation step keeps L only to its order.
        println!("{momentum} {angular}");
        assert!(angular < 5e-3, "angular momentum {angular}");
        let (momentum, _) = run(false, crossed);
        assert!(momentum > 0.1, "without a reaction: {momentum}");
    }
}

/// The carrier's explanation includes the reaction, and the audit counts the pair's energy once.
#[test]
fn reactions_are_explained_and_audited() {
    let mut world = world();
    let left = dumbbell(&mut world, Vector::new(-9.0, 0.0, 0.0));
    let right = dumbbell(&mut world, Vector::new(9.0, 0.0, 0.0));
    let pull = Field::radial(-1.5, 1.0).reacting().at(left);
    let mut fields = Fields::builder(pull)
        .audit(true)
        .build()
        .expect("a valid tree");
    let explain = |body| fields.explain(body, &world).unwrap();
    let (on_left, on_right) = (explain(left), explain(right));
    assert_eq!(on_left.wrench.force, -on_right.wrench.force);
    assert_eq!(on_left.reaction, on_left.wrench);
    assert!(on_left.to_string().contains("reaction to its own fields"));
    for _ in 0..60 {
        fields.step(&mut world).expect("a quiet step");
    }
    let audit = fields.audit().expect("switched on");
    assert!(
        audit.initial > 1.0 && audit.drift.abs() < 2e-3 * audit.initial,
        "{audit}"
    );
}

/// A reaction needs one body that carries all fields of its term.
#[test]
fn reactions_without_a_carrier_are_refused() {
    let mut world = world();
    let a = dumbbell(&mut world, Vector::ZERO);
    let b = dumbbell(&mut world, Vector::X * 9.0);
    let pull = || Field::radial(-1.0, 1.0).reacting().named("pull");
    for tree in [
        pull().into(),
        pull().at(a).replace_union(pull().at(b)),
        pull().at(a).replace_union(Field::uniform(Vector::X)),
        Tree::instances(pull(), [Anchor::from(a), Anchor::WORLD]),
    ] {
        let error = Fields::new(tree).err().expect("refused").to_string();
        assert!(
            error.contains("field `pull`") && error.contains("react"),
            "{error}"
        );
    }
    let fine = Tree::instances(pull().replace_union(pull()), [a, b]);
    assert!(Fields::new(fine).is_ok());
}

#[test]
fn totals_of_a_sum_add_up_to_the_wrench() {
    let mut world = PhysicsWorld::new();
    let boxed = RigidBodyBuilder::dynamic().translation(Vector::new(2.0, 1.0, 0.0));
    let (body, _) = world.insert(boxed, ColliderBuilder::cuboid(0.5, 0.3, 0.2));
    let pull = Field::point_gravity(9.0).named("planet");
    let breeze = Field::uniform(Vector::X * 2.0).named("breeze");
    let again = Field::uniform(Vector::X * 3.0).named("breeze");
    let far = Field::uniform(Vector::Y)
        .within(Region::ball(0.1))
        .named("far");
    let fields = Fields::new(pull + breeze + again + far).expect("a valid tree");
    let told = fields.explain(body, &world);
    let told = told.expect("sampled");
    let names: Vec<_> = told
        .totals
        .iter()
        .map(|total| &*total.field.label)
        .collect();
    assert_eq!(names.len(), 3, "one is out of reach, two have one name");
    assert!(
        told.totals.iter().any(|total| total.samples > 1),
        "over the volume"
    );
    let force: Vector = told.totals.iter().map(|total| total.wrench.force).sum();
    let torque: Vector = told.totals.iter().map(|total| total.wrench.torque).sum();
    // Some tens of roundings of the whole force, at arms shorter than 1.
    let rounding = 50.0 * Real::EPSILON * told.wrench.force.length();
    assert!((force - told.wrench.force).length() <= rounding);
    assert!((torque - told.wrench.torque).length() <= rounding);
}

/// Instances at one place: a body is cut by the border of each of them separately, not by both at once.
#[test]
fn instances_that_cut_a_body_are_explained_one_by_one() {
    let mut world = world();
    let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.0, -2.0));
    let ball = ColliderBuilder::ball(0.25).mass(1.0);
    let (body, _) = world.insert(body, ball);
    let capsule = Region::capsule(1.37, 4.37);
    let field = Field::uniform(-Vector::Y).within(capsule);
    let place = Vector::new(-1.75, 0.25, 2.25);
    let one = Fields::new(field.clone().at(place)).expect("a valid tree");
    let two = Tree::instances(field, [place, place]);
    let two = Fields::new(two).expect("a valid tree");
    let [one, two] = [one, two].map(|fields| {
        let wrench = fields.sample(body, &world).expect("finite forces");
        let told = fields.explain(body, &world).expect("sampled").wrench;
        let wrench = wrench.expect("a body in the fields");
        assert_relative_eq!(told.force.y, wrench.force.y, max_relative = 1e-6);
        told.force.y
    });
    assert!(one < -1e-3 && one > -0.1, "the border cuts the body: {one}");
    assert_relative_eq!(two, 2.0 * one, max_relative = 1e-6);
}
