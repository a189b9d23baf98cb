//! Search of the hyperparameters of a remainder.

use super::kernel::Hyperparameters;
use super::likelihood::MarginalLikelihood;
use super::noise_likelihood::evidence_of_noise;
use super::posterior::Training;
use super::rows::Rows;
use super::search::{Minimum, minimise};
use super::training_rows::TrainingRows;

/// Maximum number of rows in the search of the hyperparameters, and in the refinement after it. The
/// time grows with the cube of this number.
const MAX_SEARCH_ROWS: [usize; 2] = [120, 400];
/// Initial lengths ℓᵤ and ℓᵥ of the searches, \[rad\] for angles and in standard deviations for
/// other inputs. For each start there is a measured arm on which it reaches the best optimum.
const STARTS: [[f64; 2]; 3] = [[1.0, 1.0], [0.15, 0.15], [0.1, 3.0]];
/// Maximum number of steps of the search from each start, and of the refinement.
const MAX_STEPS: [usize; 2] = [60, 20];

/// Hyperparameters at a local maximum of the marginal likelihood.
pub(super) struct Searched {
    pub hyper: Hyperparameters,
    /// Minimum of the negative log marginal likelihood, in the logarithms of the hyperparameters.
    pub minimum: Minimum,
    /// Increase of the log marginal likelihood over that of a model with noise alone.
    pub evidence: f64,
}

/// Returns the marginal likelihood of `rows`, which are a part of the training rows. Returns `None`
/// if a matrix is not positive definite because of rounding.
fn likelihood<'a>(training: &'a TrainingRows, rows: &'a Rows) -> Option<MarginalLikelihood<'a>> {
    let shares_noise = training.shares_noise();
    let rows = (rows, &training.layout.inputs);
    MarginalLikelihood::new(rows, &training.prior, shares_noise, training.size)
}

/// Searches the hyperparameters of the remainder: local maxima of the marginal likelihood on few
/// rows, one from each start. The optimum that predicts left-out rows best is refined on more rows.
/// `None` if no search succeeds.
pub(super) fn search(training: &TrainingRows) -> Option<Searched> {
    let [few, more] =
        MAX_SEARCH_ROWS.map(|count| training.rows.select(&training.some_rows(count, 0)));
    let searched = likelihood(training, &few)?;
    let value = |x: &_| searched.value_and_gradient(x);
    let bounds = searched.bounds();
    let minima = STARTS.into_iter().filter_map(|lengths| {
        let minimum = minimise(value, (searched.start(lengths), None), &bounds, MAX_STEPS[0])?;
        let hyper = searched.hyperparameters(&minimum.at);
        Some((left_out_error(training, &few, &hyper)?, minimum))
    });
    let (_, mut minimum) = minima.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if few.len() < more.len() {
        minimum = refine(training, &more, &minimum, few.len())?;
    }
    let hyper = searched.hyperparameters(&minimum.at);
    let noise = evidence_of_noise(&more, &training.prior, training.shares_noise(), training.size)?;
    let evidence = -minimum.value - noise;
    Some(Searched { hyper, minimum, evidence })
}

/// Returns the optimum of the marginal likelihood of `rows`. The search starts at the optimum
/// `near` of another selection of `count` training rows. `None` if the likelihood cannot be
/// evaluated there.
fn refine(training: &TrainingRows, rows: &Rows, near: &Minimum, count: usize) -> Option<Minimum> {
    let refined = likelihood(training, rows)?;
    let inverse = &near.inverse * (count as f64 / rows.len() as f64);
    let value = |x: &_| refined.value_and_gradient(x);
    minimise(value, (near.at.clone(), Some(inverse)), &refined.bounds(), MAX_STEPS[1])
}

/// Returns the hyperparameters fitted to `rows`, a part of the training rows. The search starts at
/// the optimum `near` of the search over all of them. `None` if the likelihood cannot be evaluated.
pub(super) fn search_near(
    training: &TrainingRows,
    rows: &Rows,
    near: &Minimum,
) -> Option<Hyperparameters> {
    let minimum = refine(training, rows, near, training.rows.len())?;
    Some(likelihood(training, rows)?.hyperparameters(&minimum.at))
}

/// Returns the mean error length \[m\] of rows that are predicted without their configuration;
/// `None` if a matrix is not positive definite because of rounding.
fn left_out_error(training: &TrainingRows, rows: &Rows, hyper: &Hyperparameters) -> Option<f64> {
    let centres: Vec<usize> = (0..rows.len()).collect();
    let inputs = &training.layout.inputs;
    let conditioned = Training::new((rows, inputs), &training.prior, hyper, &centres)?;
    let left_out = conditioned.without_each(&rows.configuration, &centres)?;
    Some(left_out.iter().map(|row| row.error.norm()).sum::<f64>() / rows.len() as f64)
}
