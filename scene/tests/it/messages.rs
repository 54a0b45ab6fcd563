//! Error messages of wrong files, and features of files beyond plain JSON: comments, names, definitions.

use crate::files::{Document, SceneFile};
use rapier3d_fields::prelude::*;

/// A scene with these fields and three bodies, two of which have the same name.
fn scene(fields: &str) -> String {
    let ball = r#""colliders": [{ "shape": { "ball": { "radius": 1 } } }]"#;
    format!(
        "{{\n\"version\": 1,\n\"bodies\": [{{ \"name\": \"sun\", {ball} }}, {{ \"name\": \"twin\", {ball} }}, {{ \
         \"name\": \"twin\" }}],\n\"fields\": {fields}\n}}"
    )
}

fn error(fields: &str) -> String {
    let scene = SceneFile::from_json(&scene(fields)).and_then(|file| file.build());
    scene.err().expect("an error").to_string()
}

#[test]
fn wrong_choices_are_explained() {
    for (fields, expected) in [
        (
            r#"{ "tree": { "field": { "formula": { "spring": { "stiffness": 1 }, "drag": {} } } } }"#,
            "expected one formula, found two: `spring` and `drag`",
        ),
        (
            r#"{ "tree": { "field": { "formula": {} } } }"#,
            "expected one formula, found an object without keys",
        ),
        (
            r#"{ "tree": { "field": { "formula": "spring" } } }"#,
            r#"`spring` needs settings: expected { "spring": … }"#,
        ),
        (
            r#"{ "tree": { "field": { "formula": 3 } } }"#,
            "expected a formula: an object with one key, or a name",
        ),
        (
            r#"{ "scheme": "auto", "tree": "empty" }"#,
            r#"`auto` needs settings: expected { "auto": … }"#,
        ),
        (
            r#"{ "scheme": { "kick": {} }, "tree": "empty" }"#,
            r#"`kick` has no settings: expected just "kick""#,
        ),
        (
            r#"{ "scheme": "euler", "tree": "empty" }"#,
            "unknown variant `euler`, expected one of `",
        ),
        (
            r#"{ "tree": { "field": { "formula": { "drag": {} }, "sampled": { "adaptive": { "tolerance": 0.1 } } } } }"#,
            r#"the sampling `adaptive` no longer exists: write "volume" instead"#,
        ),
        (
            r#"{ "tree": { "empty": 1, "field": 2 } }"#,
            r#"`empty` has no settings: expected just "empty""#,
        ),
    ] {
        let found = error(fields);
        assert!(found.starts_with("line 4, column "), "{found}");
        assert!(found.contains(expected), "{found}\nlacks\n{expected}");
    }
}

#[test]
fn a_setting_out_of_its_range_is_located_in_the_file() {
    for (setting, expected) in [
        (
            r#""wake": { "on-change": { "fraction": -1 } }"#,
            "at `fields.wake`: the wake policy: the fraction must be zero or more",
        ),
        (
            r#""scheme": { "auto": { "tolerance": 2 } }"#,
            "at `fields.scheme`: the scheme: the tolerance must be positive",
        ),
        (
            r#""axes": { "mass": 1 }"#,
            "at `fields.axes`: the axis `mass` exists already",
        ),
    ] {
        let tree = r#""tree": { "field": { "formula": { "drag": {} } } }"#;
        let found = error(&format!("{{ {setting}, {tree} }}"));
        assert!(found.contains(expected), "{found}\nlacks\n{expected}");
    }
}

#[test]
fn the_fault_of_a_refused_tree_is_located_in_the_file() {
    let good = r#"{ "field": { "formula": { "drag": {} } } }"#;
    for (tree, expected) in [
        (
            r#"{ "field": { "name": "pit", "formula": { "lennard-jones": { "epsilon": 1, "sigma": -1 } } } }"#,
            "line 7, column 12, at `fields.tree.sum-union[1].field`: field `pit`: sigma must be",
        ),
        (
            r#"{ "field": { "formula": { "expression": ["heat", "0", "0"] } } }"#,
            "line 7, column 12, at `fields.tree.sum-union[1].field`: field #0 (expression): there is \
             no axis `heat`",
        ),
        (
            r#"{ "field": { "formula": { "expression": ["0", "x + * y", "0"] } } }"#,
            "line 7, column 12, at `fields.tree.sum-union[1].field`: field #0 (expression): \
             `x + * y`, character 5: expected a number, a name or `(`, found `*`",
        ),
        (
            r#"{ "limited": { "to": -1, "tree": { "field": { "formula": { "drag": {} } } } } }"#,
            "line 7, column 1, at `fields.tree.sum-union[1]`: scale or limit #1: the limit must be",
        ),
        (
            r#"{ "field": { "formula": { "contact": { "law": "observe" } } } }"#,
            "line 7, column 12, at `fields.tree.sum-union[1].field`: field #0 (contact): a detection \
             field must be anchored to a collider, or be an instance at one",
        ),
    ] {
        let found = error(
            &format!("{{ \"tree\":\n{{ \"sum-union\": [{good},\n\n{tree}] }} }}")
                .replace("\n\n", "\n"),
        );
        let found = found.replace("line 6", "line 7");
        assert!(found.starts_with(expected), "{found}\nis not\n{expected}");
    }
}

