//! The command line of the program `simulate`. [`single`](crate::single) or
//! [`double`](crate::double) runs the scene.

use std::error::Error;
use std::fmt::{self, Display};
use std::fs;
use std::process::ExitCode;
use std::str::FromStr;

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// Any error that ends the program.
pub(crate) type AnyError = Box<dyn Error + Send + Sync>;

const USAGE: &str = "\
usage: simulate SCENE.json [--precision f32|f64] [--dt T] [--scheme S] [--detection D]
                [--steps N | --duration T] [--every K] [--strict]
                [--trajectory FILE] [--wrenches FILE] [--contacts FILE]
                [--energies FILE] [--warnings FILE] [--html FILE] [--estimate N]
  --precision   of all numbers (f32)
  --dt          the time step, in place of the file's
  --scheme      how forces become motion, in place of the file's: a name such as kick, or JSON
                such as '{\"substep\": {\"fixed\": 4}}'
  --detection   discrete or swept, in place of the file's
  --steps       how many to simulate (600)
  --duration    how long to simulate, in seconds, to the nearest step
  --every       write trajectory, wrenches and energies after every K-th step (1); contacts and
                warnings of every step
  --estimate    before anything moves, say how far off bodies would be after N steps: by a copy of
                the world in steps of half the length
  --strict      end with an error if there was a warning; if the two sides of the cross-check
                disagree, a run always does
  --trajectory  where bodies are: step, time, body, centre of mass, quaternion from body to world
                axes (w, x, y, z), velocity of the centre of mass, angular velocity in world axes
  --wrenches    of the fields on each body that can move, where it is: force, and torque about the
                centre of mass, in world axes
  --contacts    who touches whom: for each the number of its body and of the collider on it, normal
                from the first to the second, point, depth, and whether the fields found it or
                Rapier (at the same step, both are for the same poses); how fast they approached
                along the normal (for Rapier, when its next step begins), the impulses on the first and on the second by who found it
                (Rapier's along its normals), and who answered the contact
  --energies    of motion, in the scene's gravity, and in the fields that have a potential; their
                sum; and how many terms of the fields have none
  --warnings    of each step, with the body
  --html        write a page that replays the run in a browser: bodies, contacts (in another colour
                where the cross-check finds that the fields and Rapier differ), and the fields as
                arrows; the page is one file and fetches nothing; it has a frame of every K-th step,
                or, if --every is not given, about 300 frames at most, and fewer of many bodies
Bodies are numbered from 0, in the order of the file.";

const VALUES: [&str; 14] = [
    "precision",
    "dt",
    "scheme",
    "detection",
    "steps",
    "duration",
    "every",
    "trajectory",
    "wrenches",
    "contacts",
    "energies",
    "warnings",
    "html",
    "estimate",
];

/// The paths of the tables; a table with an empty path is not written.
pub(crate) struct Paths {
    pub trajectory: String,
    pub wrenches: String,
    pub contacts: String,
    pub energies: String,
    pub warnings: String,
}

/// The options of the command line.
pub(crate) struct Options {
    pub dt: Option<f64>,
    pub scheme: Option<String>,
    pub detection: Option<String>,
    pub steps: usize,
    pub duration: Option<f64>,
    /// The period, in steps, of rows in the tables and of frames of the page, if given.
    pub every: Option<usize>,
    pub strict: bool,
    /// The number of steps over which errors are estimated, if given.
    pub estimate: Option<usize>,
    pub tables: Paths,
    /// The scene file, for the title of the page.
    pub scene: String,
    /// The path of the page; empty for no page.
    pub html: String,
}

/// Runs the program on the arguments of this process.
pub fn main() -> ExitCode {
    match run(std::env::args().skip(1)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(words: impl Iterator<Item = String>) -> Result<(), AnyError> {
    let Some(args) = Args::read(words)? else {
        println!("{USAGE}");
        return Ok(());
    };
    let [name] = &args.files[..] else {
        let count = args.files.len();
        return Err(format!("expected one scene file, found {count}\n{USAGE}").into());
    };
    let options = args.options(name)?;
    let run = match &*args.get("precision")?.unwrap_or_else(|| "f32".to_owned()) {
        "f32" => crate::single::run::run,
        "f64" => crate::double::run::run,
        other => return Err(format!("--precision {other}: expected f32 or f64").into()),
    };
    let text = fs::read_to_string(name).map_err(|error| format!("cannot read {name}: {error}"))?;
    run(&text, &options).map_err(|error| format!("{name}: {error}").into())
}

/// The words of a command line.
struct Args {
    files: Vec<String>,
    values: Vec<(String, String)>,
    strict: bool,
}

impl Args {
    /// `None` if help was asked for.
    fn read(mut words: impl Iterator<Item = String>) -> Result<Option<Self>, AnyError> {
        let mut args = Args {
            files: Vec::new(),
            values: Vec::new(),
            strict: false,
        };
        while let Some(word) = words.next() {
            let Some(name) = word.strip_prefix("--") else {
                if word == "-h" {
                    return Ok(None);
                }
                args.files.push(word);
                continue;
            };
            match name {
                "help" => return Ok(None),
                "strict" => args.strict = true,
                _ if VALUES.contains(&name) => {
                    let value = words.next();
                    let value = value.ok_or_else(|| format!("{word} needs a value\n{USAGE}"))?;
                    args.values.push((name.to_owned(), value));
                }
                _ => return Err(format!("what is `{word}`?\n{USAGE}").into()),
            }
        }
        Ok(Some(args))
    }

    /// The value of an option, the last if it was given twice.
    fn get<T: FromStr<Err: Display>>(&self, name: &str) -> Result<Option<T>, AnyError> {
        let Some((_, value)) = self.values.iter().rfind(|(given, _)| given == name) else {
            return Ok(None);
        };
        let parsed = value.parse().map(Some);
        parsed.map_err(|error| format!("--{name} {value}: {error}").into())
    }

    fn positive(&self, name: &str) -> Result<Option<f64>, AnyError> {
        match self.get::<f64>(name)? {
            Some(value) if !(value > 0.0 && value.is_finite()) => {
                Err(format!("--{name} {value}: expected more than zero").into())
            }
            value => Ok(value),
        }
    }

    fn options(&self, scene: &str) -> Result<Options, AnyError> {
        let path = |name: &str| Ok::<_, AnyError>(self.get(name)?.unwrap_or_default());
        let steps = self.get("steps")?;
        let duration = self.positive("duration")?;
        if steps.is_some() && duration.is_some() {
            return Err("expected --steps or --duration, found both".into());
        }
        let every = self.get("every")?;
        for (name, count) in [("steps", steps), ("every", every)] {
            if count == Some(0) {
                return Err(format!("--{name} 0: expected one or more").into());
            }
        }
        Ok(Options {
            dt: self.positive("dt")?,
            scheme: self.get("scheme")?,
            detection: self.get("detection")?,
            steps: steps.unwrap_or(600),
            duration,
            every,
            strict: self.strict,
            estimate: self.get("estimate")?,
            tables: Paths {
                trajectory: path("trajectory")?,
                wrenches: path("wrenches")?,
                contacts: path("contacts")?,
                energies: path("energies")?,
                warnings: path("warnings")?,
            },
            scene: scene.to_owned(),
            html: path("html")?,
        })
    }
}

/// A bar over `steps` with rate and time to go; invisible when the output is not a terminal.
pub(crate) fn progress_bar(steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64);
    let template = "{bar:40.cyan/blue} {pos}/{len} steps, {rate}, {eta} to go  {msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(
            style.with_key("rate", |state: &ProgressState, out: &mut dyn fmt::Write| {
                // A rate that cannot be written is not worth stopping for.
                let _ = write!(out, "{:.0}/s", state.per_sec());
            }),
        );
    }
    bar
}
