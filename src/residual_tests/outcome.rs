//! Results of the residual tests.

use std::fmt;

use super::covariate::Covariate;
use crate::error::Location;

/// Order in which poses are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Sequence {
    /// Order by recorded time, within each session.
    Time,
    /// Order of the rows in the files, within each session.
    Rows,
}

/// Test of the residual of a fit.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Test {
    /// Size against the declared σ; statistic: χ² / ν.
    ReducedChiSquared,
    /// Size against the scatter of repeated poses; statistic: ratio F of both variances.
    LackOfFit,
    /// Runs of equal sign in an order of the poses; statistic: fraction of the steps from pose to
    /// pose at which a coordinate keeps its sign.
    Runs {
        /// Order of the poses.
        sequence: Sequence,
    },
    /// Autocorrelation in an order of the poses; statistic: Ljung and Box's Q.
    LjungBox {
        /// Order of the poses.
        sequence: Sequence,
    },
    /// Dependence of the mean residual on a covariate; statistic: a distance correlation, 0…1.
    Dependence {
        /// Covariate whose influence is tested.
        covariate: Covariate,
    },
    /// Poses whose residual is too large to be noise; statistic: length of the largest studentised
    /// residual of a pose, in units of the scatter of the other poses.
    Outliers {
        /// Index of the pose with the largest statistic, from 0; `None` if no pose can be tested.
        worst: Option<usize>,
    },
    /// Normality of the residual coordinates; statistic: Anderson and Darling's A².
    Normality,
}

/// Reason why a test cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Untestable {
    /// The fit leaves too few degrees of freedom.
    #[error("the fit leaves too few degrees of freedom")]
    NoFreedom,
    /// Too few poses: a test of order needs five in one session, a test of dependence five in all,
    /// a test of normality eight coordinates.
    #[error("too few poses")]
    TooFewPoses,
    /// The covariate (in the test of normality: the residual) has the same value in all poses.
    #[error("it is the same at every pose")]
    Constant,
    /// The problem declares no σ.
    #[error("no σ is declared")]
    NoSigma,
    /// The residual is below a thousandth of σ.
    #[error("the residual is below a thousandth of σ: rounding")]
    Rounding,
    /// No pose was measured twice under the same conditions.
    #[error("no pose was measured twice under the same conditions")]
    NoRepeats,
    /// A residual, a time, a covariate or an entry of Q is not a finite number.
    #[error("a value is not a finite number")]
    NotFinite,
    /// Residuals, fitted directions, labels or covariates differ in their number of poses.
    #[error("residuals and labels differ in their number of poses")]
    SizeMismatch,
}

/// Result of a test that was made.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Value of the statistic, as shown to users.
    pub statistic: f64,
    /// Lower and upper bound of the statistic under noise alone, at the level at which Holm's
    /// procedure judges the test.
    ///
    /// A statistic above the upper bound fails. One below the lower bound (of χ² / ν alone; else 0)
    /// shows an overstated σ.
    pub bounds: (f64, f64),
    /// Uncorrected p-value of the statistic, for this test alone.
    pub p_value: f64,
    /// True if the test failed after correction for all tests.
    pub failed: bool,
}

/// Test with its result; its `Display` is a sentence for users.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualTest {
    /// Test that was made.
    pub test: Test,
    /// Result, or the reason why the test cannot be made.
    pub outcome: Result<Outcome, Untestable>,
    /// Row of the worst outlier in the test of outliers, if it is known.
    pub row: Option<Location>,
}

impl ResidualTest {
    /// Returns the short name of the test.
    pub fn name(&self) -> &'static str {
        match self.test {
            Test::ReducedChiSquared => "reduced-chi-squared",
            Test::LackOfFit => "lack-of-fit",
            Test::Runs { .. } => "runs",
            Test::LjungBox { .. } => "ljung-box",
            Test::Dependence { .. } => "dependence",
            Test::Outliers { .. } => "outliers",
            Test::Normality => "normality",
        }
    }

    /// Returns the covariate whose influence is tested; for a test of order it is time or row
    /// number. Returns `None` for the other tests.
    pub fn about(&self) -> Option<Covariate> {
        match &self.test {
            Test::Dependence { covariate } => Some(covariate.clone()),
            Test::Runs { sequence } | Test::LjungBox { sequence } => Some(match sequence {
                Sequence::Time => Covariate::Time,
                Sequence::Rows => Covariate::Row,
            }),
            Test::ReducedChiSquared | Test::LackOfFit | Test::Outliers { .. } | Test::Normality => {
                None
            }
        }
    }

    /// Returns true if a failure of the test indicates structure that an effect could explain.
    /// Outlier and normality tests are no tests of structure.
    pub fn tests_structure(&self) -> bool {
        !matches!(self.test, Test::Outliers { .. } | Test::Normality)
    }

    /// Returns true if the test failed.
    pub fn failed(&self) -> bool {
        self.outcome.as_ref().is_ok_and(|outcome| outcome.failed)
    }
}

