//! The region of a field (the paper's critical set): the set where it is defined.

use std::sync::Arc;

use super::axis::Axis;
use super::boundary::Normal;
use super::closure::Closure;
use super::error::{BuildError, rigid, validate_interval};
use super::over_axes::OverAxes;
use super::query::{LocalQuery, QueryNumber, Sample, Single};
use super::sets::{Outward, Sets};
use super::solid::Solid;
use super::stack::Stack;
use crate::math::{Pose, Real, SharedShape, Vector, to_f64};
use crate::number::real;

/// The set where a field is defined: a set in the space of all axes, in the field's own frame.
///
/// Outside its region a field is *not defined*, which is not the same as zero: replacements and
/// cross products give different results. Regions are closed and regularised; see
/// [`boundary`](super::boundary) for samples on a boundary.
///
/// ```
/// use rapier3d_fields::prelude::*;
/// let shell = Region::ball(3.0).difference(Region::ball(2.0));
/// let upper = shell.intersection(Region::half_space(-Vector::Y, 0.0));
/// let during_the_first_second = upper.intersection(Region::interval("time", 0.0, 1.0));
/// # let _ = during_the_first_second;
/// ```
#[derive(Clone, Debug, PartialEq)]
#[must_use = "setters and operators take the value and return the changed one"]
#[cfg_attr(
    feature = "serde-serialize",
    derive(Serialize, Deserialize),
    serde(try_from = "super::saved::RegionSteps")
)]
pub struct Region {
    /// In postfix order, so that neither deep nesting nor its drop can overflow the call stack.
    pub(crate) steps: Vec<RegionStep>,
}

/// One step of a region: a set, or an operation on the sets before it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde-serialize", derive(Serialize, Deserialize))]
#[non_exhaustive]
pub enum RegionStep {
    /// All of space.
    Everywhere,
    /// A solid, and its frame in that of the field.
    Solid(Solid, Pose),
    /// The lower and the upper end of an axis that is not x, y or z.
    Interval(
        Axis,
        #[cfg_attr(feature = "serde-serialize", serde(with = "super::saved::lower"))] Real,
        #[cfg_attr(feature = "serde-serialize", serde(with = "super::saved::upper"))] Real,
    ),
    /// A set over several axes.
    OverAxes(OverAxes),
    /// The set where a function is true.
    Predicate(Arc<Closure<bool>>),
    /// The union of the two sets before.
    Union,
    /// The intersection of the two sets before.
    Intersection,
    /// The difference of the two sets before.
    Difference,
    /// The complement of the set before.
    Complement,
}

impl Region {
    /// All of space, and all values of every other axis.
    pub fn everywhere() -> Self {
        Self::of(RegionStep::Everywhere)
    }

    /// A ball around the origin of the field's frame.
    pub fn ball(radius: Real) -> Self {
        Self::solid(Solid::Ball { radius })
    }

    /// A box around the origin, given half its edges.
    pub fn cuboid(half_extents: Vector) -> Self {
        Self::solid(Solid::Cuboid { half_extents })
    }

    /// A cylinder around the y axis, as Parry's: from −`half_height` to `half_height`.
    pub fn cylinder(half_height: Real, radius: Real) -> Self {
        Self::solid(Solid::Cylinder {
            half_height,
            radius,
        })
    }

    /// A cone around the y axis, as Parry's: apex at y = `half_height`, base at −`half_height`.
    pub fn cone(half_height: Real, radius: Real) -> Self {
        Self::solid(Solid::Cone {
            half_height,
            radius,
        })
    }

    /// A capsule around the y axis, as Parry's: its segment reaches from −`half_height` to
    /// `half_height`.
    pub fn capsule(half_height: Real, radius: Real) -> Self {
        Self::solid(Solid::Capsule {
            half_height,
            radius,
        })
    }

    /// The half-space behind the plane `outward` · x = `offset`, for a unit vector `outward`.
    pub fn half_space(outward: Vector, offset: Real) -> Self {
        Self::solid(Solid::HalfSpace { outward }).at(outward * offset)
    }

