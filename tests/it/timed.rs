//! Fields with a lifetime: their impulse in the steps in which they begin and end, and their removal afterwards.

use rapier3d_fields::math::{from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_at_most, build, either, insert_ball, weightless};

mod bodies;

const SCHEMES: [Scheme; 8] = [
    Scheme::KickDriftKick,
    Scheme::Kick,
    Scheme::ExternalForce,
    Scheme::LinearlyImplicit,
    Scheme::auto(1e-3),
    Scheme::substeps(4),
    Scheme::Substep(Substeps::PerBody { tolerance: 0.05 }),
    Scheme::Forward4,
];

/// Terms of the kinds that are evaluated differently, each of 12 N on 1 kg.
fn kinds() -> Vec<(&'static str, Field)> {
    vec![
        ("uniform", Field::uniform(Vector::X * 12.0)),
        (
            "zone",
            Field::uniform(Vector::X * 12.0).within(Region::ball(9.0)),
        ),
        ("radial", Field::radial(12.0, 0.0).at(Vector::X * -1e4)),
        ("closure", Field::closure([], |_| Vector::X * 12.0)),
        (
            "acceleration",
            Field::uniform(Vector::X * 12.0).force_mode(ForceMode::Acceleration),
        ),
    ]
}

/// The velocity along x after `steps` steps of 1/60 s in a field.
fn velocity(field: Field, scheme: Scheme, steps: u32) -> f64 {
    let mut world = weightless(1.0 / 60.0);
    let body = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
    // A second field never ends, so that the set is not empty.
    let still = Field::uniform(Vector::Y)
        .within(Region::ball(0.1))
        .at(Vector::Y * 1e3);
    let mut fields = Fields::new(field.sum_union(still)).expect("a sound tree");
    fields.settings.scheme = scheme;
    for _ in 0..steps {
        fields.step(&mut world).expect("a step");
    }
    to_f64(world.bodies[body].linvel().x)
}

/// A window of 5 ms at 60 Hz gave nothing of its impulse by default, and 0.83 and 0.69 of it under `Substep` and a
/// scheme of fourth order: lifetimes were evaluated at single moments. The impulse is the force times the overlap with
/// each step, wherever the window lies.
#[test]
fn the_impulse_is_force_times_overlap() {
    let windows = [
        (0.051, 0.056),
        (0.048, 0.053),
        (0.05, 0.055),
        (0.040, 0.050),
        (0.012, 0.104),
        (-1.0, 0.02),
        (0.0, 1.0 / 60.0),
    ];
    for scheme in SCHEMES {
        for (kind, field) in kinds() {
            for (from, until) in windows {
                let window = Lifetime::between(from, until);
                let found = velocity(field.clone().lifetime(window), scheme, 10);
                let expected = 12.0 * (until - f64::max(from, 0.0));
                let error = (found - expected).abs();
                // The steps of 1/60 are rounded to the precision of the world.
                let place = format!("{scheme:?}, {kind}, {from} to {until}: {found}, {expected}");
                assert_at_most(error, either(3e-6, 1e-12), place);
            }
        }
    }
}

/// A velocity change is given once a step, times the share of the step in which the field lives.
#[test]
fn a_change_of_velocity_is_given_by_its_share_of_the_step() {
    for scheme in SCHEMES {
        let push = Field::uniform(Vector::X * 3.0).force_mode(ForceMode::VelocityChange);
        let found = velocity(push.lifetime(Lifetime::between(0.05, 0.0625)), scheme, 10);
        assert_at_most(
            (found - 3.0 * 0.75).abs(),
            either(3e-6, 1e-12),
            format!("{scheme:?}"),
        );
    }
}

/// Drag in a window slows by its share of the step: its slope in closed form is scaled as the force is.
#[test]
fn drag_counts_by_its_share_of_the_step() {
    for scheme in SCHEMES {
        let mut world = weightless(1.0 / 64.0);
        let body = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::X);
        let drag = Field::drag(0.5, 0.0).lifetime(Lifetime::between(0.0, 1.0 / 128.0));
        let mut fields = Fields::new(drag).expect("a sound tree");
        fields.settings.scheme = scheme;
        for _ in 0..3 {
            fields.step(&mut world).expect("a step");
        }
        let found = to_f64(world.bodies[body].linvel().x);
        // Schemes of first order are within (h/m)²/2 of it.
        let expected = (-0.5 / 128.0_f64).exp();
        assert_at_most(
            (found - expected).abs(),
            1e-5,
            format!("{scheme:?}: {found}"),
        );
    }
}

