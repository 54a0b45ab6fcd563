//! A square of a plane, drawn as SVG: arrows of a field on a grid, circles, lines and text.

use std::fmt::Write;

use rapier3d_fields::math::DVec3;

/// Light to dark, from weak to strong: matplotlib's viridis reversed, without its palest end.
const SHADES: [&str; 8] = [
    "#b5de2b", "#6ece58", "#35b779", "#1f9e89", "#26828e", "#31688e", "#3e4989", "#482878",
];
/// Forces this many powers of ten below the strongest have the shortest arrow.
const DECADES: f64 = 2.5;

pub const INK: &str = "#263246";
pub const FAINT: &str = "#8b98ab";

/// Part of a plane, and its place on the page.
pub struct Panel {
    /// The point in the middle, and the directions across and up.
    pub middle: DVec3,
    pub across: DVec3,
    pub up: DVec3,
    /// Distance from the middle to each side.
    pub extent: f64,
    /// Middle and half width on the page.
    pub page_middle: [f64; 2],
    pub page_extent: f64,
    /// The part of an arrow that is at its point: 0 is the tail, ½ the middle.
    pub pivot: f64,
}

/// A vector at a point of the plane.
pub struct Arrow {
    pub point: DVec3,
    pub vector: DVec3,
}

impl Panel {
    fn scale(&self) -> f64 {
        self.page_extent / self.extent
    }

    pub fn page(&self, point: DVec3) -> [f64; 2] {
        let arm = point - self.middle;
        let scale = self.scale();
        [
            self.page_middle[0] + scale * arm.dot(self.across),
            self.page_middle[1] - scale * arm.dot(self.up),
        ]
    }

