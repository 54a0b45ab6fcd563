//! What a plan says of fields: how bodies are sampled for them, and why some are left out.

use rapier3d_fields::math::Rotation;
use rapier3d_fields::prelude::*;

use crate::sampling::one;

#[test]
fn plans_say_how_bodies_are_sampled() {
    let tree = Field::point_gravity(1.0)
        .sum_union(Field::lennard_jones(1.0, 1.0))
        .sum_union(Field::drag(1.0, 0.0))
        .sum_union(Field::uniform(Vector::X).within(Region::ball(1.0)))
        .sum_union(Field::buoyancy(1.0, 1.0));
    let fields = Fields::new(tree).expect("a sound tree");
    let plan = fields.plan();
    let sampling: Vec<_> = plan.entries.iter().map(|entry| entry.sampling).collect();
    use Sampling::*;
    assert_eq!(sampling, [Volume, Parts, Surface, Centre, Parts], "{plan}");
    let cuts: Vec<_> = plan
        .entries
        .iter()
        .map(|entry| entry.cuts_at_borders)
        .collect();
    assert_eq!(cuts, [false, false, false, true, true], "{plan}");
    // The plan names the counts for a cube.
    let (world, body) = one(
        Vector::ZERO,
        Rotation::IDENTITY,
        ColliderBuilder::cuboid(1.0, 1.0, 1.0),
    );
    let again = fields;
    let samples = again.samples(body, &world);
    for entry in &again.plan().entries {
        let count = samples
            .iter()
            .filter(|s| s.sampling == entry.sampling)
            .count();
        assert_eq!(count, entry.samples_of_a_cube, "{:?}", entry.sampling);
    }
    let text = again.plan().to_string();
    for part in [
        "once per body, in pieces where a border passes",
        "per part",
        "per part, in pieces where a border passes",
        "over the volume (27 samples of a cube, 1 of a ball)",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}

#[test]
fn plans_say_why_fields_are_left_out() {
    let mut off = Field::uniform(Vector::X);
    off.enabled = false;
    let over = Field::uniform(Vector::X).lifetime(Lifetime::steps(0));
    let cases = [
        (
            Field::uniform(Vector::ZERO),
            ": zero wherever it is defined",
        ),
        (off, ": off"),
        (over, ": off"),
    ];
    for (field, why) in cases {
        let fields = Fields::new(field.sum_union(Field::spring(1.0))).expect("a sound tree");
        let plan = fields.plan().to_string();
        assert!(plan.contains(why), "{why} in {plan}");
    }
}
