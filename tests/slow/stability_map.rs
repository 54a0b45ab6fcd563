//! A map of every scheme against every kind of scene, at any ratio of step to swing, damped or not: nothing
//! explodes without a warning.

use crate::support::SCHEMES;
use crate::support::stability::{DT, Damping, Fate, Kind, fate};

/// dt·ω, of the fastest swing there is.
const TURNS: [f64; 12] = [
    0.03, 0.1, 0.3, 0.9, 1.5, 1.9, 2.1, 3.0, 10.0, 30.0, 100.0, 1000.0,
];

/// How a run is told of in the map.
fn class(fate: Fate, damping: Damping) -> char {
    let lost = damping == Damping::None && fate.last < 0.9;
    match fate {
        _ if fate.is_silent() => '!',
        _ if fate.refused => 'R',
        Fate {
            exploded: Some(_), ..
        } => 'X',
        Fate { told: Some(_), .. } => 'w',
        _ if fate.most > 1.1 => '~',
        _ if lost => 'd',
        _ => '.',
    }
}

/// A cell: its class, and the most energy.
fn cell(fate: Fate, damping: Damping) -> String {
    let class = class(fate, damping);
    match fate.most {
        most if most < 100.0 => format!("{class}{most:.2}"),
        most => format!("{class}{most:.0e}"),
    }
}

const LEGEND: &str = "\
. stable   ~ drifting, by more than a tenth   d loses more than a tenth, undamped
w warned of, and keeps its energy   X warned of before it exploded   R refused
! exploded with no warning before.   The number is the most energy, as a share of the first.";

/// Prints the map of a kind, and takes note of the rows with cells that explode silently.
fn map(kind: Kind, damping: Damping, silent: &mut Vec<String>) {
    println!("\n{kind:?}, {damping:?}");
    let turns = TURNS.map(|turn| format!("{turn:>9}"));
    println!("{:>28}{}", "", turns.concat());
    for scheme in SCHEMES {
        let name = format!("{scheme:?}").replace("tolerance: ", "");
        print!("{name:>28}");
        let mut failing = Vec::new();
        for turn in TURNS {
            let fate = fate(kind.scene(turn / DT, damping), scheme);
            print!("{:>9}", cell(fate, damping));
            if let Some(step) = fate.exploded.filter(|_| fate.is_silent()) {
                let told = fate.told.map(|step| format!(", told in {step}"));
                let told = told.unwrap_or_default();
                failing.push(format!("{turn} in step {step}{told}"));
            }
        }
        println!();
        if !failing.is_empty() {
            let cells = failing.join("; ");
            silent.push(format!("{kind:?}, {damping:?}, {scheme:?}, dt·ω: {cells}"));
        }
    }
}

#[test]
#[ignore = "a map of ten thousand runs"]
fn nothing_explodes_without_a_warning() {
    println!("{LEGEND}");
    let mut silent = Vec::new();
    for kind in Kind::ALL {
        for damping in Damping::ALL {
            map(kind, damping, &mut silent);
        }
    }
    println!();
    silent.iter().for_each(|cell| println!("silent: {cell}"));
    assert!(silent.is_empty(), "{} rows have silent cells", silent.len());
}
