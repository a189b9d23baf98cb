//! Size of the residual of a fit, compared with the declared noise.

use crate::fit::{FindingCode, Identification, Noise};

/// Largest relative difference between the fit's variance and the declared σ² at which they count
/// as equal.
const MAX_EQUAL_DIFFERENCE: f64 = 1e-9;

/// Verdict on the size of a fit's residual in comparison with the declared noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ResidualSize {
    /// No σ is declared. The value is the 1 σ of a coordinate, estimated from the residual \[m\] or
    /// \[rad\].
    Undeclared(f64),
    /// No σ is declared, and there are no degrees of freedom to estimate it.
    Unknown,
    /// There are too few different poses to judge the declared σ or the model.
    TooFewPoses,
    /// There are too few measurements to judge the declared σ.
    TooFewRows,
    /// The value χ²/ν is inside the interval that noise alone leads to expect.
    Expected(f64),
    /// The value χ²/ν is outside the interval that noise alone leads to expect, but no other σ is
    /// clearly better.
    Unclear(f64),
    /// Residuals and priors contradict the declared σ, and the fit assumes another one. The value
    /// is χ²/ν.
    Contradicted(f64),
}

impl ResidualSize {
    /// Judges the size of the residual of a fit.
    pub fn of(found: &Identification) -> Self {
        let too_few =
            found.has(FindingCode::PriorsDecide) || found.has(FindingCode::TooFewEquations);
        let is_expected =
            |chi2: f64| found.chance.is_none_or(|(low, high)| (low..=high).contains(&chi2));
        match (found.noise, found.reduced_chi2) {
            (Noise::Estimated(sigma), _) => Self::Undeclared(sigma),
            (Noise::Unknown, _) => Self::Unknown,
            (Noise::Declared, Some(_)) if too_few => Self::TooFewPoses,
            (Noise::Declared, None) => Self::TooFewRows,
            (Noise::Declared, Some(chi2)) if is_contradicted(found) => Self::Contradicted(chi2),
            (Noise::Declared, Some(chi2)) if is_expected(chi2) => Self::Expected(chi2),
            (Noise::Declared, Some(chi2)) => Self::Unclear(chi2),
        }
    }
}

/// Returns true if residuals and priors contradict the declared σ, so that the fit assumed another
/// σ.
fn is_contradicted(found: &Identification) -> bool {
    found.noise == Noise::Declared && (found.noise_factor - 1.0).abs() > MAX_EQUAL_DIFFERENCE
}

/// Returns true if the residual is significantly larger than the declared noise; false if no noise
/// is declared.
pub fn exceeds_noise(found: &Identification) -> bool {
    let is_large = |(chi2, (_, high)): (f64, (f64, f64))| chi2 > high;
    let by_chi2 = || found.reduced_chi2.zip(found.chance).is_some_and(is_large);
    let by_scatter = is_contradicted(found).then_some(found.noise_factor > 1.0);
    found.noise == Noise::Declared && by_scatter.unwrap_or_else(by_chi2)
}
