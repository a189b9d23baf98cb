//! Checks of held-out rows: copies of identification rows, outliers, and large prediction errors.

use std::collections::HashSet;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::misfit::{MIN_SPREAD, misfit, unreported};
use super::mistaken_rows::MistakenRows;
use super::outliers::{Outlier, outliers_as_json};
use super::row_kind::{RowKind, format_error, row_noun};
use crate::fit::Identification;
use crate::fit::stages::fitting::Fitting;
use crate::fit::uncertainty::residual_lengths::{noise_lengths_of_all, scatter};
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares as _};
use crate::numeric::median;
use crate::observation::kind_named;

/// Smallest ratio of the rms held-out error of the fitted arm to that of the registered nominal
/// arm, at which the fit is reported as worse.
const MIN_ERROR_RATIO: f64 = 1.5;
/// Smallest rms held-out error, as a multiple of the noise that the fit assumed, at which the fit
/// is reported as worse than the nominal arm.
const MIN_NOISE_MULTIPLE: f64 = 5.0;

/// Largest ratio of the rms error of held-out rows with a mistake corrected to that without, and to
/// that of the fitted rows, at which the mistake is named.
const MAX_MISTAKEN_RATIO: f64 = 0.2;
const MAX_RATIO_TO_FITTED: f64 = 4.0;

/// Returns all held-out rows, in their order, each with its length s · scatter as the distance
/// ([`outliers`]).
pub(in crate::fit) fn rows(
    fitting: &Fitting,
    x: &DVector<f64>,
    unknowns: &[usize],
    covariance: &DMatrix<f64>,
) -> Vec<Outlier> {
    let rows = &fitting.split.held_out;
    let stage = fitting.stage(rows, unknowns.to_vec());
    let residuals = stage.residuals(x);
    let at = residuals.unknowns_in(x);
    let n = unknowns.len();
    let rows_per_pose = stage.coordinates();
    let of_chunk = |chunk: usize| -> Vec<f64> {
        let items = chunk * CHUNK_ITEMS..((chunk + 1) * CHUNK_ITEMS).min(rows.len());
        let poses = items.len();
        let mut block = Block::zeros(rows_per_pose * poses, n);
        residuals.linearise(&at, items, &mut block);
        let jacobian = DMatrix::from_fn(3 * poses, n, |row, j| {
            block.column(j)[rows_per_pose * (row / 3) + row % 3]
        });
        let spread = &jacobian * covariance;
        let length = |pose: usize| {
            let residual = Vector3::from_fn(|i, _| block.column(n)[rows_per_pose * pose + i]);
            let entry =
                |i: usize, k: usize| spread.row(3 * pose + i).dot(&jacobian.row(3 * pose + k));
            let variance = Matrix3::identity() + Matrix3::from_fn(entry);
            // The residual is scaled first, because squares of very large numbers overflow.
            let size = residual.amax().max(1.0);
            let square = variance.cholesky().map_or(f64::NAN, |factor| {
                (residual / size).dot(&factor.solve(&(residual / size)))
            });
            size * square.max(0.0).sqrt()
        };
        (0..poses).map(length).collect()
    };
    let lengths: Vec<f64> =
        (0..rows.len().div_ceil(CHUNK_ITEMS)).into_par_iter().flat_map_iter(of_chunk).collect();
    let errors = fitting.position_errors(rows, x);
    let rows = rows.iter().zip(lengths).zip(errors);
    rows.map(|((&row, length), error)| Outlier::new(fitting.measurements, row, length, error))
        .collect()
}

