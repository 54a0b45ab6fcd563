//! Runs as text: a readable table, and a CSV file.

use std::fmt::Write;

use super::{Measured, Method, Metric, Row, Run, StudyError, Table, Timing, fit_order};

/// The columns of [`to_csv`].
const COLUMNS: &str = "case,method,precision,dt,steps,simulated,evaluations,warned,metric,error,\
                       repeats,seconds_median,seconds_min,seconds_q1,seconds_q3";

/// The runs as a table of comma-separated values, one line per run and metric, with numbers that read back exactly.
/// Columns from `repeats` on depend on the machine, the others do not.
pub fn to_csv(runs: &[Run]) -> String {
    let mut text = "# Errors, metric = definition:\n".to_owned();
    for metric in Metric::ALL {
        let measured = |run: &Run| run.error(metric).is_some();
        if runs.iter().any(measured) {
            // Writing to a `String` cannot fail.
            let _ = writeln!(text, "# {} = {}", metric.name(), metric.definition());
        }
    }
    text.push_str(COLUMNS);
    text.push('\n');
    for run in runs {
        for error in &run.errors {
            text.push_str(&csv_line(run, error));
        }
    }
    text
}

fn csv_line(run: &Run, error: &Measured) -> String {
    let timing = &run.timing;
    let cells = [
        run.case.clone(),
        run.method.name().to_owned(),
        run.precision.to_string(),
        format!("{:e}", run.dt),
        run.steps.to_string(),
        format!("{:e}", run.simulated),
        run.evaluations.to_string(),
        run.warned.to_string(),
        error.metric.name().to_owned(),
        format!("{:e}", error.value),
        timing.repeats.to_string(),
        format!("{:e}", timing.median),
        format!("{:e}", timing.min),
        format!("{:e}", timing.lower_quartile),
        format!("{:e}", timing.upper_quartile),
    ];
    cells.join(",") + "\n"
}

/// Reads runs that [`to_csv`] wrote.
///
/// # Errors
/// A column is missing, or a cell cannot be read.
pub fn from_csv(text: &str) -> Result<Vec<Run>, StudyError> {
    let mut runs: Vec<Run> = Vec::new();
    for row in Table::parse(text)?.rows() {
        let (run, error) = read(&row)?;
        match runs.last_mut() {
            Some(last) if same(last, &run) && last.error(error.metric).is_none() => {
                last.errors.push(error);
            }
            _ => runs.push(Run {
                errors: vec![error],
                ..run
            }),
        }
    }
    Ok(runs)
}

/// Whether two lines belong to one run.
fn same(a: &Run, b: &Run) -> bool {
    (&a.case, a.method, a.precision, a.dt) == (&b.case, b.method, b.precision, b.dt)
}

fn read(row: &Row<'_>) -> Result<(Run, Measured), StudyError> {
    let whole = |column: &str| row.read(column, "whole number", |cell| cell.parse().ok());
    let error = Measured {
        metric: row.read("metric", "metric", Metric::named)?,
        value: row.number("error")?,
    };
    let run = Run {
        case: row.text("case")?.to_owned(),
        method: row.read("method", "method", Method::named)?,
        precision: row.read("precision", "whole number", |cell| cell.parse().ok())?,
        dt: row.number("dt")?,
        steps: whole("steps")?,
        simulated: row.number("simulated")?,
        evaluations: whole("evaluations")?,
        warned: whole("warned")?,
        errors: Vec::new(),
        timing: Timing {
            repeats: row.read("repeats", "whole number", |cell| cell.parse().ok())?,
            median: row.number("seconds_median")?,
            min: row.number("seconds_min")?,
            lower_quartile: row.number("seconds_q1")?,
            upper_quartile: row.number("seconds_q3")?,
        },
    };
    Ok((run, error))
}

/// The runs as readable text: for each method of each case the errors and the cost (µs per unit of simulated time) at
/// each time step, and the order of convergence of the first error.
pub fn to_table(runs: &[Run]) -> String {
    let mut text = String::new();
    let of_one =
        |a: &Run, b: &Run| (&a.case, a.method, a.precision) == (&b.case, b.method, b.precision);
    for group in runs.chunk_by(of_one) {
        let first = &group[0];
        let points: Vec<(f64, f64)> = group
            .iter()
            .filter_map(|run| Some((run.dt, run.errors.first()?.value)))
            .collect();
        let order = fit_order(&points).map_or("no order".to_owned(), |fit| {
            let floor = fit.floor.map(|floor| format!(", floor {floor:.0e}"));
            format!("order {:.2}{}", fit.order, floor.unwrap_or_default())
        });
        let (case, method, bits) = (&first.case, first.method.name(), first.precision);
        // Writing to a `String` cannot fail.
        let _ = writeln!(text, "{case}, {method}, f{bits}: {order}");
        let _ = write!(text, "{:>11} {:>8} {:>8}", "dt", "steps", "forces");
        for error in &first.errors {
            let _ = write!(text, " {:>15}", error.metric.name());
        }
        let _ = writeln!(text, " {:>10} {:>9}", "cost, µs", "spread");
        for run in group {
            let _ = write!(
                text,
                "{:>11.4e} {:>8} {:>8}",
                run.dt, run.steps, run.evaluations
            );
            for error in &run.errors {
                let _ = write!(text, " {:>15.2e}", error.value);
            }
            let timing = &run.timing;
            let note = match (run.diverged(), run.warned) {
                (true, 0) => "  diverged",
                (true, _) => "  diverged, warned",
                (false, 0) => "",
                (false, _) => "  warned",
            };
            let _ = writeln!(
                text,
                " {:>10.1} {:>7.1} %{note}",
                run.cost(),
                100.0 * timing.spread()
            );
        }
        text.push('\n');
    }
    text
}
