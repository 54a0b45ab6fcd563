//! Batches of radial fields on parts with several samples. The positions of the samples follow from the pose of the
//! body, and only their total wrench is kept.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, dispatch};

use super::kernel::{Kernel, KernelLaw, with_kernel};
use super::lanes::{Eight, sum_of};
use super::one_way::Task;
use super::quantity::Quantity;
use super::sources::Sources;
use crate::math::{DMat3, Real, Vector, from_dvec3};
use crate::number::level;
use crate::rigid::Wrench;
use crate::sample::{CloudRun, Moment, Samples};

/// The number of samples that are evaluated together.
const WIDTH: usize = 8;

/// A factor on distances, so that rounding excludes no source in range.
const SLACK: Real = 1.000_1;

/// The samples of a part, and the pose of its body.
struct Cloud<'a> {
    local_arms: [&'a [Real]; 3],
    fractions: &'a [Real],
    centre: Vector,
    /// An upper bound of the distances of the samples from `centre`.
    extent: Real,
    /// The axes of the body, in the world.
    axes: [Vector; 3],
    owner: Real,
    range: Option<Real>,
    quantity: Quantity,
}

impl<'a> Cloud<'a> {
    fn new(samples: &'a Samples, run: &CloudRun, task: &Task<'_>) -> Self {
        let (body, places) = (run.whole.body as usize, run.padded_places());
        let turned = DMat3::from_quat(samples.attitudes[body].rotation);
        let columns = samples.clouds.local_arms.each_ref();
        Cloud {
            local_arms: columns.map(|column| &column[places.clone()]),
            fractions: &samples.clouds.fractions[places],
            centre: samples.centres[body].world_point,
            extent: samples.extent_of(run),
            axes: [turned.x_axis, turned.y_axis, turned.z_axis].map(from_dvec3),
            owner: run.whole.owner,
            range: task.batch.range,
            quantity: task.quantity,
        }
    }
}

impl Sources {
    /// Adds the wrenches of the gathered sources on the samples of clouds. A potential is added in place
    /// of the first component of the force.
    pub(super) fn add_to_clouds(&mut self, task: &Task<'_>, moment: Moment, sums: &mut [Wrench]) {
        let (law, level) = (KernelLaw::new(&task.batch.law), level());
        let mut near = std::mem::take(&mut self.near);
        for (run, body, weight) in task.clouds(moment) {
            let cloud = Cloud::new(task.samples, run, task);
            self.find_near(&cloud, &mut near);
            if near.is_empty() {
                continue;
            }
            let wrench = dispatch!(level, simd => with_kernel!(
                law, law => self.on_cloud(simd, law, &near, &cloud)
            ));
            sums[body] = sums[body].plus(wrench.times(weight));
        }
        self.near = near;
    }

    /// Lists the indices of the sources that may be within range of a sample of a cloud.
    fn find_near(&self, cloud: &Cloud<'_>, near: &mut Vec<u32>) {
        near.clear();
        let reach = cloud.range.map(|range| (range + cloud.extent) * SLACK);
        let most = reach.map_or(Real::INFINITY, |reach| reach * reach);
        self.for_each_near(cloud.centre, reach, |run| {
            let is_near = |at: &usize| {
                let point = Vector::new(self.x[*at], self.y[*at], self.z[*at]);
                let square = point.distance_squared(cloud.centre);
                square <= most && self.owner[*at] != cloud.owner
            };
            near.extend(run.filter(is_near).map(|at| at as u32));
        });
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn on_cloud<S: Simd>(
        &self,
        simd: S,
        law: impl Kernel,
        near: &[u32],
        cloud: &Cloud<'_>,
    ) -> Wrench {
        let zero = Eight::splat(simd, 0.0);
        let range = cloud.range.unwrap_or(Real::INFINITY);
        let (mut force, mut torque) = ([zero; 3], [zero; 3]);
        for at in (0..cloud.fractions.len()).step_by(WIDTH) {
            let [x, y, z] = cloud.local_arms;
            let local = [load(simd, x, at), load(simd, y, at), load(simd, z, at)];
            let fraction = load(simd, cloud.fractions, at);
            let counts = !fraction.simd_eq(0.0);
            let arm = turned(cloud.axes, local);
            let mut sum = [zero; 3];
            for source in near.iter().map(|source| *source as usize) {
                let dx = arm[0] + cloud.centre.x - self.x[source];
                let dy = arm[1] + cloud.centre.y - self.y[source];
                let dz = arm[2] + cloud.centre.z - self.z[source];
                let r2 = dx * dx + dy * dy + dz * dz;
                let acts = r2.simd_le(range * range) & counts;
                if acts.all_false() {
                    continue;
                }
                // Selected, since lanes that do not act may be infinite or NaN.
                let strength = self.strength[source];
                match cloud.quantity {
                    Quantity::Force => {
                        let factor = acts.select(law.factor(r2, acts) * strength, zero);
                        sum[0] += factor * acts.select(dx, zero);
                        sum[1] += factor * acts.select(dy, zero);
                        sum[2] += factor * acts.select(dz, zero);
                    }
                    Quantity::Potential => {
                        sum[0] += acts.select(law.potential(r2, acts) * strength, zero);
                    }
                }
            }
            let [x, y, z] = [sum[0] * fraction, sum[1] * fraction, sum[2] * fraction];
            force = [force[0] + x, force[1] + y, force[2] + z];
            torque = [
                torque[0] + (arm[1] * z - arm[2] * y),
                torque[1] + (arm[2] * x - arm[0] * z),
                torque[2] + (arm[0] * y - arm[1] * x),
            ];
        }
        Wrench {
            force: vector(force),
            torque: vector(torque),
        }
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, column: &[Real], at: usize) -> Eight<S> {
    Eight::from_slice(simd, &column[at..at + WIDTH])
}

/// The sum over all lanes of each component.
#[inline(always)]
fn vector<S: Simd>([x, y, z]: [Eight<S>; 3]) -> Vector {
    Vector::new(sum_of(x), sum_of(y), sum_of(z))
}

/// Lever arms turned from the axes of a body into those of the world.
#[inline(always)]
fn turned<V>(axes: [Vector; 3], [x, y, z]: [V; 3]) -> [V; 3]
where
    V: Copy + std::ops::Mul<Real, Output = V> + std::ops::Add<Output = V>,
{
    let [a, b, c] = axes;
    [
        x * a.x + y * b.x + z * c.x,
        x * a.y + y * b.y + z * c.y,
        x * a.z + y * b.z + z * c.z,
    ]
}
