//! Contact fields as vector fields (§3.3 and §3.4 of the paper): the paper's law under operators, against `Reference`.

use proptest::prelude::*;
use rapier3d_fields::Responder;
use rapier3d_fields::contact::FieldContact;
use rapier3d_fields::field::{Query, Touch};
use rapier3d_fields::math::{DVec3, from_dvec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::collide::*;
use crate::support::largest;
use crate::support::trees::*;
use crate::support::worlds::{BodyPlan, World};

const RADIUS: Real = 0.6;
const DT: Real = 1e-3;

/// A change of a composite that starts as a contact field.
#[derive(Clone, Debug)]
enum Wrap {
    Before(Operator, TermPlan),
    Behind(Operator, TermPlan),
    /// Combined with the contact field of a ball.
    Beside(Operator, usize),
    Scaled(ScalarPlan),
    Limited(i32),
    Instance,
    /// Combined with instances, at the colliders of all balls, of a contact field and another field.
    Objects(Operator, Operator, TermPlan),
    Layer(TermPlan, i32, bool, bool),
    /// Combined with this number of fields that are out of reach.
    Among(u8),
}

fn wrap() -> impl Strategy<Value = Wrap> {
    let numbers = Numbers::Fractional;
    let operator = || proptest::sample::select(Operator::ALL.to_vec());
    let term = || term(numbers);
    prop_oneof![
        3 => (operator(), term()).prop_map(|(o, t)| Wrap::Before(o, t)),
        3 => (operator(), term()).prop_map(|(o, t)| Wrap::Behind(o, t)),
        3 => (operator(), 0..3_usize).prop_map(|(o, n)| Wrap::Beside(o, n)),
        2 => scalar(numbers).prop_map(Wrap::Scaled),
        1 => (1..4).prop_map(Wrap::Limited),
        1 => Just(Wrap::Instance),
        3 => (operator(), operator(), term()).prop_map(|(o, p, t)| Wrap::Objects(o, p, t)),
        2 => (term(), -1..=1, any::<bool>(), any::<bool>())
            .prop_map(|(t, p, r, s)| Wrap::Layer(t, p, r, s)),
        1 => (60..90_u8).prop_map(Wrap::Among),
    ]
}

fn contact(world: &World, number: usize, law: ContactLaw) -> Tree {
    Field::contact(law).at(world.colliders[number]).into()
}

fn wrapped(tree: Tree, how: &Wrap, world: &World, law: ContactLaw) -> Tree {
    match how {
        Wrap::Before(operator, term) => Tree::fold(*operator, [term.tree(world), tree]),
        Wrap::Behind(operator, term) => Tree::fold(*operator, [tree, term.tree(world)]),
        Wrap::Beside(operator, number) => {
            Tree::fold(*operator, [tree, contact(world, *number, law)])
        }
        Wrap::Scaled(scale) => tree.scaled_at(scale.scalar(), Vector::new(0.3, 0.2, 0.1)),
        Wrap::Limited(limit) => tree.limited_to(*limit as Real),
        Wrap::Instance => Tree::instances(tree, [Anchor::WORLD]),
        Wrap::Objects(operator, within, term) => {
            let object = Tree::fold(*within, [term.tree(world), Field::contact(law).into()]);
            let colliders = world.colliders.iter().copied();
            Tree::fold(*operator, [tree, Tree::instances(object, colliders)])
        }
        Wrap::Layer(term, priority, replaces, stops) => {
            let mut layer = Layer::new(term.tree(world)).priority(*priority);
            if *replaces {
                layer = layer.replacing();
            }
            if *stops {
                layer = layer.stopping();
            }
            Tree::layers([Layer::new(tree), layer])
        }
        Wrap::Among(count) => {
            let far = (0..*count).map(|number| {
                let there = Vector::Y * (100.0 + Real::from(number));
                let field = Field::uniform(Vector::X)
                    .within(Region::ball(0.1))
                    .at(there);
                Tree::from(field)
            });
            Tree::fold(Operator::ReplaceUnion, far.chain([tree]))
        }
    }
}

/// Three balls that overlap and approach.
fn balls() -> World {
    let ball = |x: i32, v: [i32; 3], mass: u32| BodyPlan {
        position: [x, 0, 0],
        linvel: v,
        angvel: [1, 2, -1],
        parts: vec![([0; 3], mass, 2, Some(1))],
    };
    let mut world = World::new(&[
        ball(0, [3, 1, 0], 0),
        ball(1, [0, 0, 1], 1),
        ball(2, [-2, 0, 1], 2),
    ]);
    world.physics.gravity = Vector::ZERO;
    world.physics.integration_parameters.dt = DT;
    for collider in &world.colliders {
        let collider = &mut world.physics.colliders[*collider];
        collider.set_shape(SharedShape::ball(RADIUS));
        // Rapier's solver must resolve none of the contacts.
        collider.set_solver_groups(InteractionGroups::none());
    }
    world
}

/// The change of a ball's velocity by its touches, by `Reference`, with normals and velocities perturbed by `tilt`.
/// `late` is added to the velocities of the balls.
fn expected(
    (tree, tilt): (&Tree, DVec3),
    (world, late): (&World, &[DVec3]),
    contacts: &[FieldContact],
    ball: usize,
) -> DVec3 {
    let (body, collider) = (world.bodies[ball], world.colliders[ball]);
    let (query, _) = world.samples(body).swap_remove(0);
    let pushed = |contact: &&FieldContact| contact.colliders.contains(&collider);
    let velocity = |number: usize, point| {
        to_dvec3(world.physics.bodies[world.bodies[number]].velocity_at_point(point))
    };
    let number = |collider| world.colliders.iter().position(|it| *it == collider);
    let touch = |contact: &FieldContact| {
        let side = usize::from(contact.colliders[1] == collider);
        let other = contact.colliders[1 - side];
        let normal = to_dvec3(contact.world_normal) * [-1.0, 1.0][side] + tilt;
        let at = |ball: usize| velocity(ball, contact.world_point) + late[ball];
        let (own, theirs) = (at(ball), at(number(other).expect("a ball")));
        Touch {
            collider: other,
            world_normal: normal,
            speed: own.length(),
            approach_speed: (theirs - own).dot(normal),
        }
    };
    let alone = Query {
        world_point: to_dvec3(world.physics.bodies[body].translation()),
        world_velocity: velocity(ball, world.physics.bodies[body].translation()) + tilt * 4.0,
        radius: to_f64(RADIUS),
        volume: std::f64::consts::PI * 4.0 / 3.0 * to_f64(RADIUS).powi(3),
        time: to_f64(DT),
        dt: to_f64(DT),
        ..query
    };
    let touching = Query {
        touches: contacts.iter().filter(pushed).map(touch).collect(),
        ..alone.clone()
    };
    let force = |query| reference(tree, world, query).unwrap_or_default();
    (force(&touching) - force(&alone)) * (to_f64(DT) / alone.mass)
}

fn fields(tree: &Tree, world: &World, responder: Responder) -> Fields {
    let builder = Fields::builder(tree.clone()).axis("delta", 2.0);
    let builder = builder.scheme(Scheme::Kick).responder(responder);
    let mut fields = builder.build().expect("a valid tree");
    for collider in &world.colliders {
        let properties = ColliderProperties::new().charge(2.0).axis("delta", 1.0);
        let set = fields.set_properties(*collider, properties, &world.physics.colliders);
        set.expect("valid properties");
    }
    fields
}

fn check(wraps: &[Wrap], first: usize, law: ContactLaw) -> Result<bool, TestCaseError> {
    let (mut world, mut unhit) = (balls(), balls());
    let mut tree = contact(&world, first, law);
    for how in wraps {
        tree = wrapped(tree, how, &world, law);
    }
    let before: Vec<Vector> = world
        .bodies
        .iter()
        .map(|it| world.physics.bodies[*it].linvel())
        .collect();
    let mut fields = [
        fields(&tree, &world, Responder::Fields),
        // The balls before any contact is resolved.
        fields(&tree, &unhit, Responder::Rapier),
    ];
    prop_assume!(fields[0].step(&mut world.physics).is_ok());
    prop_assume!(fields[1].step(&mut unhit.physics).is_ok());
    let fields = &fields[0];
    let contacts = fields.contacts().to_vec();
    let given = |ball: usize| {
        let given = contacts.iter().map(|contact| {
            let body = Some(world.bodies[ball]);
            let side = contact.bodies.iter().position(|it| *it == body);
            side.map_or(DVec3::ZERO, |side| to_dvec3(contact.impulses[side]))
        });
        let mass = to_f64(world.physics.bodies[world.bodies[ball]].mass());
        given.sum::<DVec3>() / mass
    };
    // After a whole kick the velocity is that of the middle of the step, half a kick before its end.
    let mut late = Vec::new();
    for (body, before) in unhit.bodies.iter().zip(&before) {
        // Contacts of bodies that fields press together last, and are left to Rapier.
        let kicked = to_dvec3(unhit.physics.bodies[*body].linvel() - before);
        prop_assume!(kicked.length() < 0.1);
        late.push(kicked * 0.5);
    }
    let given = [0, 1, 2].map(given);
    for (ball, given) in given.into_iter().enumerate() {
        let with = |tilt| expected((&tree, tilt), (&unhit, &late), &contacts, ball);
        let expected = with(DVec3::ZERO);
        let error = (given - expected).length();
        // The effect of rounding, which is large near a tie or in a product of parallel vectors.
        let roundings = 16.0 * to_f64(Real::EPSILON);
        let tilts = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        let tilted = tilts.map(|tilt| (with(tilt * roundings) - expected).length());
        let bound = 4.0 * largest(tilted) + 100.0 * roundings * largest([1.0, expected.length()]);
        prop_assert!(
            error <= bound,
            "ball {ball}: {given} for {expected}; {contacts:#?}"
        );
    }
    let any = given.iter().any(|given| *given != DVec3::ZERO);
    Ok(any)
}

#[test]
fn contact_fields_under_operators_agree_with_the_reference() {
    let pushed = std::cell::Cell::new([0_u32; 2]);
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: 2_000,
        max_global_rejects: 20_000,
        ..ProptestConfig::default()
    });
    let cases = (
        proptest::collection::vec(wrap(), 0..5),
        0..3_usize,
        any::<bool>(),
    );
    let outcome = runner.run(&cases, |(wraps, first, relative)| {
        let law = if relative {
            ContactLaw::PaperRelative
        } else {
            ContactLaw::Paper
        };
        let any = check(&wraps, first, law)?;
        let [with, all] = pushed.get();
        pushed.set([with + u32::from(any), all + 1]);
        Ok(())
    });
    let [with, all] = pushed.get();
    println!("{with} of {all} push");
    outcome.unwrap_or_else(|error| panic!("{error}"));
    assert!(2 * with > all, "{with} of {all} push");
}

