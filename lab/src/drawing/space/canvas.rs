//! A page with a depth buffer, of a higher resolution than its pixels.

use super::camera::Spot;

/// Red, green and blue, from 0 to 255.
pub type Rgb = [f32; 3];

/// Points per side of a pixel.
const FINE: usize = 3;

/// The way something is drawn.
#[derive(Clone, Copy)]
pub struct Paint {
    pub color: Rgb,
    /// From 0, invisible, to 1.
    pub opacity: f32,
    /// Whether it hides shapes behind it that are drawn later.
    pub hides: bool,
    /// Share by which it counts as nearer than it is, so that a shape on a face is in front of it.
    pub lift: f64,
}

impl Paint {
    pub fn solid(color: Rgb) -> Self {
        Self {
            color,
            opacity: 1.0,
            hides: true,
            lift: 0.0,
        }
    }

    /// The paint of a transparent shape.
    pub fn clear(color: Rgb, opacity: f64) -> Self {
        Self {
            color,
            opacity: opacity as f32,
            hides: false,
            lift: 0.0,
        }
    }

    /// The same paint for a shape on a face that is already drawn.
    pub fn on_face(self) -> Self {
        Self { lift: 2e-3, ..self }
    }
}

/// The page: a colour and a nearness per point.
#[derive(Clone)]
pub struct Canvas {
    size: [usize; 2],
    colors: Vec<Rgb>,
    near: Vec<f32>,
}

impl Canvas {
    /// A page of some pixels, in one colour.
    pub fn new(size: [usize; 2], color: Rgb) -> Self {
        let points = size[0] * size[1] * FINE * FINE;
        Self {
            size,
            colors: vec![color; points],
            near: vec![0.0; points],
        }
    }

    fn width(&self) -> usize {
        self.size[0] * FINE
    }

    fn height(&self) -> usize {
        self.size[1] * FINE
    }

    /// Draws a point unless a nearer one hides it.
    fn put(&mut self, place: usize, near: f64, paint: &Paint) {
        let near = (near * (1.0 + paint.lift)) as f32;
        if near < self.near[place] {
            return;
        }
        for (had, new) in self.colors[place].iter_mut().zip(paint.color) {
            *had += paint.opacity * (new - *had);
        }
        if paint.hides {
            self.near[place] = near;
        }
    }

    /// Fills a convex polygon.
    pub fn polygon(&mut self, corners: &[Spot], paint: &Paint) {
        let Some(slope) = Slope::of(corners) else {
            return;
        };
        let fine = FINE as f64;
        let rows = extent(corners.iter().map(|it| fine * it.y), self.height());
        for row in rows {
            let y = (row as f64 + 0.5) / fine;
            let crossings = (0..corners.len()).filter_map(|k| {
                let [a, b] = [corners[k], corners[(k + 1) % corners.len()]];
                let crosses = (a.y <= y) != (b.y <= y);
                crosses.then(|| fine * (a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x)))
            });
            for column in extent(crossings, self.width()) {
                let x = (column as f64 + 0.5) / fine;
                self.put(row * self.width() + column, slope.at(x, y), paint);
            }
        }
    }

    /// Draws a line with these widths at its ends, in pixels.
    pub fn line(&mut self, ends: [Spot; 2], widths: [f64; 2], paint: &Paint) {
        let [a, b] = ends;
        let length = (b.x - a.x).hypot(b.y - a.y).max(1e-9);
        let aside = [(a.y - b.y) / length, (b.x - a.x) / length];
        let moved = |from: Spot, by: f64| Spot {
            x: from.x + by * aside[0],
            y: from.y + by * aside[1],
            ..from
        };
        let [wide, narrow] = widths.map(|it| 0.5 * it);
        let corners = [
            moved(a, wide),
            moved(b, narrow),
            moved(b, -narrow),
            moved(a, -wide),
        ];
        self.polygon(&corners, paint);
    }

    /// Draws the hits of rays within a square around a place: `meet` returns nearness and paint of a hit.
    pub fn rays(
        &mut self,
        around: Spot,
        radius: f64,
        meet: impl Fn(f64, f64) -> Option<(f64, Paint)>,
    ) {
        let fine = FINE as f64;
        let span = |middle: f64| [fine * (middle - radius), fine * (middle + radius)];
        for row in extent(span(around.y), self.height()) {
            for column in extent(span(around.x), self.width()) {
                let [x, y] = [column, row].map(|it| (it as f64 + 0.5) / fine);
                if let Some((near, paint)) = meet(x, y) {
                    self.put(row * self.width() + column, near, &paint);
                }
            }
        }
    }

    /// The pixels row by row, each the mean of its points.
    pub fn pixels(&self) -> Vec<[u8; 3]> {
        let mut pixels = Vec::with_capacity(self.size[0] * self.size[1]);
        for row in 0..self.size[1] {
            for column in 0..self.size[0] {
                let mut sum = [0.0; 3];
                for y in row * FINE..(row + 1) * FINE {
                    let start = y * self.width() + column * FINE;
                    for color in &self.colors[start..start + FINE] {
                        for (sum, it) in sum.iter_mut().zip(color) {
                            *sum += it;
                        }
                    }
                }
                pixels.push(sum.map(|it| (it / (FINE * FINE) as f32).round() as u8));
            }
        }
        pixels
    }
}

/// The range of points whose middles lie between the least and the greatest of `places`, at most `0..most`.
fn extent(places: impl IntoIterator<Item = f64>, most: usize) -> std::ops::Range<usize> {
    let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
    for place in places {
        least = least.min(place);
        greatest = greatest.max(place);
    }
    let bound = |place: f64| (place - 0.5).ceil().clamp(0.0, most as f64) as usize;
    bound(least)..bound(greatest)
}

/// The nearness on a plane face, which is linear on the page.
struct Slope {
    at_origin: f64,
    across: f64,
    down: f64,
}

impl Slope {
    /// From three of the corners; `None` if the face is seen edge-on.
    fn of(corners: &[Spot]) -> Option<Self> {
        let [a, b, c] = [corners[0], corners[1], corners[corners.len() - 1]];
        let (u, v) = ([b.x - a.x, b.y - a.y], [c.x - a.x, c.y - a.y]);
        let area = u[0] * v[1] - u[1] * v[0];
        if area.abs() < 1e-6 {
            return None;
        }
        let (du, dv) = (b.near - a.near, c.near - a.near);
        let across = (du * v[1] - dv * u[1]) / area;
        let down = (dv * u[0] - du * v[0]) / area;
        Some(Self {
            at_origin: a.near - across * a.x - down * a.y,
            across,
            down,
        })
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        self.at_origin + self.across * x + self.down * y
    }
}
