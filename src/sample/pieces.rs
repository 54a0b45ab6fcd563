//! Cuts bodies into pieces at the borders of fields, so that the fields are the same all over a piece.
//!
//! Flat borders cut parts made of triangles exactly. At a curved border pieces are halved until the border is
//! almost flat in each, and then cut by its tangent plane. A ball through which a single plane or sphere passes
//! is cut in closed form, where there is one (`cap.rs`).

use super::cap;
use super::clip::{Plane, Triangle, content, extent, halving};
use super::part_shape::{Bulk, PartSolid};
use super::point::{Moment, SamplePoint};
use super::samples::Samples;
use crate::field::{Border, Cuts, Face, POINT, Query, SamplingRule};
use crate::math::{DPose3, DVec3, from_dvec3, from_f64, to_dvec3, to_f64};

/// At a curved border pieces are halved until it bends in each by less than this share of the body's extent,
const BEND: f64 = 0.1;

/// and by less than this share of the piece's thickness.
const BEND_OF_THICKNESS: f64 = 0.3;

/// Pieces smaller than this share of the body's extent are not halved.
const FINEST: f64 = 1.0 / 12.0;

/// A cut that would leave a thinner piece (as a share of the body's extent) is not made, and a piece that holds
/// a smaller share of its part is left out.
const LEAST: f64 = 1e-10;

/// Most pieces of one part.
const MOST_PIECES: usize = 1024;

/// Most cuts that lead to one piece.
const MOST_CUTS: u32 = 64;

/// A piece of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// The number of its part among all sites.
    pub site: usize,
    /// The fraction of its part that it is.
    fraction: f64,
    /// The centre of its volume.
    pub world_point: DVec3,
}

impl Samples {
    /// The size of a body, if a term with this rule cuts it at borders; `None` if it does not.
    pub(crate) fn cut(&self, how: SamplingRule, body: u32) -> Option<&Bulk> {
        if how.cuts == Cuts::Never {
            return None;
        }
        let own = self.overrides.get(body as usize).copied().flatten();
        let bulk = self.bulks.get(body as usize);
        bulk.filter(|_| own.is_none())
    }