/// The velocities of two equal balls after a head-on hit at 2 m/s each; the contact field of the first, modified by
/// `change`, pushes the second.
fn after(change: impl FnOnce(Field) -> Tree) -> [Vector; 2] {
    let (mut world, things) = overlapping([Vector::X * 2.0, -Vector::X * 2.0], [1.0; 2]);
    let [one, two] = things.each_ref().map(|thing| thing.parts[0]);
    let tree = change(Field::contact(ContactLaw::Paper).at(one));
    let mut fields = Fields::new(tree).expect("a valid tree");
    let seen = fields.step(&mut world).expect("a step").contacts;
    assert_eq!(seen, 1, "of {two:?}");
    things.each_ref().map(|thing| linvel(&world, thing))
}

#[test]
fn operators_and_scales_act_on_a_push_as_on_a_vector() {
    let along = |x: Real, y: Real| [Vector::X * 2.0, Vector::new(x, y, 0.0)];
    let half = Scalar::constant(0.5);
    let near = |found: [Vector; 2], expected: [Vector; 2]| {
        for (found, expected) in found.into_iter().zip(expected) {
            assert_near(found, expected, 1e-5, "velocity");
        }
    };
    near(after(Tree::from), along(0.0, 0.0));
    near(after(|it| it.strength(2.0).into()), along(2.0, 0.0));
    near(
        after(|it| it.scaled_by(half.clone()).into()),
        along(-1.0, 0.0),
    );
    near(after(|it| it.limited_to(0.5).into()), along(-1.5, 0.0));
    near(
        after(|it| Tree::from(it).scaled_by(half.clone())),
        along(-1.0, 0.0),
    );
    // The push along x, crossed with z, goes along −y.
    let z = || Field::uniform(Vector::Z);
    near(after(|it| it.cross_union(z())), along(-2.0, -2.0));
    near(
        after(|it| Tree::instances(it, [Anchor::WORLD])),
        along(0.0, 0.0),
    );
    let cut = || Field::uniform(Vector::ZERO).within(Region::ball(0.1));
    near(
        after(|it| it.difference(cut().at(Vector::Y * 9.0))),
        along(0.0, 0.0),
    );
}