    /// Any Parry shape: convex, mesh, height field, compound, voxels, …
    ///
    /// - A **mesh** must be the surface of a solid. Equal vertices are merged, and a mesh that is wound inwards is
    ///   turned. The field is refused ([`BuildError::MeshRegion`]) if the mesh has gaps, edges of more than two
    ///   triangles, or neighbours that are wound against each other. Self-intersections are not looked for. A mesh
    ///   with Parry's flag `ORIENTED` is taken as it is.
    /// - A **height field** stands for the points below it, at any depth, within its rectangle; y is up, as for
    ///   Parry. Points below removed cells and triangles are outside. Points on its folds and on the walls of holes
    ///   are in the region and not in its complement. The depth of a point is at most its vertical distance from the
    ///   ground times the cosine of the steepest slope, and with holes the distance to the end of the next cell.
    /// - Shapes that are surfaces or lines (a triangle, a segment, a polyline) have nothing inside: a field
    ///   within one, or within a compound with one, is refused ([`BuildError::FlatRegion`]).
    /// - Balls, cuboids, cylinders, cones, capsules around the y axis and half-spaces become the regions of these
    ///   names, which are faster.
    pub fn shape(shape: SharedShape) -> Self {
        Self::solid(Solid::of(shape))
    }

    /// The set where `axis` is between two values; either may be infinite.
    pub fn interval(axis: impl Into<Axis>, min: Real, max: Real) -> Self {
        let axis = axis.into();
        match axis.spatial() {
            Some(axis) => Self::solid(Solid::Slab { axis, min, max }),
            None => Self::of(RegionStep::Interval(axis, min, max)),
        }
    }

    /// The half-space Σ cₐ · a ≤ `offset` over any axes a with coefficients cₐ: a plane in space
    /// that moves with time, or a speed limit that falls with height.
    ///
    /// ```
    /// use rapier3d_fields::prelude::*;
    /// // Behind a front that moves along x at 3 length units per unit of time.
    /// let behind = Region::half_space_over([(Axis::X, 1.0), (Axis::Time, -3.0)], 0.0);
    /// # let _ = behind;
    /// ```
    pub fn half_space_over(
        coefficients: impl IntoIterator<Item = (Axis, Real)>,
        offset: Real,
    ) -> Self {
        let set = OverAxes::half_space(coefficients, offset);
        Self::of(RegionStep::OverAxes(set))
    }

    /// The ball Σ ((a − cₐ)/rₐ)² ≤ 1 over any axes a with centres cₐ and radii rₐ: an ellipsoid
    /// in space, or one that grows and shrinks again in time.
    pub fn ball_over(axes: impl IntoIterator<Item = (Axis, Real, Real)>) -> Self {
        Self::of(RegionStep::OverAxes(OverAxes::ball(axes)))
    }

    /// The set where a function of the user's is true. `reads` lists the axes whose values are in [`Sample::axes`].
    ///
    /// The set is not regularised: on its boundary, too, the value of the function decides.
    pub fn predicate(
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> bool + Send + Sync + 'static,
    ) -> Self {
        Self::of(RegionStep::Predicate(Closure::new(None, reads, function)))
    }

