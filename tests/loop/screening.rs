//! Score screening: a candidate whose derivative is not a number is named, and the others are
//! tested without it.

use std::path::Path;

use flexcal::fit::Options;
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::{Effect, Problem};
use flexcal::select::{NOT_FINITE, trace};

/// A law whose value is not finite at any pose.
const ENDLESS: &str =
    "law = { name = 'endless', at = 'joint2', terms = ['log(q2 - 1000)'], sigma_deg = 0.05 }";

#[test]
fn a_derivative_that_is_not_finite_spoils_no_other_candidate() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let problem = Problem::read(&folder).unwrap();
    let (measurements, _) = Measurements::read(&[folder.join("f-two.csv")], &problem).unwrap();
    let data = Dataset::from_measurements(&problem, measurements).unwrap();
    let mut options = Options::default();
    let plain = trace(&problem, &data, &options).unwrap();
    options.candidates = vec![problem.effect(ENDLESS, Path::new("endless")).unwrap().effect];
    let endless = trace(&problem, &data, &options).unwrap();
    assert!(plain.untestable.iter().all(|(_, why)| *why != NOT_FINITE));
    let refused =
        |(effect, why): &&(Effect, &str)| effect.place() == "endless" && *why == NOT_FINITE;
    assert_eq!(endless.untestable.iter().filter(refused).count(), 1);
    assert_eq!(endless.tried, plain.tried);
    let names = |effects: &[flexcal::select::Ranked]| -> Vec<(Effect, f64)> {
        effects.iter().map(|ranked| (ranked.effect.clone(), ranked.p_value)).collect()
    };
    assert_eq!(names(&endless.ranking), names(&plain.ranking));
    assert!(plain.ranking[0].p_value < 1e-6);
}
