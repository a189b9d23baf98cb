//! Whether residuals are larger than noise.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use statrs::distribution::{ChiSquared, FisherSnedecor};

use super::FitResidual;
use super::chance::Chance;
use super::deletion::Kept;
use super::judgement::{Trial, Tried};
use super::outcome::{Test, Untestable};

/// χ² / ν of the residuals against the declared σ, with ν = 3 N − tr H.
///
/// Without priors ‖r‖² has the χ² distribution with ν degrees of freedom. With priors, a fit that the truth leaves as the
/// priors say has residuals of covariance I − H, and ‖r‖² is close to g χ² with ν / g degrees of freedom,
/// g = tr (I − H)² / ν, which has the same mean and variance [Satterthwaite 1946].
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

/// Variance of the residuals beside that of repeats about their mean, which no model explains [Draper and Smith 1998, ch. 2].
///
/// F = ((‖r‖² − P) / (ν − νₚ)) / (P / νₚ),  P = Σ |r − r̄ of the same setup|²,  νₚ = 3 Σ (repeats − 1)
pub(super) fn lack_of_fit(fit: &FitResidual, kept: &Kept) -> Tried {
    Tried { test: Test::LackOfFit, trial: ratio(fit, kept) }
}

fn ratio(fit: &FitResidual, kept: &Kept) -> Result<Trial, Untestable> {
    let mut setups = BTreeMap::<usize, Vec<Vector3<f64>>>::new();
    for (&pose, residual) in kept.poses.iter().zip(kept.residual.as_slice().chunks_exact(3)) {
        setups.entry(fit.setup[pose]).or_default().push(Vector3::from_column_slice(residual));
    }
    let (mut pure, mut pure_freedom) = (0.0, 0.0);
    for repeats in setups.values() {
        let mean = repeats.iter().sum::<Vector3<f64>>() / repeats.len() as f64;
        pure += repeats.iter().map(|residual| (residual - mean).norm_squared()).sum::<f64>();
        pure_freedom += 3.0 * (repeats.len() as f64 - 1.0);
    }
    if pure_freedom == 0.0 {
        return Err(Untestable::NoRepeats);
    }
    let freedom = kept.leverage.freedom - pure_freedom;
    let distribution = FisherSnedecor::new(freedom, pure_freedom).map_err(|_| Untestable::NoFreedom)?;
    if freedom < 1.0 || pure <= 0.0 {
        return Err(Untestable::NoFreedom);
    }
    let statistic = (kept.residual.norm_squared() - pure) / freedom / (pure / pure_freedom);
    Ok(Trial { statistic, chance: Chance::Fisher { distribution, of: 1.0 }, shown: |value| value })
}
