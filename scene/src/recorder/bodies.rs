//! The bodies of a recording and their shapes.

use std::collections::HashMap;

use super::super::fields::math::{RigidBodyHandle, to_f64};
use super::super::fields::rapier::parry::shape::TypedShape;
use super::super::fields::rapier::pipeline::PhysicsWorld;
use super::bounds::{Bounds, Part, Parts};
use super::frames::{Counts, four_digits};
use super::mesh;
use super::walls::Wall;
use crate::page::{DrawnBody, DrawnPart, DrawnShape};

/// A body of the recording; without a handle, it stands for all colliders that have no body.
pub(super) struct Body {
    pub handle: Option<RigidBodyHandle>,
    pub name: Option<String>,
    pub is_fixed: bool,
}

/// All bodies, in the order of their handles.
pub(super) fn all(world: &PhysicsWorld) -> Vec<Body> {
    let bodies = world.bodies.iter().map(|(handle, body)| Body {
        handle: Some(handle),
        name: None,
        is_fixed: body.is_fixed(),
    });
    let mut bodies: Vec<Body> = bodies.collect();
    let mut colliders = world.colliders.iter();
    if colliders.any(|(_, collider)| collider.parent().is_none()) {
        bodies.push(Body {
            handle: None,
            name: None,
            is_fixed: true,
        });
    }
    bodies
}

/// Bodies and shapes in the form of a page.
pub(super) struct Drawn {
    pub shapes: Vec<DrawnShape>,
    pub bodies: Vec<DrawnBody>,
}

impl Drawn {
    pub fn new(bodies: &[Body], parts: &Parts, walls: &[Wall], bounds: &Bounds) -> Self {
        let mut shapes = Shapes::new(bounds);
        let bodies = bodies.iter().enumerate().map(|(number, body)| {
            let own = parts.of(number);
            let own = own.filter(|part| !walls.iter().any(|wall| wall.is_of(part)));
            let own: Vec<&Part> = own.collect();
            DrawnBody {
                name: body.name.clone(),
                fixed: body.is_fixed,
                turns: own.iter().any(|part| shows_turns(part)),
                parts: own
                    .iter()
                    .map(|part| DrawnPart {
                        color: number,
                        ..shapes.part(part)
                    })
                    .collect(),
            }
        });
        let mut bodies: Vec<DrawnBody> = bodies.collect();
        // In a body of several parts, the colour is by shape; other bodies have one colour each.
        for body in bodies.iter_mut().filter(|body| body.parts.len() > 1) {
            for part in &mut body.parts {
                part.color = part.shape;
            }
        }
        Drawn {
            shapes: shapes.drawn,
            bodies,
        }
    }
}

/// Whether rotations of the body can be seen on a part: not on a ball at the body's origin.
fn shows_turns(part: &Part) -> bool {
    let is_ball = matches!(part.shape.as_typed_shape(), TypedShape::Ball(_));
    !is_ball || part.local.translation.length() > 0.0
}

/// The distinct shapes so far.
struct Shapes<'a> {
    bounds: &'a Bounds,
    counts: Counts,
    drawn: Vec<DrawnShape>,
    known: HashMap<String, usize>,
}

impl<'a> Shapes<'a> {
    fn new(bounds: &'a Bounds) -> Self {
        Shapes {
            bounds,
            counts: Counts::new(bounds),
            drawn: Vec::new(),
            known: HashMap::new(),
        }
    }

    fn part(&mut self, part: &Part) -> DrawnPart {
        let shape = mesh::drawn(part, self.bounds, &self.counts);
        let key = format!("{shape:?}");
        let next = self.drawn.len();
        let number = *self.known.entry(key).or_insert(next);
        if number == next {
            self.drawn.push(shape);
        }
        let at = part.local.translation.to_array();
        DrawnPart {
            shape: number,
            at: at.map(|it| self.counts.fine(it)),
            turn: part.local.rotation.to_array().map(four_digits),
            color: 0,
            sensor: part.is_sensor,
        }
    }
}

/// The radius of a part that is a ball, in the scene's unit of length.
pub(super) fn radius_of_ball(part: &Part) -> Option<f64> {
    Some(to_f64(part.shape.as_ball()?.radius))
}
