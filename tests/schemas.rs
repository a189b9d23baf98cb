//! JSON results against their schemas, and docs/schema/ against the types.
//!
//! `FLEXCAL_REFILL=1 cargo test --test schemas` writes the schemas of the types to docs/schema/.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use common::schema::violations;
use flexcal::results::{FORMAT_VERSION, PROGRAM, schemas};
use serde_json::Value;

mod common;

fn file(format: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema");
    folder.join(format!("{}.schema.json", format.trim_start_matches("flexcal-")))
}

#[test]
fn schemas_in_the_docs_are_those_of_the_types() {
    let refills = std::env::var_os("FLEXCAL_REFILL").is_some();
    for (format, schema) in schemas() {
        if refills {
            fs::create_dir_all(file(format).parent().unwrap()).unwrap();
            fs::write(file(format), &schema).unwrap();
        }
        let kept = fs::read_to_string(file(format)).unwrap_or_default();
        assert_eq!(kept, schema, "{format}: FLEXCAL_REFILL=1 writes it anew");
    }
    let kept = fs::read_dir(file("").parent().unwrap()).unwrap().count();
    assert_eq!(kept, schemas().len(), "docs/schema holds no other file");
}

/// Runs a command with `--json` in a folder and returns what it prints.
fn printed(folder: &Path, arguments: &[&str]) -> Value {
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let output = flexcal.current_dir(folder).args(arguments).arg("--json").output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{arguments:?}: {said}"))
}

#[test]
fn every_command_writes_what_its_schema_says() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let named = |path: &str| root.join(path).to_str().unwrap().to_owned();
    let lunar = named("problems/lunar-sampler");
    let [cases, data, urdf] =
        ["tests/cases", "tests/cases/d-backlash.csv", "tests/urdf/odd.urdf"].map(named);
    let targets = format!("{lunar}/targets.csv");
    let estimate = "out/lunar-sampler/estimate.json";
    let commands: [(&str, Vec<&str>); 11] = [
        ("flexcal-estimate", vec!["identify", &lunar]),
        ("flexcal-loop", vec!["loop", &cases, "--data", &data, "--out", "loop"]),
        ("flexcal-trace", vec!["trace", &lunar]),
        ("flexcal-compare", vec!["compare", &cases, "--data", &data, "--out", "compare"]),
        ("flexcal-check", vec!["check", &lunar]),
        ("flexcal-plan", vec!["plan", &lunar, "--truth", &lunar, "--poses", "8"]),
        ("flexcal-errors", vec!["predict", &lunar, "--estimate", estimate]),
        (
            "flexcal-compensate",
            vec!["compensate", &lunar, "--estimate", estimate, "--data", &targets],
        ),
        ("flexcal-export", vec!["export", &lunar, "--estimate", estimate, "--format", "ros-yaml"]),
        ("flexcal-acceptance", vec!["accept", &lunar]),
        ("flexcal-init", vec!["init", &urdf, "--tip", "tool"]),
    ];
    let schemas = schemas();
    for (format, arguments) in commands {
        let json = printed(folder.path(), &arguments);
        let (_, schema) = schemas.iter().find(|(name, _)| *name == format).unwrap();
        let schema = serde_json::from_str(schema).unwrap();
        assert_eq!(violations(&schema, &json), Vec::<String>::new(), "{format}");
        let keys: Vec<&String> = json.as_object().unwrap().keys().collect();
        assert!(keys.iter().any(|key| *key == "format"), "{format}: {keys:?}");
        assert_eq!((&json["format"]["name"], &json["program"]), (&format.into(), &PROGRAM.into()));
        assert_eq!(json["format"]["version"], FORMAT_VERSION);
    }
}

#[test]
fn violations_are_found() {
    let (_, schema) = schemas().into_iter().find(|(name, _)| *name == "flexcal-loop").unwrap();
    let schema: Value = serde_json::from_str(&schema).unwrap();
    let found = violations(&schema, &serde_json::json!({ "verdict": "perhaps", "effects": [{}] }));
    for place in [": required", "/verdict: ", "/effects/0: required"] {
        assert!(found.iter().any(|message| message.contains(place)), "{place} not in {found:?}");
    }
}
