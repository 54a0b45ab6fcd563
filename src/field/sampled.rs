//! How fields and terms are sampled.

use super::formula::Formula;
use super::leaf::{Coupling, Field};
use super::sampling::{Cuts, Sampling, SamplingRule};

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
            cuts: Cuts::Never,
        }
    }

    /// Whether its force on a piece of a part that no border passes through is the same whatever the
    /// piece looks like: then bodies may be cut at borders.
    fn is_even(&self) -> bool {
        let shared = self.formula.is_uniform() && self.coupling == Coupling::Share;
        let displaced = matches!(self.formula, Formula::Buoyancy(_));
        let auto = self.sampling == Sampling::Auto && !self.reacts;
        auto && (shared || displaced) && self.scale_is_uniform()
    }

    /// Whether it ends somewhere: at the border of a region, or at the surface of a fluid.
    fn ends(&self) -> bool {
        !self.region.is_everywhere() || matches!(self.formula, Formula::Buoyancy(_))
    }
}

impl SamplingRule {
    /// That of a term made of fields; `at_centre`: whether it acts on a body as a whole.
    pub(super) fn of_term<'a>(
        fields: impl Iterator<Item = &'a Field>,
        at_centre: bool,
    ) -> SamplingRule {
        let mut reacts = false;
        let (mut ends, mut even, mut at_centres) = (false, at_centre, true);
        let fields = fields.inspect(|field| {
            reacts |= field.reacts;
            ends |= field.ends();
            even &= field.is_even();
            at_centres &= field.acts_at_centre();
        });
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
        finest.cuts = match (ends && even, at_centres) {
            (false, _) => Cuts::Never,
            (true, false) => Cuts::Parts,
            (true, true) => Cuts::Bodies,
        };
        finest
    }
}
