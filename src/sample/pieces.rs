//! Bodies in pieces: cut where the borders of fields pass through them, so that in each piece the
//! fields are the same all over.
//!
//! Flat borders are followed exactly, by whatever is made of triangles. At a curved one pieces are
//! halved until it is almost flat in each, and then cut by its tangent plane. A ball that one plane or
//! one sphere passes through is cut by formula.

use super::cap;
use super::clip::{Plane, Triangle, content, extent, halving};
use super::part_shape::{Bulk, PartSolid};
use super::point::{Moment, SamplePoint};
use super::samples::Samples;
use crate::field::{Border, Cuts, Face, POINT, Query, SamplingRule};
use crate::math::{DPose3, DVec3, from_dvec3, from_f64, to_dvec3, to_f64};

/// At a curved border pieces are halved until it bends by less than this part of the body's
/// extent in each,
const BEND: f64 = 0.1;

/// and by less than this part of how thick they are.
const BEND_OF_THICKNESS: f64 = 0.3;

/// But not if they are smaller than this part of it.
const FINEST: f64 = 1.0 / 12.0;

/// What is thinner, measured by the body's extent, or holds less of its part, counts as nothing.
const LEAST: f64 = 1e-10;

/// Pieces of a part, at most.
const MOST_PIECES: usize = 1024;

/// Cuts that led to a piece, at most.
const MOST_CUTS: u32 = 64;

/// A piece of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// The number of the part among all sites.
    pub site: usize,
    /// Which fraction of the part it is.
    fraction: f64,
    /// Its centre.
    pub world_point: DVec3,
}

impl Samples {
    /// Where the parts are of a body that terms like this cut; `None` if they do not.
    pub(crate) fn cut(&self, how: SamplingRule, body: u32) -> Option<&Bulk> {
        if how.cuts == Cuts::Never {
            return None;
        }
        let own = self.overrides.get(body as usize).copied().flatten();
        let bulk = self.bulks.get(body as usize);
        bulk.filter(|_| own.is_none())
    }

    /// A piece as terms like this see it; the weight of their force there; and its lever arm.
    pub(crate) fn of_piece(
        &self,
        how: SamplingRule,
        (body, piece): (u32, &Piece),
        moment: Moment,
    ) -> (Query, f64, DVec3) {
        let (centre, site) = (&self.centres[body as usize], &self.list[piece.site]);
        let attitude = &self.attitudes[body as usize];
        let arm = piece.world_point - to_dvec3(centre.world_point);
        let (whole, weight, middle) = match how.cuts {
            // What is shared out by mass acts on a whole body at its centre of mass.
            Cuts::Bodies => (centre, to_f64(site.share), self.bulks[body as usize].middle),
            Cuts::Shares => (site, 1.0, self.bulks[body as usize].middle),
            _ => (site, 1.0, DVec3::ZERO),
        };
        let query = Query {
            world_point: piece.world_point,
            world_velocity: to_dvec3(centre.velocity) + to_dvec3(attitude.angvel).cross(arm),
            spread: POINT,
            ..self.query(whole, moment)
        };
        let arm = arm - attitude.rotation * middle;
        (query, weight * piece.fraction, arm)
    }
}

impl Samples {
    /// A piece as a sample, of which is known what it is asked.
    pub(crate) fn in_piece(
        &self,
        (body, piece): (u32, &Piece),
        query: &Query,
        arm: DVec3,
    ) -> SamplePoint {
        SamplePoint {
            world_point: from_dvec3(query.world_point),
            velocity: from_dvec3(query.world_velocity),
            arm: from_dvec3(arm),
            collider: self.list[piece.site].collider,
            fraction: from_f64(piece.fraction),
            ..self.centres[body as usize]
        }
    }
}

/// Cuts bodies; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Cutter {
    /// Of the piece at hand, after those of the pieces it is cut from.
    triangles: Vec<Triangle>,
    pieces: Vec<Piece>,
}

/// What a part is cut by, and when it is fine enough.
struct Cutting<'a> {
    borders: &'a [Border],
    pose: DPose3,
    site: usize,
    volume: f64,
    extent: f64,
}

impl Cutter {
    /// The pieces that borders make of a body, given by its number.
    pub(crate) fn body(&mut self, samples: &Samples, body: u32, borders: &[Border]) -> &[Piece] {
        self.pieces.clear();
        let Some(bulk) = samples.bulks.get(body as usize) else {
            return &[];
        };
        let com = to_dvec3(samples.centres[body as usize].world_point);
        let pose = DPose3::from_parts(com, samples.attitudes[body as usize].rotation);
        let [sites, _] = samples.of(body as usize);
        for site in sites {
            let Some(shape) = samples.shapes.get(site) else {
                continue;
            };
            let cutting = Cutting {
                borders,
                pose: pose * shape.local_pose,
                site,
                volume: 0.0,
                extent: bulk.extent,
            };
            self.part(cutting, &shape.solid);
        }
        &self.pieces
    }

    fn part(&mut self, cutting: Cutting<'_>, solid: &PartSolid) {
        let (mesh, scale) = match solid {
            PartSolid::Mesh(mesh) => (mesh, 1.0),
            PartSolid::Ball(radius, mesh) => match self.ball(&cutting, *radius) {
                true => return,
                false => (mesh, *radius),
            },
            PartSolid::Point => {
                self.pieces.push(cutting.piece(1.0, DVec3::ZERO));
                return;
            }
        };
        let centre = mesh.centre * scale;
        let at = (cutting.pose.transform_point(centre), mesh.extent * scale);
        if !cutting.borders.iter().any(|border| border.passes(at)) {
            self.pieces.push(cutting.piece(1.0, centre));
            return;
        }
        self.triangles.clear();
        let scaled = mesh
            .triangles
            .iter()
            .map(|t| t.map(|corner| corner * scale));
        self.triangles.extend(scaled);
        let volume = mesh.volume * scale.powi(3);
        let cutting = Cutting { volume, ..cutting };
        let most = self.pieces.len() + MOST_PIECES;
        self.cell(&cutting, (0, 0), (0, MOST_CUTS), most);
    }

