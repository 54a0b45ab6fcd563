//! The rival: ammonia's forces as an experienced Rapier user would write them by hand.
//!
//! Plain `f32` code for this one model: a cell list of molecules, every pair once (Newton's third
//! law), buffers kept from step to step. Lennard-Jones acts between nitrogens, Coulomb between all
//! atoms of different molecules; both end at a cutoff on the distance of the two atoms, with the
//! force shifted to reach zero there: `F(r) - F(cutoff)`. Units are those of the scene: Å, amu,
//! ps.
//!
//! The fastest of those measured: a cell list of atoms takes 2.2 to 2.8 times as long, all pairs of
//! molecules without a list 1.2 times at 216 molecules and 9 times at 8,000.

use rapier3d_fields::rapier::prelude::{PhysicsWorld, RigidBodyHandle, Vector};
use rapier3d_fields::scenes::ammonia::{BoxOfAmmonia, COULOMB, LJ_EPSILON, LJ_SIGMA, SITES};

/// A number for each of the four atoms of a molecule.
///
/// With one array per axis, the compiler turns each loop over a neighbour's atoms into four SIMD
/// lanes: half the time of a loop over points that skips atoms beyond the cutoff.
type Four = [f32; 4];

/// A molecule as the pair loop reads it: the world positions of its atoms.
#[derive(Clone, Copy)]
struct Placed {
    center: Vector,
    x: Four,
    y: Four,
    z: Four,
}

/// The forces on the four atoms of a molecule.
#[derive(Clone, Copy, Default)]
struct AtomForces {
    x: Four,
    y: Four,
    z: Four,
}

/// Computes the forces between the molecules of a [`BoxOfAmmonia`], and steps its world with them.
pub struct HandWritten {
    /// Force on each molecule at its centre of mass, amu Å/ps².
    pub force: Vec<Vector>,
    /// Torque on each molecule about its centre of mass, world axes, amu Å²/ps².
    pub torque: Vec<Vector>,
    bodies: Vec<RigidBodyHandle>,
    interaction: Interaction,
    grid: Grid,
    /// World positions, in the order of `bodies`.
    placed: Vec<Placed>,
    /// The molecules sorted by cell: their numbers, positions and forces.
    order: Vec<u32>,
    sorted: Vec<Placed>,
    sorted_forces: Vec<AtomForces>,
}

impl HandWritten {
    /// Prepares for the molecules of `scene`, with `cutoff` in Å.
    pub fn new(scene: &BoxOfAmmonia, cutoff: f32) -> Self {
        let count = scene.molecules.len();
        let interaction = Interaction::new(cutoff);
        let nowhere = Placed {
            center: Vector::ZERO,
            x: [0.0; 4],
            y: [0.0; 4],
            z: [0.0; 4],
        };
        Self {
            force: vec![Vector::ZERO; count],
            torque: vec![Vector::ZERO; count],
            bodies: scene
                .molecules
                .iter()
                .map(|molecule| molecule.body)
                .collect(),
            grid: Grid::new(scene.half_extents, interaction.range, count),
            interaction,
            placed: vec![nowhere; count],
            order: vec![0; count],
            sorted: vec![nowhere; count],
            sorted_forces: vec![AtomForces::default(); count],
        }
    }

    /// Advances `world` by one step, with the forces at its start and Rapier's contacts.
    pub fn step(&mut self, world: &mut PhysicsWorld) {
        self.forces(world);
        for ((handle, force), torque) in self.bodies.iter().zip(&self.force).zip(&self.torque) {
            let body = &mut world.bodies[*handle];
            // Rapier keeps added forces until they are reset.
            body.reset_forces(true);
            body.reset_torques(true);
            body.add_force(*force, true);
            body.add_torque(*torque, true);
        }
        world.step();
    }

    /// Computes [`force`](Self::force) and [`torque`](Self::torque) for the poses in `world`.
    pub fn forces(&mut self, world: &PhysicsWorld) {
        self.place(world);
        self.grid.sort(&self.placed, &mut self.order);
        for (sorted, number) in self.sorted.iter_mut().zip(&self.order) {
            *sorted = self.placed[*number as usize];
        }
        self.sorted_forces.fill(AtomForces::default());
        self.all_pairs();
        self.gather();
    }

    fn place(&mut self, world: &PhysicsWorld) {
        for (placed, handle) in self.placed.iter_mut().zip(&self.bodies) {
            let pose = world.bodies[*handle].position();
            placed.center = pose.translation;
            for (k, site) in SITES.iter().enumerate() {
                let point =
                    pose.transform_point(Vector::from_array(site.local_point.map(|x| x as f32)));
                (placed.x[k], placed.y[k], placed.z[k]) = (point.x, point.y, point.z);
            }
        }
    }

