//! Twenty hard spheres in a cube: how many of the first 60 collisions of an exact run each method
//! reproduces in order, and how long it takes.
//!
//! `cargo run --release --example hard_spheres`

#[path = "support/hard_spheres.rs"]
mod hard_spheres;

use std::error::Error;
use std::time::Instant;

use hard_spheres::{Gas, Method, in_order};

fn main() -> Result<(), Box<dyn Error>> {
    println!("gas     method    dt        steps  collisions  in order  µs per run (least of 5)");
    for gas in Gas::references() {
        for method in [Method::Swept, Method::Discrete, Method::Rapier] {
            for halvings in [0, 2, 4, 6, 8, 10] {
                row(&gas, method, 1.0 / 60.0 / f64::from(1 << halvings))?;
            }
        }
    }
    Ok(())
}

fn row(gas: &Gas, method: Method, dt: f64) -> Result<(), Box<dyn Error>> {
    let mut least = f64::INFINITY;
    let mut events = Vec::new();
    for _ in 0..5 {
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
