//! Steps that cannot be made give a typed error that names the field, and leave the world unchanged.

use proptest::prelude::*;
use rapier3d_fields::math::{ColliderHandle, Pose, RigidBodyHandle};
use rapier3d_fields::prelude::*;

use crate::support::bits::bits;
use crate::support::{cases, insert_ball, weightless};

const SCHEMES: [Scheme; 8] = [
    Scheme::KickDriftKick,
    Scheme::Kick,
    Scheme::ExternalForce,
    Scheme::substeps(3),
    Scheme::Substep(Substeps::PerBody { tolerance: 1e-2 }),
    Scheme::LinearlyImplicit,
    Scheme::Forward4,
    Scheme::auto(1e-2),
];

/// Three bodies that move, turn, sleep and carry a user's force; the first at the origin.
fn world() -> (PhysicsWorld, Vec<RigidBodyHandle>, Vec<ColliderHandle>) {
    let mut world = PhysicsWorld::new();
    let bodies: Vec<_> = (0..3)
        .map(|i| {
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::X * (3.0 * i as Real))
                .linvel(Vector::new(0.25, -0.5, 0.125))
                .angvel(Vector::new(1.0, 2.0, 3.0));
            world.insert(body, ColliderBuilder::cuboid(0.5, 0.25, 0.125))
        })
        .collect();
    let (bodies, colliders): (Vec<_>, Vec<_>) = bodies.into_iter().unzip();
    world.bodies[bodies[1]].add_force(Vector::new(0.1, 0.2, 0.3), true);
    world.bodies[bodies[2]].sleep();
    (world, bodies, colliders)
}

fn fields(tree: impl Into<Tree>, scheme: Scheme) -> Fields {
    Fields::builder(tree)
        .scheme(scheme)
        .build()
        .expect("a valid tree")
}

/// The field as `culprit`, beside a valid one.
fn with_innocent(culprit: Field) -> Tree {
    Field::uniform(Vector::Y)
        .named("innocent")
        .sum_union(culprit.named("culprit"))
}

/// Asserts that a step fails twice with the same error and leaves the world unchanged.
fn refuses_step(tree: impl Into<Tree>, scheme: Scheme) -> StepError {
    let (mut world, ..) = world();
    let before = bits(&world);
    let mut fields = fields(tree, scheme);
    fields.settings.on_fault = FaultPolicy::Refuse;
    let error = fields
        .step(&mut world)
        .expect_err("a step that cannot be made");
    assert_eq!(bits(&world), before, "{scheme:?}: {error}");
    let again = fields.step(&mut world).expect_err("the same again");
    assert_eq!(again.to_string(), error.to_string(), "{scheme:?}");
    assert_eq!(bits(&world), before, "{scheme:?}, again: {error}");
    assert_eq!(fields.time(), 0.0, "no time has passed");
    error
}

#[test]
fn time_steps_must_be_finite_and_not_negative() {
    for dt in [
        Real::NAN,
        -1.0,
        -Real::MIN_POSITIVE,
        Real::INFINITY,
        -Real::INFINITY,
    ] {
        for scheme in SCHEMES {
            let (mut world, ..) = world();
            let before = bits(&world);
            let mut fields = fields(Field::uniform(Vector::X), scheme);
            world.integration_parameters.dt = dt;
            let error = fields.begin(WorldMut::from(&mut world)).err();
            assert!(
                matches!(error, Some(StepError::TimeStep { .. })),
                "{dt}: {error:?}"
            );
            assert!(
                matches!(fields.step(&mut world), Err(StepError::TimeStep { .. })),
                "{dt}"
            );
            assert_eq!(bits(&world), before, "{dt}");
        }
    }
}

