//! The paper's two simulations at scale (§4): the number of spheres, and of molecules that spin, of which a step takes
//! no longer than a frame of 1/60 s. The paper's program managed about twenty and ten.
//!
//! Each row is measured step by step beside a copy of the world that Rapier steps alone, with its own restitution. A
//! last run of each row compares the contacts of the fields with Rapier's.
//!
//! ```text
//! cargo run --release --example real_time
//! cargo run --release --example real_time -- --detection swept
//! ```

use std::process::ExitCode;
use std::str::FromStr;
use std::time::{Duration, Instant};

use rapier3d_fields::Detection;
use rapier3d_fields::cross_check::CrossCheckReport;
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::ammonia::AmmoniaSettings;
use rapier3d_fields_lab::single::scenes::spheres::SpheresSettings;
use rapier3d_fields_lab::single::watch::cross_check_passed;

#[path = "support/mod.rs"]
mod support;

use support::args::Args;
use support::{AnyError, exit, progress_bar};

const USAGE: &str = "\
usage: real_time [--most N] [--detection discrete|swept]
  --most       bodies in the largest world that is compared with Rapier (20000 spheres, half as
               many molecules); larger ones are measured until a step takes longer than a frame
  --detection  discrete, at the end of each step, or swept along the way (discrete)";

/// Bodies in the largest world.
const LARGEST: usize = 100_000;
const FRAME: Duration = Duration::from_nanos(1_000_000_000 / 60);
/// Steps of a row: at least the first number, and more, up to the second number, until `TIME` is over.
const STEPS: [usize; 2] = [20, 300];
const TIME: Duration = Duration::from_millis(1500);
/// Steps that are compared with Rapier: at least `CHECKED`, and more in worlds of few bodies, which seldom touch.
const CHECKED: usize = 300;
const CHECKED_IN_ALL: usize = 40_000;

/// How the contacts are detected.
#[derive(Clone, Copy)]
struct When(Detection);

impl FromStr for When {
    type Err = &'static str;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        match word {
            "discrete" => Ok(When(Detection::Discrete)),
            "swept" => Ok(When(Detection::Swept)),
            _ => Err("must be `discrete` or `swept`"),
        }
    }
}

/// The bodies and fields of a simulation.
#[derive(Clone, Copy)]
enum Kind {
    /// The first simulation: equal spheres that collide.
    Spheres,
    /// Molecules of four atoms that collide and spin.
    Molecules,
    /// The second simulation: the same with an electric field around each atom, and Lennard-Jones fields.
    Charged,
}

/// A world and the fields in it.
struct Scene {
    world: PhysicsWorld,
    fields: Fields,
}

/// A row of the table: the median times of a step.
struct Row {
    count: usize,
    fields: Duration,
    rapier: Duration,
}

fn main() -> ExitCode {
    exit(run())
}

fn run() -> Result<(), AnyError> {
    let args = Args::read(USAGE, &["most", "detection"])?;
    let most = args.get("most", 20_000)?;
    let When(detection) = args.get("detection", When(Detection::Discrete))?;
    println!(
        "a frame is {:.1} ms; times are medians of steps",
        milliseconds(FRAME)
    );
    for (kind, first, most) in [
        (Kind::Spheres, 20, most),
        (Kind::Molecules, 10, most / 2),
        (Kind::Charged, 10, most / 2),
    ] {
        kind.measure_all(first, most, detection)?;
    }
    Ok(())
}

