//! Molecules of ammonia that act on each other, as a liquid and as a gas.

use std::path::Path;

use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::rivals::cell_list::CellList;
use rapier3d_fields_lab::single::rivals::lammps;
use rapier3d_fields_lab::single::rivals::vectorised::Vectorised;
use rapier3d_fields_lab::single::scenes::ammonia::{AmmoniaSettings, BoxOfAmmonia, interaction};

use super::paired::{Variant, stepped, variant};

const CUTOFF: Real = 10.0;

/// A box of molecules: their number, and the distance between neighbours.
#[derive(Clone, Copy)]
pub struct Density {
    pub name: &'static str,
    pub count: usize,
    pub spacing: Real,
}

pub const BOXES: [Density; 5] = [
    boxed("liquid, 1,000 molecules", 1_000, LIQUID),
    boxed("liquid, 10,000 molecules", 10_000, LIQUID),
    boxed("gas, 1,000 molecules", 1_000, GAS),
    boxed("gas, 10,000 molecules", 10_000, GAS),
    boxed("gas, 100,000 molecules", 100_000, GAS),
];

/// The distance between neighbours in Å.
const LIQUID: Real = 3.6;
const GAS: Real = 20.0;

const fn boxed(name: &'static str, count: usize, spacing: Real) -> Density {
    Density {
        name,
        count,
        spacing,
    }
}

impl Density {
    fn build(self) -> BoxOfAmmonia {
        let settings = AmmoniaSettings {
            count: self.count,
            spacing: self.spacing,
            ..AmmoniaSettings::default()
        };
        settings.build().expect("the settings are in range")
    }

    /// Rapier with its own contacts, loops written for these molecules, fields that leave contacts to
    /// Rapier, and fields that find and answer them.
    pub fn variants(self) -> Vec<Variant> {
        let (mut plain, mut listed, mut wide) = (self.build(), self.build(), self.build());
        let mut loops = CellList::new(&listed, CUTOFF);
        let mut vectors = Vectorised::new(&wide, CUTOFF);
        let fields = |name, scheme| {
            let scene = self.build();
            stepped(name, fields_of(&scene, scheme), scene.world)
        };
        let detecting = |name, scheme| {
            let scene = self.build();
            let tree = scene.tree(Some(CUTOFF), ContactLaw::elastic());
            let fields = scene.fields(Fields::builder(tree).scheme(scheme));
            stepped(name, fields.expect("the tree fits the scene"), scene.world)
        };
        vec![
            variant("Rapier alone", move || plain.world.step()),
            variant("cell list by hand", move || loops.step(&mut listed.world)),
            variant("SIMD for ammonia by hand", move || {
                vectors.step(&mut wide.world);
            }),
            fields("field, kick", Scheme::Kick),
            fields("field, kick-drift-kick", Scheme::KickDriftKick),
            // In fields that vary in space, a plain kick may not answer contacts: it does not keep the energy of a hit.
            detecting("with detection, kick-drift-kick", Scheme::KickDriftKick),
        ]
    }
}

fn fields_of(scene: &BoxOfAmmonia, scheme: Scheme) -> Fields {
    let tree = interaction(scene.molecules.iter().map(|it| it.sites), Some(CUTOFF));
    let builder = Fields::builder(tree).scheme(scheme);
    scene.fields(builder).expect("the tree fits the scene")
}

/// Writes the boxes for another program, one file each: see `lammps.sh`.
pub fn write_states(folder: &Path) {
    for density in BOXES {
        let scene = density.build();
        let name = density.name.replace(' ', "_");
        let file = folder.join(name).with_extension("data");
        let fields = fields_of(&scene, Scheme::Kick);
        lammps::write(&scene, &fields, &file).expect("a folder that can be written to");
    }
}
