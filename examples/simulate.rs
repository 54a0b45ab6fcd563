//! Runs a scene file, and writes where its bodies go, what the fields do to them, and who touches
//! whom. What a scene file holds is described at `rapier3d_fields_scene`, which this is the program
//! of.
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