/// A pair has one law: a field that only observes pushes by it once, however many such fields there are, and fields with
/// the paper's law push each.
#[test]
fn fields_that_observe_push_once_by_the_law_of_the_other_side() {
    for (observing, pushing, expected) in [(0, 0, 2.0), (1, 0, 0.0), (3, 0, 0.0), (1, 2, -2.0)] {
        let (mut world, things) = overlapping([Vector::X * 2.0, -Vector::X * 2.0], [1.0; 2]);
        let [one, two] = things.each_ref().map(|thing| thing.parts[0]);
        let push = |at| Field::contact(ContactLaw::Paper).at(at);
        let mut tree = Tree::from(push(one));
        (0..observing).for_each(|_| tree += Field::contact(ContactLaw::Observe).at(two));
        (0..pushing).for_each(|_| tree += push(two));
        let mut fields = Fields::new(tree).expect("a valid tree");
        fields.step(&mut world).expect("a step");
        let [first, second] = things.each_ref().map(|thing| linvel(&world, thing));
        let place = format!("{observing} observe, {pushing} push");
        assert_near(first, Vector::X * expected, 1e-5, &place);
        assert_near(second, Vector::ZERO, 1e-5, &place);
    }
}

/// A push counts as the difference that the touch makes to a field as a whole, of which a wind is another part.
#[test]
fn a_wind_and_a_push_are_limited_together() {
    let (mut world, things) = overlapping([Vector::X * 2.0, -Vector::X * 2.0], [1.0; 2]);
    let given: Real = 0.5;
    let per_step = world.integration_parameters.dt.recip();
    let wind = Field::uniform(Vector::Y * (given * per_step));
    let push = Field::contact(ContactLaw::Paper).at(things[0].parts[0]);
    let tree = wind.sum_union(push).limited_to(per_step);
    let mut fields = Fields::new(tree).expect("a valid tree");
    fields.step(&mut world).expect("a step");
    let [pusher, pushed] = things.each_ref().map(|thing| linvel(&world, thing));
    // Nothing touches the field of the second ball, so the first one only gets the wind.
    assert_near(pusher, Vector::new(2.0, given, 0.0), 1e-5, "the pusher");
    // The push is as large as the speed with the wind. Both together are limited to 1 m/s in the step.
    let both = Vector::new((4.0 + given * given).sqrt(), given, 0.0);
    assert_near(
        pushed,
        both.normalize() - Vector::X * 2.0,
        1e-5,
        "the pushed",
    );
}

