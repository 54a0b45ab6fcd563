//! A ball cut by a plane or a sphere: volumes and centres in closed form.

use crate::field::Face;
use crate::math::DVec3;

/// Largest curvature times radius at which a round face is replaced by a plane a little behind its tangent plane.
const GENTLE: f64 = 0.25;

/// The same for planes and faces of unknown form, which are replaced by their tangent plane.
const FLAT: f64 = 1e-3;

/// The part of a ball that is behind a face: its share of the volume, and the distance of its centre from the
/// ball's, against the face's outward direction. `None` if there is no closed form, or if the centre of the
/// rest is not outside of the spherical face: a sample there would be on the wrong side.
pub(super) fn behind(radius: f64, face: &Face) -> Option<(f64, f64)> {
    let volume = 4.0 * radius.powi(3);
    if !face.is_sphere {
        let (cap, depth) = cap(radius, radius - plane(radius, face)?);
        return Some((cap / volume, depth));
    }
    let (share, depth) = common(radius, face);
    let (other, apart) = sphere(face);
    let rest = apart + depth * share / (1.0 - share);
    (rest > other).then_some((share, depth))
}

/// The radius of a spherical face, and the distance of its centre from the ball's.
fn sphere(face: &Face) -> (f64, f64) {
    let radius = face.curvature.recip();
    (radius, face.distance + radius)
}

/// The part of a ball inside a spherical face: its share of the ball's volume, and the distance of its centre
/// from the ball's.
fn common(radius: f64, face: &Face) -> (f64, f64) {
    let (other, apart) = sphere(face);
    if apart <= radius - other {
        return ((other / radius).powi(3), apart);
    }
    // A cap of each ball, on the plane in which the two spheres meet.
    let height = radius - ((apart - other) * (apart + other) + radius * radius) / (2.0 * apart);
    let (own, own_depth) = cap(radius, height);
    let height = (radius * radius - (apart - other).powi(2)) / (2.0 * apart);
    let (others, depth) = cap(other, height);
    let sum = own + others;
    let first = own * own_depth + others * (apart - depth);
    (sum / (4.0 * radius.powi(3)), first / sum)
}

/// The distance of a ball's centre from the plane that replaces a face that bends little. That plane is behind the
/// tangent plane by the mean deviation of the face over the disc in which it cuts the ball.
fn plane(radius: f64, face: &Face) -> Option<f64> {
    let bend = face.curvature * radius;
    let square = radius * radius - face.distance * face.distance;
    match face.round {
        Some(straight) if bend <= GENTLE => {
            let ways = if straight == DVec3::ZERO { 2.0 } else { 1.0 };
            Some(face.distance + face.curvature * square * ways / 8.0)
        }
        None if bend <= FLAT => Some(face.distance),
        _ => None,
    }
}

/// The cap of a ball, given its height: 3/π times its volume, and the distance of its centre from the ball's.
fn cap(radius: f64, height: f64) -> (f64, f64) {
    let height = height.clamp(0.0, 2.0 * radius);
    let depth = 0.75 * (2.0 * radius - height).powi(2) / (3.0 * radius - height);
    (height * height * (3.0 * radius - height), depth)
}
