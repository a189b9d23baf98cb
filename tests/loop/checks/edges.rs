//! Untestable data give a reason, unusual inputs are accepted, and results do not depend on
//! threads.

use flexcal::residual_tests::{
    Covariate, CovariateValues, ResidualTests, Sequence, Test, Untestable,
};
use nalgebra::DVector;
use rayon::ThreadPoolBuilder;

use super::linear::{Linear, find};

#[test]
fn threads_change_nothing() {
    for prior in [None, Some(0.4)] {
        let mut linear = Linear::new(80, 24, prior, 10);
        let noise = linear.noise();
        let residual = linear.leaves(noise);
        let with = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| linear.check(&residual))
        };
        assert_eq!(with(1), with(2));
    }
}

#[test]
fn what_cannot_be_tested_says_why() {
    let untestable = |findings: &ResidualTests, why: Untestable| {
        assert!(!findings.is_testable() && !findings.is_structured());
        assert!(findings.tests.iter().all(|check| check.outcome == Err(why.clone())));
    };
    let mut linear = Linear::new(28, 20, None, 11);
    let noise = linear.noise();
    let residual = linear.leaves(noise);
    let covariate = |covariate: Covariate, values: Vec<f64>| CovariateValues { covariate, values };
    linear.covariates = vec![
        covariate(Covariate::Hoist, vec![62.0; 28]),
        covariate(Covariate::Temperature, vec![f64::NAN; 28]),
        covariate(Covariate::Approach(0), vec![1.0; 3]),
    ];
    linear.sigma_is_declared = false;
    let findings = linear.check(&residual);
    let why = |test: Test| find(&findings, &test).outcome.clone().unwrap_err();
    let on = |covariate: Covariate| Test::Dependence { covariate };
    assert_eq!(why(on(Covariate::Hoist)), Untestable::Constant);
    assert_eq!(why(on(Covariate::Temperature)), Untestable::NotFinite);
    assert_eq!(why(on(Covariate::Approach(0))), Untestable::SizeMismatch);
    assert_eq!(why(Test::ReducedChiSquared), Untestable::NoSigma);
    assert_eq!(why(Test::LackOfFit), Untestable::NoRepeats);
    let sentence = find(&findings, &on(Covariate::Hoist)).to_string();
    assert_eq!(sentence, "dependence on hoist not tested: it is the same at every pose");

    untestable(&linear.check(&(&residual * f64::NAN)), Untestable::NotFinite);
    linear.time.pop();
    untestable(&linear.check(&residual), Untestable::SizeMismatch);
    let mut full = Linear::new(8, 24, None, 12);
    let noise = full.noise();
    let residual = full.leaves(noise);
    untestable(&full.check(&residual), Untestable::NoFreedom);
    untestable(&Linear::new(0, 0, None, 13).check(&DVector::zeros(0)), Untestable::NoFreedom);
}

#[test]
fn odd_inputs_are_taken() {
    for (poses, unknowns) in [(2, 0), (2, 1), (4, 3), (6, 12), (28, 0)] {
        let mut linear = Linear::new(poses, unknowns, None, 14);
        let noise = linear.noise();
        let residual = linear.leaves(noise);
        let zero = residual.map(|_| 0.0);
        for residual in [residual, zero] {
            for check in linear.check(&residual).tests {
                if let Ok(outcome) = &check.outcome {
                    let numbers =
                        [outcome.statistic, outcome.p_value, outcome.bounds.0, outcome.bounds.1];
                    assert!(
                        numbers.iter().all(|number| number.is_finite()),
                        "{check}: {outcome:?}"
                    );
                    assert!((0.0..=1.0).contains(&outcome.p_value));
                }
            }
        }
    }
    // One session per pose, and times that are no numbers.
    let mut linear = Linear::new(20, 5, None, 15);
    let noise = linear.noise();
    let residual = linear.leaves(noise);
    linear.time[3] = f64::NAN;
    let findings = linear.check(&residual);
    assert_eq!(
        find(&findings, &Test::Runs { sequence: Sequence::Time }).outcome,
        Err(Untestable::NotFinite)
    );
    assert!(find(&findings, &Test::Runs { sequence: Sequence::Rows }).outcome.is_ok());
    linear.session = (0..20).collect();
    let findings = linear.check(&residual);
    assert_eq!(
        find(&findings, &Test::Runs { sequence: Sequence::Rows }).outcome,
        Err(Untestable::TooFewPoses)
    );
}
