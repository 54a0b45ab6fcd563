//! The plain rival: the loop that a Rapier user writes for ammonia. A cell list of atoms, every pair once (Newton's
//! third law), one pair at a time, buffers kept from step to step.
//!
//! Lennard-Jones acts between nitrogens, Coulomb between all atoms of different molecules; both
//! end at a cutoff on the distance of the two atoms, with the force shifted to reach zero there.

use crate::single::scenes::ammonia::{BoxOfAmmonia, COULOMB, SITES};
use rapier3d_fields::rapier::prelude::{PhysicsWorld, RigidBodyHandle, Vector};

use super::model::{Grid, Interaction, step};

/// An atom at its present position.
#[derive(Clone, Copy)]
struct Atom {
    point: Vector,
    charge: f32,
    molecule: u32,
}

/// Computes the forces between the molecules of a [`BoxOfAmmonia`], and steps its world with them.
pub struct CellList {
    /// Force on each molecule, amu Å/ps².
    pub force: Vec<Vector>,
    /// Torque on each molecule about its centre of mass, world axes, amu Å²/ps².
    pub torque: Vec<Vector>,
    bodies: Vec<RigidBodyHandle>,
    interaction: Interaction,
    grid: Grid,
    centers: Vec<Vector>,
    atoms: Vec<Atom>,
    /// The atoms sorted by cell: their numbers, themselves, and the forces on them.
    order: Vec<u32>,
    sorted: Vec<Atom>,
    sorted_forces: Vec<Vector>,
}

impl CellList {
    /// Prepares for the molecules of `scene`, with `cutoff` in Å.
    pub fn new(scene: &BoxOfAmmonia, cutoff: f32) -> Self {
        let count = scene.molecules.len();
        let nowhere = Atom {
            point: Vector::ZERO,
            charge: 0.0,
            molecule: 0,
        };
        Self {
            force: vec![Vector::ZERO; count],
            torque: vec![Vector::ZERO; count],
            bodies: scene
                .molecules
                .iter()
                .map(|molecule| molecule.body)
                .collect(),
            interaction: Interaction::new(cutoff),
            grid: Grid::new(scene.half_extents, cutoff, 4 * count),
            centers: vec![Vector::ZERO; count],
            atoms: vec![nowhere; 4 * count],
            order: vec![0; 4 * count],
            sorted: vec![nowhere; 4 * count],
            sorted_forces: vec![Vector::ZERO; 4 * count],
        }
    }

    /// Advances `world` by one step, with the forces at its start and Rapier's contacts.
    pub fn step(&mut self, world: &mut PhysicsWorld) {
        self.forces(world);
        step(world, &self.bodies, &self.force, &self.torque);
    }

    /// Computes [`force`](Self::force) and [`torque`](Self::torque) for the poses in `world`.
    pub fn forces(&mut self, world: &PhysicsWorld) {
        self.place(world);
        let points = self.atoms.iter().map(|atom| atom.point);
        self.grid.sort(points, &mut self.order);
        for (sorted, number) in self.sorted.iter_mut().zip(&self.order) {
            *sorted = self.atoms[*number as usize];
        }
        self.sorted_forces.fill(Vector::ZERO);
        self.all_pairs();
        self.gather();
    }

    fn place(&mut self, world: &PhysicsWorld) {
        for (molecule, handle) in self.bodies.iter().enumerate() {
            let pose = world.bodies[*handle].position();
            self.centers[molecule] = pose.translation;
            for (k, site) in SITES.iter().enumerate() {
                let local_point = Vector::from_array(site.local_point.map(|x| x as f32));
                self.atoms[4 * molecule + k] = Atom {
                    point: pose.transform_point(local_point),
                    charge: site.charge as f32,
                    molecule: molecule as u32,
                };
            }
        }
    }

    fn all_pairs(&mut self) {
        let Self {
            interaction,
            grid,
            sorted,
            sorted_forces,
            ..
        } = self;
        for i in 0..sorted.len() {
            let atom = sorted[i];
            let mut on_atom = Vector::ZERO;
            for run in grid.later_neighbors(i, atom.point) {
                let others = sorted[run.clone()].iter();
                for (other, on_other) in others.zip(&mut sorted_forces[run]) {
                    let apart = atom.point - other.point;
                    let r2 = apart.length_squared();
                    if r2 < interaction.cutoff_squared && atom.molecule != other.molecule {
                        let force = apart * interaction.factor(&atom, other, r2);
                        on_atom += force;
                        *on_other -= force;
                    }
                }
            }
            sorted_forces[i] += on_atom;
        }
    }

    /// Turns the forces on atoms into force and torque on molecules.
    fn gather(&mut self) {
        self.force.fill(Vector::ZERO);
        self.torque.fill(Vector::ZERO);
        for (atom, force) in self.sorted.iter().zip(&self.sorted_forces) {
            let molecule = atom.molecule as usize;
            let arm = atom.point - self.centers[molecule];
            self.force[molecule] += *force;
            self.torque[molecule] += arm.cross(*force);
        }
    }
}

impl Interaction {
    /// The force between two atoms, divided by their distance.
    #[inline]
    fn factor(&self, a: &Atom, b: &Atom, r2: f32) -> f32 {
        let inverse_r = 1.0 / r2.sqrt();
        let inverse_r2 = inverse_r * inverse_r;
        let charges = COULOMB as f32 * a.charge * b.charge;
        let mut force = charges * (inverse_r2 - self.inverse_cutoff_squared);
        // Only nitrogen is negative, and only nitrogen has a Lennard-Jones term.
        if a.charge < 0.0 && b.charge < 0.0 {
            let inverse_r6 = inverse_r2 * inverse_r2 * inverse_r2;
            force +=
                (self.lj_a * inverse_r6 - self.lj_b) * inverse_r6 * inverse_r - self.lj_at_cutoff;
        }
        force * inverse_r
    }
}
