//! Identification of the example cases and of a measured robot.

#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

use std::io::Write as _;
use std::path::PathBuf;

use crate::common::arms::{measured, path};
use flexcal::fit::{Identification, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

/// Fits a case of `tests/cases`: held-out rms of the norm below `limit_mm`, χ² within its 99.9 %
/// limits.
fn check(case: &str, limit_mm: f64) {
    let problem = Problem::read(&path("tests/cases")).unwrap();
    let measurements = measured(&problem, &[case]);
    let data = Dataset::from_measurements(&problem, measurements).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let (registered, held_out) =
        (found.registered.held_out.rms.norm * 1e3, found.fitted.held_out.rms.norm * 1e3);
    let chi2 = found.reduced_chi2.unwrap();
    println!(
        "{case}: held out rms {held_out:.4} mm (registered {registered:.1}), χ²/ν {chi2:.3}, {} steps, {:.3} s",
        found.iterations, found.seconds
    );
    assert!(found.is_trusted(), "{:?}", found.termination);
    assert!(held_out < limit_mm, "{case}: held-out rms {held_out} mm");
    assert!(registered > 10.0 * held_out, "{case}: the nominal arm is off by {registered} mm");
    let (low, high) = chi2_limits(&found);
    assert!(low < chi2 && chi2 < high, "{case}: χ²/ν {chi2} is outside of {low:.3} to {high:.3}");
}

/// Returns the 99.9 % limits of χ²/ν, with ν at most the number of coordinates less the effective
/// parameters.
fn chi2_limits(found: &Identification) -> (f64, f64) {
    let given: f64 = found.estimates.iter().map(|estimate| estimate.identified).sum();
    let freedom = found.coordinates as f64 - given;
    let distribution = ChiSquared::new(freedom).unwrap();
    (distribution.inverse_cdf(0.0005) / freedom, distribution.inverse_cdf(0.9995) / freedom)
}

#[test]
fn twenty_eight_poses_of_the_lunar_sampler() {
    check("tests/cases/a-none.csv", 0.14);
}

#[test]
fn two_hundred_poses_of_the_lunar_sampler() {
    check("tests/cases/h-none-large.csv", 0.10);
}

/// Returns the folder of the measured UR10, if available.
fn ur10() -> Option<PathBuf> {
    let folder = std::env::var_os("FLEXCAL_UR10_DATA")
        .map_or_else(|| path("../shared/measured/ur10-ipa"), PathBuf::from);
    folder.join("session_A.csv").is_file().then_some(folder)
}

#[test]
fn three_sessions_of_a_measured_ur10() {
    let Some(folder) = ur10() else {
        // `eprintln!` would show its text for failed tests only.
        let why =
            "no session_A.csv of the measured UR10 at hand; name its folder in FLEXCAL_UR10_DATA";
        writeln!(std::io::stderr().lock(), "three_sessions_of_a_measured_ur10 skipped: {why}")
            .unwrap();
        return;
    };
    let problem = Problem::read(&path("problems/ur10-ipa")).unwrap();
    let files = ["A", "B", "C"].map(|session| folder.join(format!("session_{session}.csv")));
    let (data, _) = Dataset::read_files(&files, &problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let mean = |errors: &flexcal::fit::Errors| errors.held_out.mean.norm * 1e3;
    let (registered, fitted) = (mean(&found.registered), mean(&found.fitted));
    println!(
        "UR10: {} poses, held-out mean {fitted:.4} mm (registered {registered:.3}), rank {} of {}, {} steps, {:.2} s",
        data.measurements.len(),
        found.identifiability().rank,
        found.unknowns.len(),
        found.iterations,
        found.seconds
    );
    assert!(found.is_trusted(), "{:?}", found.termination);
    assert!(fitted < 0.45, "held-out mean {fitted} mm");
    assert!(registered > 0.6, "registered {registered} mm");
}
