//! A box of balls in perspective, drawn as SVG with shaded spheres.

use std::fmt::Write;

use rapier3d_fields::math::{DQuat, DVec3};

/// A ball to draw.
pub struct Ball {
    pub center: DVec3,
    pub radius: f64,
    /// Index into the colours of the drawing.
    pub color: usize,
}

/// The box, and its place on the page.
pub struct View {
    /// Distances from the origin to the walls.
    pub half_extents: DVec3,
    /// The middle of the drawing, and half its width, on the page.
    pub page_center: [f64; 2],
    pub page_radius: f64,
}

/// Red, green, blue.
pub type Rgb = [f64; 3];

/// The colour into which distant balls fade.
const HAZE: Rgb = [236.0, 241.0, 247.0];
/// Number of shades from near to far.
const LAYERS: usize = 10;
/// Distance of the eye from the centre, in half diagonals of the box.
const EYE: f64 = 5.5;

/// The corners of a box, as signs. Bit n of a number is set where sign n is positive.
const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [1.0, 1.0, 1.0],
];

/// A point on the page: across, down, its scale, and how near it is, from -1 to 1.
struct ContactPoint {
    x: f64,
    y: f64,
    scale: f64,
    near: f64,
}

impl View {
    fn project(&self, point: DVec3) -> ContactPoint {
        let tilt = DQuat::from_rotation_x(0.36) * DQuat::from_rotation_y(-0.52);
        let reach = self.half_extents.length();
        let seen = tilt * point / reach;
        let scale = self.page_radius / reach * (EYE * EYE - 1.0).sqrt() / (EYE - seen.z);
        ContactPoint {
            x: self.page_center[0] + scale * reach * seen.x,
            y: self.page_center[1] - scale * reach * seen.y,
            scale,
            near: seen.z,
        }
    }

    fn corner(&self, number: usize) -> ContactPoint {
        self.project(DVec3::from_array(CORNERS[number]) * self.half_extents)
    }

    /// Draws the edges that end in the farthest corner, the balls from far to near, and the
    /// other edges over them.
    pub fn draw(&self, svg: &mut String, balls: &[Ball], colors: &[Rgb]) {
        define_shades(svg, colors);
        let nearness = |corner: &usize| self.corner(*corner).near;
        let farthest = (0..CORNERS.len())
            .min_by(|a, b| nearness(a).total_cmp(&nearness(b)))
            .expect("a box has corners");
        self.draw_edges(svg, "#b4c0d0", |a, b| a == farthest || b == farthest);
        self.draw_balls(svg, balls);
        self.draw_edges(svg, "#5b6b82", |a, b| a != farthest && b != farthest);
    }

    fn draw_balls(&self, svg: &mut String, balls: &[Ball]) {
        let mut spots: Vec<(ContactPoint, &Ball)> = balls
            .iter()
            .map(|ball| (self.project(ball.center), ball))
            .collect();
        spots.sort_by(|(a, _), (b, _)| a.near.total_cmp(&b.near));
        for (spot, ball) in spots {
            let layer = ((spot.near + 0.75) / 1.5 * LAYERS as f64) as usize;
            let _ = writeln!(
                svg,
                r#"<circle cx="{:.1}" cy="{:.1}" r="{:.1}" fill="url(#s{}-{})"/>"#,
                spot.x,
                spot.y,
                spot.scale * ball.radius,
                ball.color,
                layer.min(LAYERS - 1)
            );
        }
    }

    fn draw_edges(&self, svg: &mut String, color: &str, wanted: impl Fn(usize, usize) -> bool) {
        for a in 0..CORNERS.len() {
            // Neighbours along an axis differ in one bit; `b != a` takes each edge once.
            for b in [a | 1, a | 2, a | 4].into_iter().filter(|b| *b != a) {
                if wanted(a, b) {
                    let (from, to) = (self.corner(a), self.corner(b));
                    let _ = writeln!(
                        svg,
                        r#"<path d="M{:.1} {:.1}L{:.1} {:.1}" stroke="{color}" stroke-width="1.4" stroke-linecap="round"/>"#,
                        from.x, from.y, to.x, to.y
                    );
                }
            }
        }
    }
}

/// One gradient per colour and layer: lit from the upper left, and paler with distance.
fn define_shades(svg: &mut String, colors: &[Rgb]) {
    svg.push_str("<defs>\n");
    for (number, color) in colors.iter().enumerate() {
        for layer in 0..LAYERS {
            let haze = 0.72 * (1.0 - layer as f64 / (LAYERS - 1) as f64);
            let [light, body, rim] = [
                hex(mix(mix(*color, [255.0; 3], 0.75), HAZE, haze)),
                hex(mix(*color, HAZE, haze)),
                hex(mix(mix(*color, [20.0, 30.0, 55.0], 0.5), HAZE, haze)),
            ];
            let _ = writeln!(
                svg,
                r#"<radialGradient id="s{number}-{layer}" cx=".36" cy=".32" r=".72"><stop offset="0" stop-color="{light}"/><stop offset=".5" stop-color="{body}"/><stop offset="1" stop-color="{rim}"/></radialGradient>"#
            );
        }
    }
    svg.push_str("</defs>\n");
}

fn mix(a: Rgb, b: Rgb, share: f64) -> Rgb {
    std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
}

fn hex(color: Rgb) -> String {
    let [r, g, b] = color.map(|c| c.round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
