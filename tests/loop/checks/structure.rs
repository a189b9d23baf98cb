//! Detection of structure in residuals.

use flexcal::residual_tests::{Covariate, ResidualTest, ResidualTests, Sequence, Test};
use nalgebra::Vector3;
use rand::RngExt as _;
use rayon::prelude::*;

use super::linear::{Linear, at_most, count, driven, factor, find, normal};

#[test]
fn a_driver_is_found_and_named() {
    let on_q2 = Test::Dependence { covariate: Covariate::Command(1) };
    let named = count(30, |seed| {
        driven(60, 20, 1.5, seed).strongest().is_some_and(|check| check.test == on_q2)
    });
    println!("q2 is named in {named} of 30");
    assert!(named >= 25);
    let findings = driven(60, 20, 3.0, 1);
    let found = findings.strongest().unwrap();
    println!("{found}");
    assert_eq!((found.about(), found.name()), (Some(Covariate::Command(1)), "dependence"));
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

/// Tests AR(1) noise in the order of time; `shuffled` rows are in another order.
fn following(shuffled: bool, seed: u64) -> ResidualTests {
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
        let all: Vec<ResidualTests> =
            (0..30).into_par_iter().map(|seed| following(shuffled, seed)).collect();
        let failing =
            |test: &Test| all.iter().filter(|findings| find(findings, test).failed()).count();
        let time = Sequence::Time;
        let (runs, correlated) =
            (failing(&Test::Runs { sequence: time }), failing(&Test::LjungBox { sequence: time }));
        println!("shuffled {shuffled}: runs {runs}, Ljung–Box {correlated} of 30");
        assert!(runs >= 25 && correlated >= 27);
        let by_rows = Test::LjungBox { sequence: Sequence::Rows };
        if shuffled {
            assert!(failing(&by_rows) <= 2);
        } else {
            assert!(all[0].tests.iter().all(|check| check.test != by_rows), "one order, one check");
        }
    }
}

#[test]
fn an_understated_sigma_fails_chi_squared_and_nothing_else() {
    let mut linear = Linear::new(28, 20, None, 6);
    let noise = linear.noise();
    let residual = linear.leaves(noise);
    let [as_declared, understated, overstated] =
        [1.0, 3.0, 0.2].map(|scale| linear.check(&(&residual * scale)));
    assert!(!as_declared.is_structured());
    let check = understated.strongest().unwrap();
    println!("{check}");
    assert_eq!(check.test, Test::ReducedChiSquared);
    assert_eq!(understated.tests.iter().filter(|check| check.failed()).count(), 1);
    assert!(!overstated.is_structured());
    let small = find(&overstated, &Test::ReducedChiSquared);
    println!("{small}");
    assert!(small.to_string().contains("overstated"));
    let statistics = |findings: &ResidualTests| -> Vec<(f64, f64)> {
        let rest = findings.tests.iter().filter(|check| check.test != Test::ReducedChiSquared);
        rest.filter_map(|check| check.outcome.as_ref().ok())
            .map(|o| (o.statistic, o.p_value))
            .collect()
    };
    for other in [&understated, &overstated] {
        for (a, b) in statistics(&as_declared).iter().zip(statistics(other)) {
            assert!(
                (a.0 - b.0).abs() < 1e-9 * a.0.abs() && (a.1 - b.1).abs() < 1e-6,
                "{a:?} {b:?}"
            );
        }
    }
}

#[test]
fn repeats_show_a_lack_of_fit_without_sigma() {
    let repeated = |seed: u64, size: f64| {
        let mut linear = Linear::new(60, 12, None, 7000 + seed);
        // Three poses of each setup have equal Jacobian rows and equal unmodelled displacements.
        linear.setup = (0..60).map(|pose| pose / 3).collect();
        linear.sigma_is_declared = false;
        for row in 0..180 {
            let first = linear.jacobian.row(row / 9 * 9 + row % 3).into_owned();
            linear.jacobian.set_row(row, &first);
        }
        linear.fitted = factor(&linear.jacobian, None);
        let mut data = linear.noise() * 4.0;
        let lacking: Vec<f64> = (0..60).map(|_| 4.0 * size * normal(&mut linear.random)).collect();
        Linear::displace(&mut data, |pose| {
            Vector3::from_fn(|axis, _| lacking[3 * (pose / 3) + axis])
        });
        let residual = linear.leaves(data);
        let findings = linear.check(&residual);
        find(&findings, &Test::LackOfFit).clone()
    };
    let p_value = |check: &ResidualTest| check.outcome.as_ref().unwrap().p_value;
    let alarms = count(300, |seed| p_value(&repeated(seed, 0.0)) <= 0.05);
    assert!((5..=at_most(300, 0.05)).contains(&alarms), "{alarms} of 300");
    let check = repeated(1, 2.0);
    println!("{check}");
    assert!(check.failed());
}