/// If a step was dropped, the next `begin` takes its forces back and fails; `finish` refuses a step of other fields.
#[test]
fn only_the_fields_that_began_a_step_finish_it() {
    for scheme in [Scheme::default(), Scheme::ExternalForce] {
        let (mut world, ..) = world();
        // While a step is open, Rapier does not compute the precession of such a body.
        let top = RigidBodyBuilder::dynamic().translation(Vector::X * 90.0);
        let top = top
            .angvel(Vector::new(1.0, 2.0, 3.0))
            .gyroscopic_forces_enabled(true);
        let (top, _) = world.insert(top, ColliderBuilder::cuboid(0.1, 0.2, 0.3));
        let mut one = fields(Field::uniform(Vector::X), scheme);
        let mut other = fields(Field::uniform(Vector::X), scheme);
        let forces = |world: &PhysicsWorld| -> Vec<Vector> {
            world
                .bodies
                .iter()
                .map(|(_, body)| body.user_force())
                .collect()
        };
        let before = forces(&world);
        drop(
            one.begin(WorldMut::from(&mut world))
                .expect("a finite field"),
        );
        let again = one.begin(WorldMut::from(&mut world)).err();
        assert_eq!(again, Some(StepError::Unfinished));
        assert_eq!(forces(&world), before, "the user's own");
        assert!(world.bodies[top].gyroscopic_forces_enabled(), "{scheme:?}");
        let step = one.begin(WorldMut::from(&mut world)).expect("the next one");
        let stranger = other.finish(step, WorldMut::from(&mut world));
        assert_eq!(stranger, Err(StepError::NotTheirs));
    }
}

/// Though no body has come or gone since the last step.
#[test]
fn errors_name_anchors_that_an_edit_brings() {
    let anchor = RigidBodyHandle::from_raw_parts(77, 0);
    for scheme in SCHEMES {
        let mut world = PhysicsWorld::new();
        world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
        let mut fields = fields(Field::uniform(Vector::X), scheme);
        fields.step(&mut world).expect("a step");
        let culprit = Field::spring(1.0).named("culprit").at(anchor);
        let tree = fields.set.insert(culprit);
        for _ in 0..2 {
            let error = fields.step(&mut world).expect_err("no such body");
            let message = error.to_string();
            assert!(
                message.contains("`culprit`") && message.contains("77"),
                "{scheme:?}: {message}"
            );
        }
        drop(fields.set.remove(tree).expect("a tree of the set"));
        fields.step(&mut world).expect("a step");
    }
}

/// At the first step, wherever in the tree the field is.
#[test]
fn errors_name_anchors_that_never_existed() {
    let (body, collider) = (
        RigidBodyHandle::from_raw_parts(77, 0),
        ColliderHandle::from_raw_parts(78, 0),
    );
    let other = || Field::uniform(Vector::X).within(Region::ball(1.0));
    for (anchor, handle) in [(Anchor::from(body), "77"), (Anchor::from(collider), "78")] {
        for culprit in [
            Field::uniform(Vector::X),
            Field::radial(1.0, -2.0),
            Field::spring(1.0).within(Region::ball(1.0)),
            Field::closure([], |_: &Sample| Vector::X),
        ] {
            let culprit = || culprit.clone().named("culprit");
            let mut trees = vec![with_innocent(culprit().at(anchor))];
            trees.extend(Operator::ALL.map(|op| Tree::fold(op, [other(), culprit().at(anchor)])));
            trees.push(Tree::instances(culprit(), [Anchor::WORLD, anchor]));
            trees.push(Tree::instances(culprit().difference(other()), [anchor]));
            for tree in trees {
                let error = refuses_step(tree, Scheme::default());
                assert!(
                    matches!(error, StepError::MissingAnchor { .. }),
                    "{error:?}"
                );
                let message = error.to_string();
                assert!(
                    message.contains("`culprit`") && message.contains(handle),
                    "{message}"
                );
            }
        }
    }
    let contact = Field::contact(ContactLaw::Observe)
        .named("culprit")
        .at(collider);
    let error = refuses_step(contact, Scheme::default()).to_string();
    assert!(
        error.contains("`culprit`") && error.contains("78"),
        "{error}"
    );
}

/// Regression: instances were labelled by their first field, also after all of their fields had been removed.
#[test]
fn instances_without_a_field_do_not_fail_a_step() {
    let nobody = RigidBodyHandle::from_raw_parts(77, 0);
    let field = |name| Field::spring(1.0).within(Region::ball(1.0)).named(name);
    for prototype in [Tree::from(field("a")), field("a").replace_union(field("b"))] {
        let (mut world, ..) = world();
        let none = Tree::instances(prototype, [Anchor::WORLD, Anchor::from(nobody)]);
        let mut fields = fields(none.sum_union(Field::drag(0.1, 0.0)), Scheme::default());
        for name in ["a", "b"] {
            if let Some(field) = fields.set.handle(name) {
                drop(fields.set.remove_field(field).expect("it is there"));
            }
        }
        fields.step(&mut world).expect("all that is left is there");
    }
}

