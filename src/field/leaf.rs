//! A field, which is a leaf of a tree: a formula on a region, with an anchor and settings.

use std::sync::Arc;

use super::anchor::{Anchor, Frame};
use super::any_shape::AnyShape;
use super::axis::Axis;
use super::error::{BuildError, finite, not_negative, rigid};
use super::formula::{Drag, Formula, Nearest, Profile, Radial, Uniform, Wind};
use super::lifetime::{Lifetime, Span};
use super::query::{LocalQuery, Query, QueryNumber, QueryProperties, Single};
use super::region::Region;
use super::sampling::Sampling;
use super::scalar::Scalar;
use crate::math::{InteractionGroups, Pose, Real, SharedShape, to_f64};
use crate::number::{Number, Vec3, limited, rotate};

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
///
/// The methods are in these groups:
///
/// | group | methods |
/// |---|---|
/// | a field of a formula | [`uniform`](Self::uniform), [`point_gravity`](Self::point_gravity), [`spring`](Self::spring), [`drag`](Self::drag), [`wind`](Self::wind), … |
/// | a field for games | [`gravity_zone`](Self::gravity_zone), [`wind_zone`](Self::wind_zone), [`conveyor`](Self::conveyor), [`magnet`](Self::magnet), [`explosion`](Self::explosion) |
/// | settings of the formula | [`softened`](Self::softened), [`around`](Self::around), [`limited_to`](Self::limited_to), [`scaled_by`](Self::scaled_by), [`as_wind`](Self::as_wind), … |
/// | where and on which bodies | [`within`](Self::within), [`outside`](Self::outside), [`at`](Self::at), [`groups`](Self::groups), [`reacting`](Self::reacting) |
/// | name, strength and time | [`named`](Self::named), [`strength`](Self::strength), [`enabled`](Self::enabled), [`lifetime`](Self::lifetime) |
/// | meaning and sampling | [`force_mode`](Self::force_mode), [`coupled_to`](Self::coupled_to), [`sampled`](Self::sampled) |
/// | operators | [`sum_union`](Self::sum_union), [`replace_union`](Self::replace_union), and the others of [`Operator`](crate::Operator) |
#[derive(Clone, Debug)]
#[must_use = "setters and operators take the value and return the changed one"]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
pub struct Field {
    pub(crate) name: Option<Arc<str>>,
    /// The factor of the vector, before any limit: 1 by default.
    pub strength: Real,
    /// True if the field is on. A field that is off is defined nowhere.
    pub enabled: bool,
    /// The time at which it acts: always, by default.
    pub lifetime: Lifetime,
    /// The region where it is defined, in its own frame.
    pub region: Region,
    /// Its vector, in its own frame.
    pub formula: Formula,
    /// The frame that it moves with.
    pub anchor: Anchor,
    pub(crate) mode: ForceMode,
    pub(crate) coupling: Coupling,
    pub(crate) scale: Option<Scalar>,
    /// Bound of the vector's length, after scaling.
    pub(crate) limit: Option<Real>,
    /// The groups of the field; without any it acts on all colliders.
    pub(crate) groups: Option<InteractionGroups>,
    pub(crate) reacts: bool,
    pub(crate) sampling: Sampling,
    /// A setter that does not fit the formula, which validation reports.
    #[cfg_attr(feature = "serde-serialize", serde(with = "super::saved::misfit"))]
    pub(crate) misfit: Option<Setter>,
}

/// The quantity that the vector of a field stands for. The algebra combines forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum ForceMode {
    /// A force (N).
    Force,
    /// An acceleration (m/s²): the force is the vector times the mass of the sample.
    Acceleration,
    /// A change of velocity (m/s), once per step: the force is mass · vector / dt.
    VelocityChange,
}

/// The factor of a field's vector at each sample, besides the one of its [`ForceMode`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Coupling {
    /// Each sample takes the vector times its share of the body's mass: a uniform force of 1 N on a
    /// body of four colliders adds up to 1 N. The default.
    Share,
    /// Each sample takes the whole vector: for laws between sites, such as Lennard-Jones.
    Each,
    /// Each sample takes the vector times its own coordinate along an axis, such as
    /// [`Axis::Charge`] or one of the user's.
    Axis(Axis),
}

