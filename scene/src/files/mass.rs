//! Masses and inertias.

use serde::{Deserialize, Serialize};

use super::error::FileError;
use super::fields::math::{Real, Vector};
use super::fields::rapier::dynamics::MassProperties;
use super::number::{
    Num, Quad, Triple, bounded, not_negative, placed, quad, triple, unless_zero, vector,
};

/// A mass, its centre, and its principal moments of inertia.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) struct MassDoc {
    mass: Num,
    /// The centre of mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    centre: Option<Triple>,
    /// About the principal axes through the centre of mass; zero for an axis about which the body cannot rotate.
    inertia: Triple,
    /// The rotation of the principal axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    axes: Option<Quad>,
}

impl MassDoc {
    pub(super) fn read(&self) -> Result<MassProperties, FileError> {
        let mass = not_negative("mass", self.mass)?;
        for inertia in self.inertia {
            not_negative("inertia", inertia)?;
        }
        let centre = bounded("centre", self.centre)?;
        let axes = placed(None, self.axes)?.rotation;
        let inertia = vector(self.inertia);
        Ok(MassProperties::with_principal_inertia_frame(
            centre, mass, inertia, axes,
        ))
    }

    pub(super) fn write(properties: &MassProperties) -> Self {
        let inertia = properties.inv_principal_inertia.to_array();
        let [x, y, z] = inertia.map(inverted);
        MassDoc {
            mass: Num(inverted(properties.inv_mass)),
            centre: unless_zero(properties.local_com),
            inertia: triple(Vector::new(x, y, z)),
            axes: quad(properties.principal_inertia_local_frame),
        }
    }
}

/// The number of fewest digits whose inverse is `inverse` to the last bit. Rapier stores inverses, and
/// the inverse of an inverse may be off by one rounding.
fn inverted(inverse: Real) -> Real {
    if inverse == 0.0 {
        return 0.0;
    }
    let near = inverse.recip();
    let candidates = [near, near.next_up(), near.next_down()];
    let fits = candidates.into_iter().filter(|x| x.recip() == inverse);
    let digits = |x: &Real| format!("{x:e}").len();
    fits.min_by_key(digits).unwrap_or(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverses_are_restored_to_the_last_bit() {
        let mut x: Real = 1e-3;
        while x < 1e6 {
            let back = inverted(x.recip());
            assert_eq!(back.recip(), x.recip(), "{x}");
            x *= 1.003;
        }
        assert_eq!(inverted((17.0307 as Real).recip()), 17.0307);
        assert_eq!(inverted(0.0), 0.0);
    }
}
