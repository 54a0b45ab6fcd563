//! Three panels over time: energies, contacts, drift of the energy.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::AnyError;
use super::record::{Record, Sample};

/// The names of the units on the axes, and what an energy is divided by to be in its unit.
pub struct Units {
    pub time: &'static str,
    pub energy: &'static str,
    pub energy_unit: f64,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Points = Vec<(f64, f64)>;

/// A line, or dots where a line of another colour is to be seen between them.
struct Series {
    label: &'static str,
    color: RGBColor,
    dots: bool,
    points: Points,
}

const INK: RGBColor = RGBColor(38, 50, 70);
const FAINT: RGBColor = RGBColor(222, 228, 236);
const BLUE: RGBColor = RGBColor(47, 110, 203);
const ORANGE: RGBColor = RGBColor(226, 125, 40);
const GREEN: RGBColor = RGBColor(28, 145, 105);

/// Draws the panels of a run; returns an SVG document.
pub fn panels(record: &Record, units: &Units, size: (u32, u32)) -> Result<String, AnyError> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let areas = root.split_evenly((3, 1));
        let time = units.time;
        draw(
            &areas[0],
            &format!("Energy, {}", units.energy),
            time,
            &energies(record, units),
        )?;
        let title = format!("Contacts in each {}", interval(record, time));
        draw(&areas[1], &title, time, &contacts(record))?;
        draw(
            &areas[2],
            "Drift of the total energy, ppm of kinetic",
            time,
            &drift(record),
        )?;
        root.present()?;
    }
    Ok(svg)
}

fn energies(record: &Record, units: &Units) -> Vec<Series> {
    let line = |label, color, value: fn(&Sample) -> f64| Series {
        label,
        color,
        dots: false,
        points: record
            .samples
            .iter()
            .map(|sample| (sample.time, value(sample) / units.energy_unit))
            .collect(),
    };
    let mut lines = vec![line("kinetic", ORANGE, |s| s.kinetic)];
    // A scene without potentials has one line to show, not three.
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
            label: "found by the fields",
            color: GREEN,
            dots: false,
            points: fields.collect(),
        },
        Series {
            label: "found by Rapier",
            color: INK,
            dots: true,
            points: rapier.collect(),
        },
    ]
}

fn drift(record: &Record) -> Vec<Series> {
    vec![Series {
        label: "",
        color: INK,
        dots: false,
        points: record
            .drifts()
            .map(|(time, drift)| (time, drift * 1e6))
            .collect(),
    }]
}

fn interval(record: &Record, unit: &str) -> String {
    let end = record.tallies.first().map_or(0.0, |tally| tally.time);
    format!("{end:.2} {unit}")
}

fn draw(area: &Area, title: &str, unit: &str, series: &[Series]) -> Result<(), AnyError> {
    let points = || series.iter().flat_map(|series| &series.points);
    let time = points().fold(0.0, |end: f64, (time, _)| end.max(*time));
    let (low, high) = points().fold((0.0, 0.0), |(low, high): (f64, f64), (_, y)| {
        (low.min(*y), high.max(*y))
    });
    // Something to see even where nothing happened; room for the legend above.
    let margin = (0.08 * (high - low)).max(1e-3);
    let low = if low < 0.0 { low - margin } else { low };
    area.titled(title, ("sans-serif", 19).into_font().color(&INK))?;
    let mut chart = ChartBuilder::on(area)
        .margin_top(30)
        .margin_right(24)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..time, low..high + 3.0 * margin)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT)
        .axis_style(FAINT)
        .y_labels(5)
        .label_style(("sans-serif", 14).into_font().color(&INK))
        .x_desc(format!("time, {unit}"))
        .draw()?;
    for series in series {
        draw_series(&mut chart, series)?;
    }
    if series.len() > 1 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .label_font(("sans-serif", 14).into_font().color(&INK))
            .background_style(WHITE.mix(0.8))
            .draw()?;
    }
    Ok(())
}

type Chart<'a, 'b> = ChartContext<
    'a,
    SVGBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

fn draw_series(chart: &mut Chart, series: &Series) -> Result<(), AnyError> {
    let color = series.color;
    if series.dots {
        let dots = series
            .points
            .iter()
            .map(|p| Circle::new(*p, 2, color.filled()));
        chart
            .draw_series(dots)?
            .label(series.label)
            .legend(move |(x, y)| Circle::new((x + 9, y), 2, color.filled()));
    } else {
        chart
            .draw_series(LineSeries::new(
                series.points.iter().copied(),
                color.stroke_width(2),
            ))?
            .label(series.label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    Ok(())
}
