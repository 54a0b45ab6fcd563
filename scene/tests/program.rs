//! Tests of the program `simulate`.

#[path = "it/pages.rs"]
mod pages;

use std::path::PathBuf;
use std::process::{Command, Output};

/// Creates a folder for files of a test.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn simulate(words: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_simulate"));
    program.args(words).output().expect("a program that runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

fn scene(name: &str) -> String {
    format!(
        "{}/../examples/scenes/{name}.json",
        env!("CARGO_MANIFEST_DIR")
    )
}

/// The cells of a table's column.
fn column(path: &std::path::Path, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("names").split(',').collect();
    let place = names.iter().position(|known| *known == name);
    let place = place.unwrap_or_else(|| panic!("no column `{name}` in {names:?}"));
    let cell = |line: &str| line.split(',').nth(place).unwrap_or_default().to_owned();
    lines.map(cell).collect()
}

#[test]
fn tables_are_written_in_both_precisions() {
    for precision in ["f32", "f64"] {
        let folder = folder(precision);
        let file = |name: &str| folder.join(name).display().to_string();
        let output = simulate(&[
            &scene("spheres"),
            "--precision",
            precision,
            "--duration",
            "0.5",
            "--contacts",
            &file("contacts.csv"),
            "--energies",
            &file("energies.csv"),
            "--warnings",
            &file("warnings.csv"),
        ]);
        assert!(output.status.success(), "{}", said(&output));
        let kinetic = column(&folder.join("energies.csv"), "kinetic");
        assert!(kinetic.len() > 10);
        let sources = column(&folder.join("contacts.csv"), "source");
        let answers = column(&folder.join("contacts.csv"), "answered_by");
        let impulses = column(&folder.join("contacts.csv"), "jx1");
        let speeds = column(&folder.join("contacts.csv"), "approach_speed");
        let approached = |speed: &String| speed.parse::<f64>().expect("a number") > 0.0;
        assert!(speeds.iter().any(approached));
        assert!(sources.contains(&"field".to_owned()) && sources.contains(&"rapier".to_owned()));
        // Which side found a contact does not decide which side answers it: here the fields do.
        assert!(answers.contains(&"fields".to_owned()), "{answers:?}");
        assert!(!answers.contains(&"both".to_owned()), "{answers:?}");
        for (answer, impulse) in answers.iter().zip(&impulses) {
            let number: f64 = impulse.parse().expect("a number");
            assert!(answer != "nobody" || number == 0.0);
        }
    }
}

#[test]
fn options_override_the_settings_of_the_file() {
    let output = simulate(&[&scene("planet"), "--dt", "0.5", "--steps", "4"]);
    assert!(
        said(&output).contains("simulated               2.000000"),
        "{}",
        said(&output)
    );
    for (words, expected) in [
        (
            &["--scheme", "euler"][..],
            "--scheme euler: unknown variant `euler`",
        ),
        (
            &["--scheme", "auto"],
            "--scheme auto: `auto` needs settings",
        ),
        (
            &["--detection", "often"],
            "--detection often: unknown variant",
        ),
        (&["--dt", "-1"], "--dt -1: expected more than zero"),
        (
            &["--precision", "f16"],
            "--precision f16: expected f32 or f64",
        ),
        (
            &["--steps", "3", "--duration", "2"],
            "expected --steps or --duration, found both",
        ),
        (&["--colour", "red"], "what is `--colour`?"),
    ] {
        let file = scene("planet");
        let words: Vec<&str> = std::iter::once(&*file)
            .chain(words.iter().copied())
            .collect();
        let output = simulate(&words);
        assert!(!output.status.success());
        assert!(said(&output).contains(expected), "{}", said(&output));
    }
    for scheme in ["kick", "linearly-implicit", r#"{"substep": {"fixed": 2}}"#] {
        let output = simulate(&[&scene("planet"), "--scheme", scheme, "--steps", "5"]);
        assert!(output.status.success(), "{}", said(&output));
    }
}

#[test]
fn warnings_are_printed_once_each_and_fail_strict_runs() {
    let stiff = folder("strict").join("stiff.json");
    let text = r#"{ "version": 1, "bodies": [
        { "at": [1, 0, 0], "colliders": [{ "shape": { "ball": { "radius": 0.5 } }, "mass": 1 }] }
    ], "fields": { "tree": { "field": { "formula": { "spring": { "stiffness": 9000 } } } } } }"#;
    std::fs::write(&stiff, text).expect("a file");
    let stiff = stiff.display().to_string();
    let output = simulate(&[&stiff, "--steps", "20"]);
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(
        said(&output)
            .matches("the fields are too stiff for")
            .count(),
        1
    );
    let output = simulate(&[&stiff, "--steps", "20", "--strict"]);
    assert!(!output.status.success());
    assert!(said(&output).contains(" warnings"), "{}", said(&output));
    assert!(
        simulate(&[&scene("planet"), "--steps", "20", "--strict"])
            .status
            .success()
    );
}
