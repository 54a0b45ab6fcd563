//! Cuts bodies into pieces at the borders of fields, so that each piece is inside or outside of each region.
//!
//! Flat borders cut parts made of triangles exactly. At a curved border pieces are halved until the border is
//! almost flat in each, and then cut by its tangent plane. A ball through which a single plane or sphere passes
//! is cut in closed form, where there is one (`cap.rs`).

use super::cap;
use super::clip::{Content, Plane, Triangle};
use super::part_shape::{Bulk, Mesh, PartSolid};
use super::point::{Moment, SamplePoint};
use super::samples::Samples;
use crate::field::{Border, Cuts, Face, POINT, Query, SamplingRule};
use crate::math::{DPose3, DVec3, from_dvec3, from_f64, to_dvec3, to_f64};

/// At a curved border pieces are halved until the border bends in each by less than this share of the body's extent.
const BEND: f64 = 0.1;

/// The same, as a share of the thickness of the piece; both must hold.
const BEND_OF_THICKNESS: f64 = 0.3;

/// Pieces smaller than this share of the body's extent are not halved.
const FINEST: f64 = 1.0 / 12.0;

/// A cut that would leave a thinner piece (as a share of the body's extent) is not made, and a piece that holds
/// a smaller share of its part is left out.
const LEAST: f64 = 1e-10;

/// A part with this number of pieces is not cut any further.
const MOST_PIECES: usize = 1024;

/// The largest number of cuts that lead to one piece.
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
    pub(crate) fn cut(&self, rule: SamplingRule, body: u32) -> Option<&Bulk> {
        if rule.cuts == Cuts::Never {
            return None;
        }
        let own = self.overrides.get(body as usize).copied().flatten();
        let bulk = self.bulks.get(body as usize);
        bulk.filter(|_| own.is_none())
    }

    /// The query at a piece for a term with this rule, the weight of the force on the piece, and its lever arm in
    /// world axes.
    pub(crate) fn of_piece(
        &self,
        rule: SamplingRule,
        body: u32,
        piece: &Piece,
        moment: Moment,
    ) -> (Query, f64, DVec3) {
        let (centre, site) = (&self.centres[body as usize], &self.sites[piece.site]);
        let attitude = &self.attitudes[body as usize];
        let arm = piece.world_point - to_dvec3(centre.world_point);
        let (whole, weight, middle) = match rule.cuts {
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
    pieces: Vec<Piece>,
    /// Empty lists, to be reused.
    spare: Vec<Vec<Triangle>>,
}

/// The next cut of a solid.
enum Cut {
    /// Into its halves, which are then cut by the faces from this one on.
    Halves(FacePlace),
    /// By a plane, with the content below it; the two parts are then cut by the faces from this one on.
    Plane(Plane, Content, FacePlace),
}

/// The borders that cut a part, and the measures by which a piece is fine enough.
struct Cutting<'a> {
    borders: &'a [Border],
    pose: DPose3,
    /// The unit of length in the frame of the part.
    scale: f64,
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
                scale: 1.0,
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
        let cutting = Cutting {
            volume: mesh.content.volume,
            extent: cutting.extent / scale,
            scale,
            ..cutting
        };
        let most = self.pieces.len() + MOST_PIECES;
        self.cut(&cutting, FacePlace::default(), mesh, MOST_CUTS, most);
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
        // Two faces may be one plane: the surface of a fluid is often that of its region, too.
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

    /// Cuts a solid by the faces of the borders from the given one on. At most `left` more cuts may lead to a piece,
    /// and there are no cuts once there are `most` pieces.
    fn cut(&mut self, cutting: &Cutting<'_>, from: FacePlace, mesh: &Mesh, left: u32, most: usize) {
        let may_go_on = left > 0 && self.pieces.len() < most;
        let cut = may_go_on.then(|| cutting.next(mesh, from)).flatten();
        match cut {
            None => self.pieces.push(cutting.piece_of(&mesh.content)),
            Some(Cut::Halves(from)) => {
                for half in mesh.halves() {
                    if self.is_open(cutting, from, &half.content, half.extent) {
                        self.cut(cutting, from, half, left - 1, most);
                    }
                }
            }
            Some(Cut::Plane(plane, below, from)) => {
                let Content { centre, .. } = mesh.content;
                let above = mesh.content.without(&below);
                for (plane, content) in [(plane, below), (plane.flipped(), above)] {
                    let reach = mesh.extent + content.centre.distance(centre);
                    if !self.is_open(cutting, from, &content, reach) {
                        continue;
                    }
                    let mut triangles = self.spare.pop().unwrap_or_default();
                    plane.keep_below(&mesh.triangles, centre, &mut triangles);
                    let mut part = Mesh::new(triangles, content);
                    self.cut(cutting, from, &part, left - 1, most);
                    part.triangles.clear();
                    self.spare.push(part.triangles);
                }
            }
        }
    }

    /// Returns true if faces from the given one on may pass within a distance of the centre of a part of a solid.
    /// Otherwise adds the part as a piece, unless it is too small.
    fn is_open(
        &mut self,
        cutting: &Cutting<'_>,
        from: FacePlace,
        part: &Content,
        within: f64,
    ) -> bool {
        let piece = cutting.piece_of(part);
        if piece.fraction.is_nan() || piece.fraction <= LEAST {
            return false;
        }
        let is_open = cutting.faces(part.centre, within, from).next().is_some();
        if !is_open {
            self.pieces.push(piece);
        }
        is_open
    }
}

