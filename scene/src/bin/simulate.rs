//! Runs a scene file, and writes where its bodies go, what the fields do to them, and who touches
//! whom. What a scene file holds is described at the crate.
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
