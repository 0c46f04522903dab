//! The JSON Schema of a result describes real results, and a result can be read back.

use didim::archive::store::ResultRecord;
use didim_identification::identification::Estimate;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::{identify_arm, json, repository, results, succeed};

/// Keys of `identify --json` in addition to those of the estimate.
const OF_THE_COMMAND: [&str; 6] =
    ["recorded", "recordings", "elapsed_ms", "reduction", "foretold", "unused_frames"];

fn schema() -> Value {
    let path = repository("docs/reference/result.schema.json");
    json(&std::fs::read_to_string(path).unwrap())
}

/// `identify --json` on a recording of tests/data, without the keys of the command.
fn identified() -> Value {
    let mut estimate = json(&identify_arm("kr300", &["a.csv".to_owned()], "1.8", "8.2"));
    OF_THE_COMMAND.iter().for_each(|key| drop(estimate.as_object_mut().unwrap().remove(*key)));
    estimate
}

/// A result that a service stores.
fn stored() -> String {
    let state = TempDir::new().unwrap();
    let cell = repository("tests/data/stored/config/cells/tx40-cia402.toml");
    let recording = repository("tests/data/stored/drive.mcap");
    succeed(&[&"replay", &"--cell", &cell, &"--state", &state.path(), &recording]);
    results(state.path()).remove(0)
}

/// Differences of a value from a schema, each with its path. The keywords are those that the
/// program writes.
fn differences(root: &Value, schema: &Value, value: &Value, path: &str) -> Vec<String> {
    if let Some(reference) = schema.get("$ref").and_then(Value::as_str) {
        let definition = root.pointer(reference.trim_start_matches('#')).unwrap();
        return differences(root, definition, value, path);
    }
    for keyword in ["anyOf", "oneOf"] {
        let Some(forms) = schema.get(keyword).and_then(Value::as_array) else { continue };
        let fits = |form: &Value| differences(root, form, value, path).is_empty();
        return match forms.iter().any(fits) {
            true => Vec::new(),
            false => vec![format!("{path}: no form fits {value}")],
        };
    }
    if let Some(words) = schema.get("enum").and_then(Value::as_array) {
        return match words.contains(value) {
            true => Vec::new(),
            false => vec![format!("{path}: {value} is not in {words:?}")],
        };
    }
    if let Some(word) = schema.get("const") {
        return if word == value { Vec::new() } else { vec![format!("{path}: not {word}")] };
    }
    if !has_type(schema, value) {
        return vec![format!("{path}: {value} is no {}", schema["type"])];
    }
    let mut found = Vec::new();
    if let (Some(items), Some(values)) = (schema.get("items"), value.as_array()) {
        for (index, value) in values.iter().enumerate() {
            found.extend(differences(root, items, value, &format!("{path}.{index}")));
        }
    }
    if let (Some(properties), Some(entries)) = (schema.get("properties"), value.as_object()) {
        for (key, value) in entries {
            match properties.get(key) {
                Some(of) => found.extend(differences(root, of, value, &format!("{path}.{key}"))),
                None => found.push(format!("{path}.{key}: not described")),
            }
        }
    }
    for key in schema.get("required").and_then(Value::as_array).into_iter().flatten() {
        if value.get(key.as_str().unwrap()).is_none() {
            found.push(format!("{path}: {key} is missing"));
        }
    }
    found
}

fn has_type(schema: &Value, value: &Value) -> bool {
    let is = |kind: &Value| match kind.as_str().unwrap() {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        _ => value.is_object(),
    };
    match &schema["type"] {
        Value::Null => true,
        Value::Array(kinds) => kinds.iter().any(is),
        kind => is(kind),
    }
}

#[test]
fn real_results_are_as_the_schema_describes_them() {
    let schema = schema();
    let found = differences(&schema, &schema, &json(&stored()), "result");
    assert!(found.is_empty(), "{found:#?}");
    let estimate = &schema["$defs"]["Estimate"];
    let found = differences(&schema, estimate, &identified(), "estimate");
    assert!(found.is_empty(), "{found:#?}");
    let wrong = serde_json::json!({ "schema": "one", "verdict": { "aplicable": true } });
    assert_eq!(differences(&schema, estimate, &wrong, "estimate").len(), 3);
}

/// The type that is written is the type that is read, with its findings as data.
#[test]
fn a_result_is_read_back() {
    let identified = identified();
    let estimate: Estimate = serde_json::from_value(identified.clone()).unwrap();
    assert!(estimate.verdict.findings().iter().any(|found| !found.uses.is_empty()));
    assert!(serde_json::to_value(&estimate).unwrap() == identified);
    let stored = json(&stored());
    let record: ResultRecord = serde_json::from_value(stored.clone()).unwrap();
    assert!(serde_json::to_value(&record).unwrap() == stored);
}

#[test]
fn a_result_of_the_first_version_is_read() {
    let path = repository("tests/data/stored/state/result-00000000.json");
    let record: ResultRecord = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let estimate = &record.estimate;
    assert_eq!((estimate.parameters.len(), estimate.method.as_str()), (28, "didim"));
    // It has neither the keys nor the verdicts that came later.
    assert!(estimate.model_uncertainty.is_none() && estimate.friction_laws.is_empty());
    assert_eq!(estimate.verdict.uses.monitoring.applicable, None);
}
