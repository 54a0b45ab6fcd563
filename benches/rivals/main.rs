//! Fields beside loops by hand that do the same.
//!
//! `cargo bench --bench rivals [-- NAME]`, measured as in `leave_out`. With `--table` only ratios are printed, one a
//! line, each with its target.

#[path = "../paired/mod.rs"]
mod paired;

mod free;
mod molecules;
mod worlds;

use std::path::PathBuf;

use molecules::BOXES;
use paired::{Measured, ROUNDS, Variant, compare, is_chosen, measure};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::study::Machine;

/// A scene, and the ratios that are reported of it.
struct Scene {
    name: &'static str,
    /// Steps in a stretch that is timed.
    stretch: usize,
    variants: fn() -> Vec<Variant>,
    ratios: &'static [Ratio],
}

/// The time of a variant over the time of a rival.
struct Ratio {
    of: &'static str,
    to: &'static str,
    share: Share,
    target: Option<f64>,
}

/// The part of a step that is compared.
#[derive(Clone, Copy)]
enum Share {
    /// The time added to Rapier's step, over the time that the rival adds; over Rapier's step, if that is the rival.
    Added,
    /// The whole step.
    Whole,
}

const ALONE: &str = "Rapier alone";
const KICK: &str = "field, kick";
const KDK: &str = "field, kick-drift-kick";
const DETECTING: &str = "with detection, kick-drift-kick";

const fn added(of: &'static str, to: &'static str, target: Option<f64>) -> Ratio {
    let share = Share::Added;
    Ratio {
        of,
        to,
        share,
        target,
    }
}

const fn whole(of: &'static str, to: &'static str, target: Option<f64>) -> Ratio {
    let share = Share::Whole;
    Ratio {
        of,
        to,
        share,
        target,
    }
}

/// Ratios to loops with as many kicks per step.
const fn kicks(target: Option<f64>) -> [Ratio; 2] {
    [
        added(KICK, "kick by hand", target),
        added(KDK, "two half kicks by hand", target),
    ]
}

const fn both(to: &'static str, target: Option<f64>) -> [Ratio; 2] {
    [added(KICK, to, target), added(KDK, to, target)]
}

const AS_FAST: &[Ratio] = &kicks(Some(1.0));
const NEARLY: &[Ratio] = &kicks(Some(1.5));
const HALF: &[Ratio] = &kicks(Some(0.5));
const BOXES_TURNED: &[Ratio] = &both(ALONE, Some(0.5));
const MOVING: &[Ratio] = &both("Rapier's query by hand", Some(0.33));
const ALL_PAIRS: &[Ratio] = &both("double loop by hand", None);
const LIQUID: &[Ratio] = &[
    added(KICK, "SIMD for ammonia by hand", None),
    added(KDK, "SIMD for ammonia by hand", None),
    added(KDK, "cell list by hand", None),
    whole(KDK, ALONE, Some(2.2)),
    whole(DETECTING, ALONE, None),
];
const GAS: &[Ratio] = &[added(KDK, ALONE, None), added(DETECTING, ALONE, Some(0.5))];

