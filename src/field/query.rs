//! The arguments of fields: one point of one body at one moment, with its properties, or several such points.

use std::sync::Arc;

use super::anchor::Frame;
use super::axis::Axis;
use super::boundary::Normal;
use super::lifetime::Span;
use crate::math::{
    ColliderHandle, DMat3, DQuat, DVec3, InteractionGroups, Real, RigidBodyHandle, Vector,
    from_f64, to_dpose3, to_dvec3,
};
use crate::number::{
    Dual, LANES, LaneMask, Lanes, Number, Plain, Vec3, constant, cross, length, real, rotate,
};

/// Axes with a slot of their own in a [`Normal`]: world x, y, z, then these, then the user's.
const SLOTS: [Axis; 12] = Axis::SLOTS;

/// One sample at one moment, in 64-bit precision and world axes: the argument of the
/// [reference](crate::reference).
#[derive(Clone, Debug)]
pub struct Query {
    /// The sample point.
    pub world_point: DVec3,
    /// The velocity of the body's material at that point.
    pub world_velocity: DVec3,
    /// Simulated time.
    pub time: f64,
    /// The time step, over which a [`ForceMode::VelocityChange`](crate::ForceMode) is spread.
    pub dt: f64,
    /// The start and the end of the step over which fields are averaged: a field that begins or ends in it is weighted
    /// with the share of the step in which it acts. `None` for the moment `time` alone.
    pub step: Option<[f64; 2]>,
    /// The fraction of its part that the sample stands for: one unless the part is sampled at several points.
    /// Forces are weighted with it; the properties below are those of the whole part.
    pub fraction: f64,
    /// Second moments, about the sample point, of the fraction of the part that it stands for, per volume and
    /// in world axes; zero for a whole part.
    pub spread: DMat3,
    /// Radius of the part.
    pub radius: f64,
    /// Mass of the part.
    pub mass: f64,
    /// That mass as a share of the body's; adds up to one over the parts of a body.
    pub share: f64,
    /// Charge of the part.
    pub charge: f64,
    /// Volume of the part.
    pub volume: f64,
    /// Collision groups of the part.
    pub groups: InteractionGroups,
    /// Values of the user's axes, with their names.
    pub user: Arc<[(Arc<str>, f64)]>,
    /// The body of the sample. Fields that this body carries do not act on it.
    pub body: Option<RigidBodyHandle>,
    /// The colliders that the part touches. A [contact field](crate::Field::contact) is zero without a touch.
    pub touches: Vec<Touch>,
}

/// Second moments of a piece that is treated as a point. Not zero, which stands for a whole part.
pub(crate) const POINT: DMat3 = DMat3::from_diagonal(DVec3::splat(1e-60));

/// A touch between the sampled part and a collider, which may carry a contact field (§3.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The collider that is touched.
    pub collider: ColliderHandle,
    /// From the touched part towards the sampled one, a unit vector.
    pub world_normal: DVec3,
    /// Speed of the sampled part at the point of contact.
    pub speed: f64,
    /// Speed at which the two approach along the normal.
    pub approach_speed: f64,
}

impl Default for Query {
    /// A resting point of unit mass at the origin, without size or charge.
    fn default() -> Self {
        Query {
            world_point: DVec3::ZERO,
            world_velocity: DVec3::ZERO,
            time: 0.0,
            dt: 1.0,
            step: None,
            fraction: 1.0,
            spread: DMat3::ZERO,
            radius: 0.0,
            mass: 1.0,
            share: 1.0,
            charge: 0.0,
            volume: 0.0,
            groups: InteractionGroups::all(),
            user: Arc::new([]),
            body: None,
            touches: Vec::new(),
        }
    }
}

impl Query {
    fn user_index(&self, name: &str) -> Option<usize> {
        self.user.iter().position(|(known, _)| **known == *name)
    }

    /// The value of a user's axis; `None` without a value.
    fn user_value(&self, name: &str) -> Option<f64> {
        Some(self.user[self.user_index(name)?].1)
    }
}

/// A number over which fields can be evaluated, with the properties of one sample or of several.
pub(crate) trait QueryNumber: Number {
    /// The properties of the sample or samples.
    type Query: QueryProperties<Plain = Self::Plain>;

