//! Tests that the comparison reports a broken detection: the fields' contacts are altered, and compared with those that
//! Rapier found in the same scene.

use super::*;
use crate::cross_check::bands::Sizes;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Rotation};
use crate::rapier::geometry::ColliderBuilder;
use crate::rapier::parry::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher,
};

/// Two parts that overlap, by Parry alone, and the inputs of their comparison.
struct Scene {
    name: &'static str,
    colliders: [Collider; 2],
    poses: [Pose; 2],
    spots: Vec<RapierPoint>,
    /// The contact that a correct detection finds.
    sound: FieldContact,
}

fn colliders() -> [(&'static str, Collider); 3] {
    let corners = [
        Vector::new(0.6, 0.1, 0.0),
        Vector::new(-0.5, 0.45, 0.1),
        Vector::new(-0.4, -0.55, 0.2),
        Vector::new(0.1, 0.0, -0.6),
        Vector::new(0.0, 0.15, 0.7),
        Vector::new(0.3, -0.45, -0.2),
    ];
    let hull = ColliderBuilder::convex_hull(&corners).expect("a hull");
    [
        ("balls", ColliderBuilder::ball(0.5).build()),
        ("cuboids", ColliderBuilder::cuboid(0.5, 0.4, 0.3).build()),
        ("hulls", hull.build()),
    ]
}

fn scenes() -> Vec<Scene> {
    let all = colliders().into_iter().flat_map(|(name, part)| {
        // At several places, attitudes and overlaps.
        (0..8).map(move |number| {
            let turn = Real::from(number as u8);
            let first = Pose::new(
                Vector::new(3.0, -1.0, 0.5) * turn,
                Vector::new(0.3, 0.2, -0.4) * turn,
            );
            let apart = Vector::new(0.8, 0.2, -0.1) * (0.75 + 0.02 * turn);
            let relative = Pose::new(apart, Vector::new(0.1, -0.3, 0.2) * turn);
            Scene::new(
                name,
                [part.clone(), part.clone()],
                [first, first * relative],
            )
        })
    });
    all.flatten().collect()
}

impl Scene {
    /// `None` if the overlap is too shallow for alterations to exceed the bands.
    fn new(name: &'static str, colliders: [Collider; 2], poses: [Pose; 2]) -> Option<Self> {
        let mut manifolds: Vec<ContactManifold<(), ()>> = Vec::new();
        let [a, b] = [&colliders[0], &colliders[1]].map(|it| &*it.shared_shape().0);
        let relative = poses[0].inv_mul(&poses[1]);
        DefaultQueryDispatcher
            .contact_manifolds(&relative, a, b, 0.02, &mut manifolds, &mut None)
            .expect("manifolds");
        let spots: Vec<RapierPoint> = manifolds
            .iter()
            .flat_map(|manifold| manifold.points.iter().map(move |point| (manifold, point)))
            .map(|(manifold, point)| {
                let one = poses[0].transform_point(point.local_p1);
                let two = poses[1].transform_point(point.local_p2);
                RapierPoint {
                    world_point: (one + two) * 0.5,
                    world_normal: poses[0].rotation * manifold.local_n1,
                    depth: -point.dist,
                    turn: 0.0,
                    shift: 0.0,
                    stale: 0.0,
                }
            })
            .collect();
        let deepest = spots.iter().max_by(|a, b| a.depth.total_cmp(&b.depth))?;
        let sound = FieldContact {
            colliders: [0, 1].map(|index| ColliderHandle::from_raw_parts(index, 0)),
            bodies: [None; 2],
            world_point: deepest.world_point,
            world_normal: deepest.world_normal,
            depth: deepest.depth,
            time_of_impact: None,
            approach_speed: 0.0,
            impulses: [Vector::ZERO; 2],
            law: ContactLaw::Observe,
            has_field: [true; 2],
        };
        (sound.depth > 0.02).then_some(Scene {
            name,
            colliders,
            poses,
            spots,
            sound,
        })
    }

    fn judge(&self, ours: Option<FieldContact>) -> Verdict {
        let colliders = [&self.colliders[0], &self.colliders[1]];
        let sizes = Sizes::of_colliders(colliders);
        let bands = Bands::at(
            &sizes,
            self.sound.world_point,
            self.sound.depth,
            &self.spots,
        );
        let placed = Placed {
            colliders,
            poses: self.poses,
        };
        judge(ours.as_ref(), &self.spots, &bands, &placed)
    }

    /// The radius of the bounding sphere of the first part.
    fn radius(&self) -> Real {
        self.colliders[0]
            .shape()
            .compute_local_bounding_sphere()
            .radius
    }
}

/// The kinds of difference of a verdict.
fn kinds(verdict: &Verdict) -> Vec<&'static str> {
    let kind = |(difference, _): &(Difference, Real)| match difference {
        Difference::OnlyField { .. } => "only the fields",
        Difference::OnlyRapier { .. } => "only Rapier",
        Difference::Depth { .. } => "depth",
        Difference::Normal { .. } => "normal",
        Difference::Point { .. } => "point",
        _ => "of a touch",
    };
    verdict.differences.iter().map(kind).collect()
}

