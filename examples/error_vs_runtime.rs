//! Error against run time: which method gives how much accuracy for its time, on three cases.
//!
//! `cargo run --release --example error_vs_runtime` prints the runs and what follows from them,
//! and writes `out/error_vs_runtime.csv` and `out/error_vs_runtime.svg`. Errors are the same on
//! every machine; times are of this one, on one thread.

use std::error::Error;

use indicatif::ProgressBar;
use plotters::prelude::*;
use rapier3d_fields_lab::single::study::{
    Case, Dimer, Effort, Impacts, Method, Metric, PRECISION, Run, Spring, compare, to_csv, to_table,
};

const DIMER: &str = include_str!("../tests/data/c_trajectories/dimer_bound.csv");
const SPHERES: &str = include_str!("../tests/data/f_collisions/spheres.csv");

/// Sample 10 is at 0.4 ps, when an error made at the start has grown by 3.7.
const SAMPLE: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let (dimer, impacts) = (Dimer::from_csv(DIMER, SAMPLE)?, Impacts::from_csv(SPHERES)?);
    let cases: [&dyn Case; 3] = [&Spring, &dimer, &impacts];
    // What to compare by, and at which error: 1 % of the amplitude, 0.01 Å, 1 % and 10 % of the
    // largest speed.
    let views = [
        (cases[0], Metric::FinalState, 0.01),
        (cases[1], Metric::AtomPosition, 0.01),
        (cases[2], Metric::Velocity, 0.01),
        (cases[2], Metric::Velocity95, 0.1),
    ];

    let count = |case: &&dyn Case| case.methods().len() * case.time_steps().len();
    let progress = ProgressBar::new(cases.iter().map(count).sum::<usize>() as u64);
    let mut runs = Vec::new();
    for case in cases {
        for method in case.methods() {
            for dt in case.time_steps() {
                runs.push(case.run(*method, dt, Effort::default())?);
                progress.inc(1);
            }
        }
    }
    progress.finish_and_clear();

    println!("{}", to_table(&runs));
    for (case, metric, target) in views {
        println!("{}", compare(&runs, case.name(), metric, target));
    }
    std::fs::create_dir_all("out")?;
    std::fs::write("out/error_vs_runtime.csv", to_csv(&runs))?;
    draw("out/error_vs_runtime.svg", &views, &runs)?;
    println!("\nWrote out/error_vs_runtime.csv and out/error_vs_runtime.svg.");
    Ok(())
}

type View<'a> = (&'a dyn Case, Metric, f64);

/// One panel per case and metric, one curve per method, one point per time step.
fn draw(path: &str, views: &[View<'_>], runs: &[Run]) -> Result<(), Box<dyn Error>> {
    let area = SVGBackend::new(path, (1240, 1000)).into_drawing_area();
    area.fill(&WHITE)?;
    let title = format!(
        "Error against run time in f{PRECISION}. Lower left is better. From point to point, upwards, the \
         time step is halved."
    );
    let area = area.titled(&title, ("sans-serif", 20))?;
    for (panel, (case, metric, _)) in area.split_evenly((2, 2)).iter().zip(views) {
        let runs = runs.iter().filter(|run| run.case == case.name());
        let runs: Vec<&Run> = runs.filter(|run| !run.diverged()).collect();
        draw_view(panel, *case, *metric, &runs)?;
    }
    area.present()?;
    Ok(())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw_view(
    area: &Area<'_>,
    case: &dyn Case,
    metric: Metric,
    runs: &[&Run],
) -> Result<(), Box<dyn Error>> {
    let point = |run: &Run| Some((run.error(metric)?.log10(), run.cost().log10()));
    let points: Vec<(f64, f64)> = runs.iter().filter_map(|run| point(run)).collect();
    let range = |of: fn(&(f64, f64)) -> f64, above: f64| {
        let low = points.iter().map(of).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        low.floor()..high + above
    };
    // The legend has its place above the curves.
    let mut chart = ChartBuilder::on(area)
        .caption(
            format!("{}, {}", case.name(), metric.name()),
            ("sans-serif", 20),
        )
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(range(|p| p.0, 0.1), range(|p| p.1, 1.0))?;
    let power = |exponent: &f64| format!("{:.0e}", 10_f64.powf(*exponent));
    chart
        .configure_mesh()
        .x_desc("error")
        .y_desc(format!("µs per simulated {}", case.time_unit()))
        .x_labels(8)
        .y_labels(6)
        .max_light_lines(0)
        .x_label_formatter(&power)
        .y_label_formatter(&power)
        .label_style(("sans-serif", 15))
        .axis_desc_style(("sans-serif", 16))
        .draw()?;
    for method in case.methods() {
        let color = color(*method);
        let curve = runs.iter().filter(|run| run.method == *method);
        let curve: Vec<(f64, f64)> = curve.filter_map(|run| point(run)).collect();
        let dots = curve.iter().map(|at| Circle::new(*at, 4, color.filled()));
        chart.draw_series(dots)?;
        chart
            .draw_series(LineSeries::new(curve, color.stroke_width(2)))?
            .label(method.name())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(3)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE)
        .border_style(RGBColor(190, 190, 190))
        .label_font(("sans-serif", 15))
        .draw()?;
    Ok(())
}

/// Distinct to the colour-blind too (Okabe and Ito, 2008).
fn color(method: Method) -> RGBColor {
    match method {
        Method::KickDriftKick | Method::ImpulseLaw => RGBColor(0, 114, 178),
        Method::Kick | Method::PaperLaw => RGBColor(230, 159, 0),
        Method::ExternalForce => RGBColor(204, 121, 167),
        _ => RGBColor(213, 94, 0),
    }
}
