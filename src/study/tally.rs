//! What many fits come to, added up fit by fit and part by part.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Half the width of the interval that should cover the truth in 95 % of the fits \[σ\].
const COVERING: f64 = 1.96;

/// Number, mean and scatter of values that were given one by one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// How many.
    pub count: u64,
    /// Their mean, 0 of none.
    pub mean: f64,
    /// Sum of the squared deviations from the mean.
    pub squares: f64,
    /// Largest absolute value, 0 of none.
    pub largest: f64,
}

impl Moments {
    fn push(&mut self, value: f64) {
        self.merge(&Self { count: 1, mean: value, squares: 0.0, largest: value.abs() });
    }

    /// Adds the values behind `other` (Chan, Golub and LeVeque 1979).
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

    /// The mean; `None` of no value.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then_some(self.mean)
    }

    /// The standard deviation; `None` of fewer than two values.
    pub fn deviation(&self) -> Option<f64> {
        (self.count > 1).then(|| (self.squares / (self.count - 1) as f64).sqrt())
    }

    /// The root of the mean square; `None` of no value.
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.mean * self.mean + self.squares / self.count as f64).sqrt())
    }

    /// The largest absolute value; `None` of no value.
    pub fn largest(&self) -> Option<f64> {
        (self.count > 0).then_some(self.largest)
    }
}

/// One parameter over many fits: deviations x \[rad\], \[m\], or of ln(value).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterTally {
    /// Estimate − truth.
    pub error: Moments,
    /// Standard errors that the fits claim.
    pub std_error: Moments,
    /// Fits with a standard error whose estimate is within 1.96 of them from the truth.
    pub covered: u64,
}

/// Many fits of one cell; all but `fits` and `failures` are over those to be trusted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Fits, failed ones included.
    pub fits: u64,
    /// Fits that are not to be trusted, by reason.
    pub failures: BTreeMap<String, u64>,
    /// Mean position error of the held-out poses of each fit \[m\].
    pub held_out_mean: Moments,
    /// Root mean squared position error of the held-out poses of each fit \[m\].
    pub held_out_rms: Moments,
    /// χ² over its degrees of freedom.
    pub reduced_chi2: Moments,
    /// Steps tried.
    pub iterations: Moments,
    /// Each free parameter of the problem.
    pub parameters: Vec<ParameterTally>,
}

/// How a fit came out.
pub(super) enum Score {
    /// Not to be trusted, and why.
    Failed(&'static str),
    Fitted(Fitted),
}

/// A fit to be trusted; SI units.
pub(super) struct Fitted {
    pub held_out_mean: f64,
    pub held_out_rms: f64,
    pub reduced_chi2: Option<f64>,
    pub iterations: u64,
    /// `None` where the truth is not known.
    pub parameters: Vec<Option<ParameterScore>>,
}

/// Of x.
pub(super) struct ParameterScore {
    pub error: f64,
    pub std_error: Option<f64>,
}

impl Tally {
    /// Of no fit yet.
    pub(super) fn new(parameters: usize) -> Self {
        Self { parameters: vec![ParameterTally::default(); parameters], ..Self::default() }
    }

    /// Number of fits that are not to be trusted.
    pub fn failed(&self) -> u64 {
        self.failures.values().sum()
    }

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
                tally.covered += u64::from(error.abs() <= COVERING * std_error);
            }
        }
    }

    /// Adds the fits behind `other`.
    pub(super) fn merge(&mut self, other: &Self) {
        self.fits += other.fits;
        for (reason, count) in &other.failures {
            *self.failures.entry(reason.clone()).or_default() += count;
        }
        self.held_out_mean.merge(&other.held_out_mean);
        self.held_out_rms.merge(&other.held_out_rms);
        self.reduced_chi2.merge(&other.reduced_chi2);
        self.iterations.merge(&other.iterations);
        for (own, others) in self.parameters.iter_mut().zip(&other.parameters) {
            own.error.merge(&others.error);
            own.std_error.merge(&others.std_error);
            own.covered += others.covered;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_to_the_whole() {
        let values = [3.0, -1.0, 4.0, 1.5, -5.0, 9.25];
        let of = |values: &[f64]| {
            let mut moments = Moments::default();
            for &value in values {
                moments.push(value);
            }
            moments
        };
        let (mut joined, whole) = (of(&values[..2]), of(&values));
        joined.merge(&of(&values[2..]));
        let mean = values.iter().sum::<f64>() / 6.0;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 5.0;
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / 6.0).sqrt();
        for moments in [joined, whole] {
            assert_eq!((moments.count, moments.largest()), (6, Some(9.25)));
            for (found, expected) in [
                (moments.mean(), mean),
                (moments.deviation(), variance.sqrt()),
                (moments.rms(), rms),
            ] {
                assert!((found.unwrap_or(f64::NAN) - expected).abs() < 1e-14);
            }
        }
        let none = Moments::default();
        assert_eq!(
            (none.mean(), none.deviation(), none.rms(), none.largest()),
            (None, None, None, None)
        );
    }
}