    /// Runs a closure in a function of its own. For several samples it is inlined in release builds, since a separate
    /// function would not be compiled for the widest registers of the machine. In debug builds it is not, since the
    /// stack space of all closures together would overflow the stack of a thread.
    fn apart<R>(something: impl FnOnce() -> R) -> R;

    /// The vector of a law that is evaluated at one sample at a time; NaN for several samples.
    fn alone(law: &impl Alone, local: &LocalQuery<'_, Self>) -> Vec3<Self>;
}

/// A number of one sample, with or without derivatives.
pub(crate) trait Single: QueryNumber<Plain = f64, Mask = bool, Query = Query> {}

impl<T: QueryNumber<Plain = f64, Mask = bool, Query = Query>> Single for T {}

/// A law that is evaluated at one sample at a time.
pub(crate) trait Alone {
    /// The vector at a sample, in the field's frame.
    fn vector_alone<T: Single>(&self, local: &LocalQuery<'_, T>) -> Vec3<T>;
}

macro_rules! single {
    ($([$($generics:tt)*] $Number:ty),*) => {$(
        impl<$($generics)*> QueryNumber for $Number {
            type Query = Query;

            #[inline(never)]
            fn apart<R>(something: impl FnOnce() -> R) -> R {
                something()
            }

            #[inline(always)]
            fn alone(law: &impl Alone, local: &LocalQuery<'_, Self>) -> Vec3<Self> {
                law.vector_alone(local)
            }
        }
    )*};
}

single!([] f64, [const K: usize] Dual<K>);

impl QueryNumber for Lanes {
    type Query = Queries;

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn apart<R>(something: impl FnOnce() -> R) -> R {
        something()
    }

    #[inline(always)]
    fn alone(_: &impl Alone, _: &LocalQuery<'_, Self>) -> Vec3<Self> {
        constant(DVec3::NAN)
    }
}

/// Properties of a sample, or of several, that do not depend on the field's frame and carry no derivatives.
pub(crate) trait QueryProperties {
    type Plain: Plain;

    fn numbers(&self) -> Numbers<Self::Plain>;
    /// The time for which lifetimes are evaluated.
    fn span(&self) -> Span;
    /// The samples that belong to a body.
    fn is_of(&self, body: Option<RigidBodyHandle>) -> <Self::Plain as Number>::Mask;
    /// The samples of colliders whose groups interact with these.
    fn interacts(&self, groups: InteractionGroups) -> <Self::Plain as Number>::Mask;
    /// The query; `None` for several samples.
    fn single(&self) -> Option<&Query>;
}

/// The numbers of a [`Query`] that laws for several samples read.
#[derive(Clone, Copy)]
pub(crate) struct Numbers<P> {
    pub time: f64,
    pub dt: f64,
    pub radius: P,
    pub mass: P,
    pub share: P,
    pub charge: P,
    pub fraction: P,
}

impl QueryProperties for Query {
    type Plain = f64;

    #[inline(always)]
    fn numbers(&self) -> Numbers<f64> {
        Numbers {
            time: self.time,
            dt: self.dt,
            radius: self.radius,
            mass: self.mass,
            share: self.share,
            charge: self.charge,
            fraction: self.fraction,
        }
    }

    fn span(&self) -> Span {
        let moment = Span::at(self.time);
        self.step.map_or(moment, |[start, end]| Span { start, end })
    }

    fn is_of(&self, body: Option<RigidBodyHandle>) -> bool {
        body.is_some() && body == self.body
    }

    fn interacts(&self, groups: InteractionGroups) -> bool {
        groups.test(self.groups)
    }

    fn single(&self) -> Option<&Query> {
        Some(self)
    }
}

/// The properties of several samples that fields are evaluated at together.
pub(crate) struct Queries {
    pub numbers: Numbers<Lanes>,
    pub span: Span,
    pub bodies: [RigidBodyHandle; LANES],
    pub groups: [InteractionGroups; LANES],
}

impl QueryProperties for Queries {
    type Plain = Lanes;

    #[inline(always)]
    fn numbers(&self) -> Numbers<Lanes> {
        self.numbers
    }

    #[inline(always)]
    fn span(&self) -> Span {
        self.span
    }