/// Three fields each add a ball's speed to its velocity, whose square overflows. Regression: Rapier got infinity.
#[test]
fn impulses_that_would_overflow_are_left_out_with_a_warning() {
    // Just below the largest speed that can be squared.
    let speed = 0.75 * Real::MAX.sqrt();
    for detection in [Detection::Discrete, Detection::Swept] {
        let mut world = weightless(1e-11 / speed);
        world.integration_parameters.normalized_max_linear_velocity = Real::INFINITY;
        let fast = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::X * speed);
        let around = [[0.9, 0.1, 0.0], [0.9, -0.1, 0.0], [0.9, 0.0, 0.1]];
        let touch = around.map(|place| {
            let place = Vector::from_array(place);
            let body = insert_ball(&mut world, 1.0, place, Vector::ZERO);
            Field::contact(ContactLaw::Paper).at(world.bodies[body].colliders()[0])
        });
        let builder = Fields::builder(Tree::fold(Operator::SumUnion, touch));
        let mut fields = builder.detection(detection).build().expect("a sound tree");
        fields.step(&mut world).expect("nothing to refuse");
        let (told, found) = (StepWarning::AnswerLeftOut { body: fast }, fields.warnings());
        assert!(found.contains(&told), "{detection:?}: {found:?}");
        let mut all = world.bodies.iter();
        assert!(all.all(|it| it.1.linvel().is_finite()), "{detection:?}");
    }
}

#[test]
fn removing_a_body_removes_its_fields() {
    for scheme in SCHEMES {
        let (mut world, bodies, colliders) = world();
        world.wake_up_all(true);
        world.gravity = Vector::ZERO;
        bodies
            .iter()
            .for_each(|body| world.bodies[*body].set_angvel(Vector::ZERO, true));
        let push = |v: Vector| Field::uniform(v).coupled_to(Coupling::Each);
        let shell = push(Vector::Y).difference(Field::uniform(Vector::X).within(Region::ball(0.1)));
        let tree = push(Vector::X)
            .at(bodies[1])
            .sum_union(push(Vector::Z).at(colliders[1]))
            .sum_union(Tree::instances(shell, [bodies[1]]));
        let mut fields = fields(tree, scheme);
        fields.step(&mut world).expect("all are there");
        assert_eq!(
            fields.wrench(bodies[0]).map(|w| w.force),
            Some(Vector::ONE),
            "{scheme:?}"
        );
        world.remove_body(bodies[1]);
        fields.step(&mut world).expect("one less");
        assert_eq!(
            fields.wrench(bodies[0]).map(|w| w.force),
            Some(Vector::ZERO),
            "{scheme:?}"
        );
        assert_eq!(fields.wrench(bodies[1]), None, "{scheme:?}");
        // A new body in the slot of the old one does not get its fields.
        let (new, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.1));
        assert_eq!(
            new.into_raw_parts().0,
            bodies[1].into_raw_parts().0,
            "the slot is used again"
        );
        fields.step(&mut world).expect("one more");
        assert_eq!(
            fields.wrench(bodies[0]).map(|w| w.force),
            Some(Vector::ZERO),
            "{scheme:?}"
        );
    }
}

