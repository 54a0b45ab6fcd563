//! Work-precision diagrams: cost against error, one line per method.
//!
//! Only some methods are shown, the same on every panel, so that lines can be distinguished.

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::AnyError;
use crate::study::{Method, Metric, Report, Run};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

const INK: RGBColor = RGBColor(38, 50, 70);
const FAINT: RGBColor = RGBColor(222, 228, 236);

/// The scenes of the overview.
pub const OVERVIEW: [&str; 4] = ["spring", "Kepler 0.9", "bound dimer", "sphere impacts"];

/// The methods that are drawn, for forces and for contacts, with this crate and without it; near duplicates are left
/// out.
const SHOWN: [Method; 12] = [
    Method::KickDriftKick,
    Method::KickDriftKickOnce,
    Method::Forward4,
    Method::Auto,
    Method::AddForce,
    Method::KicksByHand,
    Method::FieldsDiscrete,
    Method::FieldsSwept,
    Method::PaperLaw,
    Method::Rapier,
    Method::RapierCcd,
    Method::RapierSoftCcd,
];

/// The size of a panel with its legend below.
const PANEL: [u32; 2] = [500, 470];
/// The height of a legend, and of one of its lines.
const LEGEND: u32 = 84;
const LEGEND_LINE: i32 = 24;

/// Draws a panel for each of the `scenes` of a report (all if none is named) in one precision, by the metric of its
/// first view; returns an SVG document. Scenes without runs are left out.
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
        let size = (2 * PANEL[0], PANEL[1] * rows as u32 + 70);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let font = |size: i32| ("sans-serif", size).into_font().color(&INK);
        let title = format!("Error against run time, f{precision}: lower left is better");
        let root = root.titled(&title, font(23))?;
        let words =
            "from point to point the time step is halved; bars: the middle half of the times";
        let root = root.titled(words, font(16))?;
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
    let (area, legend) = area.split_vertically(PANEL[1] - LEGEND);
    // A method without a point gets a remark instead: an error of zero has no logarithm.
    let remark = |method: Method| {
        let own = || runs.iter().filter(|run| run.method == method);
        match own().any(|run| error(run).is_some()) {
            true => "",
            false if own().all(|run| run.diverged()) => ": diverges",
            false => ": exact",
        }
    };
    draw_legend(&legend, runs, remark)?;
    let shown = |run: &&&Run| SHOWN.contains(&run.method) && error(run).is_some();
    let shown: Vec<&Run> = runs.iter().filter(shown).copied().collect();
    let mut points = shown
        .iter()
        .filter_map(|run| Some((error(run)?, height(run.timing.median, run))));
    let Some(first) = points.next() else {
        return Ok(());
    };
    let range = points.fold([first, first], |[low, high], (x, y)| {
        [(low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y))]
    });
    let [low, high] = range;
    let mut chart = ChartBuilder::on(&area)
        .caption(name, ("sans-serif", 20).into_font().color(&INK))
        .margin(12)
        .x_label_area_size(50)
        .y_label_area_size(66)
        .build_cartesian_2d(low.0 - 0.2..high.0 + 0.2, low.1 - 0.2..high.1 + 0.2)?;
    let power = |exponent: &f64| format!("{:.0e}", 10_f64.powf(*exponent));
    let metric_unit = match metric.unit() {
        "1" => String::new(),
        unit => format!(", {unit}"),
    };
    chart
        .configure_mesh()
        .x_desc(format!("error: {}{metric_unit}", metric.name()))
        .y_desc(format!("µs per {unit}"))
        .x_labels(7)
        .y_labels(6)
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT)
        .axis_style(FAINT)
        .x_label_formatter(&power)
        .y_label_formatter(&power)
        .label_style(("sans-serif", 15).into_font().color(&INK))
        .draw()?;
    for method in methods_of(&shown) {
        let own: Vec<&&Run> = shown.iter().filter(|run| run.method == method).collect();
        let color = color(method);
        let at = |run: &&&Run| Some((error(run)?, height(run.timing.median, run)));
        let line: Vec<(f64, f64)> = own.iter().filter_map(at).collect();
        // From the lower to the upper quartile of the times.
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
        chart.draw_series(LineSeries::new(line, color.stroke_width(2)))?;
    }
    Ok(())
}

/// The methods that are drawn, in the order of their legend.
fn methods_of(runs: &[&Run]) -> impl Iterator<Item = Method> {
    let there = |method: &Method| runs.iter().any(|run| run.method == *method);
    SHOWN.into_iter().filter(there)
}

/// Draws the colours, names and remarks of methods, in two columns below their panel.
fn draw_legend(
    area: &Area<'_>,
    runs: &[&Run],
    remark: impl Fn(Method) -> &'static str,
) -> Result<(), AnyError> {
    let font = ("sans-serif", 16).into_font().color(&INK);
    for (number, method) in methods_of(runs).enumerate() {
        let (column, row) = ((number / 3) as i32, (number % 3) as i32);
        let (x, y) = (22 + 266 * column, 4 + LEGEND_LINE * row);
        let middle = y + 8;
        let line = PathElement::new(
            [(x, middle), (x + 22, middle)],
            color(method).stroke_width(3),
        );
        area.draw(&line)?;
        area.draw(&Circle::new((x + 11, middle), 4, color(method).filled()))?;
        let words = method.name().to_owned() + remark(method);
        area.draw(&Text::new(words, (x + 30, y), font.clone()))?;
    }
    Ok(())
}

/// Blue, green and violet for this crate, red and brown for methods without it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_most_six_methods_of_a_kind_are_drawn_including_those_by_hand() {
        for kind in [&Method::FORCES[..], &Method::CONTACTS[..]] {
            let drawn = kind.iter().filter(|it| SHOWN.contains(it));
            let drawn: Vec<_> = drawn.collect();
            assert!(drawn.len() <= 6, "{drawn:?}");
            let colors: Vec<_> = drawn.iter().map(|it| color(**it)).collect();
            let twice = (1..colors.len()).any(|k| colors[..k].contains(&colors[k]));
            assert!(!twice, "{drawn:?} in {colors:?}");
        }
        for by_hand in [Method::AddForce, Method::KicksByHand] {
            assert!(SHOWN.contains(&by_hand), "{by_hand:?}");
        }
    }
}
