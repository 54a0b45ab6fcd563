//! The contact laws under discrete and swept detection: conserved quantities, responders and events.

use rapier3d_fields::contact::ContactEvent;
use rapier3d_fields::math::{Vector, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::collide::*;
use crate::support::{assert_close, either};

/// Fields that sweep.
fn swept(things: &[&Thing], law: ContactLaw) -> Fields {
    let builder = Fields::builder(touch(parts(things), law)).detection(Detection::Swept);
    builder.build().expect("a valid tree")
}

#[test]
fn two_balls_hit_at_once_share_evenly() {
    for detection in [Detection::Discrete, Detection::Swept] {
        let mut world = arena(from_f64(1.0 / 64.0));
        // The cue ball meets two others at the same moment, on either side of its path.
        let half: Real = 0.5;
        let beside = half * 1.01;
        let cue = ball(
            &mut world,
            1.0,
            Vector::new(-3.0, 0.0, 0.0),
            Vector::X * 4.0,
        );
        let up = ball(&mut world, 1.0, Vector::Y * beside, Vector::ZERO);
        let down = ball(&mut world, 1.0, Vector::Y * -beside, Vector::ZERO);
        let tree = touch(parts(&[&cue, &up, &down]), ELASTIC);
        let mut fields = Fields::builder(tree)
            .detection(detection)
            .build()
            .expect("a tree");
        let before = Totals::of(&world);
        for _ in 0..80 {
            step(&mut fields, &mut world);
        }
        before.assert_kept(&Totals::of(&world), 16.0);
        let [up, down] = [&up, &down].map(|thing| linvel(&world, thing));
        assert!(up.x > 0.5 && up.y > 0.5, "{up}");
        assert_near(
            down,
            Vector::new(up.x, -up.y, 0.0),
            8.0 * rounding(),
            "a mirror image",
        );
        assert_close(
            to_f64(linvel(&world, &cue).y),
            0.0,
            8.0 * rounding(),
            "straight on",
        );
    }
}

#[test]
fn a_cradle_passes_the_velocity_to_the_last_ball() {
    let mut world = arena(from_f64(0.1));
    let row = [-3.0, 0.0, 1.0, 2.0].map(|x| Vector::X * x);
    let balls = row.map(|place| {
        let speed = if place.x < -1.0 { 5.0 } else { 0.0 };
        ball(&mut world, 2.0, place, Vector::X * speed)
    });
    let mut fields = swept(&[&balls[0], &balls[1], &balls[2], &balls[3]], ELASTIC);
    for _ in 0..10 {
        step(&mut fields, &mut world);
    }
    for (place, thing) in balls.iter().enumerate() {
        let expected = if place == 3 {
            Vector::X * 5.0
        } else {
            Vector::ZERO
        };
        assert_near(
            linvel(&world, thing),
            expected,
            4.0 * rounding(),
            "the last one flies",
        );
    }
}

/// The energy of two spinning tops before and after they meet; asserts that momenta are conserved.
fn tops(law: ContactLaw) -> (f64, f64) {
    let mut world = arena(from_f64(1.0 / 50.0));
    let things = [-2.5, 2.5].map(|x| {
        let place = Vector::new(from_f64(x), from_f64(0.1 * x), 0.0);
        let body = RigidBodyBuilder::dynamic()
            .translation(place)
            .linvel(place * -2.0);
        asymmetric(
            &mut world,
            body.angvel(Vector::new(1.0, from_f64(x), 3.0)),
            1.0,
        )
    });
    let mut fields = swept(&[&things[0], &things[1]], law);
    let before = Totals::of(&world);
    let mut touches = 0;
    for _ in 0..100 {
        let outcome = fields.step(&mut world).expect("a step");
        touches += outcome.contacts;
        // Tops that stick and roll could touch without end.
        assert!(!outcome.exhausted && outcome.contacts < 200, "{outcome:?}");
    }
    assert!(touches > 0);
    let after = Totals::of(&world);
    // A rounding for each touch.
    let roundings = 400.0 + touches as f64;
    match law {
        // A pair that stays together is handed over to Rapier's solver, which lost 2.6e-4 of the angular momentum.
        ContactLaw::Impulse {
            restitution: 0.0, ..
        } => {
            before.assert_momentum_kept(&after, roundings);
            before.assert_angular_momentum_kept(&after, 5e-4);
        }
        _ => before.assert_momenta_kept(&after, roundings),
    }
    (before.energy, after.energy)
}

#[test]
fn tops_keep_momenta_and_lose_only_what_the_law_takes() {
    let (before, after) = tops(ELASTIC);
    // The free rotation by this crate conserves the energy to 1e-5.
    assert_close(after / before, 1.0, 2e-5, "elastic");
    for law in [
        ELASTIC.with_friction(0.3),
        ContactLaw::restitution(0.5),
        ContactLaw::restitution(0.0).with_friction(2.0),
    ] {
        let (before, after) = tops(law);
        assert!(after < before * 0.999, "{law:?}: {before} {after}");
    }
}

/// The linear and angular velocity of a ball (moment of inertia 2/5 m r²) after it hits a fixed plane.
fn skid(friction: f64) -> (Vector, Vector) {
    let mut world = arena(from_f64(1.0 / 50.0));
    let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::Y));
    let floor = world.colliders.insert(plane);
    let velocity = Vector::new(3.0, -4.0, 0.0);
    let thing = ball(&mut world, 1.0, Vector::Y * 1.5, velocity);
    let law = ContactLaw::elastic().with_friction(from_f64(friction));
    let tree = touch([thing.parts[0], floor], law);
    let builder = Fields::builder(tree).detection(Detection::Swept);
    let mut fields = builder.build().expect("a valid tree");
    for _ in 0..25 {
        step(&mut fields, &mut world);
    }
    let body = &world.bodies[thing.body];
    (body.linvel(), body.angvel())
}

