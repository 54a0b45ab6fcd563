//! Tests of the pages that the program `simulate` writes.

use serde_json::Value;

use super::{folder, said, scene, simulate};

/// The data of a page for its script.
fn data(page: &str) -> Value {
    let data = page.split_once(r#"id="data">"#).expect("data").1;
    let data = data.split_once("</script>").expect("an end").0;
    serde_json::from_str(data).expect("JSON")
}

/// Writes the page of a scene file, and reads its data.
fn page(file: &str, name: &str, words: &[&str]) -> Value {
    let path = folder("pages").join(name);
    // A page of an earlier run must not be read.
    let _ = std::fs::remove_file(&path);
    let path = path.display().to_string();
    let words = [&[file, "--html", &path], words].concat();
    let output = simulate(&words);
    let page = std::fs::read_to_string(&path);
    data(&page.unwrap_or_else(|_| panic!("{}", said(&output))))
}

fn written(name: &str, text: &str) -> String {
    let path = folder("pages").join(name);
    std::fs::write(&path, text).expect("a file");
    path.display().to_string()
}

fn count(list: &Value) -> usize {
    list.as_array().expect("a list").len()
}

/// How many contacts of a kind there are; see `ContactKind`.
fn contacts(replay: &Value, kind: i64) -> usize {
    let frames = replay["contacts"].as_array().expect("a list").iter();
    let numbers = frames.map(|frame| {
        let numbers = frame.as_array().expect("a list");
        let kinds = numbers.iter().skip(3).step_by(4);
        kinds.filter(|it| it.as_i64() == Some(kind)).count()
    });
    numbers.sum()
}

#[test]
fn pages_hold_bodies_frames_and_arrows_in_both_precisions() {
    for precision in ["f32", "f64"] {
        let name = format!("planet_{precision}.html");
        let page = page(&scene("planet"), &name, &["--precision", precision]);
        assert_eq!(page["title"], "planet.json");
        let facts = page["facts"].as_str().expect("a text");
        let bits = format!(
            "5 bodies, 600 steps of 0.016667 in {} bits.",
            &precision[1..]
        );
        assert_eq!(facts, bits);
        let replay = &page["replay"];
        let about = replay["description"].as_str().expect("a text");
        assert!(about.starts_with("A planet that pulls"), "{about}");
        assert_eq!(replay["bodies"][1]["name"], "moon");
        assert_eq!(
            (count(&replay["bodies"]), count(&replay["frames"])),
            (5, 301)
        );
        assert!(count(&replay["arrows"]["moments"][0]["arrows"]) > 6 * 10);
        let page = self::page(&scene("spheres"), &name, &["--precision", precision]);
        let replay = &page["replay"];
        assert!(
            replay["arrows"].is_null(),
            "contacts are no force on points"
        );
        assert_eq!((count(&replay["bodies"]), count(&replay["walls"])), (21, 6));
        assert!(contacts(replay, 0) > 10);
        assert_eq!((1..6).map(|kind| contacts(replay, kind)).sum::<usize>(), 0);
    }
}

#[test]
fn the_option_every_sets_the_period_of_frames() {
    let words = ["--steps", "100", "--every", "10"];
    let page = page(&scene("planet"), "every.html", &words);
    assert_eq!(count(&page["replay"]["frames"]), 11);
}

#[test]
fn hostile_names_are_harmless() {
    let hostile = "</script><script>alert(1)</script><!-- ' & \\\" /*DATA*/";
    let text = format!(
        r#"{{ "version": 1, "about": "{hostile}", "bodies": [{{ "name": "{hostile}",
        "colliders": [{{ "shape": {{ "ball": {{ "radius": 0.5 }} }} }}] }}],
        "fields": {{ "tree": {{ "field": {{ "formula": {{ "spring": {{ "stiffness": 9 }} }} }} }} }} }}"#
    );
    let name = "a <b> & \"c\" '.json";
    let file = written(name, &text);
    let page = page(&file, "hostile.html", &["--steps", "5"]);
    let spoken = hostile.replace("\\\"", "\"");
    assert_eq!(page["title"], name);
    assert_eq!(page["replay"]["description"], spoken);
    assert_eq!(page["replay"]["bodies"][0]["name"], spoken);
    let path = folder("pages").join("hostile.html");
    let text = std::fs::read_to_string(path).expect("a page");
    assert_eq!(text.matches("<script").count(), 2);
    assert!(text.contains("<title>a &lt;b&gt; &amp; &quot;c&quot; &#39;.json</title>"));
    for outside in ["http://", "https://", " src=", "@import", "url("] {
        assert!(!text.contains(outside), "{outside}");
    }
}

#[test]
fn a_page_that_cannot_be_written_is_an_error() {
    let folder = folder("pages").display().to_string();
    let output = simulate(&[&scene("planet"), "--html", &folder]);
    assert!(!output.status.success());
    let said = said(&output);
    assert!(said.contains(&format!("cannot write {folder}: ")), "{said}");
}

#[test]
fn a_run_that_fails_has_a_page_of_the_steps_before() {
    let text = r#"{ "version": 1, "gravity": [0, 0, 0], "bodies": [{ "at": [1, 0, 0], "velocity": [1, 0, 0],
        "colliders": [{ "shape": { "ball": { "radius": 0.5 } } }] }],
        "fields": { "on-fault": "refuse", "tree":
        { "field": { "formula": { "expression": ["1 / (2 - x) ^ 400 * 0", "0", "0"] } } } } }"#;
    let file = written("refused.json", text);
    let page = page(&file, "refused.html", &["--steps", "200"]);
    assert!(count(&page["replay"]["frames"]) > 10);
}