    /// Cuts a ball by formula, unless more than one face passes through it; whether it did.
    fn ball(&mut self, cutting: &Cutting<'_>, radius: f64) -> bool {
        let centre = cutting.pose.translation;
        let near = cutting.borders.iter();
        let near = near.filter(|border| border.passes((centre, radius)));
        let mut faces = near.flat_map(|border| {
            let faces = (0..).map_while(move |number| border.face(number, (centre, radius)));
            faces.filter(|face| face.distance.abs() < radius)
        });
        let Some(face) = faces.next() else {
            self.pieces.push(cutting.piece(1.0, DVec3::ZERO));
            return true;
        };
        // The surface of a fluid is often that of its region, too.
        let least = LEAST * cutting.extent;
        let is_same = |other: Face| {
            let across = other.outward.cross(face.outward).length() <= LEAST;
            let apart = other.distance - face.distance * other.outward.dot(face.outward);
            face.curvature == 0.0 && other.curvature == 0.0 && across && apart.abs() <= least
        };
        if !faces.all(is_same) {
            return false;
        }
        let Some((share, depth)) = cap::behind(radius, &face) else {
            return false;
        };
        let ends = [
            (share, -depth),
            (1.0 - share, depth * share / (1.0 - share)),
        ];
        for (share, along) in ends.into_iter().filter(|(share, _)| *share > LEAST) {
            let world_point = centre + face.outward * along;
            let piece = cutting.piece(share, DVec3::ZERO);
            self.pieces.push(Piece {
                world_point,
                ..piece
            });
        }
        true
    }

    /// Cuts the cell that the triangles from `start` enclose, by all faces of all borders from the
    /// one given on; takes them off. `left`: how many cuts may follow.
    fn cell(
        &mut self,
        cutting: &Cutting<'_>,
        from: (usize, usize),
        (start, left): (usize, u32),
        most: usize,
    ) {
        let cell = &self.triangles[start..];
        let (volume, centre) = content(cell);
        let share = volume / cutting.volume;
        let stop = left == 0 || self.pieces.len() >= most;
        let next = match stop || share.is_nan() || share <= LEAST {
            true => None,
            false => cutting.next(cell, (volume, centre), from),
        };
        match next {
            None if share > LEAST => self.pieces.push(cutting.piece(share, centre)),
            None => {}
            Some((plane, from)) => {
                let end = self.triangles.len();
                for plane in [plane, plane.flipped()] {
                    plane.keep_below(&mut self.triangles, start..end, centre);
                    self.cell(cutting, from, (end, left - 1), most);
                }
            }
        }
        self.triangles.truncate(start);
    }
}

impl Cutting<'_> {
    /// A piece whose centre is in the frame of the part.
    fn piece(&self, fraction: f64, centre: DVec3) -> Piece {
        Piece {
            site: self.site,
            fraction,
            world_point: self.pose.transform_point(centre),
        }
    }

    /// The plane that cuts a cell like a face that is almost flat there: as a tangent plane, but so
    /// far behind it as the face is in the mean.
    fn plane(&self, face: &Face, cell: &[Triangle], centre: DVec3) -> Plane {
        let to_local = self.pose.rotation.inverse();
        let normal = to_local * face.outward;
        let tangent = Plane {
            normal,
            offset: normal.dot(centre) - face.distance,
        };
        let Some(straight) = face.round.filter(|_| face.curvature > 0.0) else {
            return tangent;
        };
        let apex = centre - normal * face.distance;
        let [area, squares] = tangent.section(cell, apex, to_local * straight);
        let behind = face.curvature * 0.5 * squares / area;
        let offset = tangent.offset - if behind > 0.0 { behind } else { 0.0 };
        Plane { offset, ..tangent }
    }

    /// Where a cell is to be cut next, and what remains to be cut by after that.
    fn next(
        &self,
        cell: &[Triangle],
        (volume, centre): (f64, DVec3),
        (first, first_face): (usize, usize),
    ) -> Option<(Plane, (usize, usize))> {
        let world_point = self.pose.transform_point(centre);
        let radius = extent(cell, centre);
        let thickness = (volume / (radius * radius)).abs();
        let most = (BEND * self.extent).min(BEND_OF_THICKNESS * thickness);
        let borders = self.borders.iter().enumerate().skip(first);
        for (number, border) in borders {
            if !border.passes((world_point, radius)) {
                continue;
            }
            let from = if number == first { first_face } else { 0 };
            let faces =
                (from..).map_while(|face| Some((face, border.face(face, (world_point, radius))?)));
            for (place, face) in faces {
                // A tangent plane may touch what its face does not.
                if face.distance.is_nan() || face.distance.abs() >= radius {
                    continue;
                }
                let straight = most >= face.curvature * radius * radius;
                if !straight && radius > FINEST * self.extent {
                    return Some((halving(cell), (number, place)));
                }
                let plane = self.plane(&face, cell, centre);
                if plane.parts(cell, LEAST * self.extent) {
                    return Some((plane, (number, place + 1)));
                }
            }
        }
        None
    }
}
