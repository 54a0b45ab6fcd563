//! The samples of parts that have several. Their places follow from the poses of their bodies and from columns of
//! points, which parts of equal shape share: thousands of equal boxes have one set of columns.

use std::ops::Range;

use super::point::SamplePoint;
use crate::math::{DVec3, Real, Vector, from_f64, to_f64};
use crate::number::{LANES, each_lane};

/// The number of samples that are placed together. Columns are padded to a multiple of it.
pub(crate) const BLOCK: usize = LANES;

/// The samples that are not sites, part by part.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clouds {
    /// In the order of their bodies.
    pub runs: Vec<CloudRun>,
    /// Columns of the places of samples, from the centre of mass, in the axes of the body.
    pub local_arms: [Vec<Real>; 3],
    /// The fraction of its part that each sample stands for; zero for padding.
    pub fractions: Vec<Real>,
    /// For each block of samples, the run that it belongs to.
    run_of: Vec<u32>,
    /// The columns of a single sample at the centre of mass.
    centre: Option<Columns>,
}

/// The samples of one kind in one part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CloudRun {
    /// The part as a whole: its samples differ from it only in place and fraction.
    pub whole: SamplePoint,
    /// The number of its first block.
    first: u32,
    columns: Columns,
}

/// The places of the samples of a run in the columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Columns {
    start: u32,
    count: u32,
    /// A bound of the lengths of the arms.
    extent: Real,
}

impl Columns {
    fn blocks(self) -> usize {
        (self.count as usize).div_ceil(BLOCK)
    }
}

/// Samples of one run in world axes, in lanes. Lanes from `count` on are padding.
pub(crate) struct PlacedBlock<'a> {
    pub run: &'a CloudRun,
    pub count: usize,
    /// From the centre of mass, in world axes, one coordinate after the other.
    pub arms: [[Real; BLOCK]; 3],
    pub world_points: [[Real; BLOCK]; 3],
    /// Velocities of the body's material there, in world axes.
    pub velocities: [[Real; BLOCK]; 3],
    pub fractions: &'a [Real; BLOCK],
}

impl PlacedBlock<'_> {
    /// The arm of a sample, in world axes.
    pub(crate) fn arm(&self, lane: usize) -> Vector {
        at(&self.arms, lane)
    }

    /// The place of a sample.
    pub(crate) fn world_point(&self, lane: usize) -> Vector {
        at(&self.world_points, lane)
    }

    /// A sample by itself.
    pub(crate) fn sample(&self, lane: usize) -> SamplePoint {
        SamplePoint {
            arm: self.arm(lane),
            world_point: self.world_point(lane),
            velocity: at(&self.velocities, lane),
            fraction: self.fractions[lane],
            ..self.run.whole
        }
    }
}

/// The body of a block, at one moment.
pub(super) struct BodyPlacement {
    /// The centre of mass.
    pub centre: Vector,
    pub linvel: Vector,
    pub angvel: Vector,
    /// The axes of the body, in the world.
    pub axes: [DVec3; 3],
}

impl CloudRun {
    /// The range of its samples in the columns.
    pub(crate) fn places(&self) -> Range<usize> {
        let start = self.columns.start as usize;
        start..start + self.columns.count as usize
    }

    /// The same range with the padding after it.
    pub(crate) fn padded_places(&self) -> Range<usize> {
        let start = self.columns.start as usize;
        start..start + self.columns.blocks() * BLOCK
    }

    /// The numbers of its blocks.
    pub(crate) fn blocks(&self) -> Range<u32> {
        self.first..self.first + self.columns.blocks() as u32
    }

    /// A bound of the lengths of its arms.
    pub(super) fn extent(&self) -> Real {
        self.columns.extent
    }
}

impl Clouds {
    /// Adds points, given by their arms in the axes of a body and their fractions, for the runs that have them.
    pub(crate) fn add_columns(
        &mut self,
        points: impl Iterator<Item = ([Real; 3], Real)>,
    ) -> Columns {
        let start = self.fractions.len();
        let (mut last, mut extent) = ([0.0; 3], 0.0 as Real);
        for (local_arm, fraction) in points {
            last = local_arm;
            extent = extent.max(Vector::from_array(local_arm).length());
            self.push_point(local_arm, fraction);
        }
        let columns = Columns {
            start: start as u32,
            count: (self.fractions.len() - start) as u32,
            // Rounded up.
            extent: extent * (1.0 + Real::EPSILON * 4.0),
        };
        let end = start + columns.blocks() * BLOCK;
        (self.fractions.len()..end).for_each(|_| self.push_point(last, 0.0));
        columns
    }

