//! All residual tests of one fit.

use std::borrow::Cow;

use super::fit_residual::{CovariateValues, FitResidual};
use super::judgement::{Trial, Tried, judge};
use super::leverage::{Kept, Leverage};
use super::outcome::{ResidualTests, Sequence, Test, Untestable};
use super::outliers;
use super::permutation;
use super::size;
use super::statistic::{Cumulative, Sample, Statistic, sequences};

/// Tests the residual of a fit. `level` is the probability that noise alone makes at least one test
/// fail; `seed` seeds the permutations.
///
/// The tests come in a fixed order: χ², lack of fit, runs, Ljung–Box, each covariate, outliers,
/// normality. Runs and Ljung–Box use the order of time, and that of the rows if it differs. All
/// tests except the last two use the fit without outliers. Holm's procedure judges all tests
/// together at that level. Outliers and normality take part in it, but are not structure, because
/// no effect explains them.
pub fn test_residual(fit: &FitResidual, level: f64, seed: u64) -> ResidualTests {
    let poses = fit.residual.len() / 3;
    let leverage = match fit
        .check_input()
        .and_then(|()| {
            Leverage::new(
                Cow::Borrowed(fit.fitted),
                (0..poses).map(|pose| fit.coordinates_of(pose)).collect(),
            )
        })
        .and_then(|leverage| fit.check_above_rounding().map(|()| leverage))
    {
        Ok(leverage) => leverage,
        Err(why) => return judge(all_untestable(fit, &why), level, Vec::new()),
    };
    let studentised = leverage.studentise(fit.residual.as_slice());
    // A pose that is removed at the level of one test of the largest possible number also fails in
    // Holm's procedure.
    let max_tests = fit.covariates.len() + 8;
    let found = outliers::find(fit, &leverage, level / max_tests as f64);
    let kept = found.kept.unwrap_or_else(|| Kept::all(fit, leverage));
    let mut tried = vec![size::reduced_chi_squared(fit, &kept), size::lack_of_fit(fit, &kept)];
    tried.extend(order_and_dependence_tests(fit, &kept, seed));
    tried.push(found.tried);
    tried.push(size::anderson_darling(&studentised));
    judge(tried, level, (0..poses).filter(|pose| kept.poses.binary_search(pose).is_err()).collect())
}

/// Returns the tests of order (runs and Ljung–Box) and of dependence on each covariate, for the
/// kept poses.
fn order_and_dependence_tests(fit: &FitResidual, kept: &Kept, seed: u64) -> Vec<Tried> {
    let statistics = statistics(fit, &kept.poses);
    let working: Vec<&Statistic> =
        statistics.iter().filter_map(|(_, statistic)| statistic.as_ref().ok()).collect();
    let studentised = kept.leverage.studentise(kept.residual.as_slice());
    let mut null_distributions =
        permutation::null_distributions(&kept.leverage, &studentised, &working, seed).into_iter();
    let coordinates: Vec<[f64; 3]> = studentised.into_iter().map(Into::into).collect();
    let sample = Sample::of([&coordinates]);
    let tried = statistics.iter().map(|(test, statistic)| {
        let trial = statistic.as_ref().map_err(Clone::clone).and_then(|statistic| {
            let chance = null_distributions.next().flatten().ok_or(Untestable::NoFreedom)?;
            let shown =
                if matches!(test, Test::Dependence { .. }) { f64::sqrt } else { |value| value };
            let [statistic] = statistic.evaluate(&sample);
            Ok(Trial { statistic, chance, shown })
        });
        Tried { test: test.clone(), trial }
    });
    tried.collect()
}

/// Returns the tests of order and of dependence with their statistics for some poses. `Err` is the
/// reason why a statistic cannot be computed.
fn statistics(fit: &FitResidual, poses: &[usize]) -> Vec<(Test, Result<Statistic, Untestable>)> {
    let mut statistics = Vec::new();
    for (sequence, order) in sequences(fit, poses) {
        let order = order.map(std::sync::Arc::new);
        statistics.push((Test::Runs { sequence }, order.clone().map(Statistic::Runs)));
        statistics.push((Test::LjungBox { sequence }, order.map(Statistic::LjungBox)));
    }
    for CovariateValues { covariate, values } in fit.covariates {
        let statistic = Cumulative::new(values, fit.residual.len() / 3, poses);
        statistics.push((
            Test::Dependence { covariate: covariate.clone() },
            statistic.map(Statistic::Dependence),
        ));
    }
    statistics
}

/// Returns every test with `why` as the reason why it cannot be made.
fn all_untestable(fit: &FitResidual, why: &Untestable) -> Vec<Tried> {
    let sequence = if fit.time.is_empty() { Sequence::Rows } else { Sequence::Time };
    let mut tests = vec![
        Test::ReducedChiSquared,
        Test::LackOfFit,
        Test::Runs { sequence },
        Test::LjungBox { sequence },
    ];
    tests.extend(
        fit.covariates.iter().map(|of| Test::Dependence { covariate: of.covariate.clone() }),
    );
    tests.extend([Test::Outliers { worst: None }, Test::Normality]);
    tests.into_iter().map(|test| Tried { test, trial: Err(why.clone()) }).collect()
}
