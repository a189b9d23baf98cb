//! What the residual tests found.

use crate::diagnose::covariate::Covariate;

/// An order of the poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sequence {
    /// By time, session by session.
    Time,
    /// As the rows stand in the files, session by session.
    Rows,
}

/// A test of what a fit leaves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Test {
    /// Size against the declared σ; statistic: χ² / ν.
    ReducedChiSquared,
    /// Size against the scatter of repeats; statistic: the ratio of both variances, F.
    LackOfFit,
    /// Runs of equal sign in some order; statistic: share of steps from pose to pose at which a coordinate keeps its sign.
    Runs {
        /// The order.
        sequence: Sequence,
    },
    /// Autocorrelation in some order; statistic: Ljung and Box's Q.
    LjungBox {
        /// The order.
        sequence: Sequence,
    },
    /// Dependence of the mean residual on a covariate; statistic: a distance correlation, 0…1.
    Dependence {
        /// Which.
        covariate: Covariate,
    },
    /// Poses too far off to be noise; statistic: the largest distance in units of the others' scatter.
    Outliers {
        /// The pose that is farthest off.
        worst: Option<usize>,
    },
    /// Normal distribution; statistic: Anderson and Darling's A².
    Normality,
}

/// Why a check says nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Untestable {
    /// The fit leaves (nearly) no degrees of freedom.
    #[error("the fit leaves too few degrees of freedom")]
    NoFreedom,
    /// Too few poses in any session.
    #[error("too few poses")]
    TooFewPoses,
    /// The covariate has the same value everywhere.
    #[error("it is the same at every pose")]
    Constant,
    /// No σ was declared.
    #[error("no σ is declared")]
    NoSigma,
    /// The residual is below a thousandth of σ.
    #[error("the residual is below a thousandth of σ: rounding")]
    Rounding,
    /// No setup was measured more than once.
    #[error("no setup was measured twice")]
    NoRepeats,
    /// A value is not a finite number.
    #[error("a value is not a finite number")]
    NotFinite,
    /// Residuals, fitted directions, labels or covariates differ in their number of poses.
    #[error("residuals and labels differ in their number of poses")]
    SizeMismatch,
}

/// What a test found.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Its value.
    pub statistic: f64,
    /// Where chance keeps it, from and to, at the level at which Holm's procedure judges this check.
    ///
    /// Above is what fails; below the lower bound (of χ² / ν alone; else 0) σ is overstated.
    pub bounds: (f64, f64),
    /// Probability that chance alone gives as much, by itself.
    pub p_value: f64,
    /// Whether it failed, all checks together taken into account.
    pub failed: bool,
}

/// One check; its `Display` is a sentence for people.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualTest {
    /// What was tested.
    pub test: Test,
    /// What came of it, or why nothing did.
    pub outcome: Result<Outcome, Untestable>,
}

impl ResidualTest {
    /// Short name of the test.
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

    /// The covariate that the test is about: of a test of order, time or row.
    pub fn about(&self) -> Option<Covariate> {
        match self.test {
            Test::Dependence { covariate } => Some(covariate),
            Test::Runs { sequence } | Test::LjungBox { sequence } => Some(match sequence {
                Sequence::Time => Covariate::Time,
                Sequence::Rows => Covariate::Row,
            }),
            Test::ReducedChiSquared | Test::LackOfFit | Test::Outliers { .. } | Test::Normality => None,
        }
    }

    /// Whether a failure means structure that an effect could explain.
    pub fn is_structure(&self) -> bool {
        !matches!(self.test, Test::Outliers { .. } | Test::Normality)
    }

    /// Whether it failed.
    pub fn failed(&self) -> bool {
        self.outcome.as_ref().is_ok_and(|outcome| outcome.failed)
    }
}

/// All checks of what a fit leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Every check, testable or not.
    pub tests: Vec<ResidualTest>,
    /// Poses that were left out as outliers, counted from 0.
    pub outliers: Vec<usize>,
}

impl Findings {
    /// Whether there is structure left, beyond chance at the family-wise level 0.01.
    pub fn is_structured(&self) -> bool {
        self.strongest().is_some()
    }

    /// The failed check of structure that chance explains least.
    pub fn strongest(&self) -> Option<&ResidualTest> {
        let p_value = |check: &ResidualTest| check.outcome.as_ref().map_or(f64::INFINITY, |outcome| outcome.p_value);
        let failed = self.tests.iter().filter(|check| check.is_structure() && check.failed());
        failed.min_by(|a, b| p_value(a).total_cmp(&p_value(b)))
    }

    /// Whether anything was tested for structure.
    pub fn is_testable(&self) -> bool {
        self.tests.iter().any(|check| check.is_structure() && check.outcome.is_ok())
    }
}
