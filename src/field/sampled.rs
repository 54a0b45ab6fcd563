//! The sampling rules of fields and terms.

use super::formula::Formula;
use super::leaf::{Coupling, Field};
use super::sampling::{Cuts, Sampling, SamplingRule};
use super::scalar::Scalar;

impl Field {
    /// Sets the points of bodies at which the field is sampled. A term of the tree (an operand of the outermost sum of
    /// union) has the finest sampling of its fields: the last in the order of [`Sampling`]'s variants.
    pub fn sampled(mut self, sampling: Sampling) -> Self {
        self.sampling = sampling;
        self
    }

    /// Returns true if the field acts on a body as a whole, at its centre of mass: a uniform vector that is
    /// distributed by mass, and depends on nothing that may differ between the colliders.
    pub(crate) fn acts_at_centre(&self) -> bool {
        self.is_shared_out() && !self.reads_parts() && self.scale_is_uniform()
    }

    /// Returns true if it is a uniform vector that is distributed by mass.
    fn is_shared_out(&self) -> bool {
        self.formula.is_uniform() && self.coupling == Coupling::Share
    }

    /// Returns true if it may differ between the colliders of a body at one place, so that no single sample
    /// stands for all of them.
    fn reads_parts(&self) -> bool {
        self.groups.is_some()
            || self.coupling != Coupling::Share
            || self.region.reads_parts()
            || self.formula.reads_parts()
            || self.scale.as_ref().is_some_and(Scalar::reads_parts)
    }

    /// The sampling rule of the field by itself.
    fn sampling_rule(&self) -> SamplingRule {
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
            apart: self.reads_parts(),
            linear: self.is_linear(),
        }
    }

    /// Returns true if its force is linear in place and velocity, and acts everywhere.
    fn is_linear(&self) -> bool {
        let everywhere = self.region.is_everywhere() && self.limit.is_none();
        // Multiplied by a coordinate it would be of the second power.
        let even = self.scale_is_uniform() && !self.coupling.reads_frame();
        everywhere && even && self.formula.is_linear()
    }

    /// Returns true if its force on a piece that no border passes through does not depend on the shape of the piece.
    /// Bodies may then be cut at borders.
    fn is_even(&self) -> bool {
        let displaced = matches!(self.formula, Formula::Buoyancy(_));
        let auto = self.sampling == Sampling::Auto && !self.reacts;
        auto && (self.is_shared_out() || displaced) && self.scale_is_uniform()
    }

    /// Returns true if it ends somewhere: at the border of a region, or at the surface of a fluid.
    fn ends(&self) -> bool {
        !self.region.is_everywhere() || matches!(self.formula, Formula::Buoyancy(_))
    }
}

impl SamplingRule {
    /// The rule of a term made of fields, and of scales over several of them.
    pub(super) fn of_term<'a>(
        fields: impl Iterator<Item = &'a Field>,
        scales: impl Iterator<Item = &'a Scalar>,
    ) -> SamplingRule {
        let (mut at_centre, mut reads_parts) = (true, false);
        for scale in scales {
            at_centre &= scale.is_uniform();
            reads_parts |= scale.reads_parts();
        }
        let mut reacts = false;
        let (mut ends, mut even) = (false, at_centre);
        let (mut at_centres, mut shared_out) = (true, true);
        let fields = fields.inspect(|field| {
            reacts |= field.reacts;
            ends |= field.ends();
            even &= field.is_even();
            at_centres &= field.acts_at_centre();
            shared_out &= field.is_shared_out();
        });
        let finest = fields.map(Field::sampling_rule).reduce(SamplingRule::finer);
        let mut finest = finest.unwrap_or(SamplingRule::CENTRE);
        finest.apart |= reads_parts;
        if reacts {
            finest.overridable = false;
        }
        // A scale over several fields may vary even if these do not.
        if finest.sampling == Sampling::Centre && finest.auto && !at_centre {
            return SamplingRule {
                sampling: Sampling::Volume,
                ..finest
            };
        }
        finest.cuts = match (ends && even, at_centres, shared_out) {
            (false, ..) => Cuts::Never,
            (true, true, _) => Cuts::Bodies,
            (true, false, true) => Cuts::Shares,
            (true, false, false) => Cuts::Parts,
        };
        if finest.cuts == Cuts::Shares {
            // A uniform vector is the same at all points of a part, so one sample is enough.
            finest.sampling = Sampling::Parts;
        }
        finest
    }
}
