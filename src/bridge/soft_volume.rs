//! The volume that each particle of a soft body stands for, for fields that act on volumes.

use crate::math::{Real, Vector, from_f64, to_dvec3};
use crate::rapier::dynamics::SoftBody;

/// The volume of each particle in the body's present shape: a quarter of each cell that it is a corner of. Without
/// cells, the volume that a closed surface encloses, shared among its particles in proportion to the area around them.
/// Sheets and ropes have no volume.
pub(super) fn volumes(soft: &SoftBody, volumes: &mut Vec<Real>) {
    volumes.clear();
    volumes.resize(soft.num_particles(), 0.0);
    let mut add = |particle: u32, volume: f64| {
        if let Some(known) = volumes.get_mut(particle as usize) {
            *known += from_f64(volume);
        }
    };
    let at = |particle: u32| to_dvec3(soft.particle_position(particle as usize));
    for cell in soft.cells() {
        let [a, b, c, d] = cell.vertices.map(at);
        // A cell that is turned inside out has no volume.
        let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
        let share = volume.max(0.0) / 4.0;
        cell.vertices.iter().for_each(|corner| add(*corner, share));
    }
    if !soft.cells().is_empty() {
        return;
    }
    for piece in soft.volume_pieces() {
        let triangles = || {
            piece
                .elements()
                .iter()
                .map(|it| soft.boundary()[*it as usize])
        };
        let area = |[a, b, c]: [u32; 3]| (at(b) - at(a)).cross(at(c) - at(a)).length();
        let all: f64 = triangles().map(area).sum();
        let Some(origin) = piece.particles().first().map(|it| at(*it)) else {
            continue;
        };
        let beneath = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(|it| at(it) - origin);
            a.cross(b).dot(c) / 6.0
        };
        let enclosed = triangles().map(beneath).sum::<f64>().abs();
        if all > 0.0 {
            for triangle in triangles() {
                let share = enclosed * area(triangle) / (3.0 * all);
                triangle.iter().for_each(|corner| add(*corner, share));
            }
        }
    }
}

/// The least and the greatest coordinates of its particles, in world space.
pub(super) fn bounds(soft: &SoftBody) -> [Vector; 2] {
    let start = [Real::INFINITY, -Real::INFINITY].map(Vector::splat);
    let positions = soft.particle_positions();
    positions.fold(start, |[low, high], at| [low.min(at), high.max(at)])
}
