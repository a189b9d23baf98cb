//! Whether structure is left in the residual of a fit: statistical tests, each with its bounds under chance.
//!
//! A fitted residual r = (I − H) ε is neither independent nor equally scattered from pose to pose. So the residual of each
//! pose is studentised by its own leverage, and the tests of order and dependence learn from permuted residuals, fitted
//! again, what chance does.
//!
//! - [`leverage`], [`deletion`], [`draws`]: studentised residuals, poses left out, permutations.
//! - [`size`], [`outliers`], [`normality`]: how large the residuals are, and how they scatter.
//! - [`order`], [`dependence`]: whether they follow one another, or a covariate.
//! - [`chance`], [`judgement`], [`outcome`], [`sentence`]: p-values, the verdict of all tests together, and words for it.

mod chance;
mod deletion;
mod dependence;
mod draws;
mod judgement;
mod leverage;
mod normality;
mod order;
mod outcome;
mod outliers;
mod sentence;
mod size;
mod statistic;

use nalgebra::{DMatrix, DVector};

use deletion::Kept;
use judgement::{ALPHA, Trial, Tried, judge};
use leverage::Leverage;
use statistic::{Sample, Statistic};

use super::covariate::Covariate;
use super::neighbourhood::LEAST_SCATTER;

pub use outcome::{Findings, Outcome, ResidualTest, Sequence, Test, Untestable};

/// Degrees of freedom below which nothing is tested.
const LEAST_FREEDOM: f64 = 4.0;
/// Poses below which order and dependence are not tested.
const LEAST_POSES: usize = 5;

/// Something that the residuals may depend on, pose by pose.
#[derive(Debug, Clone, PartialEq)]
pub struct CovariateValues {
    /// What it is.
    pub covariate: Covariate,
    /// One value per pose, any unit.
    pub values: Vec<f64>,
}

/// What a fit leaves, as the checks see it: N poses, p fitted directions.
#[derive(Debug, Clone, Copy)]
pub struct FitResidual<'a> {
    /// Whitened residuals (measured − predicted) / σ, measuring frame, pose after pose, shape = (3 N).
    pub residual: &'a DVector<f64>,
    /// Q, shape = (3 N, p): H = Q Qᵀ takes data to fitted values.
    ///
    /// The data's rows of the thin orthonormal factor of [J; prior rows]: with priors, H has eigenvalues between 0 and 1.
    pub fitted: &'a DMatrix<f64>,
    /// Whether σ was declared; one that was estimated from the residuals says nothing about their size.
    pub sigma_is_declared: bool,
    /// Time of each pose, any unit and origin.
    pub time: &'a [f64],
    /// Session of each pose, as a number.
    pub session: &'a [usize],
    /// Setup of each pose, as a number: poses with the same one are repeats, for which the model predicts the same position.
    pub setup: &'a [usize],
    /// What the residuals may depend on.
    pub covariates: &'a [CovariateValues],
}

/// Tests what a fit leaves; `seed` draws the permutations.
///
/// The checks come in a fixed order: χ², lack of fit, runs and Ljung–Box in the order of time (and of the rows, where that
/// is another), each covariate, outliers, normality. Outliers are left out of all but these last two, with their pull on the
/// fit undone. The judgement is Holm's over all checks at the family-wise level 0.01; outliers and normality take part in it,
/// but are not structure, since no effect explains them.
pub fn test_residual(fit: &FitResidual, seed: u64) -> Findings {
    let poses = fit.residual.len() / 3;
    let leverage =
        match testable(fit).and_then(|()| Leverage::of(fit.fitted)).and_then(|all| above_rounding(fit).map(|()| all)) {
            Ok(leverage) => leverage,
            Err(why) => return judge(all_untestable(fit, &why), Vec::new()),
        };
    let studentised = leverage.studentise(fit.residual.as_slice());
    // At most so many checks: what is left out fails in the judgement, too.
    let most = fit.covariates.len() + 8;
    let found = outliers::find(fit, &leverage, ALPHA / most as f64);
    let kept = found.kept.unwrap_or_else(|| Kept::all(fit, leverage));
    let mut tried = vec![size::reduced_chi_squared(fit, &kept), size::lack_of_fit(fit, &kept)];
    tried.extend(permuted(fit, &kept, seed));
    tried.push(found.tried);
    tried.push(normality::anderson_darling(&studentised));
    judge(tried, (0..poses).filter(|pose| kept.poses.binary_search(pose).is_err()).collect())
}