/// Returns those of the held-out [`rows`] that are farther from the prediction than the σ and the
/// covariance of the fit allow, in the order of the rows.
///
/// A row is an outlier if P(χ²ₖ > s²) < 0.01 / N with s² = rᵀ (I + J C Jᵀ)⁻¹ r / scatter², N rows
/// and k measured numbers of the row. The residual r and the Jacobian J are whitened by the σ that
/// the fit assumed, and C is the covariance of its `unknowns` at `x`. The scatter is the median
/// over the rows of √(rᵀ (I + J C Jᵀ)⁻¹ r / median of χ²ₖ), or 1 if that is larger. If the model
/// lacks an effect that acts in all rows, the scatter grows, so that not every row becomes an
/// outlier.
pub(in crate::fit) fn outliers(rows: &[Outlier]) -> Vec<Outlier> {
    let lengths: Vec<f64> = rows.iter().map(|row| row.distance).collect();
    let numbers: Vec<usize> = rows.iter().map(|row| kind_named(row.kind).numbers).collect();
    let noise_lengths = noise_lengths_of_all(&numbers);
    let scatter = scatter(&lengths, &noise_lengths).max(1.0);
    let outlier = |(row, (_, limit)): (&Outlier, (f64, f64))| {
        let distance = row.distance / scatter;
        (distance > limit).then(|| Outlier { distance, ..row.clone() })
    };
    rows.iter().zip(noise_lengths).filter_map(outlier).collect()
}

/// Returns the number of held-out rows of a fit that copy an identification row: configuration,
/// measured numbers, session and kind are equal to the bit.
fn copies(fit: &CheckedFit) -> usize {
    let Fitting { measurements, split, .. } = fit.fitting;
    let key = |row: usize| -> Vec<u64> {
        let values =
            measurements.configuration(row).iter().chain(measurements.positions[row].iter());
        let words = measurements
            .observation(row)
            .sort_key()
            .into_iter()
            .chain([measurements.session.of_row[row]]);
        values.map(|value| value.to_bits()).chain(words.map(|word| word as u64)).collect()
    };
    let fitted: HashSet<Vec<u64>> = split.identification.iter().map(|&row| key(row)).collect();
    split.held_out.iter().filter(|&&row| fitted.contains(&key(row))).count()
}

/// Maximum number of held-out rows that the text of a finding names.
const MAX_NAMED_ROWS: usize = 3;

/// Checks that at least one held-out row is no copy of an identification row.
pub(super) fn not_all_copied(fit: &CheckedFit) -> Option<Finding> {
    let rows = fit.fitting.split.held_out.len();
    if rows == 0 || copies(fit) < rows {
        return None;
    }
    let text =
        "all held-out rows are identification rows again: their errors judge nothing".to_owned();
    Some(Finding::new(FindingCode::HeldOutCopied, [rows.into()], text))
}

/// Checks that no held-out row copies an identification row, unless all do.
pub(super) fn not_repeated(fit: &CheckedFit) -> Option<Finding> {
    let (rows, of) = (copies(fit), fit.fitting.split.held_out.len());
    if rows == 0 || rows == of {
        return None;
    }
    let text =
        format!("{rows} of {of} held-out rows are identification rows again: they judge nothing");
    let numbers = [rows.into(), of.into()];
    Some(Finding::new(FindingCode::HeldOutRepeated, numbers, text))
}

/// Smallest share of held-out rows of fitted poses that is reported.
const MIN_FITTED_SHARE: f64 = 0.5;

/// Checks that at most half of the held-out rows are of poses that were fitted too.
pub(super) fn other_poses_held_out(fit: &CheckedFit) -> Option<Finding> {
    let Fitting { measurements, split, .. } = fit.fitting;
    let poses = measurements.pose_numbers(fit.problem);
    // Other loads and temperatures judge the model, also at the same joint angles.
    let bits =
        |column: &Option<Vec<f64>>, row: usize| column.as_ref().map(|values| values[row].to_bits());
    let temperature =
        |row: usize| measurements.temperature.as_ref().map(|values| values[row].round().to_bits());
    let state = |&row: &usize| {
        let loads = [&measurements.payload, &measurements.hoist].map(|column| bits(column, row));
        (poses[row], loads, temperature(row))
    };
    let fitted: HashSet<_> = split.identification.iter().map(state).collect();
    let rows = split.held_out.iter().filter(|row| fitted.contains(&state(row))).count();
    let of = split.held_out.len();
    if rows as f64 <= MIN_FITTED_SHARE * of as f64 || copies(fit) > 0 {
        return None;
    }
    let text = format!(
        "{rows} of {of} held-out rows are of poses that are fitted too: their errors show how well \
         poses repeat, not how well other poses are predicted"
    );
    let numbers = [rows.into(), of.into()];
    Some(Finding::new(FindingCode::HeldOutPosesFitted, numbers, text))
}

