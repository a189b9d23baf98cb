//! Cross-validation for few configurations: each fold is predicted with hyperparameters fitted to
//! the other folds.

use super::hyperparameter_search::search_near;
use super::posterior::Training;
use super::scores::{LeftOutError, left_out_errors};
use super::search::Minimum;
use super::training_rows::TrainingRows;

/// Largest number of configurations at which the hyperparameters are fitted again for each fold
/// that is left out. With more configurations, no single one has much influence on the about 25
/// hyperparameters.
pub(super) const MAX_CONFIGURATIONS: usize = 100;
/// Maximum number of folds of the cross-validation.
const FOLDS: usize = 10;

/// Returns the prediction error of each row by a fit to the other folds: first with the parameters
/// alone, then with a remainder. The search of each fold starts at `near`, the optimum of the
/// hyperparameters that was found without leaving rows out. `None` if a matrix is not positive
/// definite because of rounding.
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
            let conditioned = Training::new((&rows, inputs), &training.prior, hyper, &centres)?;
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