#[test]
fn friction_is_coulombs() {
    // Sliding: the change along the floor is friction times that across it.
    let (linvel, angvel) = skid(0.1);
    assert_near(
        linvel,
        Vector::new(from_f64(3.0 - 0.8), 4.0, 0.0),
        8.0 * rounding(),
        "slides",
    );
    // Torque μ·2v·r over 2/5 m r².
    assert_near(
        angvel,
        Vector::Z * from_f64(-0.8 * 0.5 / 0.1),
        40.0 * rounding(),
        "spun up",
    );
    // Rolling: 2/7 of the speed is lost, whatever the friction.
    for friction in [0.3, 5.0] {
        let (linvel, angvel) = skid(friction);
        let rolls = 3.0 * 5.0 / 7.0;
        assert_near(
            linvel,
            Vector::new(from_f64(rolls), 4.0, 0.0),
            8.0 * rounding(),
            "rolls",
        );
        assert_near(
            angvel,
            Vector::Z * from_f64(-rolls / 0.5),
            40.0 * rounding(),
            "rolls",
        );
    }
}

#[test]
fn paper_relative_is_elastic_for_equal_masses_only() {
    let after = |mass: Real, law: ContactLaw| {
        let velocities = [Vector::new(2.0, 1.0, 0.0), Vector::new(-1.0, 0.0, 2.0)];
        let (mut world, [a, b]) = overlapping(velocities, [1.0, mass]);
        let mut fields = detect(&[&a, &b], law);
        let before = Totals::of(&world);
        step(&mut fields, &mut world);
        (
            before,
            Totals::of(&world),
            [linvel(&world, &a), linvel(&world, &b)],
        )
    };
    let (before, end, [a, b]) = after(1.0, ContactLaw::PaperRelative);
    before.assert_kept(&end, 8.0);
    assert_near(a, Vector::new(-1.0, 1.0, 0.0), rounding(), "exchanged");
    assert_near(b, Vector::new(2.0, 0.0, 2.0), rounding(), "exchanged");
    let (before, end, _) = after(3.0, ContactLaw::PaperRelative);
    let lost = before.momentum.distance(end.momentum);
    assert_close(lost, 6.0, 1e-5, "3 at unit mass, 9 at three");
    let (before, end, _) = after(1.0, ContactLaw::Paper);
    assert!(
        (end.energy / before.energy - 1.0).abs() > 0.1,
        "{}",
        end.energy
    );
}

/// A ball between two walls that both push it: the damping of both together is solved for the velocity that it leaves.
#[test]
fn damped_springs_on_both_sides_are_solved_together() {
    let (dt, mass, stiffness, damping, speed) = (1.0 / 64.0, 2.0, 100.0, 8.0, 0.125);
    let mut world = arena(from_f64(dt));
    let ball = ball(
        &mut world,
        from_f64(mass),
        Vector::ZERO,
        Vector::X * from_f64(speed),
    );
    let law = ContactLaw::Penalty {
        stiffness: from_f64(stiffness),
        damping: from_f64(damping),
    };
    let mut parts = vec![ball.parts[0]];
    for side in [-0.95, 0.95] {
        let wall = ColliderBuilder::cuboid(0.5, 2.0, 2.0);
        parts.push(world.colliders.insert(wall.translation(Vector::X * side)));
    }
    let mut fields = Fields::new(touch(parts, law)).expect("a valid tree");
    fields.step(&mut world).expect("a step");
    assert_eq!(fields.contacts().len(), 2);
    // The sums of spring and damping on the two sides differ by twice k v dt + c v, and the impulses of both take
    // themselves from the damping.
    let push = 2.0 * (stiffness * dt / damping + 1.0) * speed;
    let difference = push / (2.0 / mass + (damping * dt).recip());
    let wanted = speed - difference / mass;
    let found = to_f64(linvel(&world, &ball).x);
    assert_close(found, wanted, 1e-4, "the velocity");
}

