//! Whatever Rapier holds on uneven ground, contact fields hold.

use rapier3d_fields::Detection;

use crate::support::drops::*;

const ALL: [(Detection, Side); 6] = [
    (Detection::Discrete, Side::Body),
    (Detection::Discrete, Side::Ground),
    (Detection::Discrete, Side::Both),
    (Detection::Swept, Side::Body),
    (Detection::Swept, Side::Ground),
    (Detection::Swept, Side::Both),
];

/// With a contact field on either side all of these fell through the mesh, with no warning. Rapier's
/// centre of mass of an open mesh is anywhere (here 6e7 m away) and its principal frame NaN; the
/// response read both of a fixed body, and dropped the impulse that came of it.
#[test]
fn an_uneven_mesh_holds_what_falls_on_it() {
    for shape in [Shape::Ball, Shape::Box, Shape::Cone, Shape::Hull] {
        let drops = Drops {
            ground: Ground::Mesh,
            bumps: 0.15,
            carried: Carried::Fixed,
            shape,
            count: 3,
            seed: 1,
        };
        let lost = drops.run(Answer::Rapier).lost;
        assert!(lost.is_empty(), "{shape:?}, Rapier: {lost:?}");
        for (detection, side) in ALL {
            let lost = drops.run(Answer::Fields(detection, side)).lost;
            assert!(
                lost.is_empty(),
                "{shape:?}, {detection:?}, {side:?}: {lost:?}"
            );
        }
    }
}
