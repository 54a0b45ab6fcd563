//! Runs a scene file, and writes the trajectories of its bodies, the wrenches of the fields and the contacts. The crate
//! `rapier3d_fields_scene`, of which this is the program, describes scene files.
//!
//! ```text
//! cargo run --release --example simulate -- examples/scenes/planet.json \
//!     --steps 600 --every 10 --trajectory out/planet.csv --html out/planet.html
//! ```
//!
//! The page replays the run in a browser.

fn main() -> std::process::ExitCode {
    rapier3d_fields_scene::program::main()
}
