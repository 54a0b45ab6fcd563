//! The bits of random worlds, and of what fields report of them, as a file has them.
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
use std::sync::Mutex;

use crate::report::Hash;
use crate::{Way, attempt};

/// Cases in one test: some hundred worlds have every kind of body, shape, joint, formula, operator and scheme.
const IN_A_TEST: u64 = 500;

/// Cases with one hash.
const TOGETHER: usize = 50;

/// Held by a test that writes the file.
static WRITING: Mutex<()> = Mutex::new(());

const PRECISION: &str = if cfg!(feature = "f64") { "f64" } else { "f32" };

/// The hash of all that a case left behind. All NaNs are one, because processors choose the bits of a new one; a fault is
/// its text.
fn add(hash: &mut Hash, seed: u64) {
    match attempt(seed, Way::of(seed)) {
        Ok(trace) => {
            let numbers = trace.worlds.into_iter().flatten().flatten();
            let numbers = numbers.map(|it| {
                if f64::from_bits(it).is_nan() {
                    u64::MAX
                } else {
                    it
                }
            });
            let texts = trace.reports.into_iter().chain(trace.answers);
            numbers
                .chain(texts)
                .for_each(|it| hash.add(&it.to_le_bytes()));
        }
        Err(fault) => hash.add(fault.as_bytes()),
    }
}

/// The name of a case in the file, and its hash.
fn line(line: &str) -> Option<(String, String)> {
    let (name, hash) = line.rsplit_once(' ')?;
    Some((name.to_owned(), hash.to_owned()))
}

/// Compares the cases from one on with the file.
fn check(first: u64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let mut files = path.map(|it| it.join("tests/data/golden.txt"));
    let path = files.find(|it| it.exists()).expect("the file");
    let read = || -> BTreeMap<String, String> {
        let text = std::fs::read_to_string(&path).expect("a readable file");
        text.lines().filter_map(line).collect()
    };
    let now = (first..first + IN_A_TEST).step_by(TOGETHER).map(|first| {
        let mut hash = Hash::default();
        (first..first + TOGETHER as u64).for_each(|seed| add(&mut hash, seed));
        (format!("{PRECISION} {first}"), format!("{:016x}", hash.0))
    });
    let now: Vec<_> = now.collect();
    if std::env::var("WRITE_GOLDEN").is_ok() {
        let _alone = WRITING.lock().expect("no panic while it is held");
        let mut known = read();
        known.extend(now);
        let lines = known.iter().map(|(name, hash)| format!("{name} {hash}\n"));
        std::fs::write(&path, lines.collect::<String>()).expect("a writable file");
        return;
    }
    let known = read();
    let others = now
        .iter()
        .filter(|(name, hash)| known.get(name) != Some(hash));
    let others: Vec<_> = others.map(|(name, _)| name).collect();
    assert!(
        others.is_empty(),
        "other bits in the {TOGETHER} cases from {others:?} on"
    );
}

macro_rules! tests {
    ($($name:ident: $first:literal)*) => {$(
        #[test]
        fn $name() {
            check($first);
        }
    )*};
}

tests! {
    the_bits_from_1000_on: 1000
    the_bits_from_1500_on: 1500
    the_bits_from_2000_on: 2000
    the_bits_from_2500_on: 2500
    the_bits_from_3000_on: 3000
    the_bits_from_3500_on: 3500
    the_bits_from_4000_on: 4000
    the_bits_from_4500_on: 4500
}