impl Kind {
    fn title(self) -> &'static str {
        match self {
            Kind::Spheres => "spheres that collide",
            Kind::Molecules => "molecules that collide and spin",
            Kind::Charged => "molecules with electric and Lennard-Jones fields",
        }
    }

    /// A closed box of the same density for every count.
    fn build(self, count: usize, detection: Detection, check: bool) -> Result<Scene, AnyError> {
        let settings = |tree: Tree| {
            Fields::builder(tree)
                .detection(detection)
                .cross_check(check)
        };
        let law = ContactLaw::elastic();
        if matches!(self, Kind::Spheres) {
            let twenty = SpheresSettings::default();
            let growth = (count as Real / twenty.count as Real).cbrt();
            let half_extent = twenty.half_extent * growth;
            let scene = SpheresSettings {
                count,
                half_extent,
                ..twenty
            }
            .build()?;
            let fields = settings(scene.tree(law)).build()?;
            return Ok(Scene {
                world: scene.world,
                fields,
            });
        }
        let scene = AmmoniaSettings {
            count,
            ..AmmoniaSettings::default()
        }
        .build()?;
        let fields = match self {
            Kind::Charged => scene.fields(settings(scene.tree(Some(10.0), law)))?,
            _ => {
                let parts = scene.molecules.iter().flat_map(|it| it.sites);
                let parts = parts.chain(scene.walls);
                settings(Tree::instances(Field::contact(law), parts)).build()?
            }
        };
        Ok(Scene {
            world: scene.world,
            fields,
        })
    }

    fn measure_all(self, first: usize, most: usize, detection: Detection) -> Result<(), AnyError> {
        println!("\n{}", self.title());
        println!(
            "{:>8} {:>12} {:>12} {:>8}  cross-check",
            "bodies", "fields", "Rapier", "ratio"
        );
        let mut rows = Vec::new();
        for count in counts(first, most) {
            let row = self.measure(count, detection)?;
            row.print();
            let check = self.check(count, detection)?;
            println!(
                "{} agree, {} do not",
                check.total.both + check.touches.agreed,
                check.disagreed()
            );
            cross_check_passed(&check)?;
            rows.push(row);
        }
        // Larger worlds, until a step takes longer than a frame both with fields and without.
        let last = |rows: &[Row]| {
            rows.last()
                .map(|row| (row.count, row.fields.min(row.rapier)))
        };
        while let Some((count, _)) =
            last(&rows).filter(|(count, time)| *time <= FRAME && *count < LARGEST)
        {
            let row = self.measure(2 * count, detection)?;
            row.print();
            println!("not compared");
            rows.push(row);
        }
        println!(
            "  in real time with fields: {}",
            largest(&rows, |row| row.fields)
        );
        println!(
            "  in real time with Rapier alone: {}",
            largest(&rows, |row| row.rapier)
        );
        Ok(())
    }

    fn measure(self, count: usize, detection: Detection) -> Result<Row, AnyError> {
        let Scene {
            mut world,
            mut fields,
        } = self.build(count, detection, false)?;
        let mut twin = self.build(count, detection, false)?.world;
        let bar = progress_bar(STEPS[1]).with_message(format!("{count} {}", self.title()));
        let (begin, mut times) = (Instant::now(), [Vec::new(), Vec::new()]);
        while times[0].len() < STEPS[0] || (begin.elapsed() < TIME && times[0].len() < STEPS[1]) {
            let start = Instant::now();
            fields.step(&mut world)?;
            let middle = Instant::now();
            twin.step();
            times[0].push(middle - start);
            times[1].push(middle.elapsed());
            bar.inc(1);
        }
        bar.finish_and_clear();
        let [fields, rapier] = times.map(median);
        Ok(Row {
            count,
            fields,
            rapier,
        })
    }

    fn check(self, count: usize, detection: Detection) -> Result<CrossCheckReport, AnyError> {
        let Scene {
            mut world,
            mut fields,
        } = self.build(count, detection, true)?;
        for _ in 0..CHECKED.max(CHECKED_IN_ALL / count) {
            fields.step(&mut world)?;
        }
        let report = fields.cross_check().ok_or("the cross-check is off")?;
        Ok(report.clone())
    }
}

impl Row {
    /// Prints the row up to the verdict of the cross-check.
    fn print(&self) {
        let Row {
            count,
            fields,
            rapier,
        } = self;
        let ratio = fields.as_secs_f64() / rapier.as_secs_f64();
        let [fields, rapier] = [fields, rapier].map(|it| milliseconds(*it));
        print!("{count:>8} {fields:>9.3} ms {rapier:>9.3} ms {ratio:>8.2}  ");
    }
}

/// The counts of the rows: each is ten times the one before.
fn counts(first: usize, most: usize) -> impl Iterator<Item = usize> {
    let counts = std::iter::successors(Some(first), |count| Some(count * 10));
    counts.take_while(move |count| *count <= most)
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

fn milliseconds(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

/// The count of bodies whose step takes a frame, interpolated linearly in logarithms between the two rows around it.
fn largest(rows: &[Row], time: impl Fn(&Row) -> Duration) -> String {
    let over = rows.iter().position(|row| time(row) > FRAME);
    let Some(above) = over else {
        return rows
            .last()
            .map_or("none".into(), |row| format!("{} and more", row.count));
    };
    let Some(below) = above.checked_sub(1).map(|below| &rows[below]) else {
        return format!("fewer than {}", rows[above].count);
    };
    let above = &rows[above];
    let log = |time: Duration| time.as_secs_f64().ln();
    let share = (log(FRAME) - log(time(below))) / (log(time(above)) - log(time(below)));
    let count = below.count as f64 * (above.count as f64 / below.count as f64).powf(share);
    format!("about {:.0}", count)
}
