//! Three panels over time: energies, contacts, drift of the energy.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::AnyError;
use crate::record::{Record, Sample};

/// The names of the units on the axes, and the divisor that converts an energy to its unit.
pub struct Units {
    pub time: &'static str,
    pub energy: &'static str,
    pub energy_unit: f64,
}

/// Space for the labels at the left of a panel, and for title and legend above it.
const LEFT: u32 = 64;
const HEADING: u32 = 40;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Points = Vec<(f64, f64)>;

struct Series {
    label: &'static str,
    color: RGBColor,
    mark: Mark,
    points: Points,
}

#[derive(Clone, Copy)]
enum Mark {
    /// A line of this width.
    Line(u32),
    /// Dots, between which a line below remains visible.
    Dots,
}

const INK: RGBColor = RGBColor(38, 50, 70);
const FAINT: RGBColor = RGBColor(222, 228, 236);
const BLUE: RGBColor = RGBColor(47, 110, 203);
const ORANGE: RGBColor = RGBColor(226, 125, 40);
const GREEN: RGBColor = RGBColor(28, 145, 105);

/// Draws the panels of a run; returns an SVG document.
pub fn panels(record: &Record, units: &Units, size: (u32, u32)) -> Result<String, AnyError> {
    let interval = record.tallies.first().map_or(0.0, |tally| tally.time);
    let panels = [
        (format!("Energy, {}", units.energy), energies(record, units)),
        (
            format!("Contacts in each {interval:.2} {}", units.time),
            contacts(record),
        ),
        (
            "Drift of the total energy, millionths of the initial kinetic energy".to_owned(),
            drift(record),
        ),
    ];
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        for (area, (title, series)) in root.split_evenly((3, 1)).iter().zip(&panels) {
            draw(area, title, units.time, series)?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn energies(record: &Record, units: &Units) -> Vec<Series> {
    let line = |label, color, value: fn(&Sample) -> f64| Series {
        label,
        color,
        mark: Mark::Line(2),
        points: record
            .samples
            .iter()
            .map(|sample| (sample.time, value(sample) / units.energy_unit))
            .collect(),
    };
    let mut lines = vec![line("kinetic", ORANGE, |s| s.kinetic)];
    // Without potentials the total equals the kinetic energy.
    if record.samples.iter().any(|sample| sample.potential != 0.0) {
        lines.push(line("potential", BLUE, |s| s.potential));
        lines.push(line("total", INK, |s| s.kinetic + s.potential));
    }
    lines
}

fn contacts(record: &Record) -> Vec<Series> {
    let tallies = record.tallies.iter();
    let fields = tallies
        .clone()
        .map(|tally| (tally.time, tally.fields as f64));
    let rapier = tallies.map(|tally| (tally.time, tally.rapier as f64));
    vec![
        Series {
            label: "by the fields",
            color: GREEN,
            mark: Mark::Line(2),
            points: fields.collect(),
        },
        Series {
            label: "by Rapier",
            color: INK,
            mark: Mark::Dots,
            points: rapier.collect(),
        },
    ]
}

fn drift(record: &Record) -> Vec<Series> {
    vec![Series {
        label: "",
        color: INK,
        mark: Mark::Line(1),
        points: record
            .drifts()
            .map(|(time, drift)| (time, drift * 1e6))
            .collect(),
    }]
}

fn draw(area: &Area, title: &str, unit: &str, series: &[Series]) -> Result<(), AnyError> {
    let points = || series.iter().flat_map(|series| &series.points);
    let end = points().fold(0.0, |end: f64, (time, _)| end.max(*time));
    let (low, high) = points().fold((0.0, 0.0), |(low, high): (f64, f64), (_, y)| {
        (low.min(*y), high.max(*y))
    });
    // A range that is not empty even if all values are equal.
    let margin = (0.1 * (high - low)).max(0.05);
    let low = if low < 0.0 { low - margin } else { low };
    let mut chart = ChartBuilder::on(area)
        .margin_top(HEADING)
        .margin_right(24)
        .x_label_area_size(38)
        .y_label_area_size(LEFT)
        .build_cartesian_2d(0.0..end, low..high + margin)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT)
        .axis_style(FAINT)
        .y_labels(5)
        .x_label_formatter(&|time| label(*time, 0.01 * end))
        .y_label_formatter(&|y| label(*y, 0.01 * (high - low)))
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .x_desc(format!("time, {unit}"))
        .draw()?;
    for series in series {
        draw_series(&mut chart, series)?;
    }
    draw_heading(area, title, series)
}

/// A number with as many decimals as distinguish it from one that differs by `step`.
fn label(value: f64, step: f64) -> String {
    let decimals = (-step.log10()).clamp(0.0, 6.0) as usize;
    // A tick next to zero would print as -0.0.
    let value = if value.abs() < step { 0.0 } else { value };
    let text = format!("{value:.decimals$}");
    if decimals == 0 {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Draws the title at the left and the legend at the right, above the curves.
fn draw_heading(area: &Area, title: &str, series: &[Series]) -> Result<(), AnyError> {
    let font = |size| ("sans-serif", size).into_font().color(&INK);
    area.draw(&Text::new(title, (LEFT as i32, 10), font(17)))?;
    let mut x = area.dim_in_pixel().0 as i32 - 24;
    for series in series
        .iter()
        .rev()
        .filter(|series| !series.label.is_empty())
    {
        // The average width of such text: the backend cannot measure it.
        x -= 34 + series.label.len() as i32 * 15 / 2;
        area.draw(&Text::new(series.label, (x + 24, 11), font(14)))?;
        match series.mark {
            Mark::Dots => area.draw(&Circle::new((x + 14, 19), 2, series.color.filled()))?,
            Mark::Line(width) => {
                let key = [(x, 19), (x + 18, 19)];
                area.draw(&PathElement::new(key, series.color.stroke_width(width)))?;
            }
        }
    }
    Ok(())
}

type Chart<'a, 'b> = ChartContext<
    'a,
    SVGBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

fn draw_series(chart: &mut Chart, series: &Series) -> Result<(), AnyError> {
    let Series { color, points, .. } = series;
    match series.mark {
        Mark::Dots => {
            chart.draw_series(points.iter().map(|p| Circle::new(*p, 2, color.filled())))?
        }
        Mark::Line(width) => {
            let style = color.stroke_width(width);
            chart.draw_series(LineSeries::new(points.iter().copied(), style))?
        }
    };
    Ok(())
}
