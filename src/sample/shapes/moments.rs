//! Moments of shapes up to the second, and weighted points with given moments.

use crate::math::{DMat3, DVec3, SharedShape, to_dvec3, to_f64};

/// Moments of a shape that is filled uniformly, in the shape's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// Volume or area.
    pub measure: f64,
    pub centre: DVec3,
    /// Second moments about the centre, per measure.
    pub second: DMat3,
}

impl Moments {
    /// The moments of a shape's volume, from Parry's mass properties; `None` if it has no volume.
    pub(super) fn of(shape: &SharedShape) -> Option<Self> {
        let properties = shape.mass_properties(1.0);
        let measure = to_f64(properties.mass());
        let inertia = properties.reconstruct_inertia_matrix();
        let inertia = DMat3::from_cols(
            to_dvec3(inertia.x_axis),
            to_dvec3(inertia.y_axis),
            to_dvec3(inertia.z_axis),
        );
        let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
        let moments = Moments {
            measure,
            centre: to_dvec3(properties.local_com),
            second: (DMat3::from_diagonal(DVec3::splat(trace * 0.5)) - inertia) * measure.recip(),
        };
        let sound = measure > 0.0 && moments.centre.is_finite() && moments.second.is_finite();
        sound.then_some(moments)
    }

    /// The moments of weighted points.
    pub(super) fn of_points(points: &[(DVec3, f64)]) -> Self {
        let measure: f64 = points.iter().map(|(_, weight)| weight).sum();
        let first: DVec3 = points.iter().map(|(point, weight)| *point * *weight).sum();
        let centre = first / measure;
        let second = points.iter().fold(DMat3::ZERO, |sum, (point, weight)| {
            sum + outer(*point - centre) * *weight
        });
        Moments {
            measure,
            centre,
            second: second * measure.recip(),
        }
    }
}

impl Moments {
    /// The linear map, about the centres, that turns the second moments of `self` into those of `wanted`; `None` if
    /// either are flat.
    pub(super) fn map_onto(&self, wanted: &Moments) -> Option<DMat3> {
        let map = cholesky(wanted.second)? * cholesky(self.second)?.inverse();
        map.is_finite().then_some(map)
    }
}

/// v vᵀ.
pub(super) fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// Weighted points moved by one linear map so that they have these moments, and the map; `None` if the points or the
/// moments are flat.
pub(super) fn matched(
    points: &[(DVec3, f64)],
    moments: &Moments,
) -> Option<(Vec<(DVec3, f64)>, DMat3)> {
    let have = Moments::of_points(points);
    let map = have.map_onto(moments)?;
    let moved = |(point, weight): &(DVec3, f64)| {
        (
            moments.centre + map * (*point - have.centre),
            weight / have.measure,
        )
    };
    Some((points.iter().map(moved).collect(), map))
}

/// The lower triangle L of a matrix L Lᵀ; `None` if the matrix is not safely positive definite.
pub(super) fn cholesky(a: DMat3) -> Option<DMat3> {
    let scale = a.x_axis.x.max(a.y_axis.y).max(a.z_axis.z);
    let root = |x: f64| (x > scale * 1e-9).then(|| x.sqrt());
    let xx = root(a.x_axis.x)?;
    let (yx, zx) = (a.x_axis.y / xx, a.x_axis.z / xx);
    let yy = root(a.y_axis.y - yx * yx)?;
    let zy = (a.y_axis.z - zx * yx) / yy;
    let zz = root(a.z_axis.z - zx * zx - zy * zy)?;
    Some(DMat3::from_cols(
        DVec3::new(xx, yx, zx),
        DVec3::new(0.0, yy, zy),
        DVec3::new(0.0, 0.0, zz),
    ))
}
