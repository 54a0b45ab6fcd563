//! The forces that come with derivatives are those of the evaluators.

use super::super::linearise::Lineariser;
use super::super::quantity::Terms;
use super::*;
use crate::math::DVec3;
use crate::math::from_dvec3;

/// Very many sources in a lopsided cloud, whose distant cells act as a whole.
fn clouds(_: &PhysicsWorld) -> Vec<Tree> {
    let pull = |k: usize| {
        let place = [k % 7, k % 11, k % 13].map(|n| n as Real * 0.3);
        let place = Vector::new(place[0], 0.4 * place[1] - place[0], place[2] + place[1]);
        let field = Field::point_gravity(0.01 * (k % 5) as Real).softened(0.25);
        field
            .opening_angle(0.9)
            .at(place + Vector::new(3.0, -4.0, 2.0))
    };
    (0..1200).map(|k| Tree::from(pull(k))).collect()
}

/// The wrenches on all bodies, by the lineariser.
fn linearised(stage: &Stage) -> Vec<Wrench> {
    let samples = stage.samples();
    let view = WorldRef::new(&stage.world.bodies, &stage.world.colliders);
    let scene = SampledWorld::new(&stage.compiled, &view, &samples, stage.moment());
    let mut lineariser = Lineariser::default();
    lineariser.prepare(&scene);
    let mut of_body = |body| {
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        lineariser.of_body(&scene, Terms::All, body, |sample, found| {
            force += found.force;
            torque += to_dvec3(sample.arm).cross(found.force);
        });
        let [force, torque] = [force, torque].map(from_dvec3);
        Wrench { force, torque }
    };
    (0..samples.bodies.len()).map(&mut of_body).collect()
}

#[test]
fn forces_with_derivatives_equal_those_of_the_reference() {
    for fields in [radials, far] {
        let stage = Stage::new(fields);
        let want = stage.reference();
        agree(&linearised(&stage), &want, size(&want));
    }
}

#[test]
fn forces_with_derivatives_equal_those_of_cells_that_act_as_a_whole() {
    let stage = Stage::new(clouds);
    let want = stage.evaluate(&mut Radials::default(), all_radials, 0.0);
    agree(&linearised(&stage), &want, size(&want));
    let exact = stage.reference();
    let apart = (want[0].force - exact[0].force).length() / exact[0].force.length();
    assert!(apart > 1e-5, "no cell acts as a whole: {apart}");
}
