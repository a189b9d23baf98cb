//! Settings of the search that users may want to change.

use crate::fit::IdentifyError;

/// Settings of the search for effects that a problem lacks.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SelectionRules {
    /// Probability that noise alone makes at least one residual test fail, and of a false alarm of
    /// the ranking. One false alarm in a hundred data sets is rare enough to be examined.
    pub level: f64,
    /// Corrected p-value of the F test up to which an effect is reported as found if no evidence
    /// about it was evaluated.
    pub leaving_level: f64,
    /// Smallest probability that there are at least as many effects as a set has, at which the loop
    /// fits the set. One half selects the single model that predicts best [Barbieri and Berger
    /// 2004].
    pub inclusion_threshold: f64,
    /// Smallest probability at which an error without a law is reported as located.
    pub located: f64,
    /// Smallest probability of a law at which an effect is reported as found.
    pub stated: f64,
    /// Maximum number of poses, evenly chosen, on which evidence is evaluated, because its work and
    /// memory grow with them. Fits and tests use all poses.
    pub evidence_poses: usize,
    /// Work of all fits between two evaluations of the evidence, in poses × unknowns². It limits
    /// how many rival sets are fitted and how many steps intermediate fits take.
    pub fit_work: f64,
    /// Maximum number of rounds of the search.
    pub max_rounds: usize,
    /// Seed of all random choices: blocks, permutations, resamples, subsets of poses.
    pub seed: u64,
}

impl SelectionRules {
    /// Default settings, which the commands use.
    pub const DEFAULT: Self = Self {
        level: 0.01,
        leaving_level: 0.05,
        inclusion_threshold: 0.5,
        located: 0.95,
        stated: 0.9,
        evidence_poses: 400,
        fit_work: 1e8,
        max_rounds: 24,
        seed: 20_211_206,
    };

    /// Checks that every setting is in its range.
    ///
    /// # Errors
    /// Returns an error that names the first setting out of its range.
    #[doc(hidden)]
    pub fn check(&self) -> Result<(), IdentifyError> {
        let is_probability = |value: f64| value > 0.0 && value < 1.0;
        let rules = [
            ("level", is_probability(self.level)),
            (
                "leaving_level",
                is_probability(self.leaving_level) && self.leaving_level >= self.level,
            ),
            ("inclusion_threshold", is_probability(self.inclusion_threshold)),
            ("located", is_probability(self.located)),
            ("stated", is_probability(self.stated)),
            ("evidence_poses", self.evidence_poses >= 1),
            ("fit_work", self.fit_work > 0.0 && self.fit_work.is_finite()),
            ("max_rounds", self.max_rounds >= 1),
        ];
        rules
            .into_iter()
            .find(|(_, holds)| !holds)
            .map_or(Ok(()), |(rule, _)| Err(IdentifyError::Rule { rule }))
    }
}

impl Default for SelectionRules {
    fn default() -> Self {
        Self::DEFAULT
    }
}
