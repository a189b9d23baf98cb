//! Checks of the prediction for held-out rows: are its errors as large as its uncertainty, and no
//! larger than those of the nominal arm?

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{
    Binomial, ChiSquared, ContinuousCDF as _, DiscreteCDF as _, FisherSnedecor,
};

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::held_out::mistake;
use super::outliers::Outlier;
use super::row_kind::{format_error, row_noun};
use crate::fit::stages::fitting::Fitting;
use crate::fit::uncertainty::noise::Noise;
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares as _};
use crate::numeric::{parallel, spaced};
use crate::problem::Observation;

/// p-value of the held-out residuals below which they contradict the prediction.
const MAX_CHANCE_PROBABILITY: f64 = 1e-3;
/// Smallest distance of an outlier, in units of the scatter of a coordinate, that is a gross error
/// rather than a wrong prediction.
const MIN_GROSS_DISTANCE: f64 = 10.0;
/// Probability that a row has a gross error.
const PROBABILITY_OF_GROSS_ERROR: f64 = 0.01;
/// Smallest probability of so many gross errors at which they are left out of the test.
const MIN_CHANCE_OF_ERRORS: f64 = 0.01;
/// Maximum number of held-out rows that are tested together, which limits the computing time.
const MAX_TESTED_ROWS: usize = 2048;
/// Smallest ratio of the mean increase of squared held-out errors to its standard error at which
/// the increase is significant.
const MIN_DIFFERENCE: f64 = 2.0;
/// Smallest ratio of the rms held-out error of the fitted arm to that of the registered nominal arm
/// that is more than a difference of rounding.
const MIN_WORSENING: f64 = 1.0 + 1e-6;
/// Smallest ratio of the rms error of held-out pixels to that of fitted ones at which the fit is
/// uncertain.
const UNCERTAIN_RATIO: f64 = 3.0;
/// Minimum number of held-out rows from which the mean increase of squared errors is judged.
const MIN_ROWS: usize = 6;

/// Checks that the held-out residuals are as large as the fit predicts.
///
/// The residuals are r ∼ N(0, Σ + J C Jᵀ) with the noise covariance Σ that the fit assumed and the
/// covariance C of its unknowns. Then χ² = rᵀ(Σ + J C Jᵀ)⁻¹ r has a χ² distribution. If Σ is
/// estimated, χ² over the number of coordinates has an F distribution. Outliers beyond
/// [`MIN_GROSS_DISTANCE`] are left out, unless gross errors are improbable in so many rows.
pub(super) fn prediction_holds(fit: &CheckedFit) -> Option<Finding> {
    let held_out = &fit.fitting.split.held_out;
    let is_far = |outlier: &&Outlier| outlier.distance > MIN_GROSS_DISTANCE;
    let far: Vec<usize> =
        fit.held_out_outliers.iter().filter(is_far).map(|outlier| outlier.row).collect();
    let has_errors = is_plausible_number_of_errors(far.len(), held_out.len());
    let is_used = |row: &usize| !(has_errors && far.contains(row));
    let rows: Vec<usize> = held_out.iter().copied().filter(is_used).collect();
    let rows = spaced(rows, MAX_TESTED_ROWS);
    let (chi2, coordinates) =
        predictive_chi2(fit.fitting, &rows, &fit.end.x, &fit.whole.unknowns, fit.covariance)?;
    let dof = fit.whole.count() as f64 - fit.whole.unknowns.len() as f64;
    let is_estimated = fit.noise != Noise::Declared || (fit.noise_factor - 1.0).abs() > 1e-9;
    let (p_value, limit) = upper_tail(chi2, coordinates, is_estimated.then_some(dof))?;
    if p_value >= MAX_CHANCE_PROBABILITY {
        return None;
    }
    let text = format!(
        "the held-out rows are {:.2} times as far from the prediction as the fit expects: χ² is {chi2:.0} for {coordinates} \
         coordinates, expected below {limit:.0} (99.9 %)",
        (chi2 / coordinates as f64).sqrt()
    );
    let numbers = [chi2.into(), coordinates.into(), p_value.into()];
    let finding = Finding::new(FindingCode::HeldOutBeyondPrediction, numbers, text);
    let leading = fit.leading();
    let errors = fit.errors_at(&rows, &fit.end.x);
    Some(
        finding.with_remedy_of(
            mistake(fit, &leading, (&rows, &errors))
                .map(|words| format!("{words}; correct these rows, or hold out others")),
        ),
    )
}

/// Returns true if at least `count` of `of` rows have gross errors with a probability of more than
/// [`MIN_CHANCE_OF_ERRORS`].
fn is_plausible_number_of_errors(count: usize, of: usize) -> bool {
    let fewer = Binomial::new(PROBABILITY_OF_GROSS_ERROR, of as u64);
    count < 2 || fewer.is_ok_and(|errors| errors.sf(count as u64 - 1) > MIN_CHANCE_OF_ERRORS)
}

/// Returns the probability that χ² of residuals as large as predicted exceeds `chi2`, and the χ²
/// that they exceed with probability [`MAX_CHANCE_PROBABILITY`]. `noise_dof` is the number of
/// degrees of freedom from which the noise was estimated, `None` if the noise is declared. Returns
/// `None` if `chi2` is not finite or there are no degrees of freedom.
fn upper_tail(chi2: f64, coordinates: usize, noise_dof: Option<f64>) -> Option<(f64, f64)> {
    let k = coordinates as f64;
    if !chi2.is_finite() || coordinates == 0 {
        return None;
    }
    if let Some(dof) = noise_dof {
        let distribution = FisherSnedecor::new(k, dof).ok()?;
        Some((
            distribution.sf(chi2 / k),
            k * distribution.inverse_cdf(1.0 - MAX_CHANCE_PROBABILITY),
        ))
    } else {
        let distribution = ChiSquared::new(k).ok()?;
        Some((distribution.sf(chi2), distribution.inverse_cdf(1.0 - MAX_CHANCE_PROBABILITY)))
    }
}