const SCENES: [Scene; 19] = [
    scene(
        "uniform field, 10,000 balls",
        20,
        || free::uniform(10_000),
        AS_FAST,
    ),
    scene(
        "three zones, summed, 10,000 balls",
        20,
        || free::zones(10_000),
        AS_FAST,
    ),
    scene(
        "three zones, replacing, 10,000 balls",
        20,
        || free::replacing_zones(10_000),
        AS_FAST,
    ),
    scene(
        "drag, 10,000 balls",
        10,
        || free::drag(10_000, Vector::ZERO, 0.0),
        NEARLY,
    ),
    scene(
        "quadratic drag, 10,000 balls",
        10,
        || free::drag(10_000, Vector::ZERO, 1e-3),
        NEARLY,
    ),
    scene(
        "wind, 10,000 balls",
        10,
        || free::drag(10_000, Vector::Y * 2.0, 1e-3),
        NEARLY,
    ),
    scene(
        "turbulence as wind, 10,000 balls",
        5,
        || free::turbulence(10_000),
        HALF,
    ),
    scene(
        "1,000 moving zones, 10,000 balls",
        5,
        || free::moving_zones(10_000),
        MOVING,
    ),
    scene(
        "mutual attraction and drag, 2,000 balls",
        3,
        || free::attracted(2_000),
        ALL_PAIRS,
    ),
    scene(
        "point gravity, 10,000 boxes",
        10,
        || free::boxes(10_000),
        BOXES_TURNED,
    ),
    scene(
        "heap of 1,000 boxes in wind and three zones",
        5,
        || worlds::piled(1_000),
        &[whole("field", "force by hand", Some(1.05))],
    ),
    scene(
        "40 mixed shapes in wind, gusts and water",
        50,
        || worlds::mixed(40),
        &[whole("field", ALONE, Some(3.0))],
    ),
    scene(
        "jumble of 60 mixed shapes, contacts by fields",
        50,
        || worlds::jumbled(60),
        &[
            whole("fields, discrete", ALONE, Some(1.3)),
            whole("fields, swept", ALONE, Some(1.6)),
        ],
    ),
    scene(
        "1,000 spheres, contacts by fields",
        20,
        || worlds::spheres(1_000),
        &[
            whole("fields, discrete", ALONE, Some(1.1)),
            whole("fields, swept", ALONE, Some(1.6)),
        ],
    ),
    scene(BOXES[0].name, 5, || BOXES[0].variants(), LIQUID),
    scene(BOXES[1].name, 2, || BOXES[1].variants(), LIQUID),
    scene(BOXES[2].name, 20, || BOXES[2].variants(), GAS),
    scene(BOXES[3].name, 3, || BOXES[3].variants(), GAS),
    scene(BOXES[4].name, 1, || BOXES[4].variants(), GAS),
];

const fn scene(
    name: &'static str,
    stretch: usize,
    variants: fn() -> Vec<Variant>,
    ratios: &'static [Ratio],
) -> Scene {
    Scene {
        name,
        stretch,
        variants,
        ratios,
    }
}

impl Scene {
    /// Prints the lines of the scene in a table of all scenes.
    fn print(&self) {
        let measured = measure(self.stretch, (self.variants)());
        for ratio in self.ratios {
            let found = ratio.line(&measured);
            println!("| {} | {found} |", self.name);
        }
    }
}

impl Ratio {
    fn line(&self, measured: &Measured) -> String {
        let Ratio { of, to, .. } = *self;
        let ([low, median, high], what) = match self.share {
            Share::Added if to == ALONE => (measured.added(of, to), "added ÷ step of Rapier alone"),
            Share::Added => (measured.added(of, to), "added ÷ added by"),
            Share::Whole => (measured.whole(of, to), "step ÷ step of"),
        };
        let rival = if what.ends_with(ALONE) { "" } else { to };
        let target = self.target.map_or("–".to_owned(), |it| format!("≤ {it}"));
        let error = measured.error(of);
        let quartiles = format!("{median:.2} ({low:.2} to {high:.2})");
        let compared = format!("{what} {rival}");
        format!(
            "{of} | {quartiles} | {} | {target} | {error}",
            compared.trim_end()
        )
    }
}

fn print_head() {
    println!(
        "`cargo bench --bench rivals -- --table`: medians and quartiles of {ROUNDS} paired rounds."
    );
    println!(
        "The error is that of forces in the end, by the sum of their terms, at worst of fifty bodies."
    );
    println!("{}.\n", Machine::here().line());
    println!("| scene | fields | ratio | compared | target | error |\n|---|---|---|---|---|---|");
}

fn main() {
    let states = std::env::args().find_map(|it| it.strip_prefix("--states=").map(PathBuf::from));
    if let Some(folder) = states {
        molecules::write_states(&folder);
    }
    let as_table = std::env::args().any(|argument| argument == "--table");
    if as_table {
        print_head();
    }
    for scene in SCENES.iter().filter(|scene| is_chosen(scene.name)) {
        match as_table {
            true => scene.print(),
            false => compare(scene.name, scene.stretch, scene.variants),
        }
    }
}
