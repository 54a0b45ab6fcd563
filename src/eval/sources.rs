//! The sources of one batch of radial fields, in columns, sorted by the cells of a grid.

use std::collections::HashMap;
use std::ops::Range;

use super::lanes::WIDTH;
use super::quantity::Quantity;
use crate::compile::{AnchorId, Key, RadialBatch, RadialSource};
use crate::field::Frame;
use crate::math::{DVec3, Real, Vector, to_f64};
use crate::neighbors::{FEWEST_FOR_GRID, PointGrid};
use crate::sample::owner;

/// Sources in columns, sorted by the cells of a grid if there are many, and within a cell by their terms. Columns
/// are padded, so that [`Four`](super::lanes::Four) can be read behind each row of cells.
#[derive(Debug, Default)]
pub(super) struct Sources {
    points: Vec<Vector>,
    kept: Vec<(Real, Real)>,
    pub(super) x: Vec<Real>,
    pub(super) y: Vec<Real>,
    pub(super) z: Vec<Real>,
    pub(super) strength: Vec<Real>,
    pub(super) owner: Vec<Real>,
    grid: PointGrid,
    gridded: bool,
    /// The stamp of the batch they were gathered from, if all its sources stand still; else zero.
    stamp: u64,
    /// The term of each source, if `stamp` is not zero.
    serials: Vec<Key>,
    count: usize,
    /// The corners of the box around the sources, and the number of sources in each of its faces.
    bounds: [Vector; 2],
    in_faces: [usize; 6],
    /// For rows that were moved, the index beyond which the row must not grow.
    limits: HashMap<usize, usize>,
    /// A buffer: the indices of the sources near a cloud.
    pub(super) near: Vec<u32>,
}

impl Sources {
    /// Gathers the sources whose anchors exist, and sorts them into a grid if there are many.
    pub(super) fn gather(
        &mut self,
        batch: &RadialBatch,
        sources: &[RadialSource],
        frame: impl FnMut(AnchorId) -> Option<Frame>,
        quantity: Quantity,
    ) {
        self.points.clear();
        self.kept.clear();
        for (point, strength, owner) in present(sources, frame, quantity) {
            self.points.push(point);
            self.kept.push((strength, owner));
        }
        self.count = self.points.len();
        self.gridded = is_gridded(batch, self.count);
        let side = self.side(batch);
        self.grid.build(&self.points, side);
        self.columns().into_iter().for_each(Vec::clear);
        for source in self.grid.order() {
            let (point, (strength, owner)) =
                (self.points[*source as usize], self.kept[*source as usize]);
            self.x.push(point.x);
            self.y.push(point.y);
            self.z.push(point.z);
            self.strength.push(strength);
            self.owner.push(owner);
        }
        for column in self.columns() {
            column.extend([0.0; WIDTH]);
        }
        match batch.moving {
            0 => self.note_terms(batch),
            _ => self.stamp = 0,
        }
    }

    /// Records the properties that [`Sources::follow`] needs.
    fn note_terms(&mut self, batch: &RadialBatch) {
        let order = self.grid.order().iter();
        self.serials.clear();
        self.serials
            .extend(order.map(|source| batch.serials[*source as usize]));
        self.serials.resize(self.x.len(), 0);
        self.limits.clear();
        let infinity = Vector::splat(Real::INFINITY);
        let points = self.points.iter();
        self.bounds = points.fold([infinity, -infinity], |[low, high], point| {
            [low.min(*point), high.max(*point)]
        });
        self.in_faces = [0; 6];
        for point in &self.points {
            for face in faces(self.bounds, *point) {
                self.in_faces[face] += 1;
            }
        }
    }

    fn columns(&mut self) -> [&mut Vec<Real>; 5] {
        let (strength, owner) = (&mut self.strength, &mut self.owner);
        [&mut self.x, &mut self.y, &mut self.z, strength, owner]
    }

    /// The side of the grid's cells. Half the range: smaller cells exclude more sources outside of the ball, which pays
    /// for the additional ranges.
    fn side(&self, batch: &RadialBatch) -> Real {
        let range = batch.range.filter(|_| self.gridded);
        range.map_or(Real::MAX, |range| range * 0.5)
    }

    /// The indices of all sources, if there is no grid.
    fn all(&self) -> Range<usize> {
        let [_, row] = self.grid.runs(0);
        row
    }

    /// The indices of all sources, if there is no grid and they are at most [`WIDTH`].
    pub(super) fn few(&self) -> Option<Range<usize>> {
        let all = (!self.gridded).then(|| self.all());
        all.filter(|all| all.len() <= WIDTH)
    }

    /// The position of the source of an index.
    pub(super) fn point(&self, at: usize) -> DVec3 {
        DVec3::new(to_f64(self.x[at]), to_f64(self.y[at]), to_f64(self.z[at]))
    }

    /// Visits ranges of indices that together hold all sources within range of a point, and some farther ones.
    #[inline(always)]
    pub(super) fn for_each_near(
        &self,
        point: Vector,
        range: Option<Real>,
        mut visit: impl FnMut(Range<usize>),
    ) {
        match range.filter(|_| self.gridded) {
            Some(range) => self.grid.for_each_near(point, range, visit),
            None => visit(self.all()),
        }
    }

