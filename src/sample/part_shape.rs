//! What bodies are made of, for cutting them.

use std::sync::Arc;

use super::clip::Triangle;
use crate::math::{DPose3, DQuat, DVec3, Vector};

/// How a body stands and turns.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Attitude {
    pub rotation: DQuat,
    pub angvel: Vector,
}

/// Where the parts of a body are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bulk {
    /// How far they reach from the centre of mass.
    pub extent: f64,
    /// From the centre of mass to the centre of its parts, weighted by their masses, in the body's
    /// axes: zero, but for bodies with mass of their own.
    pub middle: DVec3,
}

/// The shape of a part, at its place about the body's centre of mass.
#[derive(Clone, Debug)]
pub(crate) struct PartShape {
    /// In the body's axes.
    pub local_pose: DPose3,
    pub solid: PartSolid,
}

#[derive(Clone, Debug)]
pub(crate) enum PartSolid {
    /// It has no volume, or none that is known.
    Point,
    /// Its radius, and a mesh of a ball of radius one.
    Ball(f64, Arc<Mesh>),
    Mesh(Arc<Mesh>),
}

/// A closed surface.
#[derive(Debug)]
pub(crate) struct Mesh {
    pub triangles: Vec<Triangle>,
    /// Less than zero if it is inside out.
    pub volume: f64,
    pub centre: DVec3,
    /// How far it reaches from its centre.
    pub extent: f64,
}

impl PartSolid {
    /// The centre of the volume.
    pub(super) fn centre(&self) -> DVec3 {
        match self {
            PartSolid::Mesh(mesh) => mesh.centre,
            _ => DVec3::ZERO,
        }
    }

    /// How far it reaches from its centre.
    pub(super) fn extent(&self) -> f64 {
        match self {
            PartSolid::Point => 0.0,
            PartSolid::Ball(radius, _) => *radius,
            PartSolid::Mesh(mesh) => mesh.extent,
        }
    }
}