    /// The centres of `count` × `count` cells.
    pub fn grid(&self, count: usize) -> impl Iterator<Item = DVec3> + '_ {
        let place =
            move |k: usize| self.extent * (2.0 * k as f64 + 1.0 - count as f64) / count as f64;
        (0..count * count).map(move |cell| {
            self.middle + self.across * place(cell % count) + self.up * place(cell / count)
        })
    }

    /// The arrows of a field on the [`grid`](Self::grid); none where it is not defined.
    pub fn sample(&self, count: usize, field: impl Fn(DVec3) -> Option<DVec3>) -> Vec<Arrow> {
        let arrow = |point| {
            let vector = field(point)?;
            Some(Arrow { point, vector })
        };
        self.grid(count).filter_map(arrow).collect()
    }

    /// Draws arrows of a logarithmic length, at most `longest` on the page, coloured by strength. The longest stand for
    /// `strongest`, or without it for a strength that most arrows do not exceed. A vector out of the plane is drawn as
    /// a ringed dot, one into it as a cross.
    pub fn draw_arrows(
        &self,
        svg: &mut String,
        arrows: &[Arrow],
        longest: f64,
        strongest: Option<f64>,
    ) {
        let strongest = strongest.unwrap_or_else(|| high_strength(arrows));
        let mut shades: [String; SHADES.len()] = Default::default();
        for arrow in arrows {
            let strength = arrow.vector.length();
            // Singular vectors have no direction, and those that are only rounding errors neither.
            if !strength.is_finite() || strength <= 1e-9 * strongest {
                continue;
            }
            let share = (1.0 + (strength / strongest).log10() / DECADES).clamp(0.0, 1.0);
            let shade = ((share * SHADES.len() as f64) as usize).min(SHADES.len() - 1);
            self.trace_arrow(&mut shades[shade], arrow, longest * (0.25 + 0.75 * share));
        }
        for (path, color) in shades
            .iter()
            .zip(SHADES)
            .filter(|(path, _)| !path.is_empty())
        {
            let _ = writeln!(svg, r#"<path d="{path}" stroke="{color}"/>"#);
        }
    }

    /// Draws arrows with lengths proportional to their vectors, at most `longest`, in one colour.
    pub fn draw_pale(&self, svg: &mut String, arrows: &[Arrow], longest: f64, color: &str) {
        let lengths = arrows.iter().map(|arrow| arrow.vector.length());
        let greatest = lengths.fold(0.0, f64::max);
        let mut path = String::new();
        for arrow in arrows {
            let share = arrow.vector.length() / greatest;
            if share > 0.01 {
                self.trace_arrow(&mut path, arrow, longest * share);
            }
        }
        let _ = writeln!(
            svg,
            r#"<path d="{path}" stroke="{color}" stroke-width="2.2"/>"#
        );
    }

    fn trace_arrow(&self, path: &mut String, arrow: &Arrow, length: f64) {
        let [x, y] = self.page(arrow.point);
        let direction = arrow.vector.normalize();
        let (dx, dy) = (direction.dot(self.across), -direction.dot(self.up));
        let in_plane = dx.hypot(dy);
        if in_plane < 0.1 {
            let towards_eye = direction.dot(self.across.cross(self.up)) > 0.0;
            let mark = if towards_eye {
                "m-2.4 0a2.4 2.4 0 1 0 4.8 0a2.4 2.4 0 1 0-4.8 0m2.4 0h.01"
            } else {
                "m-2-2l4 4m0-4l-4 4"
            };
            let _ = write!(path, "M{x:.1} {y:.1}{mark}");
            return;
        }
        let (lx, ly) = (length * dx, length * dy);
        let head = (0.38 * length * in_plane).min(3.6) / in_plane;
        let barb = |side: f64| {
            (
                head * (-dx + side * 0.55 * dy),
                head * (-dy - side * 0.55 * dx),
            )
        };
        let (left, right) = (barb(1.0), barb(-1.0));
        let _ = write!(
            path,
            "M{:.1} {:.1}l{lx:.1} {ly:.1}m{:.1} {:.1}L{:.1} {:.1}l{:.1} {:.1}",
            x - self.pivot * lx,
            y - self.pivot * ly,
            left.0,
            left.1,
            x + (1.0 - self.pivot) * lx,
            y + (1.0 - self.pivot) * ly,
            right.0,
            right.1,
        );
    }

    pub fn circle(&self, svg: &mut String, center: DVec3, radius: f64, style: &str) {
        let [x, y] = self.page(center);
        let r = radius * self.scale();
        let _ = writeln!(
            svg,
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="{r:.1}" {style}/>"#
        );
    }

    /// A line through points.
    pub fn line(&self, svg: &mut String, points: &[DVec3], style: &str) {
        let mut path = String::new();
        for point in points {
            let [x, y] = self.page(*point);
            let _ = write!(
                path,
                "{}{x:.1} {y:.1}",
                if path.is_empty() { 'M' } else { 'L' }
            );
        }
        let _ = writeln!(svg, r#"<path d="{path}" {style}/>"#);
    }
}

/// The strength that 17 in 20 arrows do not exceed: near a singularity, the largest would make all others pale.
fn high_strength(arrows: &[Arrow]) -> f64 {
    let mut strengths: Vec<f64> = arrows.iter().map(|arrow| arrow.vector.length()).collect();
    strengths.retain(|strength| strength.is_finite() && *strength > 0.0);
    strengths.sort_by(f64::total_cmp);
    let place = strengths.len() * 17 / 20;
    strengths
        .get(place)
        .or(strengths.last())
        .copied()
        .unwrap_or(0.0)
}

/// A line of text.
pub fn text(svg: &mut String, [x, y]: [f64; 2], size: f64, color: &str, words: &str) {
    let words = words.replace('&', "&amp;").replace('<', "&lt;");
    let _ = writeln!(
        svg,
        r#"<text x="{x:.1}" y="{y:.1}" font-size="{size}" fill="{color}">{words}</text>"#
    );
}

/// The legend of the colours.
pub fn legend(svg: &mut String, [x, y]: [f64; 2]) {
    text(svg, [x, y], 13.0, FAINT, "weak");
    for (number, color) in SHADES.iter().enumerate() {
        let left = x + 38.0 + 14.0 * number as f64;
        let top = y - 10.0;
        let _ = writeln!(
            svg,
            r#"<rect x="{left}" y="{top}" width="14" height="11" fill="{color}"/>"#
        );
    }
    text(
        svg,
        [x + 44.0 + 14.0 * SHADES.len() as f64, y],
        13.0,
        FAINT,
        "strong",
    );
}

/// The whole document around its content. By default, lines have round ends and shapes have no fill.
pub fn document(width: f64, height: f64, content: &str) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="sans-serif">
<rect width="100%" height="100%" rx="14" fill="#fff"/>
<g fill="none" stroke-width="1.15" stroke-linecap="round" stroke-linejoin="round">
{content}</g>
</svg>
"##
    )
}
