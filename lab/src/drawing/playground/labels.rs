//! Labels of the parts of the level.

use std::fmt::Write;

use rapier3d_fields::math::{DVec3, to_dvec3};

use super::PAGE;
use crate::drawing::space::Camera;
use crate::single::scenes::playground::{BLAST, MAGNET, PLANET, POOL, POOL_SIZE, WIND, WIND_SIZE};

pub fn svg(camera: &Camera) -> String {
    let places = [
        ("planet", to_dvec3(PLANET) + DVec3::new(0.0, 2.75, 0.0)),
        (
            "explosion",
            to_dvec3(BLAST) * DVec3::new(1.0, 0.0, 1.0) + DVec3::new(-3.0, 0.0, 0.3),
        ),
        ("magnet", to_dvec3(MAGNET) + DVec3::new(0.7, 1.25, 0.0)),
        (
            "wind",
            to_dvec3(WIND) + to_dvec3(WIND_SIZE) * DVec3::new(-0.86, -1.0, 1.3),
        ),
        (
            "pool",
            to_dvec3(POOL) + to_dvec3(POOL_SIZE) * DVec3::new(0.0, 0.0, 1.28),
        ),
    ];
    let [width, height] = PAGE;
    let mut svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="15" font-weight="bold" text-anchor="middle" fill="white">"#
    );
    for (word, place) in places {
        let spot = camera.spot(place);
        let _ = write!(
            svg,
            r#"<text x="{:.0}" y="{:.0}">{word}</text>"#,
            spot.x, spot.y
        );
    }
    let base = height - 16;
    let _ = write!(
        svg,
        r##"<g font-size="12.5" font-weight="normal" text-anchor="start" fill="#b9c6dc">
<rect x="20" y="{0}" width="11" height="11" rx="2" fill="#ffb242"/><text x="37" y="{base}">awake</text>
<rect x="90" y="{0}" width="11" height="11" rx="2" fill="#7c8aa2"/><text x="107" y="{base}">asleep</text></g></svg>"##,
        base - 10
    );
    svg
}
