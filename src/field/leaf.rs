//! A field: a leaf of the tree.

use std::sync::Arc;

use super::anchor::Anchor;
use super::axis::Axis;
use super::contact::ContactLaw;
use super::error::{TreeError, rigid};
use super::formula::{Closure, Formula, Profile, Radial};
use super::query::{LocalQuery, Sample};
use super::region::Region;
use crate::math::{Real, Vector};

/// A vector field: a [`Formula`] on a [`Region`], anchored to the world, a body or a collider.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// // A planet of gravitational parameter 40, felt within 30 length units of (0, -10, 0).
/// let planet = Field::point_gravity(40.0).within(Region::ball(30.0)).at(Vector::new(0.0, -10.0, 0.0));
/// // Wind of 5 N along x in a box.
/// let wind = Field::uniform(Vector::X * 5.0).within(Region::cuboid(Vector::splat(2.0)));
/// let tree = planet.sum_union(wind);
/// ```
#[derive(Clone, Debug)]
pub struct Field {
    pub(crate) name: Option<Arc<str>>,
    pub(crate) region: Region,
    pub(crate) formula: Formula,
    pub(crate) anchor: Anchor,
    pub(crate) reading: Reading,
    pub(crate) coupling: Coupling,
    /// A setter that does not fit the formula, for validation to report.
    pub(crate) misfit: Option<&'static str>,
}

/// How the vector of a field is to be read. Forces are what the algebra combines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Reading {
    /// A force (N).
    Force,
    /// An acceleration (m/s²): the force is the vector times the mass of the probe.
    Acceleration,
    /// A change of velocity (m/s), once per step: the force is mass · vector / dt.
    VelocityChange,
}

/// What the vector of a field is multiplied with, besides what its [`Reading`] asks for.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Coupling {
    /// Each probe takes its share of the body's mass of the vector: a body of four colliders in
    /// a uniform force of 1 N feels 1 N. The default.
    Share,
    /// Each probe takes the whole vector: for laws between sites, such as Lennard-Jones.
    Each,
    /// Each probe takes the vector times its own coordinate along an axis, such as
    /// [`Axis::Charge`] or one of the user's.
    Axis(Axis),
}

impl Coupling {
    /// Whether the number is measured in the field's own frame, and so differs from field to
    /// field at one probe.
    pub(crate) fn reads_frame(&self) -> bool {
        use Axis::{Speed, X, Y, Z};
        matches!(self, Coupling::Axis(X | Y | Z | Speed))
    }
}

impl Field {
    fn new(formula: Formula) -> Self {
        Field {
            name: None,
            region: Region::everywhere(),
            formula,
            anchor: Anchor::WORLD,
            reading: Reading::Force,
            coupling: Coupling::Share,
            misfit: None,
        }
    }

    /// The same vector everywhere, in the field's frame: a force, unless read otherwise.
    pub fn uniform(vector: Vector) -> Self {
        Self::new(Formula::Uniform(vector))
    }

    /// Along the line through the field's origin: `strength` · rᵖᵒʷᵉʳ, positive outward.
    pub fn radial(strength: Real, power: Real) -> Self {
        Self::from_profile(Profile::Power {
            strength,
            power,
            softening: 0.0,
        })
    }

    /// The gravity of a point mass, an acceleration of `mu`/r² towards the field's origin.
    ///
    /// `mu` = G M, in length³/time². Singular at the origin unless [softened](Self::softened).
    pub fn point_gravity(mu: Real) -> Self {
        Self::radial(-mu, -2.0).read_as(Reading::Acceleration)
    }

    /// The electric force of a point charge, `constant` · `charge` · (charge of the probe) / r².
    ///
    /// Coupled to [`Axis::Charge`]. `constant` is 1/4πε₀ in the units of the world
    /// (8.98755e9 N m²/C², or 138935.458 amu Å³ ps⁻² e⁻²).
    pub fn coulomb(constant: Real, charge: Real) -> Self {
        Self::radial(constant * charge, -2.0).coupled_to(Coupling::Axis(Axis::Charge))
    }

    /// The Lennard-Jones force of potential 4 ε ((σ/r)¹² − (σ/r)⁶), on [each](Coupling::Each)
    /// probe.
    pub fn lennard_jones(epsilon: Real, sigma: Real) -> Self {
        Self::from_profile(Profile::LennardJones { epsilon, sigma }).coupled_to(Coupling::Each)
    }

    /// A spring to the field's origin: −`stiffness` · d, for the distance vector d.
    pub fn spring(stiffness: Real) -> Self {
        Self::new(Formula::Spring {
            stiffness,
            damping: 0.0,
            rest_length: 0.0,
        })
    }

    /// A spring to the field's origin with a rest length, and damping of the velocity relative
    /// to the field's frame.
    pub fn spring_damper(stiffness: Real, damping: Real, rest_length: Real) -> Self {
        Self::new(Formula::Spring {
            stiffness,
            damping,
            rest_length,
        })
    }

    /// Drag −(`linear` + `quadratic` |v|) v, for the velocity v relative to the field's frame.
    pub fn drag(linear: Real, quadratic: Real) -> Self {
        Self::new(Formula::Drag { linear, quadratic })
    }

    /// The magnetic part of the Lorentz force, q v × B, coupled to [`Axis::Charge`].
    pub fn magnetic(b: Vector) -> Self {
        Self::new(Formula::Magnetic(b)).coupled_to(Coupling::Axis(Axis::Charge))
    }

