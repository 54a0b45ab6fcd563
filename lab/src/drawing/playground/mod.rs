//! The frames of an animation of the playground: its fields and their effect on bodies, which are bright while they are
//! awake and pale while they sleep.

mod bodies;
mod ground;
mod labels;
mod streams;
mod zones;

use rapier3d_fields::math::{DVec3, Vector, to_dvec3};

use super::apng::Pixel;
use super::png;
use super::space::{Camera, Canvas, Rgb};
use crate::AnyError;
use crate::single::scenes::playground::{Playground, STEPS};
use streams::Streams;

/// Pixels across and down.
pub const PAGE: [usize; 2] = [800, 450];

const SKY: Rgb = [19.0, 27.0, 44.0];
/// Number of steps in which bodies grow at first and shrink at the end.
const GROWTH: f64 = 12.0;
/// The radius of the corners of the page, in pixels.
const CORNER: f64 = 14.0;

/// Draws the level.
pub struct Painter {
    camera: Camera,
    /// The fixed parts, drawn once.
    ground: Canvas,
    streams: Streams,
    labels: Vec<Pixel>,
}

impl Painter {
    /// Draws the fixed parts, and follows the lines of the fields, once for all frames.
    ///
    /// # Errors
    /// The machine has none of the usual fonts.
    pub fn new(level: &Playground) -> Result<Self, AnyError> {
        let target = DVec3::new(0.12, 1.0, 0.0);
        let camera = Camera::new(DVec3::new(-3.0, 14.0, 24.0), target, 22.5, PAGE);
        let mut ground = Canvas::new(PAGE, SKY);
        ground::draw(&mut ground, &camera);
        let words = png::pixels(&labels::svg(&camera), 1.0)?;
        let words = words.ok_or("no font for the labels: install DejaVu Sans")?;
        let labels = words.pixels().iter().map(|it| {
            let it = it.demultiply();
            [it.red(), it.green(), it.blue(), it.alpha()]
        });
        Ok(Self {
            streams: Streams::of(level),
            labels: labels.collect(),
            camera,
            ground,
        })
    }

    /// Draws the level in its present state.
    pub fn frame(&self, level: &Playground) -> Vec<Pixel> {
        let mut canvas = self.ground.clone();
        bodies::draw_shadows(&mut canvas, &self.camera, level);
        bodies::draw(&mut canvas, &self.camera, level);
        zones::draw_water(&mut canvas, &self.camera);
        let share = level.step as f64 / STEPS as f64;
        self.streams.draw(&mut canvas, &self.camera, share);
        zones::draw_blast(&mut canvas, &self.camera, level.step);
        let pixels = canvas.pixels().into_iter().zip(&self.labels);
        let pixels = pixels.enumerate();
        pixels
            .map(|(place, (pixel, label))| finish(place, pixel, *label))
            .collect()
    }
}

/// A pixel with the labels over it, transparent outside the round corners.
fn finish(place: usize, pixel: [u8; 3], [r, g, b, opacity]: Pixel) -> Pixel {
    let share = f64::from(opacity) / 255.0;
    let over = |under: u8, over: u8| {
        let (under, over) = (f64::from(under), f64::from(over));
        (under + share * (over - under)).round() as u8
    };
    let inside = inside_corners(place);
    if inside == 0.0 {
        return [0; 4];
    }
    let [x, y, z] = pixel;
    [
        over(x, r),
        over(y, g),
        over(z, b),
        (255.0 * inside).round() as u8,
    ]
}

/// The share of a pixel that is inside the round corners of the page.
fn inside_corners(place: usize) -> f64 {
    let [x, y] = [place % PAGE[0], place / PAGE[0]];
    let beyond = |at: usize, size: usize| {
        let from_border = (at as f64 + 0.5).min(size as f64 - at as f64 - 0.5);
        (CORNER - from_border).max(0.0)
    };
    let [x, y] = [beyond(x, PAGE[0]), beyond(y, PAGE[1])];
    (CORNER + 0.5 - x.hypot(y)).clamp(0.0, 1.0)
}

/// The share of its size with which a body is drawn: it grows after the step `since`, and shrinks before the animation
/// repeats.
fn size_at(step: usize, since: usize) -> f64 {
    let grown = (step as f64 - since as f64) / GROWTH;
    let left = (STEPS as f64 - step as f64) / GROWTH;
    let share = grown.min(left).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// A corner of a box by the signs of its coordinates.
fn corner(middle: Vector, half_extents: Vector, signs: [f64; 3]) -> DVec3 {
    to_dvec3(middle) + DVec3::from_array(signs) * to_dvec3(half_extents)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_grow_and_shrink_without_a_jump() {
        assert_eq!(size_at(0, 0), 0.0);
        assert_eq!(size_at(STEPS, 0), 0.0);
        assert_eq!(size_at(STEPS / 2, 0), 1.0);
        let sizes = (0..=STEPS).map(|step| size_at(step, 100));
        let sizes: Vec<f64> = sizes.collect();
        assert!(sizes[..=100].iter().all(|it| *it == 0.0));
        let jump = sizes
            .windows(2)
            .map(|it| (it[1] - it[0]).abs())
            .fold(0.0, f64::max);
        assert!(jump < 0.15, "{jump}");
    }

    #[test]
    fn corners_are_transparent_and_sides_are_not() {
        let [width, height] = PAGE;
        assert_eq!(inside_corners(0), 0.0);
        assert_eq!(inside_corners(width * height - 1), 0.0);
        assert_eq!(inside_corners(width / 2), 1.0);
        assert_eq!(inside_corners(height / 2 * width), 1.0);
    }

    #[test]
    fn the_picture_of_the_readme_is_animated_and_small() -> Result<(), AnyError> {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/level.png");
        let file = std::fs::read(path)?;
        assert!(file.len() <= 2_000_000, "{} bytes", file.len());
        let reader = ::png::Decoder::new(std::io::Cursor::new(&file)).read_info()?;
        let info = reader.info();
        assert_eq!([info.width, info.height].map(|it| it as usize), PAGE);
        let moves = info.animation_control.ok_or("it stands still")?;
        assert_eq!(moves.num_plays, 0, "over and over again");
        let frame = info
            .frame_control
            .ok_or("a picture that is no part of it")?;
        let rate = f64::from(frame.delay_den) / f64::from(frame.delay_num);
        assert!(rate >= 24.0, "{rate} pictures a second");
        let seconds = f64::from(moves.num_frames) / rate;
        assert!((6.0..=8.0).contains(&seconds), "{seconds} s");
        Ok(())
    }

    #[test]
    fn a_crate_that_wakes_is_drawn_in_another_colour() -> Result<(), AnyError> {
        let mut level = Playground::new()?;
        level.step = STEPS / 3;
        let Ok(painter) = Painter::new(&level) else {
            println!("no font: nothing drawn");
            return Ok(());
        };
        let asleep = painter.frame(&level);
        let crates: Vec<_> = level.things.iter().map(|it| it.body).collect();
        for body in crates {
            level.world.bodies[body].wake_up(true);
        }
        let awake = painter.frame(&level);
        let changed = asleep.iter().zip(&awake).filter(|(a, b)| a != b).count();
        // Only the two pyramids and two rafts change.
        assert!((3_000..40_000).contains(&changed), "{changed} pixels");
        Ok(())
    }
}
