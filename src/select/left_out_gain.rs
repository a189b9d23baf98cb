//! Comparison of two fits of the same rows by their predictions of blocks of poses left out.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::data::Data;
use super::fitted::Fitted;

/// Predictions of blocks of poses by an old and by a new fit, neither of which was fitted to the
/// predicted block.
pub(super) struct LeftOutGain {
    /// Sum of squared errors of the old fit minus that of the new one \[m²\], for each block.
    gains: Vec<f64>,
    /// The same summed over the blocks, each error in units of its covariance over σ².
    weighted_gain: f64,
    /// ln of the ratio of the determinants of the covariances of the old and the new fit's errors.
    ln_determinants: f64,
}

impl LeftOutGain {
    /// Compares the fit `new` with the fit `old` on all rows but those that are outliers of both;
    /// `None` if an error is not finite.
    pub fn new(new: &Fitted, old: &Fitted, data: &Data) -> Option<Self> {
        let of_both = |row: &usize| old.set_aside.contains(row);
        let aside: Vec<usize> = new.set_aside.iter().copied().filter(of_both).collect();
        let left_out = |fitted: &Fitted| {
            fitted.with_outliers(aside.clone()).neighbourhood_at_rows(data).left_out(&data.block)
        };
        let (before, after) = (left_out(old)?, left_out(new)?);
        let (old, new) = (old.sigma.powi(2), new.sigma.powi(2));
        let pairs = || before.iter().zip(&after);
        Some(Self {
            gains: pairs().map(|(one, other)| one.squares * old - other.squares * new).collect(),
            weighted_gain: pairs()
                .map(|(one, other)| one.weighted_squares * old - other.weighted_squares * new)
                .sum(),
            ln_determinants: pairs()
                .map(|(one, other)| other.ln_determinant - one.ln_determinant)
                .sum(),
        })
    }

    /// Returns ln of the odds of the new fit over the old one by the predictive density of the
    /// left-out poses, for noise of standard deviation `sigma` \[m\] in each coordinate. The
    /// density takes the uncertainty of each fit's predictions into account.
    pub fn ln_odds(&self, sigma: f64) -> f64 {
        0.5 * (self.weighted_gain / (sigma * sigma) + self.ln_determinants)
    }

    /// Returns true if the mean decrease exceeds its standard error. Otherwise the
    /// one-standard-error rule keeps the plainer model [Breiman et al. 1984, sec. 3.4.3].
    pub fn exceeds_standard_error(&self) -> bool {
        self.exceeds(|_| 1.0)
    }

    /// Returns true if the mean decrease is larger than chance: one-sided t test over the blocks at
    /// 2.5 %.
    pub fn is_significant(&self) -> bool {
        self.exceeds(|freedom| {
            let distribution = StudentsT::new(0.0, 1.0, freedom);
            distribution.map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
        })
    }

    /// Returns true if the mean decrease exceeds a multiple of its standard error, given the
    /// degrees of freedom of that error.
    fn exceeds(&self, multiple: impl Fn(f64) -> f64) -> bool {
        let count = self.gains.len() as f64;
        let mean = self.gains.iter().sum::<f64>() / count;
        let squares = self.gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>();
        let freedom = (count - 1.0).max(1.0);
        mean > multiple(freedom) * (squares / freedom / count).sqrt()
    }
}
