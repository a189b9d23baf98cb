//! Checks of what a fit leaves: no false alarms on noise, and structure found and named.
//!
//! `cargo test --release --test checks -- --ignored --nocapture` prints rates over many more problems, and times.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

use std::time::Instant;

use flexcal::diagnosis::{Check, Driver, Findings, Remainder, Sequence, Test, Untestable, check};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use statrs::distribution::{Binomial, DiscreteCDF as _};

/// A linear fit: 3 N data, p unknowns, with strong leverage.
struct Linear {
    jacobian: DMatrix<f64>,
    /// 1 σ of each unknown's prior.
    prior: Option<f64>,
    fitted: DMatrix<f64>,
    drivers: Vec<Driver>,
    time: Vec<f64>,
    session: Vec<usize>,
    setup: Vec<usize>,
    sigma_is_declared: bool,
    /// Where the drawing of noise goes on.
    random: ChaCha8Rng,
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

impl Linear {
    /// Columns smooth in the drivers, rows of some poses many times larger than those of others.
    fn new(poses: usize, unknowns: usize, prior: Option<f64>, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let joints = 6;
        let angles: Vec<Vec<f64>> =
            (0..joints).map(|_| (0..poses).map(|_| random.random_range(-1.5..1.5)).collect()).collect();
        let reach: Vec<f64> = (0..poses).map(|_| (0.7 * normal(&mut random)).exp()).collect();
        let mut jacobian = DMatrix::zeros(3 * poses, unknowns);
        for j in 0..unknowns {
            let waves: [[f64; 6]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| 0.8 * normal(&mut random)));
            let phases: [f64; 3] = std::array::from_fn(|_| random.random_range(0.0..6.3));
            for pose in 0..poses {
                for axis in 0..3 {
                    let phase: f64 = (0..joints).map(|k| waves[axis][k] * angles[k][pose]).sum::<f64>() + phases[axis];
                    jacobian[(3 * pose + axis, j)] = phase.sin() * reach[pose];
                }
            }
        }
        let fitted = factor(&jacobian, prior);
        let mut drivers: Vec<Driver> =
            angles.into_iter().enumerate().map(|(k, values)| Driver { name: format!("q{}", k + 1), values }).collect();
        let payload = (0..poses).map(|_| f64::from(random.random_range(0..3_u8))).collect();
        drivers.push(Driver { name: "payload".to_owned(), values: payload });
        drivers.push(Driver { name: "torque2".to_owned(), values: reach });
        let time: Vec<f64> = (0..poses).map(|pose| pose as f64).collect();
        drivers.push(Driver { name: "time".to_owned(), values: time.clone() });
        let (session, setup) = (vec![0; poses], (0..poses).collect());
        Self { jacobian, prior, fitted, drivers, time, session, setup, sigma_is_declared: true, random }
    }

    fn poses(&self) -> usize {
        self.time.len()
    }

    fn noise(&mut self) -> DVector<f64> {
        DVector::from_fn(3 * self.poses(), |_, _| normal(&mut self.random))
    }

    /// What the fit leaves of data; with priors, of true unknowns drawn from them as well.
    fn leaves(&mut self, mut data: DVector<f64>) -> DVector<f64> {
        let p = self.jacobian.ncols();
        if let Some(sigma) = self.prior {
            let truth = DVector::from_fn(p, |_, _| sigma * normal(&mut self.random));
            data += &self.jacobian * truth;
        }
        let taken = self.fitted.tr_mul(&data);
        data - &self.fitted * taken
    }

    fn check(&self, residual: &DVector<f64>) -> Findings {
        check(&self.remainder(residual), 7)
    }

    fn remainder<'a>(&'a self, residual: &'a DVector<f64>) -> Remainder<'a> {
        Remainder {
            residual,
            fitted: &self.fitted,
            sigma_is_declared: self.sigma_is_declared,
            time: &self.time,
            session: &self.session,
            setup: &self.setup,
            drivers: &self.drivers,
        }
    }

    fn driver(&self, name: &str) -> &[f64] {
        &self.drivers.iter().find(|driver| driver.name == name).unwrap().values
    }

    /// Adds a displacement as a function of the pose.
    fn displace(data: &mut DVector<f64>, by: impl Fn(usize) -> Vector3<f64>) {
        for pose in 0..data.len() / 3 {
            let mut at = data.fixed_rows_mut::<3>(3 * pose);
            at += by(pose);
        }
    }
}

