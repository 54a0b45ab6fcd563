//! The bits of random worlds, as a file has them.
//!
//! With `enhanced-determinism`, Rapier and this crate compute elementary functions by the same code on every machine, so
//! the bits after each case are those of `tests/data/golden.txt`, with and without optimisations. These worlds are too
//! small for `parallel` to sum forces in another order, so they are the same with it:
//!
//! `cargo test --release --package rapier3d-fields-tests --features enhanced-determinism --test fuzz golden::`
//!
//! A change of the library that rounds differently changes them, and so does one of Rapier. If that is meant, write the
//! file anew with `WRITE_GOLDEN=1`, for both packages (`rapier3d-fields-tests-f64` is the other one).

use std::collections::BTreeMap;
use std::path::Path;

use crate::{Way, attempt};

/// The cases: some hundred worlds have every kind of body, shape, joint, formula, operator and scheme.
const SEEDS: std::ops::Range<u64> = 1_000..1_400;

const PRECISION: &str = if cfg!(feature = "f64") { "f64" } else { "f32" };

/// FNV-1a over the bits of all steps of a case. All NaNs are one, because processors choose the bits of a new one; a
/// fault is its text.
fn hash(seed: u64) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut add = |byte: u8| hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    match attempt(seed, Way::of(seed)) {
        Ok(steps) => {
            let numbers = steps.into_iter().flatten().flatten();
            let numbers = numbers.map(|it| {
                if f64::from_bits(it).is_nan() {
                    u64::MAX
                } else {
                    it
                }
            });
            numbers.flat_map(u64::to_le_bytes).for_each(&mut add);
        }
        Err(fault) => fault.bytes().for_each(&mut add),
    }
    hash
}

/// The name of a case in the file, and its hash.
fn line(line: &str) -> Option<(String, String)> {
    let (name, hash) = line.rsplit_once(' ')?;
    Some((name.to_owned(), hash.to_owned()))
}

#[test]
fn the_bits_are_those_of_the_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let mut files = path.map(|it| it.join("tests/data/golden.txt"));
    let path = files.find(|it| it.exists()).expect("the file");
    let text = std::fs::read_to_string(&path).expect("a readable file");
    let mut known: BTreeMap<_, _> = text.lines().filter_map(line).collect();
    let name = |seed| format!("{PRECISION} {seed}");
    let now = SEEDS.map(|seed| (name(seed), format!("{:016x}", hash(seed))));
    if std::env::var("WRITE_GOLDEN").is_ok() {
        known.extend(now);
        let lines = known.iter().map(|(name, hash)| format!("{name} {hash}\n"));
        std::fs::write(&path, lines.collect::<String>()).expect("a writable file");
        return;
    }
    let others: Vec<_> = now
        .filter(|(name, hash)| known.get(name) != Some(hash))
        .collect();
    let count = others.len();
    assert!(
        others.is_empty(),
        "{count} cases have other bits, the first is {:?}",
        others[0]
    );
}
