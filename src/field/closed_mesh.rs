//! Checks that a triangle mesh is the surface of a solid, so that every point is inside or outside, and orients
//! it.
//!
//! Parry tells inside from outside by the normals of faces, edges and corners, which requires a surface without
//! gaps that is wound outwards. Meshes from files may have gaps or be wound inwards.

use std::collections::BTreeMap;

use crate::math::{DVec3, SharedShape, Vector, to_dvec3};
use crate::rapier::parry::shape::{TriMesh, TriMeshFlags};

/// Volumes below this share of the cube of the mesh's extent count as rounding errors.
const NO_VOLUME: f64 = 1e-12;

/// The reason why a mesh is not the surface of a solid. Vertices are numbered as in the mesh; the first of
/// several vertices at one place stands for all.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFault {
    /// The surface has gaps.
    #[error(
        "{edges} of its edges, the first from vertex {} to vertex {}, belong to one triangle only; \
         each must belong to two", edge[0], edge[1]
    )]
    Open {
        /// The number of edges at gaps.
        edges: usize,
        /// The ends of one of them.
        edge: [u32; 2],
    },
    /// Surfaces meet in an edge.
    #[error(
        "{edges} of its edges, the first from vertex {} to vertex {}, which belongs to {triangles}, \
         belong to more than two triangles", edge[0], edge[1]
    )]
    Crowded {
        /// The number of edges with more than two triangles.
        edges: usize,
        /// The ends of one of them.
        edge: [u32; 2],
        /// The number of triangles at that edge.
        triangles: usize,
    },
    /// Two neighbouring triangles are wound in opposite senses.
    #[error(
        "the two triangles at {edges} of its edges, the first from vertex {} to vertex {}, are \
         wound against each other", edge[0], edge[1]
    )]
    Winding {
        /// The number of edges between such neighbours.
        edges: usize,
        /// The ends of one of them.
        edge: [u32; 2],
    },
    /// One of several closed surfaces is wound the wrong way: a cavity outwards, a body inwards, or
    /// a body within a body.
    #[error(
        "its closed surface with vertex {vertex} is wound against the others: bodies that are apart \
         must be wound alike, cavities the other way"
    )]
    Nesting {
        /// A vertex of that surface.
        vertex: u32,
    },
    /// The mesh encloses nothing.
    #[error("it encloses no volume")]
    Flat,
    /// A vertex is not a finite point.
    #[error("its vertex {vertex} is not finite")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
}

/// The mesh with equal vertices merged, wound outwards, and with the normals by which Parry tells inside from
/// outside.
pub(super) fn oriented(mesh: &TriMesh) -> Result<SharedShape, MeshFault> {
    let vertices = mesh.vertices();
    let places: Vec<DVec3> = vertices.iter().map(|v| to_dvec3(*v)).collect();
    if let Some(vertex) = places.iter().position(|place| !place.is_finite()) {
        let vertex = vertex as u32;
        return Err(MeshFault::NotFinite { vertex });
    }
    let mut triangles = merged(mesh.indices(), &places);
    let surfaces = closed_surfaces(&triangles)?;
    if total_volume(&triangles, &places)? < 0.0 {
        triangles
            .iter_mut()
            .for_each(|triangle| triangle.swap(1, 2));
    }
    check_nesting(&surfaces, &triangles, &places)?;
    rebuilt(vertices, triangles)
}

/// The triangles with equal vertices replaced by the first of them, without those that become lines.
fn merged(triangles: &[[u32; 3]], places: &[DVec3]) -> Vec<[u32; 3]> {
    let mut first: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut merge = |vertex: u32| {
        // Adding zero turns −0 into 0.
        let bits = places[vertex as usize]
            .to_array()
            .map(|x| (x + 0.0).to_bits());
        *first.entry(bits).or_insert(vertex)
    };
    let triangles = triangles.iter().map(|triangle| triangle.map(&mut merge));
    triangles
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect()
}

