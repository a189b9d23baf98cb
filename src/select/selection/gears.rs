//! Common prior of the harmonics of joints with a periodic error of many orders.
//!
//! If a joint covers only part of a turn, harmonics of neighbouring orders hardly differ there.
//! Estimated without a prior, they cancel at the measured poses and diverge elsewhere. With all
//! orders in the model and one Gaussian prior on the coefficients, predictions tend to zero where
//! nothing was measured.
//!
//! The joints of one arm have similar gears, whose errors have similar orders. Therefore σₖ = s hₖ
//! is common to all joints. The spectrum hₖ is that of the coefficients of all joints, smoothed
//! over neighbouring orders. The search uses the scale s of the largest evidence, which leaves the
//! least residual to other hypotheses. The extended problem has the scale that predicts best when
//! parts of a joint's range are left out. That scale is smaller if the errors are not exact
//! harmonics.

use crate::problem::Problem;
use crate::select::data::Data;
use crate::select::fitted::Fitted;
use crate::select::harmonic_prior::{HarmonicPrior, harmonic_order};
use crate::select::neighbourhood::PartSquares;

/// Number of passes of the spectrum's estimate: σₖ from the coefficients, then the coefficients
/// under σₖ. More passes hardly change it.
const SPECTRUM_PASSES: usize = 2;
/// Number of parts of each joint's range that are left out in turn to find the scale of the prior.
const RANGE_PARTS: usize = 5;
/// Trial scales of the prior, as powers of two of the current scale; half and quarter powers about
/// the best one follow.
const SCALE_POWERS: std::ops::RangeInclusive<i32> = -8..=4;
/// Standard deviation of the kernel that smooths σₖ \[orders\]. A joint that covers part of a turn
/// cannot resolve finer.
const SPECTRUM_WIDTH: f64 = 1.5;
/// Weight of the mean square of all coefficients in the σₖ² of one order, as an equivalent number
/// of coefficients.
const COMMON_COEFFICIENTS: f64 = 4.0;

/// Returns the indices of the harmonics' coefficients among the unknowns, each with its order.
fn harmonic_coefficients(fitted: &Fitted) -> Vec<(usize, u32)> {
    let order = |j: usize| harmonic_order(&fitted.model.parameters[fitted.unknowns[j]].regressor);
    (0..fitted.unknowns.len()).filter_map(|j| Some((j, order(j)?))).collect()
}

/// Criterion by which the scale of the prior is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ScaleBy {
    /// Chooses the scale with the largest evidence.
    Evidence,
    /// Chooses the scale that predicts left-out parts of the joints' ranges best.
    LeftOutRanges,
}