/// Fails unless an altered contact shows the expected difference in each scene.
#[track_caller]
fn assert_reported(kind: &str, alter: impl Fn(&Scene, FieldContact) -> Option<FieldContact>) {
    let scenes = scenes();
    for name in ["balls", "cuboids", "hulls"] {
        let own: Vec<_> = scenes.iter().filter(|it| it.name == name).collect();
        assert!(own.len() >= 4, "{name}: {} scenes overlap", own.len());
        for scene in own {
            let verdict = scene.judge(alter(scene, scene.sound));
            let found = kinds(&verdict);
            assert!(found.contains(&kind), "{name}: {found:?} of {verdict:?}");
        }
    }
}

#[test]
fn a_sound_detection_agrees() {
    for scene in scenes() {
        let verdict = scene.judge(Some(scene.sound));
        assert_eq!(verdict.found, FoundBy::Both, "{}", scene.name);
        assert!(verdict.differences.is_empty(), "{verdict:?}");
        assert_eq!(verdict.errors, [Some(0.0); 3]);
    }
}

#[test]
fn a_normal_that_points_the_other_way_is_reported() {
    assert_reported("normal", |_, sound| {
        Some(FieldContact {
            world_normal: -sound.world_normal,
            ..sound
        })
    });
}

#[test]
fn a_normal_that_is_turned_by_five_degrees_is_reported() {
    assert_reported("normal", |_, sound| {
        let across = sound.world_normal.any_orthonormal_vector();
        let turn = Rotation::from_axis_angle(across, (5.0 as Real).to_radians());
        Some(FieldContact {
            world_normal: turn * sound.world_normal,
            ..sound
        })
    });
}

#[test]
fn a_depth_that_is_a_tenth_too_large_is_reported() {
    assert_reported("depth", |_, sound| {
        Some(FieldContact {
            depth: sound.depth * 1.1,
            ..sound
        })
    });
}

/// Within two faces that lie on each other every point is valid, so the point is moved out of them.
#[test]
fn a_point_that_is_moved_by_a_radius_is_reported() {
    assert_reported("point", |scene, sound| {
        let across = sound.world_normal.any_orthonormal_vector();
        let moved = sound.world_point + across * scene.radius();
        Some(FieldContact {
            world_point: moved,
            ..sound
        })
    });
}

#[test]
fn a_pair_that_is_dropped_is_reported() {
    assert_reported("only Rapier", |_, _| None);
}

#[test]
fn a_contact_that_rapier_does_not_find_is_reported() {
    for mut scene in scenes() {
        scene.spots.clear();
        let verdict = scene.judge(Some(scene.sound));
        assert_eq!(kinds(&verdict), ["only the fields"], "{}", scene.name);
    }
}

#[test]
fn values_that_are_nan_are_reported() {
    for scene in scenes() {
        for broken in [
            FieldContact {
                depth: Real::NAN,
                ..scene.sound
            },
            FieldContact {
                world_normal: Vector::NAN,
                ..scene.sound
            },
            FieldContact {
                world_point: Vector::NAN,
                ..scene.sound
            },
        ] {
            let verdict = scene.judge(Some(broken));
            assert!(
                !verdict.differences.is_empty(),
                "{}: {verdict:?}",
                scene.name
            );
        }
    }
}

#[test]
fn manifolds_that_parry_kept_widen_the_band_up_to_its_limits() {
    for mut scene in scenes().into_iter().filter(|it| it.name != "balls") {
        let altered = FieldContact {
            depth: scene.sound.depth + 0.004,
            ..scene.sound
        };
        assert_eq!(kinds(&scene.judge(Some(altered))), ["depth"]);
        for spot in &mut scene.spots {
            spot.turn = 0.01;
        }
        assert!(scene.judge(Some(altered)).differences.is_empty());
        for spot in &mut scene.spots {
            (spot.turn, spot.shift) = (1.0, 1.0);
        }
        let beyond = FieldContact {
            depth: scene.sound.depth + 0.1,
            ..scene.sound
        };
        assert_eq!(kinds(&scene.judge(Some(beyond))), ["depth"]);
    }
}

#[test]
fn the_worst_difference_is_measured_in_its_band() {
    let mut verdict = Verdict::new(FoundBy::Both);
    let difference = || Difference::OnlyField { depth: 0.0 };
    for (which, error, band) in [(0, 1.0, 4.0), (1, 3.0, 2.0), (2, 0.5, 1.0)] {
        verdict.judge(which, error, band, difference());
    }
    assert_eq!(verdict.worst, 1.5);
    assert_eq!(verdict.errors, [1.0, 3.0, 0.5].map(Some));
    assert_eq!(verdict.differences, [(difference(), 2.0)]);
}
