//! Solids in perspective, as pixels: what is nearer hides what is farther, whatever is drawn first.

mod camera;
mod canvas;
mod solids;

pub use camera::{Camera, Spot};
pub use canvas::{Canvas, Paint, Rgb};
pub use solids::{disc, draw_ball, draw_box, lit, mix, round};

#[cfg(test)]
mod tests;