/// The data's rows of Q of [J; prior rows].
fn factor(jacobian: &DMatrix<f64>, prior: Option<f64>) -> DMatrix<f64> {
    let (rows, p) = jacobian.shape();
    let mut stack = DMatrix::zeros(rows + if prior.is_some() { p } else { 0 }, p);
    stack.rows_mut(0, rows).copy_from(jacobian);
    if let Some(sigma) = prior {
        stack.rows_mut(rows, p).fill_diagonal(sigma.recip());
    }
    stack.qr().q().rows(0, rows).into_owned()
}

fn find<'a>(findings: &'a Findings, test: &Test) -> &'a Check {
    findings.checks.iter().find(|check| check.test == *test).unwrap()
}

fn outliers(findings: &Findings) -> &Check {
    findings.checks.iter().find(|check| check.name() == "outliers").unwrap()
}

/// What the checks say of many problems.
struct Rates {
    structured: usize,
    failed: usize,
    /// Name and driver, p-values.
    p_values: Vec<(String, Vec<f64>)>,
}

impl Rates {
    fn of(problems: u64, make: impl Fn(u64) -> (Linear, DVector<f64>) + Sync) -> Self {
        let all: Vec<Findings> = (0..problems)
            .into_par_iter()
            .map(|seed| {
                let (linear, residual) = make(seed);
                linear.check(&residual)
            })
            .collect();
        let mut p_values: Vec<(String, Vec<f64>)> = Vec::new();
        for (k, check) in all[0].checks.iter().enumerate() {
            let values = all.iter().filter_map(|f| f.checks[k].outcome.as_ref().ok()).map(|outcome| outcome.p_value);
            p_values.push((format!("{} {}", check.name(), check.about().unwrap_or("")), values.collect()));
        }
        Self {
            structured: all.iter().filter(|findings| findings.is_structured()).count(),
            failed: all.iter().filter(|findings| findings.checks.iter().any(Check::failed)).count(),
            p_values,
        }
    }

    fn share(values: &[f64], level: f64) -> f64 {
        values.iter().filter(|&&p| p <= level).count() as f64 / values.len().max(1) as f64
    }

    /// The check that most often has p ≤ `level`, and the share.
    fn worst(&self, level: f64) -> (&str, f64) {
        let shares = self.p_values.iter().map(|(name, values)| (name.as_str(), Self::share(values, level)));
        shares.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    }

    fn print(&self, what: &str) {
        println!("{what}: structured {}, any failure {}", self.structured, self.failed);
        for (name, values) in &self.p_values {
            let [a, b, c, d] = [0.5, 0.05, 0.01, 0.001].map(|level| Self::share(values, level));
            println!("  {name:24} p ≤ 0.5: {a:.3}  0.05: {b:.4}  0.01: {c:.4}  0.001: {d:.5}  of {}", values.len());
        }
    }
}

fn noise_only(poses: usize, unknowns: usize, prior: Option<f64>) -> impl Fn(u64) -> (Linear, DVector<f64>) + Sync {
    move |seed| {
        let mut linear = Linear::new(poses, unknowns, prior, 1000 + seed);
        let noise = linear.noise();
        let residual = linear.leaves(noise);
        (linear, residual)
    }
}

/// How many of `problems` may have what happens with probability `rate`: exceeded once in some 10 000 tests.
fn at_most(problems: u64, rate: f64) -> usize {
    let binomial = Binomial::new(rate, problems).unwrap();
    usize::try_from(binomial.inverse_cdf(1.0 - 1e-4)).unwrap()
}

/// Counts problems for which `holds`.
fn count(problems: u64, holds: impl Fn(u64) -> bool + Sync) -> usize {
    (0..problems).into_par_iter().filter(|&seed| holds(seed)).count()
}

