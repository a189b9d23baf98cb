//! Gain in predictive accuracy by a remainder, and the decision whether to keep it.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::rows::AXES;
use super::scores::LeftOutError;

/// Probability with which the test of the error length finds a gain although there is no model
/// error.
const FALSE_GAIN_PROBABILITY: f64 = 0.02;
/// Probability with which the test of the predictive density finds a gain although there is no
/// model error. It is larger than [`FALSE_GAIN_PROBABILITY`] because the test of the error must
/// pass, too.
const FALSE_DENSITY_GAIN_PROBABILITY: f64 = 0.1;
/// Increase of the log marginal likelihood that 2 % of data sets without model error exceed. With
/// the hyperparameters integrated out it would be ln 50; at their maximum it is larger. Counted in
/// 372 sets of 28 to 100 poses.
const LN_EVIDENCE_OF_NOISE: f64 = 5.7;

/// Mean of one difference per left-out configuration, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanDifference {
    /// Mean of the differences over the left-out configurations.
    pub mean: f64,
    /// Standard error of the mean difference.
    pub std_error: f64,
}

impl MeanDifference {
    pub(super) fn of(differences: &[f64]) -> Self {
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let squares = differences.iter().map(|difference| (difference - mean).powi(2));
        Self { mean, std_error: (squares.sum::<f64>() / (n - 1.0) / n).sqrt() }
    }

    /// Returns true if the mean of `count` differences is larger than chance: one-sided t test at
    /// the level `chance`.
    pub(super) fn exceeds(&self, chance: f64, count: usize) -> bool {
        self.ratio() > quantile(1.0 - chance, count)
    }

    /// Returns the mean divided by its standard error.
    pub fn ratio(&self) -> f64 {
        self.mean / self.std_error
    }
}

/// Gain by a remainder in predicting configurations that were left out of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Mean error length of left-out rows with the parameters alone \[m\].
    pub without: f64,
    /// Mean error length of left-out rows with the remainder \[m\].
    pub with: f64,
    /// Decrease of the error length of a left-out configuration \[m\].
    pub error: MeanDifference,
    /// Increase of the logarithm of the predictive density of a left-out row. Each covariance is
    /// multiplied by the factor that fits the left-out errors best, as the error bounds are.
    pub density: MeanDifference,
    /// Increase of the logarithm of the marginal likelihood over that of noise alone, including the
    /// priors of the hyperparameters.
    pub ln_evidence: f64,
    /// Number of left-out configurations over which the gain is averaged.
    pub configurations: usize,
}

impl Gain {
    /// Computes the gain from the errors of left-out rows. Errors and densities are averaged within
    /// each configuration, and then over `configurations`.
    ///
    /// The factor of all covariances that gives the left-out errors the largest density is their
    /// mean square in units of these covariances. Without it, the few configurations that a
    /// confident prediction misses by many σ would decide alone, although the bounds account for
    /// them.
    pub(super) fn of(
        configurations: &[Vec<usize>],
        (without, with): (&[LeftOutError], &[LeftOutError]),
        ln_evidence: f64,
    ) -> Self {
        let average = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let means = |errors: &[LeftOutError], of: &dyn Fn(&LeftOutError) -> f64| -> Vec<f64> {
            let rows = |rows: &Vec<usize>| -> Vec<f64> {
                rows.iter().map(|&row| of(&errors[row])).collect()
            };
            configurations.iter().map(|configuration| average(&rows(configuration))).collect()
        };
        let difference = |more: &[f64], less: &[f64]| {
            let pairs = more.iter().zip(less);
            MeanDifference::of(&pairs.map(|(more, less)| more - less).collect::<Vec<f64>>())
        };
        let [before, after] = [without, with].map(|errors| means(errors, &|error| error.length));
        let [less, more] = [without, with].map(|errors| {
            let scale = average(&means(errors, &|error| error.square)) / AXES as f64;
            means(errors, &|error| error.density(scale))
        });
        Self {
            without: average(&before),
            with: average(&after),
            error: difference(&before, &after),
            density: difference(&more, &less),
            ln_evidence,
            configurations: configurations.len(),
        }
    }

    /// Returns the ratio of the mean decrease of the error length to its standard error that noise
    /// alone exceeds with a probability of 2 %. It is a quantile of Student's t distribution.
    pub fn threshold(&self) -> f64 {
        quantile(1.0 - FALSE_GAIN_PROBABILITY, self.configurations)
    }

    /// Returns the ratio of the mean increase of the log density to its standard error that noise
    /// alone exceeds with a probability of 10 %.
    pub fn density_threshold(&self) -> f64 {
        quantile(1.0 - FALSE_DENSITY_GAIN_PROBABILITY, self.configurations)
    }

    /// Returns the smallest increase of the log evidence at which a remainder is kept. Noise alone
    /// exceeds it with a probability of 2 %.
    pub fn least_evidence() -> f64 {
        LN_EVIDENCE_OF_NOISE
    }

    /// Returns true if errors and predictive densities of left-out configurations improve
    /// significantly, and the evidence increases by more than [`Self::least_evidence`].
    ///
    /// The predictive density is a proper score of the whole prediction. A remainder that follows
    /// noise may decrease some errors by chance, but its variances are then too small. [Gneiting &
    /// Raftery 2007]
    pub fn is_significant(&self) -> bool {
        self.error.ratio() > self.threshold()
            && self.density.ratio() > self.density_threshold()
            && self.ln_evidence > Self::least_evidence()
    }
}

/// Returns the quantile `level` of Student's t distribution with one degree of freedom less than
/// there are configurations.
fn quantile(level: f64, configurations: usize) -> f64 {
    StudentsT::new(0.0, 1.0, configurations as f64 - 1.0)
        .map_or(f64::INFINITY, |distribution| distribution.inverse_cdf(level))
}
