//! Two causes of a change together.

use nalgebra::DMatrix;

use super::assessment::{AssessedCause, Assessment, Weighted, weighted_cause};
use super::causes::{Cause, CauseKind, Trial};
use super::evidence::{MIN_NAMED_PROBABILITY, NOISE_RATIOS, SECOND_CHANGE_ODDS, Unchanged, ln_sum};
use super::onset::sums_of;
use super::rows::SensitiveRows;

/// Maximum number of causes of which all pairs are tried: those with the largest evidence.
const MAX_PAIRED_CAUSES: usize = 40;

/// Returns the assessment with the pairs of `causes`, if the pairs together are nine times as
/// probable as all single causes, alone or with larger noise: what a model lacks looks like noise,
/// and a second cause would fit a part of it. The pairs are appended to `causes`. Otherwise no pair
/// is listed, and their probability is subtracted from that of the single causes.
///
/// All pairs have the prior odds [`SECOND_CHANGE_ODDS`] together, and each pair has a share in
/// proportion to the product of the prior probabilities of its causes. The evidence for a change, and
/// with it the rate of false alarms, does not depend on pairs. Returns `None` if a number is not
/// finite.
pub(super) fn with_pairs(
    assessment: Assessment,
    rows: &SensitiveRows,
    factor: &DMatrix<f64>,
    causes: &mut Vec<Cause>,
) -> Option<Assessment> {
    let single = assessment.causes.iter().map(|assessed| &causes[assessed.cause]);
    let single: Vec<&Cause> = single.filter(|cause| !cause.columns.is_empty()).collect();
    let paired = &single[..single.len().min(MAX_PAIRED_CAUSES)];
    let mut pairs: Vec<Cause> = paired
        .iter()
        .enumerate()
        .flat_map(|(place, a)| paired[..place].iter().map(|b| pair(b, a)))
        .collect();
    let all = ln_sum(pairs.iter().map(|pair| pair.ln_weight));
    let unchanged = Unchanged::new(&sums_of(rows, 1.0), factor)?;
    let every_column: Vec<usize> = (0..rows.sensitivity.ncols()).collect();
    let mut found: Vec<(usize, Weighted)> = Vec::new();
    for (place, pair) in pairs.iter_mut().enumerate() {
        pair.ln_weight += SECOND_CHANGE_ODDS.ln() - all;
        let weighted = weighted_cause(&unchanged, pair, &every_column);
        found.extend(weighted.map(|weighted| (causes.len() + place, weighted)));
    }
    let of_pairs = ln_sum(found.iter().map(|(_, weighted)| weighted.ln_share));
    let noise = causes.iter().find(|cause| cause.kind == CauseKind::Noise);
    let ln_prior = noise.map_or(f64::NEG_INFINITY, |noise| noise.ln_weight)
        + SECOND_CHANGE_ODDS.ln()
        - all
        - (NOISE_RATIOS.len() as f64).ln();
    let with_noise = NOISE_RATIOS.iter().filter_map(|&ratio| {
        let noisier = Unchanged::new(&sums_of(rows, ratio), factor)?;
        let of_cause = |cause: &&Cause| weighted_cause(&noisier, cause, &every_column);
        let shares = paired.iter().filter_map(of_cause).map(|weighted| weighted.ln_share);
        Some(ln_sum(shares) + unchanged.against(&noisier) + ln_prior)
    });
    let others = ln_sum(with_noise.chain([assessment.ln_sum]));
    let odds = MIN_NAMED_PROBABILITY / (1.0 - MIN_NAMED_PROBABILITY);
    if of_pairs < others + odds.ln() {
        let part = (others - ln_sum([others, of_pairs])).exp();
        return Some(assessment.scaled(part));
    }
    let sum = ln_sum([assessment.ln_sum, of_pairs]);
    let assessed = found.into_iter().map(|(cause, weighted)| AssessedCause {
        probability: (weighted.ln_share - sum).exp(),
        ..weighted.assessed(cause, 0)
    });
    let part = (assessment.ln_sum - sum).exp();
    let assessment = assessment.scaled(part);
    let mut all: Vec<AssessedCause> = assessment.causes.into_iter().chain(assessed).collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    causes.extend(pairs);
    Some(Assessment { causes: all, ln_sum: sum, ..assessment })
}

/// Returns the cause that moves the columns of two causes. Its trials are all combinations of theirs.
fn pair(first: &Cause, second: &Cause) -> Cause {
    let combined = |a: &Trial, b: &Trial| Trial {
        sigmas: [&*a.sigmas, &b.sigmas].concat(),
        ln_prior: a.ln_prior + b.ln_prior,
    };
    let trials =
        first.trials.iter().flat_map(|a| second.trials.iter().map(move |b| combined(a, b)));
    Cause {
        kind: CauseKind::Two,
        label: format!("{} and {}", first.label, second.label),
        columns: [&*first.columns, &second.columns].concat(),
        terms: [&*first.terms, &second.terms].concat(),
        amplitudes: [&*first.amplitudes, &second.amplitudes].concat(),
        trials: trials.collect(),
        ln_weight: first.ln_weight + second.ln_weight,
    }
}
