//! Bodies driven towards each other's places, two head-on and four at a crossing. Pure repulsion deadlocks in exact
//! symmetry; with the cross product of the repulsion and the vertical added, every body passes on its right. Measures
//! both, exactly symmetric and perturbed.
//!
//! ```text
//! cargo run --release --example head_on
//! cargo run --release --example head_on -- --seeds 200 --spread 0.1
//! ```

use std::path::Path;
use std::process::ExitCode;

use rapier3d_fields::math::{DVec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::head_on::{Avoidance, HeadOnSettings, Meeting, RADIUS};

#[path = "support/mod.rs"]
mod support;

use rapier3d_fields_lab::drawing::arrows::{FAINT, INK, Panel, document, text};
use support::args::Args;
use support::{AnyError, exit, make_folder_of, progress_bar};

const USAGE: &str = "\
usage: head_on [--seeds N] [--spread LENGTH] [--steps N] [--picture FILE]
  --seeds    perturbed starts of each kind (50)
  --spread   standard deviation of each coordinate of a perturbed start (0.01)
  --steps    of 1/60 after which a meeting counts as a deadlock (1800)
  --picture  where to write the picture (out/head_on.svg)";

const HALF: f64 = 190.0;
const MARGIN: f64 = 28.0;

/// The outcome of one meeting.
struct Outcome {
    /// The time at which all had reached their goals.
    time: Option<f64>,
    /// The least distance between two centres.
    nearest: f64,
    /// One line for each body.
    lines: Vec<Vec<DVec3>>,
}

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["seeds", "spread", "steps", "picture"])?;
    let seeds: u64 = args.get("seeds", 50)?;
    let spread: Real = args.get("spread", 0.01)?;
    let steps = args.steps(1800)?;
    let path = args.get("picture", "out/head_on.svg".to_owned())?;

    let bar = progress_bar(4 * (1 + seeds as usize));
    let mut rows = Vec::new();
    let mut svg = String::new();
    let kinds = [
        (Meeting::Pair, Avoidance::Repulsion),
        (Meeting::Pair, Avoidance::WithCross),
        (Meeting::Crossing, Avoidance::Repulsion),
        (Meeting::Crossing, Avoidance::WithCross),
    ];
    for (number, (meeting, avoidance)) in kinds.into_iter().enumerate() {
        let settings = HeadOnSettings {
            meeting,
            avoidance,
            ..HeadOnSettings::default()
        };
        let exact = meet(&settings, steps)?;
        bar.inc(1);
        let mut perturbed = Vec::new();
        for seed in 1..=seeds {
            perturbed.push(meet(
                &HeadOnSettings {
                    spread,
                    seed,
                    ..settings
                },
                steps,
            )?);
            bar.inc(1);
        }
        draw(&mut svg, number, &settings, &exact);
        rows.push(row(&settings, "exact", std::slice::from_ref(&exact)));
        rows.push(row(&settings, "perturbed", &perturbed));
    }
    bar.finish_and_clear();
    println!(
        "{seeds} perturbed starts of each kind, coordinates by {spread}; touching at {}",
        2.0 * RADIUS
    );
    println!(
        "who       avoidance         start      deadlocks  time to goal: median, longest  least distance"
    );
    rows.into_iter().flatten().for_each(|row| println!("{row}"));
    write(Path::new(&path), &svg)?;
    println!("written   {path}");
    Ok(())
}

fn meet(settings: &HeadOnSettings, steps: usize) -> Result<Outcome, AnyError> {
    let mut scene = settings.build()?;
    let mut fields = Fields::new(scene.tree.clone())?;
    let mut outcome = Outcome {
        time: None,
        nearest: scene.nearest(),
        lines: scene
            .places()
            .into_iter()
            .map(|place| vec![place])
            .collect(),
    };
    for step in 1..=steps {
        fields.step(&mut scene.world)?;
        outcome.nearest = outcome.nearest.min(scene.nearest());
        let is_over = scene.is_over();
        if step % 6 == 0 || is_over {
            let lines = outcome.lines.iter_mut();
            lines
                .zip(scene.places())
                .for_each(|(line, place)| line.push(place));
        }
        if is_over {
            outcome.time = Some(fields.time());
            break;
        }
    }
    Ok(outcome)
}

