//! Sequential test of an unchanged arm against a mixture of causes of a change.

use nalgebra::{DMatrix, DVector};

use super::causes::{Cause, CauseKind};
use super::evidence::{NOISE_RATIOS, OTHER_RATIOS, Unchanged, ln_sum};
use super::rows::{SensitiveRows, Sums};

/// Maximum number of looks, which are row counts after which the evidence is computed. Tables with
/// more rows have looks in equal steps.
const MAX_LOOKS: usize = 400;

/// Sums over rows for several ratios of the noise to the assumed one, each with its ratio.
type SumsByRatio = Vec<(f64, Sums)>;

/// Result of the test after all rows.
pub(super) struct Assessment {
    /// Number of rows at each look, and ln of the likelihood ratio of the mixture of causes to
    /// "unchanged" for these rows.
    pub looks: Vec<(usize, f64)>,
    /// Causes, the most probable first.
    pub causes: Vec<AssessedCause>,
    /// ln Σ (prior probability × likelihood ratio) over all causes, for all rows.
    pub ln_sum: f64,
    /// Squared length rᵀ S⁻¹ r of all residuals: χ² with `coordinates` degrees of freedom if
    /// nothing changed.
    pub chi2: f64,
    /// Number of measured coordinates.
    pub coordinates: f64,
}

/// Cause with its probability and amplitudes, given the rows.
#[derive(Debug, Clone)]
pub(super) struct AssessedCause {
    /// Index among the causes that were tried.
    pub cause: usize,
    /// Index of the row, if the cause is a gross error of one row.
    pub row: Option<usize>,
    /// Index of the first row that shows the change; 0 if it happened before the table.
    pub onset: usize,
    /// Probability among all causes, given that something changed.
    pub probability: f64,
    /// Prior 1 σ of each amplitude, those of the trial with the largest evidence; empty for noise,
    /// gross rows and something else.
    pub sizes: Vec<f64>,
    /// Posterior mean of the amplitudes with these prior 1 σ; for larger noise and something else,
    /// the ratio to the assumed noise.
    pub mean: DVector<f64>,
    /// Posterior covariance of the amplitudes.
    pub covariance: DMatrix<f64>,
}

impl Assessment {
    /// Returns the assessment with the probability of each cause multiplied by `part`.
    pub fn scaled(mut self, part: f64) -> Self {
        self.causes.iter_mut().for_each(|cause| cause.probability *= part);
        self
    }
}

impl AssessedCause {
    /// Returns the name of the cause, with its row or its onset; `location` names a row by its file
    /// and line.
    pub fn label(&self, causes: &[Cause], location: impl Fn(usize) -> String) -> String {
        match (self.row, self.onset) {
            (Some(row), _) => format!("{} is off", location(row)),
            (None, 0) => causes[self.cause].label.clone(),
            (None, onset) => format!("{}, from {} on", causes[self.cause].label, location(onset)),
        }
    }
}

