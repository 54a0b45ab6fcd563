//! The box that is shown: the one in which bodies move, widened to fixed parts near it.

use super::super::fields::math::{
    ColliderHandle, DPose3, DVec3, SharedShape, from_dvec3, to_dpose3, to_dvec3, to_f64,
};
use super::super::fields::rapier::geometry::Collider;
use super::super::fields::rapier::parry::shape::TypedShape;
use super::super::fields::rapier::pipeline::PhysicsWorld;
use super::bodies::Body;
use super::frames::Frame;
use super::paths::Paths;
use super::walls::Wall;

/// Shapes larger than this count as unbounded.
const ENDLESS: f64 = 1e9;

/// How far fixed parts widen the view at most, as a share of half its size.
const WIDENING: f64 = 0.5;

/// A part of a body: a collider, or one of the shapes of a compound.
pub(super) struct Part {
    /// The number of its body.
    pub body: usize,
    /// Its number among the parts of the body.
    pub place: usize,
    /// Its pose in the frame of its body.
    pub local: DPose3,
    /// Its pose in the world at the first frame.
    pub first: DPose3,
    pub shape: SharedShape,
    pub is_sensor: bool,
    pub is_fixed: bool,
}

impl Part {
    /// An upper bound of its reach from the origin of its body; `None` if it is unbounded.
    fn reach(&self) -> Option<f64> {
        let sphere = self.shape.compute_local_bounding_sphere();
        let radius = to_f64(sphere.radius);
        let center = self.local * to_dvec3(sphere.center);
        (radius < ENDLESS).then(|| center.length() + radius)
    }

    /// Whether it contains a point of the world, in its pose at the first frame.
    pub fn contains(&self, world_point: DVec3) -> bool {
        let local = self.first.inverse() * world_point;
        self.shape.contains_local_point(from_dvec3(local))
    }
}

/// All parts of all bodies, in the order of the bodies.
pub(super) struct Parts(Vec<Part>);

impl Parts {
    pub fn new(bodies: &[Body], frames: &[Frame], world: &PhysicsWorld) -> Self {
        let mut parts = Vec::new();
        for (number, body) in bodies.iter().enumerate() {
            let place = &frames[0].places[number];
            let first = DPose3::from_parts(place.at, place.turn);
            let handles = colliders(body, world).into_iter();
            let colliders = handles.filter_map(|handle| world.colliders.get(handle));
            let enabled = colliders.filter(|collider| collider.is_enabled());
            let own = enabled.flat_map(|collider| simple_parts(collider, body));
            parts.extend(own.enumerate().map(|(place, part)| Part {
                body: number,
                place,
                first: first * part.local,
                ..part
            }));
        }
        Parts(parts)
    }

    pub fn of(&self, body: usize) -> impl Iterator<Item = &Part> {
        self.0.iter().filter(move |part| part.body == body)
    }

    pub fn fixed(&self) -> impl Iterator<Item = &Part> {
        self.0.iter().filter(|part| part.is_fixed)
    }

    pub fn movers(&self) -> impl Iterator<Item = &Part> {
        self.0.iter().filter(|part| !part.is_fixed)
    }
}

fn colliders(body: &Body, world: &PhysicsWorld) -> Vec<ColliderHandle> {
    match body.handle {
        Some(handle) => world
            .bodies
            .get(handle)
            .map_or(Vec::new(), |it| it.colliders().to_vec()),
        None => {
            let colliders = world.colliders.iter();
            let free = colliders.filter(|(_, collider)| collider.parent().is_none());
            free.map(|(handle, _)| handle).collect()
        }
    }
}

/// The parts of a collider: those of a compound, or the shape itself.
fn simple_parts(collider: &Collider, body: &Body) -> Vec<Part> {
    let local = match (body.handle, collider.position_wrt_parent()) {
        (Some(_), Some(local)) => to_dpose3(local),
        _ => to_dpose3(collider.position()),
    };
    let part = |pose: DPose3, shape: &SharedShape| Part {
        body: 0,
        place: 0,
        local: local * pose,
        first: DPose3::IDENTITY,
        shape: shape.clone(),
        is_sensor: collider.is_sensor(),
        is_fixed: body.is_fixed,
    };
    match collider.shape().as_typed_shape() {
        TypedShape::Compound(compound) => {
            let shapes = compound.shapes().iter();
            shapes
                .map(|(pose, shape)| part(to_dpose3(pose), shape))
                .collect()
        }
        _ => vec![part(DPose3::IDENTITY, collider.shared_shape())],
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub center: DVec3,
    /// Half its size.
    pub half: DVec3,
}

impl Bounds {
    /// The box in which bodies move, over all frames; that of fixed parts if none moves.
    pub fn of_movers(parts: &Parts, paths: &Paths) -> Self {
        let largest = parts.movers().filter_map(Part::reach).fold(0.0, f64::max);
        let places = paths.places().iter().copied();
        let low = places.clone().reduce(DVec3::min);
        let high = places.reduce(DVec3::max);
        let bounds = match (low, high) {
            (Some(low), Some(high)) => Bounds::between(low, high),
            _ => Bounds::of_fixed(parts),
        };
        // The view is larger than the largest part.
        let half = bounds.half + DVec3::splat(largest);
        let least = (2.5 * largest - half.length()).max(0.0);
        let half = half + DVec3::splat(least);
        Bounds {
            half: if half.max_element() > 0.0 {
                half
            } else {
                DVec3::ONE
            },
            ..bounds
        }
    }

    fn of_fixed(parts: &Parts) -> Self {
        let boxes = parts.fixed().filter_map(Bounds::of_part);
        let all =
            boxes.reduce(|a, b| Bounds::between(a.low().min(b.low()), a.high().max(b.high())));
        all.unwrap_or(Bounds {
            center: DVec3::ZERO,
            half: DVec3::ZERO,
        })
    }

    fn between(low: DVec3, high: DVec3) -> Self {
        Bounds {
            center: (low + high) / 2.0,
            half: (high - low) / 2.0,
        }
    }

    fn low(&self) -> DVec3 {
        self.center - self.half
    }

    fn high(&self) -> DVec3 {
        self.center + self.half
    }

    /// The box around a part at the first frame; `None` if it is unbounded.
    fn of_part(part: &Part) -> Option<Self> {
        part.reach()?;
        let aabb = part.shape.compute_local_aabb();
        let center = part.first * to_dvec3(aabb.center());
        let half = to_dvec3(aabb.half_extents()).to_array();
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| (part.first.rotation * axis).abs());
        let half = axes[0] * half[0] + axes[1] * half[1] + axes[2] * half[2];
        Some(Bounds { center, half })
    }

    /// The box widened to fixed parts near it, except walls.
    pub fn with_fixed(self, parts: &Parts, walls: &[Wall]) -> Self {
        let reach = DVec3::splat(WIDENING * self.half.max_element());
        let (least, most) = (self.low() - reach, self.high() + reach);
        let (mut low, mut high) = (self.low(), self.high());
        let others = parts
            .fixed()
            .filter(|part| !walls.iter().any(|wall| wall.is_of(part)));
        for fixed in others.filter_map(Bounds::of_part) {
            low = low.min(fixed.low().max(least));
            high = high.max(fixed.high().min(most));
        }
        Bounds::between(low, high)
    }
}
