//! JSON results against their schemas, and docs/schema/ against the types.
//!
//! `FLEXCAL_REFILL=1 cargo test --test schemas` writes the schemas of the types to docs/schema/.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::PathBuf;

use common::arms::path;
use common::program::Folder;
use common::schema::violations;
use flexcal::results::{FORMAT_VERSION, PROGRAM, schemas};
use serde_json::Value;

mod common;

fn file(format: &str) -> PathBuf {
    path("docs/schema").join(format!("{}.schema.json", format.trim_start_matches("flexcal-")))
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

#[test]
fn every_command_writes_what_its_schema_says() {
    let folder = Folder::new();
    let full = |relative: &str| path(relative).display().to_string();
    let lunar = full("problems/lunar-sampler");
    let case = format!("{} --data {}", full("tests/cases"), full("tests/cases/d-backlash.csv"));
    let estimated = format!("{lunar} --estimate out/lunar-sampler/estimate.json");
    let watched = format!(
        "watch {} --estimate out/a-none/estimate.json --data {}",
        full("tests/cases"),
        full("tests/cases/a-none.csv")
    );
    let first =
        format!("identify {} --data {}", full("tests/cases"), full("tests/cases/a-none.csv"));
    folder.flexcal(&format!("{first} --out out/a-none")).success();
    let commands: [(&str, String); 13] = [
        ("flexcal-estimate", format!("identify {lunar}")),
        ("flexcal-loop", format!("loop {case} --out loop")),
        ("flexcal-trace", format!("trace {lunar}")),
        ("flexcal-compare", format!("compare {case} --out compare")),
        ("flexcal-check", format!("check {lunar}")),
        ("flexcal-plan", format!("plan {lunar} --truth {lunar} --poses 8")),
        ("flexcal-next", format!("next {lunar} --truth {lunar} --poses 3 --out next")),
        ("flexcal-errors", format!("predict {estimated}")),
        ("flexcal-watch", format!("{watched} --out watch")),
        ("flexcal-compensate", format!("compensate {estimated} --data {lunar}/targets.csv")),
        ("flexcal-export", format!("export {estimated} --format ros-yaml")),
        ("flexcal-acceptance", format!("accept {lunar}")),
        ("flexcal-init", format!("init {} --tip tool", full("tests/urdf/odd.urdf"))),
    ];
    let schemas = schemas();
    for (format, arguments) in commands {
        let json = folder.flexcal(&format!("{arguments} --json")).json();
        let (_, schema) = schemas.iter().find(|(name, _)| *name == format).unwrap();
        let schema = serde_json::from_str(schema).unwrap();
        assert_eq!(violations(&schema, &json), Vec::<String>::new(), "{format}");
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
