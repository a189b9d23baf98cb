//! False alarm rates of the residual tests on several kinds of noise.

use std::time::Instant;

use flexcal::residual_tests::{Covariate, CovariateValues, ResidualTest, ResidualTests};
use nalgebra::DVector;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use super::linear::{Linear, at_most, driven, heavy_tails, noise_only, normal, uneven};

/// Results of the tests over many problems.
struct Rates {
    structured: usize,
    failed: usize,
    /// Name and covariate of each test, with its p values.
    p_values: Vec<(String, Vec<f64>)>,
}

impl Rates {
    fn of(problems: u64, make: impl Fn(u64) -> (Linear, DVector<f64>) + Sync) -> Self {
        let all: Vec<ResidualTests> = (0..problems)
            .into_par_iter()
            .map(|seed| {
                let (linear, residual) = make(seed);
                linear.check(&residual)
            })
            .collect();
        let mut p_values: Vec<(String, Vec<f64>)> = Vec::new();
        for (k, check) in all[0].tests.iter().enumerate() {
            let values = all
                .iter()
                .filter_map(|f| f.tests[k].outcome.as_ref().ok())
                .map(|outcome| outcome.p_value);
            p_values.push((
                format!(
                    "{} {}",
                    check.name(),
                    check.about().map_or_else(String::new, |of| of.to_string())
                ),
                values.collect(),
            ));
        }
        Self {
            structured: all.iter().filter(|findings| findings.is_structured()).count(),
            failed: all
                .iter()
                .filter(|findings| findings.tests.iter().any(ResidualTest::failed))
                .count(),
            p_values,
        }
    }

    fn share(values: &[f64], level: f64) -> f64 {
        values.iter().filter(|&&p| p <= level).count() as f64 / values.len().max(1) as f64
    }

    /// Returns the test with the largest share of p ≤ `level`, and the share.
    fn worst(&self, level: f64) -> (&str, f64) {
        let shares =
            self.p_values.iter().map(|(name, values)| (name.as_str(), Self::share(values, level)));
        shares.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    }

    fn print(&self, what: &str) {
        println!("{what}: structured {}, any failure {}", self.structured, self.failed);
        for (name, values) in &self.p_values {
            let [a, b, c, d] = [0.5, 0.05, 0.01, 0.001].map(|level| Self::share(values, level));
            println!(
                "  {name:24} p ≤ 0.5: {a:.3}  0.05: {b:.4}  0.01: {c:.4}  0.001: {d:.5}  of {}",
                values.len()
            );
        }
    }
}

#[test]
fn noise_is_not_structure() {
    for (unknowns, prior) in [(32, None), (32, Some(0.5)), (60, Some(0.3))] {
        let problems = 300;
        let rates = Rates::of(problems, noise_only(28, unknowns, prior));
        rates.print(&format!("28 poses, {unknowns} unknowns, prior {prior:?}"));
        assert!(rates.structured <= at_most(problems, 0.01), "{} of {problems}", rates.structured);
        assert!(rates.failed <= at_most(problems, 0.01), "{} of {problems}", rates.failed);
        // Share of each test alone.
        let (name, share) = rates.worst(0.05);
        assert!(share <= at_most(problems, 0.05) as f64 / problems as f64, "{name} {share}");
    }
}

#[test]
fn heavy_tails_and_uneven_noise_are_not_structure() {
    let problems = 300;
    let heavy = Rates::of(problems, heavy_tails(28, 32));
    heavy.print("heavy tails");
    assert!(heavy.structured <= at_most(problems, 0.01), "{} of {problems}", heavy.structured);
    let uneven = Rates::of(problems, uneven);
    uneven.print("uneven");
    assert!(uneven.structured <= at_most(problems, 0.01), "{} of {problems}", uneven.structured);
}

#[test]
#[ignore = "a sweep of minutes"]
fn rates_and_times() {
    for (poses, unknowns, prior, problems) in [
        (28, 32, None, 2000),
        (28, 32, Some(0.5), 2000),
        (28, 60, Some(0.3), 1000),
        (28, 60, None, 1000),
        (100, 32, None, 500),
    ] {
        let rates = Rates::of(problems, noise_only(poses, unknowns, prior));
        rates.print(&format!(
            "{poses} poses, {unknowns} unknowns, prior {prior:?}, {problems} problems"
        ));
        assert!(rates.failed <= at_most(problems, 0.01), "{} of {problems}", rates.failed);
    }
    let heavy = Rates::of(2000, heavy_tails(28, 32));
    heavy.print("Student's t with 3 degrees of freedom, 28 poses, 32 unknowns, 2000 problems");
    assert!(heavy.structured <= at_most(2000, 0.01), "{} of 2000", heavy.structured);
    let uneven = Rates::of(2000, uneven);
    uneven.print("noise twice as large at every other pose, 2000 problems");
    assert!(uneven.structured <= at_most(2000, 0.01), "{} of 2000", uneven.structured);
    for (poses, unknowns, size) in
        [(28, 32, 3.0), (28, 32, 6.0), (28, 20, 3.0), (60, 20, 1.0), (200, 32, 0.5)]
    {
        let all: Vec<ResidualTests> =
            (0..200).into_par_iter().map(|seed| driven(poses, unknowns, size, seed)).collect();
        let structured = all.iter().filter(|findings| findings.is_structured()).count();
        let on_q2 = all
            .iter()
            .filter_map(ResidualTests::strongest)
            .filter(|check| check.about() == Some(Covariate::Command(1)))
            .count();
        println!(
            "{poses} poses, {unknowns} unknowns, {size} σ of q2: structure {structured}, strongest on q2 {on_q2} of 200"
        );
        assert!(on_q2 >= 180, "{on_q2} of 200");
    }
    for (poses, unknowns) in [(28, 32), (200, 32), (6500, 60)] {
        let mut linear = Linear::new(poses, unknowns, None, 5);
        for k in linear.covariates.len()..20 {
            let values = (0..poses).map(|_| normal(&mut linear.random)).collect();
            linear.covariates.push(CovariateValues { covariate: Covariate::Approach(k), values });
        }
        let noise = linear.noise();
        let residual = linear.leaves(noise);
        let [one, two] = [1, 2].map(|threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let start = Instant::now();
            let findings = pool.install(|| linear.check(&residual));
            println!(
                "{poses} poses, {unknowns} unknowns, {} checks, {threads} threads: {:?}",
                findings.tests.len(),
                start.elapsed()
            );
            findings
        });
        assert_eq!(one, two, "{poses} poses");
    }
}
