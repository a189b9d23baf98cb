//! Comparison of two fits of the same rows by their predictions of blocks of poses left out.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::data::Data;
use super::fitted::Fitted;

/// Sum of squared errors of an old fit minus that of a new one \[m²\], for each block of poses,
/// which both predict without having been fitted to it.
pub(super) struct LeftOutGain(Vec<f64>);

impl LeftOutGain {
    /// Compares the fit `new` with the fit `old` on all rows but those that are outliers of both;
    /// `None` if an error is not finite.
    pub fn new(new: &Fitted, old: &Fitted, data: &Data) -> Option<Self> {
        let of_both = |row: &usize| old.set_aside.contains(row);
        let aside: Vec<usize> = new.set_aside.iter().copied().filter(of_both).collect();
        let squares = |fitted: &Fitted| {
            let fit = fitted.with_outliers(aside.clone()).neighbourhood_at_rows(data);
            let blocks = fit.left_out_squares(&data.block)?;
            Some(blocks.into_iter().map(|sum| sum * fitted.sigma.powi(2)).collect::<Vec<f64>>())
        };
        let (before, after) = squares(old).zip(squares(new))?;
        Some(Self(before.iter().zip(&after).map(|(before, after)| before - after).collect()))
    }

    /// Returns ln of the odds of the new fit over the old one by the predictive density of the
    /// left-out poses, for noise of standard deviation `sigma` \[m\] in each coordinate.
    pub fn ln_odds(&self, sigma: f64) -> f64 {
        self.0.iter().sum::<f64>() / (2.0 * sigma * sigma)
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
        let count = self.0.len() as f64;
        let mean = self.0.iter().sum::<f64>() / count;
        let squares = self.0.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>();
        let freedom = (count - 1.0).max(1.0);
        mean > multiple(freedom) * (squares / freedom / count).sqrt()
    }
}