    /// Brings the sources of a batch up to date.
    pub(super) fn refresh(
        &mut self,
        batch: &RadialBatch,
        mut frame: impl FnMut(AnchorId) -> Option<Frame>,
        quantity: Quantity,
    ) {
        if batch.moving > 0 || !self.follow(batch, &mut frame) {
            self.gather(batch, &batch.sources, frame, quantity);
        }
    }

    /// Follows the changes of a batch whose sources all stand still, so that the sources are the same as after
    /// [`Sources::gather`]. Returns false if that is not possible.
    fn follow(
        &mut self,
        batch: &RadialBatch,
        frame: impl FnMut(AnchorId) -> Option<Frame>,
    ) -> bool {
        let before = std::mem::replace(&mut self.stamp, batch.log.stamp);
        before == batch.log.stamp || self.patch(batch, before, frame).is_some()
    }

    /// Replaces the sources of the terms that were changed; `None` if the grid would have another shape.
    fn patch(
        &mut self,
        batch: &RadialBatch,
        before: u64,
        mut frame: impl FnMut(AnchorId) -> Option<Frame>,
    ) -> Option<()> {
        let changes = batch.log.since(before)?;
        let mut terms: Vec<Key> = changes.clone().map(|(serial, _)| serial).collect();
        for (serial, stood) in changes {
            if let Some(point) = stood {
                self.remove(serial, point);
            }
        }
        terms.sort_unstable();
        terms.dedup();
        for serial in terms {
            for source in &batch.sources[batch.places_of(serial)] {
                let frame = frame(source.anchor)?;
                self.insert(serial, frame.pose.translation, source.strength)?;
            }
        }
        let [low, high] = self.bounds;
        let same = self.in_faces.iter().all(|count| *count > 0)
            && self.gridded == is_gridded(batch, self.count)
            && self
                .grid
                .keeps_shape(high - low, self.count, self.side(batch));
        same.then_some(())
    }

    /// Removes a source of a term. A source that was added and removed since the last update is absent.
    fn remove(&mut self, serial: Key, point: Vector) {
        let cell = self.grid.cell_of(point);
        let [mut run, row] = self.grid.runs(cell);
        let found = run.find(|at| {
            let here = Vector::new(self.x[*at], self.y[*at], self.z[*at]);
            self.serials[*at] == serial && here == point
        });
        let Some(at) = found else { return };
        for column in self.columns() {
            column.copy_within(at + 1..row.end, at);
        }
        self.serials.copy_within(at + 1..row.end, at);
        self.grid.resize(cell, -1);
        self.count -= 1;
        for face in faces(self.bounds, point) {
            self.in_faces[face] -= 1;
        }
    }

    /// Inserts a source of a term, after those it has in the cell; `None` if the source is out of bounds.
    fn insert(&mut self, serial: Key, point: Vector, strength: Real) -> Option<()> {
        let [low, high] = self.bounds;
        let inside = point.cmpge(low) & point.cmple(high);
        let cell = self.grid.cell_of(Some(point).filter(|_| inside.all())?);
        self.make_room(cell);
        let [run, row] = self.grid.runs(cell);
        let at = run.start + self.serials[run].partition_point(|known| *known <= serial);
        let values = [point.x, point.y, point.z, strength, owner(None)];
        for (column, value) in self.columns().into_iter().zip(values) {
            column.copy_within(at..row.end, at + 1);
            column[at] = value;
        }
        self.serials.copy_within(at..row.end, at + 1);
        self.serials[at] = serial;
        self.grid.resize(cell, 1);
        self.count += 1;
        for face in faces(self.bounds, point) {
            self.in_faces[face] += 1;
        }
        Some(())
    }

    /// Moves the row of a cell to the end of the columns, unless there is room behind it.
    fn make_room(&mut self, cell: usize) {
        let (number, [_, row]) = (self.grid.row_of(cell), self.grid.runs(cell));
        if self
            .limits
            .get(&number)
            .is_some_and(|limit| row.end < *limit)
        {
            return;
        }
        let to = self.x.len();
        let limit = to + 2 * row.len() + WIDTH;
        for column in self.columns() {
            column.extend_from_within(row.clone());
            column.resize(limit + WIDTH, 0.0);
        }
        self.serials.extend_from_within(row);
        self.serials.resize(limit + WIDTH, 0);
        self.grid.move_row(cell, to);
        self.limits.insert(number, limit);
    }
}

/// The sources whose anchors exist: their points and strengths, and the [owners](owner) of their samples.
pub(super) fn present(
    sources: &[RadialSource],
    mut frame: impl FnMut(AnchorId) -> Option<Frame>,
    quantity: Quantity,
) -> impl Iterator<Item = (Vector, Real, Real)> {
    sources.iter().filter_map(move |source| {
        let frame = frame(source.anchor)?;
        let is_shared = quantity == Quantity::Potential && frame.body.is_some();
        let share = if is_shared { 0.5 } else { 1.0 };
        let strength = source.strength * share;
        Some((frame.pose.translation, strength, owner(frame.body)))
    })
}

fn is_gridded(batch: &RadialBatch, count: usize) -> bool {
    batch.range.is_some() && count >= FEWEST_FOR_GRID
}

/// The numbers of the faces of a box that a point lies in.
fn faces(bounds: [Vector; 2], point: Vector) -> impl Iterator<Item = usize> {
    let corners = bounds.into_iter().flat_map(|corner| corner.to_array());
    let coordinates = point.to_array().into_iter().cycle();
    let pairs = corners.zip(coordinates).enumerate();
    pairs.filter_map(|(face, (bound, x))| (bound == x).then_some(face))
}
