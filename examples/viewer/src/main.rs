//! Shows scene files of force fields in the window of Rapier's testbed, or draws a picture of one without a window.
//!
//! `cargo run --release` shows all scenes of this project; `cargo run --release -- my_scene.json` shows yours, and reads
//! it anew whenever the file changes.

mod catalogue;
mod drawing;
mod panel;
mod picture;
mod session;
mod walls;
mod window;

use std::path::PathBuf;

use clap::Parser;

use catalogue::Catalogue;
use drawing::Part;

/// Shows scene files of force fields in a window.
#[derive(Parser)]
struct Options {
    /// Scene files; all scenes of this project if none is given.
    scenes: Vec<PathBuf>,
    /// Writes a PNG picture of the first scene instead, without a window.
    #[arg(long)]
    picture: Option<PathBuf>,
    /// Steps before the picture is drawn.
    #[arg(long, default_value_t = 60)]
    steps: usize,
    /// The parts of fields that are drawn at first.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = Part::usual())]
    draw: Vec<Part>,
}

#[kiss3d::main]
async fn main() {
    let options = Options::parse();
    let mode = drawing::mode(&options.draw);
    let result = match Catalogue::new(options.scenes) {
        Ok(catalogue) => match options.picture {
            Some(path) => picture::draw(&catalogue, &path, options.steps, mode).await,
            None => window::show(&catalogue, mode).await,
        },
        Err(error) => Err(error),
    };
    if let Err(error) = result {
        eprintln!("{error}");
        std::process::exit(1);
    }
}
