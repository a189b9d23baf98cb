//! Agreement of docs/selection.md with the numbers of the search.

use std::fs;
use std::path::Path;

use flexcal::fit::Options;
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::select::{SelectionRules, close_by, trace_by};

#[test]
fn the_page_has_every_number() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/selection.md"))
        .unwrap_or_default();
    let cells = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `"))
        .filter_map(|row| row.split_once("` | "));
    let told: Vec<String> = cells
        .filter_map(|(name, rest)| Some(format!("{name}: {}", rest.split_once(" |")?.0)))
        .collect();
    let rules = format!("{:?}", SelectionRules::default());
    let rules = rules.trim_start_matches("SelectionRules { ").trim_end_matches(" }");
    for one in &told {
        assert!(
            format!("{rules}, ").contains(&format!("{one}, ")),
            "docs/selection.md says {one}: {rules}"
        );
    }
    // Every field has one colon.
    assert_eq!(told.len(), rules.matches(": ").count());
}

type Change = fn(&mut SelectionRules);

#[test]
fn rules_that_make_no_sense_are_refused() {
    let problem =
        Problem::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("problems/lunar-sampler"))
            .unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let change: [(&str, Change); 8] = [
        ("level", |rules| rules.level = f64::NAN),
        ("leaving_level", |rules| rules.leaving_level = 1e-9),
        ("inclusion_threshold", |rules| rules.inclusion_threshold = 1.5),
        ("located", |rules| rules.located = 1.0),
        ("stated", |rules| rules.stated = 0.0),
        ("evidence_poses", |rules| rules.evidence_poses = 0),
        ("fit_work", |rules| rules.fit_work = f64::INFINITY),
        ("max_rounds", |rules| rules.max_rounds = 0),
    ];
    assert!(SelectionRules::DEFAULT.check().is_ok());
    for (name, change) in change {
        let mut rules = SelectionRules::default();
        change(&mut rules);
        let options = Options::default();
        let traced = trace_by(&problem, &data, &options, &rules).map(|_| ());
        let closed = close_by(&problem, &data, &options, &rules).map(|_| ());
        for error in [traced, closed].map(|outcome| outcome.unwrap_err().to_string()) {
            assert!(error.contains(&format!("the rule {name} of the search")), "{error}");
        }
    }
}