impl Coupling {
    /// Returns true if the factor is measured in the field's own frame, and so differs from field to field at
    /// one sample.
    pub(crate) fn reads_frame(&self) -> bool {
        matches!(self, Coupling::Axis(axis) if axis.reads_frame())
    }
}

/// The name of a setter. The alias keeps serde from borrowing it from its input.
type Setter = &'static str;

impl Field {
    pub(super) fn new(formula: Formula) -> Self {
        Field {
            name: None,
            strength: 1.0,
            enabled: true,
            lifetime: Lifetime::ALWAYS,
            region: Region::everywhere(),
            formula,
            anchor: Anchor::WORLD,
            mode: ForceMode::Force,
            coupling: Coupling::Share,
            scale: None,
            limit: None,
            groups: None,
            reacts: false,
            sampling: Sampling::Auto,
            misfit: None,
        }
    }
}

/// Settings of the formula. One that the formula does not have is an error when the tree is built, which names both.
impl Field {
    /// Softens a radial power law: r² becomes r² + `length`² (Plummer). Other formulas are refused with the tree.
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

    /// Smooths a vortex or spin within a core of this radius around its axis.
    pub fn smoothed(mut self, radius: Real) -> Self {
        match &mut self.formula {
            Formula::Swirl(swirl) => swirl.core = radius,
            _ => self.misfit = Some("smoothed"),
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

    /// Measures the distance of a radial field from the nearest point of a shape, which stands in
    /// the field's frame: the pull of a ring, a wall, a planet that is a cube. Fields that are not
    /// radial are refused with the tree.
    pub fn around(mut self, shape: SharedShape) -> Self {
        if let Formula::Radial(radial) = self.formula {
            let shape = AnyShape(shape);
            self.formula = Formula::Nearest(Nearest { shape, radial });
        } else {
            self.misfit = Some("around");
        }
        self
    }

    /// Makes a radial force nearer than `distance` as strong as at `distance`, which removes its singularity.
    pub fn no_nearer_than(mut self, distance: Real) -> Self {
        match &mut self.formula {
            Formula::Radial(radial) | Formula::Nearest(Nearest { radial, .. }) => {
                radial.nearest = Some(distance);
            }
            _ => self.misfit = Some("no_nearer_than"),
        }
        self
    }

    /// Evaluates many distant sources of a power law together, such as 100,000 bodies that attract each other, without
    /// a cutoff, at a cost of n log n (Barnes & Hut, Nature 324, 1986).
    ///
    /// Sources are divided into cells within cells. A cell acts by its moments, up to the second, if each of
    /// its sources is nearer to its centre than `angle` times the distance of the centre; others are opened. A
    /// smaller angle costs more and errs less: a table is in `docs/design/measurements.md`. The errors are neither
    /// equal and opposite for a pair nor bounded for each body, so momentum is conserved only as accurately as the
    /// forces are.
    ///
    /// It has an effect for 512 or more fields that differ in strength and place only, are summed with
    /// everything else, and act everywhere; in composites and regions each is evaluated by itself.
    /// [`Fields::explain`](crate::Fields::explain) is exact. Derivatives, for schemes that need them, treat a distant
    /// cell as a point. Laws that are not powers, are bounded or are cut off are refused with the tree, as are angles
    /// above 1.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let mut world = PhysicsWorld::new();
    /// let star = |k: i32| Vector::new((k % 29) as Real, (k % 31) as Real, (k % 37) as Real);
    /// let stars: Vec<_> = (0..1000)
    ///     .map(|k| world.insert_body(RigidBodyBuilder::dynamic().translation(star(k))))
    ///     .collect();
    /// let pull = |star| Field::point_gravity(1e-3).softened(0.1).opening_angle(0.5).at(star);
    /// let fields = Fields::new(Tree::fold(Operator::SumUnion, stars.into_iter().map(pull)))?;
    /// assert!(fields.plan().to_string().contains("cells within cells"));
    /// # Ok::<(), BuildError>(())
    /// ```
    pub fn opening_angle(mut self, angle: Real) -> Self {
        match &mut self.formula {
            Formula::Radial(radial) => radial.opening_angle = Some(angle),
            _ => self.misfit = Some("opening_angle"),
        }
        self
    }

    /// Shortens the vector to this length where it is longer, after any [scale](Self::scaled_by). The length
    /// is in the vector's own unit: that of a force, an acceleration, or a velocity.
    pub fn limited_to(mut self, length: Real) -> Self {
        match &mut self.formula {
            Formula::Radial(radial) if self.scale.is_none() => radial.strongest = Some(length),
            _ => self.limit = Some(length),
        }
        self
    }

    /// Multiplies the vector with a number that depends on the sample: masks, soft edges, falloff
    /// curves, time envelopes. A second scale multiplies the first.
    pub fn scaled_by(mut self, scale: impl Into<Scalar>) -> Self {
        let scale = scale.into();
        // The limit holds after scaling, so it moves from the formula to the field.
        if let Formula::Radial(radial) | Formula::Nearest(Nearest { radial, .. }) =
            &mut self.formula
        {
            self.limit = radial.strongest.take().or(self.limit);
        }
        self.scale = Some(match self.scale.take() {
            Some(known) => known.times(scale),
            None => scale,
        });
        self
    }

    /// Reads the vector as the velocity of a medium, in the field's frame, that drags bodies along: (`linear` +
    /// `quadratic` |w|) w for the velocity w of the flow past the sample. Contacts, drag, magnetic fields and
    /// buoyancy are not flows: they are refused with the tree.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// let whirlwind = Field::vortex(12.0, -1.0).smoothed(1.0).as_wind(0.5, 0.0).speed_cap(30.0);
    /// # let _ = whirlwind;
    /// ```
    pub fn as_wind(mut self, linear: Real, quadratic: Real) -> Self {
        let still = Formula::Uniform(Uniform {
            vector: crate::math::Vector::ZERO,
        });
        let flow = Box::new(std::mem::replace(&mut self.formula, still));
        self.formula = Formula::Wind(Wind {
            flow,
            drag: Drag { linear, quadratic },
            speed_cap: Real::INFINITY,
        });
        self
    }

    /// Bounds the speed of a [wind](Self::as_wind) past the sample, as its drag uses it. Light bodies at
    /// large speeds are stable only with a bound.
    pub fn speed_cap(mut self, speed: Real) -> Self {
        match &mut self.formula {
            Formula::Wind(wind) => wind.speed_cap = speed,
            _ => self.misfit = Some("speed_cap"),
        }
        self
    }
}

/// Where the field acts, and on which bodies.
impl Field {
    /// Restricts the field to samples of colliders whose collision groups interact with these. By default it acts on
    /// all.
    pub fn groups(mut self, groups: InteractionGroups) -> Self {
        self.groups = Some(groups);
        self
    }

    /// Applies the opposite force, at the same point, to the body that the field is anchored to: so
    /// momentum and angular momentum are conserved. Of two bodies that attract each other, either one carries a field
    /// that reacts, or each carries a field that does not: with two fields that react, each force acts twice.
    ///
    /// A field that reacts cannot be combined with fields of other bodies, except by the sum of union and as
    /// [instances](crate::Tree::instances).
    pub fn reacting(mut self) -> Self {
        self.reacts = true;
        self
    }

    /// Restricts the field to a region of its own frame.
    pub fn within(mut self, region: Region) -> Self {
        self.region = region;
        self
    }

    /// Restricts the field to the complement of a region of its own frame.
    pub fn outside(self, region: Region) -> Self {
        self.within(region.complement())
    }

    /// Anchors the field to a body, a collider, or a pose in the world.
    pub fn at(mut self, anchor: impl Into<Anchor>) -> Self {
        self.anchor = anchor.into();
        self
    }
}

/// Name, strength and time. They can also be edited while the field acts: `fields["wind"].strength = 2.0`.
impl Field {
    /// Names the field, for messages and for look-up in a [`FieldSet`](crate::FieldSet).
    pub fn named(mut self, name: &str) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Its name, if it has one.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Sets the factor of the vector, before any limit.
    pub fn strength(mut self, strength: Real) -> Self {
        self.strength = strength;
        self
    }

    /// Switches the field on or off.
    pub fn enabled(mut self, enabled: bool) -> Self {
        self.enabled = enabled;
        self
    }

    /// Sets the time at which the field acts.
    pub fn lifetime(mut self, lifetime: Lifetime) -> Self {
        self.lifetime = lifetime;
        self
    }
}

/// The meaning of the vector, and the points at which bodies are sampled.
impl Field {
    /// Sets the quantity that the vector stands for.
    pub fn force_mode(mut self, mode: ForceMode) -> Self {
        self.mode = mode;
        self
    }

    /// Sets the factor of the vector at each sample.
    pub fn coupled_to(mut self, coupling: Coupling) -> Self {
        self.coupling = coupling;
        self
    }

    /// Couples the field to the charge, or to another axis.
    pub fn coupled_to_axis(self, axis: impl Into<Axis>) -> Self {
        self.coupled_to(Coupling::Axis(axis.into()))
    }

    /// Returns true if the field acts at some time of a step, or at a moment.
    pub(crate) fn is_on(&self, span: Span) -> bool {
        self.enabled && self.lifetime.share_of(span) > 0.0
    }

    /// The samples that the field may act on, whatever its region: the field is on, its groups allow them, and
    /// they do not belong to the body that carries it.
    #[inline(always)]
    pub(crate) fn acts_on<Q: QueryProperties>(
        &self,
        query: &Q,
        frame: &Frame,
    ) -> <Q::Plain as Number>::Mask {
        let is_on = self.is_on(query.span());
        let mut acts = !query.is_of(frame.body) & is_on.into();
        if let Some(groups) = self.groups {
            acts = acts & query.interacts(groups);
        }
        acts
    }

    /// The force on a sample where the field is defined, in world axes.
    pub(crate) fn force<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> Vec3<T> {
        self.force_of(self.strength, local)
    }

    /// [`Self::force`] with another strength than the field's own.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn force_of<T: QueryNumber>(
        &self,
        strength: Real,
        local: &LocalQuery<'_, T>,
    ) -> Vec3<T> {
        if self.is_contact() && local.touch().is_none() {
            return Vec3::zero();
        }
        let mut vector = self.formula.times(to_f64(strength), local);
        if let Some(scale) = &self.scale {
            vector = vector
                * T::apart(
                    #[inline(always)]
                    || scale.at(local),
                );
        }
        if let Some(limit) = self.limit {
            vector = limited(vector, to_f64(limit));
        }
        rotate(local.rotation, vector) * self.weight(local)
    }

    /// Returns true if it can be evaluated at several samples at once.
    pub(crate) fn knows_several(&self) -> bool {
        let of_users = |coupling: &Coupling| matches!(coupling, Coupling::Axis(Axis::User(_)));
        !of_users(&self.coupling)
            && self.formula.knows_several()
            && self.region.knows_several()
            && self.scale.as_ref().is_none_or(Scalar::knows_several)
    }

    /// The potential energy of a sample (J); `None` if the field has no potential.
    pub(crate) fn potential<T: Single>(&self, local: &LocalQuery<'_, T>) -> Option<T> {
        self.potential_of(self.strength, local)
    }

    /// [`Self::potential`] with another strength than the field's own.
    pub(crate) fn potential_of<T: Single>(
        &self,
        strength: Real,
        local: &LocalQuery<'_, T>,
    ) -> Option<T> {
        let bare = self.scale.is_none() && self.limit.is_none();
        let potential = bare.then(|| self.formula.potential(local)).flatten()?;
        let weight = self.weight(local);
        if strength == 1.0 {
            return Some(potential * weight);
        }
        Some(potential * T::from(to_f64(strength)) * weight)
    }

    /// The factor from the formula's vector to a force on the sample.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn weight<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> T {
        let numbers = local.query.numbers();
        // The vector of a contact is a change of velocity, whatever the mode of the field.
        let mode = if self.is_contact() {
            ForceMode::VelocityChange
        } else {
            self.mode
        };
        let coupled = match (&self.coupling, mode) {
            (Coupling::Axis(axis), _) => local.coordinate(axis).unwrap_or(f64::NAN.into()),
            (Coupling::Share, ForceMode::Force) => T::of(numbers.share),
            (Coupling::Share | Coupling::Each, _) => 1.0.into(),
        };
        let whole = match mode {
            ForceMode::Force => coupled,
            ForceMode::Acceleration => coupled * T::of(numbers.mass),
            ForceMode::VelocityChange => coupled * T::of(numbers.mass / numbers.dt),
        };
        whole * T::of(numbers.fraction * self.lifetime.share_of(local.query.span()))
    }

