//! Statistical power of the scan of the catalogue.

use statrs::function::beta::beta_reg;

use crate::numeric::bisect;

/// Number of bisections that locate a noncentrality.
const MAX_BISECTIONS: usize = 24;
/// Number of standard deviations of a Poisson distribution beyond which its terms are neglected.
const MAX_POISSON_DEVIATIONS: f64 = 9.0;
/// Largest noncentrality that is considered, that of an effect 30 times its standard error.
const MAX_NONCENTRALITY: f64 = 1024.0;

/// F test of one candidate in a scan, in terms of the fraction of the sum of squares that it
/// explains. Without an effect, the fraction follows Beta(k/2, (ν − k)/2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ScanTest {
    /// First parameter k/2 of the beta distribution: half the number k of columns that the
    /// candidate adds.
    new: f64,
    /// Second parameter (ν − k)/2 of the beta distribution: half the residual degrees of freedom
    /// with the candidate.
    left: f64,
    /// Smallest fraction of the sum of squares that the candidate must explain to be found.
    threshold: f64,
}

impl ScanTest {
    /// Creates the F test of a candidate with `k` additional columns, ν = `freedom` degrees of
    /// freedom, at `level` / `tries`. Returns `None` if no degree of freedom would remain.
    ///
    /// The explained fraction s must be significant at level / tries, and the information criterion
    /// ν ln(1 − s) + k ln ν + 2 ln(tries) must be negative.
    pub fn new(k: usize, freedom: f64, level: f64, tries: f64) -> Option<Self> {
        let (new, left) = (k as f64 / 2.0, (freedom - k as f64) / 2.0);
        if k == 0 || left < 0.5 {
            return None;
        }
        let level = level / tries;
        let chance = bisected(|part| beta_reg(left, new, 1.0 - part) > level, (0.0, 1.0));
        let better = -(-(k as f64 * freedom.ln() + 2.0 * tries.ln()) / freedom).exp_m1();
        Some(Self { new, left, threshold: chance.max(better) })
    }

    /// Returns the probability that the candidate is found at a noncentrality λ of the F test.
    pub fn power(&self, noncentrality: f64) -> f64 {
        let mean = 0.5 * noncentrality;
        let reach = MAX_POISSON_DEVIATIONS * mean.sqrt() + MAX_POISSON_DEVIATIONS;
        let (mut weight, mut j, mut sum) = ((-mean).exp(), 0.0, 0.0);
        while j <= mean + reach {
            if j >= mean - reach {
                sum += weight * beta_reg(self.left, self.new + j, 1.0 - self.threshold);
            }
            j += 1.0;
            weight *= mean / j;
        }
        sum
    }

    /// Returns the p-value that belongs to the expected gain at a noncentrality λ, not corrected
    /// for the number of tries.
    pub fn expected_p(&self, noncentrality: f64) -> f64 {
        let gained = 2.0 * self.new + noncentrality;
        beta_reg(self.left, self.new, 2.0 * self.left / (2.0 * self.left + gained))
    }

    /// Returns the noncentrality λ at which the candidate is found with probability `power`; `None`
    /// if it exceeds [`MAX_NONCENTRALITY`].
    pub fn noncentrality(&self, power: f64) -> Option<f64> {
        let mut most = 32.0;
        while self.power(most) < power {
            if most >= MAX_NONCENTRALITY {
                return None;
            }
            most *= 2.0;
        }
        Some(bisected(|lambda| self.power(lambda) < power, (0.0, most)))
    }
}

/// Returns the midpoint of the interval in which `is_below` changes from true to false.
fn bisected(is_below: impl Fn(f64) -> bool, range: (f64, f64)) -> f64 {
    let (low, high) = bisect(is_below, range, MAX_BISECTIONS);
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// scipy.stats: threshold by `beta.isf(level, k/2, (ν − k)/2)` or the criterion, power by
    /// `ncf.sf`.
    #[test]
    fn power_is_that_of_a_noncentral_f_test() {
        let cases = [
            (1, 84.0, 40.0, 20.0, 0.150_030_798, 0.735_368_43),
            (2, 84.0, 5000.0, 35.0, 0.273_892_819, 0.663_337_55),
            (3, 600.0, 2000.0, 40.0, 0.055_709_087, 0.708_206_7),
        ];
        for (k, freedom, tries, lambda, threshold, power) in cases {
            let test = ScanTest::new(k, freedom, 0.01, tries);
            assert!(test.is_some_and(|test| (test.threshold - threshold).abs() < 1e-6), "{test:?}");
            assert!(
                test.is_some_and(|test| (test.power(lambda) - power).abs() < 1e-5),
                "{test:?} {power}"
            );
            let needed = test.and_then(|test| test.noncentrality(0.8)).unwrap_or(0.0);
            assert!(test.is_some_and(|test| (test.power(needed) - 0.8).abs() < 1e-4), "{needed}");
        }
        assert_eq!(ScanTest::new(0, 84.0, 0.01, 1.0), None);
    }

    #[test]
    fn two_degrees_of_freedom_find_nothing_among_many() {
        let test = ScanTest::new(1, 3.0, 0.01, 2000.0);
        assert!(
            test.is_some_and(
                |test| test.power(MAX_NONCENTRALITY) < 0.1 && test.noncentrality(0.8).is_none()
            ),
            "{test:?}"
        );
        let sure = ScanTest::new(1, 300.0, 0.01, 2000.0).and_then(|test| test.noncentrality(0.8));
        assert!(sure.is_some_and(|lambda| lambda < 50.0), "{sure:?}");
    }
}
