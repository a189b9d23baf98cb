//! Gain of predictions by a remainder, and the decision whether it is kept.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::scores::LeftOutError;

/// Probability of a test to find a gain where there is none. Of 360 simulated sets of noise alone
/// (28, 30 and 50 poses) none passed all tests.
const RISK: f64 = 0.02;

/// Mean of a difference over configurations, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanDifference {
    /// Mean difference.
    pub mean: f64,
    /// Standard error of the mean.
    pub std_error: f64,
}

impl MeanDifference {
    fn of(differences: &[f64]) -> Self {
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let squares = differences.iter().map(|difference| (difference - mean).powi(2));
        Self { mean, std_error: (squares.sum::<f64>() / (n - 1.0) / n).sqrt() }
    }

    /// Mean over its standard error.
    pub fn ratio(&self) -> f64 {
        self.mean / self.std_error
    }
}

/// Gain by a remainder on configurations left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Mean left-out error with the parameters alone \[m\].
    pub without: f64,
    /// Mean left-out error with the remainder \[m\].
    pub with: f64,
    /// Fall of the left-out error of a configuration \[m\].
    pub error: MeanDifference,
    /// Rise of the logarithm of the predictive density of a left-out row.
    pub density: MeanDifference,
    /// Rise of the logarithm of the marginal likelihood, priors of the hyperparameters included.
    pub evidence: f64,
    /// Number of configurations.
    pub configurations: usize,
}

impl Gain {
    /// Gains of the mean error and of the mean density of each configuration, averaged over
    /// `configurations`.
    pub(super) fn of(
        configurations: &[Vec<usize>],
        (without, with): (&[LeftOutError], &[LeftOutError]),
        evidence: f64,
    ) -> Self {
        let means = |errors: &[LeftOutError], of: fn(&LeftOutError) -> f64| -> Vec<f64> {
            let mean = |rows: &Vec<usize>| {
                rows.iter().map(|&row| of(&errors[row])).sum::<f64>() / rows.len() as f64
            };
            configurations.iter().map(mean).collect()
        };
        let average = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let difference = |more: &[f64], less: &[f64]| {
            let pairs = more.iter().zip(less);
            MeanDifference::of(&pairs.map(|(more, less)| more - less).collect::<Vec<f64>>())
        };
        let [before, after] = [without, with].map(|errors| means(errors, |error| error.length));
        let [less, more] = [without, with].map(|errors| means(errors, |error| error.density));
        Self {
            without: average(&before),
            with: average(&after),
            error: difference(&before, &after),
            density: difference(&more, &less),
            evidence,
            configurations: configurations.len(),
        }
    }

    /// Ratio of the mean gain to its standard error that chance exceeds with a probability of
    /// 2 %: quantile of Student's t distribution.
    pub fn threshold(&self) -> f64 {
        StudentsT::new(0.0, 1.0, self.configurations as f64 - 1.0)
            .map_or(f64::INFINITY, |distribution| distribution.inverse_cdf(1.0 - RISK))
    }

    /// Logarithm of the Bayes factor above which noise alone is improbable: odds of 50 to 1.
    pub fn least_evidence() -> f64 {
        -RISK.ln()
    }

    /// True if errors of configurations left out gain beyond chance, their densities do not fall,
    /// and the likelihood rises.
    pub fn is_significant(&self) -> bool {
        self.error.ratio() > self.threshold()
            && self.density.mean > 0.0
            && self.evidence > Self::least_evidence()
    }
}