#[test]
fn properties_of_colliders_are_checked() {
    let (mut world, _, colliders) = world();
    let fields = Fields::builder(Field::uniform(Vector::X))
        .axis("warmth", 1.0)
        .build();
    let mut fields = fields.expect("valid");
    let mut set =
        |collider, properties| fields.set_properties(collider, properties, &world.colliders);
    for bad in [Real::NAN, Real::INFINITY, -Real::INFINITY] {
        for properties in [
            ColliderProperties::new().charge(bad),
            ColliderProperties::new().mass(bad),
            ColliderProperties::new().axis("warmth", bad),
        ] {
            let error = set(colliders[0], properties).expect_err("not finite");
            let right = matches!(
                error,
                PropertyError::Property { .. } | PropertyError::AxisValue { .. }
            );
            assert!(right, "{error:?}");
        }
    }
    assert!(matches!(
        set(colliders[0], ColliderProperties::new().mass(-1.0)),
        Err(PropertyError::Property { .. })
    ));
    let unknown = set(colliders[0], ColliderProperties::new().axis("cold", 1.0));
    assert_eq!(
        unknown,
        Err(PropertyError::UnknownAxis {
            axis: "cold".into()
        })
    );
    world.remove_collider(colliders[0]);
    let mut set =
        |collider, properties| fields.set_properties(collider, properties, &world.colliders);
    let gone = set(colliders[0], ColliderProperties::new());
    assert_eq!(
        gone,
        Err(PropertyError::NoSuchCollider {
            collider: colliders[0]
        })
    );
    assert!(matches!(
        fields.set_axis("warmth", Real::NAN),
        Err(PropertyError::AxisValue { .. })
    ));
    assert!(matches!(
        fields.set_axis("cold", 1.0),
        Err(PropertyError::UnknownAxis { .. })
    ));
}

#[test]
fn errors_name_the_field_of_a_value_that_is_not_finite() {
    let bad_beyond_one = |bad: Real| {
        Field::closure([], move |s: &Sample| {
            Vector::Y * if s.local_point.x > 1.0 { bad } else { 1.0 }
        })
        .sampled(Sampling::Parts)
    };
    let (_, bodies, colliders) = world();
    for scheme in SCHEMES {
        for bad in [Real::NAN, Real::INFINITY] {
            let tree = with_innocent(bad_beyond_one(bad));
            for tree in [
                tree,
                Field::uniform(Vector::X).replace_union(bad_beyond_one(bad).named("culprit")),
            ] {
                let StepError::NonFinite {
                    field,
                    body,
                    collider,
                    world_point,
                    ..
                } = refuses_step(tree, scheme)
                else {
                    panic!("a value that is not finite");
                };
                assert!(field.label.contains("`culprit`"), "{field}");
                assert_eq!((body, collider), (bodies[1], Some(colliders[1])));
                assert_eq!(world_point, Vector::X * 3.0);
            }
        }
        // A point charge exactly at the centre of a body.
        let coincident = Field::coulomb(1.0, 1.0)
            .coupled_to(Coupling::Each)
            .at(Vector::X * 3.0);
        let StepError::NonFinite { field, body, .. } =
            refuses_step(with_innocent(coincident), scheme)
        else {
            panic!("a singularity");
        };
        assert!(field.label.contains("`culprit`"), "{field}");
        assert_eq!(body, bodies[1]);
    }
}

/// The field is evaluated at a time after zero only once Rapier has moved the bodies.
#[test]
fn a_step_that_fails_at_its_end_is_undone() {
    let late = Field::closure([Axis::Time], |s: &Sample| {
        Vector::Y * if s.axes[0] > 0.0 { Real::NAN } else { 1.0 }
    });
    let error = refuses_step(with_innocent(late), Scheme::KickDriftKick);
    assert!(error.to_string().contains("`culprit`"), "{error}");
}

#[test]
fn speeds_beyond_the_limit_are_refused() {
    let (_, bodies, _) = world();
    let huge = Real::MAX / 4.0;
    for scheme in [Scheme::Kick, Scheme::KickDriftKick] {
        let force = with_innocent(Field::uniform(Vector::X * huge));
        let StepError::TooFast {
            field,
            body,
            speed,
            limit,
        } = refuses_step(force, scheme)
        else {
            panic!("too fast")
        };
        assert!(field.label.contains("`culprit`"), "{field}");
        assert_eq!(body, bodies[0]);
        assert!(speed > limit || speed.is_nan(), "{speed} against {limit}");
    }
}

