//! Error against run time: which method gives how much accuracy for its time, on three cases.
//!
//! `cargo run --release --example error_vs_runtime` prints the runs and what follows from them,
//! and writes `out/error_vs_runtime.csv` and `out/error_vs_runtime.svg`. Errors are the same on
//! every machine; times are of this one, on one thread.

use std::error::Error;

use indicatif::ProgressBar;
use plotters::prelude::*;
use rapier3d_fields::study::{
    Case, Dimer, Effort, Impacts, Method, Run, Spring, compare, to_csv, to_table,
};

const DIMER: &str = include_str!("../tests/data/c_trajectories/dimer_bound.csv");
const SPHERES: &str = include_str!("../tests/data/f_collisions/spheres.csv");

/// Sample 10 is at 0.4 ps, when an error made at the start has grown by 3.7.
const SAMPLE: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let (dimer, impacts) = (Dimer::from_csv(DIMER, SAMPLE)?, Impacts::from_csv(SPHERES)?);
    // The errors at which times are compared: 1 % of the amplitude, 0.01 Å, 1 % of the speed.
    let cases: [(&dyn Case, f64); 3] = [(&Spring, 0.01), (&dimer, 0.01), (&impacts, 0.01)];

    let of_case = |(case, _): &(&dyn Case, f64)| case.methods().len() * case.time_steps().len();
    let progress = ProgressBar::new(cases.iter().map(of_case).sum::<usize>() as u64);
    let mut runs = Vec::new();
    for (case, _) in cases {
        for method in case.methods() {
            for dt in case.time_steps() {
                runs.push(case.run(*method, dt, Effort::default())?);
                progress.inc(1);
            }
        }
    }
    progress.finish_and_clear();

    println!("{}", to_table(&runs));
    for (case, target) in cases {
        println!("{}", compare(&runs, case.name(), case.metric(), target));
    }
    std::fs::create_dir_all("out")?;
    std::fs::write("out/error_vs_runtime.csv", to_csv(&runs))?;
    draw("out/error_vs_runtime.svg", &cases, &runs)?;
    println!("\nWrote out/error_vs_runtime.csv and out/error_vs_runtime.svg.");
    Ok(())
}

/// One panel per case, one curve per method, one point per time step.
fn draw(path: &str, cases: &[(&dyn Case, f64)], runs: &[Run]) -> Result<(), Box<dyn Error>> {
    let area = SVGBackend::new(path, (1560, 620)).into_drawing_area();
    area.fill(&WHITE)?;
    let bits = runs.first().map_or(0, |run| run.precision);
    let title = format!(
        "Error against run time, f{bits}: lower left is better; each point is half the time step \
         of the one above it"
    );
    let area = area.titled(&title, ("sans-serif", 20))?;
    for (panel, (case, _)) in area.split_evenly((1, cases.len())).iter().zip(cases) {
        let runs = runs.iter().filter(|run| run.case == case.name());
        let runs: Vec<&Run> = runs.filter(|run| !run.diverged()).collect();
        draw_case(panel, *case, &runs)?;
    }
    area.present()?;
    Ok(())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw_case(area: &Area<'_>, case: &dyn Case, runs: &[&Run]) -> Result<(), Box<dyn Error>> {
    let point = |run: &Run| Some((run.error(case.metric())?.log10(), run.cost().log10()));
    let points: Vec<(f64, f64)> = runs.iter().filter_map(|run| point(run)).collect();
    let range = |of: fn(&(f64, f64)) -> f64, above: f64| {
        let low = points.iter().map(of).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        low.floor()..high.ceil() + above
    };
    // The legend has its place above the curves.
    let mut chart = ChartBuilder::on(area)
        .caption(case.name(), ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(range(|p| p.0, 0.0), range(|p| p.1, 1.0))?;
    let power = |exponent: &f64| format!("1e{exponent:.0}");
    chart
        .configure_mesh()
        .x_desc(format!("error: {}", case.metric().name()))
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
