//! A level of a game: two moons around a planet, a wind that blows balls into a pool, a magnet that catches iron
//! bodies, and crates that sleep until an explosion wakes them. Prints which bodies fall asleep and wake, and draws an
//! animation if a file is given.
//!
//! ```text
//! cargo run --release --example level
//! cargo run --release --example level -- --picture assets/level.png
//! ```

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use rapier3d_fields_lab::drawing::apng::Film;
use rapier3d_fields_lab::drawing::playground::{PAGE, Painter};
use rapier3d_fields_lab::single::scenes::playground::{
    BLAST_STEP, Kind, Playground, STEPS, STEPS_PER_SECOND,
};

#[path = "support/mod.rs"]
mod support;

use support::args::Args;
use support::{AnyError, exit, make_folder_of, progress_bar};

const USAGE: &str = "\
usage: level [--picture FILE.png]
  --picture  where to write the moving picture; none is written without";

/// Steps from one frame to the next.
const STEPS_PER_FRAME: usize = 2;
/// The film begins at this step, when nothing is flying in; the frames before it come last.
const FIRST_STEP: usize = 64;

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["picture"])?;
    let picture: PathBuf = args.get("picture", PathBuf::new())?;
    let mut level = Playground::new()?;
    println!("{}", level.fields.plan());
    let draws = !picture.as_os_str().is_empty();
    let painter = draws.then(|| Painter::new(&level)).transpose()?;
    let mut frames = Vec::new();
    let mut sleepers = Sleepers::default();
    let bar = progress_bar(STEPS);
    while level.step < STEPS {
        if let Some(painter) = painter
            .as_ref()
            .filter(|_| level.step % STEPS_PER_FRAME == 0)
        {
            frames.push(painter.frame(&level));
        }
        level.step()?;
        bar.suspend(|| sleepers.tell(&level));
        bar.inc(1);
    }
    bar.finish_and_clear();
    if draws {
        frames.rotate_left(FIRST_STEP / STEPS_PER_FRAME);
        write(&picture, frames)?;
    }
    Ok(())
}

/// Whether each body sleeps.
#[derive(Default)]
struct Sleepers(Vec<bool>);

impl Sleepers {
    /// Prints which bodies fell asleep in the last step, and which woke.
    fn tell(&mut self, level: &Playground) {
        let now = level.things.iter();
        let now = now.map(|it| level.world.bodies[it.body].is_sleeping());
        let now: Vec<bool> = now.collect();
        let time = level.step as f64 / STEPS_PER_SECOND as f64;
        if level.step == BLAST_STEP + 1 {
            println!("{time:5.2} s  explosion");
        }
        for (what, wanted) in [("fell asleep", true), ("woken", false)] {
            let changed =
                |k: &usize| now[*k] == wanted && self.0.get(*k).is_some_and(|it| *it != wanted);
            let names: Vec<String> = (0..now.len())
                .filter(changed)
                .map(|k| name(level, k))
                .collect();
            if !names.is_empty() {
                println!("{time:5.2} s  {what}: {}", names.join(", "));
            }
        }
        self.0 = now;
    }
}

/// The kind of a body, and its number within the kind.
fn name(level: &Playground, thing: usize) -> String {
    let kind = level.things[thing].kind;
    let before = level.things[..thing].iter().filter(|it| it.kind == kind);
    let number = before.count() + 1;
    match kind {
        Kind::Moon => format!("moon {number}"),
        Kind::Crate => format!("crate {number}"),
        Kind::Raft => format!("raft {number}"),
        Kind::Ball => format!("ball {number}"),
        Kind::Iron => format!("iron {number}"),
    }
}

fn write(path: &Path, frames: Vec<Vec<[u8; 4]>>) -> Result<(), AnyError> {
    let film = Film {
        size: PAGE,
        frames_per_second: (STEPS_PER_SECOND / STEPS_PER_FRAME) as u16,
        frames,
    };
    let file = film.encode()?;
    make_folder_of(path)?;
    std::fs::write(path, &file)?;
    println!(
        "written  {}: {} frames, {} a second, {} bytes",
        path.display(),
        film.frames.len(),
        film.frames_per_second,
        file.len()
    );
    Ok(())
}
