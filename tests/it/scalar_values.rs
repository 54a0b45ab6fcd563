//! The numbers by which forces are scaled, against their closed forms.

use rapier3d_fields::math::{Real, from_f64, to_f64};
use rapier3d_fields::prelude::*;

use crate::support::{assert_close, insert_ball, weightless};

/// The places at which numbers are compared, none of them on a corner.
const PLACES: [f64; 9] = [-2.3, -1.1, -0.4, 0.15, 0.6, 0.95, 1.7, 2.6, 4.2];

/// The factor of the force on a ball at x = `place`, y = 0.5, z = −0.25.
fn factor(scale: &Scalar, place: f64) -> f64 {
    let mut world = weightless(1e-3);
    let at = Vector::new(from_f64(place), 0.5, -0.25);
    let ball = insert_ball(&mut world, 1.0, at, Vector::ZERO);
    let push = Field::uniform(Vector::Y * 4.0).scaled_by(scale.clone());
    let fields = Fields::new(push).expect("a sound tree");
    let wrench = fields.sample(ball, &world).expect("finite").expect("felt");
    to_f64(wrench.force.y) / 4.0
}

fn assert_equals(name: &str, scale: &Scalar, value: impl Fn(f64) -> f64) {
    for place in PLACES {
        let (found, wanted) = (factor(scale, place), value(place));
        let rounding = 32.0 * to_f64(Real::EPSILON) * wanted.abs().max(1.0);
        assert_close(found, wanted, rounding, format!("{name} at {place}"));
    }
}

/// The share of the way from one number to another, between 0 and 1.
fn share(x: f64, from: f64, to: f64) -> f64 {
    ((x - from) / (to - from)).clamp(0.0, 1.0)
}

/// Straight lines through (−1, 2), (0.5, −1), (2, 3), constant beyond.
fn through_three(x: f64) -> f64 {
    match x {
        x if x < -1.0 => 2.0,
        x if x < 0.5 => 2.0 - 2.0 * (x + 1.0),
        x if x < 2.0 => -1.0 + (x - 0.5) * 8.0 / 3.0,
        _ => 3.0,
    }
}

#[test]
fn curves_have_their_values() {
    let x = || Scalar::axis("x");
    assert_equals("an axis", &x(), |x| x);
    assert_equals("ramp", &x().ramp(-0.5, 1.5), |x| share(x, -0.5, 1.5));
    assert_equals("falling ramp", &x().ramp(1.5, -0.5), |x| {
        share(x, 1.5, -0.5)
    });
    assert_equals("smooth", &x().smooth(-0.5, 1.5), |x| {
        let t = share(x, -0.5, 1.5);
        t * t * (3.0 - 2.0 * t)
    });
    assert_equals("power", &x().power(3.0), |x| x.powi(3));
    assert_equals("inverse", &x().power(-2.0), |x| x.powi(-2));
    assert_equals("exponential", &x().exponential(-0.7), |x| (-0.7 * x).exp());
    assert_equals("gaussian", &x().gaussian(0.8), |x| {
        (-x * x / (2.0 * 0.8 * 0.8)).exp()
    });
    let table = x().table([(-1.0, 2.0), (0.5, -1.0), (2.0, 3.0)]);
    assert_equals("table", &table, through_three);
    assert_equals("table of one", &x().table([(1.0, 0.5)]), |_| 0.5);
}

#[test]
fn numbers_are_combined() {
    let (x, y) = (|| Scalar::axis("x"), || Scalar::axis("y"));
    assert_equals("plus", &x().plus(y()), |x| x + 0.5);
    assert_equals("times", &x().times(y()), |x| x * 0.5);
    assert_equals("min", &x().min(y()), |x| x.min(0.5));
    assert_equals("max", &x().max(y()), |x| x.max(0.5));
    assert_equals("constant", &Scalar::constant(-1.5), |_| -1.5);
    // The last operation applies to all before it.
    let nested = x()
        .plus(Scalar::constant(1.0))
        .times(y().max(x()))
        .power(2.0);
    assert_equals("nested", &nested, |x| ((x + 1.0) * x.max(0.5)).powi(2));
}

#[test]
fn places_have_their_distance_and_depth() {
    assert_equals("distance", &Scalar::distance(), |x| {
        (x * x + 0.25 + 0.0625).sqrt()
    });
    let ball = Scalar::depth(Region::ball(2.0));
    assert_equals("in a ball", &ball, |x| 2.0 - (x * x + 0.25 + 0.0625).sqrt());
    let around = Scalar::depth(Region::ball(2.0).complement());
    assert_equals("around a ball", &around, |x| {
        (x * x + 0.25 + 0.0625).sqrt() - 2.0
    });
    let below = Scalar::depth(Region::half_space(Vector::X, 1.0));
    assert_equals("behind a plane", &below, |x| 1.0 - x);
    let slab = Scalar::depth(Region::interval("x", -1.5, 2.0));
    assert_equals("in a slab", &slab, |x| (x + 1.5).min(2.0 - x));
    let distances = Scalar::depth(Region::interval("distance", 0.75, 2.5));
    let distance = |x: f64| (x * x + 0.25 + 0.0625).sqrt();
    assert_equals("between distances", &distances, |x| {
        (distance(x) - 0.75).min(2.5 - distance(x))
    });
    let cuboid = Scalar::depth(Region::cuboid(Vector::new(1.5, 0.75, 2.0)));
    assert_equals("in a box", &cuboid, |x| (1.5 - x.abs()).min(0.25));
    let cylinder = Scalar::depth(Region::cylinder(0.75, 2.0));
    let around = |x: f64| (x * x + 0.0625).sqrt();
    assert_equals("in a cylinder", &cylinder, |x| (2.0 - around(x)).min(0.25));
    let slanted = [(Axis::X, 3.0), (Axis::Y, -4.0)];
    let slanted = Scalar::depth(Region::half_space_over(slanted, 2.0));
    assert_equals("behind a plane over axes", &slanted, |x| {
        (2.0 - (3.0 * x - 2.0)) / 5.0
    });
    let stretched = [(Axis::X, 0.5, 2.0), (Axis::Y, 0.0, 1.0)];
    let stretched = Scalar::depth(Region::ball_over(stretched));
    assert_equals("in a ball over axes", &stretched, |x| {
        1.0 - (((x - 0.5) / 2.0).powi(2) + 0.25).sqrt()
    });
}

#[test]
fn times_are_those_of_the_step() {
    let mut world = weightless(0.125);
    let ball = insert_ball(&mut world, 1.0, Vector::ZERO, Vector::ZERO);
    let push = Field::uniform(Vector::Y).scaled_by(Scalar::time().ramp(0.0, 2.0));
    let mut fields = Fields::builder(push)
        .scheme(Scheme::Kick)
        .build()
        .expect("valid");
    let mut speed = 0.0;
    for step in 0..8 {
        fields.step(&mut world).expect("a step");
        speed += 0.125 * share(0.125 * f64::from(step), 0.0, 2.0);
        let found = to_f64(world.bodies[ball].linvel().y);
        assert_close(found, speed, 1e-6, format!("step {step}"));
    }
}
