//! Overlap: of balls exactly, and of balls with any other shape by Parry's projection.

use std::collections::HashMap;

use super::field_contact::{FieldContact, Part};
use crate::compile::Compiled;
use crate::field::ContactLaw;
use crate::math::{ColliderHandle, Pose, Real, RigidBodyHandle, SharedShape, Vector};
use crate::neighbors::{Cluster, VerletList};
use crate::rapier::geometry::{Aabb, Collider};
use crate::rigid::Lookup;

/// Laws of colliders are kept in a table up to this index, and beyond it in a map: a handle that
/// no world gave out may hold any number.
const TABLED: usize = 1 << 20;

/// Everything that may touch, at its present place.
#[derive(Debug)]
pub(super) struct Discrete {
    /// Numbers of the detection fields of each collider.
    detectors: HashMap<ColliderHandle, Vec<u32>>,
    /// By the index of a collider: its handle and law, if it has a detection field.
    laws: Vec<Option<(ColliderHandle, ContactLaw)>>,
    laws_beyond: HashMap<ColliderHandle, ContactLaw>,
    /// Those of one body stand together.
    balls: Vec<Ball>,
    clusters: Vec<Cluster>,
    list: VerletList,
    solids: Vec<Solid>,
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
    bounds: Aabb,
}

impl Discrete {
    pub(super) fn new(compiled: &Compiled) -> Self {
        let mut detectors: HashMap<ColliderHandle, Vec<u32>> = HashMap::new();
        for (number, detector) in compiled.detectors.iter().enumerate() {
            detectors
                .entry(detector.collider)
                .or_default()
                .push(number as u32);
        }
        let (mut laws, mut laws_beyond) = (Vec::new(), HashMap::new());
        for (collider, numbers) in &detectors {
            let all = numbers.iter().map(|d| compiled.detectors[*d as usize].law);
            let Some(law) = all.reduce(ContactLaw::stronger) else {
                continue;
            };
            let index = collider.into_raw_parts().0 as usize;
            if index < TABLED {
                laws.resize(laws.len().max(index + 1), None);
                laws[index] = Some((*collider, law));
            } else {
                laws_beyond.insert(*collider, law);
            }
        }
        Discrete {
            detectors,
            laws,
            laws_beyond,
            balls: Vec::new(),
            clusters: Vec::new(),
            list: VerletList::default(),
            solids: Vec::new(),
        }
    }

    /// Numbers of the detection fields of a collider.
    pub(super) fn detectors_of(&self, collider: ColliderHandle) -> &[u32] {
        self.detectors.get(&collider).map_or(&[], Vec::as_slice)
    }

    fn law_of(&self, collider: ColliderHandle) -> Option<ContactLaw> {
        let index = collider.into_raw_parts().0 as usize;
        if index >= TABLED {
            return self.laws_beyond.get(&collider).copied();
        }
        let (handle, law) = (*self.laws.get(index)?)?;
        (handle == collider).then_some(law)
    }

    /// A collider, with its law.
    pub(super) fn part_of(
        &self,
        collider: ColliderHandle,
        body: Option<RigidBodyHandle>,
        dynamic: bool,
    ) -> Part {
        Part {
            collider,
            body,
            dynamic,
            law: self.law_of(collider),
        }
    }

    /// Takes up all colliders that can touch or be touched.
    pub(super) fn gather(&mut self, world: &impl Lookup) {
        self.balls.clear();
        self.clusters.clear();
        self.solids.clear();
        for (handle, body) in world.bodies() {
            let start = self.balls.len() as u32;
            let part = Part {
                collider: ColliderHandle::invalid(),
                body: Some(handle),
                dynamic: body.is_dynamic(),
                law: None,
            };
            for handle in body.colliders() {
                if let Some(collider) = world.collider(*handle) {
                    let local_pose = collider.position_wrt_parent();
                    let pose = *body.position() * local_pose.copied().unwrap_or(Pose::IDENTITY);
                    let collider_part = Part {
                        collider: *handle,
                        ..part
                    };
                    self.part(collider_part, collider, pose);
                }
            }
            self.cluster(start);
        }
        for (handle, collider) in world.free_colliders() {
            let start = self.balls.len() as u32;
            let part = Part {
                collider: handle,
                body: None,
                dynamic: false,
                law: None,
            };
            self.part(part, collider, *collider.position());
            self.cluster(start);
        }
    }

