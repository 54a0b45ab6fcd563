//! Every formula of the crate in one table of pictures: arrows of the field on a slice, its
//! constructor and its formula. Sampled through the reference, one query for each arrow.
//!
//! ```text
//! cargo run --release --example formulas
//! ```

use std::path::Path;
use std::process::ExitCode;

use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, to_dvec3};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;

mod catalogue;
mod contact;
#[path = "../support/mod.rs"]
mod support;

use catalogue::{Entry, Mark, Slice};
use rapier3d_fields_lab::drawing::arrows::{Arrow, FAINT, INK, Panel, document, legend, text};
use support::args::Args;
use support::{AnyError, exit, make_folder_of};

const USAGE: &str = "\
usage: formulas [--picture FILE]
  --picture  where to write the table (out/formulas.svg)";

const COLUMNS: usize = 4;
/// Half width of a panel's square, and the room from one panel to the next.
const HALF: f64 = 122.0;
const CELL: [f64; 2] = [276.0, 322.0];
const MARGIN: f64 = 28.0;
const HEADING: f64 = 112.0;
/// Room for the name and the formula over a square.
const CAPTION: f64 = 52.0;
const PALE: &str = "#c3ccd8";

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["picture"])?;
    let path = args.get("picture", "out/formulas.svg".to_owned())?;
    let entries = catalogue::entries();
    let panels = entries.len() + 1;
    let mut svg = String::new();
    heading(&mut svg);
    for (number, entry) in entries.iter().enumerate() {
        draw(&mut svg, entry, &entry_panel(number, entry))?;
    }
    contact::draw(&mut svg, &panel(entries.len(), Slice::Upright, 1.6))?;

    let width = 2.0 * MARGIN + CELL[0] * COLUMNS as f64 - (CELL[0] - 2.0 * HALF);
    let height = HEADING + CELL[1] * panels.div_ceil(COLUMNS) as f64 + 8.0;
    let path = Path::new(&path);
    make_folder_of(path)?;
    let picture = document(width, height, &svg);
    std::fs::write(path, &picture)?;
    println!(
        "{panels} formulas, {} kB: {}",
        picture.len() / 1000,
        path.display()
    );
    Ok(())
}

fn heading(svg: &mut String) {
    text(
        svg,
        [MARGIN, 42.0],
        23.0,
        INK,
        "Every formula, on a slice through its field",
    );
    let words =
        "arrows point along the force; length and colour: logarithm of its strength in each panel";
    text(svg, [MARGIN, 68.0], 14.0, FAINT, words);
    let words = "grey: velocity of the sample, where the force depends on it";
    text(svg, [MARGIN, 88.0], 14.0, FAINT, words);
    legend(svg, [MARGIN + 862.0, 42.0]);
}

/// The square of the panel of that number, its caption above it.
fn panel(number: usize, slice: Slice, extent: f64) -> Panel {
    let (column, row) = (number % COLUMNS, number / COLUMNS);
    let (across, up) = slice.axes();
    Panel {
        middle: DVec3::ZERO,
        across,
        up,
        extent,
        page_middle: [
            MARGIN + HALF + CELL[0] * column as f64,
            HEADING + CAPTION + HALF + CELL[1] * row as f64,
        ],
        page_extent: HALF,
        pivot: 0.5,
    }
}

/// Where two arrows share a point, both start there.
fn entry_panel(number: usize, entry: &Entry) -> Panel {
    Panel {
        pivot: if entry.velocity.is_some() { 0.0 } else { 0.5 },
        ..panel(number, entry.slice, entry.extent)
    }
}

/// Name and formula over the square, and its frame.
fn caption(svg: &mut String, panel: &Panel, name: &str, formula: &str) {
    let [x, y] = panel.page_middle;
    let (left, top) = (x - HALF, y - HALF);
    text(svg, [left, top - 32.0], 16.0, INK, name);
    text(svg, [left, top - 11.0], 13.5, "#52627a", formula);
    let side = 2.0 * HALF;
    *svg += &format!(
        "<rect x=\"{left}\" y=\"{top}\" width=\"{side}\" height=\"{side}\" rx=\"5\" stroke=\"#e3e8ef\" fill=\"#fbfcfe\"/>\n"
    );
}

fn draw(svg: &mut String, entry: &Entry, panel: &Panel) -> Result<(), AnyError> {
    caption(svg, panel, entry.name, entry.formula);
    let world = PhysicsWorld::new();
    let frames = WorldRef::from(&world);
    let reference = Reference::new(&entry.tree)?;
    for mark in &entry.marks {
        draw_mark(svg, panel, mark);
    }
    let query = |point| Query {
        world_point: point,
        world_velocity: entry
            .velocity
            .map_or(DVec3::ZERO, |velocity| velocity(point)),
        charge: 1.0,
        radius: entry.radius,
        volume: entry.radius.powi(3) * std::f64::consts::PI * 4.0 / 3.0,
        ..Query::default()
    };
    let (count, share) = if entry.velocity.is_some() {
        (7, 0.5)
    } else {
        (13, 0.86)
    };
    let longest = share * 2.0 * HALF / count as f64;
    if let Some(velocity) = entry.velocity {
        let points = panel.grid(count);
        let arrows: Vec<Arrow> = points
            .map(|point| Arrow {
                point,
                vector: velocity(point),
            })
            .collect();
        panel.draw_pale(svg, &arrows, longest, PALE);
    }
    let arrows = panel.sample(count, |point| reference.force(&frames, &query(point)));
    panel.draw_arrows(svg, &arrows, longest, None);
    Ok(())
}

fn draw_mark(svg: &mut String, panel: &Panel, mark: &Mark) {
    const DASHED: &str = "stroke=\"#9aa7b8\" stroke-dasharray=\"3 4\"";
    const SOLID: &str = "stroke=\"none\" fill=\"#e4e9f1\"";
    match mark {
        Mark::Circle(radius) => panel.circle(svg, DVec3::ZERO, *radius, DASHED),
        Mark::Disc(center, radius) => panel.circle(svg, *center, *radius, SOLID),
        Mark::Line(points) => panel.line(svg, points, DASHED),
        Mark::Area(points) => panel.line(svg, points, SOLID),
    }
}

/// For the panel of the detection field.
fn point(v: Vector) -> DVec3 {
    to_dvec3(v)
}
