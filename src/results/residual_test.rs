//! Tests of the residual of a fit, and its size compared with the declared noise.

use schemars::JsonSchema;
use serde::Serialize;

use crate::fit::{FindingCode, Identification, Noise};
use crate::residual_tests::{self, Covariate, ResidualTests};

/// Test of the residual for size or structure.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ResidualTest {
    /// Name of the test.
    pub check: &'static str,
    /// Quantity whose influence is tested, or that orders the poses; null if there is none.
    pub about: Option<String>,
    /// True if a failure indicates structure that an effect could explain.
    pub structure: bool,
    pub failed: bool,
    /// Value of the statistic; null if the test could not be made.
    pub statistic: Option<f64>,
    /// Lower and upper limit of the statistic if only noise is left, at the level of the test.
    pub bounds: Option<(f64, f64)>,
    pub p_value: Option<f64>,
    pub words: String,
}

impl ResidualTest {
    /// Lists the tests in the order in which they were made.
    pub(super) fn all(tests: &ResidualTests) -> Vec<Self> {
        let about = |covariate: Covariate| match covariate {
            Covariate::Row => "rows".to_owned(),
            covariate => covariate.to_string(),
        };
        let entry = |test: &residual_tests::ResidualTest| {
            let outcome = test.outcome.as_ref().ok();
            Self {
                check: test.name(),
                about: test.about().map(about),
                structure: test.tests_structure(),
                failed: test.failed(),
                statistic: outcome.map(|outcome| outcome.statistic),
                bounds: outcome.map(|outcome| outcome.bounds),
                p_value: outcome.map(|outcome| outcome.p_value),
                words: test.to_string(),
            }
        };
        tests.tests.iter().map(entry).collect()
    }
}

/// Returns the test of the size of a residual against the declared σ, with its χ²/ν; `None` if the
/// test could not be made.
pub(super) fn size_test(tests: &[ResidualTest]) -> Option<(&ResidualTest, f64)> {
    let test = tests.iter().find(|test| test.check == "reduced-chi-squared")?;
    Some((test, test.statistic?))
}

/// Returns the ratio √(χ²/ν) of a residual to the declared σ if it is significantly above 1 and no
/// other test of structure fails.
pub(super) fn size_alone(tests: &[ResidualTest]) -> Option<f64> {
    let (size, chi2) = size_test(tests)?;
    let failed = tests.iter().filter(|test| test.structure && test.failed);
    (failed.count() == 1 && size.failed && chi2 > 1.0).then(|| chi2.sqrt())
}

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