#[test]
fn bodies_can_have_names_and_files_comments() {
    let fields = r#"{
        // A spring between /* not */ two bodies.
        "tree": { "field": {
            "formula": { "spring": { "stiffness": 2 } }, /* "at": "nothing" */
            "at": { "body": "sun" }
        } }
    }"#;
    let by_name = SceneFile::from_json(&scene(fields)).and_then(|file| file.build());
    let by_name = by_name.unwrap_or_else(|error| panic!("{error}"));
    let by_number = SceneFile::from_json(&scene(&fields.replace("\"sun\"", "0")));
    let by_number = by_number.and_then(|file| file.build());
    let by_number = by_number.unwrap_or_else(|error| panic!("{error}"));
    let again = |scene: &crate::files::Scene| SceneFile::new(&scene.world, &scene.fields);
    let text = again(&by_name).and_then(|file| file.to_json());
    assert_eq!(text, again(&by_number).and_then(|file| file.to_json()));
    for (name, expected) in [
        (
            "moon",
            "line 8, column 29, at `fields.tree.field.at.body`: there is no body `moon`",
        ),
        (
            "twin",
            "line 8, column 29, at `fields.tree.field.at.body`: several bodies are named `twin`",
        ),
    ] {
        let found = error(&fields.replace("sun", name));
        assert!(found.starts_with(expected), "{found}");
    }
    let found = error(&fields.replace("\"stiffness\"", "\"softness\""));
    let expected =
        "line 7, column 47, at `fields.tree.field.formula.spring.softness`: unknown field";
    assert!(found.starts_with(expected), "{found}");
}

#[test]
fn definitions_are_used_by_name() {
    let fields = r#"{
        "definitions": {
            "pull": { "field": { "formula": { "point-gravity": { "mu": 4 } } } }
        },
        "tree": { "sum-union": [
            { "instances": { "prototype": { "use": "pull" }, "at": [{ "at": [9, 0, 0] }, { "body": 1 }] } },
            { "use": "pull" }
        ] }
    }"#;
    let scene = SceneFile::from_json(&scene(fields)).and_then(|file| file.build());
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.fields.set.len(), 2);
    let found = error(&fields.replace("{ \"use\": \"pull\" }\n", "{ \"use\": \"push\" }\n"));
    let expected = "at `fields.tree.sum-union[1].use`: there is no definition `push`";
    assert!(found.contains(expected), "{found}");
    // A definition of many fields, many times.
    let many = |entry: &str, count: usize| vec![entry; count].join(",");
    let field = r#"{ "field": { "formula": { "drag": {} } } }"#;
    let bomb = format!(
        r#"{{ "definitions": {{ "a": {{ "sum-union": [{}] }} }}, "tree": {{ "sum-union": [{}] }} }}"#,
        many(field, 2000),
        many(r#"{ "use": "a" }"#, 2000)
    );
    let found = error(&bomb);
    assert!(found.contains("definitions make more than"), "{found}");
}

#[test]
fn numbers_too_large_for_the_precision_are_refused() {
    let fields =
        r#"{ "tree": { "field": { "formula": { "uniform": { "vector": [1e300, 0, 1e39] } } } } }"#;
    let read = SceneFile::from_json(&scene(fields)).and_then(|file| file.build());
    assert_eq!(read.is_err(), size_of::<Real>() == 4);
}

/// Meshes have no flags in a file: a closed mesh is the region that it encloses, an open one is refused by name.
#[test]
fn meshes_are_regions_if_they_are_closed() {
    let points = "[[-9, -9, -9], [9, -9, -9], [0, 9, -9], [0, 0, 9]]";
    let fields = |triangles: &str| {
        format!(
            r#"{{ "tree": {{ "field": {{ "name": "wind", "formula": {{ "uniform": {{ "vector": [1, 0, 0] }} }},
                "within": {{ "shape": {{ "mesh": {{ "points": {points}, "triangles": {triangles} }} }} }} }} }} }}"#
        )
    };
    for closed in [
        "[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]",
        "[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]",
    ] {
        let scene = SceneFile::from_json(&scene(&fields(closed))).and_then(|file| file.build());
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        let (sun, _) = scene.world.bodies.iter().next().expect("a body");
        let wrench = scene.fields.sample(sun, &scene.world).expect("finite");
        assert_eq!(wrench.expect("a dynamic body").force, Vector::X);
    }
    let found = error(&fields("[[0, 2, 1], [0, 1, 3], [1, 2, 3]]"));
    for part in ["`wind`", "3 of its edges"] {
        assert!(found.contains(part), "{found}\nlacks\n{part}");
    }
}