    /// The same field with the place of its region moved into its anchor, if that does not change it. Zones
    /// that differ only in their place then become instances of one. Only for fields in the world's own frame,
    /// where no rounding occurs.
    pub(crate) fn at_its_region(&self) -> Option<Field> {
        let of_place = self.anchor != Anchor::WORLD
            || self.reacts
            || !self.formula.is_placeless()
            || !self.scale_is_uniform()
            || self.region.has_code()
            || self.axes().any(Axis::reads_frame);
        let place = self.region.place().filter(|_| !of_place)?;
        let mut moved = self.clone().at(place);
        moved.region = moved.region.at(-place);
        Some(moved)
    }

    /// Returns true if its scale, if it has one, is the same at all points of a body.
    pub(super) fn scale_is_uniform(&self) -> bool {
        self.scale.as_ref().is_none_or(Scalar::is_uniform)
    }

    /// Returns true if the field may change with time in its own frame. Closures are assumed to do so.
    pub(crate) fn reads_time(&self) -> bool {
        let by_scale = self.scale.as_ref().is_some_and(Scalar::has_code);
        !self.lifetime.is_timeless()
            || self.formula.reads_time()
            || self.region.has_code()
            || by_scale
            || self.axes().any(|axis| *axis == Axis::Time)
    }