#[test]
fn noise_is_not_structure() {
    for (unknowns, prior) in [(32, None), (32, Some(0.5)), (60, Some(0.3))] {
        let problems = 300;
        let rates = Rates::of(problems, noise_only(28, unknowns, prior));
        rates.print(&format!("28 poses, {unknowns} unknowns, prior {prior:?}"));
        assert!(rates.structured <= at_most(problems, 0.01), "{} of {problems}", rates.structured);
        assert!(rates.failed <= at_most(problems, 0.01), "{} of {problems}", rates.failed);
        // Each check by itself.
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

/// Student's t with 3 degrees of freedom, σ not declared.
fn heavy_tails(poses: usize, unknowns: usize) -> impl Fn(u64) -> (Linear, DVector<f64>) + Sync {
    move |seed| {
        let mut linear = Linear::new(poses, unknowns, None, 2000 + seed);
        linear.sigma_is_declared = false;
        let t = StudentT::new(3.0).unwrap();
        let noise = DVector::from_fn(3 * poses, |_, _| t.sample(&mut linear.random));
        let residual = linear.leaves(noise);
        (linear, residual)
    }
}

/// Noise twice as large at every other pose, σ not declared.
fn uneven(seed: u64) -> (Linear, DVector<f64>) {
    let mut linear = Linear::new(28, 32, None, 3000 + seed);
    linear.sigma_is_declared = false;
    let mut noise = linear.noise();
    noise.iter_mut().enumerate().filter(|(row, _)| row / 3 % 2 == 0).for_each(|(_, value)| *value *= 2.0);
    let residual = linear.leaves(noise);
    (linear, residual)
}

/// A smooth function of one driver, `size` σ of noise large.
fn driven(poses: usize, unknowns: usize, size: f64, seed: u64) -> Findings {
    let mut linear = Linear::new(poses, unknowns, None, 4000 + seed);
    linear.sigma_is_declared = false;
    let mut data = linear.noise();
    let driver = linear.driver("q2").to_vec();
    Linear::displace(&mut data, |pose| size * (2.0 * driver[pose]).sin() * Vector3::new(1.0, 0.5, -1.0));
    let residual = linear.leaves(data);
    linear.check(&residual)
}

#[test]
fn a_driver_is_found_and_named() {
    let on_q2 = Test::Dependence { driver: "q2".to_owned() };
    let named = count(30, |seed| driven(60, 20, 1.5, seed).strongest().is_some_and(|check| check.test == on_q2));
    println!("q2 is named in {named} of 30");
    assert!(named >= 25);
    let findings = driven(60, 20, 3.0, 1);
    let found = findings.strongest().unwrap();
    println!("{found}");
    assert_eq!((found.about(), found.name()), (Some("q2"), "dependence"));
    assert!(found.to_string().starts_with("residuals depend on q2 (distance correlation 0."));
    let outcome = found.outcome.as_ref().unwrap();
    assert!(outcome.statistic > outcome.bounds.1 && outcome.statistic < 1.0);
}

#[test]
fn few_degrees_of_freedom_still_show_strong_structure() {
    let found = count(30, |seed| driven(28, 20, 6.0, seed).is_structured());
    println!("28 poses, 20 unknowns: structure in {found} of 30");
    assert!(found >= 25);
}

/// AR(1) noise in the order of time; `shuffled` rows are not in that order.
fn following(shuffled: bool, seed: u64) -> Findings {
    let mut linear = Linear::new(100, 20, None, 5000 + seed);
    linear.sigma_is_declared = false;
    if shuffled {
        linear.time = (0..100).map(|_| linear.random.random()).collect();
    }
    let mut order: Vec<usize> = (0..100).collect();
    order.sort_by(|&a, &b| linear.time[a].total_cmp(&linear.time[b]));
    let fresh = linear.noise();
    let mut noise = fresh.clone();
    for pair in order.windows(2) {
        for axis in 0..3 {
            noise[3 * pair[1] + axis] = 0.7 * noise[3 * pair[0] + axis] + fresh[3 * pair[1] + axis];
        }
    }
    let residual = linear.leaves(noise);
    linear.check(&residual)
}

#[test]
fn noise_that_follows_itself_is_found_in_its_order() {
    for shuffled in [false, true] {
        let all: Vec<Findings> = (0..30).into_par_iter().map(|seed| following(shuffled, seed)).collect();
        let failing = |test: &Test| all.iter().filter(|findings| find(findings, test).failed()).count();
        let time = Sequence::Time;
        let (runs, correlated) = (failing(&Test::Runs { sequence: time }), failing(&Test::LjungBox { sequence: time }));
        println!("shuffled {shuffled}: runs {runs}, Ljung–Box {correlated} of 30");
        assert!(runs >= 25 && correlated >= 27);
        let by_rows = Test::LjungBox { sequence: Sequence::Rows };
        if shuffled {
            assert!(failing(&by_rows) <= 2);
        } else {
            assert!(all[0].checks.iter().all(|check| check.test != by_rows), "one order, one check");
        }
    }
}

#[test]
fn an_understated_sigma_fails_chi_squared_and_nothing_else() {
    let mut linear = Linear::new(28, 20, None, 6);
    let noise = linear.noise();
    let residual = linear.leaves(noise);
    let [as_declared, understated, overstated] = [1.0, 3.0, 0.2].map(|scale| linear.check(&(&residual * scale)));
    assert!(!as_declared.is_structured());
    let check = understated.strongest().unwrap();
    println!("{check}");
    assert_eq!(check.test, Test::ReducedChiSquared);
    assert_eq!(understated.checks.iter().filter(|check| check.failed()).count(), 1);
    assert!(!overstated.is_structured());
    let small = find(&overstated, &Test::ReducedChiSquared);
    println!("{small}");
    assert!(small.to_string().contains("overstated"));
    let statistics = |findings: &Findings| -> Vec<(f64, f64)> {
        let rest = findings.checks.iter().filter(|check| check.test != Test::ReducedChiSquared);
        rest.filter_map(|check| check.outcome.as_ref().ok()).map(|o| (o.statistic, o.p_value)).collect()
    };
    for other in [&understated, &overstated] {
        for (a, b) in statistics(&as_declared).iter().zip(statistics(other)) {
            assert!((a.0 - b.0).abs() < 1e-9 * a.0.abs() && (a.1 - b.1).abs() < 1e-6, "{a:?} {b:?}");
        }
    }
}

#[test]
fn repeats_show_a_lack_of_fit_without_sigma() {
    let repeated = |seed: u64, size: f64| {
        let mut linear = Linear::new(60, 12, None, 7000 + seed);
        // Three poses of each setup: rows of the Jacobian are the same, and so is what the model lacks.
        linear.setup = (0..60).map(|pose| pose / 3).collect();
        linear.sigma_is_declared = false;
        for row in 0..180 {
            let first = linear.jacobian.row(row / 9 * 9 + row % 3).into_owned();
            linear.jacobian.set_row(row, &first);
        }
        linear.fitted = factor(&linear.jacobian, None);
        let mut data = linear.noise() * 4.0;
        let lacking: Vec<f64> = (0..60).map(|_| 4.0 * size * normal(&mut linear.random)).collect();
        Linear::displace(&mut data, |pose| Vector3::from_fn(|axis, _| lacking[3 * (pose / 3) + axis]));
        let residual = linear.leaves(data);
        let findings = linear.check(&residual);
        find(&findings, &Test::LackOfFit).clone()
    };
    let p_value = |check: &Check| check.outcome.as_ref().unwrap().p_value;
    let alarms = count(300, |seed| p_value(&repeated(seed, 0.0)) <= 0.05);
    assert!((5..=at_most(300, 0.05)).contains(&alarms), "{alarms} of 300");
    let check = repeated(1, 2.0);
    println!("{check}");
    assert!(check.failed());
}

#[test]
fn outliers_are_named_and_are_not_structure() {
    let mut linear = Linear::new(60, 20, None, 8);
    let mut data = linear.noise();
    let clean = linear.leaves(data.clone());
    assert!(linear.check(&clean).outliers.is_empty());
    Linear::displace(&mut data, |pose| match pose {
        12 => Vector3::new(60.0, 20.0, 0.0),
        40 => Vector3::new(0.0, -12.0, 10.0),
        _ => Vector3::zeros(),
    });
    let residual = linear.leaves(data);
    let findings = linear.check(&residual);
    let check = outliers(&findings);
    println!("{check}");
    assert!(check.failed());
    assert_eq!(check.test, Test::Outliers { worst: Some(12) });
    assert!(check.to_string().starts_with("pose 13 is too far off"));
    assert_eq!(findings.outliers, [12, 40]);
    assert!(!findings.is_structured(), "{:?}", findings.strongest());
}

#[test]
fn left_out_poses_leave_no_trace() {
    let mut linear = Linear::new(60, 20, Some(0.5), 9);
    let mut data = linear.noise();
    let p_values = |findings: &Findings| -> Vec<f64> {
        let rest =
            findings.checks.iter().filter(|check| !matches!(check.test, Test::Outliers { .. } | Test::Normality));
        rest.filter_map(|check| check.outcome.as_ref().ok()).map(|outcome| outcome.p_value).collect()
    };
    let at = |size: f64, data: &mut DVector<f64>| {
        Linear::displace(data, |pose| if pose == 30 { Vector3::new(size, 0.0, size) } else { Vector3::zeros() });
        let taken = linear.fitted.tr_mul(data);
        let residual = &*data - &linear.fitted * taken;
        linear.check(&residual)
    };
    let (near, far) = (at(20.0, &mut data), at(200.0, &mut data));
    assert!(outliers(&near).failed());
    assert_eq!((&near.outliers, &far.outliers), (&vec![30], &vec![30]));
    for (a, b) in p_values(&near).iter().zip(p_values(&far)) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn heavy_tails_are_named() {
    let named = count(30, |seed| {
        let (linear, residual) = heavy_tails(100, 20)(seed);
        find(&linear.check(&residual), &Test::Normality).failed()
    });
    println!("heavy tails are named in {named} of 30");
    assert!(named >= 25);
}

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
    let untestable = |findings: &Findings, why: Untestable| {
        assert!(!findings.is_testable() && !findings.is_structured());
        assert!(findings.checks.iter().all(|check| check.outcome == Err(why.clone())));
    };
    let mut linear = Linear::new(28, 20, None, 11);
    let noise = linear.noise();
    let residual = linear.leaves(noise);
    let driver = |name: &str, values: Vec<f64>| Driver { name: name.to_owned(), values };
    linear.drivers = vec![
        driver("hoist", vec![62.0; 28]),
        driver("temperature", vec![f64::NAN; 28]),
        driver("torque1", vec![1.0; 3]),
    ];
    linear.sigma_is_declared = false;
    let findings = linear.check(&residual);
    let why = |test: Test| find(&findings, &test).outcome.clone().unwrap_err();
    let on = |driver: &str| Test::Dependence { driver: driver.to_owned() };
    assert_eq!(why(on("hoist")), Untestable::Constant);
    assert_eq!(why(on("temperature")), Untestable::NotFinite);
    assert_eq!(why(on("torque1")), Untestable::SizeMismatch);
    assert_eq!(why(Test::ReducedChiSquared), Untestable::NoSigma);
    assert_eq!(why(Test::LackOfFit), Untestable::NoRepeats);
    let sentence = find(&findings, &on("hoist")).to_string();
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
            for check in linear.check(&residual).checks {
                if let Ok(outcome) = &check.outcome {
                    let numbers = [outcome.statistic, outcome.p_value, outcome.bounds.0, outcome.bounds.1];
                    assert!(numbers.iter().all(|number| number.is_finite()), "{check}: {outcome:?}");
                    assert!((0.0..=1.0).contains(&outcome.p_value));
                }
            }
        }
    }
    // A session a pose, times that are no numbers.
    let mut linear = Linear::new(20, 5, None, 15);
    let noise = linear.noise();
    let residual = linear.leaves(noise);
    linear.time[3] = f64::NAN;
    let findings = linear.check(&residual);
    assert_eq!(find(&findings, &Test::Runs { sequence: Sequence::Time }).outcome, Err(Untestable::NotFinite));
    assert!(find(&findings, &Test::Runs { sequence: Sequence::Rows }).outcome.is_ok());
    linear.session = (0..20).collect();
    let findings = linear.check(&residual);
    assert_eq!(find(&findings, &Test::Runs { sequence: Sequence::Rows }).outcome, Err(Untestable::TooFewPoses));
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
        rates.print(&format!("{poses} poses, {unknowns} unknowns, prior {prior:?}, {problems} problems"));
    }
    Rates::of(2000, heavy_tails(28, 32))
        .print("Student's t with 3 degrees of freedom, 28 poses, 32 unknowns, 2000 problems");
    Rates::of(2000, uneven).print("noise twice as large at every other pose, 2000 problems");
    for (poses, unknowns, size) in [(28, 32, 3.0), (28, 32, 6.0), (28, 20, 3.0), (60, 20, 1.0), (200, 32, 0.5)] {
        let all: Vec<Findings> = (0..200).into_par_iter().map(|seed| driven(poses, unknowns, size, seed)).collect();
        let structured = all.iter().filter(|findings| findings.is_structured()).count();
        let on_q2 = all.iter().filter_map(Findings::strongest).filter(|check| check.about() == Some("q2")).count();
        println!(
            "{poses} poses, {unknowns} unknowns, {size} σ of q2: structure {structured}, strongest on q2 {on_q2} of 200"
        );
    }
    for (poses, unknowns) in [(28, 32), (200, 32), (6500, 60)] {
        let mut linear = Linear::new(poses, unknowns, None, 5);
        for k in linear.drivers.len()..20 {
            let values = (0..poses).map(|_| normal(&mut linear.random)).collect();
            linear.drivers.push(Driver { name: format!("torque{k}"), values });
        }
        let noise = linear.noise();
        let residual = linear.leaves(noise);
        for threads in [1, 2] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let start = Instant::now();
            let findings = pool.install(|| linear.check(&residual));
            println!(
                "{poses} poses, {unknowns} unknowns, {} checks, {threads} threads: {:?}",
                findings.checks.len(),
                start.elapsed()
            );
        }
    }
}