    #[inline(always)]
    fn is_of(&self, body: Option<RigidBodyHandle>) -> LaneMask {
        match body {
            Some(body) => LaneMask::from_fn(|lane| self.bodies[lane] == body),
            None => false.into(),
        }
    }

    #[inline(always)]
    fn interacts(&self, groups: InteractionGroups) -> LaneMask {
        LaneMask::from_fn(|lane| groups.test(self.groups[lane]))
    }

    #[inline(always)]
    fn single(&self) -> Option<&Query> {
        None
    }
}

impl Frame {
    /// Returns true if a sample belongs to the body that the frame is on.
    pub(crate) fn carries(&self, query: &Query) -> bool {
        query.is_of(self.body)
    }
}

/// Point and velocity of a sample in the world, as numbers that may carry derivatives; its other properties
/// have none.
#[derive(Clone, Copy)]
pub(crate) struct Motion<T> {
    pub point: Vec3<T>,
    pub velocity: Vec3<T>,
}

impl Motion<f64> {
    pub(crate) fn of(query: &Query) -> Self {
        Motion {
            point: constant(query.world_point),
            velocity: constant(query.world_velocity),
        }
    }
}

impl Motion<Dual<6>> {
    /// With derivatives by the point (the first three) and by the velocity (the last three).
    pub(crate) fn seeded(query: &Query) -> Self {
        Motion {
            point: inputs(query.world_point, 0),
            velocity: inputs(query.world_velocity, 3),
        }
    }
}

impl Motion<Dual<3>> {
    /// With derivatives by the velocity alone.
    pub(crate) fn by_velocity(query: &Query) -> Self {
        Motion {
            point: constant(query.world_point),
            velocity: inputs(query.world_velocity, 0),
        }
    }
}

/// A vector whose components are inputs, from number `first` on.
fn inputs<const K: usize>(vector: DVec3, first: usize) -> Vec3<Dual<K>> {
    let component = |k: usize| Dual::input(vector[k], first + k);
    Vec3::new(component(0), component(1), component(2))
}

/// A query in the frame of a field: point and velocity relative to that frame, in its axes.
pub(crate) struct LocalQuery<'a, T: QueryNumber = f64> {
    pub point: Vec3<T>,
    pub velocity: Vec3<T>,
    /// The rotation from the field's frame to the world.
    pub rotation: DQuat,
    /// The collider that carries the field.
    pub collider: Option<ColliderHandle>,
    pub query: &'a T::Query,
}

impl<'a> LocalQuery<'a> {
    pub(crate) fn new(query: &'a Query, frame: &Frame) -> Self {
        Self::moving(query, &Motion::of(query), frame)
    }
}

impl<'a, T: QueryNumber> LocalQuery<'a, T> {
    #[inline(always)]
    pub(crate) fn moving(query: &'a T::Query, motion: &Motion<T>, frame: &Frame) -> Self {
        let pose = to_dpose3(&frame.pose);
        let arm = motion.point - pose.translation;
        let mut velocity = motion.velocity - to_dvec3(frame.velocity);
        if frame.angvel != Vector::ZERO {
            velocity = velocity - cross(to_dvec3(frame.angvel), arm);
        }
        let to_local = pose.rotation.inverse();
        LocalQuery {
            point: rotate(to_local, arm),
            velocity: rotate(to_local, velocity),
            rotation: pose.rotation,
            collider: frame.collider,
            query,
        }
    }

    /// The query without derivatives; `None` for several samples.
    pub(crate) fn single(&self) -> Option<LocalQuery<'a>> {
        let number = |x: T| x.re().single().unwrap_or(f64::NAN);
        Some(LocalQuery {
            point: self.point.map(number),
            velocity: self.velocity.map(number),
            rotation: self.rotation,
            collider: self.collider,
            query: self.query.single()?,
        })
    }

