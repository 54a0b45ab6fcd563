//! A scene in which contact fields once let a ball fall through a mesh.

use rapier3d_fields::math::to_f64;

use crate::files::{Document, SceneFile};

/// A scene in which the ball fell through, to 310 m below after eight seconds. The heights of the mesh are from
/// −0.15 to 0.15, and Rapier alone holds the centre of the ball at 0.54.
const SCENE: &str = include_str!("../../../tests/data/uneven_mesh.json");

/// The ball rests where it does with Rapier alone, no body is below the mesh, and no step warns.
#[test]
fn the_ball_on_the_uneven_mesh_rests_where_rapier_puts_it() {
    let middle = |by_fields: bool, detection: &str| {
        let text = SCENE.replace("\"discrete\"", &format!("\"{detection}\""));
        let scene = SceneFile::from_json(&text).expect("a scene");
        let mut scene = scene.build().expect("a sound scene");
        let mut lowest = f64::INFINITY;
        for _ in 0..480 {
            match by_fields {
                false => scene.world.step(),
                true => {
                    scene.fields.step(&mut scene.world).expect("a step");
                    assert!(scene.fields.warnings().is_empty(), "{detection}");
                }
            }
            let bodies = scene.world.bodies.iter().filter(|(_, it)| it.is_dynamic());
            let heights = bodies.map(|(_, body)| to_f64(body.translation().y));
            lowest = heights.fold(f64::INFINITY, f64::min);
        }
        lowest
    };
    let alone = middle(false, "discrete");
    assert!((alone - 0.54).abs() < 0.01, "Rapier alone: {alone}");
    for detection in ["discrete", "swept"] {
        let held = middle(true, detection);
        println!("{detection}: {held}, Rapier {alone}");
        // Twice the depth to which Rapier's solver lets bodies sink.
        assert!(
            (held - alone).abs() < 0.01,
            "{detection}: {held}, Rapier {alone}"
        );
    }
}
