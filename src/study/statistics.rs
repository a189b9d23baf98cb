//! What the residual of a fit says about its unknowns.

use nalgebra::DVector;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::fitting::FitEnd;
use super::stage::Stage;
use crate::fit::{LeastSquares as _, Uncertainty, residual_vector};

/// A χ² this improbable under the declared σ means that σ is understated.
const IMPROBABLE: f64 = 1e-3;
/// Correlations beyond this are reported.
const STRONG: f64 = 0.9;

/// Errors and correlations of the unknowns of a fit.
#[derive(Debug, Clone)]
pub(super) struct Statistics {
    /// Standard error of each unknown.
    pub errors: Vec<f64>,
    /// Part of each unknown that the data gave, 0…1.
    pub identified: Vec<f64>,
    /// Pairs of unknowns correlated by more than 0.9, strongest first.
    pub correlations: Vec<(usize, usize, f64)>,
    /// χ² over its degrees of freedom; `None` without any.
    pub reduced_chi2: Option<f64>,
    /// By how much the assumed variance was raised, ≥ 1.
    pub noise_factor: f64,
}

impl Statistics {
    /// Of a stage that ended at `end`.
    ///
    /// The model's errors count as noise: where χ² / ν is beyond chance under a declared σ, the variance is raised by it.
    pub fn of(stage: &Stage, end: &FitEnd, noise_is_declared: bool) -> Self {
        let residuals = stage.residuals(&end.x);
        let x: DVector<f64> = residuals.reduced(&end.x);
        let chi2 = residual_vector(&residuals, &x).norm_squared();
        let triangle = stage.data_triangle(&end.x);
        let priors: Vec<Option<f64>> = stage.parameters().map(|parameter| parameter.sigma).collect();
        let held: Vec<bool> = end.at_bound.iter().map(Option::is_some).collect();
        let of = |factor| Uncertainty::of(&triangle, &priors, &end.gauge.rows, &held, factor);
        let mut uncertainty = of(1.0);
        let freedom = (residuals.items() * residuals.rows_per_item()) as f64 - uncertainty.effective_parameters;
        let noise_factor = if noise_is_declared { raised(chi2, freedom) } else { 1.0 };
        if noise_factor > 1.0 {
            uncertainty = of(noise_factor);
        }
        let errors = uncertainty.standard_errors();
        // What can be seen at the start may have run out of sight on the way, a rigidity towards infinity for one.
        let visible = stage.gauge(&end.x).visible;
        let identified = (0..errors.len())
            .map(|j| match priors[j] {
                _ if held[j] => 0.0,
                Some(sigma) => (1.0 - (errors[j] / sigma).powi(2)).clamp(0.0, 1.0),
                None => end.gauge.visible[j].min(visible[j]),
            })
            .collect();
        Self {
            correlations: uncertainty.correlations_above(STRONG),
            errors,
            identified,
            reduced_chi2: (freedom > 0.5).then_some(chi2 / freedom),
            noise_factor,
        }
    }
}

/// χ² / ν where that is beyond chance, else 1.
fn raised(chi2: f64, freedom: f64) -> f64 {
    let beyond_chance =
        freedom > 0.5 && ChiSquared::new(freedom).is_ok_and(|distribution| distribution.sf(chi2) < IMPROBABLE);
    if beyond_chance { (chi2 / freedom).max(1.0) } else { 1.0 }
}