    /// Like [`predicate`](Self::predicate), with a name under which it can be saved; see
    /// [`Registry`](super::Registry).
    pub fn predicate_named(
        name: &str,
        reads: impl IntoIterator<Item = Axis>,
        function: impl Fn(&Sample<'_>) -> bool + Send + Sync + 'static,
    ) -> Self {
        let closure = Closure::new(Some(name), reads, function);
        Self::of(RegionStep::Predicate(closure))
    }

    fn solid(solid: Solid) -> Self {
        Self::of(RegionStep::Solid(solid, Pose::IDENTITY))
    }

    fn of(step: RegionStep) -> Self {
        Region { steps: vec![step] }
    }

    /// The same region moved to `local_pose` (a pose, or a point) in the field's frame. Sets without a position
    /// (intervals of time or speed, predicates) stay as they are.
    pub fn at(mut self, local_pose: impl Into<Placement>) -> Self {
        let Placement(moved) = local_pose.into();
        for step in &mut self.steps {
            match step {
                RegionStep::Solid(_, pose) | RegionStep::OverAxes(OverAxes { pose, .. }) => {
                    *pose = moved * *pose;
                }
                _ => {}
            }
        }
        self
    }

    /// The place of its first solid, if that is not the origin.
    pub(crate) fn place(&self) -> Option<Vector> {
        let place = self.steps.iter().find_map(|step| match step {
            RegionStep::Solid(_, pose) => Some(pose.translation),
            _ => None,
        });
        place.filter(|place| *place != Vector::ZERO)
    }

    /// Points in either region.
    pub fn union(self, other: Region) -> Self {
        self.combine(other, RegionStep::Union)
    }

    /// Points in both regions.
    pub fn intersection(self, other: Region) -> Self {
        self.combine(other, RegionStep::Intersection)
    }

    /// Points of this region that are not in the other, and the cut boundary.
    pub fn difference(self, other: Region) -> Self {
        self.combine(other, RegionStep::Difference)
    }

    /// Points that are not in this region, and its boundary.
    pub fn complement(mut self) -> Self {
        self.steps.push(RegionStep::Complement);
        self
    }

    fn combine(mut self, other: Region, step: RegionStep) -> Self {
        self.steps.extend(other.steps);
        self.steps.push(step);
        self
    }

    /// Returns true if this is all of space, so that no test is needed.
    pub(crate) fn is_everywhere(&self) -> bool {
        matches!(self.steps[..], [RegionStep::Everywhere])
    }

    /// The radius, if the region is a ball around the origin.
    pub(crate) fn as_centred_ball(&self) -> Option<Real> {
        match &self.steps[..] {
            [RegionStep::Solid(Solid::Ball { radius }, pose)]
                if pose.translation == Vector::ZERO =>
            {
                Some(*radius)
            }
            _ => None,
        }
    }

    /// A radius around the origin of the field's frame that encloses the whole region; `None` if the region is
    /// not known to be bounded in space.
    pub(crate) fn bounding_radius(&self) -> Option<Real> {
        let mut stack = Stack::<Option<Real>, 4>::new(None);
        for step in &self.steps {
            match step {
                RegionStep::Solid(solid, pose) => {
                    let away = pose.translation.length();
                    stack.push(solid.extent().map(|extent| extent + away));
                }
                RegionStep::OverAxes(set) => stack.push(set.extent()),
                RegionStep::Everywhere | RegionStep::Interval(..) | RegionStep::Predicate(_) => {
                    stack.push(None);
                }
                RegionStep::Complement => stack.change(|_| None),
                RegionStep::Union => stack.combine(|left, right| Some(left?.max(right?))),
                RegionStep::Intersection => stack.combine(|left, right| {
                    let bounds = [left, right].into_iter().flatten();
                    bounds.reduce(Real::min)
                }),
                RegionStep::Difference => stack.combine(|left, _| left),
            }
        }
        stack.top()
    }

    /// Returns true if it depends on a function of the user's.
    pub(crate) fn has_code(&self) -> bool {
        let mut steps = self.steps.iter();
        steps.any(|step| matches!(step, RegionStep::Predicate(_)))
    }

    /// Returns true if it may differ between the colliders of a body at one place.
    pub(crate) fn reads_parts(&self) -> bool {
        self.has_code() || self.axes().any(Axis::is_of_part)
    }

    /// The axes beyond space that the region constrains.
    pub(crate) fn axes(&self) -> impl Iterator<Item = &Axis> {
        self.steps.iter().flat_map(|step| match step {
            RegionStep::Interval(axis, ..) => std::slice::from_ref(axis),
            RegionStep::OverAxes(set) => &set.axes,
            RegionStep::Predicate(predicate) => predicate.axes(),
            _ => &[],
        })
    }

    pub(crate) fn validate(&self, field: &str) -> Result<(), BuildError> {
        for step in &self.steps {
            match step {
                RegionStep::Solid(solid, pose) => {
                    rigid(field, "the pose of the region", pose)?;
                    solid.validate(field)?;
                }
                RegionStep::Interval(_, min, max) => validate_interval(field, *min, *max)?,
                RegionStep::OverAxes(set) => set.validate(field)?,
                RegionStep::Predicate(predicate) => predicate.validate(field)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns true if it can be evaluated at several samples at once.
    pub(crate) fn knows_several(&self) -> bool {
        let of_users = |axis: &Axis| matches!(axis, Axis::User(_));
        !self.has_code()
            && !self.axes().any(of_users)
            && self.steps.iter().all(|step| match step {
                RegionStep::Solid(solid, _) => solid.knows_several(),
                _ => true,
            })
    }

    /// The part of the neighbourhood that lies in the region.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn set<T: QueryNumber, S: Sets<T>>(
        &self,
        local: &LocalQuery<'_, T>,
        here: &S,
    ) -> S::Set {
        let mut stack = Stack::<S::Set, 4>::new(here.all(false.into()));
        for step in &self.steps {
            match step {
                RegionStep::Complement => {
                    let all = here.all(true.into());
                    stack.change(|top| here.difference(all, top));
                }
                RegionStep::Union => stack.combine(|left, right| here.union(left, right)),
                RegionStep::Intersection => {
                    stack.combine(|left, right| here.intersection(left, right))
                }
                RegionStep::Difference => stack.combine(|left, right| here.difference(left, right)),
                set => stack.push(set.set(local, here)),
            }
        }
        stack.top()
    }

    /// Depth of the sample inside the region, negative outside. Its size is at most the distance from the border, along
    /// whichever axis that is; without a border it is infinite. For sets over several axes see [`OverAxes::excess`].
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn depth<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> T {
        let mut stack = Stack::<T, 4>::new(f64::NAN.into());
        for step in &self.steps {
            match step {
                RegionStep::Complement => stack.change(|top| -top),
                RegionStep::Union => stack.combine(|left, right| -(-left).lesser(-right)),
                RegionStep::Intersection => stack.combine(T::lesser),
                RegionStep::Difference => stack.combine(|left, right| left.lesser(-right)),
                set => stack.push(set.depth(local)),
            }
        }
        stack.top()
    }

    /// Adds the outward normals of the surfaces that the sample lies on exactly.
    pub(crate) fn touched<T: Single>(&self, local: &LocalQuery<'_, T>, normals: &mut Vec<Normal>) {
        for step in &self.steps {
            match step {
                RegionStep::Solid(solid, pose) => {
                    solid.for_each_surface(local.point.re(), pose, |surface| {
                        if surface.distance == 0.0 {
                            normals.push(local.spatial_normal(real(surface.outward)));
                        }
                    });
                }
                RegionStep::Interval(axis, min, max) => {
                    let value = local.axis(axis);
                    if value == Some(to_f64(*min)) || value == Some(to_f64(*max)) {
                        normals.push(local.normal_along(axis, 1.0));
                    }
                }
                RegionStep::OverAxes(set) if set.excess(local).re() == 0.0 => {
                    normals.push(set.outward(local));
                }
                _ => {}
            }
        }
    }
}

impl RegionStep {
    /// The part of the neighbourhood that lies in the set of a single step.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn set<T: QueryNumber, S: Sets<T>>(&self, local: &LocalQuery<'_, T>, here: &S) -> S::Set {
        let everywhere = here.all(true.into());
        match self {
            RegionStep::Solid(solid, pose) => {
                let mut inside = everywhere;
                solid.for_each_surface(
                    local.point.re(),
                    pose,
                    #[inline(always)]
                    |surface| {
                        let outward = Outward::Space(surface.outward);
                        let behind = here.behind(surface.distance, outward, local);
                        inside = here.intersection(inside, behind);
                    },
                );
                inside
            }
            RegionStep::Interval(axis, min, max) => {
                let value = local.coordinate(axis).unwrap_or(f64::NAN.into()).re();
                let (low, high) = (-value + to_f64(*min), value - to_f64(*max));
                let above = here.behind(low, Outward::Along(axis, -1.0), local);
                let below = here.behind(high, Outward::Along(axis, 1.0), local);
                here.intersection(above, below)
            }
            RegionStep::OverAxes(set) => {
                here.behind(set.excess(local).re(), Outward::OverAxes(set), local)
            }
            RegionStep::Predicate(predicate) => here.all(predicate.at(local).into()),
            _ => everywhere,
        }
    }

    /// Depth of the sample in the set of a single step.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn depth<T: QueryNumber>(&self, local: &LocalQuery<'_, T>) -> T {
        match self {
            RegionStep::Solid(solid, pose) => solid.depth(local.point, pose),
            RegionStep::Interval(axis, min, max) => {
                let value = local.coordinate(axis).unwrap_or(f64::NAN.into());
                (value - to_f64(*min)).lesser(-value + to_f64(*max))
            }
            RegionStep::OverAxes(set) => -set.excess(local),
            RegionStep::Predicate(predicate) if !predicate.at(local) => f64::NEG_INFINITY.into(),
            _ => f64::INFINITY.into(),
        }
    }
}

/// The pose to which a region is moved: made from a pose or from a point.
#[derive(Clone, Copy, Debug)]
pub struct Placement(Pose);

impl From<Pose> for Placement {
    fn from(pose: Pose) -> Self {
        Placement(pose)
    }
}

impl From<Vector> for Placement {
    fn from(local_point: Vector) -> Self {
        Placement(Pose::from_translation(local_point))
    }
}