/// Checks that the median prediction error of the held-out rows of each kind is small relative to
/// the spread of the fitted rows, or to σ.
pub(super) fn held_out_reached(fit: &CheckedFit) -> Vec<Finding> {
    let fitting = fit.fitting;
    let errors = fitting.position_errors(&fitting.split.held_out, &fit.end.x);
    let of_kind = |row_kind: RowKind| {
        let RowKind { observation, spread, .. } = row_kind;
        let kind = observation.kind();
        let is_of_kind = |row: usize| fitting.measurements.observation(row).kind() == kind;
        let held_out = fitting.split.held_out.iter().copied().zip(&errors);
        let (rows, errors): (Vec<usize>, Vec<Vector3<f64>>) =
            held_out.filter(|(row, _)| is_of_kind(*row)).unzip();
        let lengths = errors.iter().map(nalgebra::Matrix::norm);
        let median = median(lengths.filter(|length| length.is_finite())).unwrap_or(0.0);
        let text = format!(
            "half of the held-out {} are missed by more than {}, {:.0} % of the spread of the \
             fitted ones",
            row_noun(kind),
            format_error(kind, median, 1),
            100.0 * median / spread
        );
        let numbers = [kind.into(), median.into(), spread.into()];
        let finding = || {
            let finding = Finding::new(FindingCode::HeldOutMissed, numbers, text);
            match held_base(fit) {
                Some(base) => finding.with_remedy(format!(
                    "base[{base}] is held where it is declared, while another base is free: \
                     free it in [parameters], \"base[{base}].*\" = {{ free = true }}"
                )),
                None => match mistake(fit, &row_kind, (&rows, &errors)) {
                    Some(words) => finding
                        .with_remedy(format!("{words}; correct these rows, or hold out others")),
                    None => finding,
                },
            }
        };
        (spread > MIN_SPREAD && median > unreported(&row_kind)).then(finding)
    };
    fit.kinds().into_iter().filter_map(of_kind).collect()
}

/// Returns the words for the mistake with which the fitted arm predicts held-out `rows` of a kind
/// about as well as it fits the others; `None` if there is none, or if the fit is far off too.
pub(super) fn mistake(
    fit: &CheckedFit,
    kind: &RowKind,
    (rows, errors): (&[usize], &[Vector3<f64>]),
) -> Option<String> {
    let is_sound = fit.has_further_fits && misfit(fit).is_empty();
    if !(is_sound && kind.observation.is_position()) {
        return None;
    }
    let fitted = fit.rms_at(&kind.rows, &fit.end.x);
    let limit = (MAX_MISTAKEN_RATIO * fit.rms(rows, errors)).min(MAX_RATIO_TO_FITTED * fitted);
    MistakenRows { fit, x: &fit.end.x, rows, limit }.cause()
}

/// Returns the name of a base that held-out rows use and of which no coordinate is free, while those
/// of another base are.
fn held_base<'a>(fit: &CheckedFit<'a>) -> Option<&'a str> {
    let Fitting { placement, split, .. } = *fit.fitting;
    if !fit.is_base_free() {
        return None;
    }
    let mut bases = split.held_out.iter().map(|&row| placement.base_of(row));
    bases.find(|&base| !fit.frees_base(base)).map(|base| placement.bases[base].as_str())
}

