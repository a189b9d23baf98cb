//! Tests of the size of the residuals and of their normality.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use statrs::distribution::{ChiSquared, ContinuousCDF as _, FisherSnedecor, Normal};

use super::chance::Chance;
use super::fit_residual::FitResidual;
use super::judgement::{Trial, Tried};
use super::leverage::Kept;
use super::outcome::{Test, Untestable};

/// Minimum number of residual coordinates for the test of normality.
const MIN_COORDINATES: usize = 8;
/// Lower bound of the probabilities Φ(z) in Anderson and Darling's A², so that their logarithms are
/// finite.
const MIN_TAIL_PROBABILITY: f64 = 1e-300;

/// Tests χ² / ν of the residuals against the declared σ, with ν = 3 N − tr H.
///
/// Without priors ‖r‖² has the χ² distribution with ν degrees of freedom. With priors, residuals
/// have covariance I − H if true parameters scatter as the priors state. ‖r‖² is then close to g χ²
/// with ν / g degrees of freedom, g = tr (I − H)² / ν, which has the same mean and variance
/// [Satterthwaite 1946].
pub(super) fn reduced_chi_squared(fit: &FitResidual, kept: &Kept) -> Tried {
    let freedom = kept.leverage.freedom;
    let factor = kept.leverage.squared_freedom / freedom;
    let trial = if fit.sigma_is_declared {
        let distribution = ChiSquared::new(freedom / factor).map_err(|_| Untestable::NoFreedom);
        distribution.map(|distribution| Trial {
            statistic: kept.residual.norm_squared() / freedom,
            chance: Chance::ChiSquared { distribution, scale: factor / freedom },
            shown: |value| value,
        })
    } else {
        Err(Untestable::NoSigma)
    };
    Tried { test: Test::ReducedChiSquared, trial }
}

/// Tests the variance of the residuals against that of repeated measurements about their mean,
/// which no model explains [Draper and Smith 1998, ch. 2].
///
/// F = ((‖r‖² − P) / (ν − νₚ)) / (P / νₚ), P = Σ |r − r̄|², νₚ = Σ k (n − 1). r̄ is the mean
/// residual of the n poses of the same setup, each with k measured coordinates.
pub(super) fn lack_of_fit(fit: &FitResidual, kept: &Kept) -> Tried {
    Tried { test: Test::LackOfFit, trial: lack_of_fit_trial(fit, kept) }
}

fn lack_of_fit_trial(fit: &FitResidual, kept: &Kept) -> Result<Trial, Untestable> {
    let mut setups = BTreeMap::<usize, (usize, Vec<Vector3<f64>>)>::new();
    for (&pose, residual) in kept.poses.iter().zip(kept.residual.as_slice().chunks_exact(3)) {
        let (_, repeats) =
            setups.entry(fit.setup[pose]).or_insert_with(|| (fit.coordinates_of(pose), Vec::new()));
        repeats.push(Vector3::from_column_slice(residual));
    }
    let (mut pure, mut pure_freedom) = (0.0, 0.0);
    for (numbers, repeats) in setups.values() {
        let mean = repeats.iter().sum::<Vector3<f64>>() / repeats.len() as f64;
        pure += repeats.iter().map(|residual| (residual - mean).norm_squared()).sum::<f64>();
        pure_freedom += *numbers as f64 * (repeats.len() as f64 - 1.0);
    }
    if pure_freedom == 0.0 {
        return Err(Untestable::NoRepeats);
    }
    let freedom = kept.leverage.freedom - pure_freedom;
    let distribution =
        FisherSnedecor::new(freedom, pure_freedom).map_err(|_| Untestable::NoFreedom)?;
    if freedom < 1.0 || pure <= 0.0 {
        return Err(Untestable::NoFreedom);
    }
    let statistic = (kept.residual.norm_squared() - pure) / freedom / (pure / pure_freedom);
    Ok(Trial { statistic, chance: Chance::Fisher { distribution, of: 1.0 }, shown: |value| value })
}

/// Tests all studentised coordinates for normality by Anderson and Darling's test, with estimated
/// mean and variance. Coordinates that are exactly 0, such as those not measured, are left out.
///
/// A² = −n − (1/n) Σᵢ (2i − 1) [ln Φ(z₍ᵢ₎) + ln Φ(−z₍ₙ₊₁₋ᵢ₎)], times 1 + 0.75/n + 2.25/n² [Stephens
/// 1986, in D'Agostino and Stephens, Goodness-of-Fit Techniques, section 4.8.5]
///
/// The fit mixes the noise of many poses in each residual, which makes residuals more normal than
/// the noise. With few poses the test may therefore miss heavy tails, but it does not report false
/// ones.
pub(super) fn anderson_darling(studentised: &[Vector3<f64>]) -> Tried {
    let mut values: Vec<f64> =
        studentised.iter().flatten().copied().filter(|value| *value != 0.0).collect();
    let trial = a_squared(&mut values).map(|statistic| Trial {
        statistic,
        chance: Chance::AndersonDarling,
        shown: |value| value,
    });
    Tried { test: Test::Normality, trial }
}

fn a_squared(values: &mut [f64]) -> Result<f64, Untestable> {
    if values.len() < MIN_COORDINATES {
        return Err(Untestable::TooFewPoses);
    }
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread =
        (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    if !spread.is_normal() {
        return Err(Untestable::Constant);
    }
    let normal = Normal::standard();
    let log = |z: f64| normal.cdf(z).max(MIN_TAIL_PROBABILITY).ln();
    let terms = values.iter().zip(values.iter().rev()).enumerate().map(|(i, (low, high))| {
        (2.0 * i as f64 + 1.0) * (log((low - mean) / spread) + log((mean - high) / spread))
    });
    let squared = -n - terms.sum::<f64>() / n;
    Ok(squared * (1.0 + 0.75 / n + 2.25 / (n * n)))
}
