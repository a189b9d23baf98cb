//! Conditions the parameters on the training rows, with and without a remainder, and tests both on
//! left-out rows.

use super::blocks::blocks;
use super::cross_validation::{MAX_CONFIGURATIONS, cross_validated};
use super::gain::Gain;
use super::hyperparameter_search::{Searched, search};
use super::kernel::Hyperparameters;
use super::posterior::{LeftOut, Posterior, Training};
use super::rows::AXES;
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
    /// Gain in accuracy by the remainder, whether it is kept or not; `None` if none was fitted.
    pub gain: Option<Gain>,
    /// Error length of each judged row with the remainder, predicted without its configuration
    /// \[m\]; empty if none was fitted.
    pub left_out_lengths: Vec<f64>,
}

/// Conditions on the training rows with the parameters alone and, if wanted, with a remainder.
/// Returns `None` if a matrix is not positive definite because of rounding.
pub(super) fn judge(training: &TrainingRows, is_remainder_wanted: bool) -> Option<Judged> {
    let count = BLOCKS.min(training.configurations.len() / MIN_BLOCK_CONFIGURATIONS).max(2);
    let block = blocks(&training.rows, &training.layout.inputs, count);
    let conditioned = |hyper: &Hyperparameters| {
        let centres = training.some_rows(training.max_centres(), 1);
        let rows = (&training.rows, &training.layout.inputs);
        Training::new(rows, &training.prior, hyper, &centres)
    };
    let judged_rows = training.rows.select(&training.judged);
    let configurations = judged_rows.configurations();
    let with_scores = |of: Training, single: &[LeftOutError], blocks: &[LeftOutError]| {
        let [single, blocks] =
            [single, blocks].map(|errors| errors.iter().map(|error| error.score).collect());
        let scores = Scores::new(configurations.len(), single, blocks);
        Conditioned { posterior: of.posterior, scores }
    };
    let errors = |hyper: &Hyperparameters, alone: &[LeftOut], with: &[LeftOut]| {
        left_out_errors(hyper, &judged_rows, alone, with)
    };
    let left_out = |of: &Training| {
        let each = of.without_each(&training.rows.configuration, &training.judged)?;
        Some((each, of.without_each(&block, &training.judged)?))
    };
    let noise = training.noise();
    let alone = conditioned(&noise)?;
    let (single_alone, blocks_alone) = left_out(&alone)?;
    let errors_alone = errors(&noise, &single_alone, &single_alone);
    let plain = with_scores(alone, &errors_alone, &errors(&noise, &blocks_alone, &blocks_alone));
    let without =
        Judged { alone: plain, remainder: None, gain: None, left_out_lengths: Vec::new() };
    let is_fitted = is_remainder_wanted
        && training.takes_remainder
        && !training.layout.sites.is_empty()
        && training.configurations.len() >= MIN_CONFIGURATIONS_FOR_REMAINDER;
    let searched = is_fitted.then(|| search(training)).flatten();
    let Some(Searched { hyper, minimum, evidence }) = searched else { return Some(without) };
    let beside = conditioned(&hyper).and_then(|with| Some((left_out(&with)?, with)));
    let Some(((single_with, blocks_with), with)) = beside else { return Some(without) };
    let blocks = errors(&hyper, &blocks_alone, &blocks_with);
    let [errors_alone, single] = if training.configurations.len() <= MAX_CONFIGURATIONS {
        let errors = cross_validated(training, &minimum)?;
        errors.map(|errors| training.judged.iter().map(|&row| errors[row]).collect::<Vec<_>>())
    } else {
        [errors_alone, errors(&hyper, &single_alone, &single_with)]
    };
    let gain = Gain::of(&configurations, (&errors_alone, &single), evidence);
    let inflation = inflation(configurations.len(), minimum.at.len());
    let remainder = gain.is_significant().then(|| {
        let mut conditioned = with_scores(with, &single, &blocks);
        conditioned.scores.multiply(inflation);
        conditioned
    });
    let left_out_lengths = single.iter().map(|error| error.length).collect();
    Some(Judged { remainder, gain: Some(gain), left_out_lengths, ..without })
}

/// Returns the factor by which error bounds grow because hyperparameters were fitted to the same
/// rows. It is √(m / (m − k)), with m three times the number of configurations and k
/// hyperparameters.
fn inflation(configurations: usize, hyperparameters: usize) -> f64 {
    let coordinates = (AXES * configurations) as f64;
    (coordinates / (coordinates - hyperparameters as f64).max(1.0)).sqrt()
}
