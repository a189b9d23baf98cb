//! Null distributions of the test statistics.

use statrs::distribution::{ChiSquared, ContinuousCDF as _, FisherSnedecor, Gamma};

use crate::numeric::{bisect, whole};

/// Minimum number of draws that must reach a value for their fraction to estimate its probability.
/// With fewer, the tail is that of a fitted gamma distribution.
const MIN_EXCEEDING_DRAWS: usize = 10;
/// Smallest skewness of the fitted gamma distribution. At smaller skewness it equals a normal
/// distribution, and its shape parameter 4 / skewness² would become too large.
const MIN_SKEWNESS: f64 = 0.02;
/// Largest A² for which the p-value is computed; larger values get the same p-value. The fitted
/// curve of [Stephens 1986] ends there.
const MAX_STATISTIC: f64 = 150.0;

/// Null distribution of a test statistic. The tests are one-sided: large values are significant.
#[derive(Debug, Clone)]
pub(super) enum Chance {
    /// Null distribution of `scale` times a χ² variable.
    ChiSquared { distribution: ChiSquared, scale: f64 },
    /// Null distribution of the largest of `of` F variables, by Bonferroni's inequality.
    Fisher { distribution: FisherSnedecor, of: f64 },
    /// Anderson and Darling's A² of normal variables with mean and variance estimated.
    AndersonDarling,
    /// Empirical distribution of permutation draws.
    Drawn(Drawn),
}

impl Chance {
    /// Returns the probability of `statistic` or a larger value under the null hypothesis; 1 if the
    /// statistic is NaN.
    pub fn p_value(&self, statistic: f64) -> f64 {
        if statistic.is_nan() {
            return 1.0;
        }
        let p = match self {
            Self::ChiSquared { distribution, scale } => distribution.sf(statistic / scale),
            Self::Fisher { distribution, of } => of * distribution.sf(statistic),
            Self::AndersonDarling => anderson_darling_p(statistic),
            Self::Drawn(drawn) => drawn.p_value(statistic),
        };
        p.clamp(f64::MIN_POSITIVE, 1.0)
    }

    /// Returns the critical value that the statistic reaches with probability `level` under the
    /// null hypothesis.
    pub fn upper(&self, level: f64) -> f64 {
        match self {
            Self::ChiSquared { distribution, scale } => {
                scale * distribution.inverse_cdf(1.0 - level)
            }
            Self::Fisher { distribution, of } => distribution.inverse_cdf(1.0 - level / of),
            Self::AndersonDarling => {
                bisect(|value| anderson_darling_p(value) > level, (0.0, MAX_STATISTIC), 60).1
            }
            Self::Drawn(drawn) => drawn.upper(level),
        }
    }

    /// Returns the value below which a χ² statistic falls with probability `level` under the null
    /// hypothesis. It is 0 for other statistics, because only their large values are significant.
    pub fn lower(&self, level: f64) -> f64 {
        match self {
            Self::ChiSquared { distribution, scale } => scale * distribution.inverse_cdf(level),
            Self::Fisher { .. } | Self::AndersonDarling | Self::Drawn(_) => 0.0,
        }
    }
}

/// Values of a statistic drawn under the null hypothesis.
///
/// The p-value is (1 + number of draws that reach the statistic) / (1 + draws), which is valid for
/// any number of draws. If fewer than ten draws reach it, the p-value is that of a gamma
/// distribution with the draws' mean, variance and skewness (Pearson's type III), which extends far
/// beyond 1 / draws [Winkler et al. 2016, NeuroImage 141, 502-516].
#[derive(Debug, Clone)]
pub(super) struct Drawn {
    /// Drawn values, ascending.
    values: Vec<f64>,
    /// Gamma distribution of shape k and scale 1 fitted to the draws, used for the upper tail.
    tail: Gamma,
    /// Origin and unit of the fitted tail: statistic = origin + unit × variable of `tail`.
    origin: f64,
    unit: f64,
}

impl Drawn {
    /// Creates the distribution from draws; `None` if all draws are equal.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let moment =
            |power: i32| values.iter().map(|value| (value - mean).powi(power)).sum::<f64>() / n;
        let spread = moment(2).sqrt();
        let scatters = spread.is_normal() && spread > 1e-9 * mean.abs();
        let skewness = (moment(3) / spread.powi(3)).max(MIN_SKEWNESS);
        let shape = 4.0 / (skewness * skewness);
        let unit = spread / shape.sqrt();
        let tail = Gamma::new(shape, 1.0).ok().filter(|_| scatters)?;
        Some(Self { values, tail, origin: mean - unit * shape, unit })
    }

    fn share(&self, reached: usize) -> f64 {
        (1 + reached) as f64 / (1 + self.values.len()) as f64
    }

    fn p_value(&self, statistic: f64) -> f64 {
        let reached = self.values.len() - self.values.partition_point(|&value| value < statistic);
        if reached >= MIN_EXCEEDING_DRAWS {
            self.share(reached)
        } else {
            self.tail
                .sf(((statistic - self.origin) / self.unit).max(0.0))
                .min(self.share(MIN_EXCEEDING_DRAWS))
        }
    }

    fn upper(&self, level: f64) -> f64 {
        if level > self.share(MIN_EXCEEDING_DRAWS) {
            let reached = level * (1 + self.values.len()) as f64 - 1.0;
            // The bound is a drawn value, which a whole number of draws reaches.
            let reached = whole(reached).clamp(1, self.values.len());
            self.values[self.values.len() - reached]
        } else {
            self.origin + self.unit * self.tail.inverse_cdf(1.0 - level)
        }
    }
}

/// Returns the probability of Anderson and Darling's A² or a larger value under normality [Stephens
/// 1986, table 4.9].
fn anderson_darling_p(statistic: f64) -> f64 {
    let a = statistic.clamp(0.0, MAX_STATISTIC);
    let curve = |c0: f64, c1: f64, c2: f64| (c0 + c1 * a + c2 * a * a).exp();
    match a {
        _ if a < 0.2 => 1.0 - curve(-13.436, 101.14, -223.73),
        _ if a < 0.34 => 1.0 - curve(-8.318, 42.796, -59.938),
        _ if a < 0.6 => curve(0.9177, -4.279, -1.38),
        _ => curve(1.2937, -5.709, 0.0186),
    }
}
