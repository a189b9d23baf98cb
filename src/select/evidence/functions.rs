//! Functions of recorded quantities of a pose, as sums of a few basis functions.

use std::f64::consts::PI;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use crate::residual_tests::Covariate;
use crate::select::settings::SMOOTH_LENGTHS;

/// Margin by which the cosine basis extends on either side of the covariate's range, as a fraction
/// of the range. Functions then need not be flat at the ends of the range.
const RANGE_MARGIN: f64 = 0.25;
/// Smallest prior variance of a smooth basis function, relative to the first one, at which it is
/// kept.
const MIN_BASIS_VARIANCE: f64 = 1e-3;
/// Smallest prior variance of a rough (exponential covariance) basis function, relative to the
/// first one, at which it is kept. Smaller ones are negligible relative to the noise.
const MIN_ROUGH_VARIANCE: f64 = 0.1;

/// Largest width of a cluster of values that noise alone may cause, as a multiple of the largest
/// gap that noise may cause.
const MAX_GAPS_OF_NOISE: f64 = 4.0;

/// Number of trial centres of single bumps and steps along the range.
const SHAPE_CENTRES: u32 = 16;
/// Trial widths of single bumps and steps, as fractions of the range.
const SHAPE_WIDTHS: [f64; 5] = [0.04, 0.07, 0.12, 0.2, 0.35];
/// Trial shapes about a given shape: shifts of the centre as fractions of the width, and factors on
/// the width.
const FINER_SHAPES: ([f64; 9], [f64; 5]) =
    ([-0.6, -0.4, -0.2, -0.1, 0.0, 0.1, 0.2, 0.4, 0.6], [0.7, 0.85, 1.0, 1.2, 1.4]);

/// Single bump exp(−u²/2) or step tanh u with u = (x − centre) / width; x runs from 0 to 1 over the
/// range.
#[derive(Debug, Clone, Copy)]
pub(in crate::select) struct Shape {
    is_bump: bool,
    centre: f64,
    width: f64,
}

impl Shape {
    /// Returns all trial shapes over the range.
    pub fn all() -> Vec<Self> {
        let centres = (0..SHAPE_CENTRES).map(|k| (f64::from(k) + 0.5) / f64::from(SHAPE_CENTRES));
        let of_centre = |centre| {
            SHAPE_WIDTHS
                .into_iter()
                .flat_map(move |width| [true, false].map(|is_bump| Self { is_bump, centre, width }))
        };
        centres.flat_map(of_centre).collect()
    }

    /// Returns trial shapes with centres and widths near those of this one.
    pub fn finer(self) -> Vec<Self> {
        let (steps, factors) = FINER_SHAPES;
        let at = |step: f64| {
            let centre = self.centre + step * self.width;
            factors.map(|factor| Self { centre, width: self.width * factor, ..self })
        };
        steps.into_iter().flat_map(at).collect()
    }

    pub fn value(self, x: f64) -> f64 {
        let u = (x - self.centre) / self.width;
        if self.is_bump { (-0.5 * u * u).exp() } else { u.tanh() }
    }
}

/// Covariate with its value in every pose.
pub(super) struct SampledCovariate {
    pub covariate: Covariate,
    /// Value of the covariate in every pose, SI, temperatures in °C.
    pub values: Vec<f64>,
    /// Values scaled so that the range is 0 to 1; values outside are clamped to the nearer end.
    pub scaled: Vec<f64>,
    /// Smallest and largest value in the poses on which evidence is evaluated.
    pub range: (f64, f64),
    /// Number of different values in those poses.
    pub levels: usize,
    /// Cosines of the basis with the shortest of [`SMOOTH_LENGTHS`], shape = (poses, functions).
    cosines: OnceLock<DMatrix<f64>>,
}

impl SampledCovariate {
    /// Returns the value of the covariate at which its effects vanish: `reference` \[°C\] for a
    /// temperature, 0 for loads, `None` for others.
    pub(super) fn zero(&self, reference: Option<f64>) -> Option<f64> {
        match self.covariate {
            Covariate::Temperature => reference,
            Covariate::Payload | Covariate::Hoist => Some(0.0),
            _ => None,
        }
    }

    /// Returns true if an error may grow in proportion to this covariate. The covariate must be a
    /// temperature, a load or a declared one, and vary at least by half its largest distance from
    /// zero. `reference` is the reference temperature \[°C\].
    pub(super) fn may_scale_error(&self, reference: Option<f64>) -> bool {
        use Covariate::{Declared, Hoist, Payload, Temperature};
        let (low, high) = self.range;
        let varies = |zero: f64| 2.0 * (high - low) >= (high - zero).abs().max((low - zero).abs());
        matches!(self.covariate, Temperature | Payload | Hoist | Declared(_))
            && self.zero(reference).is_none_or(varies)
    }

