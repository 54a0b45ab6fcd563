//! The fields of a box of ammonia: two per atom (paper §4), and one per wall.

use super::fields;
use fields::math::{ColliderHandle, ColliderSet, Real, from_f64};
use fields::{
    ColliderProperties, ContactLaw, Field, Fields, FieldsBuilder, Operator, PropertyError, Tree,
};

use super::{BoxOfAmmonia, COULOMB, LJ_EPSILON, LJ_SIGMA, Molecule, SITES};

/// The axis of the Lennard-Jones forces: 1 for nitrogen, 0 for hydrogen.
pub const DISPERSION: &str = "dispersion";

/// The interaction of molecules, given the colliders of each in the order of [`SITES`]: a Lennard-Jones field on each
/// nitrogen, and on each atom the electric field of its charge.
///
/// A cutoff (Å) limits the range of both, and shifts their forces to reach zero there. The atoms need the properties of
/// [`set_probes`], and the fields the axis [`DISPERSION`].
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
    /// The whole tree: the [`interaction`] and, at each atom and each wall, a contact field with `law`.
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

/// Sets the charges and masses of the atoms, and their values on the axis [`DISPERSION`].
///
/// # Errors
/// The collider of an atom does not exist, or the axis [`DISPERSION`] was not declared.
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