fn words(settings: &HeadOnSettings) -> (&'static str, &'static str) {
    let who = match settings.meeting {
        Meeting::Pair => "two",
        Meeting::Crossing => "four",
    };
    let how = match settings.avoidance {
        Avoidance::Repulsion => "repulsion",
        Avoidance::WithCross => "with the cross",
    };
    (who, how)
}

/// A line of the table; `None` if there are no outcomes.
fn row(settings: &HeadOnSettings, start: &str, outcomes: &[Outcome]) -> Option<String> {
    let (who, how) = words(settings);
    let nearest = outcomes.iter().map(|o| o.nearest).reduce(f64::min)?;
    let mut times: Vec<f64> = outcomes.iter().filter_map(|o| o.time).collect();
    times.sort_by(f64::total_cmp);
    let stuck = outcomes.len() - times.len();
    let time = match (times.get(times.len() / 2), times.last()) {
        (Some(median), Some(longest)) => format!("{median:.1}, {longest:.1}"),
        _ => "never".to_owned(),
    };
    let stuck = format!("{stuck} of {}", outcomes.len());
    Some(format!(
        "{who:<9} {how:<17} {start:<10} {stuck:<10} {time:<30} {nearest:.2}"
    ))
}

/// The lines of an exactly symmetric meeting, seen from above, bodies drawn where they end.
fn draw(svg: &mut String, number: usize, settings: &HeadOnSettings, outcome: &Outcome) {
    const COLORS: [&str; 4] = ["#2f6ecb", "#e27d28", "#1c9169", "#a2449b"];
    let (column, row) = ((number % 2) as f64, (number / 2) as f64);
    // Two bodies stay close to the line between their goals.
    let height = if settings.meeting == Meeting::Pair {
        80.0
    } else {
        HALF
    };
    let top = 84.0 + row * (2.0 * 80.0 + 60.0);
    let left = MARGIN + column * (2.0 * HALF + MARGIN);
    let panel = Panel {
        middle: DVec3::ZERO,
        across: DVec3::X,
        up: -DVec3::Z,
        extent: to_f64(settings.distance) + 0.6,
        page_middle: [left + HALF, top + 24.0 + height],
        page_extent: HALF,
        pivot: 0.5,
    };
    let (who, how) = words(settings);
    let ends = outcome.time.map_or("deadlock".to_owned(), |time| {
        format!("over after {time:.1}")
    });
    text(
        svg,
        [left, top + 12.0],
        14.0,
        INK,
        &format!("{who}, {how}: {ends}"),
    );
    *svg += &format!(
        "<rect x=\"{left}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"5\" stroke=\"#e3e8ef\" fill=\"#fbfcfe\"/>\n",
        top + 24.0,
        2.0 * HALF,
        2.0 * height
    );
    for (line, color) in outcome.lines.iter().zip(COLORS) {
        panel.line(svg, line, &format!("stroke=\"{color}\" stroke-width=\"2\""));
        let ends = [line.first(), line.last()].into_iter().flatten();
        for (end, style) in ends.zip(["fill=\"#fff\"", "fill-opacity=\".35\""]) {
            let fill = if style.starts_with("fill-") {
                format!("fill=\"{color}\"")
            } else {
                String::new()
            };
            panel.circle(
                svg,
                *end,
                to_f64(RADIUS),
                &format!("stroke=\"{color}\" {fill} {style}"),
            );
        }
    }
}

fn write(path: &Path, content: &str) -> Result<(), AnyError> {
    let mut svg = String::new();
    text(
        &mut svg,
        [MARGIN, 40.0],
        21.0,
        INK,
        "Head-on, exactly symmetric",
    );
    let how = "open: start, filled: end. Left: repulsion alone. Right: plus its cross product with the vertical";
    text(&mut svg, [MARGIN, 64.0], 14.0, FAINT, how);
    svg += content;
    let (width, height) = (
        4.0 * HALF + 3.0 * MARGIN,
        84.0 + 220.0 + 24.0 + 2.0 * HALF + MARGIN,
    );
    make_folder_of(path)?;
    Ok(std::fs::write(path, document(width, height, &svg))?)
}