/// Both bodies stand still at their centres of mass, and gravity makes slow contacts lasting ones: the speed that counts
/// is that of the points of contact.
#[test]
fn a_rod_that_turns_on_the_floor_hits_a_ball() {
    for detection in [Detection::Discrete, Detection::Swept] {
        let mut world = arena(1.0 / 240.0);
        world.gravity = Vector::Y * -9.81;
        let floor = ColliderBuilder::cuboid(9.0, 0.5, 9.0).friction(0.0);
        world.colliders.insert(floor.translation(Vector::Y * -0.5));
        let turning = RigidBodyBuilder::dynamic().translation(Vector::Y * 0.25);
        let turning = turning.angvel(Vector::Y * -2.0).can_sleep(false);
        let rod = ColliderBuilder::cuboid(1.25, 0.25, 0.1);
        let rod = rod.friction(0.0).mass(1.0);
        let (rod, one) = world.insert(turning, rod);
        let lying = RigidBodyBuilder::dynamic().translation(Vector::new(1.0, 0.25, 0.45));
        let ball = ColliderBuilder::ball(0.25).friction(0.0).mass(0.5);
        let (ball, other) = world.insert(lying.can_sleep(false), ball);
        let tree = touch([one, other], ContactLaw::restitution(0.8));
        let builder = Fields::builder(tree).detection(detection);
        let mut fields = builder.build().expect("a valid tree");
        let inertia = (1.25_f64.powi(2) + 0.1_f64.powi(2)) / 3.0;
        let energy = |world: &PhysicsWorld| {
            let speed2 = |it: RigidBodyHandle| to_f64(world.bodies[it].linvel().length_squared());
            let spin = to_f64(world.bodies[rod].angvel().y);
            0.5 * (speed2(rod) + inertia * spin * spin) + 0.25 * speed2(ball)
        };
        let before = energy(&world);
        for _ in 0..30 {
            fields.step(&mut world).expect("a step");
        }
        // The rod turns by 0.0985 until the ball is 0.35 from its axis; there the ball is 1.039 from its middle.
        let (arm, bounce) = (1.039_f64, 0.8_f64);
        let mass = (1.0 + 2.0 + arm * arm / inertia).recip();
        let lost = 0.5 * (1.0 - bounce * bounce) * mass * (2.0 * arm).powi(2);
        let found = before - energy(&world);
        assert_close(found, lost, 0.03 * lost, format!("{detection:?}"));
    }
}

#[test]
fn a_spring_gives_the_energy_back() {
    for detection in [Detection::Discrete, Detection::Swept] {
        let mut world = arena(from_f64(1e-3));
        let [a, b] =
            [-1.0, 1.0].map(|x: Real| ball(&mut world, 1.0, Vector::X * x, Vector::X * -x));
        let law = |damping: Real| ContactLaw::Penalty {
            stiffness: 500.0,
            damping,
        };
        let fields = |damping| {
            let tree = touch(parts(&[&a, &b]), law(damping));
            Fields::builder(tree)
                .detection(detection)
                .build()
                .expect("a valid tree")
        };
        let mut elastic = fields(0.0);
        let before = Totals::of(&world);
        for _ in 0..1000 {
            step(&mut elastic, &mut world);
        }
        let bounced = Totals::of(&world);
        // The error is of first order in dt·ω: 0.03.
        assert_close(bounced.energy / before.energy, 1.0, 0.03, "a bounce");
        assert!(linvel(&world, &b).x > 0.9, "{}", linvel(&world, &b));
        before.assert_momenta_kept(&bounced, 200.0);
        for thing in [&a, &b] {
            let back = -linvel(&world, thing);
            world.bodies[thing.body].set_linvel(back, true);
        }
        let mut damped = fields(5.0);
        for _ in 0..1500 {
            step(&mut damped, &mut world);
        }
        let after = Totals::of(&world).energy;
        assert!(after < 0.9 * bounced.energy && after > 0.0, "{after}");
    }
}