    /// A piece as a term with this rule sees it, the weight of the force on it, and its lever arm in world
    /// axes.
    pub(crate) fn of_piece(
        &self,
        how: SamplingRule,
        body: u32,
        piece: &Piece,
        moment: Moment,
    ) -> (Query, f64, DVec3) {
        let (centre, site) = (&self.centres[body as usize], &self.sites[piece.site]);
        let attitude = &self.attitudes[body as usize];
        let arm = piece.world_point - to_dvec3(centre.world_point);
        let (whole, weight, middle) = match how.cuts {
            // A force that is shared out by mass acts on a whole body at its centre of mass.
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
    /// A piece as a sample, for explanations; `query` and `arm` are those of [`Samples::of_piece`].
    pub(crate) fn in_piece(
        &self,
        body: u32,
        piece: &Piece,
        query: &Query,
        arm: DVec3,
    ) -> SamplePoint {
        SamplePoint {
            world_point: from_dvec3(query.world_point),
            velocity: from_dvec3(query.world_velocity),
            arm: from_dvec3(arm),
            collider: self.sites[piece.site].collider,
            fraction: from_f64(piece.fraction),
            ..self.centres[body as usize]
        }
    }
}

/// Cuts bodies into pieces; keeps its buffers between calls.
#[derive(Debug, Default)]
pub(crate) struct Cutter {
    /// The triangles of the present piece, after those of the pieces it is cut from.
    triangles: Vec<Triangle>,
    pieces: Vec<Piece>,
}

/// The borders that cut a part, and the measures by which a piece is fine enough.
struct Cutting<'a> {
    borders: &'a [Border],
    pose: DPose3,
    site: usize,
    volume: f64,
    extent: f64,
}

/// The place of a face: the number of its border, and its own number there.
#[derive(Clone, Copy, Default)]
struct FacePlace {
    border: usize,
    face: usize,
}

impl Cutter {
    /// The pieces into which borders cut a body, given by its number.
    pub(crate) fn body(&mut self, samples: &Samples, body: u32, borders: &[Border]) -> &[Piece] {
        self.pieces.clear();
        let Some(bulk) = samples.bulks.get(body as usize) else {
            return &[];
        };
        let com = to_dvec3(samples.centres[body as usize].world_point);
        let pose = DPose3::from_parts(com, samples.attitudes[body as usize].rotation);
        for site in samples.sites_of(body as usize) {
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
            PartSolid::Ball(radius, mesh) => {
                if self.ball(&cutting, *radius) {
                    return;
                }
                (mesh, *radius)
            }
            PartSolid::Point => {
                self.pieces.push(cutting.piece(1.0, DVec3::ZERO));
                return;
            }
        };
        let centre = mesh.centre * scale;
        let (point, within) = (cutting.pose.transform_point(centre), mesh.extent * scale);
        let mut borders = cutting.borders.iter();
        if !borders.any(|border| border.passes(point, within)) {
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
        self.cell(&cutting, FacePlace::default(), 0, MOST_CUTS, most);
    }

    /// Cuts a ball in closed form, if at most one face passes through it. Returns true if it did.
    fn ball(&mut self, cutting: &Cutting<'_>, radius: f64) -> bool {
        let centre = cutting.pose.translation;
        let near = cutting.borders.iter();
        let near = near.filter(|border| border.passes(centre, radius));
        let mut faces = near.flat_map(|border| {
            let faces = (0..).map_while(move |number| border.face(number, centre, radius));
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

    /// Cuts the cell that the triangles from `start` on enclose, by the faces of the borders from the given one
    /// on, and removes its triangles. At most `left` cuts may lead from it to a piece.
    fn cell(
        &mut self,
        cutting: &Cutting<'_>,
        from: FacePlace,
        start: usize,
        left: u32,
        most: usize,
    ) {
        let cell = &self.triangles[start..];
        let (volume, centre) = content(cell);
        let share = volume / cutting.volume;
        let stop = left == 0 || self.pieces.len() >= most;
        let next = if stop || share.is_nan() || share <= LEAST {
            None
        } else {
            cutting.next(cell, volume, centre, from)
        };
        match next {
            None if share > LEAST => self.pieces.push(cutting.piece(share, centre)),
            None => {}
            Some((plane, from)) => {
                let end = self.triangles.len();
                for plane in [plane, plane.flipped()] {
                    plane.keep_below(&mut self.triangles, start..end, centre);
                    self.cell(cutting, from, end, left - 1, most);
                }
            }
        }
        self.triangles.truncate(start);
    }
}

impl Cutting<'_> {
    /// A piece whose `centre` is in the frame of the part.
    fn piece(&self, fraction: f64, centre: DVec3) -> Piece {
        Piece {
            site: self.site,
            fraction,
            world_point: self.pose.transform_point(centre),
        }
    }

    /// The plane that cuts a cell like a face that is almost flat there: parallel to its tangent plane, and
    /// behind it by the mean deviation of the face.
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

    /// The next plane that cuts a cell, and the border and face to go on with after that.
    fn next(
        &self,
        cell: &[Triangle],
        volume: f64,
        centre: DVec3,
        from: FacePlace,
    ) -> Option<(Plane, FacePlace)> {
        let world_point = self.pose.transform_point(centre);
        let radius = extent(cell, centre);
        let thickness = (volume / (radius * radius)).abs();
        let most = (BEND * self.extent).min(BEND_OF_THICKNESS * thickness);
        let borders = self.borders.iter().enumerate().skip(from.border);
        for (border_number, border) in borders {
            if !border.passes(world_point, radius) {
                continue;
            }
            let is_begun = border_number == from.border;
            let first = if is_begun { from.face } else { 0 };
            let faces =
                (first..).map_while(|face| Some((face, border.face(face, world_point, radius)?)));
            for (number, face) in faces {
                let here = FacePlace {
                    border: border_number,
                    face: number,
                };
                // A tangent plane may reach where its face does not.
                if face.distance.is_nan() || face.distance.abs() >= radius {
                    continue;
                }
                let straight = most >= face.curvature * radius * radius;
                if !straight && radius > FINEST * self.extent {
                    return Some((halving(cell), here));
                }
                let plane = self.plane(&face, cell, centre);
                if plane.parts(cell, LEAST * self.extent) {
                    let face = number + 1;
                    return Some((plane, FacePlace { face, ..here }));
                }
            }
        }
        None
    }
}
