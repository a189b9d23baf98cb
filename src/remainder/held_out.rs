//! Comparison of error bounds with held-out rows, which widen the bounds that they contradict.

use super::apply::predict_identified;
use super::bounds::{BoundTest, Bounds};
use super::correction::Correction;
use super::scores::Scores;
use crate::fit::{FindingCode, Identification, IdentifyError};
use crate::measurement::Dataset;
use crate::problem::Problem;

/// Probability with which a bound holds that is compared with held-out rows.
const LEVEL: f64 = 0.95;
/// Probability of as many exceeded bounds by chance, below which they widen the bounds of a fit whose
/// residuals are larger than noise.
const MAX_CHANCE_BESIDE_MISFIT: f64 = 0.1;
/// Findings by which residuals are larger than noise.
const MISFIT: [FindingCode; 4] = [
    FindingCode::HeldOutBeyondPrediction,
    FindingCode::HeldOutOutliers,
    FindingCode::NoiseBeyondDeclared,
    FindingCode::ResidualBeyondDeclared,
];

/// Compares the bounds of `correction` with the position errors of the held-out configurations;
/// `None` without held-out positions.
///
/// If more of them exceed their bounds than chance explains, the scores of held-out rows take the
/// place of those of configurations left out of the fit. The fit itself does not change.
///
/// # Errors
/// Returns an error if `problem` and `data` are not those that were identified.
pub(super) fn compare(
    correction: &mut Correction,
    (found, problem): (&Identification, &Problem),
    data: &Dataset,
) -> Result<Option<BoundTest>, IdentifyError> {
    let table = &data.measurements;
    let is_position = |row: &usize| table.observation(*row).is_position();
    let held_out: Vec<usize> = data.split.held_out.iter().copied().filter(is_position).collect();
    if held_out.is_empty() {
        return Ok(None);
    }
    // Effects with memory depend on the poses before, whether these are held out or not.
    let rows = table.select_with_past(&held_out);
    let (positions, corrected) = predict_identified(found, problem, correction, &rows)?;
    let errors = positions.iter().zip(&rows.positions).map(|(at, measured)| (measured - at).norm());
    let errors: Vec<f64> = errors.collect();
    let scores = errors.iter().zip(&corrected).map(|(error, pose)| error / pose.size).collect();
    let bounds = Bounds::new(correction, corrected, LEVEL);
    let each = errors.iter().enumerate().map(|(pose, error)| (pose, pose, *error));
    let mut test = bounds.test(&rows, each);
    let is_misfit = MISFIT.iter().any(|code| found.has(*code));
    let are_exceeded = test.is_contradicted()
        || is_misfit && test.beyond() > 0 && test.chance() < MAX_CHANCE_BESIDE_MISFIT;
    let known = correction.scores.quantile(LEVEL);
    let wider = Scores::new(test.of, scores, correction.scores.blocks.clone());
    if are_exceeded && wider.quantile(LEVEL) > known && known > 0.0 {
        test.widened = wider.quantile(LEVEL) / known;
        correction.scores = wider;
    }
    Ok(Some(test))
}
