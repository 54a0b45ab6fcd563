//! Forces that are scaled by a number which varies over a body.

use rapier3d_fields::math::{Real, Rotation, to_f64};
use rapier3d_fields::prelude::*;

use crate::sampling::{one, wrench};
use crate::support::assert_at_most;

/// A force along x that grows along a bar is summed over the bar, whether the field or the whole tree is scaled:
/// F = f m (1/2 + y/4), so that its torque about the middle is −f m/4 times the mean of y², a third of 1.5².
#[test]
fn a_scale_that_varies_over_a_bar_turns_it() {
    let growing = || Scalar::axis("y").ramp(-2.0, 2.0);
    let push = |x: Real| Field::uniform(Vector::X * x).force_mode(ForceMode::Acceleration);
    let trees = [
        ("a field", Tree::from(push(8.0).scaled_by(growing()))),
        ("a tree", Tree::from(push(8.0)).scaled_by(growing())),
        ("a sum", push(5.0).sum_union(push(3.0)).scaled_by(growing())),
    ];
    for (name, tree) in trees {
        let mut fields = Fields::new(tree).expect("a sound tree");
        let bar = ColliderBuilder::cuboid(0.1, 1.5, 0.1).mass(2.0);
        let (world, body) = one(Vector::ZERO, Rotation::IDENTITY, bar);
        let (force, torque) = wrench(&mut fields, &world, body);
        let rounding = 64.0 * to_f64(Real::EPSILON);
        assert_at_most((force.x - 8.0).abs(), 16.0 * rounding, name);
        assert_at_most((torque.z + 3.0).abs(), 16.0 * rounding, name);
    }
}
