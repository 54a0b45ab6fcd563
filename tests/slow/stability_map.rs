//! A map of every scheme against every kind of scene, over many ratios of the time step to the period of oscillation,
//! damped or not: no run explodes without a warning. `KIND=Penalty` runs only the kinds whose names begin with it.

use crate::lab::stability::{Damping, Kind, SCHEMES, map};
use rapier3d_fields_lab::study::StabilityCell;

/// A cell as text: its class, and the largest energy.
fn told(cell: &StabilityCell) -> String {
    match cell.most {
        most if most < 100.0 => format!("{}{most:.2}", cell.class),
        most => format!("{}{most:.0e}", cell.class),
    }
}

#[test]
#[ignore = "a map of ten thousand runs"]
fn nothing_explodes_without_a_warning() {
    for (class, meaning) in StabilityCell::LEGEND {
        println!("{class} {meaning}");
    }
    let mut silent = Vec::new();
    let only = std::env::var("KIND").unwrap_or_default();
    let kinds = Kind::ALL.into_iter();
    for kind in kinds.filter(|kind| format!("{kind:?}").starts_with(&only)) {
        for damping in Damping::ALL {
            println!("\n{kind:?}, {damping:?}");
            for scheme in SCHEMES {
                let row = map(kind, damping, scheme);
                let cells = row.iter().map(|cell| format!("{:>9}", told(cell)));
                println!("{:>28}{}", row[0].scheme, cells.collect::<String>());
                silent.extend(row.into_iter().filter(|cell| cell.class == '!'));
            }
        }
    }
    println!();
    silent.iter().for_each(|cell| println!("silent: {cell:?}"));
    assert!(silent.is_empty(), "{} cells are silent", silent.len());
}