    /// Creates a covariate from its values in every pose; `None` if it does not vary over the first
    /// `evidence_poses` poses, on which evidence is evaluated.
    pub fn new(covariate: Covariate, values: Vec<f64>, evidence_poses: usize) -> Option<Self> {
        let low = values[..evidence_poses].iter().copied().fold(f64::INFINITY, f64::min);
        let high = values[..evidence_poses].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if !(high > low && (high - low).is_finite()) {
            return None;
        }
        let mut sorted = values[..evidence_poses].to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        let scaled =
            values.iter().map(|value| ((value - low) / (high - low)).clamp(0.0, 1.0)).collect();
        let (levels, cosines) = (sorted.len(), OnceLock::new());
        Some(Self { covariate, values, scaled, range: (low, high), levels, cosines })
    }

    /// Returns the cosine functions of the scaled covariate at every pose: the basis of smooth
    /// functions, which the hypotheses at all sites share. Shape = (poses, functions).
    fn cosines(&self) -> &DMatrix<f64> {
        self.cosines.get_or_init(|| {
            let count = SMOOTH_LENGTHS.map(|length| weights(length).len()).into_iter().max();
            DMatrix::from_fn(self.scaled.len(), count.unwrap_or(0), |row, k| {
                cosine(k, self.scaled[row])
            })
        })
    }

    /// Returns cosines over the range and its margin as columns, each scaled to the standard
    /// deviation that a Gaussian process has along it. The process has squared-exponential
    /// covariance with the given length, at least the shortest of [`SMOOTH_LENGTHS`]
    /// [Solin & Särkkä 2020]; shape = (poses, functions).
    pub fn basis(&self, length: f64) -> DMatrix<f64> {
        let (weights, cosines) = (weights(length), self.cosines());
        DMatrix::from_fn(cosines.nrows(), weights.len(), |row, k| weights[k] * cosines[(row, k)])
    }
}

/// Replaces clusters of the values with indices `some` by their means. In a cluster, successive
/// values differ by at most `apart`. Clusters wider than [`MAX_GAPS_OF_NOISE`] times `apart` stay
/// unchanged.
pub(super) fn merge(values: &mut [f64], mut some: Vec<usize>, apart: f64) {
    some.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let rows: Vec<Vec<usize>> =
        some.chunk_by(|&a, &b| values[b] - values[a] <= apart).map(<[usize]>::to_vec).collect();
    for row in rows {
        let (first, last) = (values[row[0]], values[row[row.len() - 1]]);
        if last - first <= MAX_GAPS_OF_NOISE * apart {
            let mean = row.iter().map(|&k| values[k]).sum::<f64>() / row.len() as f64;
            for k in row {
                values[k] = mean;
            }
        }
    }
}

/// Returns true if the search has hypotheses that are functions of these two covariates together.
pub(super) fn are_combined(one: &Covariate, other: &Covariate) -> bool {
    use Covariate::{Approach, Command, Row, Temperature, Time};
    match (one, other) {
        (Approach(_), other) | (other, Approach(_)) => !matches!(other, Approach(_)),
        (Command(_), Command(_)) | (Temperature, Time | Row) | (Time | Row, Temperature) => true,
        _ => false,
    }
}

/// Returns basis functions of a Gaussian process with exponential covariance exp(−|Δ|/length),
/// shape = (poses, functions). It describes an instrument that drifts at random, and noise that is
/// correlated from reading to reading. `None` if the covariate has fewer different values
/// (`levels`) than twice the number of functions.
pub(super) fn rough_basis(scaled: &[f64], length: f64, levels: usize) -> Option<DMatrix<f64>> {
    // The mean square of the constant is 1, that of each cosine is ½.
    let of_constant = |k: usize| if k == 0 { 0.5 } else { 1.0 };
    let variance = |k: usize| {
        of_constant(k) / (1.0 + (PI * k as f64 * length / (1.0 + 2.0 * RANGE_MARGIN)).powi(2))
    };
    let count = (0..=levels / 2).find(|&k| variance(k) <= MIN_ROUGH_VARIANCE)?;
    Some(DMatrix::from_fn(scaled.len(), count, |row, k| {
        variance(k).sqrt() * cosine(k, scaled[row])
    }))
}

fn cosine(k: usize, u: f64) -> f64 {
    (PI * k as f64 * (u + RANGE_MARGIN) / (1.0 + 2.0 * RANGE_MARGIN)).cos()
}

/// Returns the prior standard deviation of each cosine of the basis, down to
/// [`MIN_BASIS_VARIANCE`].
fn weights(length: f64) -> Vec<f64> {
    let variance =
        |k: usize| (-0.5 * (PI * k as f64 * length / (1.0 + 2.0 * RANGE_MARGIN)).powi(2)).exp();
    let count = (0..usize::MAX).find(|&k| variance(k) <= MIN_BASIS_VARIANCE).unwrap_or(0);
    (0..count).map(|k| variance(k).sqrt()).collect()
}

/// Returns functions of a covariate `of` whose amplitude is proportional to another one, `size`,
/// less its `zero`: basis functions times that difference. If `zero` is `None`, the basis functions
/// alone are included, too. Shape = (poses, functions).
pub(super) fn scaled_functions(
    of: &SampledCovariate,
    size: &SampledCovariate,
    zero: Option<f64>,
    length: f64,
) -> DMatrix<f64> {
    let plain = of.basis(length);
    let (low, high) = size.range;
    let (from, kept) =
        (zero.unwrap_or(0.5 * (low + high)), if zero.is_some() { 0 } else { plain.ncols() });
    let size = |row: usize| (size.values[row].clamp(low, high) - from) / (high - low);
    DMatrix::from_fn(plain.nrows(), kept + plain.ncols(), |row, j| {
        if j < kept { plain[(row, j)] } else { plain[(row, j - kept)] * size(row) }
    })
}