/// The tests of order and dependence.
fn permuted(fit: &FitResidual, kept: &Kept, seed: u64) -> Vec<Tried> {
    let statistics = statistics(fit, &kept.poses);
    let working: Vec<&Statistic> = statistics.iter().filter_map(|(_, statistic)| statistic.as_ref().ok()).collect();
    let studentised = kept.leverage.studentise(kept.residual.as_slice());
    let sample = Sample::of(studentised.clone());
    let mut chances = draws::chances(&kept.leverage, &studentised, &working, seed).into_iter();
    let tried = statistics.iter().map(|(test, statistic)| {
        let trial = statistic.as_ref().map_err(Clone::clone).and_then(|statistic| {
            let chance = chances.next().flatten().ok_or(Untestable::NoFreedom)?;
            let shown = if matches!(test, Test::Dependence { .. }) { f64::sqrt } else { |value| value };
            Ok(Trial { statistic: statistic.of(&sample), chance, shown })
        });
        Tried { test: test.clone(), trial }
    });
    tried.collect()
}

/// The statistics of order and dependence on some of the poses, or why there is none.
fn statistics(fit: &FitResidual, poses: &[usize]) -> Vec<(Test, Result<Statistic, Untestable>)> {
    let mut all = Vec::new();
    for (sequence, order) in order::sequences(fit, poses) {
        let order = order.map(std::sync::Arc::new);
        all.push((Test::Runs { sequence }, order.clone().map(Statistic::Runs)));
        all.push((Test::LjungBox { sequence }, order.map(Statistic::LjungBox)));
    }
    for CovariateValues { covariate, values } in fit.covariates {
        let statistic = dependence::Cumulative::of(values, fit.residual.len() / 3, poses);
        all.push((Test::Dependence { covariate: *covariate }, statistic.map(Statistic::Dependence)));
    }
    all
}

/// Whether the input makes sense.
fn testable(fit: &FitResidual) -> Result<(), Untestable> {
    let rows = fit.residual.len();
    let poses = rows / 3;
    let shapes = rows == 3 * poses
        && fit.fitted.nrows() == rows
        && [fit.time.len(), fit.session.len(), fit.setup.len()] == [poses; 3];
    if !shapes {
        return Err(Untestable::SizeMismatch);
    }
    let finite = fit.residual.iter().chain(fit.fitted.iter()).all(|value| value.is_finite());
    if finite { Ok(()) } else { Err(Untestable::NotFinite) }
}

/// A residual far below a declared σ is rounding.
fn above_rounding(fit: &FitResidual) -> Result<(), Untestable> {
    let size = fit.residual.norm_squared() / fit.residual.len().max(1) as f64;
    let is_rounding = fit.sigma_is_declared && size < LEAST_SCATTER.powi(2);
    if is_rounding { Err(Untestable::Rounding) } else { Ok(()) }
}

/// Every check, with the same reason why it is not testable.
fn all_untestable(fit: &FitResidual, why: &Untestable) -> Vec<Tried> {
    let sequence = Sequence::Time;
    let mut tests =
        vec![Test::ReducedChiSquared, Test::LackOfFit, Test::Runs { sequence }, Test::LjungBox { sequence }];
    tests.extend(fit.covariates.iter().map(|of| Test::Dependence { covariate: of.covariate }));
    tests.extend([Test::Outliers { worst: None }, Test::Normality]);
    tests.into_iter().map(|test| Tried { test, trial: Err(why.clone()) }).collect()
}