/// Returns χ² = rᵀ(I + J C Jᵀ)⁻¹ r of the measured numbers of `rows` other than orientations,
/// whitened by the σ that the fit assumed, and the number of these numbers. `None` without rows.
///
/// With N = JᵀJ and v = Jᵀr, χ² = r·r − vᵀ C (I + N C)⁻¹ v by the Woodbury identity. Unknowns are
/// in units of their standard errors.
fn predictive_chi2(
    fitting: &Fitting,
    rows: &[usize],
    x: &DVector<f64>,
    unknowns: &[usize],
    covariance: &DMatrix<f64>,
) -> Option<(f64, usize)> {
    let stage = fitting.stage(rows, unknowns.to_vec());
    let (residuals, n, per_pose) = (stage.residuals(x), unknowns.len(), stage.coordinates());
    let at = residuals.unknowns_in(x);
    let scale = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
    let of_chunk = |chunk: usize| {
        let items = chunk * CHUNK_ITEMS..((chunk + 1) * CHUNK_ITEMS).min(rows.len());
        let poses = items.len();
        let mut block = Block::zeros(per_pose * poses, n);
        residuals.linearise(&at, items, &mut block);
        let scaled = DMatrix::from_fn(3 * poses, n + 1, |row, j| {
            let unit = if j < n { scale[j] } else { 1.0 };
            block.column(j)[per_pose * (row / 3) + row % 3] * unit
        });
        scaled.tr_mul(&scaled)
    };
    let chunks = parallel::map(rows.len().div_ceil(CHUNK_ITEMS), of_chunk);
    let products = chunks.into_iter().reduce(|a, b| a + b)?;
    let correlation = DMatrix::from_fn(n, n, |i, j| match scale[i] * scale[j] {
        unit if unit > 0.0 => covariance[(i, j)] / unit,
        _ => 0.0,
    });
    let coordinates = stage.poses.iter().map(|pose| pose.observation.coordinates()).sum();
    if n == 0 {
        return Some((products[(0, 0)], coordinates));
    }
    let vector = products.view((0, n), (n, 1)).column(0).into_owned();
    let matrix = DMatrix::identity(n, n) + products.view((0, 0), (n, n)) * &correlation;
    let explained = vector.dot(&(correlation * matrix.lu().solve(&vector)?));
    Some((products[(n, n)] - explained, coordinates))
}

/// Checks that pixels that were not fitted are missed by about as much as fitted ones, even where the
/// covariance of the fit allows more.
pub(super) fn prediction_is_sure(fit: &CheckedFit) -> Option<Finding> {
    let [fitted, held_out] = [&fit.fitted.identification, &fit.fitted.held_out];
    let ratio = held_out.rms.norm / fitted.rms.norm;
    let is_of_images = fitted.kind == Observation::Pixel(0, 0, 0).kind();
    let exceeds_noise = held_out.rms.norm > UNCERTAIN_RATIO * fit.sigma_taken;
    if !(is_of_images && exceeds_noise && ratio.is_finite() && ratio > UNCERTAIN_RATIO) {
        return None;
    }
    let text = format!("held-out rows miss by {ratio:.0} times as much as fitted ones");
    Some(Finding::new(FindingCode::HeldOutUncertain, [fitted.kind.into(), ratio.into()], text))
}

/// Checks that the squared held-out errors of the fitted arm are not significantly larger, in the
/// mean, than those of the registered nominal arm.
pub(super) fn not_worse_than_nominal(fit: &CheckedFit) -> Option<Finding> {
    let fitting = fit.fitting;
    let kind = fit.fitted.held_out.kind;
    let of_kind = |row: &usize| fitting.measurements.observation(*row).kind() == kind;
    let rows: Vec<usize> = fitting.split.held_out.iter().copied().filter(of_kind).collect();
    let errors = |x| fitting.position_errors(&rows, x);
    let pairs = errors(fit.registered_x).into_iter().zip(errors(&fit.end.x));
    let differences: Vec<f64> = pairs
        .map(|(before, after)| after.norm_squared() - before.norm_squared())
        .filter(|difference| difference.is_finite())
        .collect();
    let count = differences.len() as f64;
    if differences.len() < MIN_ROWS {
        return None;
    }
    let mean = differences.iter().sum::<f64>() / count;
    let squares: f64 = differences.iter().map(|difference| (difference - mean).powi(2)).sum();
    let error = (squares / (count - 1.0) / count).sqrt();
    if mean <= MIN_DIFFERENCE * error {
        return None;
    }
    let (before, after) = (fit.registered.held_out.rms.norm, fit.fitted.held_out.rms.norm);
    // Differences of rounding may all have one sign and are then beyond chance.
    if after <= MIN_WORSENING * before {
        return None;
    }
    let text = format!(
        "the fit made the error of held-out {} worse ({} rms with the nominal arm, {} \
         fitted), beyond chance",
        row_noun(kind),
        format_error(kind, before, 3),
        format_error(kind, after, 3)
    );
    let numbers = [kind.into(), before.into(), after.into()];
    Some(Finding::new(FindingCode::HeldOutNotBetter, numbers, text))
}
