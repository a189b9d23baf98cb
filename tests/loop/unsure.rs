//! Effects without a sure law beside a remainder.
//!
//! `unsure` holds 30 configurations of a simulated arm of six joints, three targets each. Its joints
//! give way and have small errors of many orders, and 30 configurations do not show their laws.

use crate::common::program::{Folder, items, named, number};

#[test]
fn a_remainder_replaces_effects_whose_law_is_not_sure() {
    let folder = Folder::new();
    for name in ["problem.toml", "data.csv"] {
        folder.copy(&format!("tests/loop/unsure/{name}"), name);
    }
    let found = folder.flexcal("loop problem.toml --out loop --json").success().json();
    assert!(found["remainder"].is_object());
    let effects = items(&found["effects"]);
    assert!(!effects.is_empty() && effects.iter().all(|effect| effect["status"] == "found"));
    // What gave way is stated as structure, with the most probable law.
    let structures = std::iter::once(&found["unexplained"]).chain(items(&found["further"]));
    let laws: Vec<&str> = structures.filter_map(|left| left["law"].as_str()).collect();
    assert!(laws.iter().any(|law| law.starts_with("joint-")), "{laws:?}");
    // Its sizes are those of the fit that is used.
    let again = folder.flexcal("identify loop/problem.closed.toml --out again --json").success();
    let again = again.json();
    for parameter in effects.iter().flat_map(|effect| items(&effect["parameters"])) {
        let name = parameter["name"].as_str().unwrap();
        let fitted = number(&named(&again["parameters"], name)["estimate"]);
        let ratio = number(&parameter["estimate"]) / fitted;
        assert!((ratio - 1.0).abs() < 1e-6, "{name}: {ratio}");
    }
}