/// A step begins with the last evaluation if nothing changed. That one has the lifetimes of the step before, and so has
/// the one in a snapshot.
#[test]
fn steps_before_and_after_a_window_go_on_bit_for_bit() {
    let windows = [(0.040, 0.044), (0.05, 0.0525), (1.0 / 60.0, 2.0 / 60.0)];
    for scheme in SCHEMES {
        for (from, until) in windows {
            let run = |restart: bool| {
                let mut world = weightless(1.0 / 60.0);
                let body = insert_ball(&mut world, 1.0, Vector::X, Vector::Y);
                let gust = Field::uniform(Vector::X * 12.0).within(Region::ball(9.0));
                let gust = gust.lifetime(Lifetime::between(from, until));
                let tree = gust.sum_union(Field::spring(4.0));
                let mut fields = Fields::new(tree).expect("a sound tree");
                fields.settings.scheme = scheme;
                for _ in 0..8 {
                    fields.step(&mut world).expect("a step");
                    if restart {
                        let parts = (
                            fields.set.clone(),
                            fields.settings.clone(),
                            fields.state.clone(),
                        );
                        let again = Fields::from_parts(parts.0, parts.1, parts.2);
                        fields = again.expect("sound parts");
                    }
                }
                let body = &world.bodies[body];
                [body.translation(), body.linvel()]
                    .map(|it| it.to_array().map(|x| to_f64(x).to_bits()))
            };
            assert_eq!(run(false), run(true), "{scheme:?}, {from} to {until}");
        }
    }
}

/// Fields past their end stayed in their set and were evaluated as before: 1,000 of them cost 13,962 µs a step. They
/// leave in the step in which they end.
#[test]
fn fields_leave_when_their_time_is_over() {
    let mut world = weightless(0.25);
    insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
    let mut fields = Fields::new(Field::uniform(Vector::Y)).expect("a sound tree");
    let puff = || Field::vortex(1.0, 0.0).smoothed(0.5);
    let until = |time| puff().lifetime(Lifetime::between(f64::NEG_INFINITY, time));
    let ends = [0.25, 0.5, 0.6, 0.75].map(|time| (time, fields.set.insert_field(until(time))));
    let never = fields
        .set
        .insert_field(puff().lifetime(Lifetime::between(0.5, f64::INFINITY)));
    let off = fields.set.insert_field(until(0.5).enabled(false));
    let both = until(0.5).lifetime(Lifetime {
        steps: Some(9),
        ..Lifetime::between(0.0, 0.5)
    });
    let both = fields.set.insert_field(both);
    for step in 1..=4 {
        fields.step(&mut world).expect("a step");
        let now = 0.25 * f64::from(step);
        for (end, field) in ends {
            assert_eq!(fields.set.get(field).is_some(), now < end, "{end} at {now}");
        }
        assert_eq!(
            fields.set.get(both).is_some(),
            now < 0.5,
            "steps and time at {now}"
        );
        assert_eq!(
            fields.set.get(off).is_some(),
            now < 0.5,
            "switched off, at {now}"
        );
        assert!(fields.set.get(never).is_some(), "no end, at {now}");
    }
    assert_eq!(fields.set.len(), 2);
    assert_eq!(fields.plan().fields, 2, "nothing of what left is evaluated");
}

/// A field whose end was changed, or that was inserted after its end, leaves as well; within composites, too.
#[test]
fn ends_may_be_changed_while_fields_act() {
    let mut world = weightless(0.25);
    let body = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
    let wind = Field::uniform(Vector::X).named("wind");
    let calm = Field::uniform(Vector::Y).named("calm");
    let mut fields = Fields::new(wind.replace_union(calm)).expect("a sound tree");
    fields.step(&mut world).expect("a step");
    fields.set["calm"].lifetime = Lifetime::between(0.0, 0.5);
    fields.step(&mut world).expect("a step");
    assert!(fields.set.handle("calm").is_none(), "it has left");
    let before = world.bodies[body].linvel();
    fields.step(&mut world).expect("a step");
    let gained = world.bodies[body].linvel() - before;
    let expected = Vector::X * 0.25;
    assert!((gained - expected).length() < from_f64(1e-6), "{gained}");
    fields
        .set
        .insert_field(Field::uniform(Vector::Z).lifetime(Lifetime::between(0.0, 0.1)));
    assert_eq!(fields.set.len(), 2);
    fields.step(&mut world).expect("a step");
    assert_eq!(fields.set.len(), 1, "its time was over before it came");
}

/// A body that sleeps under a field wakes when the field ends, although it has left the set by then.
#[test]
fn the_end_of_a_field_wakes_bodies_that_slept_under_it() {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed(),
        ColliderBuilder::cuboid(20.0, 0.5, 20.0),
    );
    let block = RigidBodyBuilder::dynamic().translation(Vector::Y);
    let (block, _) = world.insert(block, ColliderBuilder::cuboid(0.5, 0.5, 0.5).mass(1.0));
    let lift = Field::uniform(Vector::Y * 4.0).lifetime(Lifetime::between(0.0, 8.0));
    let mut fields = Fields::new(lift).expect("a sound tree");
    let (mut slept, mut woken) = (false, false);
    for _ in 0..500 {
        fields.step(&mut world).expect("a step");
        let sleeps = world.bodies[block].is_sleeping();
        slept |= sleeps && fields.time() < 8.0;
        woken |= slept && !sleeps && fields.time() > 7.9;
    }
    assert!(slept, "it rests under the lift");
    assert!(woken, "what it rests under has changed");
    assert_eq!(fields.set.len(), 0);
}

