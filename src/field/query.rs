//! What a field is asked: one point of one body at one moment, with its properties.

use std::sync::Arc;

use super::anchor::Frame;
use super::axis::Axis;
use super::boundary::Normal;
use super::lifetime::Span;
use super::number::{Dual, Number, Vec3, constant, length, real, rotate};
use crate::math::{
    ColliderHandle, DMat3, DQuat, DVec3, InteractionGroups, Real, RigidBodyHandle, Vector,
    from_f64, to_dpose3, to_dvec3,
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
    /// The step whose mean is asked for, by its start and end: a field that begins or ends in it acts
    /// with its share of it. `None` for the moment `time` alone.
    pub step: Option<[f64; 2]>,
    /// Which fraction of its part the sample stands for: one unless the part is sampled at
    /// several points. Forces are weighted with it; what follows is that of the whole part.
    pub fraction: f64,
    /// Second moments of what the sample stands for about the sample point, per volume, in world
    /// axes; zero where it stands for a whole part.
    pub spread: DMat3,
    /// Radius of the part.
    pub radius: f64,
    /// Mass of the part.
    pub mass: f64,
    /// That mass as a share of the body's: sums to one over the parts of a body.
    pub share: f64,
    /// Charge of the part.
    pub charge: f64,
    /// Volume of the part.
    pub volume: f64,
    /// Collision groups of the part.
    pub groups: InteractionGroups,
    /// Values of the user's axes, by name.
    pub user: Arc<[(Arc<str>, f64)]>,
    /// The body the sample belongs to: that body's own fields do not act.
    pub body: Option<RigidBodyHandle>,
    /// What the part touches: a [contact field](crate::Field::contact) is zero where nothing does.
    pub touches: Vec<Touch>,
}

/// The second moments of what is small beside anything.
pub(crate) const POINT: DMat3 = DMat3::from_diagonal(DVec3::splat(1e-60));

/// A part that the sampled one touches, as a contact field around the former sees it (§3.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The collider that is touched, which may carry a contact field.
    pub collider: ColliderHandle,
    /// From the touched part towards the sampled one, a unit vector.
    pub world_normal: DVec3,
    /// Speed of the sampled part at the point of contact.
    pub speed: f64,
    /// How fast the two approach along the normal.
    pub approach_speed: f64,
}

impl Default for Query {
    /// A resting point of unit mass at the origin, of no size and no charge.
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
    /// What lifetimes are asked about.
    pub(crate) fn span(&self) -> Span {
        let moment = Span::at(self.time);
        self.step.map_or(moment, |[start, end]| Span { start, end })
    }
}

/// How a sample moves, as numbers that may carry derivatives; the rest of a query has none.
#[derive(Clone, Copy)]
pub(crate) struct Motion<T> {
    pub point: Vec3<T>,
    pub velocity: Vec3<T>,
}

impl Frame {
    /// Whether a sample is of the body that the frame belongs to.
    pub(crate) fn carries(&self, query: &Query) -> bool {
        self.body.is_some() && self.body == query.body
    }
}

impl Motion<f64> {
    pub(crate) fn of(query: &Query) -> Self {
        Motion {
            point: constant(query.world_point),
            velocity: constant(query.world_velocity),
        }
    }
}

impl Motion<Dual> {
    /// With the derivatives by the point and the velocity themselves.
    pub(crate) fn seeded(query: &Query) -> Self {
        let plain = Motion::of(query);
        let seed = |v: Vec3<f64>, first: usize| {
            let component = |k: usize| Dual::from(v[k]).derivative(first + k);
            Vec3::new(component(0), component(1), component(2))
        };
        Motion {
            point: seed(plain.point, 0),
            velocity: seed(plain.velocity, 3),
        }
    }
}

/// A query as a field sees it: point and velocity relative to the field's frame, in its axes.
pub(crate) struct LocalQuery<'a, T = f64> {
    pub point: Vec3<T>,
    pub velocity: Vec3<T>,
    /// Frame to world.
    pub rotation: DQuat,
    /// The collider that carries the field.
    pub collider: Option<ColliderHandle>,
    pub query: &'a Query,
}

