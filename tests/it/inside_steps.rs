//! Steps that are divided or made again: their times, borders and faults inside them, and what divides them.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::numbers::Numbers;
use crate::support::{assert_at_most, build, insert_ball, weightless};

const DT: f64 = 1.0 / 60.0;

/// The velocity of a unit mass that comes back out of a spring that begins at zero and becomes stiffer with time.
fn thrown_back(start: f64, speed: f64, omega2: impl Fn(f64) -> f64) -> f64 {
    let parts = 2000;
    let h = DT / f64::from(parts);
    let (mut x, mut v, mut time) = (start, speed, 0.0);
    while x >= 0.0 || v >= 0.0 {
        let pull = |x: f64, time: f64| -omega2(time) * x.max(0.0);
        v += 0.5 * h * pull(x, time);
        x += h * v;
        time += h;
        v += 0.5 * h * pull(x, time);
    }
    v
}

/// A step that is made again, because the body has met a stiff field, evaluates the field at the times of that step.
#[test]
fn steps_that_are_made_again_begin_at_their_own_time() {
    let speed = 1.0;
    for swing in [0.5, 1.0, 2.0] {
        let omega2 = move |time: f64| (swing / DT).powi(2) * (1.0 + 40.0 * time);
        let pull = move |sample: &Sample| {
            let time = sample.time;
            Vector::X * -sample.local_point.x * from_f64(omega2(to_f64(time)))
        };
        let wall = || {
            let right = Region::half_space(-Vector::X, 0.0);
            Field::closure([Axis::Time], pull).within(right)
        };
        for entry in [0.1, 0.3, 0.6, 0.9] {
            let start = -(2.0 + entry) * DT * speed;
            let mut world = weightless(from_f64(DT));
            let at = Vector::X * from_f64(start);
            let ball = insert_ball(&mut world, 1.0, at, Vector::X * from_f64(speed));
            let mut fields = build(wall(), Scheme::auto(1e-4));
            for _ in 0..30 {
                fields.step(&mut world).expect("a step");
            }
            let found = to_f64(world.bodies[ball].linvel().x);
            let wanted = thrown_back(start, speed, omega2);
            assert_at_most((found - wanted).abs(), 1e-4, format!("{swing} {entry}"));
        }
    }
}

/// Springs behind a border at which their force begins at zero: the error of the energy is below the tolerance, or a
/// step warns, wherever in a step the border is. There are two passes of it, and errors add up.
#[test]
fn bends_of_the_force_count_in_the_tolerance() {
    let mut numbers = Numbers::new(7);
    for case in 0..150 {
        let swing = numbers.within(0.01, 10.0);
        let tolerance = numbers.within(1e-4, 1e-2);
        let stiffness = from_f64((swing / DT).powi(2));
        let pull = move |sample: &Sample| Vector::X * (-stiffness * sample.local_point.x);
        let behind = Region::half_space(-Vector::X, 0.0);
        let wall = Field::closure([], pull).within(behind);
        let mut world = weightless(from_f64(DT));
        let start = Vector::X * from_f64(-numbers.within(2.0, 3.0) * DT);
        let ball = insert_ball(&mut world, 1.0, start, Vector::X);
        let mut fields = build(wall, Scheme::auto(from_f64(tolerance)));
        let mut warned = 0;
        let most = (std::f64::consts::PI / swing) as usize + 10;
        for _ in 0..most {
            warned += fields.step(&mut world).expect("a step").warnings;
        }
        let speed = to_f64(world.bodies[ball].linvel().x);
        assert!(speed < 0.0, "{case}: it has not come back: {speed}");
        if warned == 0 {
            let what = format!("{case}: swing {swing}, tolerance {tolerance}");
            assert_at_most((speed * speed - 1.0).abs() / tolerance, 2.0, what);
        }
    }
}

/// Two of three bodies that attract each other pass closely, so that their step is divided into parts of unequal
/// lengths. The third is divided with them, although its own motion does not need it: the momentum is kept.
#[test]
fn bodies_that_act_on_each_other_are_divided_unevenly_together() {
    for (miss, tolerance) in [(1e-2, 1e-2), (3e-3, 1e-2), (3e-3, 1e-3)] {
        let mut world = weightless(from_f64(DT));
        let bodies = [
            (1.0, Vector::ZERO, Vector::ZERO),
            (1.0, Vector::new(1.0, miss, 0.0), Vector::X * -2.0),
            (20.0, Vector::new(0.5, 0.0, 1.5), Vector::ZERO),
        ];
        let bodies = bodies.map(|(mass, place, linvel)| {
            let ball = insert_ball(&mut world, mass, place, linvel);
            let collider = world.bodies[ball].colliders()[0];
            world.colliders[collider].set_collision_groups(InteractionGroups::none());
            (ball, mass)
        });
        let [one, two, three] =
            bodies.map(|(ball, mass)| Field::point_gravity(mass).reacting().at(ball));
        let mut fields = build(one + two + three, Scheme::auto(tolerance));
        let momenta =
            |world: &PhysicsWorld| bodies.map(|(ball, mass)| world.bodies[ball].linvel() * mass);
        let sum = |momenta: [Vector; 3]| momenta.into_iter().sum::<Vector>();
        let before = sum(momenta(&world));
        for step in 0..60 {
            fields.step(&mut world).expect("a step");
            let now = momenta(&world);
            let largest = now.map(|it| it.length()).into_iter().fold(1.0, Real::max);
            let off = (sum(now) - before).length() / largest;
            let what = format!("{miss} {tolerance}: step {step}");
            assert_at_most(to_f64(off), 1e3 * to_f64(Real::EPSILON), what);
        }
    }
}

/// A field that is infinite at a place that the body passes inside the step: the rest of the step and of the fields
/// count.
#[test]
fn contributions_that_are_infinite_inside_a_step_are_left_out() {
    // The shares of the kicks that are outside of that place: five of eight, and two of one sixth. The plan of `Auto` has
    // no point there.
    for (scheme, share) in [
        (Scheme::Substep(Substeps::Fixed(8)), 0.625),
        (Scheme::Forward4, 1.0 / 3.0),
        (Scheme::auto(1e-3), 1.0),
    ] {
        let mut world = weightless(from_f64(DT));
        let start = Vector::X / from_f64(DT);
        let ball = insert_ball(&mut world, 1.0, Vector::ZERO, start);
        let bad = |sample: &Sample| {
            let is_middle = (sample.local_point.x - 0.5).abs() < 0.2;
            if is_middle {
                Vector::Y * Real::INFINITY
            } else {
                Vector::Y
            }
        };
        let tree = Field::closure([], bad).sum_union(Field::uniform(Vector::Z));
        let builder = Fields::builder(tree).scheme(scheme);
        let mut fields = builder
            .on_fault(FaultPolicy::LeaveOut)
            .build()
            .expect("valid");
        fields.step(&mut world).expect("a step");
        let given = (world.bodies[ball].linvel() - start) / from_f64(DT);
        let wanted = Vector::new(0.0, from_f64(share), 1.0);
        assert_at_most(
            to_f64((given - wanted).length()),
            1e-3,
            format!("{scheme:?}"),
        );
        let told = fields.warnings().iter();
        let told = told.filter(|it| matches!(it, StepWarning::LeftOut { .. }));
        assert_eq!(told.count(), usize::from(share < 1.0), "{scheme:?}");
    }
}
