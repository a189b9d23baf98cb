//! docs/selection.md has every number of the search, and each as it is.

use std::fs;
use std::path::Path;

use flexcal::diagnose::SelectionRules;

#[test]
fn the_page_has_every_number() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/selection.md")).unwrap_or_default();
    let cells = page.lines().filter_map(|line| line.strip_prefix("| `")).filter_map(|row| row.split_once("` | "));
    let told: Vec<String> =
        cells.filter_map(|(name, rest)| Some(format!("{name}: {}", rest.split_once(" |")?.0))).collect();
    let rules = format!("{:?}", SelectionRules::default());
    let rules = rules.trim_start_matches("SelectionRules { ").trim_end_matches(" }");
    for one in &told {
        assert!(format!("{rules}, ").contains(&format!("{one}, ")), "docs/selection.md says {one}: {rules}");
    }
    // Every field has one colon.
    assert_eq!(told.len(), rules.matches(": ").count());
}