/// Returns the prior whose σₖ are estimated from the coefficients of a fit under the prior `first`.
/// Its scale is chosen by `criterion` in the linear neighbourhood of the fit. Returns `first` if no
/// scale can be evaluated.
pub(super) fn estimated_prior(
    fitted: &Fitted,
    data: &Data,
    (first, criterion): (HarmonicPrior, ScaleBy),
) -> HarmonicPrior {
    let linearised = fitted.linearised(data, &[]);
    let parts = match criterion {
        ScaleBy::Evidence => Vec::new(),
        ScaleBy::LeftOutRanges => parts_of_ranges(&fitted.problem, data),
    };
    let squares = PartSquares::new(linearised.fitted(), linearised.residual(), &parts);
    let parameters =
        fitted.unknowns.iter().map(|&k| (fitted.found.x[k], fitted.model.parameters[k].sigma));
    let values_and_sigmas =
        parameters.chain(linearised.relaxed().iter().map(|&sigma| (0.0, sigma)));
    // If the fit assumed a σ larger than the declared one, its priors had a correspondingly larger
    // weight.
    let weight = fitted.found.noise_factor.max(1.0).sqrt();
    let priors: Vec<(f64, Option<f64>)> =
        values_and_sigmas.map(|(x, sigma)| (x, sigma.map(|sigma| sigma / weight))).collect();
    // Declared harmonics whose orders the prior does not contain keep their declared priors.
    let coefficients: Vec<(usize, u32)> = harmonic_coefficients(fitted)
        .into_iter()
        .filter(|(_, order)| first.sigma(*order).is_some())
        .collect();
    let with = |prior: &HarmonicPrior| {
        let mut priors = priors.clone();
        for &(j, order) in &coefficients {
            priors[j].1 = prior.sigma(order).map(|sigma| sigma / weight);
        }
        priors
    };
    let best_of = |prior: &HarmonicPrior, powers: &[f64]| {
        let error = |&power: &f64| {
            let prior = prior.scaled(power.exp2());
            let priors = with(&prior);
            let error = match criterion {
                ScaleBy::Evidence => squares.evidence(&priors, weight.powi(2)),
                ScaleBy::LeftOutRanges => squares.left_out(&priors),
            };
            Some((error?, prior))
        };
        powers.iter().filter_map(error).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let refined = |(least, prior): (f64, HarmonicPrior), step: f64| {
        best_of(&prior, &[-step, step]).filter(|other| other.0 < least).unwrap_or((least, prior))
    };
    // Under a wider prior, the coefficients of neighbouring orders are large and cancel, so they do
    // not show the spectrum.
    let powers: Vec<f64> = SCALE_POWERS.map(f64::from).collect();
    let Some(flat) = best_of(&first, &powers).map(|best| refined(refined(best, 0.5), 0.25)) else {
        return first;
    };
    let spectrum = (0..SPECTRUM_PASSES).fold(flat.1.clone(), |prior, _| {
        let Some((x, variances)) = squares.posterior(&with(&prior)) else { return prior };
        let expected: Vec<(u32, f64)> = coefficients
            .iter()
            .map(|&(j, order)| (order, x[j].powi(2) + weight.powi(2) * variances[j]))
            .collect();
        smoothed(&prior, &expected)
    });
    let shaped = best_of(&spectrum, &[0.0]).map(|best| refined(refined(best, 0.5), 0.25));
    shaped.filter(|shaped| shaped.0 < flat.0).unwrap_or(flat).1
}

/// Returns σₖ of every order from expected squared coefficients of all joints.
///
/// σₖ² ∝ (Σ w c² + m c̄²) / (Σ w + m), w = exp(−(k' − k)² / (2 width²)), with m =
/// `COMMON_COEFFICIENTS` and c̄² the mean square. The result is scaled to the mean square of the
/// prior.
fn smoothed(prior: &HarmonicPrior, expected: &[(u32, f64)]) -> HarmonicPrior {
    let count = expected.len().max(1) as f64;
    let mean = expected.iter().map(|entry| entry.1).sum::<f64>() / count;
    let of = |order: u32| {
        let near = |other: u32| {
            (-0.5 * ((f64::from(other) - f64::from(order)) / SPECTRUM_WIDTH).powi(2)).exp()
        };
        let add = |(sum, weight): (f64, f64), entry: &(u32, f64)| {
            (sum + near(entry.0) * entry.1, weight + near(entry.0))
        };
        let start = (COMMON_COEFFICIENTS * mean, COMMON_COEFFICIENTS);
        let (sum, weight) = expected.iter().fold(start, add);
        (sum / weight).sqrt()
    };
    let shaped = HarmonicPrior {
        by_order: prior.by_order.iter().map(|&(order, _)| (order, of(order))).collect(),
    };
    let size = |prior: &HarmonicPrior| {
        let squares =
            expected.iter().filter_map(|entry| prior.sigma(entry.0)).map(|sigma| sigma.powi(2));
        (squares.sum::<f64>() / count).sqrt()
    };
    let (before, after) = (size(prior), size(&shaped));
    if before > 0.0 && after > 0.0 { shaped.scaled(before / after) } else { prior.clone() }
}

/// Returns the indices of identification poses in each of [`RANGE_PARTS`] parts of the range of
/// each moving joint; the parts of a joint contain about equal numbers of poses.
fn parts_of_ranges(problem: &Problem, data: &Data) -> Vec<Vec<usize>> {
    let (rows, conditions) = (data.rows(), data.conditions(problem));
    let coordinate = |pose: usize, joint: usize| data.measurements.configuration(rows[pose])[joint];
    let of_joint = |joint: usize| {
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by(|&a, &b| coordinate(a, joint).total_cmp(&coordinate(b, joint)));
        order
            .chunks(rows.len().div_ceil(RANGE_PARTS).max(1))
            .map(<[usize]>::to_vec)
            .collect::<Vec<_>>()
    };
    (0..data.measurements.joints)
        .filter(|&joint| conditions.moves(joint))
        .flat_map(of_joint)
        .collect()
}
