//! How fields and terms are sampled.

use super::formula::Formula;
use super::leaf::{Coupling, Field};
use super::sampling::{Sampling, SamplingRule};

impl Field {
    /// Sets where on bodies the field is sampled. A term of the tree (an operand of the outermost
    /// sum of union) is sampled as its field of the finest sampling asks for, in the order of
    /// [`Sampling`]'s variants.
    pub fn sampled(mut self, sampling: Sampling) -> Self {
        self.sampling = sampling;
        self
    }

    /// How the field by itself is sampled.
    fn how(&self) -> SamplingRule {
        let of_sites = self.coupling != Coupling::Share && !self.formula.reads_volume();
        let auto = self.sampling == Sampling::Auto;
        let sampling = match (&self.formula, self.sampling) {
            (_, asked) if !auto => asked,
            (Formula::Contact(_), _) => Sampling::Parts,
            _ if self.acts_at_centre() => Sampling::Centre,
            _ if of_sites => Sampling::Parts,
            (Formula::Drag(_) | Formula::Wind(_), _) => Sampling::Surface,
            _ => Sampling::Volume,
        };
        SamplingRule {
            sampling,
            auto,
            overridable: auto && !of_sites && !self.is_contact(),
        }
    }
}

impl SamplingRule {
    /// That of a term made of fields; `at_centre`: whether it acts on a body as a whole.
    pub(super) fn of_term<'a>(
        fields: impl Iterator<Item = &'a Field>,
        at_centre: bool,
    ) -> SamplingRule {
        let mut reacts = false;
        let fields = fields.inspect(|field| reacts |= field.reacts);
        let finest = fields.map(Field::how).reduce(SamplingRule::finer);
        let mut finest = finest.unwrap_or(SamplingRule::CENTRE);
        if reacts {
            // Reactions are kept sample by sample, which cells have not.
            finest.overridable = false;
            if finest.sampling.tolerance().is_some() {
                finest.sampling = Sampling::Volume;
            }
        }
        // A scale over several fields may vary where they do not.
        if finest.sampling == Sampling::Centre && finest.auto && !at_centre {
            return SamplingRule {
                sampling: Sampling::Volume,
                ..finest
            };
        }
        finest
    }
}