impl Cutting<'_> {
    /// A piece whose `centre` is in the frame of the part.
    fn piece(&self, fraction: f64, centre: DVec3) -> Piece {
        Piece {
            site: self.site,
            fraction,
            world_point: self.pose.transform_point(centre * self.scale),
        }
    }

    fn piece_of(&self, content: &Content) -> Piece {
        self.piece(content.volume / self.volume, content.centre)
    }

    /// The faces from the given one on whose tangent planes pass within a distance of a point, as seen from the point.
    /// Distances are in the frame of the part, directions in world axes.
    fn faces(
        &self,
        centre: DVec3,
        within: f64,
        from: FacePlace,
    ) -> impl Iterator<Item = (FacePlace, Face)> {
        let scale = self.scale;
        let world_point = self.pose.transform_point(centre * scale);
        let reach = within * scale;
        let borders = self.borders.iter().enumerate().skip(from.border);
        let borders = borders.filter(move |(_, border)| border.passes(world_point, reach));
        let faces = borders.flat_map(move |(number, border)| {
            let first = if number == from.border { from.face } else { 0 };
            (first..).map_while(move |face| {
                let seen = border.face(face, world_point, reach)?;
                let place = FacePlace {
                    border: number,
                    face,
                };
                let local = Face {
                    distance: seen.distance / scale,
                    curvature: seen.curvature * scale,
                    ..seen
                };
                Some((place, local))
            })
        });
        // A face itself may be farther away than its tangent plane.
        faces.filter(move |(_, face)| face.distance.abs() < within)
    }

    /// The plane that replaces a face that is almost flat within a solid: parallel to the tangent plane, and behind it
    /// by the mean deviation of the face.
    fn plane(&self, face: &Face, mesh: &Mesh) -> Plane {
        let centre = mesh.content.centre;
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
        let [area, squares] = tangent.section(&mesh.triangles, apex, to_local * straight);
        let behind = face.curvature * 0.5 * squares / area;
        let offset = tangent.offset - if behind > 0.0 { behind } else { 0.0 };
        Plane { offset, ..tangent }
    }

    /// The next cut of a solid by the faces from the given one on.
    fn next(&self, mesh: &Mesh, from: FacePlace) -> Option<Cut> {
        let (Content { volume, centre }, radius) = (mesh.content, mesh.extent);
        let thickness = (volume / (radius * radius)).abs();
        let most = (BEND * self.extent).min(BEND_OF_THICKNESS * thickness);
        let mut faces = self.faces(centre, radius, from);
        faces.find_map(|(here, face)| {
            let straight = most >= face.curvature * radius * radius;
            if !straight && radius > FINEST * self.extent {
                return Some(Cut::Halves(here));
            }
            let plane = self.plane(&face, mesh);
            let below = plane.below(&mesh.triangles, centre);
            let share = below.volume / volume;
            let next = FacePlace {
                face: here.face + 1,
                ..here
            };
            let parts = share > LEAST && share < 1.0 - LEAST;
            parts.then_some(Cut::Plane(plane, below, next))
        })
    }
}
