//! Decision over all residual tests together, with a correction for multiple tests.

use super::chance::Chance;
use super::outcome::{Outcome, ResidualTest, ResidualTests, Test, Untestable};

/// Test before the correction for multiple tests.
pub(super) struct Tried {
    /// Test that was made.
    pub test: Test,
    /// Statistic with its null distribution, or the reason why the test cannot be made.
    pub trial: Result<Trial, Untestable>,
}

/// Value of a statistic with its null distribution.
pub(super) struct Trial {
    /// Value of the statistic.
    pub statistic: f64,
    /// Null distribution of the statistic.
    pub chance: Chance,
    /// Increasing function from the statistic to the number shown to users.
    pub shown: fn(f64) -> f64,
}

/// Judges the tests by Holm's procedure: the smallest of m p-values fails up to α / m, the next one
/// up to α / (m − 1), until one does not fail [Holm 1979]. α is `family_level`. `outliers`, the
/// indices of the poses left out, are stored in the result.
pub(super) fn judge(tried: Vec<Tried>, family_level: f64, outliers: Vec<usize>) -> ResidualTests {
    let p_value = |tried: &Tried| {
        tried.trial.as_ref().ok().map(|trial| trial.chance.p_value(trial.statistic))
    };
    let p_values: Vec<Option<f64>> = tried.iter().map(p_value).collect();
    let mut ranked: Vec<usize> = (0..tried.len()).filter(|&k| p_values[k].is_some()).collect();
    ranked.sort_by(|&a, &b| {
        p_values[a].partial_cmp(&p_values[b]).unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut levels = vec![family_level; tried.len()];
    let mut failed = vec![false; tried.len()];
    let mut level = family_level;
    let mut stopped = false;
    for (rank, &k) in ranked.iter().enumerate() {
        if !stopped {
            level = family_level / (ranked.len() - rank) as f64;
            failed[k] = p_values[k].is_some_and(|p| p <= level);
            stopped = !failed[k];
        }
        levels[k] = level;
    }
    let judged = |(k, Tried { test, trial }): (usize, Tried)| {
        let outcome = trial.map(|Trial { statistic, chance, shown }| Outcome {
            statistic: shown(statistic),
            bounds: (shown(chance.lower(levels[k])), shown(chance.upper(levels[k]))),
            p_value: p_values[k].unwrap_or(1.0),
            failed: failed[k],
        });
        ResidualTest { test, outcome, row: None }
    };
    ResidualTests { tests: tried.into_iter().enumerate().map(judged).collect(), outliers }
}
