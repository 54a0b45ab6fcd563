//! Field lines, with dashes that drift along them.

use rapier3d_fields::math::{DVec3, Real, Vector, to_dvec3};

use crate::drawing::space::{Camera, Canvas, Paint, Rgb};
use crate::single::scenes::playground::{
    MAGNET, MAGNET_REACH, PLANET, PLANET_REACH, Playground, WIND, WIND_SIZE,
};

const AIR: Rgb = [205.0, 240.0, 255.0];
const GRAVITY: Rgb = [255.0, 224.0, 150.0];
const PULL: Rgb = [255.0, 150.0, 196.0];

/// The length of a line's pieces, m.
const PIECE: Real = 0.1;

/// The appearance of the dashes of a field.
struct Style {
    color: Rgb,
    opacity: f64,
    /// Length, in pieces of a line.
    dash: f64,
    /// Number of times a dash passes along its line until the animation repeats.
    turns: f64,
    width: f64,
}

/// A field line, and the initial place of its dash, from 0 to 1.
struct Stream {
    points: Vec<DVec3>,
    start: f64,
}

pub struct Streams(Vec<(Style, Vec<Stream>)>);

impl Streams {
    /// Follows the fields of the level from points in their regions.
    pub fn of(level: &Playground) -> Self {
        let wind = Style {
            color: AIR,
            opacity: 0.7,
            dash: 15.0,
            turns: 3.0,
            width: 2.8,
        };
        let gravity = Style {
            color: GRAVITY,
            opacity: 0.8,
            dash: 5.0,
            turns: 6.0,
            width: 2.4,
        };
        let pull = Style {
            color: PULL,
            opacity: 0.7,
            dash: 8.0,
            turns: 5.0,
            width: 2.6,
        };
        Self(vec![
            (wind, follow_all(level, wind_starts())),
            (gravity, follow_all(level, around(PLANET, PLANET_REACH, 22))),
            (pull, follow_all(level, around(MAGNET, MAGNET_REACH, 30))),
        ])
    }

    /// Draws the dashes after a `share` of the animation.
    pub fn draw(&self, canvas: &mut Canvas, camera: &Camera, share: f64) {
        for (style, streams) in &self.0 {
            for stream in streams {
                stream.draw(canvas, camera, style, share);
            }
        }
    }
}

/// Points at the windward side.
fn wind_starts() -> Vec<Vector> {
    let mut starts = Vec::new();
    for row in 0..2 {
        for column in 0..4 {
            let [up, aside] = [0.6 * row as Real - 0.62, (column as Real - 1.5) / 1.8];
            let shift = Vector::new(-0.999, up, aside + 0.2 * up);
            starts.push(WIND + WIND_SIZE * shift);
        }
    }
    starts
}

/// Points of a Fibonacci lattice on a sphere just within `reach`, without those close to or below the floor.
fn around(center: Vector, reach: Real, count: usize) -> Vec<Vector> {
    let place = |k: usize| {
        let up = 1.0 - 2.0 * (k as Real + 0.5) / count as Real;
        let turn = 2.399_963 * k as Real;
        let flat = (1.0 - up * up).sqrt();
        Vector::new(flat * turn.cos(), up, flat * turn.sin())
    };
    let places = (0..count).map(place);
    let places = places.map(|it| center + it * (0.99 * reach));
    places.filter(|it| it.y > 0.1).collect()
}

fn follow_all(level: &Playground, starts: Vec<Vector>) -> Vec<Stream> {
    let streams = starts.into_iter().enumerate();
    let streams = streams.map(|(number, start)| Stream {
        points: follow(level, start),
        start: (0.754_9 * number as f64 + 0.137 * (number * number) as f64).fract(),
    });
    streams.filter(|it| it.points.len() > 2).collect()
}

/// The line along the fields from `start`, up to where they are not defined or their direction reverses.
fn follow(level: &Playground, start: Vector) -> Vec<DVec3> {
    let (mut at, mut points) = (start, Vec::new());
    let mut last = Vector::ZERO;
    while points.len() < 200 {
        let values = level.fields.values_at(&[at], &level.world);
        let towards = values[0].force.normalize_or_zero();
        if !values[0].is_defined || towards.dot(last) < 0.0 || towards == Vector::ZERO {
            break;
        }
        points.push(to_dvec3(at));
        at += towards * PIECE;
        last = towards;
    }
    points
}

impl Stream {
    fn draw(&self, canvas: &mut Canvas, camera: &Camera, style: &Style, share: f64) {
        let last = self.points.len() as f64 - 1.0;
        // The dash enters before the start of its line, and leaves beyond its end.
        let whole = last + style.dash;
        let head = (self.start + share * style.turns).fract() * whole;
        let paint = Paint::clear(style.color, style.opacity);
        let at = |place: f64| {
            let place = place.clamp(0.0, last);
            let k = (place as usize).min(self.points.len() - 2);
            self.points[k].lerp(self.points[k + 1], place - k as f64)
        };
        let pieces = 6;
        for piece in 0..pieces {
            let place = |k: i32| head - style.dash * (1.0 - f64::from(k) / f64::from(pieces));
            let [from, to] = [place(piece), place(piece + 1)];
            if to <= 0.0 || from >= last {
                continue;
            }
            let width = |k: i32| style.width * (0.15 + 0.85 * f64::from(k) / f64::from(pieces));
            let ends = [camera.spot(at(from)), camera.spot(at(to))];
            canvas.line(ends, [width(piece), width(piece + 1)], &paint);
        }
    }
}