/// Weighted likelihood ratio of a cause, with the amplitudes of the trial of largest evidence.
pub(super) struct Weighted {
    /// ln (prior probability × likelihood ratio), averaged over the trials.
    pub ln_share: f64,
    sizes: Vec<f64>,
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Weighted {
    /// Creates the weighted ratio of a cause that moves no column of the sensitivities.
    fn without_columns(ln_share: f64, mean: Vec<f64>) -> Self {
        let covariance = DMatrix::zeros(mean.len(), mean.len());
        Self { ln_share, sizes: Vec::new(), covariance, mean: DVector::from_vec(mean) }
    }

    /// Returns the cause with its amplitudes from the row `onset` on; its probability is NaN until
    /// it is set.
    pub fn assessed(self, cause: usize, onset: usize) -> AssessedCause {
        let Self { sizes, mean, covariance, .. } = self;
        AssessedCause { cause, row: None, onset, probability: f64::NAN, sizes, mean, covariance }
    }
}

/// Computes the weighted likelihood ratio of a cause that moves columns of the sensitivities.
/// `columns` maps each column that causes name to one of the sums. Returns `None` for noise and
/// gross rows, or if a number is not finite.
pub(super) fn weighted_cause(
    unchanged: &Unchanged,
    cause: &Cause,
    columns: &[usize],
) -> Option<Weighted> {
    let columns: Vec<usize> = cause.columns.iter().map(|&k| columns[k]).collect();
    let tried: Vec<_> = cause
        .trials
        .iter()
        .filter_map(|trial| {
            let (ratio, mean, covariance) = unchanged.likelihood_ratio(&columns, &trial.sigmas)?;
            Some((ratio + trial.ln_prior, &trial.sigmas, mean, covariance))
        })
        .collect();
    let ln_share = ln_sum(tried.iter().map(|entry| entry.0)) + cause.ln_weight;
    let (_, sizes, mean, covariance) = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(Weighted { ln_share, sizes: sizes.clone(), mean, covariance })
}

/// Tests rows in their order. `factor` is F with F Fᵀ the covariance of the estimate, one row for
/// each column of the sensitivities. Only the last look is computed if `is_sequential` is false.
///
/// Returns `None` if a number is not finite.
pub(super) fn assess(
    rows: &SensitiveRows,
    factor: &DMatrix<f64>,
    causes: &[Cause],
    is_sequential: bool,
) -> Option<Assessment> {
    // Poses without an equilibrium have no residual.
    if rows.residual.iter().any(|residual| !residual.is_finite()) {
        return None;
    }
    let columns = rows.sensitivity.ncols();
    let mut sums = Sums::new(columns, 1.0);
    let of_ratios = |ratios: &[f64]| -> SumsByRatio {
        ratios.iter().map(|&ratio| (ratio, Sums::new(columns, ratio))).collect()
    };
    let mut noisier = [of_ratios(&NOISE_RATIOS), of_ratios(&OTHER_RATIOS)];
    let step = rows.len().div_ceil(MAX_LOOKS).max(1);
    let mut looks = Vec::new();
    let mut last = None;
    for row in 0..rows.len() {
        sums.add(rows, row, 1.0);
        for (_, sums) in noisier.iter_mut().flatten() {
            sums.add(rows, row, 1.0);
        }
        let is_last = row + 1 == rows.len();
        if !(is_last || is_sequential && (row + 1) % step == 0) {
            continue;
        }
        let unchanged = Unchanged::new(&sums, factor)?;
        let weighted =
            weighted_ratios(rows, row + 1, (&sums, &noisier, factor), &unchanged, causes);
        // The likelihood ratio of a gross row that is still to come is 1.
        let to_come = causes.iter().find(|cause| cause.kind == CauseKind::Row);
        let to_come = to_come.map(|cause| cause.ln_weight - (row as f64 + 2.0).ln());
        let evidence = ln_sum(weighted.iter().map(|(.., entry)| entry.ln_share).chain(to_come));
        looks.push((row + 1, evidence));
        if is_last {
            last = Some((weighted, unchanged.squares));
        }
    }
    let (weighted, chi2) = last?;
    let all = ln_sum(weighted.iter().map(|(.., entry)| entry.ln_share));
    let mut causes: Vec<AssessedCause> = weighted
        .into_iter()
        .map(|(cause, row, entry)| AssessedCause {
            row,
            probability: (entry.ln_share - all).exp(),
            ..entry.assessed(cause, 0)
        })
        .collect();
    causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    Some(Assessment { looks, causes, ln_sum: all, chi2, coordinates: sums.coordinates })
}

/// Computes the weighted likelihood ratio of each cause, and of a gross error of each of the first
/// `count` rows. Returns them with the index of the cause and of the gross row. `noisier` holds the
/// sums with each of [`NOISE_RATIOS`], then those with each of [`OTHER_RATIOS`].
fn weighted_ratios(
    rows: &SensitiveRows,
    count: usize,
    (sums, noisier, factor): (&Sums, &[SumsByRatio; 2], &DMatrix<f64>),
    unchanged: &Unchanged,
    causes: &[Cause],
) -> Vec<(usize, Option<usize>, Weighted)> {
    let every_column: Vec<usize> = (0..rows.sensitivity.ncols()).collect();
    let mut weighted = Vec::new();
    for (index, cause) in causes.iter().enumerate() {
        match cause.kind {
            CauseKind::Noise | CauseKind::Other => {
                let noisier = &noisier[usize::from(cause.kind == CauseKind::Other)];
                let ratio = |(ratio, sums): &(f64, Sums)| {
                    Some((unchanged.against(&Unchanged::new(sums, factor)?), *ratio))
                };
                let found: Vec<(f64, f64)> = noisier.iter().filter_map(ratio).collect();
                let best = found.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
                let share = ln_sum(found.iter().map(|entry| entry.0)) - (noisier.len() as f64).ln()
                    + cause.ln_weight;
                let noise = |(_, ratio)| Weighted::without_columns(share, vec![ratio]);
                weighted.extend(best.map(noise).map(|share| (index, None, share)));
            }
            // Row i has the prior probability 1 / (i (i + 1)), which sums to 1 over all i.
            CauseKind::Row => weighted.extend((0..count).filter_map(|row| {
                let number = row as f64 + 1.0;
                let share = unchanged.gross_row(rows, row, (sums, factor))? + cause.ln_weight
                    - (number * (number + 1.0)).ln();
                Some((index, Some(row), Weighted::without_columns(share, Vec::new())))
            })),
            _ => {
                let found = weighted_cause(unchanged, cause, &every_column);
                weighted.extend(found.map(|share| (index, None, share)));
            }
        }
    }
    weighted
}