    /// The touch between the sample and the collider that carries the field, if there is one.
    pub(crate) fn touch(&self) -> Option<&'a Touch> {
        let (collider, query) = (self.collider?, self.query.single()?);
        let mut touches = query.touches.iter();
        touches.find(|touch| touch.collider == collider)
    }

    /// The coordinate of the sample along `axis`; `None` for a user's axis without a value.
    #[inline(always)]
    pub(crate) fn coordinate(&self, axis: &Axis) -> Option<T> {
        Some(match axis {
            Axis::X => self.point.x,
            Axis::Y => self.point.y,
            Axis::Z => self.point.z,
            Axis::Time => self.query.numbers().time.into(),
            Axis::Speed => length(self.velocity),
            Axis::VelocityX => self.velocity.x,
            Axis::VelocityY => self.velocity.y,
            Axis::VelocityZ => self.velocity.z,
            Axis::Distance => length(self.point),
            Axis::ClosingSpeed => self.closing_speed(),
            Axis::TimeToClosest => self.time_to_closest(),
            Axis::ClosestDistance => self.closest_distance(),
            Axis::Radius => T::of(self.query.numbers().radius),
            Axis::Mass => T::of(self.query.numbers().mass),
            Axis::Charge => T::of(self.query.numbers().charge),
            Axis::User(name) => self.query.single()?.user_value(name)?.into(),
        })
    }

    #[inline(always)]
    fn closing_speed(&self) -> T {
        let distance = length(self.point);
        let approach = -self.point.dot(self.velocity) / distance;
        T::select(distance.re().equals(0.0), 0.0.into(), approach)
    }

    #[inline(always)]
    fn time_to_closest(&self) -> T {
        let square = self.velocity.dot(self.velocity);
        let time = -self.point.dot(self.velocity) / square;
        T::select(square.re().equals(0.0), f64::INFINITY.into(), time)
    }

    #[inline(always)]
    fn closest_distance(&self) -> T {
        let speed = length(self.velocity);
        let aside = length(self.point.cross(self.velocity)) / speed;
        T::select(speed.re().equals(0.0), length(self.point), aside)
    }
}

impl<T: Single> LocalQuery<'_, T> {
    /// The sample point without derivatives, in the field's frame.
    pub(crate) fn local_point(&self) -> DVec3 {
        real(self.point)
    }

    /// [`Self::coordinate`] without derivatives.
    pub(crate) fn axis(&self, axis: &Axis) -> Option<f64> {
        self.coordinate(axis).map(T::re)
    }

    /// The direction of growing `axis` in the space of all axes, times `sign`; not for x, y, z.
    pub(crate) fn normal_along(&self, axis: &Axis, sign: f64) -> Normal {
        let mut normal = self.blank_normal();
        let slot = match SLOTS.iter().position(|a| a == axis) {
            Some(slot) => Some(3 + slot),
            None => self
                .query
                .user_index(axis.name())
                .map(|i| 3 + SLOTS.len() + i),
        };
        if let Some(slot) = slot {
            normal[slot] = sign;
        }
        normal
    }

    /// A direction of the field's frame in the space of all axes.
    pub(crate) fn spatial_normal(&self, local: DVec3) -> Normal {
        let mut normal = self.blank_normal();
        normal[..3].copy_from_slice(&(self.rotation * local).to_array());
        normal
    }

    fn blank_normal(&self) -> Normal {
        vec![0.0; 3 + SLOTS.len() + self.query.user.len()]
    }
}

/// The argument of a user's function: the sample in the frame of the field.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Sample<'a> {
    /// The sample point, in the field's frame.
    pub local_point: Vector,
    /// Velocity of the sample relative to the field's frame, in its axes.
    pub local_velocity: Vector,
    /// Simulated time.
    pub time: Real,
    /// Radius of the part that is sampled.
    pub radius: Real,
    /// Mass of the part.
    pub mass: Real,
    /// Charge of the part.
    pub charge: Real,
    /// The coordinates of the sample along the axes that the function declared, in that order.
    pub axes: &'a [Real],
}

impl<'a> Sample<'a> {
    pub(crate) fn new(
        query: &Query,
        local_point: DVec3,
        local_velocity: DVec3,
        axes: &'a [Real],
    ) -> Self {
        use crate::math::from_dvec3;
        Sample {
            local_point: from_dvec3(local_point),
            local_velocity: from_dvec3(local_velocity),
            time: from_f64(query.time),
            radius: from_f64(query.radius),
            mass: from_f64(query.mass),
            charge: from_f64(query.charge),
            axes,
        }
    }
}
