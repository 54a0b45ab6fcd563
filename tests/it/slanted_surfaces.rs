//! Samples of the surface of a body without symmetry.

use rapier3d_fields::math::{DVec3, Rotation, SharedShape, Vector, from_f64};
use rapier3d_fields::prelude::*;

use crate::sampling::one;
use crate::support::{assert_at_most, either};

const CORNERS: [[f64; 3]; 4] = [
    [0.25, -0.5, 0.125],
    [2.25, -0.25, 0.25],
    [0.5, 0.75, 0.0],
    [0.375, -0.25, 1.0],
];
const FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];

/// The means of p, of p² by components, and of (xy, yz, zx), from places with weights.
fn means(places: impl Iterator<Item = (DVec3, f64)>) -> [DVec3; 3] {
    let (mut sums, mut whole) = ([DVec3::ZERO; 3], 0.0);
    for (p, weight) in places {
        whole += weight;
        let mixed = DVec3::new(p.x * p.y, p.y * p.z, p.z * p.x);
        for (sum, power) in sums.iter_mut().zip([p, p * p, mixed]) {
            *sum += power * weight;
        }
    }
    sums.map(|sum| sum / whole)
}

/// Polynomials of the second power over a triangle are a third of its area times their values in the middles of its
/// sides.
fn exact() -> [DVec3; 3] {
    let middles = FACES.iter().flat_map(|face| {
        let [a, b, c] = face.map(|corner| DVec3::from(CORNERS[corner]));
        let area = 0.5 * (b - a).cross(c - a).length();
        [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5].map(|middle| (middle, area / 3.0))
    });
    means(middles)
}

#[test]
fn surface_samples_have_the_moments_of_a_slanted_tetrahedron() {
    let corners = CORNERS.map(|corner| Vector::from_array(corner.map(from_f64)));
    let shape = SharedShape::convex_hull(&corners).expect("a hull");
    // Linear drag is sampled at few points, quadratic drag at all.
    for quadratic in [0.0, 0.5] {
        let collider = ColliderBuilder::new(shape.clone()).density(1.0);
        let (world, body) = one(Vector::ZERO, Rotation::IDENTITY, collider);
        let drag = Field::drag(1.0, quadratic).sampled(Sampling::Surface);
        let fields = Fields::new(drag).expect("a sound tree");
        let samples = fields.samples(body, &world);
        let surface = samples.iter().filter(|s| s.sampling == Sampling::Surface);
        let found = means(surface.map(|s| (s.query.world_point, s.query.fraction)));
        for (found, wanted) in found.iter().zip(exact()) {
            let off = (*found - wanted).length();
            assert_at_most(off, either(1e-6, 1e-12), format!("{found}, not {wanted}"));
        }
    }
}
