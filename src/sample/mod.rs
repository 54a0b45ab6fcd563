//! Makes samples of bodies: the points at which fields are sampled, with the properties that fields may read.

mod cap;
mod clip;
mod cloud;
mod gather;
mod known_points;
mod part_shape;
mod pieces;
mod point;
mod properties;
mod samples;
mod shapes;

pub(crate) use cloud::{BLOCK, CloudRun, PlacedBlock};
pub(crate) use gather::Gatherer;
pub(crate) use part_shape::Attitude;
pub(crate) use pieces::Cutter;
pub(crate) use point::{Kind, Moment, SamplePoint, owner};
pub(crate) use properties::Properties;
pub(crate) use samples::Samples;