#[test]
fn extremes_of_mass_speed_and_overlap_keep_energy_and_momenta() {
    for ratio in [1e-6, 1.0, 1e6] {
        for speed in [1e-6, 1.0, 1e6] {
            for place in [Vector::ZERO, Vector::X * 0.3, Vector::X * 2.0] {
                let mut world = arena(from_f64(0.01));
                let a = ball(&mut world, 1.0, Vector::ZERO, Vector::X * from_f64(speed));
                let b = ball(
                    &mut world,
                    from_f64(ratio),
                    place,
                    Vector::X * from_f64(-speed),
                );
                let mut fields = swept(&[&a, &b], ELASTIC);
                let before = Totals::of(&world);
                for _ in 0..20 {
                    let outcome = fields.step(&mut world).expect("a step");
                    assert!(!outcome.exhausted);
                }
                before.assert_kept(&Totals::of(&world), 32.0);
            }
        }
    }
}

#[test]
fn a_bouncing_ball_comes_to_rest() {
    let mut world = arena(from_f64(1.0 / 60.0));
    world.gravity = Vector::Y * -9.81;
    let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::Y));
    let floor = world.colliders.insert(plane);
    let drop = ball(&mut world, 1.0, Vector::Y * 2.0, Vector::ZERO);
    let tree = touch([floor, drop.parts[0]], ContactLaw::restitution(0.5));
    let builder = Fields::builder(tree).detection(Detection::Swept);
    let mut fields = builder.build().expect("a valid tree");
    for _ in 0..600 {
        assert!(!fields.step(&mut world).expect("a step").exhausted);
    }
    let height = to_f64(world.bodies[drop.body].translation().y);
    assert_close(height, 0.5, 3e-3, "at rest on the floor");
}

#[test]
fn swept_capsules_do_not_pass_through_a_wall() {
    let mut world = arena(from_f64(1.0 / 60.0));
    let slab = ColliderBuilder::cuboid(0.05, 5.0, 5.0);
    let wall = insert(&mut world, RigidBodyBuilder::fixed(), [slab]);
    let bullet = RigidBodyBuilder::dynamic()
        .translation(Vector::X * -4.0)
        .linvel(Vector::X * 300.0);
    let bullet = insert(
        &mut world,
        bullet.can_sleep(false),
        [ColliderBuilder::capsule_x(0.1, 0.1)],
    );
    let marble = ball(
        &mut world,
        1.0,
        Vector::new(-4.0, 3.0, 0.0),
        Vector::X * 500.0,
    );
    let mut fields = swept(&[&wall, &bullet, &marble], ELASTIC);
    let mut times = Vec::new();
    for _ in 0..3 {
        step(&mut fields, &mut world);
        times.extend(fields.contacts().iter().filter_map(|c| c.time_of_impact));
    }
    assert_eq!(times.len(), 2);
    let tolerance = either(1e-6, 1e-9);
    assert_close(times[0], 3.45 / 500.0, tolerance, "the marble");
    assert_close(times[1], 3.75 / 300.0, tolerance, "the capsule");
    assert_near(linvel(&world, &marble), Vector::X * -500.0, 1e-3, "back");
    assert_near(linvel(&world, &bullet), Vector::X * -300.0, 1e-1, "back");
}

/// A tree with repulsion outside and collision inside (§3.4 of the paper): the speed of a ball after it meets a
/// fixed one, over its speed before, and whether they touched.
fn avoid_and_collide(speed: f64, responder: Responder) -> (f64, bool) {
    let mut world = arena(from_f64(1e-3));
    let fixed = insert(
        &mut world,
        RigidBodyBuilder::fixed(),
        [ColliderBuilder::ball(0.5).restitution(1.0)],
    );
    let start = Vector::X * from_f64(4.0);
    let body = RigidBodyBuilder::dynamic()
        .linvel(Vector::X * from_f64(-speed))
        .can_sleep(false);
    let part = ColliderBuilder::ball(0.5).mass(1.0).restitution(1.0);
    let comer = insert(&mut world, body.translation(start), [part]);
    let avoidance = Field::radial(10.0, 0.0)
        .within(Region::ball(3.0))
        .at(fixed.body);
    let tree = avoidance.sum_union(touch(parts(&[&fixed, &comer]), ELASTIC));
    let builder = Fields::builder(tree)
        .responder(responder)
        .detection(Detection::Swept);
    let mut fields = builder.build().expect("a valid tree");
    let mut touched = false;
    for _ in 0..(9.0 / speed / 1e-3) as usize {
        touched |= step(&mut fields, &mut world) > 0;
    }
    (to_f64(linvel(&world, &comer).x) / speed, touched)
}

