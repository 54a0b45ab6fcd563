//! Solids in perspective, as pixels: nearer ones hide farther ones in any order of drawing.

mod camera;
mod canvas;
mod solids;

pub use camera::{Camera, Spot};
pub use canvas::{Canvas, Paint, Rgb};
pub use solids::{disc, draw_ball, draw_box, lit, mix, round};

#[cfg(test)]
mod tests;