    fn all_pairs(&mut self) {
        let range_squared = self.interaction.range * self.interaction.range;
        for i in 0..self.sorted.len() {
            let molecule = self.sorted[i];
            // Per atom, one term per atom of the neighbours: adding those up only once, at the
            // end, keeps the pair loop free of sums across lanes.
            let mut on_atoms = [AtomForces::default(); 4];
            for neighbors in self.grid.later_neighbors(i, molecule.center) {
                for j in neighbors {
                    let other = &self.sorted[j];
                    if molecule.center.distance_squared(other.center) < range_squared {
                        let on_other = &mut self.sorted_forces[j];
                        self.interaction
                            .add(&molecule, other, &mut on_atoms, on_other);
                    }
                }
            }
            let sum = &mut self.sorted_forces[i];
            for (k, on_atom) in on_atoms.iter().enumerate() {
                sum.x[k] += on_atom.x.iter().sum::<f32>();
                sum.y[k] += on_atom.y.iter().sum::<f32>();
                sum.z[k] += on_atom.z.iter().sum::<f32>();
            }
        }
    }

    /// Turns the forces on atoms into force and torque on molecules, in the order of `bodies`.
    fn gather(&mut self) {
        for (s, number) in self.order.iter().enumerate() {
            let (molecule, on_atoms) = (&self.sorted[s], &self.sorted_forces[s]);
            let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
            for k in 0..4 {
                let atom = Vector::new(molecule.x[k], molecule.y[k], molecule.z[k]);
                let on_atom = Vector::new(on_atoms.x[k], on_atoms.y[k], on_atoms.z[k]);
                force += on_atom;
                torque += (atom - molecule.center).cross(on_atom);
            }
            self.force[*number as usize] = force;
            self.torque[*number as usize] = torque;
        }
    }
}

/// The force law between two atoms.
struct Interaction {
    cutoff_squared: f32,
    /// Molecules whose centres are farther apart than this have no atoms within the cutoff.
    range: f32,
    /// `COULOMB * q_i * q_j`.
    coulomb: [Four; 4],
    /// `1 / cutoff²`: what the shift takes off Coulomb's `1 / r²`.
    inverse_cutoff_squared: f32,
    /// The Lennard-Jones force is `(a / r^12 - b / r^6) / r`, less its value at the cutoff.
    lj_a: f32,
    lj_b: f32,
    lj_at_cutoff: f32,
}

impl Interaction {
    fn new(cutoff: f32) -> Self {
        let arm = SITES
            .map(|site| site.local_point.iter().map(|x| x * x).sum::<f64>().sqrt())
            .into_iter()
            .fold(0.0, f64::max);
        let sigma_6 = LJ_SIGMA.powi(6);
        let (lj_a, lj_b) = (
            48.0 * LJ_EPSILON * sigma_6 * sigma_6,
            24.0 * LJ_EPSILON * sigma_6,
        );
        let rc = f64::from(cutoff);
        Self {
            cutoff_squared: cutoff * cutoff,
            range: cutoff + 2.0 * arm as f32,
            coulomb: SITES.map(|a| SITES.map(|b| (COULOMB * a.charge * b.charge) as f32)),
            inverse_cutoff_squared: (1.0 / (rc * rc)) as f32,
            lj_a: lj_a as f32,
            lj_b: lj_b as f32,
            lj_at_cutoff: (lj_a / rc.powi(13) - lj_b / rc.powi(7)) as f32,
        }
    }

