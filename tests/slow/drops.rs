//! Bodies of all shapes dropped on all grounds: with contact fields no more are lost than with Rapier alone.
//!
//! `DROPS` bodies of each shape (1,000 by default) are dropped on each ground, in worlds of a hundred that pass through
//! each other. If each of n bodies is lost with a probability p, the number lost scatters by √(n·p): three times that
//! is allowed on each ground, and once that in the sum over all grounds.

use rapier3d_fields::Detection;

use crate::support::drops::*;

const GROUNDS: [Ground; 4] = [
    Ground::Mesh,
    Ground::HeightField,
    Ground::Compound,
    Ground::Voxels,
];
const AT_ONCE: usize = 100;
const BUMPS: [f64; 3] = [0.0, 0.03, 0.15];

fn count() -> usize {
    let count = std::env::var("DROPS").ok();
    count.and_then(|it| it.parse().ok()).unwrap_or(1_000)
}

fn lost(drops: Drops, answer: Answer) -> usize {
    let worlds = count().div_ceil(AT_ONCE);
    let run = |world: usize| {
        let drops = Drops {
            count: AT_ONCE.min(count() - world * AT_ONCE),
            seed: world as u64 + 1,
            ..drops
        };
        drops.run(answer).lost.len()
    };
    (0..worlds).map(run).sum()
}

#[test]
#[ignore = "minutes to hours"]
fn no_more_fall_through_grounds_than_with_rapier_alone() {
    let mut failures = Vec::new();
    // Bodies lost of each shape on all grounds: with Rapier alone, and with each of the six arrangements of fields.
    let mut totals = SHAPES.map(|shape| (shape, 0, [0; 6]));
    for carried in [Carried::Fixed, Carried::Led] {
        for ground in GROUNDS {
            for bumps in BUMPS {
                for shape in SHAPES.into_iter().filter(|it| ground.bears(*it)) {
                    let drops = Drops {
                        ground,
                        bumps,
                        carried,
                        shape,
                        count: 0,
                        seed: 0,
                    };
                    let alone = lost(drops, Answer::Rapier);
                    let [discrete, swept] = [Detection::Discrete, Detection::Swept].map(|how| {
                        let sides = [Side::Body, Side::Ground, Side::Both];
                        sides.map(|side| lost(drops, Answer::Fields(how, side)))
                    });
                    let place = format!("{carried:?} {ground:?}, bumps {bumps}, {shape:?}");
                    let of = count();
                    println!(
                        "{place}: of {of} Rapier {alone}, discrete {discrete:?}, swept {swept:?} \
                         (field on the body, the ground, both)"
                    );
                    let most = alone as f64 + 3.0 * (alone as f64 + 1.0).sqrt();
                    let ways = || discrete.into_iter().chain(swept);
                    if ways().any(|lost| lost as f64 > most) {
                        failures.push(place);
                    }
                    let of_shape = totals.iter_mut().filter(|it| it.0 == shape);
                    for (_, of_rapier, of_fields) in of_shape {
                        *of_rapier += alone;
                        of_fields
                            .iter_mut()
                            .zip(ways())
                            .for_each(|(sum, lost)| *sum += lost);
                    }
                }
            }
        }
    }
    for (shape, alone, fields) in totals {
        let grounds = GROUNDS.into_iter().filter(|it| it.bears(shape));
        let drops = count() * grounds.count() * BUMPS.len() * 2;
        println!("{shape:?} in all: of {drops} Rapier {alone}, fields {fields:?}");
        let most = alone as f64 + (alone as f64).sqrt() + 1.0;
        if fields.into_iter().any(|lost| lost as f64 > most) {
            failures.push(format!("{shape:?} in all"));
        }
    }
    assert!(failures.is_empty(), "more are lost: {failures:#?}");
}
