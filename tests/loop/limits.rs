//! Active limits: a wrong limit is reported and is no effect.

use std::path::Path;

use flexcal::fit::Options;
use flexcal::measurement::{Dataset, Split};
use flexcal::problem::Problem;
use flexcal::report::loop_text;
use flexcal::results::LoopResult;
use flexcal::rig::{Truth, simulate};
use flexcal::select::{HypothesisKind, close};
use flexcal::study::table;

fn service_arm() -> Problem {
    Problem::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("problems/service-arm/problem.toml"))
        .unwrap()
}

#[test]
fn a_link_longer_than_its_tolerance_is_no_effect() {
    let problem = service_arm();
    let (data, _) = Dataset::read(&problem).unwrap();
    let closed = close(&problem, &data, &Options::default()).unwrap();
    assert!(closed.effects.is_empty(), "{:?}", closed.effects);
    let claims = closed.unexplained[0].claims.as_ref().unwrap();
    assert_eq!(claims.law.0.kind, HypothesisKind::Limit("of joint4.a".to_owned()));
    assert!(claims.law.1 > 0.5, "{claims:?}");
    let result = LoopResult::new(&problem, &closed);
    assert_eq!(result.unexplained.unwrap().limit.as_deref(), Some("of joint4.a"));
    let said = loop_text(&problem, &closed, None).replace('\n', " ");
    assert!(said.contains("limit of joint4.a"), "{said}");
    // No law was tried in its place.
    assert!(!said.contains("No effect of the catalogue"), "{said}");
}

#[test]
fn an_effect_beside_limits_that_hold_is_named() {
    let problem = service_arm();
    let text = "[parameters]\n'joint4.a' = { mm = 0.1 }\n'joint2.stiffness' = { relative = 1.1 }\n'upper.EI' = { relative = 1.1 }\n\
                [[effect]]\njoint-coupling = { joint = 3, from = 4 }\nfactor_relative = 1e-3\n[noise]\nposition_sigma_mm = 0.05\n[poses]\n\
                q1_deg = [-120, 120]\nq2_deg = [-10, 80]\nq3_deg = [-120, 20]\nq4_deg = [-100, 100]\npayload_kg = [0, 1, 2]\n";
    let truth = Truth::parse(text, Path::new("TRUTH.toml"), &problem).unwrap();
    for seed in [1, 2, 3] {
        let rows = simulate(&problem, &truth, 40, seed).unwrap().rows;
        let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
        let closed =
            close(&problem, &Dataset::new(table(&rows), split), &Options::default()).unwrap();
        let names: Vec<&str> = closed.effects.iter().map(|found| found.effect.name()).collect();
        assert_eq!(names, ["joint-coupling"], "{seed}");
        let before = &closed.before.fit;
        let limits = before.estimates.iter().filter(|estimate| estimate.at_bound.is_some()).count()
            + before.active_constraints.len();
        assert!(limits > 0, "{seed}: no limit holds this fit");
    }
}