impl<'a> LocalQuery<'a> {
    pub(crate) fn new(query: &'a Query, frame: &Frame) -> Self {
        Self::moving(query, &Motion::of(query), frame)
    }
}

impl<'a, T: Number> LocalQuery<'a, T> {
    pub(crate) fn moving(query: &'a Query, motion: &Motion<T>, frame: &Frame) -> Self {
        let pose = to_dpose3(&frame.pose);
        let arm = motion.point - constant(pose.translation);
        let turning = constant::<T>(to_dvec3(frame.angvel)).cross(&arm);
        let velocity = motion.velocity - constant(to_dvec3(frame.velocity)) - turning;
        let to_local = pose.rotation.inverse();
        LocalQuery {
            point: rotate(to_local, &arm),
            velocity: rotate(to_local, &velocity),
            rotation: pose.rotation,
            collider: frame.collider,
            query,
        }
    }

    /// How the sample touches the collider that carries the field.
    pub(crate) fn touch(&self) -> Option<&'a Touch> {
        let collider = self.collider?;
        let mut touches = self.query.touches.iter();
        touches.find(|touch| touch.collider == collider)
    }

    /// The sample point without derivatives, in the field's frame.
    pub(crate) fn local_point(&self) -> DVec3 {
        real(&self.point)
    }

    /// The coordinate of the sample along `axis`; `None` where the user's axis has no value.
    pub(crate) fn axis(&self, axis: &Axis) -> Option<f64> {
        self.coordinate(axis).map(|value| value.re())
    }

    /// Like [`Self::axis`], with derivatives.
    pub(crate) fn coordinate(&self, axis: &Axis) -> Option<T> {
        Some(match axis {
            Axis::X => self.point.x,
            Axis::Y => self.point.y,
            Axis::Z => self.point.z,
            Axis::Time => self.query.time.into(),
            Axis::Speed => length(&self.velocity),
            Axis::VelocityX => self.velocity.x,
            Axis::VelocityY => self.velocity.y,
            Axis::VelocityZ => self.velocity.z,
            Axis::Distance => length(&self.point),
            Axis::ClosingSpeed => self.closing_speed(),
            Axis::TimeToClosest => self.time_to_closest(),
            Axis::ClosestDistance => self.closest_distance(),
            Axis::Radius => self.query.radius.into(),
            Axis::Mass => self.query.mass.into(),
            Axis::Charge => self.query.charge.into(),
            Axis::User(_) => self.query.user[self.user_index(axis)?].1.into(),
        })
    }

    fn closing_speed(&self) -> T {
        let distance = length(&self.point);
        if distance.re() == 0.0 {
            return 0.0.into();
        }
        -self.point.dot(&self.velocity) / distance
    }

    fn time_to_closest(&self) -> T {
        let square = self.velocity.dot(&self.velocity);
        if square.re() == 0.0 {
            return f64::INFINITY.into();
        }
        -self.point.dot(&self.velocity) / square
    }

    fn closest_distance(&self) -> T {
        let speed = length(&self.velocity);
        if speed.re() == 0.0 {
            return length(&self.point);
        }
        length(&self.point.cross(&self.velocity)) / speed
    }

    /// The direction of growing `axis` in the space of all axes; not for x, y, z.
    pub(crate) fn normal_along(&self, axis: &Axis, sign: f64) -> Normal {
        let mut normal = self.blank_normal();
        let slot = match SLOTS.iter().position(|a| a == axis) {
            Some(slot) => Some(3 + slot),
            None => self.user_index(axis).map(|i| 3 + SLOTS.len() + i),
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

    fn user_index(&self, axis: &Axis) -> Option<usize> {
        let names = self.query.user.iter();
        names
            .into_iter()
            .position(|(name, _)| **name == *axis.name())
    }
}

/// What a user's own formula is given: the sample in the frame of the field.
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
    /// The axes the formula declared that it reads, in that order.
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
