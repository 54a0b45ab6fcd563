//! Figure 2: every operator on two fields that overlap, evaluated by the reference.

use std::path::Path;

use rapier3d_fields::field::Query;
use rapier3d_fields::math::DVec3;
use rapier3d_fields::prelude::*;
use rapier3d_fields::reference::Reference;
use rapier3d_fields_lab::AnyError;
use rapier3d_fields_lab::drawing::arrows::{FAINT, INK, Panel, document, text};

const EXTENT: f64 = 2.6;
const HALF: f64 = 118.0;
/// Half the height of a panel.
const HEIGHT: f64 = 76.0;
const GAP: f64 = 22.0;
const HEADING: f64 = 76.0;
const CAPTION: f64 = 26.0;
const COLUMNS: usize = 5;
/// The two regions: balls about these points.
const MIDDLES: [DVec3; 2] = [DVec3::new(-0.7, 0.0, 0.0), DVec3::new(0.7, 0.0, 0.0)];
const RADIUS: f64 = 1.6;

/// The two operands: along x in one ball, and away from the middle of another one, stronger farther out.
fn operands() -> [Field; 2] {
    let [one, two] = MIDDLES.map(|it| Vector::X * it.x as f32);
    let ball = || Region::ball(RADIUS as f32);
    let across = Field::uniform(Vector::X).within(ball()).at(one);
    let outward = Field::radial(1.0, 1.0).within(ball()).at(two);
    [across, outward]
}

/// Draws the two fields, and under them each operator on both.
pub fn draw(path: &Path) -> Result<(), AnyError> {
    let [one, two] = operands();
    let mut panels: Vec<(String, Tree)> = vec![
        ("U".into(), one.clone().into()),
        ("V".into(), two.clone().into()),
    ];
    for operator in Operator::ALL {
        let operands = [one.clone(), two.clone()].map(Tree::from);
        let said = match operator.symbol() {
            symbol if symbol.is_ascii() => format!("{symbol} of U and V"),
            symbol => format!("U {symbol} V"),
        };
        panels.push((said, Tree::fold(operator, operands)));
    }
    let mut svg = String::new();
    let subtitle =
        "the operators on two fields; rings and crosses point out of the page and into it";
    text(&mut svg, [GAP, 34.0], 21.0, INK, "Figure 2");
    text(&mut svg, [GAP, 58.0], 14.5, FAINT, subtitle);
    let cell = [2.0 * HALF + GAP, 2.0 * HEIGHT + CAPTION + GAP];
    for (number, (caption, tree)) in panels.iter().enumerate() {
        let [column, row] = [number % COLUMNS, number / COLUMNS];
        let corner = [
            GAP + column as f64 * cell[0],
            HEADING + row as f64 * cell[1],
        ];
        text(&mut svg, [corner[0], corner[1] + 16.0], 15.0, INK, caption);
        let panel = Panel {
            middle: DVec3::ZERO,
            across: DVec3::X,
            up: DVec3::Y,
            extent: EXTENT,
            page_middle: [corner[0] + HALF, corner[1] + CAPTION + HEIGHT],
            page_extent: HALF,
            pivot: 0.5,
        };
        draw_panel(&mut svg, &panel, tree)?;
    }
    let rows = panels.len().div_ceil(COLUMNS);
    let size = [
        GAP + COLUMNS as f64 * cell[0],
        HEADING + rows as f64 * cell[1],
    ];
    std::fs::write(path, document(size[0], size[1], &svg))?;
    println!("every operator: {}\n", path.display());
    Ok(())
}

/// The arrows of a tree, and the outlines of both regions.
fn draw_panel(svg: &mut String, panel: &Panel, tree: &Tree) -> Result<(), AnyError> {
    for middle in MIDDLES {
        let style = "fill=\"#eef2f8\" fill-opacity=\".6\" stroke=\"#b9c4d6\" stroke-width=\"1\"";
        panel.circle(svg, middle, RADIUS, style);
    }
    let world = PhysicsWorld::new();
    let reference = Reference::new(tree)?;
    let frames = WorldRef::from(&world);
    let arrows = panel.sample(15, |world_point| {
        let query = Query {
            world_point,
            ..Query::default()
        };
        reference.force(&frames, &query)
    });
    panel.draw_arrows(svg, &arrows, 13.0, Some(RADIUS));
    Ok(())
}
