//! The contact of a pair as each side found it.

use std::collections::HashSet;

use crate::contact::FieldContact;
use crate::math::{ColliderHandle, Pose, Real, RigidBodyHandle, Vector};
use crate::rapier::geometry::{ContactManifold, ContactPair};
use crate::rapier::parry::utils::PoseOpt;
use crate::rigid::Lookup;

/// The state before Rapier's step, with which its contacts are compared after it.
#[derive(Debug, Default)]
pub(crate) struct Expected {
    /// The contacts as the fields found them.
    pub contacts: Vec<FieldContact>,
    /// Bodies that slept when the step began.
    pub asleep: HashSet<RigidBodyHandle>,
}

/// A contact point that Rapier holds for a pair, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct RapierPoint {
    /// The middle of the overlap, contact skins included.
    pub world_point: Vector,
    /// Unit vector from the first collider to the second.
    pub world_normal: Vector,
    /// The overlap, contact skins included; negative where the parts are apart.
    pub depth: Real,
    /// The angle by which the parts have turned relative to each other since the point was found.
    pub turn: Real,
    /// The distance by which the point on one part has shifted along the other since.
    pub shift: Real,
    /// The difference between this depth and that of the point at the poses compared.
    pub stale: Real,
}

/// All contact points that Rapier holds for a pair, with the colliders in the order of their handles and at the poses
/// that `pose_before` returns. `None` if a collider is gone.
pub(super) fn spots(
    pair: &ContactPair,
    world: &impl Lookup,
    pose_before: impl Fn(ColliderHandle) -> Option<Pose>,
) -> Option<Vec<RapierPoint>> {
    let handles = [pair.collider1, pair.collider2];
    let poses = [pose_before(handles[0])?, pose_before(handles[1])?];
    let [one, two] = handles.map(|handle| world.collider(handle));
    let skins = [one?.contact_skin(), two?.contact_skin()];
    let swap = handles[1].into_raw_parts() < handles[0].into_raw_parts();
    let manifolds = pair.manifolds().iter();
    let all = manifolds.flat_map(|manifold| of_manifold(manifold, poses, skins));
    Some(
        all.map(|spot| if swap { spot.flipped() } else { spot })
            .collect(),
    )
}

fn of_manifold(
    manifold: &ContactManifold,
    poses: [Pose; 2],
    skins: [Real; 2],
) -> impl Iterator<Item = RapierPoint> + '_ {
    let frames = [
        manifold.subshape_pos1().prepend_to(&poses[0]),
        manifold.subshape_pos2().prepend_to(&poses[1]),
    ];
    let normal = manifold.data.normal;
    let seen = [
        frames[0].rotation * manifold.local_n1,
        frames[1].rotation * -manifold.local_n2,
    ];
    let turn = angle(seen[0], seen[1]);
    manifold.points.iter().map(move |point| {
        let ends = [
            frames[0].transform_point(point.local_p1),
            frames[1].transform_point(point.local_p2),
        ];
        let between = ends[1] - ends[0];
        let apart = between.dot(seen[0]);
        RapierPoint {
            world_point: (ends[0] + ends[1]) * 0.5 + normal * ((skins[0] - skins[1]) * 0.5),
            world_normal: normal,
            depth: skins[0] + skins[1] - point.dist,
            turn,
            shift: (between - seen[0] * apart).length(),
            stale: (apart - point.dist).abs(),
        }
    })
}

impl RapierPoint {
    fn flipped(self) -> Self {
        RapierPoint {
            world_normal: -self.world_normal,
            ..self
        }
    }
}

/// The angle between two unit vectors, precise for small angles too.
pub(super) fn angle(one: Vector, two: Vector) -> Real {
    one.cross(two).length().atan2(one.dot(two))
}
