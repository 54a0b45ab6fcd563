//! Runs a scene file, and writes trajectories, the wrenches of the fields, and contacts. The crate's
//! documentation describes scene files.
//!
//! ```text
//! cargo run --release -p rapier3d-fields-scene -- examples/scenes/planet.json \
//!     --steps 600 --every 10 --trajectory out/planet.csv --html out/planet.html
//! ```
//!
//! The page replays the run in a browser.

fn main() -> std::process::ExitCode {
    rapier3d_fields_scene::program::main()
}
