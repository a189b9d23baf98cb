//! Cross-validation of few configurations, with hyperparameters that did not see them.

use super::hyperparameter_search::search_near;
use super::posterior::Training;
use super::scores::{LeftOutError, left_out_errors};
use super::search::Minimum;
use super::training_rows::TrainingRows;

/// Maximum configurations that are cross-validated with other hyperparameters in each fold. With
/// more of them the hyperparameters, some 25, no longer follow single configurations.
pub(super) const MAX_CONFIGURATIONS: usize = 100;
/// Maximum folds.
const FOLDS: usize = 10;

/// Errors of each row predicted from the other folds, with the parameters alone and with a
/// remainder; `near` is the optimum of all rows. `None` where rounding spoils a factorisation.
pub(super) fn cross_validated(
    training: &TrainingRows,
    near: &Minimum,
) -> Option<[Vec<LeftOutError>; 2]> {
    let noise = training.noise();
    let inputs = &training.layout.inputs;
    let mut out = [(); 2].map(|()| vec![LeftOutError::default(); training.rows.len()]);
    for (fold, others) in training.folds(FOLDS) {
        let (rows, left_out) = (training.rows.select(&others), training.rows.select(&fold));
        let hyper = search_near(training, &rows, near)?;
        let centres: Vec<usize> = (0..rows.len()).collect();
        let predicted = |hyper| {
            let conditioned = Training::of((&rows, inputs), &training.prior, hyper, &centres)?;
            Some(conditioned.posterior.left_out(&left_out))
        };
        let (alone, with) = (predicted(&noise)?, predicted(&hyper)?);
        let errors = [
            left_out_errors(&noise, &left_out, &alone, &alone),
            left_out_errors(&hyper, &left_out, &alone, &with),
        ];
        for (out, errors) in out.iter_mut().zip(errors) {
            fold.iter().zip(errors).for_each(|(&row, error)| out[row] = error);
        }
    }
    Some(out)
}
