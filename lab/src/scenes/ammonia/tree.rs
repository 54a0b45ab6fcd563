//! The fields of a box of ammonia: two per atom (paper §4), and one per wall.

use super::fields;
use fields::math::{ColliderHandle, ColliderSet, Real, from_f64};
use fields::{
    ColliderProperties, ContactLaw, Field, Fields, FieldsBuilder, Operator, PropertyError, Tree,
};

use super::{BoxOfAmmonia, COULOMB, LJ_EPSILON, LJ_SIGMA, Molecule, SITES};

/// The axis on which nitrogen is 1, and feels Lennard-Jones, and hydrogen 0.
pub const DISPERSION: &str = "dispersion";

/// The interaction of molecules, given the colliders of each in the order of [`SITES`]: on each nitrogen a Lennard-Jones field, and on each atom the
/// electric field of its charge.
///
/// With a cutoff (Å) both end there, their force shifted to reach zero; without, they reach
/// everywhere. Samples need [`set_probes`], and the fields the axis [`DISPERSION`].
pub fn interaction(
    molecules: impl IntoIterator<Item = [ColliderHandle; 4]>,
    cutoff: Option<Real>,
) -> Tree {
    let ended = |field: Field| match cutoff {
        Some(cutoff) => field.shifted_to_zero_at(cutoff),
        None => field,
    };
    let fields = molecules.into_iter().flat_map(|atoms| {
        let electric = SITES.iter().zip(atoms).map(|(site, collider)| {
            let field = Field::coulomb(from_f64(COULOMB), from_f64(site.charge));
            field
                .at(collider)
                .named(&format!("charge of {}", site.name))
        });
        let nitrogen = Field::lennard_jones(from_f64(LJ_EPSILON), from_f64(LJ_SIGMA))
            .coupled_to_axis(DISPERSION)
            .at(atoms[0])
            .named("Lennard-Jones of N");
        electric.chain([nitrogen]).map(ended)
    });
    Tree::fold(Operator::SumUnion, fields)
}

impl BoxOfAmmonia {
    /// The whole tree: the [`interaction`] and, around each atom and at each wall, a detection
    /// field that answers by `law`.
    pub fn tree(&self, cutoff: Option<Real>, law: ContactLaw) -> Tree {
        let atoms = self.molecules.iter().flat_map(|molecule| molecule.sites);
        let touch = atoms
            .chain(self.walls)
            .map(|part| Field::contact(law).at(part));
        interaction(self.molecules.iter().map(|it| it.sites), cutoff)
            .sum_union(Tree::fold(Operator::SumUnion, touch))
    }

    /// Builds the fields of the box, and sets the properties of its atoms.
    ///
    /// # Errors
    /// The tree does not fit the settings.
    pub fn fields(
        &self,
        builder: FieldsBuilder,
    ) -> Result<Fields, Box<dyn std::error::Error + Send + Sync>> {
        let mut fields = builder.axis(DISPERSION, 0.0).build()?;
        set_probes(&mut fields, &self.molecules, &self.world.colliders)?;
        Ok(fields)
    }
}

/// Tells the fields the charges and masses of the atoms, and which are nitrogen.
///
/// # Errors
/// An atom is not there, or the axis [`DISPERSION`] was not declared.
pub fn set_probes(
    fields: &mut Fields,
    molecules: &[Molecule],
    colliders: &ColliderSet,
) -> Result<(), PropertyError> {
    for molecule in molecules {
        for (number, (site, collider)) in SITES.iter().zip(molecule.sites).enumerate() {
            let dispersion = if number == 0 { 1.0 } else { 0.0 };
            let properties = ColliderProperties::new()
                .charge(from_f64(site.charge))
                .mass(from_f64(site.mass))
                .axis(DISPERSION, dispersion);
            fields.set_properties(collider, properties, colliders)?;
        }
    }
    Ok(())
}
