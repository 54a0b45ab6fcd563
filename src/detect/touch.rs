//! Overlap: of balls exactly, and of balls with any other shape by Parry's projection.

use std::collections::HashMap;

use super::FieldContact;
use crate::compile::Compiled;
use crate::eval::Grid;
use crate::field::ContactLaw;
use crate::math::{
    ColliderHandle, ColliderSet, Pose, Real, RigidBodyHandle, RigidBodySet, SharedShape, Vector,
};
use crate::rapier::geometry::Collider;

/// Everything that may touch, at its present place.
#[derive(Debug)]
pub(super) struct Touch {
    /// Numbers of the detection fields of each collider.
    detectors: HashMap<ColliderHandle, Vec<u32>>,
    balls: Vec<Ball>,
    points: Vec<Vector>,
    solids: Vec<Solid>,
    grid: Grid,
}

/// What balls and other shapes have in common.
#[derive(Clone, Copy, Debug)]
struct Part {
    collider: ColliderHandle,
    body: Option<RigidBodyHandle>,
    dynamic: bool,
    /// Of its detection field, if it has one.
    law: Option<ContactLaw>,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    part: Part,
    centre: Vector,
    radius: Real,
}

/// Another shape with a detection field.
#[derive(Debug)]
struct Solid {
    part: Part,
    pose: Pose,
    shape: SharedShape,
}

impl Touch {
    pub(super) fn new(compiled: &Compiled) -> Self {
        let mut detectors: HashMap<ColliderHandle, Vec<u32>> = HashMap::new();
        for (number, detector) in compiled.detectors.iter().enumerate() {
            detectors
                .entry(detector.collider)
                .or_default()
                .push(number as u32);
        }
        Touch {
            detectors,
            balls: Vec::new(),
            points: Vec::new(),
            solids: Vec::new(),
            grid: Grid::default(),
        }
    }

    /// Numbers of the detection fields of a collider.
    pub(super) fn detectors_of(&self, collider: ColliderHandle) -> &[u32] {
        self.detectors.get(&collider).map_or(&[], Vec::as_slice)
    }

    /// Takes up all colliders that can touch or be touched.
    pub(super) fn gather(
        &mut self,
        compiled: &Compiled,
        bodies: &RigidBodySet,
        colliders: &ColliderSet,
    ) {
        self.balls.clear();
        self.solids.clear();
        for (handle, collider) in colliders.iter() {
            if !collider.is_enabled() || collider.is_sensor() {
                continue;
            }
            let laws = self.detectors_of(handle).iter();
            let laws = laws.map(|d| compiled.detectors[*d as usize].law);
            let parent = collider.parent().and_then(|parent| bodies.get(parent));
            let part = Part {
                collider: handle,
                body: collider.parent(),
                dynamic: parent.is_some_and(|body| body.is_dynamic()),
                law: laws.reduce(stronger),
            };
            let pose = world_pose(collider, parent.map(|body| body.position()));
            if let Some(ball) = collider.shape().as_ball() {
                self.balls.push(Ball {
                    part,
                    centre: pose.translation,
                    radius: ball.radius,
                });
            } else if part.law.is_some() {
                self.solids.push(Solid {
                    part,
                    pose,
                    shape: collider.shared_shape().clone(),
                });
            }
        }
        self.points.clear();
        self.points
            .extend(self.balls.iter().map(|ball| ball.centre));
    }

    /// Adds all contacts in which at least one side has a detection field.
    pub(super) fn find(&mut self, bodies: &RigidBodySet, contacts: &mut Vec<FieldContact>) {
        let largest = self
            .balls
            .iter()
            .fold(0.0, |most: Real, ball| most.max(ball.radius));
        self.grid.build(&self.points, largest * 2.0);
        let order = self.grid.order();
        for (i, ball) in self.balls.iter().enumerate() {
            if ball.part.law.is_none() {
                continue;
            }
            for j in self.grid.near(ball.centre, ball.radius + largest).flatten() {
                let j = order[j] as usize;
                let other = &self.balls[j];
                // Of a pair in which both detect, the first finds it.
                if (other.part.law.is_some() && j <= i) || !ball.part.may_touch(&other.part) {
                    continue;
                }
                contacts.extend(ball.touches(other).map(|touch| touch.contact(bodies)));
            }
        }
        for solid in &self.solids {
            for ball in &self.balls {
                if solid.part.may_touch(&ball.part) {
                    contacts.extend(solid.touches(ball).map(|touch| touch.contact(bodies)));
                }
            }
        }
    }
}

