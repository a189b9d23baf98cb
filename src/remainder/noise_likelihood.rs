//! Marginal likelihood of a model with noise but without a remainder; the parameters are integrated
//! out.

use nalgebra::{DMatrix, DVector};

use super::likelihood::{NOISE_BOUNDS, NOISE_STARTS};
use super::prior::ParameterPrior;
use super::rows::{AXES, Rows};
use super::search::minimise;
use crate::numeric::{gram, lower_factor};

/// Step of ln σ and ln σ_c in the central differences of the likelihood.
const DIFFERENCE_STEP: f64 = 1e-4;
/// Maximum number of steps of the search for the largest likelihood.
const MAX_STEPS: usize = 60;

/// Sums over the rows from which the likelihood is computed at any σ and σ_c.
///
/// The noise of one configuration's rows has the covariance C = σ² D + σ_c² 1 1ᵀ along each axis. D
/// is diagonal, with the squared relative σ of the rows. Its inverse is C⁻¹ = σ⁻² (W − ρ w wᵀ),
/// with W = D⁻¹, w = W 1 and ρ = σ_c² / (σ² + σ_c² Σ w).
struct NoiseLikelihood {
    /// Product (J S½, y)ᵀ W (J S½, y), with S the prior covariance of the parameters, J their
    /// Jacobian, and y the residuals at their mean given prior and information rows.
    gram: DMatrix<f64>,
    /// For each configuration and axis, a row: the sum wᵀ (J S½, y) over the rows of measurements.
    sums: DMatrix<f64>,
    /// Sum Σ w for each row of `sums`.
    weights: Vec<f64>,
    /// Number of coordinates, and the sum of ln D over them.
    coordinates: f64,
    log_relative: f64,
}

impl NoiseLikelihood {
    fn new(rows: &Rows, prior: &ParameterPrior) -> Option<Self> {
        let (target, scaled) = prior.reduce(rows)?;
        let width = scaled.ncols();
        let mut columns = scaled.insert_column(width, 0.0);
        columns.set_column(width, &target);
        let weight = |row: usize| rows.relative_sigma[row].powi(-2);
        let groups = rows.configurations();
        let mut sums = DMatrix::zeros(AXES * groups.len(), width + 1);
        for (number, group) in groups.iter().enumerate() {
            for axis in 0..AXES {
                for &row in group {
                    let added = columns.row(AXES * row + axis) * weight(row);
                    let mut sum = sums.row_mut(AXES * number + axis);
                    sum += added;
                }
            }
        }
        let whole = |group: &Vec<usize>| group.iter().map(|&row| weight(row)).sum::<f64>();
        let weights = groups.iter().flat_map(|group| [whole(group); AXES]).collect();
        for (coordinate, mut row) in columns.row_iter_mut().enumerate() {
            row *= weight(coordinate / AXES).sqrt();
        }
        Some(Self {
            gram: gram(&columns),
            sums,
            weights,
            coordinates: (AXES * rows.len()) as f64,
            log_relative: AXES as f64
                * rows.relative_sigma.iter().map(|sigma| 2.0 * sigma.ln()).sum::<f64>(),
        })
    }

    /// Returns the negative logarithm of the likelihood at (ln σ, ln σ_c), or at (ln σ) if the rows
    /// of a configuration share no noise; `None` if it is not finite.
    fn value(&self, logarithms: &DVector<f64>) -> Option<f64> {
        let variance = (2.0 * logarithms[0]).exp();
        let shared = logarithms.get(1).map_or(0.0, |shared| (2.0 * shared).exp());
        let mut precision = self.gram.clone();
        let mut log_det = self.coordinates * variance.ln() + self.log_relative;
        if shared > 0.0 {
            let mut sums = self.sums.clone();
            for (mut row, weight) in sums.row_iter_mut().zip(&self.weights) {
                row *= (shared / (variance + shared * weight)).sqrt();
                log_det += (1.0 + shared * weight / variance).ln();
            }
            precision -= gram(&sums);
        }
        precision /= variance;
        let n = precision.nrows() - 1;
        let square = precision[(n, n)];
        let right = precision.view((0, n), (n, 1)).into_owned();
        let outer = precision.view((0, 0), (n, n)).into_owned();
        let lower = lower_factor(DMatrix::identity(n, n) + outer)?;
        log_det += 2.0 * lower.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let explained = lower.solve_lower_triangular(&right)?.norm_squared();
        Some(0.5 * (square - explained + log_det)).filter(|value| value.is_finite())
    }
}

/// Returns the largest logarithm of the marginal likelihood of `rows` over σ and σ_c, without a
/// remainder. `size` is the root mean square length of a residual \[m\]. `None` if the likelihood
/// is not finite at the start.
pub(super) fn evidence_of_noise(
    rows: &Rows,
    prior: &ParameterPrior,
    shares_noise: bool,
    size: f64,
) -> Option<f64> {
    let likelihood = NoiseLikelihood::new(rows, prior)?;
    let count = 1 + usize::from(shares_noise);
    let (low, high) = (size.ln() + NOISE_BOUNDS.0, size.ln() + NOISE_BOUNDS.1);
    let start = DVector::from_fn(count, |k, _| (NOISE_STARTS[k] * size).ln());
    let function = |at: &DVector<f64>| {
        let value = likelihood.value(at)?;
        let mut gradient = DVector::zeros(count);
        for k in 0..count {
            let beside = |step: f64| {
                let mut moved = at.clone();
                moved[k] += step;
                likelihood.value(&moved)
            };
            gradient[k] =
                (beside(DIFFERENCE_STEP)? - beside(-DIFFERENCE_STEP)?) / (2.0 * DIFFERENCE_STEP);
        }
        Some((value, gradient))
    };
    minimise(function, (start, None), &vec![(low, high); count], MAX_STEPS)
        .map(|least| -least.value)
}
