//! `schema.json` is the JSON Schema of the types, and the scenes of this project conform to it.

use rapier3d_fields_scene::single::SceneFile;
use serde_json::Value;

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_schema_file_is_up_to_date() {
    let text = serde_json::to_string_pretty(&SceneFile::schema()).expect("JSON") + "\n";
    if std::env::var_os("WRITE_SCENES").is_some() {
        std::fs::write(path("schema.json"), &text).expect("a file that can be written");
    }
    let found = std::fs::read_to_string(path("schema.json")).unwrap_or_default();
    assert!(
        found == text,
        "schema.json is out of date: run this with WRITE_SCENES=1"
    );
}

/// Checks a value by those keywords of JSON Schema that the schema uses; other keywords fail.
fn check(value: &Value, schema: &Value, root: &Value, place: &str) -> Result<(), String> {
    let object = match schema {
        Value::Bool(true) => return Ok(()),
        Value::Object(object) => object,
        other => return Err(format!("{place}: {other} is no schema")),
    };
    for (word, rule) in object {
        let inner = |schema: &Value| check(value, schema, root, place);
        let list = || rule.as_array().map(Vec::as_slice).unwrap_or_default();
        let good = match &**word {
            "$ref" => {
                let pointer = rule.as_str().unwrap_or_default().trim_start_matches('#');
                let target = root.pointer(pointer).ok_or("no such definition")?;
                inner(target)?;
                true
            }
            "oneOf" => {
                let fits: Vec<_> = list().iter().map(inner).collect();
                if fits.iter().filter(|fit| fit.is_ok()).count() != 1 {
                    let reasons: Vec<String> = fits.into_iter().filter_map(Result::err).collect();
                    return Err(format!(
                        "{place}: none, or several, of: {}",
                        reasons.join("; ")
                    ));
                }
                true
            }
            "anyOf" => list().iter().any(|schema| inner(schema).is_ok()),
            "allOf" => list().iter().all(|schema| inner(schema).is_ok()),
            "const" => value == rule,
            "enum" => list().contains(value),
            "type" => {
                let fits = |name: &Value| match name.as_str() {
                    Some("object") => value.is_object(),
                    Some("array") => value.is_array(),
                    Some("string") => value.is_string(),
                    Some("number") => value.is_number(),
                    Some("integer") => value.is_i64() || value.is_u64(),
                    Some("boolean") => value.is_boolean(),
                    Some("null") => value.is_null(),
                    _ => false,
                };
                fits(rule) || list().iter().any(fits)
            }
            "required" => list()
                .iter()
                .all(|key| value.get(key.as_str().unwrap_or_default()).is_some()),
            "minItems" => value
                .as_array()
                .is_none_or(|v| v.len() as u64 >= rule.as_u64().unwrap_or(0)),
            "maxItems" => value
                .as_array()
                .is_none_or(|v| v.len() as u64 <= rule.as_u64().unwrap_or(0)),
            "minimum" => value
                .as_f64()
                .is_none_or(|x| x >= rule.as_f64().unwrap_or(0.0)),
            "maximum" => value
                .as_f64()
                .is_none_or(|x| x <= rule.as_f64().unwrap_or(0.0)),
            "items" => {
                for (number, item) in value.as_array().into_iter().flatten().enumerate() {
                    check(item, rule, root, &format!("{place}[{number}]"))?;
                }
                true
            }
            "prefixItems" => {
                for (item, schema) in value.as_array().into_iter().flatten().zip(list()) {
                    check(item, schema, root, place)?;
                }
                true
            }
            "properties" => {
                for (key, schema) in rule.as_object().into_iter().flatten() {
                    if let Some(item) = value.get(key) {
                        check(item, schema, root, &format!("{place}.{key}"))?;
                    }
                }
                true
            }
            "additionalProperties" => {
                let known =
                    |key: &String| object.get("properties").and_then(|p| p.get(key)).is_some();
                for (key, item) in value.as_object().into_iter().flatten() {
                    if known(key) {
                        continue;
                    }
                    if *rule == Value::Bool(false) {
                        return Err(format!("{place}: unknown key `{key}`"));
                    }
                    check(item, rule, root, &format!("{place}.{key}"))?;
                }
                true
            }
            "$schema" | "$defs" | "title" | "description" | "default" | "format" => true,
            unknown => return Err(format!("{place}: the schema says `{unknown}`")),
        };
        if !good {
            return Err(format!("{place}: {value} is not {word} {rule}"));
        }
    }
    Ok(())
}

#[test]
fn scenes_conform_to_the_schema() {
    let schema = serde_json::to_value(SceneFile::schema()).expect("JSON");
    let read = |path: &str| -> Value {
        let text = std::fs::read_to_string(path).expect("a scene");
        serde_json::from_str(&text).expect("JSON")
    };
    let mut count = 0;
    for entry in std::fs::read_dir(path("../examples/scenes")).expect("a folder") {
        let file = entry.expect("a file").path().display().to_string();
        let fits = check(&read(&file), &schema, &schema, "scene");
        fits.unwrap_or_else(|error| panic!("{file}: {error}"));
        count += 1;
    }
    assert!(count >= 8, "only {count} scenes");
    let mut everything = read(&path("tests/data/everything.json"));
    check(&everything, &schema, &schema, "scene").unwrap_or_else(|error| panic!("{error}"));
    everything["bodies"][0]["colour"] = Value::from("red");
    let error = check(&everything, &schema, &schema, "scene").expect_err("a wrong scene");
    assert!(error.contains("unknown key `colour`"), "{error}");
}