    /// A function of the user's, from the sample in the field's frame to a vector in that frame.
    ///
    /// `reads` lists the axes it wants in [`Sample::axes`]; a function of the velocity names
    /// [`Axis::Speed`] among them. The function must depend on nothing but the sample.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let pulse = Field::closure([Axis::Time], |sample: &Sample| Vector::Y * sample.axes[0].sin());
    /// ```
    pub fn closure(
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> Vector + Send + Sync + 'static,
    ) -> Self {
        let closure = Closure::new(reads.into_iter().collect(), function);
        Self::new(Formula::Closure(Arc::new(closure)))
    }

    /// A detection field (§3.3): finds what touches the collider it is anchored to, and answers
    /// by a law.
    pub fn contact(law: ContactLaw) -> Self {
        Self::new(Formula::Contact(law))
    }

    fn from_profile(profile: Profile) -> Self {
        Self::new(Formula::Radial(Radial {
            profile,
            shifted_at: None,
        }))
    }

    /// Softens a radial power law: r² becomes r² + `length`² (Plummer). Other formulas have no
    /// softening: the tree is then refused.
    pub fn softened(mut self, length: Real) -> Self {
        if let Formula::Radial(Radial {
            profile: Profile::Power { softening, .. },
            ..
        }) = &mut self.formula
        {
            *softening = length;
        } else {
            self.misfit = Some("softened");
        }
        self
    }

    /// Ends a radial field at `cutoff`, its force shifted so that it reaches zero there; replaces
    /// the region by a ball of that radius. Formulas that are not radial are refused with the tree.
    pub fn shifted_to_zero_at(mut self, cutoff: Real) -> Self {
        if let Formula::Radial(radial) = &mut self.formula {
            radial.shifted_at = Some(cutoff);
            self.region = Region::ball(cutoff);
        } else {
            self.misfit = Some("shifted_to_zero_at");
        }
        self
    }

    /// Restricts the field to a region of its own frame.
    pub fn within(mut self, region: Region) -> Self {
        self.region = region;
        self
    }

    /// Anchors the field to a body, a collider, or a pose in the world.
    pub fn at(mut self, anchor: impl Into<Anchor>) -> Self {
        self.anchor = anchor.into();
        self
    }

    /// Names the field, for messages.
    pub fn named(mut self, name: &str) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Sets how the vector is read.
    pub fn read_as(mut self, reading: Reading) -> Self {
        self.reading = reading;
        self
    }

    /// Sets what the vector is multiplied with.
    pub fn coupled_to(mut self, coupling: Coupling) -> Self {
        self.coupling = coupling;
        self
    }

    /// Couples the field to the charge, or to another axis.
    pub fn coupled_to_axis(self, axis: impl Into<Axis>) -> Self {
        self.coupled_to(Coupling::Axis(axis.into()))
    }

    /// The number that turns the formula's vector into a force on the probe.
    pub(crate) fn weight(&self, local: &LocalQuery<'_>) -> f64 {
        let query = local.query;
        let coupled = match &self.coupling {
            Coupling::Axis(axis) => Some(local.axis(axis).unwrap_or(f64::NAN)),
            _ => None,
        };
        match (self.reading, &self.coupling) {
            (Reading::Force, Coupling::Share) => query.share,
            (Reading::Force, _) => coupled.unwrap_or(1.0),
            (Reading::Acceleration, _) => query.mass * coupled.unwrap_or(1.0),
            (Reading::VelocityChange, _) => query.mass / query.dt * coupled.unwrap_or(1.0),
        }
    }

    /// Whether two fields differ in name and anchor at most.
    pub(crate) fn is_like(&self, other: &Field) -> bool {
        self.formula == other.formula
            && self.region == other.region
            && self.reading == other.reading
            && self.coupling == other.coupling
    }

    /// Whether the field acts on a body as a whole, at its centre of mass: a uniform vector that
    /// is not coupled to what differs between its parts.
    pub(crate) fn acts_at_centre(&self) -> bool {
        self.formula.is_uniform() && self.coupling == Coupling::Share
    }

    pub(crate) fn reads_velocity(&self) -> bool {
        self.formula.reads_velocity() || self.axes().any(|axis| *axis == Axis::Speed)
    }

    pub(crate) fn is_contact(&self) -> bool {
        matches!(self.formula, Formula::Contact(_))
    }

    /// The axes the field names.
    pub(crate) fn axes(&self) -> impl Iterator<Item = &Axis> {
        let coupling = match &self.coupling {
            Coupling::Axis(axis) => Some(axis),
            _ => None,
        };
        let formula = self.formula.axes().iter();
        formula.chain(self.region.axes()).chain(coupling)
    }

    /// How messages name the field.
    pub(crate) fn label(&self, place: usize) -> String {
        match &self.name {
            Some(name) => format!("field `{name}`"),
            None => format!("field #{place} ({})", self.formula.kind()),
        }
    }

    pub(crate) fn validate(&self, label: &str) -> Result<(), TreeError> {
        rigid(label, "the pose of the anchor", self.anchor.local_pose())?;
        if self.is_contact() && !matches!(self.anchor, Anchor::Collider { .. }) {
            let field = label.to_owned();
            return Err(TreeError::DetectionAnchor { field });
        }
        if let Some(setter) = self.misfit {
            return Err(TreeError::Misfit {
                field: label.to_owned(),
                setter,
                formula: self.formula.kind(),
            });
        }
        self.region.validate(label)?;
        self.formula.validate(label)
    }
}
