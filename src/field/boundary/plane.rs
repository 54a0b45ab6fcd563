//! Planes through a sample, with the outward normals of surfaces.

/// Unit normals whose cosine differs from ±1 by less than this are those of one plane.
const SAME_DIRECTION: f64 = 1e-9;

/// Cosines below this count as right angles.
const RIGHT_ANGLE: f64 = 1e-6;

/// The outward normal of a surface in the space of all axes: world x, y, z first.
pub(crate) type Normal = Vec<f64>;

/// A plane through the sample.
#[derive(Debug)]
pub(super) struct Hyperplane {
    /// Of length one.
    pub normal: Normal,
    /// True if it is at right angles to all others, so that each of its sides meets every piece that the others
    /// make.
    pub is_free: bool,
}

impl Hyperplane {
    /// The planes with these normals, each once.
    pub fn through(normals: &[Normal]) -> Vec<Hyperplane> {
        let mut apart: Vec<Normal> = Vec::new();
        for normal in normals.iter().filter_map(unit) {
            if !apart.iter().any(|p| parallel(p, &normal).is_some()) {
                apart.push(normal);
            }
        }
        let square_to = |a: &Normal, b: &Normal| dot(a, b).abs() < RIGHT_ANGLE;
        let is_free = |k: usize| {
            let mut others = apart.iter().enumerate().filter(|(j, _)| *j != k);
            others.all(|(_, other)| square_to(other, &apart[k]))
        };
        let free: Vec<bool> = (0..apart.len()).map(is_free).collect();
        let planes = apart.into_iter().zip(free);
        planes
            .map(|(normal, is_free)| Hyperplane { normal, is_free })
            .collect()
    }

    /// The unit vector that points to one side: behind the plane, or beyond it.
    pub fn inward(&self, behind: bool) -> Normal {
        let sign = if behind { -1.0 } else { 1.0 };
        self.normal.iter().map(|n| sign * n).collect()
    }
}

/// If two unit normals are those of one plane, whether they point the same way.
pub(super) fn parallel(a: &Normal, b: &Normal) -> Option<bool> {
    let cosine = dot(a, b);
    (1.0 - cosine.abs() < SAME_DIRECTION).then_some(cosine > 0.0)
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn unit(normal: &Normal) -> Option<Normal> {
    let length = dot(normal, normal).sqrt();
    (length > SAME_DIRECTION).then(|| normal.iter().map(|n| n / length).collect())
}