/// Checks that the fitted arm predicts held-out rows not much worse than the registered nominal
/// arm.
pub(super) fn better_than_nominal(fit: &CheckedFit) -> Option<Finding> {
    let kind = fit.fitted.held_out.kind;
    let (before, after) = (fit.registered.held_out.rms.norm, fit.fitted.held_out.rms.norm);
    let row_kind = fit.kinds().into_iter().find(|row_kind| row_kind.observation.kind() == kind);
    let RowKind { observation, taken_sigma, .. } = row_kind?;
    let noise = observation.expected_norm() * taken_sigma;
    if !(after > MIN_ERROR_RATIO * before && after > MIN_NOISE_MULTIPLE * noise) {
        return None;
    }
    let text = format!(
        "the fitted arm misses held-out {} by more than the nominal arm ({} rms before, {} \
         after)",
        row_noun(kind),
        format_error(kind, before, 3),
        format_error(kind, after, 3)
    );
    let numbers = [kind.into(), before.into(), after.into()];
    Some(Finding::new(FindingCode::HeldOutWorse, numbers, text))
}

/// Checks that no held-out row has a prediction error too large to be noise.
pub(super) fn without_outliers(fit: &CheckedFit) -> Option<Finding> {
    let (rows, of) = (fit.held_out_outliers, fit.fitting.split.held_out.len());
    (!rows.is_empty()).then(|| finding_of(rows, of))
}

/// Returns the finding about held-out outliers `rows` among `of` held-out rows.
fn finding_of(rows: &[Outlier], of: usize) -> Finding {
    let name = |row: &Outlier| {
        let is_vector = kind_named(row.kind).numbers == 3;
        let axis = if is_vector { " along an axis" } else { "" };
        format!("{} (off by {}{axis})", row.location, format_error(row.kind, row.error.amax(), 3))
    };
    let named: Vec<String> = rows.iter().take(MAX_NAMED_ROWS).map(name).collect();
    let more = rows.len().saturating_sub(MAX_NAMED_ROWS);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    let (count, verb) = (rows.len(), if rows.len() == 1 { "is" } else { "are" });
    let text = format!(
        "{count} of {of} held-out rows {verb} too far off to be noise: {}{more}",
        named.join(", ")
    );
    let finding =
        Finding::new(FindingCode::HeldOutOutliers, [outliers_as_json(rows), of.into()], text);
    if rows.iter().any(|row| row.kind != "pixel") {
        return finding;
    }
    finding.with_remedy(
        "leave out corners that the detector misplaced, or weigh them less by [robust]",
    )
}

impl Identification {
    /// Judges all held-out rows with a remainder that is kept. `errors` are those of all rows with
    /// the remainder \[m\]; rows without a finite one, and other rows than positions, are judged
    /// without it.
    pub(crate) fn judge_corrected(&mut self, errors: &[Vector3<f64>]) {
        let corrected = |row: &Outlier| {
            let error = errors.get(row.row).filter(|error| error.norm().is_finite());
            match error.filter(|_| row.kind == "position" && row.error.norm() > 0.0) {
                Some(&error) => {
                    let distance = row.distance * error.norm() / row.error.norm();
                    Outlier { distance, error, ..row.clone() }
                }
                None => row.clone(),
            }
        };
        let corrected: Vec<Outlier> = self.held_out_rows.iter().map(corrected).collect();
        self.held_out_outliers = outliers(&corrected);
        let code = FindingCode::HeldOutOutliers;
        let place = self.findings.iter().position(|finding| finding.code == code);
        let found = (!self.held_out_outliers.is_empty())
            .then(|| finding_of(&self.held_out_outliers, corrected.len()));
        match (place, found) {
            (Some(place), Some(Finding { numbers, text, .. })) => {
                let finding = &mut self.findings[place];
                (finding.numbers, finding.text) = (numbers, text);
            }
            (Some(place), None) => drop(self.findings.remove(place)),
            (None, found) => self.findings.extend(found),
        }
        for finding in &mut self.findings {
            if finding.code == FindingCode::HeldOutBeyondPrediction {
                finding.text += ", without the remainder";
            }
        }
    }
}