/// Laws that are not singular at their centre but have no direction there.
#[test]
fn regular_laws_give_no_force_at_their_centre() {
    let law = |power: Real| Field::radial(2.0, power).coupled_to(Coupling::Each);
    for (what, field) in [
        ("constant", law(0.0)),
        ("root", law(0.5)),
        ("linear", law(1.0)),
        ("linear, shifted", law(1.0).shifted_to_zero_at(2.0)),
        ("softened", law(-2.0).softened(0.5)),
        (
            "softened, shifted",
            law(-2.0).softened(0.5).shifted_to_zero_at(2.0),
        ),
        (
            "spring at length",
            Field::spring_damper(1.0, 0.0, 1.0).coupled_to(Coupling::Each),
        ),
    ] {
        let (world, bodies, _) = world();
        for tree in [
            Tree::from(field.clone()),
            field.difference(
                Field::spring(1.0)
                    .coupled_to(Coupling::Each)
                    .within(Region::ball(0.1).at(Vector::X)),
            ),
        ] {
            let fields = fields(tree, Scheme::default());
            let wrench = fields.sample(bodies[0], &world);
            let wrench = wrench.unwrap_or_else(|error| panic!("{what}: {error}"));
            assert_eq!(wrench.map(|w| w.force), Some(Vector::ZERO), "{what}");
        }
    }
}

fn hostile() -> impl Strategy<Value = Real> {
    let values = vec![
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-30,
        1e10,
        -1e18,
        1e30,
        Real::NAN,
        Real::INFINITY,
        -Real::INFINITY,
        Real::MAX,
        Real::MIN,
        Real::MIN_POSITIVE,
        Real::EPSILON,
    ];
    prop_oneof![1 => proptest::sample::select(values), 3 => (0.01..4.0_f64).prop_map(|x| x as Real)]
}

fn hostile_field() -> impl Strategy<Value = Field> {
    let number = || hostile();
    (
        0..12,
        [number(), number(), number()],
        0..6,
        [number(), number(), number()],
        0..4,
        any::<bool>(),
    )
        .prop_map(|(formula, [a, b, c], region, [d, e, f], anchor, moved)| {
            let field = match formula {
                0 => Field::uniform(Vector::new(a, b, c)),
                1 => Field::radial(a, b).softened(c),
                2 => Field::radial(a, b).shifted_to_zero_at(c),
                3 => Field::lennard_jones(a, b),
                4 => Field::lennard_jones(a, b).shifted_to_zero_at(c),
                5 => Field::spring_damper(a, b, c),
                6 => Field::drag(a, b),
                7 => Field::magnetic(Vector::new(a, b, c)).coupled_to(Coupling::Each),
                8 => Field::closure([Axis::Time], move |s: &Sample| {
                    Vector::new(a, b * s.axes[0], c)
                }),
                9 => Field::coulomb(a, b),
                10 => Field::point_gravity(a),
                _ => Field::contact(ContactLaw::restitution(a))
                    .at(ColliderHandle::from_raw_parts(1, 0)),
            };
            let field = match region {
                0 => field.within(Region::ball(d)),
                1 => field.within(Region::cuboid(Vector::new(d, e, f)).complement()),
                2 => field.within(Region::cone(d, e).union(Region::capsule(e, f))),
                3 => field.within(Region::interval("speed", d, e)),
                4 => field.within(Region::half_space(Vector::X, d)),
                _ => field,
            };
            let pose = Pose::from_translation(if moved {
                Vector::new(d, e, f)
            } else {
                Vector::ZERO
            });
            match anchor {
                0 if formula < 11 => field.at(pose),
                1 if formula < 11 => field.at(Anchor::Body {
                    handle: RigidBodyHandle::from_raw_parts(1, 0),
                    local_pose: pose,
                }),
                2 => field.at(Anchor::Collider {
                    handle: ColliderHandle::from_raw_parts(0, 0),
                    local_pose: pose,
                }),
                _ => field,
            }
        })
}