#[test]
fn avoidance_outside_and_collision_inside_fit_in_one_tree() {
    let (back, touched) = avoid_and_collide(2.0, Responder::Fields);
    assert!(!touched, "the slow one turns round");
    assert_close(back, 1.0, 0.02, "and leaves as it came");
    let (back, touched) = avoid_and_collide(8.0, Responder::Fields);
    assert!(touched, "the fast one gets through to the inner field");
    assert_close(back, 1.0, 0.02, "one bounce, answered once");
}

#[test]
fn the_responder_can_be_set_for_each_pair() {
    for (responder, answered) in [(Responder::Fields, true), (Responder::Rapier, false)] {
        let mut world = arena(from_f64(1.0 / 240.0));
        let mut bouncing = |y: Real| {
            [-1.0, 1.0].map(|side: Real| {
                let place = Vector::new(side, y, 0.0);
                let body = RigidBodyBuilder::dynamic().linvel(Vector::X * -side);
                let part = ColliderBuilder::ball(0.5).mass(1.0).restitution(1.0);
                insert(&mut world, body.translation(place).can_sleep(false), [part])
            })
        };
        let (special, usual) = (bouncing(0.0), bouncing(5.0));
        let all = [&special[0], &special[1], &usual[0], &usual[1]];
        let everywhere = match responder {
            Responder::Fields => Responder::Rapier,
            _ => Responder::Fields,
        };
        let builder = Fields::builder(touch(parts(&all), ContactLaw::restitution(0.5)));
        let pair = [special[0].parts[0], special[1].parts[0]];
        let builder = builder
            .responder(everywhere)
            .responder_among(pair, responder);
        let mut fields = builder.build().expect("a valid tree");
        for _ in 0..240 {
            step(&mut fields, &mut world);
        }
        for (things, by_fields) in [(&special, answered), (&usual, !answered)] {
            let speed = to_f64(linvel(&world, &things[1]).x);
            let expected = if by_fields { 0.5 } else { 1.0 };
            assert_close(speed, expected, 2e-2, format!("{responder:?} {by_fields}"));
        }
    }
}

#[test]
fn events_report_the_start_and_end_of_a_contact() {
    let mut world = arena(from_f64(0.1));
    let [a, b] = [-1.0, 1.0].map(|x: Real| ball(&mut world, 1.0, Vector::X * x, Vector::X * -x));
    let (sender, events) = std::sync::mpsc::channel();
    let builder = Fields::builder(touch(parts(&[&a, &b]), ELASTIC)).events(sender);
    let mut fields = builder
        .detection(Detection::Swept)
        .build()
        .expect("a valid tree");
    for _ in 0..10 {
        step(&mut fields, &mut world);
    }
    let events: Vec<ContactEvent> = events.try_iter().collect();
    let [
        ContactEvent::Started {
            colliders,
            time,
            impulse,
        },
        ContactEvent::Stopped { time: end, .. },
    ] = events[..]
    else {
        panic!("{events:?}");
    };
    assert_eq!(colliders, [a.parts[0], b.parts[0]]);
    assert_close(time, 0.5, 1e-6, "they meet in the middle");
    assert!(end > time && end < 0.8, "{end}");
    assert_near(impulse, Vector::X * 2.0, rounding(), "impulse");
}

#[test]
fn an_error_after_a_swept_answer_restores_the_world() {
    let mut world = arena(from_f64(0.1));
    let [a, b] = [-1.0, 1.0].map(|x: Real| {
        ball(
            &mut world,
            1.0,
            Vector::X * x,
            Vector::X * from_f64(-9.0 * to_f64(x)),
        )
    });
    // NaN in the second half of the first step, after the bounce.
    let trap = Field::closure([Axis::Time], |sample: &Sample| {
        let late = sample.axes[0] > 0.05;
        if late {
            Vector::X * Real::NAN
        } else {
            Vector::ZERO
        }
    });
    let tree = trap.sum_union(touch(parts(&[&a, &b]), ELASTIC));
    let mut fields = Fields::builder(tree)
        .detection(Detection::Swept)
        .on_fault(FaultPolicy::Refuse)
        .build()
        .expect("a tree");
    let before: Vec<_> = world
        .bodies
        .iter()
        .map(|(_, body)| (*body.position(), body.linvel()))
        .collect();
    assert!(fields.step(&mut world).is_err());
    let after: Vec<_> = world
        .bodies
        .iter()
        .map(|(_, body)| (*body.position(), body.linvel()))
        .collect();
    assert_eq!(before, after);
}
