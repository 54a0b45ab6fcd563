//! The solids that bodies consist of, for cutting them at borders.

use std::sync::{Arc, OnceLock};

use super::clip::{Content, Plane, Triangle, content, extent, halving};
use crate::math::{DPose3, DQuat, DVec3, Vector};

/// The rotation and the angular velocity of a body, in world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Attitude {
    pub rotation: DQuat,
    pub angvel: Vector,
}

/// The size of a body, and the place of its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bulk {
    /// The largest distance of its parts from the centre of mass.
    pub extent: f64,
    /// From the centre of mass to the mean of the centres of its parts, weighted by their masses, in the body's axes.
    /// Zero except for bodies with additional mass.
    pub middle: DVec3,
}

/// The shape of a part, placed relative to the body's centre of mass.
#[derive(Clone, Debug)]
pub(crate) struct PartShape {
    /// In the body's axes.
    pub local_pose: DPose3,
    pub solid: PartSolid,
}

#[derive(Clone, Debug)]
pub(crate) enum PartSolid {
    /// A part without a volume, or of unknown volume.
    Point,
    /// A ball of this radius, and the mesh of a ball of radius one.
    Ball(f64, Arc<Mesh>),
    Mesh(Arc<Mesh>),
}

/// A closed surface of triangles.
#[derive(Debug)]
pub(crate) struct Mesh {
    pub triangles: Vec<Triangle>,
    /// Its volume is negative if the surface is inside out.
    pub(super) content: Content,
    /// The largest distance of a corner from the centre.
    pub extent: f64,
    halves: OnceLock<Box<[Mesh; 2]>>,
}

impl Mesh {
    pub(super) fn new(triangles: Vec<Triangle>, content: Content) -> Self {
        Mesh {
            content,
            extent: extent(&triangles, content.centre),
            triangles,
            halves: OnceLock::new(),
        }
    }

    /// The parts on both sides of the plane that halves the bounding box across its longest edge. They are kept,
    /// because all bodies of a shape share them.
    pub(super) fn halves(&self) -> &[Mesh; 2] {
        self.halves.get_or_init(|| {
            let plane = halving(&self.triangles);
            let half = |plane: Plane| {
                let mut triangles = Vec::new();
                plane.keep_below(&self.triangles, self.content.centre, &mut triangles);
                let content = content(&triangles);
                Mesh::new(triangles, content)
            };
            Box::new([half(plane), half(plane.flipped())])
        })
    }
}

impl PartSolid {
    /// The centre of the volume.
    pub(super) fn centre(&self) -> DVec3 {
        match self {
            PartSolid::Mesh(mesh) => mesh.content.centre,
            _ => DVec3::ZERO,
        }
    }

    /// The largest distance of the surface from the centre.
    pub(super) fn extent(&self) -> f64 {
        match self {
            PartSolid::Point => 0.0,
            PartSolid::Ball(radius, _) => *radius,
            PartSolid::Mesh(mesh) => mesh.extent,
        }
    }
}
