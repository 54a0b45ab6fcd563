//! Work-precision diagrams: cost against error, one line per method.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::AnyError;
use crate::study::{Method, Metric, Report, Run};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

const INK: RGBColor = RGBColor(38, 50, 70);
const FAINT: RGBColor = RGBColor(222, 228, 236);

/// Scenes that say the most on one picture.
pub const OVERVIEW: [&str; 4] = ["spring", "Kepler 0.9", "bound dimer", "sphere impacts"];

/// Draws a panel for each of some scenes of a report, by the first of its views, in one precision;
/// returns an SVG document. Scenes without runs are left out.
pub fn diagrams(report: &Report, precision: u32, scenes: &[&str]) -> Result<String, AnyError> {
    let shown = report.scenes.iter().filter(|scene| {
        let of_scene = |run: &Run| run.case == scene.name && run.precision == precision;
        let wanted = scenes.is_empty() || scenes.contains(&scene.name.as_str());
        wanted && report.runs.iter().any(of_scene)
    });
    let shown: Vec<_> = shown.collect();
    let rows = shown.len().div_ceil(2).max(1);
    let mut svg = String::new();
    {
        let size = (1240, 430 * rows as u32 + 44);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let title = format!(
            "Error against run time, f{precision}. Lower left is better. Lines: the time step is halved."
        );
        let font = ("sans-serif", 20).into_font().color(&INK);
        let root = root.titled(&title, font)?;
        for (area, scene) in root.split_evenly((rows, 2)).iter().zip(&shown) {
            let of_scene = |run: &&Run| run.case == scene.name && run.precision == precision;
            let runs: Vec<&Run> = report.runs.iter().filter(of_scene).collect();
            panel(
                area,
                (&scene.name, &scene.time_unit),
                scene.views[0].0,
                &runs,
            )?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn panel(
    area: &Area<'_>,
    (name, unit): (&str, &str),
    metric: Metric,
    runs: &[&Run],
) -> Result<(), AnyError> {
    let height = |seconds: f64, run: &Run| (1e6 * seconds / run.simulated).log10();
    let error = |run: &Run| {
        let error = run
            .error(metric)
            .filter(|it| *it > 0.0 && !run.diverged())?;
        Some(error.log10())
    };
    let mut points = runs
        .iter()
        .filter_map(|run| Some((error(run)?, height(run.timing.median, run))));
    let Some(first) = points.next() else {
        return Ok(());
    };
    let range = points.fold([first, first], |[low, high], (x, y)| {
        [(low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y))]
    });
    let [low, high] = range;
    let mut chart = ChartBuilder::on(area)
        .caption(name, ("sans-serif", 18).into_font().color(&INK))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(60)
        // The legend has its place beside the curves.
        .build_cartesian_2d(
            low.0 - 0.2..high.0 + 0.55 * (high.0 - low.0) + 0.4,
            low.1 - 0.2..high.1 + 0.2,
        )?;
    let power = |exponent: &f64| format!("{:.0e}", 10_f64.powf(*exponent));
    let metric_unit = match metric.unit() {
        "1" => String::new(),
        unit => format!(", {unit}"),
    };
    chart
        .configure_mesh()
        .x_desc(format!("error: {}{metric_unit}", metric.name()))
        .y_desc(format!("µs per {unit}"))
        .x_labels(8)
        .y_labels(6)
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT)
        .axis_style(FAINT)
        .x_label_formatter(&power)
        .y_label_formatter(&power)
        .label_style(("sans-serif", 13).into_font().color(&INK))
        .draw()?;
    for method in Method::ALL {
        let own: Vec<&&Run> = runs
            .iter()
            .filter(|run| run.method == method && error(run).is_some())
            .collect();
        if own.is_empty() {
            continue;
        }
        let color = color(method);
        let at = |run: &&&Run| Some((error(run)?, height(run.timing.median, run)));
        let line: Vec<(f64, f64)> = own.iter().filter_map(at).collect();
        // The middle half of the times.
        let bars = own.iter().filter_map(|run| {
            let [low, high] = [run.timing.lower_quartile, run.timing.upper_quartile];
            let x = error(run)?;
            Some(PathElement::new(
                [(x, height(low, run)), (x, height(high, run))],
                color.stroke_width(1),
            ))
        });
        chart.draw_series(bars)?;
        chart.draw_series(line.iter().map(|at| Circle::new(*at, 3, color.filled())))?;
        let width = if method.is_ours() { 2 } else { 1 };
        chart
            .draw_series(LineSeries::new(line, color.stroke_width(width)))?
            .label(method.name())
            .legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 16, y)], color.stroke_width(width + 1))
            });
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE)
        .border_style(FAINT)
        .label_font(("sans-serif", 12).into_font().color(&INK))
        .draw()?;
    Ok(())
}

/// Blue and green for this crate, red and brown without it.
fn color(method: Method) -> RGBColor {
    const OURS: [RGBColor; 9] = [
        RGBColor(31, 119, 208),
        RGBColor(122, 190, 245),
        RGBColor(122, 92, 214),
        RGBColor(18, 165, 184),
        RGBColor(92, 158, 28),
        RGBColor(61, 70, 130),
        RGBColor(160, 91, 181),
        RGBColor(11, 110, 79),
        RGBColor(45, 200, 130),
    ];
    const THEIRS: [RGBColor; 3] = [
        RGBColor(214, 69, 44),
        RGBColor(224, 138, 0),
        RGBColor(141, 85, 40),
    ];
    let alike = Method::ALL
        .into_iter()
        .filter(|it| it.is_ours() == method.is_ours());
    let place = alike.take_while(|it| *it != method).count();
    match method.is_ours() {
        true => OURS[place % OURS.len()],
        false => THEIRS[place % THEIRS.len()],
    }
}
