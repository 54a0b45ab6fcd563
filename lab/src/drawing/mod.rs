//! Pictures as SVG.

pub mod arrows;

pub mod picture;

pub mod plot;

pub mod png;

pub mod projection;
pub mod work_precision;