/// Results of all tests of a residual.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualTests {
    /// All tests, including those that cannot be made.
    pub tests: Vec<ResidualTest>,
    /// Indices of the poses that were left out of the tests as outliers, counted from 0. The tests
    /// of outliers and of normality include them.
    pub outliers: Vec<usize>,
}

impl ResidualTests {
    /// Returns true if a test of structure failed at the family-wise level.
    pub fn is_structured(&self) -> bool {
        self.strongest().is_some()
    }

    /// Returns the failed test of structure with the smallest p-value; `None` if none failed.
    pub fn strongest(&self) -> Option<&ResidualTest> {
        let p_value = |test: &ResidualTest| {
            test.outcome.as_ref().map_or(f64::INFINITY, |outcome| outcome.p_value)
        };
        let failed = self.tests.iter().filter(|test| test.tests_structure() && test.failed());
        failed.min_by(|a, b| p_value(a).total_cmp(&p_value(b)))
    }

    /// Returns true if at least one test of structure could be made.
    pub fn is_testable(&self) -> bool {
        self.tests.iter().any(|test| test.tests_structure() && test.outcome.is_ok())
    }
}

impl fmt::Display for ResidualTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.outcome {
            Ok(outcome) => write_tested(self, outcome, f),
            Err(why) => write!(f, "{} not tested: {why}", untested_phrase(&self.test)),
        }
    }
}

fn write_tested(
    ResidualTest { test, row, .. }: &ResidualTest,
    outcome: &Outcome,
    f: &mut fmt::Formatter<'_>,
) -> fmt::Result {
    let Outcome { statistic, bounds: (from, to), failed, .. } = outcome;
    let expected = format!("expected up to {to:.2} if only noise is left");
    match test {
        Test::ReducedChiSquared => {
            let size = match (failed, statistic < from) {
                (true, _) => "residuals are larger than σ explains",
                (false, true) => "residuals are not larger than σ; σ is overstated",
                (false, false) => "residuals are as large as σ",
            };
            write!(
                f,
                "{size} (χ²/ν {statistic:.2}, expected {from:.2} to {to:.2} if only noise is left)"
            )
        }
        Test::LackOfFit => {
            let size = if *failed { "larger than" } else { "as large as" };
            write!(
                f,
                "residuals are {size} the scatter of repeated poses (F {statistic:.2}, {expected})"
            )
        }
        Test::Runs { sequence } => {
            let sign = if *failed { "keep their sign too often" } else { "change sign like noise" };
            let percent = (100.0 * statistic, 100.0 * to);
            write!(
                f,
                "residuals {sign} {} (the sign stays at {:.0} % of the steps, expected up to \
                 {:.0} %)",
                order_phrase(*sequence),
                percent.0,
                percent.1
            )
        }
        Test::LjungBox { sequence } => {
            let follow =
                if *failed { "are autocorrelated" } else { "are not significantly autocorrelated" };
            write!(
                f,
                "residuals {follow} {} (Ljung–Box {statistic:.1}, expected up to {to:.1})",
                order_phrase(*sequence)
            )
        }
        Test::Dependence { covariate } => {
            let depend = if *failed { "depend" } else { "do not depend significantly" };
            write!(
                f,
                "residuals {depend} on {covariate} (distance correlation {statistic:.2}, \
                 {expected})"
            )
        }
        Test::Outliers { worst } => {
            let pose = match (row, worst) {
                (Some(row), _) => row.to_string(),
                (None, Some(pose)) => format!("pose {}", pose + 1),
                (None, None) => "one pose".to_owned(),
            };
            let size = if *failed {
                "is an outlier: a gross error, or an effect that acts in few poses"
            } else {
                "has the largest residual, which is not significant"
            };
            write!(f, "{pose} {size} ({statistic:.1} × the scatter, expected up to {to:.1})")
        }
        Test::Normality => {
            let normal = if *failed { "are not" } else { "may be" };
            write!(
                f,
                "residuals {normal} normally distributed (Anderson–Darling {statistic:.2}, \
                 {expected})"
            )
        }
    }
}

fn order_phrase(sequence: Sequence) -> &'static str {
    match sequence {
        Sequence::Time => "in the order of time",
        Sequence::Rows => "in the order of the rows",
    }
}

fn untested_phrase(test: &Test) -> String {
    match test {
        Test::ReducedChiSquared => "size of the residual against σ".to_owned(),
        Test::LackOfFit => "size of the residual against the scatter of repeated poses".to_owned(),
        Test::Runs { sequence } => format!("signs {}", order_phrase(*sequence)),
        Test::LjungBox { sequence } => format!("autocorrelation {}", order_phrase(*sequence)),
        Test::Dependence { covariate } => format!("dependence on {covariate}"),
        Test::Outliers { .. } => "outliers".to_owned(),
        Test::Normality => "normal distribution".to_owned(),
    }
}
