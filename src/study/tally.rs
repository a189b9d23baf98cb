//! Statistics over many fits, accumulated fit by fit and part by part.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Half-width, in standard errors, of the interval about an estimate that should contain the truth
/// in 95 % of the fits.
const COVERAGE_SIGMAS: f64 = 1.96;

/// Count, mean and scatter of values, accumulated one by one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// Number of accumulated values.
    pub count: u64,
    /// Mean of the values; 0 if there are none.
    pub mean: f64,
    /// Sum of the squared deviations from the mean.
    pub squares: f64,
    /// Largest absolute value; 0 if there are none.
    pub largest: f64,
}

impl Moments {
    /// Adds one value to the statistics.
    fn push(&mut self, value: f64) {
        self.merge(&Self { count: 1, mean: value, squares: 0.0, largest: value.abs() });
    }

    /// Adds the values whose statistics are `other` [Chan, Golub & LeVeque 1979].
    fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        if count == 0 {
            return;
        }
        let (part, step) = (other.count as f64 / count as f64, other.mean - self.mean);
        self.mean += part * step;
        self.squares += other.squares + self.count as f64 * part * step * step;
        self.count = count;
        self.largest = self.largest.max(other.largest);
    }

    /// Returns the mean, or `None` without values.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then_some(self.mean)
    }

    /// Returns the standard deviation, or `None` for fewer than two values.
    pub fn deviation(&self) -> Option<f64> {
        (self.count > 1).then(|| (self.squares / (self.count - 1) as f64).sqrt())
    }

    /// Returns the root mean square, or `None` without values.
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.mean * self.mean + self.squares / self.count as f64).sqrt())
    }

    /// Returns the largest absolute value, or `None` without values.
    pub fn largest(&self) -> Option<f64> {
        (self.count > 0).then_some(self.largest)
    }
}

/// Statistics of one parameter over many fits: deviations x in \[rad\], \[m\], or of ln(value).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterTally {
    /// Errors of the estimates, estimate − truth.
    pub error: Moments,
    /// Standard errors that the fits report.
    pub std_error: Moments,
    /// Number of fits whose estimate is within 1.96 reported standard errors of the truth.
    pub covered: u64,
}

/// Statistics over the fits of one cell; all but `fits` and `failures` cover trusted fits only.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Number of fits, failed ones included.
    pub fits: u64,
    /// Number of fits that are not trusted, by reason.
    pub failures: BTreeMap<String, u64>,
    /// Mean position error at the held-out poses of each fit \[m\].
    pub held_out_mean: Moments,
    /// Root mean square position error at the held-out poses of each fit \[m\].
    pub held_out_rms: Moments,
    /// Reduced χ² of each fit.
    pub reduced_chi2: Moments,
    /// Number of solver steps of each fit.
    pub iterations: Moments,
    /// Statistics of each free parameter of the problem.
    pub parameters: Vec<ParameterTally>,
}

/// Outcome of one fit: failed, or its results.
pub(super) enum Score {
    /// Fit that is not trusted, with the reason.
    Failed(&'static str),
    /// Trusted fit.
    Fitted(Fitted),
}

/// Results of a trusted fit, SI units.
pub(super) struct Fitted {
    /// Mean position error at the held-out poses \[m\].
    pub held_out_mean: f64,
    /// Root mean square position error at the held-out poses \[m\].
    pub held_out_rms: f64,
    pub reduced_chi2: Option<f64>,
    pub iterations: u64,
    /// Error of each free parameter; `None` if the truth does not give its value.
    pub parameters: Vec<Option<ParameterScore>>,
}

/// Error and reported standard error of the deviation x of one parameter.
pub(super) struct ParameterScore {
    /// Estimate − truth.
    pub error: f64,
    pub std_error: Option<f64>,
}

impl Tally {
    /// Creates empty statistics for a number of parameters.
    pub(super) fn new(parameters: usize) -> Self {
        Self { parameters: vec![ParameterTally::default(); parameters], ..Self::default() }
    }

    /// Returns the number of fits that are not trusted.
    pub fn failed(&self) -> u64 {
        self.failures.values().sum()
    }

    /// Adds the outcome of one fit.
    pub(super) fn push(&mut self, score: Score) {
        self.fits += 1;
        let fitted = match score {
            Score::Failed(reason) => {
                return *self.failures.entry(reason.to_owned()).or_default() += 1;
            }
            Score::Fitted(fitted) => fitted,
        };
        self.held_out_mean.push(fitted.held_out_mean);
        self.held_out_rms.push(fitted.held_out_rms);
        fitted.reduced_chi2.into_iter().for_each(|chi2| self.reduced_chi2.push(chi2));
        self.iterations.push(fitted.iterations as f64);
        for (tally, score) in self.parameters.iter_mut().zip(fitted.parameters) {
            let Some(ParameterScore { error, std_error }) = score else { continue };
            tally.error.push(error);
            if let Some(std_error) = std_error {
                tally.std_error.push(std_error);
                tally.covered += u64::from(error.abs() <= COVERAGE_SIGMAS * std_error);
            }
        }
    }

    /// Adds the fits of `other`.
    pub(super) fn merge(&mut self, other: &Self) {
        self.fits += other.fits;
        for (reason, count) in &other.failures {
            *self.failures.entry(reason.clone()).or_default() += count;
        }
        self.held_out_mean.merge(&other.held_out_mean);
        self.held_out_rms.merge(&other.held_out_rms);
        self.reduced_chi2.merge(&other.reduced_chi2);
        self.iterations.merge(&other.iterations);
        for (tally, added) in self.parameters.iter_mut().zip(&other.parameters) {
            tally.error.merge(&added.error);
            tally.std_error.merge(&added.std_error);
            tally.covered += added.covered;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_to_the_whole() {
        let values = [3.0, -1.0, 4.0, 1.5, -5.0, 9.25];
        let moments_of = |values: &[f64]| {
            let mut moments = Moments::default();
            for &value in values {
                moments.push(value);
            }
            moments
        };
        let (mut joined, whole) = (moments_of(&values[..2]), moments_of(&values));
        joined.merge(&moments_of(&values[2..]));
        let mean = values.iter().sum::<f64>() / 6.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 5.0;
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / 6.0).sqrt();
        for moments in [joined, whole] {
            assert_eq!((moments.count, moments.largest()), (6, Some(9.25)));
            for (statistic, expected) in [
                (moments.mean(), mean),
                (moments.deviation(), variance.sqrt()),
                (moments.rms(), rms),
            ] {
                assert!((statistic.unwrap_or(f64::NAN) - expected).abs() < 1e-14);
            }
        }
        let none = Moments::default();
        assert_eq!(
            (none.mean(), none.deviation(), none.rms(), none.largest()),
            (None, None, None, None)
        );
    }
}
