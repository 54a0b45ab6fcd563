//! Twenty hard spheres in a cube: how many of the first 60 collisions of an exact run each method
//! reproduces in order, and how long it takes.
//!
//! `cargo run --release --example hard_spheres`

use std::process::ExitCode;
use std::time::Instant;

#[path = "support/mod.rs"]
mod support;

use rapier3d_fields_lab::single::scenes::hard_spheres::{Gas, Method, in_order};
use support::args::Args;
use support::{AnyError, exit};

const USAGE: &str = "\
usage: hard_spheres [--halvings N]
  --halvings  how often the longest step, 1/60, is halved at most (4); 10 take minutes";

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let most: u32 = Args::read(USAGE, &["halvings"])?.get("halvings", 4)?;
    println!("gas     method    dt        steps  collisions  in order  µs per run (least of 3)");
    for gas in Gas::references() {
        for method in [Method::Swept, Method::Discrete, Method::Rapier] {
            for halvings in (0..=most.min(20)).step_by(2) {
                row(&gas, method, 1.0 / 60.0 / f64::from(1 << halvings))?;
            }
        }
    }
    Ok(())
}

fn row(gas: &Gas, method: Method, dt: f64) -> Result<(), AnyError> {
    let mut least = f64::INFINITY;
    let mut events = Vec::new();
    for _ in 0..3 {
        let mut run = gas.build(method, dt)?;
        let begin = Instant::now();
        events = run.finish(gas)?;
        least = least.min(begin.elapsed().as_secs_f64() * 1e6);
    }
    let last = gas.events.last().map_or(0.0, |event| event.time);
    println!(
        "{:<7} {:<9} {:<9.2e} {:<6} {:<11} {:<9} {:.0}",
        gas.name,
        format!("{method:?}"),
        dt,
        (last / dt).ceil(),
        events.len(),
        in_order(&events, gas),
        least
    );
    Ok(())
}
