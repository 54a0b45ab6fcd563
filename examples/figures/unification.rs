//! The paper's §3.4 as a picture: one tree turns slow bodies away, and lets fast ones collide.

use std::path::Path;

use rapier3d_fields::field::Query;
use rapier3d_fields::math::{DVec3, to_dvec3, to_f64};
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;
use rapier3d_fields_lab::AnyError;
use rapier3d_fields_lab::drawing::arrows::{FAINT, INK, Panel, document, text};
use rapier3d_fields_lab::single::scenes::unification::{
    OBSTACLE, RADIUS, REACH, Unification, UnificationSettings,
};

const HALF: f64 = 290.0;
const MARGIN: f64 = 28.0;
const HEADING: f64 = 88.0;
const STEPS: usize = 240 * 7;
const COLORS: [&str; 4] = ["#2f6ecb", "#c23b64", "#e27d28", "#35b779"];

/// The path of a body.
#[derive(Default)]
struct Way {
    line: Vec<DVec3>,
    /// Where it collided.
    hits: Vec<DVec3>,
}

/// Runs the scene, reports, and draws it.
pub fn draw(path: &Path) -> Result<(), AnyError> {
    let mut scene = UnificationSettings::default().build()?;
    let panel = Panel {
        middle: DVec3::ZERO,
        across: DVec3::X,
        up: DVec3::Y,
        extent: 6.8,
        page_middle: [MARGIN + HALF, HEADING + HALF],
        page_extent: HALF,
        pivot: 0.5,
    };
    let mut svg = String::new();
    let subtitle =
        "a repulsion and, in its place close by, a contact field: who is slow turns back";
    text(
        &mut svg,
        [MARGIN, 40.0],
        21.0,
        INK,
        "§3.4: avoidance and collision",
    );
    text(&mut svg, [MARGIN, 66.0], 14.5, FAINT, subtitle);
    draw_fields(&mut svg, &panel, &scene)?;
    let ways = run(&mut scene)?;
    for (number, (way, color)) in ways.iter().zip(COLORS).enumerate() {
        let line: Vec<DVec3> = way.line.iter().step_by(4).copied().collect();
        let stroke = format!("stroke=\"{color}\" stroke-width=\"2\"");
        panel.line(&mut svg, &line, &stroke);
        let disc = format!("{stroke} fill=\"{color}\" fill-opacity=\".25\"");
        for place in way.line.first().into_iter().chain(&way.hits) {
            panel.circle(&mut svg, *place, to_f64(RADIUS), &disc);
        }
        let lengths = way.line.iter().map(|place| place.length());
        let nearest = lengths.fold(f64::INFINITY, f64::min);
        let hits = way.hits.len();
        println!("body {number}: never nearer than {nearest:.2}, {hits} collisions");
    }
    let size = [2.0 * (HALF + MARGIN), HEADING + 2.0 * HALF + MARGIN];
    std::fs::write(path, document(size[0], size[1], &svg))?;
    println!("avoidance and collision: {}\n", path.display());
    Ok(())
}

/// Draws the borders of both fields, and the force on a body as arrows.
fn draw_fields(svg: &mut String, panel: &Panel, scene: &Unification) -> Result<(), AnyError> {
    for (radius, fill) in [(REACH[0], "#f4f6fa"), (REACH[1], "#fbeee2")] {
        let style = format!("fill=\"{fill}\" stroke=\"#b9c4d6\" stroke-dasharray=\"4 4\"");
        panel.circle(svg, DVec3::ZERO, to_f64(radius), &style);
    }
    let middle = "fill=\"#8b98ab\" stroke=\"none\"";
    panel.circle(svg, DVec3::ZERO, to_f64(OBSTACLE), middle);
    let reference = Reference::new(&scene.tree)?;
    let frames = WorldRef::from(&scene.world);
    let arrows = panel.sample(29, |world_point| {
        let query = Query {
            world_point,
            ..Query::default()
        };
        let force = reference.force(&frames, &query);
        // The contact field is zero where nothing touches.
        force.filter(|force| *force != DVec3::ZERO)
    });
    panel.draw_arrows(svg, &arrows, 15.0, None);
    Ok(())
}

fn run(scene: &mut Unification) -> Result<Vec<Way>, AnyError> {
    let builder = Fields::builder(scene.tree.clone()).detection(Detection::Swept);
    let mut fields = builder.build()?;
    let mut ways: Vec<Way> = scene.bodies.iter().map(|_| Way::default()).collect();
    for _ in 0..STEPS {
        fields.step(&mut scene.world)?;
        for (body, way) in scene.bodies.iter().zip(&mut ways) {
            let here = to_dvec3(scene.world.bodies[*body].translation());
            way.line.push(here);
            let mut contacts = fields.contacts().iter();
            if contacts.any(|it| it.time_of_impact.is_some() && it.bodies.contains(&Some(*body))) {
                way.hits.push(here);
            }
        }
    }
    Ok(ways)
}