/// `Fields::at_sample` agrees with `Reference` for a sample with touches, also in prototypes.
#[test]
fn questions_about_samples_include_their_touches() {
    let world = balls();
    let [mine, other, _] = [0, 1, 2].map(|number| world.colliders[number]);
    let pull = || Field::radial(-1.0, 0.0).within(Region::ball(8.0));
    for law in [ContactLaw::Paper, ContactLaw::PaperRelative] {
        let bounce = Field::contact(law).within(Region::ball(2.0 * RADIUS));
        let object = pull().named("pull").replace_union(bounce.named("bounce"));
        let tree = Tree::instances(object, world.colliders.iter().copied());
        let fields = Fields::new(tree.clone()).expect("a valid tree");
        let touch = Touch {
            collider: other,
            world_normal: -DVec3::X,
            speed: 3.0,
            approach_speed: 2.0,
        };
        let mut sample = Query {
            world_point: to_dvec3(world.physics.colliders[mine].translation()),
            body: Some(world.bodies[0]),
            dt: 0.5,
            ..Query::default()
        };
        let mut felt = [Vec::new(), vec![touch]].map(|touches| {
            sample.touches = touches;
            let value = fields.value_for(&sample, &world.physics);
            let expected = reference(&tree, &world, &sample).unwrap_or_default();
            assert_near(value.force, from_dvec3(expected), 1e-5, "force");
            assert!(
                value.fields.iter().any(|it| it.label.contains("bounce")),
                "{value:?}"
            );
            value.force
        });
        felt[1] -= felt[0];
        let push = if law == ContactLaw::Paper { 3.0 } else { 2.0 };
        assert_near(felt[1], -Vector::X * (push / 0.5), 1e-5, "push");
        let explained = fields.explain(world.bodies[0], &world.physics);
        let text = explained.expect("a body that feels fields").to_string();
        assert!(text.contains("overruled (→∪) by field `bounce`"), "{text}");
    }
}

/// A molecule's atoms have no mass of their own: their body has it all.
#[test]
fn a_part_without_mass_is_pushed_too() {
    let pushed = |strength: Real| {
        let (mut world, things) = overlapping([Vector::X * 2.0, -Vector::X * 2.0], [1.0; 2]);
        for thing in &things {
            let (body, part) = (thing.body, thing.parts[0]);
            world.colliders[part].set_mass(0.0);
            let inertia = Vector::splat(0.1);
            let properties = MassProperties::new(Vector::ZERO, 1.0, inertia);
            world.bodies[body].set_additional_mass_properties(properties, true);
            world.bodies[body].recompute_mass_properties_from_colliders(&world.colliders);
        }
        let field = Field::contact(ContactLaw::Paper).at(things[0].parts[0]);
        let mut fields = Fields::new(field.strength(strength)).expect("a valid tree");
        fields.step(&mut world).expect("a step");
        linvel(&world, &things[1])
    };
    assert_near(pushed(1.0), Vector::ZERO, 1e-5, "velocity");
    assert_near(pushed(2.0), Vector::X * 2.0, 1e-5, "velocity");
}
