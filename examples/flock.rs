//! A flock in a gust (§1 of the paper): birds avoid one another, hold together and follow a path,
//! until a strong wind on one side drives them into each other. Detection fields answer the
//! collisions, and the flock forms again.
//!
//! ```text
//! cargo run --release --example flock
//! cargo run --release --example flock -- --gust 0
//! ```

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use rapier3d_fields::math::{DVec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::flock::{Flock, FlockSettings, RADIUS};

#[path = "support/mod.rs"]
mod support;

use rapier3d_fields_lab::drawing::arrows::{FAINT, INK, Panel, document, text};
use support::args::Args;
use support::{AnyError, exit, make_folder_of, progress_bar};

const USAGE: &str = "\
usage: flock [--birds N] [--gust SPEED] [--steps N] [--seed N] [--picture FILE]
  --birds    how many (40)
  --gust     speed of the gust; 0 for none (25)
  --steps    to simulate, of 1/120 each (2400)
  --seed     of the places (1)
  --picture  where to write the picture (out/flock.svg)";

const WIDTH: f64 = 1180.0;
const MARGIN: f64 = 28.0;
/// The distance from the path to the edges of the view from above.
const ASIDE: f64 = 7.5;
const RED: &str = "#d2303f";

/// The record of a run.
#[derive(Default)]
struct Record {
    times: Vec<f64>,
    gaps: Vec<f64>,
    spreads: Vec<f64>,
    /// The number of pairs that began to touch in each step.
    collisions: Vec<usize>,
    /// The pairs that touched in the last step.
    touching: Vec<[ColliderHandle; 2]>,
    lines: Vec<Vec<DVec3>>,
    /// Where birds touched.
    touches: Vec<DVec3>,
}

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["birds", "gust", "steps", "seed", "picture"])?;
    let defaults = FlockSettings::default();
    let settings = FlockSettings {
        count: args.get("birds", defaults.count)?,
        gust: args.get("gust", defaults.gust)?,
        seed: args.get("seed", defaults.seed)?,
        ..defaults
    };
    let steps = args.steps(2400)?;
    let path = args.get("picture", "out/flock.svg".to_owned())?;

    let mut flock = settings.build()?;
    let mut fields = Fields::new(flock.tree.clone())?;
    println!("{}", fields.plan());
    let mut record = Record::default();
    record.lines.resize(flock.birds.len(), Vec::new());
    let bar = progress_bar(steps);
    for _ in 0..steps {
        fields.step(&mut flock.world)?;
        record.step(&flock, &fields);
        bar.inc(1);
    }
    bar.finish_and_clear();
    record.report(&settings);
    record.draw(&settings, Path::new(&path))?;
    println!("written        {path}");
    Ok(())
}

impl Record {
    fn step(&mut self, flock: &Flock, fields: &Fields) {
        self.times.push(fields.time());
        self.gaps.push(flock.nearest_gap());
        self.spreads.push(flock.spread());
        let contacts = fields.contacts().iter();
        let pairs: Vec<_> = contacts.map(|contact| contact.colliders).collect();
        let begun = pairs.iter().filter(|pair| !self.touching.contains(pair));
        self.collisions.push(begun.count());
        self.touching = pairs;
        let touches = fields.contacts().iter();
        self.touches
            .extend(touches.map(|contact| to_dvec3(contact.world_point)));
        let lines = self.lines.iter_mut();
        lines
            .zip(flock.places())
            .for_each(|(line, place)| line.push(place));
    }

    fn report(&self, settings: &FlockSettings) {
        let start = to_f64(settings.gust_start);
        let end = start + to_f64(settings.gust_length);
        let phases = [
            ("before", 0.0, start),
            ("in the gust", start, end),
            ("2 s after it", end, end + 2.0),
            ("from then on", end + 2.0, f64::INFINITY),
        ];
        println!("phase          nearest gap  collisions  spread at its end");
        for (name, from, to) in phases {
            let within = |k: &usize| from < self.times[*k] && self.times[*k] <= to;
            let steps: Vec<usize> = (0..self.times.len()).filter(within).collect();
            let Some(last) = steps.last() else {
                continue;
            };
            let gap = steps
                .iter()
                .map(|k| self.gaps[*k])
                .fold(f64::INFINITY, f64::min);
            let collisions: usize = steps.iter().map(|k| self.collisions[*k]).sum();
            println!(
                "{name:<14} {gap:<12.3} {collisions:<11} {:.2}",
                self.spreads[*last]
            );
        }
    }