    /// The columns of a single sample at the centre of mass.
    pub(crate) fn centre(&mut self) -> Columns {
        let known = self.centre.take();
        let point = ([0.0; 3], 1.0);
        let columns = known.unwrap_or_else(|| self.add_columns([point].into_iter()));
        *self.centre.insert(columns)
    }

    fn push_point(&mut self, local_arm: [Real; 3], fraction: Real) {
        for (column, x) in self.local_arms.iter_mut().zip(local_arm) {
            column.push(x);
        }
        self.fractions.push(fraction);
    }

    /// Adds the samples of a part at the points of some columns.
    pub(crate) fn add(&mut self, whole: SamplePoint, columns: Columns) {
        let number = self.runs.len() as u32;
        let first = self.run_of.len() as u32;
        self.run_of
            .resize(self.run_of.len() + columns.blocks(), number);
        self.runs.push(CloudRun {
            whole,
            first,
            columns,
        });
    }

    /// Adds a run of other clouds, as one of this part.
    pub(super) fn take(&mut self, run: &CloudRun, from: &Clouds, whole: SamplePoint) {
        let points = run.places().map(|at| (from.arm(at), from.fractions[at]));
        let columns = self.add_columns(points);
        self.add(whole, columns);
    }

    /// The arm at a place in the columns.
    pub(crate) fn arm(&self, at: usize) -> [Real; 3] {
        self.local_arms.each_ref().map(|column| column[at])
    }

    /// The run that a block belongs to.
    #[inline]
    pub(super) fn run_of(&self, block: u32) -> &CloudRun {
        &self.runs[self.run_of[block as usize] as usize]
    }

    /// The samples of a block of a run.
    #[inline(always)]
    pub(super) fn placed<'a>(
        &'a self,
        run: &'a CloudRun,
        block: u32,
        body: &BodyPlacement,
    ) -> PlacedBlock<'a> {
        let before = (block - run.first) as usize * BLOCK;
        let at = run.columns.start as usize + before;
        let [x, y, z] = [0, 1, 2].map(|k| eight(&self.local_arms[k], at));
        let turned = |a: f64, b: f64, c: f64, lane: usize| -> Real {
            from_f64(to_f64(x[lane]) * a + to_f64(y[lane]) * b + to_f64(z[lane]) * c)
        };
        let [a, b, c] = body.axes;
        let arms = [
            each_lane(|lane| turned(a.x, b.x, c.x, lane)),
            each_lane(|lane| turned(a.y, b.y, c.y, lane)),
            each_lane(|lane| turned(a.z, b.z, c.z, lane)),
        ];
        let BodyPlacement {
            centre,
            linvel,
            angvel,
            ..
        } = body;
        let sum = |start: Real, arms: &[Real; BLOCK]| each_lane(|lane| start + arms[lane]);
        let material =
            |start: Real, one: Real, by: &[Real; BLOCK], other: Real, to: &[Real; BLOCK]| {
                each_lane(|lane| start + (one * by[lane] - other * to[lane]))
            };
        PlacedBlock {
            run,
            count: (run.columns.count as usize - before).min(BLOCK),
            world_points: [
                sum(centre.x, &arms[0]),
                sum(centre.y, &arms[1]),
                sum(centre.z, &arms[2]),
            ],
            velocities: [
                material(linvel.x, angvel.y, &arms[2], angvel.z, &arms[1]),
                material(linvel.y, angvel.z, &arms[0], angvel.x, &arms[2]),
                material(linvel.z, angvel.x, &arms[1], angvel.y, &arms[0]),
            ],
            arms,
            fractions: eight(&self.fractions, at),
        }
    }

    pub(super) fn clear(&mut self) {
        self.runs.clear();
        self.local_arms.iter_mut().for_each(Vec::clear);
        self.fractions.clear();
        self.run_of.clear();
        self.centre = None;
    }
}

#[inline(always)]
fn at([x, y, z]: &[[Real; BLOCK]; 3], lane: usize) -> Vector {
    Vector::new(x[lane], y[lane], z[lane])
}

#[inline(always)]
fn eight(column: &[Real], at: usize) -> &[Real; BLOCK] {
    let (eight, _) = column[at..].split_first_chunk().expect("padded columns");
    eight
}
