//! Rigid ammonia in its own field, as the reference data have it: Lennard-Jones between nitrogens
//! and Coulomb between all sites, without cutoff and without hard cores.

use crate::lab::scenes::ammonia::{LJ_EPSILON, LJ_SIGMA, Molecule, SITES, Site};
use rapier3d_fields::math::{Real, from_f64};
use rapier3d_fields::prelude::*;

/// The atoms of all molecules.
pub fn sites(molecules: &[Molecule]) -> impl Iterator<Item = (ColliderHandle, Site)> + '_ {
    let of_one = |molecule: &Molecule| molecule.sites.into_iter().zip(SITES);
    molecules.iter().flat_map(of_one)
}

/// The coordinate along the axis `lj`: Lennard-Jones acts between nitrogens only.
pub fn dispersion(site: &Site) -> Real {
    if site.name == "N" { 1.0 } else { 0.0 }
}

/// The fields of all atoms, with Coulomb's constant `coulomb`.
pub fn tree(molecules: &[Molecule], coulomb: f64) -> Tree {
    let fields = sites(molecules).flat_map(|(collider, site)| {
        let charge = Field::coulomb(from_f64(coulomb), from_f64(site.charge)).at(collider);
        let dispersion = (site.name == "N").then(|| {
            Field::lennard_jones(from_f64(LJ_EPSILON), from_f64(LJ_SIGMA))
                .coupled_to_axis("lj")
                .at(collider)
        });
        [Some(charge), dispersion].into_iter().flatten()
    });
    Tree::fold(Operator::SumUnion, fields)
}

/// The fields of a tree, with the charge of each atom and its coordinate along `lj`.
pub fn fields(molecules: &[Molecule], tree: Tree, colliders: &ColliderSet) -> Fields {
    let builder = Fields::builder(tree).axis("lj", 0.0);
    let mut fields = builder.build().expect("a valid tree");
    for (handle, site) in sites(molecules) {
        let properties = ColliderProperties::new()
            .charge(from_f64(site.charge))
            .axis("lj", dispersion(&site));
        let set = fields.set_properties(handle, properties, colliders);
        set.expect("a collider of the world");
    }
    fields
}