    fn part(&mut self, mut part: Part, collider: &Collider, pose: Pose) {
        if !collider.is_enabled() || collider.is_sensor() {
            return;
        }
        part.law = self.law_of(part.collider);
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
                bounds: collider.shape().compute_aabb(&pose),
            });
        }
    }

    /// Makes a cluster of the balls from `start` on.
    fn cluster(&mut self, start: u32) {
        let balls = &self.balls[start as usize..];
        let Some(first) = balls.first() else { return };
        let sum = balls
            .iter()
            .fold(Vector::ZERO, |sum, ball| sum + (ball.centre - first.centre));
        let centre = first.centre + sum / balls.len() as Real;
        let reach = |ball: &Ball| (ball.centre - centre).length() + ball.radius;
        self.clusters.push(Cluster {
            centre,
            radius: balls.iter().map(reach).fold(0.0, Real::max),
            start,
            end: self.balls.len() as u32,
        });
    }

    /// Adds all contacts in which at least one side has a detection field.
    pub(super) fn find(&mut self, world: &impl Lookup, contacts: &mut Vec<FieldContact>) {
        self.list.refresh(&self.clusters, 0.0);
        for (i, cluster) in self.clusters.iter().enumerate() {
            for j in self.list.later(i) {
                let other = &self.clusters[*j as usize];
                let reach = cluster.radius + other.radius;
                if (cluster.centre - other.centre).length_squared() <= reach * reach * 1.0001 {
                    self.between(cluster, other, world, contacts);
                }
            }
        }
        for solid in &self.solids {
            for ball in self.balls.iter().filter(|ball| solid.is_near(ball)) {
                if solid.part.may_touch(&ball.part) {
                    contacts.extend(solid.touches(ball).map(|touch| touch.contact(world)));
                }
            }
        }
    }

    /// Adds the contacts between the balls of two clusters.
    fn between(
        &self,
        cluster: &Cluster,
        other: &Cluster,
        world: &impl Lookup,
        contacts: &mut Vec<FieldContact>,
    ) {
        let balls = |cluster: &Cluster| &self.balls[cluster.start as usize..cluster.end as usize];
        for ball in balls(cluster) {
            for other in balls(other) {
                let detects = ball.part.law.is_some() || other.part.law.is_some();
                if detects && ball.part.may_touch(&other.part) {
                    contacts.extend(ball.touches(other).map(|touch| touch.contact(world)));
                }
            }
        }
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
    /// Whether a ball reaches the bounds of the solid: a look that costs next to nothing.
    fn is_near(&self, ball: &Ball) -> bool {
        let margin = Vector::splat(ball.radius);
        let (low, high) = (ball.centre - margin, ball.centre + margin);
        low.cmple(self.bounds.maxs).all() && high.cmpge(self.bounds.mins).all()
    }

    fn touches<'a>(&'a self, ball: &'a Ball) -> Option<Overlap<'a>> {
        let local = self.pose.inverse_transform_point(ball.centre);
        let (distance, outward) = match self.shape.as_halfspace() {
            // The one shape without bounds: its projection would lose digits far from its origin.
            Some(half_space) => (half_space.normal.dot(local), half_space.normal),
            None => {
                let projection = self.shape.project_local_point(local, false);
                let away = local - projection.point;
                let sign = if projection.is_inside { -1.0 } else { 1.0 };
                let outward = away.try_normalize().map(|away| away * sign);
                let outward =
                    outward.unwrap_or_else(|| outward_at(&self.shape, local, ball.radius));
                (away.length() * sign, outward)
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

/// Unit vector out of a shape at a point of its surface, where the projection shows no direction:
/// the one in which a point a little beside it is farthest outside.
fn outward_at(shape: &SharedShape, local: Vector, radius: Real) -> Vector {
    let step = local.length().max(radius) * Real::EPSILON.sqrt();
    let away = |axis: Vector| {
        let beside = local + axis * step;
        let projection = shape.project_local_point(beside, false);
        (!projection.is_inside).then(|| beside - projection.point)
    };
    Vector::AXES
        .into_iter()
        .flat_map(|axis| [away(axis), away(-axis)])
        .flatten()
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .and_then(Vector::try_normalize)
        .unwrap_or(Vector::Y)
}

impl Overlap<'_> {
    fn contact(self, world: &impl Lookup) -> FieldContact {
        let [first, second] = self.parts;
        let velocity = |part: &Part| {
            let body = part.body.and_then(|body| world.body(body));
            body.map_or(Vector::ZERO, |body| {
                body.velocity_at_point(self.world_point)
            })
        };
        let closing = velocity(first) - velocity(second);
        let (point, normal) = (self.world_point, self.world_normal);
        FieldContact {
            approach_speed: closing.dot(normal),
            ..FieldContact::new(self.parts, point, normal, self.depth)
        }
    }
}
