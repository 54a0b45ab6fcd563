//! A thousand molecules that spin at 3e13 rad/s: fields and Rapier detect the same contacts.

use crate::lab::scenes::ammonia::AmmoniaSettings;
use rapier3d_fields::prelude::*;

const STEPS: usize = 10_000;
/// rad/ps, which is 3e13 rad/s.
const SPIN: Real = 30.0;
/// Å.
const CUTOFF: Real = 10.0;

#[test]
#[ignore = "ten thousand steps of a thousand molecules"]
fn fields_and_rapier_agree_on_molecules_that_spin_fast() {
    let settings = AmmoniaSettings {
        count: 1_000,
        ..AmmoniaSettings::default()
    };
    let mut scene = settings.build().expect("a box");
    for molecule in &scene.molecules {
        let body = &mut scene.world.bodies[molecule.body];
        let axis = body.angvel().normalize_or_zero();
        body.set_angvel(axis * SPIN, true);
    }
    let tree = scene.tree(Some(CUTOFF), ContactLaw::elastic());
    let builder = Fields::builder(tree).cross_check(true);
    let mut fields = scene.fields(builder).expect("valid fields");
    for step in 1..=STEPS {
        fields.step(&mut scene.world).expect("a finite step");
        if step.is_multiple_of(1_000) {
            let report = fields.cross_check().expect("it is on");
            println!("step {step}\n{report}");
        }
    }
    let report = fields.cross_check().expect("it is on");
    assert!(report.total.both > 10_000, "{report}");
    assert_eq!(report.disagreed(), 0, "{report}");
}
