//! The picture of a run: the box on the left, its plots over time on the right.

use std::path::Path;

use rapier3d_fields::math::DVec3;

use super::plot::{self, Units};
use super::projection::{Ball, Rgb, View};
use crate::record::Record;
use crate::{AnyError, make_folder_of};

const WIDTH: u32 = 1320;
const HEIGHT: u32 = 740;
/// Width of the plots.
const PANELS: u32 = 600;

/// The left part of the picture: the box and its titles.
pub struct Scene<'a> {
    pub title: &'a str,
    pub subtitle: &'a str,
    pub balls: Vec<Ball>,
    /// The colours of the balls.
    pub colors: &'a [Rgb],
    pub half_extents: DVec3,
}

/// Writes the picture as SVG.
pub fn write(path: &Path, scene: &Scene, record: &Record, units: &Units) -> Result<(), AnyError> {
    let left = WIDTH - PANELS;
    let view = View {
        half_extents: scene.half_extents,
        page_center: [f64::from(left) / 2.0, f64::from(HEIGHT) / 2.0 + 20.0],
        page_radius: f64::from(left) / 2.0 - 2.0,
    };
    let mut svg = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}">
<rect width="100%" height="100%" rx="14" fill="#fff"/>
<text x="28" y="40" font-family="sans-serif" font-size="21" fill="#263246">{}</text>
<text x="28" y="66" font-family="sans-serif" font-size="15" fill="#5b6b82">{}</text>
"##,
        scene.title, scene.subtitle
    );
    view.draw(&mut svg, &scene.balls, scene.colors);
    let panels = plot::panels(record, units, (PANELS, HEIGHT - 24))?;
    svg += &format!("<g transform=\"translate({left} 14)\">\n{panels}</g>\n</svg>\n");
    make_folder_of(path)?;
    std::fs::write(path, svg)
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}
