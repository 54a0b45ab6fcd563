//! Wrong files: errors give the place and the expected content, and nothing panics.
use crate::files::{Document, FileError, SceneFile};
use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::random::Random;
use serde_json::{Value, json};

/// The error of reading and building a scene.
fn error(text: &str) -> String {
    let scene = SceneFile::from_json(text).and_then(|file| file.build());
    scene.err().expect("an error").to_string()
}

/// A scene of one body and one tree.
fn scene(body: &str, tree: &str) -> String {
    format!(
        "{{\n\"version\": 1,\n\"bodies\": [\n{body}\n],\n\"fields\": {{\n\"tree\": {tree}\n}}\n}}"
    )
}

const BALL: &str = r#"{ "colliders": [{ "shape": { "ball": { "radius": 1 } } }] }"#;
const PULL: &str = r#"{ "field": { "formula": { "point-gravity": { "mu": 4 } } } }"#;

fn with_body(body: &str) -> String {
    error(&scene(body, PULL))
}

fn with_tree(tree: &str) -> String {
    error(&scene(BALL, tree))
}

#[test]
fn errors_of_the_text_say_line_column_path_and_what_was_expected() {
    for (found, expected) in [
        (
            with_body(r#"{ "colliders": [{ "shape": { "bal": { "radius": 1 } } }] }"#),
            "line 4, column 34, at `bodies[0].colliders[0].shape`: unknown variant `bal`, expected \
             one of `ball`, `cuboid`",
        ),
        (
            with_body(r#"{ "colour": "red" }"#),
            "line 4, column 10, at `bodies[0].colour`: unknown field `colour`, expected one of `name`, \
             `type`",
        ),
        (
            with_body(r#"{ "at": [1, 2] }"#),
            "line 4, column 14, at `bodies[0].at`: invalid length 2, expected a list of length 3",
        ),
        (
            with_body(r#"{ "at": [1, 2, "three"] }"#),
            "line 4, column 22, at `bodies[0].at[2]`: invalid type: string \"three\", expected a \
             finite number",
        ),
        (
            with_body(r#"{ "at": [1, 2, 1e999] }"#),
            "line 4, column 20, at `bodies[0].at[2]`: number out of range",
        ),
        (
            with_body(r#"{ "at": [1, 2, NaN] }"#),
            "line 4, column 16, at `bodies[0].at[2]`: expected value",
        ),
        (
            with_tree(r#"{ "field": { "formula": { "spring": { } } } }"#),
            "line 7, column 47, at `fields.tree.field.formula.spring`: missing field `stiffness`",
        ),
        (
            with_tree(&format!(
                r#"{{ "sum-union": [{PULL}, {{ "field": {{}} }}] }}"#
            )),
            "line 7, column 99, at `fields.tree.sum-union[1].field`: missing field `formula`",
        ),
        (
            error("{ \"version\": 1,"),
            "line 1, column 15, at `.`: EOF while parsing a value",
        ),
        (
            error(""),
            "line 1, column 0, at `.`: EOF while parsing a value",
        ),
        (
            error(&(scene(BALL, PULL) + "]")),
            "line 9, column 2, at `.`: trailing characters",
        ),
    ] {
        assert!(found.starts_with(expected), "{found}\nis not\n{expected}");
    }
}

#[test]
fn impossible_content_is_reported_with_its_place_and_value() {
    let ball = |rest: &str| {
        format!(r#"{{ "colliders": [{{ "shape": {{ "ball": {{ "radius": 1 }} }}, {rest} }}] }}"#)
    };
    let anchored = |at: &str| {
        format!(
            r#"{{ "field": {{ "name": "sun", "formula": {{ "spring": {{ "stiffness": 1 }} }}, "at": {at} }} }}"#
        )
    };
    for (found, expected) in [
        (
            with_tree(&anchored(r#"{ "body": 7 }"#)),
            "at `fields.tree.field.at.body`: there is no body 7; the scene has 1, from 0",
        ),
        (
            with_tree(&anchored(r#"{ "body": 0, "part": 1 }"#)),
            "at `fields.tree.field.at.part`: body 0 has no part 1; it has 1, from 0",
        ),
        (
            with_tree(&anchored(r#"{ "body-handle": [0, 0] }"#)),
            "at `fields.tree.field.at`: expected `body`, or `body` and `part`, by their numbers in \
             the scene",
        ),
        (
            with_tree(&anchored(r#"{ "rotation": [0, 0, 0, 0] }"#)),
            "at `fields.tree.field.at.rotation`: expected a quaternion [w, x, y, z] of length one, but its \
             length is 0",
        ),
        (
            with_body(r#"{ "colliders": [{ "shape": { "ball": { "radius": -1 } } }] }"#),
            "at `bodies[0].colliders[0].shape.ball.radius`: expected a size from 1e-6 to 1e6, found \
             -1",
        ),
        (
            with_body(&ball(r#""density": -2"#)),
            "at `bodies[0].colliders[0].density`: expected zero or more, found -2",
        ),
        (
            with_body(&ball(r#""density": 1, "mass": 1"#)),
            "at `bodies[0].colliders[0]`: expected one of `density`, `mass` and `mass-properties`, \
             found several",
        ),
        (
            with_body(&ball(r#""probe": { "axes": { "heat": 1 } }"#)),
            "at `bodies[0].colliders[0].probe`: there is no axis `heat`",
        ),
        (
            error(&scene(BALL, PULL).replace("1,", "2,")),
            "at `version`: expected 1, found 2",
        ),
        (
            with_tree(r#"{ "field": { "formula": { "closure": "x => 2x" } } }"#),
            "at `fields.tree.field.formula`: a closure is code and cannot be written to a file",
        ),
        (
            with_tree(r#"{ "sum-union": [] }"#),
            "at `fields.tree`: the tree is empty: it needs at least one field",
        ),
        (
            with_tree(
                r#"{ "field": { "name": "well", "formula": { "spring": { "stiffness": 1 } },
                     "scaled-by": [{ "ramp": [0, 1] }] } }"#,
            ),
            "at `fields.tree.field.scaled-by[0]`: the first step must be a source: constant, axis, \
             distance or depth",
        ),
        (
            with_tree(
                r#"{ "field": { "formula": { "spring": { "stiffness": 1 } }, "within": { "union": [] } } }"#,
            ),
            "at `fields.tree.field.within.union`: expected at least one region",
        ),
        (
            with_tree(
                r#"{ "field": { "name": "pit", "formula": { "lennard-jones": { "epsilon": 1, "sigma": -1 } } } }"#,
            ),
            "at `fields.tree.field`: field `pit`: sigma must be positive and finite, but is -1",
        ),
    ] {
        let (place, _) = found.split_once(", at `").unwrap_or_default();
        assert!(place.starts_with("line "), "{found}");
        assert!(found.contains(expected), "{found}\nis not\n{expected}");
    }
}

#[test]
fn code_is_refused_by_name_when_writing() {
    let fields = [
        (
            Field::closure([], |_: &Sample| Vector::X).named("mine"),
            "field `mine`: a closure is code and cannot be written to a file",
        ),
        (
            Field::uniform(Vector::X)
                .within(Region::predicate([], |_: &Sample| true))
                .named("here"),
            "field `here`: a predicate is code and cannot be written to a file",
        ),
        (
            Field::uniform(Vector::X).scaled_by(Scalar::closure([], |_: &Sample| 1.0)),
            "field: a closure is code and cannot be written to a file",
        ),
    ];
    for (field, expected) in fields {
        let error = field.to_json().expect_err("code");
        assert!(matches!(error, FileError::Code { .. }), "{error:?}");
        assert_eq!(error.to_string(), expected);
        let tree = Tree::from(field.named("leaf")).sum_union(Field::uniform(Vector::Y));
        let error = tree.to_json().expect_err("code").to_string();
        assert!(error.starts_with("field `leaf`: a "), "{error}");
    }
}

#[test]
fn numbers_that_are_not_finite_are_not_written() {
    let wells = [
        Field::spring(Real::INFINITY),
        Field::uniform(Vector::new(0.0, Real::NAN, 0.0)),
        Field::uniform(Vector::X).within(Region::ball(Real::INFINITY)),
    ];
    for field in wells {
        let error = field.to_json().expect_err("no finite number").to_string();
        assert!(
            error.contains("is not finite, and cannot stand in a file"),
            "{error}"
        );
    }
}

#[test]
fn deep_nesting_does_not_exhaust_the_stack() {
    let levels = 100_000;
    for (open, middle, close) in [
        ("{\"sum-union\":[", PULL, "]}"),
        ("{\"limited\":{\"to\":1,\"tree\":", PULL, "}}"),
        ("{\"instances\":{\"at\":[],\"prototype\":", PULL, "}}"),
    ] {
        let text = open.repeat(levels) + middle + &close.repeat(levels);
        let tree = Tree::from_json(&text).expect_err("too deep").to_string();
        assert!(tree.ends_with("recursion limit exceeded"), "{tree}");
        assert!(error(&scene(BALL, &text)).ends_with("recursion limit exceeded"));
    }
    for (open, middle, close) in [
        ("{\"complement\":", "\"everywhere\"", "}"),
        ("{\"union\":[", "\"everywhere\"", "]}"),
        ("[", "", "]"),
        ("{\"x\":", "1", "}"),
    ] {
        let text = open.repeat(levels) + middle + &close.repeat(levels);
        assert!(Region::from_json(&text).is_err());
        assert!(SceneFile::from_json(&text).is_err());
    }
    let times = |levels: usize| "[{\"axis\":\"x\"},{\"times\":".repeat(levels);
    assert!(Scalar::from_json(&times(levels)).is_err());
    let brackets = format!("{}x{}", "(".repeat(levels), ")".repeat(levels));
    let text = format!(r#"{{ "formula": {{ "expression": ["{brackets}", "0", "0"] }} }}"#);
    let error = Field::from_json(&text).expect_err("too long").to_string();
    assert!(error.contains("at most 65536 are read"), "{error}");
}

#[test]
fn trees_and_regions_of_any_depth_are_read_if_they_were_written() {
    let leaf = || Field::uniform(Vector::X).within(Region::ball(2.0));
    let mut tree = Tree::from(leaf());
    let mut written = 0;
    for level in 0..512 {
        tree = match level % 3 {
            0 => tree.difference(leaf()),
            1 => tree.scaled_by(Scalar::axis("time")),
            _ => tree.sum_intersection(leaf()),
        };
        match tree.to_json() {
            Ok(text) => {
                let read = Tree::from_json(&text);
                assert!(read.is_ok(), "what was written");
                written = level;
            }
            Err(error) => assert!(matches!(error, FileError::TooDeep { .. }), "{error}"),
        }
    }
    assert!(written >= 40, "only {written} levels");
    let chain = Tree::fold(Operator::SumUnion, (0..20_000).map(|_| leaf()));
    let text = chain.to_json().expect("a chain is one level");
    let read = Tree::from_json(&text).expect("what was written");
    assert_eq!(read.field_count(), 20_000);
    let mut region = Region::ball(1.0);
    for level in 0..200 {
        region = if level % 2 == 0 {
            region.complement()
        } else {
            region.union(Region::ball(1.0))
        };
        if let Ok(text) = region.to_json() {
            assert_eq!(Region::from_json(&text).expect("what was written"), region);
        }
    }
}

const EVERYTHING: &str = include_str!("../data/everything.json");

#[test]
fn truncated_files_are_errors() {
    let text = EVERYTHING.trim_end();
    assert!(SceneFile::from_json(text).is_ok());
    for end in (0..text.len()).filter(|end| text.is_char_boundary(*end)) {
        assert!(
            SceneFile::from_json(&text[..end]).is_err(),
            "cut after {end}"
        );
    }
}

/// A random value, wrong in most places of a file.
fn strange(random: &mut Random) -> Value {
    let numbers = [
        0.0, -0.0, -1.0, 1e-300, 1e-40, 1e-10, 0.5, 3.0, 1e7, 1e15, 1e30, 3e38, 1e300,
    ];
    let pick = (random.uniform() * 26.0) as usize;
    match pick {
        0..13 => json!(numbers[pick]),
        13 => json!(u64::MAX),
        14 => json!(i64::MIN),
        15 => json!("text"),
        16 => json!(null),
        17 => json!([]),
        18 => json!({}),
        19 => json!([0, 0, 0]),
        20 => json!([0, 0, 0, 1]),
        21 => json!(true),
        22 => json!(vec![json!([0, 0, 0]); 5]),
        23 => json!("everywhere"),
        24 => json!(7),
        _ => json!({ "body": 1 }),
    }
}

/// Changes one value somewhere in a document.
fn change(value: &mut Value, random: &mut Random, mut depth: usize) {
    let mut place = value;
    loop {
        let count = match place {
            Value::Array(list) => list.len(),
            Value::Object(map) => map.len(),
            _ => 0,
        };
        if count == 0 || depth == 0 {
            break;
        }
        depth -= 1;
        let chosen = (random.uniform() * count as f64) as usize;
        if depth % 7 == 3 && random.uniform() < 0.05 {
            match place {
                Value::Array(list) => drop(list.remove(chosen)),
                Value::Object(map) => {
                    let key = map.keys().nth(chosen).cloned();
                    key.and_then(|key| map.remove(&key));
                }
                _ => {}
            }
            return;
        }
        place = match place {
            Value::Array(list) => &mut list[chosen],
            Value::Object(map) => map.values_mut().nth(chosen).expect("that many"),
            _ => return,
        };
    }
    *place = strange(random);
}

/// Files that are almost right: reading, building and running them gives errors or scenes that run,
/// and never panics.
#[test]
fn randomly_changed_files_give_errors_or_scenes() {
    let mut whole: Value = serde_json::from_str(EVERYTHING).expect("a JSON file");
    // This field is singular at a body, so every run would end with an error.
    let trees = whole["fields"]["tree"]["sum-union"].as_array_mut();
    trees.expect("a list").remove(10);
    let cases = std::env::var("HOSTILE_CASES")
        .ok()
        .and_then(|n| n.parse().ok());
    let cases = cases.unwrap_or(3000);
    let mut random = Random::new(7);
    let (mut built, mut steps) = (0, 0);
    for _ in 0..cases {
        let mut value = whole.clone();
        for _ in 0..1 + (random.uniform() * 3.0) as usize {
            let depth = 1 + (random.uniform() * 14.0) as usize;
            change(&mut value, &mut random, depth);
        }
        match SceneFile::from_json(&value.to_string()).and_then(|file| file.build()) {
            Ok(mut scene) => {
                built += 1;
                let ran = (0..2).take_while(|_| scene.fields.step(&mut scene.world).is_ok());
                steps += ran.count();
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    assert!(built > cases / 20, "only {built} were built");
    assert!(steps > built, "only {steps} steps");
}

/// At commit 95daff4 a body at 3.4e30 was written to a file that could not be read. Now it is not written.
#[test]
fn a_scene_that_cannot_be_read_back_is_not_written() {
    let file = SceneFile::from_json(&scene(BALL, PULL)).expect("a scene");
    let mut scene = file.build().expect("a scene");
    let body = scene.bodies[0];
    type Edit = fn(&mut RigidBody);
    let edits: [(&str, Edit); 4] = [
        ("bodies[0].at", |body| {
            body.set_translation(Vector::X * 3.4e30, true);
        }),
        ("bodies[0].velocity", |body| {
            body.set_linvel(Vector::Y * -3.4e30, true);
        }),
        ("bodies[0].angular-velocity", |body| {
            body.set_angvel(Vector::Z * 3.4e30, true);
        }),
        ("bodies[0].linear-damping", |body| {
            body.set_linear_damping(-1.0);
        }),
    ];
    for (place, edit) in edits {
        let was = scene.world.bodies[body].clone();
        edit(&mut scene.world.bodies[body]);
        let error = SceneFile::new(&scene.world, &scene.fields).expect_err("too much");
        let FileError::Content { path, message } = &error else {
            panic!("{error}");
        };
        assert_eq!(path, place);
        assert!(message.starts_with("expected "), "{message}");
        scene.world.bodies[body] = was;
    }
    scene.world.gravity = Vector::Y * 1e20;
    let error = SceneFile::new(&scene.world, &scene.fields).expect_err("too much");
    assert!(error.to_string().contains("gravity"), "{error}");
}

/// Calls `judge` on copies of a document in each of which one value is replaced by another.
fn with_others(value: &Value, judge: &mut impl FnMut(&Value)) {
    fn places(value: &Value, path: &mut Vec<String>, all: &mut Vec<Vec<String>>) {
        all.push(path.clone());
        let inner: Vec<(String, &Value)> = match value {
            Value::Array(list) => (0..).map(|n: usize| n.to_string()).zip(list).collect(),
            Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
            _ => Vec::new(),
        };
        for (name, value) in inner {
            path.push(name);
            places(value, path, all);
            path.pop();
        }
    }
    let mut all = Vec::new();
    places(value, &mut Vec::new(), &mut all);
    let others = [
        json!(null),
        json!(true),
        json!(-1),
        json!(1.5),
        json!(1e30),
        json!("x"),
        json!([]),
        json!([1]),
        json!({}),
        json!({ "x": 1 }),
    ];
    // Three at each place, in turn.
    for (place, path) in all.into_iter().enumerate() {
        let others = (0..3).map(|n| &others[(place + 3 * n) % others.len()]);
        for other in others {
            let mut changed = value.clone();
            let mut at = &mut changed;
            for name in &path {
                at = match at {
                    Value::Array(list) => &mut list[name.parse::<usize>().expect("a number")],
                    value => &mut value[name.as_str()],
                };
            }
            *at = other.clone();
            judge(&changed);
        }
    }
}

/// At commit 95daff4 messages were "expected struct BodyDoc", "expected usize", "invalid type: map". Now they use the
/// terms of JSON, for any value at any place.
#[test]
fn errors_use_the_terms_of_json_not_of_rust() {
    let value = serde_json::from_str(EVERYTHING).expect("JSON");
    let mut wrong = 0;
    with_others(&value, &mut |changed| {
        let Err(error) = SceneFile::from_json(&changed.to_string()) else {
            return;
        };
        wrong += 1;
        let told = error.to_string();
        let words = told.split(|letter: char| !letter.is_alphanumeric());
        for word in words {
            let is_of_rust = ["struct", "usize", "u32", "i8", "f32", "f64"].contains(&word)
                || word.ends_with("Doc");
            assert!(!is_of_rust || told.contains("unknown variant"), "{told}");
        }
    });
    assert!(wrong > 1000, "{wrong}");
}
