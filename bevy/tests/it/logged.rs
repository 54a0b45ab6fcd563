//! Errors and warnings in the log.

use std::sync::Mutex;

use log::{Log, Metadata, Record};

use crate::support::*;

/// All lines that tests in this process have logged.
static LINES: Mutex<Vec<String>> = Mutex::new(Vec::new());

struct Kept;

impl Log for Kept {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &Record<'_>) {
        LINES
            .lock()
            .expect("no thread panics with it")
            .push(record.args().to_string());
    }

    fn flush(&self) {}
}

/// The number of lines logged so far in which all parts occur.
fn lines(parts: &[&str]) -> usize {
    let lines = LINES.lock().expect("no thread panics with it");
    let has_all = |line: &&String| parts.iter().all(|part| line.contains(part));
    lines.iter().filter(has_all).count()
}

#[test]
fn errors_name_the_entity_and_warnings_do_not_repeat() {
    log::set_logger(&Kept).expect("the only one");
    log::set_max_level(log::LevelFilter::Warn);

    let mut first = app(fixed());
    // Entities that make the id below unique among all tests.
    for _ in 0..1_000 {
        first.world_mut().spawn_empty();
    }
    let bad = Field::uniform(Vec3::X * f32::NAN).named("gale");
    let bad = first.world_mut().spawn(ForceField::new(bad)).id();
    frames(&mut first, 5);
    assert_eq!(lines(&["refused", &bad.to_string(), "gale"]), 1);

    // A spring that is too stiff for the step: √5000 / 60 is 1.1785.
    let mut second = app(fixed());
    second
        .world_mut()
        .spawn(ForceField::new(Field::spring(5_000.0)));
    second.world_mut().spawn(ball(Vec3::X * 1e-3));
    frames(&mut second, 50);
    let stiff = ["too stiff", "1.178"];
    assert_eq!(lines(&stiff), 1);
    frames(&mut second, 50);
    assert_eq!(lines(&stiff), 2, "once a second");
}