/// An edge without its direction.
fn undirected([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Checks that two triangles meet at each edge, and run along it in opposite directions. Returns the closed
/// surfaces, each as the numbers of connected triangles.
fn closed_surfaces(triangles: &[[u32; 3]]) -> Result<Vec<Vec<usize>>, MeshFault> {
    // For each edge its triangles; true if a triangle runs along it from the lesser vertex.
    let mut meeting: BTreeMap<[u32; 2], Vec<(usize, bool)>> = BTreeMap::new();
    for (number, triangle) in triangles.iter().enumerate() {
        for edge in edges(*triangle) {
            let there = meeting.entry(undirected(edge)).or_default();
            there.push((number, edge[0] < edge[1]));
        }
    }
    let all_where = |wrong: fn(&[(usize, bool)]) -> bool| {
        let mut found = meeting.iter().filter(move |(_, there)| wrong(there));
        let (edge, there) = found.next()?;
        Some((*edge, there.len(), 1 + found.count()))
    };
    if let Some((edge, _, edges)) = all_where(|there| there.len() == 1) {
        return Err(MeshFault::Open { edges, edge });
    }
    if let Some((edge, triangles, edges)) = all_where(|there| there.len() > 2) {
        return Err(MeshFault::Crowded {
            edges,
            edge,
            triangles,
        });
    }
    if let Some((edge, _, edges)) = all_where(|there| there[0].1 == there[1].1) {
        return Err(MeshFault::Winding { edges, edge });
    }
    let mut surfaces = Vec::new();
    let mut seen = vec![false; triangles.len()];
    for start in 0..triangles.len() {
        let mut surface = Vec::new();
        let mut open = vec![start];
        while let Some(number) = open.pop() {
            if std::mem::replace(&mut seen[number], true) {
                continue;
            }
            surface.push(number);
            let around = edges(triangles[number]);
            let around = around.iter().flat_map(|edge| &meeting[&undirected(*edge)]);
            open.extend(around.map(|(neighbour, _)| neighbour));
        }
        if !surface.is_empty() {
            surfaces.push(surface);
        }
    }
    Ok(surfaces)
}

/// The enclosed volume, negative if the surface is wound inwards. It is measured from a corner, so that
/// distance from the origin costs no precision.
fn volume<'a>(triangles: impl Iterator<Item = &'a [u32; 3]>, places: &[DVec3]) -> f64 {
    let mut triangles = triangles.peekable();
    let from = triangles
        .peek()
        .map_or(DVec3::ZERO, |t| places[t[0] as usize]);
    let corner = |vertex: u32| places[vertex as usize] - from;
    let part = |[a, b, c]: &[u32; 3]| corner(*a).dot(corner(*b).cross(corner(*c))) / 6.0;
    triangles.map(part).sum()
}

fn total_volume(triangles: &[[u32; 3]], places: &[DVec3]) -> Result<f64, MeshFault> {
    let total = volume(triangles.iter(), places);
    let used = triangles.iter().flatten().map(|v| places[*v as usize]);
    let (low, high) = bounds(used);
    let extent = (high - low).length();
    if total.abs() > NO_VOLUME * extent.powi(3) {
        return Ok(total);
    }
    Err(MeshFault::Flat)
}

fn bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    let nowhere = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.fold(nowhere, |(low, high), p| (low.min(p), high.max(p)))
}

/// Checks that the mesh winds around each point once or not at all: the other surfaces must wind zero times around
/// one that is wound outwards, and once around one that is wound inwards.
fn check_nesting(
    surfaces: &[Vec<usize>],
    triangles: &[[u32; 3]],
    places: &[DVec3],
) -> Result<(), MeshFault> {
    if surfaces.len() < 2 {
        return Ok(());
    }
    let of = |surface: &[usize]| -> Vec<[u32; 3]> {
        surface.iter().map(|number| triangles[*number]).collect()
    };
    let surfaces: Vec<Vec<[u32; 3]>> = surfaces.iter().map(|surface| of(surface)).collect();
    let boxes: Vec<(DVec3, DVec3)> = surfaces
        .iter()
        .map(|surface| bounds(surface.iter().flatten().map(|v| places[*v as usize])))
        .collect();
    for (number, surface) in surfaces.iter().enumerate() {
        let vertex = surface[0][0];
        let at = places[vertex as usize];
        let holds = |(low, high): &(DVec3, DVec3)| at.cmpge(*low).all() && at.cmple(*high).all();
        let others = surfaces.iter().zip(&boxes).enumerate();
        let others = others.filter(|(other, (_, bounds))| *other != number && holds(bounds));
        let around: f64 = others
            .map(|(_, (other, _))| windings(other, places, at))
            .sum();
        let inwards = volume(surface.iter(), places) < 0.0;
        if around.round() != f64::from(u8::from(inwards)) {
            return Err(MeshFault::Nesting { vertex });
        }
    }
    Ok(())
}

/// The number of times that a surface is wound around a point: the solid angle that it fills, over 4π. A. van
/// Oosterom and J. Strackee, IEEE Transactions on Biomedical Engineering 30 (1983), 125–126.
fn windings(surface: &[[u32; 3]], places: &[DVec3], at: DVec3) -> f64 {
    let half_angle = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| places[vertex as usize] - at);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        a.dot(b.cross(c)).atan2(below)
    };
    surface.iter().map(half_angle).sum::<f64>() / std::f64::consts::TAU
}

fn rebuilt(vertices: &[Vector], triangles: Vec<[u32; 3]>) -> Result<SharedShape, MeshFault> {
    let mesh = TriMesh::with_flags(vertices.to_vec(), triangles, TriMeshFlags::ORIENTED);
    // A mesh without triangles encloses nothing.
    mesh.map(SharedShape::new).map_err(|_| MeshFault::Flat)
}