/// The energy that a field with a potential gives or takes as it begins and ends is border work in the audit, also in
/// steps of which it has a share, and after it has left: the remaining drift is the error of the scheme.
#[test]
fn the_audit_counts_the_work_of_windows() {
    for (from, until) in [(0.0, 0.31), (0.105, 0.5), (0.203, 0.2045), (0.25, 0.5)] {
        let mut world = weightless(1.0 / 128.0);
        insert_ball(&mut world, 1.0, Vector::X, Vector::Y);
        let pull = Field::spring(9.0).lifetime(Lifetime::between(from, until));
        let tree = pull.sum_union(Field::spring(1.0));
        let fields = Fields::builder(tree).audit(true).build();
        let mut fields = fields.expect("a sound tree");
        let mut largest = 0.0_f64;
        for _ in 0..128 {
            fields.step(&mut world).expect("a step");
            let drift = fields.audit().expect("switched on").drift;
            largest = largest.max(if drift.is_nan() {
                f64::INFINITY
            } else {
                drift.abs()
            });
        }
        // The energy is 5 J; (ωh)²/8 of it.
        assert_at_most(largest, 4e-3, format!("{from} to {until}"));
        let audit = fields.audit().expect("switched on");
        let border: f64 = audit.fields.iter().map(|field| field.border.abs()).sum();
        assert!(border > 1e-5, "{from} to {until}: {border}");
    }
}

/// Contacts and drag are no flows: `contact(…).as_wind(…)` was accepted, and did nothing.
#[test]
fn fields_that_are_no_flows_are_refused_as_wind() {
    let mut world = weightless(0.25);
    let body = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
    let collider = world.bodies[body].colliders()[0];
    let no_flows = [
        Field::contact(ContactLaw::Paper).at(collider),
        Field::drag(1.0, 0.0),
        Field::magnetic(Vector::Y),
        Field::buoyancy(1.0, 9.81),
    ];
    for field in no_flows {
        match Fields::new(field.as_wind(1.0, 0.0)).err() {
            Some(BuildError::Misfit { setter, .. }) => assert_eq!(setter, "as_wind"),
            other => panic!("{other:?}"),
        }
    }
    for flow in [
        Field::vortex(1.0, 0.0),
        Field::uniform(Vector::X),
        Field::spring(1.0),
    ] {
        Fields::new(flow.as_wind(1.0, 0.0)).expect("a flow");
    }
}

/// `within(region.at(p))` compiled each zone to a program of its own, at 42 times the cost of `within(region).at(p)`.
/// Both are instances of one program, and give the same forces.
#[test]
fn zones_placed_by_their_regions_are_instances_of_one_program() {
    let half = Vector::new(2.0, 1.0, 3.0);
    let place = |n: u32| Vector::new(n as Real * 5.0, (n % 7) as Real, (n % 3) as Real);
    let kinds: [fn(Region) -> Field; 4] = [
        |region| Field::wind_zone(Vector::X * 3.0, 0.5, 0.25, region),
        |region| Field::gravity_zone(Vector::Y * 3.0, region),
        |region| Field::conveyor(Vector::Z * 3.0, 2.0, region),
        |region| Field::drag(1.0, 0.5).within(region),
    ];
    for (number, kind) in kinds.into_iter().enumerate() {
        let shaft = || Region::cuboid(half).difference(Region::ball(0.5));
        let mut wrenches = Vec::new();
        for by_region in [false, true] {
            let zone = |n: u32| match by_region {
                true => kind(shaft().at(place(n))),
                false => kind(shaft()).at(place(n)),
            };
            let tree = Tree::fold(Operator::SumUnion, (0..40).map(zone));
            let fields = Fields::new(tree).expect("a sound tree");
            let entries = fields.plan().entries.len();
            assert_eq!(
                entries,
                1,
                "{number}, by the region: {by_region}: {}",
                fields.plan()
            );
            let mut world = weightless(1.0 / 64.0);
            for n in 0..200 {
                let at = Vector::new(n as Real, 0.3 + (n % 11) as Real * 0.5, 0.4);
                insert_ball(&mut world, 2.0, at, Vector::new(0.1, 0.2, -0.3));
            }
            let found = fields.sample_all(0.25, &world);
            wrenches.push(found.expect("finite"));
        }
        let [by_field, by_region] = &wrenches[..] else {
            unreachable!()
        };
        assert!(
            by_field
                .iter()
                .any(|(_, wrench)| wrench.force != Vector::ZERO)
        );
        assert_eq!(by_field, by_region, "{number}");
    }
}
