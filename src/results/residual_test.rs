//! Tests of the residual of a fit.

use schemars::JsonSchema;
use serde::Serialize;

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
