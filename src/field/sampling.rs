//! The points of a body at which fields are sampled.

/// The points of a body at which fields are sampled. They decide how well a field's variation over the body is
/// resolved.
///
/// Every sample stands for a fraction of its part (its collider), with which its force is
/// weighted: a constant force on a body does not depend on the number of samples.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let zone = Region::cuboid(Vector::splat(3.0));
/// let wind = Field::uniform(Vector::X).within(zone).sampled(Sampling::Volume);
/// # let _ = wind;
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Sampling {
    /// Chosen by the kind of field:
    ///
    /// - [`Centre`](Self::Centre) for a uniform vector that is distributed by mass. Where the border of its
    ///   region passes through a body, the body is cut there, and gets the force and the torque
    ///   on the share of it that is inside;
    /// - one sample of each part for buoyancy, and for uniform vectors in a region that act on some
    ///   collision groups only, or whose region has a predicate or reads properties of colliders (charge,
    ///   mass, radius, an axis of the user's). A part is cut at the border of the region, and at the surface
    ///   of the fluid;
    /// - [`Parts`](Self::Parts) for fields coupled to [each](crate::Coupling::Each) part or to an
    ///   [axis](crate::Coupling::Axis): laws between sites, such as Lennard-Jones and Coulomb;
    /// - [`Surface`](Self::Surface) for drag and wind;
    /// - [`Volume`](Self::Volume) for everything else.
    ///
    /// Ball colliders are sampled once, at their centre, in place of volume and surface: for an
    /// inverse-square pull from outside this is exact. They are cut like any other shape.
    ///
    /// Flat borders cut exactly: half-spaces, boxes, slabs, the ends of cylinders and cones, the surface of a
    /// fluid. Cuboids, convex polyhedra, closed meshes and compounds of them are exact up to rounding, and so is
    /// a ball that one plane or one ball region passes through. Other round shapes are cut as meshes of 24
    /// facets with their volume and second moments: their share is within 0.1 %. At a curved border bodies are
    /// halved until it bends little in each piece: the share is within 1 % of the body. At the border of a
    /// region of a [Parry shape](crate::Region::shape) it is within 2 %. Regions over other axes than x, y and
    /// z, and predicates, are evaluated at the centre of each piece, and cut nothing.
    ///
    /// A term is cut if all of its fields are of these kinds, none of them [reacts](crate::Field::reacting),
    /// and no scale varies over a body. A body with a sampling of its own is not cut.
    #[default]
    Auto,
    /// At the centre of mass of the body: no torque, and all or nothing at a border.
    ///
    /// If the force may differ between colliders, since the field has [groups](crate::Field::groups), is
    /// [coupled](crate::Coupling) to anything but the share of the mass, or reads the charge, the mass, the
    /// radius or an axis of the user's, each collider is sampled there by itself, with its own properties.
    /// Functions of the user's are assumed to read all of these.
    Centre,
    /// Once per collider, in its middle.
    Parts,
    /// At 27 or more points in each collider (a cuboid that is not long has 27, and a thin, slanted shape
    /// may have eight). Mass, centre and second moments are those of the shape, filled uniformly, so forces
    /// are exact up to the second power of the coordinates, and torques up to the first; for shapes that are
    /// symmetric about their centre, one power more. Forces that are linear in position and velocity, and act
    /// everywhere, are evaluated at four points that have the same moments.
    Volume,
    /// At points of each collider's surface, by area: a cuboid at 2 × 2 Gauss points of each
    /// face (exact up to the third power), a ball at six points (third power), other shapes at
    /// patches of a triangle mesh (second power, but for the facets of the mesh). Linear forces are evaluated
    /// at four points, as for the volume.
    Surface,
}

/// The way in which a term cuts bodies where a border passes through them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum Cuts {
    #[default]
    Never,
    /// A body that no border passes through is sampled at its centre of mass.
    Bodies,
    /// A part that no border passes through is sampled at its centre, shifted so that all parts together are at
    /// the centre of mass.
    Shares,
    /// A part that no border passes through is sampled at its centre.
    Parts,
}

/// The rule by which a term of the tree is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct SamplingRule {
    /// Never [`Sampling::Auto`].
    pub sampling: Sampling,
    /// True if the user has set no sampling. Balls are then sampled once.
    pub auto: bool,
    /// True if the sampling of a body, where it is set, replaces this one.
    pub overridable: bool,
    /// The way in which bodies with shapes, and without a sampling of their own, are cut at borders.
    pub cuts: Cuts,
    /// True if forces may differ between colliders at one place: at the centre of mass each is sampled by itself.
    pub apart: bool,
    /// True if forces are linear in position and velocity, so that few points give the same sums as many.
    pub linear: bool,
}

/// The points at which a part is sampled, for rules with several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Points {
    Volume,
    Surface,
    /// Four points with the mass, centre and second moments of the others: forces that are linear in position
    /// and velocity have the same sum, and so have their torques.
    FewOfVolume,
    FewOfSurface,
}

impl Points {
    pub(crate) const ALL: [Points; 4] = [
        Points::Volume,
        Points::Surface,
        Points::FewOfVolume,
        Points::FewOfSurface,
    ];
}

impl SamplingRule {
    /// The points at which it samples parts, if there are several.
    pub(crate) fn points(self) -> Option<Points> {
        match (self.sampling, self.linear) {
            (Sampling::Volume, false) => Some(Points::Volume),
            (Sampling::Volume, true) => Some(Points::FewOfVolume),
            (Sampling::Surface, false) => Some(Points::Surface),
            (Sampling::Surface, true) => Some(Points::FewOfSurface),
            (Sampling::Auto | Sampling::Centre | Sampling::Parts, _) => None,
        }
    }

    /// The rule of a body with a sampling of its own.
    pub(crate) fn own(sampling: Sampling) -> SamplingRule {
        SamplingRule {
            sampling,
            auto: false,
            overridable: false,
            cuts: Cuts::Never,
            apart: true,
            linear: false,
        }
    }

    /// The rule of a term without fields.
    pub(super) const CENTRE: SamplingRule = SamplingRule {
        sampling: Sampling::Centre,
        auto: true,
        overridable: true,
        cuts: Cuts::Never,
        apart: false,
        linear: false,
    };

    /// The finer of two rules, in the order of [`Sampling`]'s variants.
    pub(super) fn finer(self, other: SamplingRule) -> SamplingRule {
        let (a, b) = (self.sampling, other.sampling);
        let overridable = self.overridable && other.overridable;
        let apart = self.apart || other.apart;
        let linear = self.linear && other.linear;
        let finest = match (a as u8).cmp(&(b as u8)) {
            std::cmp::Ordering::Less => other,
            std::cmp::Ordering::Greater => self,
            std::cmp::Ordering::Equal => SamplingRule {
                auto: self.auto && other.auto,
                ..self
            },
        };
        SamplingRule {
            overridable,
            apart,
            linear,
            ..finest
        }
    }
}
