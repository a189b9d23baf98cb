//! Score screening: a candidate whose derivative is not a number is named as such, and the others are judged without it.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::path::Path;

use flexcal::diagnose::{NOT_FINITE, Trace, trace};
use flexcal::identify::Options;
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::Problem;

#[test]
fn a_derivative_that_is_not_finite_spoils_no_other_candidate() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let problem = Problem::read(&folder).unwrap();
    let (measurements, _) = Measurements::read(&[folder.join("f-two.csv")], &problem).unwrap();
    let split = Split::new(&problem, &measurements).unwrap();
    let traced = |change: &dyn Fn(&mut Vec<f64>)| -> Trace {
        let mut measurements = measurements.clone();
        change(measurements.temperature.as_mut().unwrap());
        trace(&problem, &Dataset::new(measurements, split.clone()), &Options::default()).unwrap()
    };
    let refused = |trace: &Trace| trace.untestable.iter().filter(|(_, why)| *why == NOT_FINITE).count();
    let row = split.identification[3];
    let (plain, hot) = (traced(&|_| {}), traced(&|all| all[row] = f64::INFINITY));
    assert_eq!(refused(&plain), 0);
    assert!(refused(&hot) >= 4, "{:?}", hot.untestable);
    assert!(hot.untestable.iter().any(|(effect, why)| effect.name() == "joint-thermal-drift" && *why == NOT_FINITE));
    assert_eq!(hot.tried + refused(&hot), plain.tried);
    let best = |trace: &Trace| (trace.ranking[0].effect.clone(), trace.ranking[0].f);
    assert_eq!(best(&hot), best(&plain));
    assert!(hot.ranking[0].p_value <= plain.ranking[0].p_value && hot.ranking[0].p_value < 1e-6);
}
