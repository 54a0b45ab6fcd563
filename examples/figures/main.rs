//! The paper's figures. Figure 2: every operator on two fields. Figure 3: an attraction with a
//! repulsion in its place close by (replacement of union), around one fixed body. Figure 4: three
//! bodies that each carry such a field (sum of union of instances), attract one another, and
//! bounce. §3.4: avoidance outside and collision inside, in one tree. Plate 2: two molecules that
//! collide and spin.
//!
//! ```text
//! cargo run --release --example figures
//! ```

use std::path::Path;
use std::process::ExitCode;

use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;
use rapier3d_fields_lab::single::scenes::figures::{Figure, Figure3Settings, Figure4Settings};

mod operators;
mod plate_2;
#[path = "../support/mod.rs"]
mod support;
mod unification;

use rapier3d_fields_lab::drawing::arrows::{FAINT, INK, Panel, document, legend, text};
use support::args::Args;
use support::{AnyError, exit, make_folder_of};

const USAGE: &str = "\
usage: figures [--steps N] [--folder FOLDER]
  --steps   to simulate, of 1/240 each (2400)
  --folder  where to write figure-2, -3, -4, unification and plate-2, all .svg (out)";

const HALF: f64 = 290.0;
const MARGIN: f64 = 28.0;
const HEADING: f64 = 88.0;
const COLORS: [&str; 4] = ["#2f6ecb", "#e27d28", "#c23b64", "#8b98ab"];

/// The path of one body.
struct Track {
    start: DVec3,
    line: Vec<DVec3>,
    radius: f64,
    /// The least distance to another body's centre.
    nearest: f64,
}

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["steps", "folder"])?;
    let steps = args.steps(2400)?;
    let folder = args.get("folder", "out".to_owned())?;
    let folder = Path::new(&folder);

    make_folder_of(&folder.join("figure"))?;
    operators::draw(&folder.join("figure-2.svg"))?;
    unification::draw(&folder.join("unification.svg"))?;
    plate_2::draw(&folder.join("plate-2.svg"))?;

    let figure = Figure3Settings::default().build()?;
    let title = [
        "Figure 3",
        "an attraction and, in its place close by, a repulsion: →∪",
    ];
    show(figure, steps, title, 8.6, &folder.join("figure-3.svg"))?;

    let title = [
        "Figure 4",
        "three bodies with such a field each: the sum of union of instances",
    ];
    show(
        Figure4Settings::default().build()?,
        steps,
        title,
        5.2,
        &folder.join("figure-4.svg"),
    )
}

/// Runs a figure, prints a report, and draws the force on a point at the start and the path of every body.
fn show(
    mut figure: Figure,
    steps: usize,
    [name, subtitle]: [&str; 2],
    extent: f64,
    path: &Path,
) -> Result<(), AnyError> {
    let panel = Panel {
        middle: DVec3::ZERO,
        across: DVec3::X,
        up: DVec3::Y,
        extent,
        page_middle: [MARGIN + HALF, HEADING + HALF],
        page_extent: HALF,
        pivot: 0.5,
    };
    let mut svg = String::new();
    text(&mut svg, [MARGIN, 40.0], 21.0, INK, name);
    text(&mut svg, [MARGIN, 66.0], 14.5, FAINT, subtitle);
    legend(&mut svg, [MARGIN + 2.0 * HALF - 190.0, 40.0]);
    draw_field(&mut svg, &figure, &panel)?;

    let mut fields = Fields::new(figure.tree.clone())?;
    println!("{name}: {subtitle}\n{}", fields.plan());
    let mut tracks = tracks(&figure);
    for _ in 0..steps {
        fields.step(&mut figure.world)?;
        follow(&mut tracks, &figure);
    }
    for (number, track) in tracks.iter().enumerate() {
        let end = track.line.last().copied().unwrap_or(track.start);
        println!(
            "body {number}  radius {:.2}  from {:.2}  to {end:.2}  never nearer than {:.3}",
            track.radius, track.start, track.nearest
        );
    }
    draw_tracks(&mut svg, &panel, &tracks);
    let size = [2.0 * (HALF + MARGIN), HEADING + 2.0 * HALF + MARGIN];
    std::fs::write(path, document(size[0], size[1], &svg))?;
    println!("after {:.1}: {}\n", fields.time(), path.display());
    Ok(())
}

/// Draws the force on a point at the start as arrows, and the bodies that carry the fields.
fn draw_field(svg: &mut String, figure: &Figure, panel: &Panel) -> Result<(), AnyError> {
    for source in &figure.sources {
        let body = &figure.world.bodies[*source];
        let center = to_dvec3(body.translation());
        panel.circle(svg, center, 1.0, "fill=\"#e4e9f1\" stroke=\"none\"");
    }
    let reference = Reference::new(&figure.tree)?;
    let frames = WorldRef::from(&figure.world);
    let arrows = panel.sample(29, |point| {
        let query = Query {
            world_point: point,
            ..Query::default()
        };
        reference.force(&frames, &query)
    });
    // Both fields have constant strength; the scale makes the repulsion stand out.
    let strengths = arrows.iter().map(|arrow| arrow.vector.length());
    let strongest = strengths.fold(0.0, f64::max);
    panel.draw_arrows(svg, &arrows, 16.5, Some(strongest));
    Ok(())
}

fn place(figure: &Figure, body: RigidBodyHandle) -> DVec3 {
    to_dvec3(figure.world.bodies[body].translation())
}

fn tracks(figure: &Figure) -> Vec<Track> {
    let track = |body: &RigidBodyHandle| {
        let start = place(figure, *body);
        let colliders = figure.world.bodies[*body].colliders().iter();
        let mut shapes = colliders.map(|handle| figure.world.colliders[*handle].shape());
        let ball = shapes.find_map(|shape| shape.as_ball());
        Track {
            start,
            line: vec![start],
            radius: ball.map_or(0.0, |ball| to_f64(ball.radius)),
            nearest: f64::INFINITY,
        }
    };
    figure.bodies.iter().map(track).collect()
}

fn follow(tracks: &mut [Track], figure: &Figure) {
    for (track, body) in tracks.iter_mut().zip(&figure.bodies) {
        let here = place(figure, *body);
        track.line.push(here);
        for source in figure.sources.iter().filter(|source| *source != body) {
            track.nearest = track.nearest.min(here.distance(place(figure, *source)));
        }
    }
}

fn draw_tracks(svg: &mut String, panel: &Panel, tracks: &[Track]) {
    for (track, color) in tracks.iter().zip(COLORS) {
        // Every fourth step is smooth enough.
        let line: Vec<DVec3> = track.line.iter().step_by(4).copied().collect();
        panel.line(
            svg,
            &line,
            &format!("stroke=\"{color}\" stroke-width=\"2\""),
        );
        let style =
            format!("stroke=\"{color}\" stroke-width=\"2\" fill=\"{color}\" fill-opacity=\".25\"");
        panel.circle(svg, track.start, track.radius, &style);
        if let Some(end) = line.last() {
            panel.circle(svg, *end, 0.09, &format!("fill=\"{color}\""));
        }
    }
}