/// Returns products of cosines, one factor for each covariate, scaled to their prior standard
/// deviations, shape = (poses, functions).
pub(super) fn products_of(covariates: &[&SampledCovariate], length: f64) -> DMatrix<f64> {
    let weights = weights(length);
    let mut indices: Vec<Vec<usize>> = vec![Vec::new()];
    for _ in covariates {
        let longer = |index: &Vec<usize>| {
            (0..weights.len()).map(|k| [index.as_slice(), &[k]].concat()).collect::<Vec<_>>()
        };
        indices = indices.iter().flat_map(longer).collect();
    }
    let weight = |index: &[usize]| index.iter().map(|&k| weights[k]).product::<f64>();
    indices.retain(|index| weight(index).powi(2) > MIN_BASIS_VARIANCE);
    let weights: Vec<f64> = indices.iter().map(|index| weight(index)).collect();
    let cosines: Vec<&DMatrix<f64>> = covariates.iter().map(|of| of.cosines()).collect();
    DMatrix::from_fn(covariates[0].scaled.len(), indices.len(), |row, j| {
        let factors = indices[j].iter().zip(&cosines);
        weights[j] * factors.map(|(&k, cosines)| cosines[(row, k)]).product::<f64>()
    })
}

/// Returns the product of every lever in `at` with every function of the pose, shape = (3 N, levers
/// · functions).
pub(super) fn expand(at: &[&DVector<f64>], functions: &DMatrix<f64>) -> DMatrix<f64> {
    let k = functions.ncols();
    let mut out = DMatrix::zeros(3 * functions.nrows(), at.len() * k);
    for (j, mut column) in out.column_iter_mut().enumerate() {
        let poses = column.as_mut_slice().as_chunks_mut::<3>().0.iter_mut();
        let levers = at[j / k].as_slice().as_chunks::<3>().0;
        for ((out, lever), value) in poses.zip(levers).zip(&functions.column(j % k)) {
            *out = lever.map(|lever| lever * value);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_wanders_forgets_within_its_length() {
        let scaled: Vec<f64> = (0..=200).map(|k| f64::from(k) / 200.0).collect();
        for (length, poses) in [(0.15, 30), (0.06, 12), (0.025, 5)] {
            let basis = rough_basis(&scaled, length, 200).unwrap();
            let covariance = |a: usize, b: usize| basis.row(a).dot(&basis.row(b));
            for first in [20, 60, 100] {
                // The covariance is near exp(−lengths). The truncated basis smooths it over part of
                // the first length.
                for (lengths, expected, within) in
                    [(1, 0.37, 0.16), (2, 0.14, 0.06), (3, 0.05, 0.06)]
                {
                    let correlation =
                        covariance(first, first + lengths * poses) / covariance(first, first);
                    assert!(
                        (correlation - expected).abs() < within,
                        "{length} {first} {lengths}: {correlation}"
                    );
                }
            }
        }
        assert!(rough_basis(&scaled, 0.025, 60).is_none(), "that would be the noise itself");
    }

    #[test]
    fn what_hardly_varies_from_its_zero_is_no_size_to_grow_with() {
        let covariate = |values: &[f64]| {
            SampledCovariate::new(Covariate::Temperature, values.to_vec(), values.len()).unwrap()
        };
        assert!(
            covariate(&[17.0, 20.0, 31.0]).may_scale_error(Some(20.0))
                && covariate(&[29.5, 30.5]).may_scale_error(None)
        );
        assert!(!covariate(&[29.5, 30.5]).may_scale_error(Some(20.0)));
        let grown =
            scaled_functions(&covariate(&[0.0, 0.5]), &covariate(&[20.0, 31.0]), Some(20.0), 0.5);
        assert!(
            grown.row(0).iter().all(|value| *value == 0.0)
                && grown.row(1).iter().any(|value| *value != 0.0),
            "{grown}"
        );
    }

    #[test]
    fn values_in_a_short_row_are_one_and_others_stay() {
        // The index of the last value is not among those to merge. A cluster of many values is not
        // merged either.
        let mut values: Vec<f64> = [3.0, 1.0, 1.2, 1.4, 2.0]
            .into_iter()
            .chain((0..20).map(|k| 5.0 + 0.2 * f64::from(k)))
            .collect();
        let long = values[5..].to_vec();
        values.push(1.1);
        let all = 0..values.len() - 1;
        merge(&mut values, all.collect(), 0.25);
        let expected: Vec<f64> =
            [3.0, 1.2, 1.2, 1.2, 2.0].into_iter().chain(long).chain([1.1]).collect();
        assert!(
            values.iter().zip(&expected).all(|(value, expected)| (value - expected).abs() < 1e-12),
            "{values:?}"
        );
    }
}