    pub(crate) fn reads_velocity(&self) -> bool {
        self.formula.reads_velocity() || self.axes().any(Axis::reads_velocity)
    }

    /// The share of its potential that counts as energy: half for a field that a body carries, as the field of the body
    /// it acts on has the other half; all for a field that reacts.
    pub(crate) fn energy_share(&self, carried: bool) -> f64 {
        if carried && !self.reacts { 0.5 } else { 1.0 }
    }

    /// Returns true if it has a potential.
    pub(crate) fn has_potential(&self) -> bool {
        let query = Query::default();
        let frame = Frame::at_rest(Pose::IDENTITY);
        self.potential(&LocalQuery::new(&query, &frame)).is_some()
    }

    pub(crate) fn is_contact(&self) -> bool {
        matches!(self.formula, Formula::Contact(_))
    }

    /// Returns true if it is a contact field whose law has no vector.
    pub(crate) fn answers_pairs(&self) -> bool {
        match self.formula {
            Formula::Contact(law) => !law.is_vector(),
            _ => false,
        }
    }

    /// Returns true if the formula's vector is multiplied or bounded.
    pub(crate) fn changes_its_vector(&self) -> bool {
        self.strength != 1.0 || self.scale.is_some() || self.limit.is_some()
    }

    /// The axes that the field names.
    pub(crate) fn axes(&self) -> impl Iterator<Item = &Axis> {
        let coupling = match &self.coupling {
            Coupling::Axis(axis) => Some(axis),
            _ => None,
        };
        let formula = self.formula.axes().iter();
        let scale = self.scale.iter().flat_map(Scalar::axes);
        formula
            .chain(self.region.axes())
            .chain(coupling)
            .chain(scale)
    }

    /// The name of the field in messages.
    pub(crate) fn label(&self, place: usize) -> String {
        match &self.name {
            Some(name) => format!("field `{name}`"),
            None => format!("field #{place} ({})", self.formula.kind()),
        }
    }

    pub(crate) fn validate(&self, label: &str) -> Result<(), BuildError> {
        rigid(label, "the pose of the anchor", self.anchor.local_pose())?;
        finite(label, "the strength", self.strength)?;
        self.lifetime.validate(label)?;
        if let Some(setter) = self.misfit {
            return Err(BuildError::Misfit {
                field: label.into(),
                setter,
                formula: self.formula.kind(),
            });
        }
        if let Some(scale) = &self.scale {
            scale.validate(label)?;
        }
        let limit = self.limit.unwrap_or(0.0);
        not_negative(label, "the limit of the vector's length", limit)?;
        self.region.validate(label)?;
        self.formula.validate(label)
    }
}