/// A collider's pose from its body's, which is newer after a teleport.
fn world_pose(collider: &Collider, body_pose: Option<&Pose>) -> Pose {
    match (body_pose, collider.position_wrt_parent()) {
        (Some(body_pose), Some(local_pose)) => *body_pose * *local_pose,
        _ => *collider.position(),
    }
}

/// Of two laws for one pair the one that counts: what answers before what observes, Newton's law
/// before the paper's, and the larger restitution.
fn stronger(a: ContactLaw, b: ContactLaw) -> ContactLaw {
    match (a, b) {
        (ContactLaw::Impulse { restitution: a }, ContactLaw::Impulse { restitution: b }) => {
            ContactLaw::Impulse {
                restitution: a.max(b),
            }
        }
        (law @ ContactLaw::Impulse { .. }, _) | (_, law @ ContactLaw::Impulse { .. }) => law,
        (ContactLaw::Paper, _) | (_, ContactLaw::Paper) => ContactLaw::Paper,
        (ContactLaw::Observe, ContactLaw::Observe) => ContactLaw::Observe,
    }
}

impl Part {
    /// Parts of one body never touch, nor do two that cannot move.
    fn may_touch(&self, other: &Part) -> bool {
        let same = self.body.is_some() && self.body == other.body;
        !same && (self.dynamic || other.dynamic)
    }
}

/// An overlap of two parts.
struct Overlap<'a> {
    parts: [&'a Part; 2],
    world_point: Vector,
    /// From the first to the second.
    world_normal: Vector,
    depth: Real,
}

impl Ball {
    fn touches<'a>(&'a self, other: &'a Ball) -> Option<Overlap<'a>> {
        let apart = other.centre - self.centre;
        let reach = self.radius + other.radius;
        if apart.length_squared() >= reach * reach {
            return None;
        }
        let distance = apart.length();
        // Of two equal centres no direction is better; Rapier takes +y too.
        let normal = if distance > 0.0 {
            apart / distance
        } else {
            Vector::Y
        };
        let depth = reach - distance;
        Some(Overlap {
            parts: [&self.part, &other.part],
            world_point: self.centre + normal * (self.radius - depth * 0.5),
            world_normal: normal,
            depth,
        })
    }
}

impl Solid {
    fn touches<'a>(&'a self, ball: &'a Ball) -> Option<Overlap<'a>> {
        let local = self.pose.inverse_transform_point(ball.centre);
        let (distance, outward) = match self.shape.as_halfspace() {
            // The one shape without bounds: its projection would lose digits far from its origin.
            Some(half_space) => (half_space.normal.dot(local), half_space.normal),
            None => {
                let projection = self.shape.project_local_point(local, false);
                let away = local - projection.point;
                let sign = if projection.is_inside { -1.0 } else { 1.0 };
                (away.length() * sign, away.normalize_or_zero() * sign)
            }
        };
        let depth = ball.radius - distance;
        if depth <= 0.0 {
            return None;
        }
        let normal = self.pose.rotation * outward;
        Some(Overlap {
            parts: [&self.part, &ball.part],
            world_point: ball.centre - normal * (ball.radius - depth * 0.5),
            world_normal: normal,
            depth,
        })
    }
}

impl Overlap<'_> {
    fn contact(self, bodies: &RigidBodySet) -> FieldContact {
        let [first, second] = self.parts;
        let velocity = |part: &Part| {
            let body = part.body.and_then(|body| bodies.get(body));
            body.map_or(Vector::ZERO, |body| {
                body.velocity_at_point(self.world_point)
            })
        };
        let closing = velocity(first) - velocity(second);
        let law = match (first.law, second.law) {
            (Some(a), Some(b)) => stronger(a, b),
            (law, None) | (None, law) => law.unwrap_or(ContactLaw::Observe),
        };
        let swap = second.collider.into_raw_parts() < first.collider.into_raw_parts();
        let (parts, normal) = if swap {
            ([second, first], -self.world_normal)
        } else {
            ([first, second], self.world_normal)
        };
        FieldContact {
            colliders: parts.map(|part| part.collider),
            bodies: parts.map(|part| part.body),
            world_point: self.world_point,
            world_normal: normal,
            depth: self.depth,
            approach_speed: closing.dot(self.world_normal),
            impulses: [Vector::ZERO; 2],
            law,
        }
    }
}