    /// Adds the forces that two molecules exert on each other: `on_a[i]` takes what atom `i` of
    /// `a` feels from each atom of `b`.
    ///
    /// Written as a chain of loops over four lanes, without branches, so that each becomes a few
    /// vector instructions.
    #[inline(always)]
    fn add(&self, a: &Placed, b: &Placed, on_a: &mut [AtomForces; 4], on_b: &mut AtomForces) {
        for (i, on_atom) in on_a.iter_mut().enumerate() {
            let dx: Four = std::array::from_fn(|j| a.x[i] - b.x[j]);
            let dy: Four = std::array::from_fn(|j| a.y[i] - b.y[j]);
            let dz: Four = std::array::from_fn(|j| a.z[i] - b.z[j]);
            let r2: Four = std::array::from_fn(|j| dx[j] * dx[j] + dy[j] * dy[j] + dz[j] * dz[j]);
            let inverse_r: Four = r2.map(|r2| 1.0 / r2.sqrt());
            let mut force: Four = std::array::from_fn(|j| {
                self.coulomb[i][j] * (inverse_r[j] * inverse_r[j] - self.inverse_cutoff_squared)
            });
            // Atom 0 is the nitrogen, the only one with a Lennard-Jones term.
            if i == 0 {
                let inverse_r2 = inverse_r[0] * inverse_r[0];
                let inverse_r6 = inverse_r2 * inverse_r2 * inverse_r2;
                force[0] += (self.lj_a * inverse_r6 - self.lj_b) * inverse_r6 * inverse_r[0]
                    - self.lj_at_cutoff;
            }
            let scale: Four = std::array::from_fn(|j| {
                if r2[j] < self.cutoff_squared {
                    force[j] * inverse_r[j]
                } else {
                    0.0
                }
            });
            for j in 0..4 {
                on_b.x[j] -= scale[j] * dx[j];
                on_b.y[j] -= scale[j] * dy[j];
                on_b.z[j] -= scale[j] * dz[j];
            }
            for j in 0..4 {
                on_atom.x[j] += scale[j] * dx[j];
                on_atom.y[j] += scale[j] * dy[j];
                on_atom.z[j] += scale[j] * dz[j];
            }
        }
    }
}

/// Cells over the box, half as wide as the range: neighbours are up to two cells away.
///
/// With cells as wide as the range the search covers more outside the sphere of neighbours, and
/// takes 4 % longer in the default scene, 20 % in a liquid.
struct Grid {
    half_extents: Vector,
    cells_per_length: Vector,
    size: [i32; 3],
    /// Per cell, where its molecules begin in the sorted order; then the number of molecules.
    starts: Vec<u32>,
    /// The cell of each molecule.
    cell: Vec<u32>,
}

/// How many cells away a neighbour may be.
const REACH: i32 = 2;

impl Grid {
    fn new(half_extents: Vector, range: f32, count: usize) -> Self {
        // At least as wide as `range / REACH`.
        let size = half_extents
            .to_array()
            .map(|h| ((2.0 * h * REACH as f32 / range) as i32).max(1));
        let cells_per_length = Vector::from_array(size.map(|n| n as f32)) / (2.0 * half_extents);
        let cells = size.iter().product::<i32>() as usize;
        Self {
            half_extents,
            cells_per_length,
            size,
            starts: vec![0; cells + 1],
            cell: vec![0; count],
        }
    }

    /// The cell of a point. One outside the box goes to the nearest cell, which brings it no
    /// farther from its neighbours' cells than it is from them.
    fn coordinates(&self, point: Vector) -> [i32; 3] {
        let scaled = ((point + self.half_extents) * self.cells_per_length).to_array();
        std::array::from_fn(|axis| (scaled[axis] as i32).clamp(0, self.size[axis] - 1))
    }

    /// Counting sort: fills `order` with the numbers of the molecules, cell by cell.
    fn sort(&mut self, placed: &[Placed], order: &mut [u32]) {
        self.starts.fill(0);
        for (number, molecule) in placed.iter().enumerate() {
            let [x, y, z] = self.coordinates(molecule.center);
            let cell = self.index(x, y, z);
            self.cell[number] = cell as u32;
            self.starts[cell] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        // `starts` now holds ends. Filling each cell from its end moves it back to the start.
        for (number, cell) in self.cell.iter().enumerate().rev() {
            let start = &mut self.starts[*cell as usize];
            *start -= 1;
            order[*start as usize] = number as u32;
        }
    }

    fn index(&self, x: i32, y: i32, z: i32) -> usize {
        ((x * self.size[1] + y) * self.size[2] + z) as usize
    }

    /// Ranges of the sorted order that hold all neighbours of molecule `i` that come after it.
    ///
    /// Cells follow each other along z, so the neighbours in a column are one range.
    fn later_neighbors(
        &self,
        i: usize,
        center: Vector,
    ) -> impl Iterator<Item = std::ops::Range<usize>> {
        let [x, y, z] = self.coordinates(center);
        let [nx, ny, nz] = self.size;
        let (low, high) = ((z - REACH).max(0), (z + REACH).min(nz - 1));
        let own = i + 1..self.starts[self.index(x, y, high) + 1] as usize;
        let column = move |x, y| {
            self.starts[self.index(x, y, low)] as usize
                ..self.starts[self.index(x, y, high) + 1] as usize
        };
        let same_x = (y + 1..=(y + REACH).min(ny - 1)).map(move |y| column(x, y));
        let later_x = (x + 1..=(x + REACH).min(nx - 1)).flat_map(move |x| {
            ((y - REACH).max(0)..=(y + REACH).min(ny - 1)).map(move |y| column(x, y))
        });
        std::iter::once(own).chain(same_x).chain(later_x)
    }
}