proptest! {
    #![proptest_config(cases(1000))]

    /// Hostile numbers in random trees: an error that leaves the world alone, or a step after
    /// which every body that was finite still is.
    #[test]
    fn hostile_numbers_never_panic(
        parts in proptest::collection::vec((hostile_field(), 0..7_usize), 1..5),
        scheme in 0..SCHEMES.len(),
        policy in 0..3_usize,
    ) {
        let (mut world, ..) = world();
        let tree = parts.into_iter().fold(Tree::empty(), |tree, (field, operator)| {
            if tree.field_count() == 0 { field.into() } else { Tree::fold(Operator::ALL[operator], [tree, field.into()]) }
        });
        let policy = [FaultPolicy::LeaveOut, FaultPolicy::Quarantine, FaultPolicy::Refuse][policy];
        let builder = Fields::builder(tree).scheme(SCHEMES[scheme]).on_fault(policy);
        let Ok(mut fields) = builder.build() else {
            return Ok(());
        };
        for _ in 0..3 {
            let before = bits(&world);
            let outcome = fields.step(&mut world);
            fields.potential_energy(&world);
            match outcome {
                Ok(_) => {
                    for (handle, body) in world.bodies.iter() {
                        prop_assert!(body.position().is_finite() && body.linvel().is_finite(), "{handle:?}");
                        let kept = body.is_enabled() || policy == FaultPolicy::Quarantine;
                        prop_assert!(kept, "{handle:?} is in quarantine");
                    }
                }
                Err(error) => {
                    prop_assert_eq!(bits(&world), before, "{}", error);
                    let faulty = matches!(error, StepError::NonFinite { .. } | StepError::TooFast { .. });
                    prop_assert!(!faulty || policy == FaultPolicy::Refuse, "{}", error);
                    break;
                }
            }
        }
    }
}

/// The positions of two balls some steps after a third one has become not finite.
fn beside(spoil: impl Fn(&mut RigidBody), scheme: Scheme, detection: Detection) -> Vec<Vector> {
    let mut world = weightless(1.0 / 60.0);
    world.gravity = Vector::Y * -9.81;
    let floor = world
        .colliders
        .insert(ColliderBuilder::cuboid(20.0, 0.5, 20.0));
    let places = [
        Vector::Y,
        Vector::new(3.0, 2.0, 0.0),
        Vector::new(8.0, 5.0, 0.0),
    ];
    let balls = places.map(|place| insert_ball(&mut world, 1.0, place, Vector::X));
    let part = world.bodies[balls[0]].colliders()[0];
    let contact = Tree::from(Field::contact(ContactLaw::Observe).at(part));
    let moon = Field::point_gravity(3.0).at(balls[2]);
    let tree = contact
        .sum_union(Field::spring(2.0))
        .sum_union(moon)
        .sum_union(Field::contact(ContactLaw::Observe).at(floor));
    let builder = Fields::builder(tree).scheme(scheme).detection(detection);
    let mut fields = builder.cross_check(true).build().expect("a valid tree");
    for _ in 0..3 {
        fields.step(&mut world).expect("a finite step");
    }
    spoil(&mut world.bodies[balls[2]]);
    fields.step(&mut world).expect("the world goes on");
    let told = |warning: &StepWarning| matches!(warning, StepWarning::NotFinite { body } if *body == balls[2]);
    assert!(
        fields.warnings().iter().any(told),
        "{:?}",
        fields.warnings()
    );
    for _ in 0..3 {
        fields.step(&mut world).expect("the world goes on");
        assert!(!fields.warnings().iter().any(told), "told once");
    }
    assert!(!world.bodies[balls[2]].is_enabled(), "in quarantine");
    let finite = |ball: RigidBodyHandle| world.bodies[ball].translation();
    [balls[0], balls[1]].map(finite).to_vec()
}

#[test]
fn a_body_that_is_not_finite_does_not_stop_a_world() {
    for detection in [Detection::Discrete, Detection::Swept] {
        let schemes = SCHEMES.into_iter();
        for scheme in schemes {
            let spoilt = [
                beside(
                    |it| it.set_translation(Vector::X * Real::NAN, true),
                    scheme,
                    detection,
                ),
                beside(
                    |it| it.set_linvel(Vector::X * Real::INFINITY, true),
                    scheme,
                    detection,
                ),
                beside(
                    |it| it.add_force(Vector::X * Real::NAN, true),
                    scheme,
                    detection,
                ),
            ];
            for places in &spoilt {
                assert!(places.iter().all(|place| place.is_finite()), "{scheme:?}");
            }
        }
    }
}
