//! Conditions the parameters on the training rows, with and without a remainder, and tests both on
//! left-out rows.

use super::blocks::blocks;
use super::cross_validation::{MAX_CONFIGURATIONS, cross_validated};
use super::gain::Gain;
use super::hyperparameter_search::{Searched, search};
use super::kernel::Hyperparameters;
use super::posterior::{LeftOut, Posterior, Training};
use super::prior::ParameterPrior;
use super::rows::{AXES, Rows};
use super::scores::{LeftOutError, Scores, left_out_errors};
use super::training_rows::TrainingRows;

/// Minimum number of configurations to which a remainder is fitted.
const MIN_CONFIGURATIONS_FOR_REMAINDER: usize = 20;
/// Number of blocks of neighbouring configurations, each of which is left out once.
const BLOCKS: usize = 10;
/// Minimum mean number of configurations in a block. With few configurations there are therefore
/// fewer blocks than [`BLOCKS`], but at least two.
const MIN_BLOCK_CONFIGURATIONS: usize = 3;

/// Posterior distribution, with the scores of training rows that were left out.
pub(super) struct Conditioned {
    pub posterior: Posterior,
    pub scores: Scores,
}

/// Posterior with the parameters alone, and with a remainder in addition.
pub(super) struct Judged {
    /// Posterior of the parameters without a remainder.
    pub alone: Conditioned,
    /// Posterior with a remainder; `None` if the remainder is not kept.
    pub remainder: Option<Conditioned>,
    /// True if the remainder is kept in place of the effects that a search added to the model.
    pub replaces_effects: bool,
    /// Gain in accuracy by the remainder, whether it is kept or not; `None` if none was fitted.
    pub gain: Option<Gain>,
}

/// Conditions on the training rows with the parameters alone and, if wanted, with a remainder.
/// Returns `None` if a matrix is not positive definite because of rounding.
///
/// If a search added effects to the model, a remainder in place of these effects is an alternative
/// to one beside them. The alternative with the larger posterior probability is kept if it predicts
/// left-out configurations significantly better than the parameters alone; otherwise, the other one
/// is tested.
pub(super) fn judge(training: &TrainingRows, is_remainder_wanted: bool) -> Option<Judged> {
    let count = BLOCKS.min(training.configurations.len() / MIN_BLOCK_CONFIGURATIONS).max(2);
    let rows = training.rows.select(&training.judged);
    let configurations = rows.configurations();
    let block = blocks(&training.rows, &training.layout.inputs, count);
    let judge = Judge { training, block, rows, configurations };
    let noise = training.noise();
    let alone = judge.conditioned(&noise, &training.prior)?;
    let left_out = judge.left_out(&alone)?;
    let [single, blocks] = left_out.each_ref().map(|of| judge.errors(&noise, of, of));
    let plain = judge.with_scores(alone, &single, &blocks);
    let mut judged = Judged { alone: plain, remainder: None, replaces_effects: false, gain: None };
    let is_fitted = is_remainder_wanted
        && !training.layout.sites.is_empty()
        && training.configurations.len() >= MIN_CONFIGURATIONS_FOR_REMAINDER;
    for searched in is_fitted.then(|| search(training)).into_iter().flatten() {
        let Some((conditioned, gain)) = judge.remainder(&searched, &left_out, &single) else {
            continue;
        };
        // Without a remainder, the gain of the more probable alternative is reported.
        judged.gain = judged.gain.or(Some(gain));
        if gain.is_significant() {
            let replaces_effects = searched.assumed.replaces_effects;
            let remainder = Some(conditioned);
            return Some(Judged { remainder, replaces_effects, gain: Some(gain), ..judged });
        }
    }
    Some(judged)
}

/// Rows that are left out to test predictions.
struct Judge<'a> {
    training: &'a TrainingRows,
    /// Index of the block of neighbouring configurations to which each training row belongs.
    block: Vec<usize>,
    /// Rows that are left out in turn, and their indices by configuration.
    rows: Rows,
    configurations: Vec<Vec<usize>>,
}

impl Judge<'_> {
    /// Conditions on all training rows.
    fn conditioned(&self, hyper: &Hyperparameters, prior: &ParameterPrior) -> Option<Training> {
        let centres = self.training.some_rows(self.training.max_centres(), 1);
        Training::new((&self.training.rows, &self.training.layout.inputs), prior, hyper, &centres)
    }

    /// Predicts the rows without their configuration, and without their block.
    fn left_out(&self, of: &Training) -> Option<[Vec<LeftOut>; 2]> {
        let judged = &self.training.judged;
        let each = of.without_each(&self.training.rows.configuration, judged)?;
        Some([each, of.without_each(&self.block, judged)?])
    }

    /// Returns the errors of rows that were left out of the fits `alone` and `with`, which is with the
    /// remainder of `hyper`.
    fn errors(
        &self,
        hyper: &Hyperparameters,
        alone: &[LeftOut],
        with: &[LeftOut],
    ) -> Vec<LeftOutError> {
        left_out_errors(hyper, &self.rows, alone, with)
    }

    /// Returns the posterior with the scores of rows left out singly and in blocks.
    fn with_scores(
        &self,
        of: Training,
        single: &[LeftOutError],
        blocks: &[LeftOutError],
    ) -> Conditioned {
        let [single, blocks] =
            [single, blocks].map(|errors| errors.iter().map(|error| error.score).collect());
        let scores = Scores::new(self.configurations.len(), single, blocks);
        Conditioned { posterior: of.posterior, scores }
    }

    /// Conditions with a remainder and computes its gain over the parameters alone, whose
    /// predictions of left-out rows have the errors `errors_alone`. Returns `None` if a matrix is not
    /// positive definite because of rounding.
    fn remainder(
        &self,
        Searched { assumed, hyper, minimum, evidence }: &Searched,
        [single_alone, blocks_alone]: &[Vec<LeftOut>; 2],
        errors_alone: &[LeftOutError],
    ) -> Option<(Conditioned, Gain)> {
        let training = self.training;
        let with = self.conditioned(hyper, &assumed.prior)?;
        let [single_with, blocks_with] = self.left_out(&with)?;
        let blocks = self.errors(hyper, blocks_alone, &blocks_with);
        let [errors_alone, single] = if training.configurations.len() <= MAX_CONFIGURATIONS {
            let errors = cross_validated((training, assumed), minimum)?;
            errors.map(|errors| training.judged.iter().map(|&row| errors[row]).collect::<Vec<_>>())
        } else {
            [errors_alone.to_vec(), self.errors(hyper, single_alone, &single_with)]
        };
        let gain = Gain::of(&self.configurations, (&errors_alone, &single), *evidence);
        let mut conditioned = self.with_scores(with, &single, &blocks);
        conditioned.scores.multiply(inflation(self.configurations.len(), minimum.at.len()));
        Some((conditioned, gain))
    }
}

/// Returns the factor by which error bounds grow because hyperparameters were fitted to the same
/// rows. It is √(m / (m − k)), with m three times the number of configurations and k
/// hyperparameters.
fn inflation(configurations: usize, hyperparameters: usize) -> f64 {
    let coordinates = (AXES * configurations) as f64;
    (coordinates / (coordinates - hyperparameters as f64).max(1.0)).sqrt()
}