    fn draw(&self, settings: &FlockSettings, path: &Path) -> Result<(), AnyError> {
        let reach = self
            .lines
            .iter()
            .flatten()
            .map(|place| place.x)
            .fold(1.0, f64::max)
            + 6.0;
        let extent = 0.5 * reach;
        let scale = (0.5 * WIDTH - MARGIN) / extent;
        let top = 84.0;
        let panel = Panel {
            middle: DVec3::X * (extent - 4.5),
            across: DVec3::X,
            up: -DVec3::Z,
            extent,
            page_middle: [WIDTH / 2.0, top + ASIDE * scale],
            page_extent: extent * scale,
            pivot: 0.5,
        };
        let mut svg = String::new();
        text(&mut svg, [MARGIN, 40.0], 21.0, INK, "A flock in a gust");
        let words = "from above, flying to the right; shaded: where and while the wind blows; red: collisions";
        text(&mut svg, [MARGIN, 66.0], 14.5, FAINT, words);
        self.draw_gust(&mut svg, &panel, settings);
        self.draw_birds(&mut svg, &panel);
        let bottom = top + 2.0 * ASIDE * scale;
        self.draw_gaps(&mut svg, &panel, settings, bottom + 40.0);
        make_folder_of(path)?;
        Ok(std::fs::write(path, document(WIDTH, bottom + 190.0, &svg))?)
    }

    /// Shades the windward side, along the way of the flock while the gust blows.
    fn draw_gust(&self, svg: &mut String, panel: &Panel, settings: &FlockSettings) {
        if settings.gust == 0.0 {
            return;
        }
        let from = to_f64(settings.speed * settings.gust_start) - 2.5;
        let to = from + to_f64(settings.speed * settings.gust_length) + 5.0;
        let corners = [(from, 0.0), (to, 0.0), (to, ASIDE), (from, ASIDE)];
        let corners = corners.map(|(x, z)| DVec3::new(x, 0.0, z));
        panel.line(svg, &corners, "fill=\"#dfeafa\"");
    }

    fn draw_birds(&self, svg: &mut String, panel: &Panel) {
        const COLORS: [&str; 4] = ["#2f6ecb", "#1c9169", "#7a5cc0", "#3a97b8"];
        for (number, line) in self.lines.iter().enumerate() {
            let color = COLORS[number % COLORS.len()];
            let line: Vec<DVec3> = line.iter().step_by(8).copied().collect();
            panel.line(
                svg,
                &line,
                &format!("stroke=\"{color}\" stroke-opacity=\".55\""),
            );
            // The birds themselves, every fifth of the way.
            for place in line.iter().step_by((line.len() / 5).max(1)) {
                panel.circle(svg, *place, to_f64(RADIUS), &format!("fill=\"{color}\""));
            }
        }
        for touch in &self.touches {
            panel.circle(svg, *touch, 0.12, &format!("fill=\"{RED}\""));
        }
    }

    /// Draws the nearest gap over time, below the place of the flock at that time.
    fn draw_gaps(&self, svg: &mut String, panel: &Panel, settings: &FlockSettings, top: f64) {
        let greatest = self.gaps.iter().copied().fold(0.1, f64::max);
        let height = 110.0;
        let zero = top + height;
        let place = |time: f64, gap: f64| {
            let [x, _] = panel.page(DVec3::X * time * to_f64(settings.speed));
            [x, zero - height * gap / greatest]
        };
        text(
            svg,
            [MARGIN, top - 12.0],
            14.0,
            INK,
            "least gap between two birds over time",
        );
        let end = self.times.last().copied().unwrap_or(0.0);
        let [[left, _], [right, _]] = [place(0.0, 0.0), place(end, 0.0)];
        let _ = writeln!(
            svg,
            "<path d=\"M{left:.1} {zero}H{right:.1}\" stroke=\"{FAINT}\"/>"
        );
        text(svg, [right + 8.0, zero + 5.0], 13.0, FAINT, "0: they touch");
        let mut path = String::new();
        for (time, gap) in self.times.iter().zip(&self.gaps).step_by(4) {
            let [x, y] = place(*time, *gap);
            let _ = write!(
                path,
                "{}{x:.1} {y:.1}",
                if path.is_empty() { 'M' } else { 'L' }
            );
        }
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" stroke=\"{INK}\" stroke-width=\"1.6\"/>"
        );
    }
}
