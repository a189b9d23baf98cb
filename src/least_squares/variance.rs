//! Restricted maximum likelihood (REML) of the noise variance in the presence of priors.

use nalgebra::{DMatrix, DVector};

use super::inverse::sum_of_inverse_row_squares;
use super::tridiagonal::eigenvalues_with_components;
use super::uncertainty::CONSTRAINT_WEIGHT;
use super::{Linearisation, Triangle};
use crate::numeric::{gram_of_lower, inverse_lower};

/// Range of ln s² that is searched, s² being relative to the assumed variance.
const LOG_VARIANCE_RANGE: (f64, f64) = (-60.0, 60.0);
/// Number of steps of the grid search over ln s².
const VARIANCE_GRID_STEPS: u32 = 480;
/// Largest ratio a² of prior variance to assumed data variance in a direction that informs on the
/// noise. Directions above it are projected out.
const MAX_PRIOR_RATIO: f64 = 0.1;
/// Number of golden sections around the best point of the grid; they locate ln s² to 1e-8.
const GOLDEN_SECTIONS: u32 = 40;
/// Golden ratio less one, (√5 − 1)/2.
const GOLDEN_SECTION_RATIO: f64 = 0.618_033_988_749_894_8;

/// Restricted likelihood of the data variance for given priors.
///
/// Linearised about a fit, the data relative to the prior means are y = A z + e with z ∼ N(0, I)
/// and e ∼ N(0, s² I). Unknowns without a prior are projected out; those with a prior are scaled by
/// it. With A = U diag(a) Vᵀ, c = Uᵀy and m rows outside the range of A,
///
/// −2 ln L(s²) = Σ (ln(s² + a²) + c²/(s² + a²)) + m ln s² + ‖y − U c‖²/s²          [Patterson &
/// Thompson 1971]
///
/// Directions with a² above 0.1 are projected out, too: the data determine them, and their
/// deviation from the prior is not noise. s² = 1 is the variance by which the data were whitened.
#[derive(Debug, Clone, PartialEq)]
pub struct VarianceLikelihood {
    /// For each direction with a prior: squared ratio a² of prior to noise deviation, and square c²
    /// of the data along it.
    directions: Vec<(f64, f64)>,
    /// Sum of squares ‖y − U c‖² of the data y that no unknown can explain (outside the range of
    /// A).
    residual_squares: f64,
    /// Number m of independent data rows that no unknown can explain (outside the range of A).
    free_rows: f64,
}

impl VarianceLikelihood {
    /// Builds the likelihood from the linearisation `data` at the unknowns `x`.
    ///
    /// `rows` is the number of data rows and `squares` their ‖r‖². `priors` holds 1 σ of each
    /// unknown's prior, `held` is true for unknowns that are not estimated. The rows of `closed`
    /// are combinations of unknowns that are fixed.
    pub fn new(
        data: &Linearisation,
        (rows, squares): (usize, f64),
        x: &DVector<f64>,
        priors: &[Option<f64>],
        held: &[bool],
        closed: &DMatrix<f64>,
    ) -> Self {
        let n = x.len();
        let select =
            |prior: bool| (0..n).filter(move |&j| !held[j] && priors[j].is_some() == prior);
        let (free, with_prior): (Vec<usize>, Vec<usize>) =
            (select(false).collect(), select(true).collect());
        let width = free.len() + with_prior.len();
        let mut moved = DVector::zeros(n);
        for &j in &with_prior {
            moved[j] = x[j];
        }
        let at_priors = &data.projected - &data.triangle * &moved;
        let height = n + closed.nrows();
        let mut stack = DMatrix::zeros(height.max(width + 1), width + 1);
        for (column, &j) in free.iter().chain(&with_prior).enumerate() {
            let scale = priors[j].unwrap_or(1.0);
            stack.view_mut((0, column), (n, 1)).copy_from(&(data.triangle.column(j) * scale));
            stack
                .view_mut((n, column), (closed.nrows(), 1))
                .copy_from(&(closed.column(j) * (CONSTRAINT_WEIGHT * scale)));
        }
        stack.view_mut((0, width), (n, 1)).copy_from(&at_priors);
        stack
            .view_mut((n, width), (closed.nrows(), 1))
            .copy_from(&(closed * moved * -CONSTRAINT_WEIGHT));
        let reduced = Triangle::factor(&stack);
        let (first, k) = (free.len(), with_prior.len());
        let prior_block = reduced.view((first, first), (k, k)).into_owned();
        let y = reduced.view((first, width), (k, 1)).column(0).into_owned();
        let residual_squares =
            (squares - data.projected.norm_squared()).max(0.0) + reduced[(width, width)].powi(2);
        let free_rows = (rows + closed.nrows()) as f64 - first as f64;
        // The norm of the inverse bounds every a² from below. If all directions are projected out,
        // the singular values are not needed.
        let inverse = sum_of_inverse_row_squares(&prior_block, (0..k).map(|j| (j, 1.0)));
        if inverse.is_some_and(|squares| squares * MAX_PRIOR_RATIO < 1.0) {
            let free_rows = free_rows - k as f64;
            return Self { directions: Vec::new(), residual_squares, free_rows };
        }
        let directions = noise_directions(&prior_block, &y);
        let free_rows = free_rows - k as f64;
        Self { directions, residual_squares, free_rows }
    }

    /// Returns −2 ln L(s²) at ln s² = `log`.
    fn deviance(&self, log: f64) -> f64 {
        let variance = log.exp();
        let term = |&(a, c): &(f64, f64)| (variance + a).ln() + c / (variance + a);
        self.directions.iter().map(term).sum::<f64>()
            + self.free_rows * log
            + self.residual_squares / variance
    }

    /// Returns the effective degrees of freedom of the estimate of s². Each row outside the range
    /// of A adds one. Each direction with a prior adds (1 / (1 + a²))², its share of the
    /// information on s² at s² = 1.
    pub fn freedom(&self) -> f64 {
        self.free_rows + self.directions.iter().map(|(a, _)| (1.0 + a).powi(-2)).sum::<f64>()
    }

    /// Returns the s² of the largest likelihood and the excess of its 2 ln L over that of s² = 1.
    pub fn maximum(&self) -> (f64, f64) {
        let step = (LOG_VARIANCE_RANGE.1 - LOG_VARIANCE_RANGE.0) / f64::from(VARIANCE_GRID_STEPS);
        let grid = |k: u32| LOG_VARIANCE_RANGE.0 + f64::from(k) * step;
        let best = (0..=VARIANCE_GRID_STEPS)
            .map(grid)
            .min_by(|a, b| self.deviance(*a).total_cmp(&self.deviance(*b)))
            .unwrap_or(0.0);
        let (mut low, mut high) = (best - step, best + step);
        for _ in 0..GOLDEN_SECTIONS {
            let (a, b) = (
                high - GOLDEN_SECTION_RATIO * (high - low),
                low + GOLDEN_SECTION_RATIO * (high - low),
            );
            if self.deviance(a) < self.deviance(b) { high = b } else { low = a }
        }
        let log = 0.5 * (low + high);
        (log.exp(), self.deviance(0.0) - self.deviance(log))
    }
}

/// Returns a² and c² of the directions of A with a² up to [`MAX_PRIOR_RATIO`], for y = A z + e and
/// c = Uᵀy. The result is empty if the eigenvalues do not converge.
///
/// They follow from the eigenvalues 1/(1 + a²) of (1 + A Aᵀ)⁻¹, which are exact to rounding where
/// a² is small. The triangular factor of Aᵀ stacked on the identity is that of 1 + A Aᵀ. Directions
/// with a = 0 are included; they contain noise alone.
fn noise_directions(a: &DMatrix<f64>, y: &DVector<f64>) -> Vec<(f64, f64)> {
    let k = a.ncols();
    let mut stack = DMatrix::zeros(2 * k, k);
    stack.rows_mut(0, k).tr_copy_from(a);
    stack.rows_mut(k, k).fill_with_identity();
    let inverse = inverse_lower(&Triangle::factor(&stack).transpose());
    let Some(spectrum) = eigenvalues_with_components(gram_of_lower(&inverse), y) else {
        return Vec::new();
    };
    // Rounding may make eigenvalues of the largest a² zero or negative.
    let is_counted = |value: f64| value * (1.0 + MAX_PRIOR_RATIO) >= 1.0;
    let counted = spectrum.into_iter().filter(|(value, _)| is_counted(*value));
    counted.map(|(value, c)| ((value.recip() - 1.0).max(0.0), c * c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::least_squares::Block;

    /// Returns entry `i` of a deterministic sequence with the spread of standard normal numbers.
    fn noise(i: usize) -> f64 {
        let part = |k: usize| ((i * 12 + k) as f64 * 12.9898).sin() * 43_758.545_3 % 1.0;
        (0..12).map(|k| part(k).abs()).sum::<f64>() - 6.0
    }

    fn likelihood(rows: usize, sigma: f64, x: [f64; 2]) -> VarianceLikelihood {
        // y = t x₀ + x₁; x₀ has a prior of 1 σ = 1.
        let mut block = Block::zeros(rows, 2);
        for i in 0..rows {
            let t = i as f64 / rows as f64 - 0.5;
            block.column_mut(0)[i] = t;
            block.column_mut(1)[i] = 1.0;
            block.column_mut(2)[i] = t * x[0] + x[1] + sigma * noise(i);
        }
        let squares = block.column(2).iter().map(|r| r * r).sum();
        let mut triangle = Triangle::new(2);
        triangle.absorb(&mut block);
        let closed = DMatrix::zeros(0, 2);
        let data = triangle.into_linearisation();
        VarianceLikelihood::new(
            &data,
            (rows, squares),
            &DVector::zeros(2),
            &[Some(1.0), None],
            &[false; 2],
            &closed,
        )
    }

    #[test]
    fn the_scatter_is_found_whatever_was_assumed() {
        for sigma in [0.01, 1.0, 30.0] {
            let maximum = likelihood(200, sigma, [1.5, 7.0]).maximum();
            assert!((maximum.0.sqrt() / sigma - 1.0).abs() < 0.15, "{sigma}: {maximum:?}");
            assert_eq!(maximum.1 > 10.0, (sigma - 1.0).abs() > 1e-9, "{sigma}: {maximum:?}");
        }
    }

    #[test]
    fn directions_that_the_data_determine_are_no_noise() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.7, 1.1).into_inner();
        let size = nalgebra::Vector3::new(1e9, 3e9, 1e-3);
        let a = turn * nalgebra::Matrix3::from_diagonal(&size) * turn.transpose();
        let y = a * nalgebra::Vector3::new(1.0, -1.0, 2.0);
        let a = DMatrix::from_column_slice(3, 3, a.as_slice());
        let counted = noise_directions(&a, &DVector::from_column_slice(y.as_slice()));
        assert!(matches!(counted[..], [(square, c)] if square < 1e-4 && c < 1.0), "{counted:?}");
    }

    #[test]
    fn unknowns_far_beyond_their_prior_are_no_noise() {
        let maximum = likelihood(200, 1.0, [30.0, 7.0]).maximum();
        assert!((maximum.0.sqrt() - 1.0).abs() < 0.3, "{maximum:?}");
    }

    #[test]
    fn the_maximum_is_that_of_the_formula() {
        // Without priors: s² = ‖y − U c‖² / m, −2 ln L = m ln s² + ‖y − U c‖² / s².
        let free = |squares: f64, rows: f64| VarianceLikelihood {
            directions: Vec::new(),
            residual_squares: squares,
            free_rows: rows,
        };
        for (squares, rows) in [(8.0, 2.0), (0.03, 5.0), (7.0, 7.0), (900.0, 4.0)] {
            let (variance, excess) = free(squares, rows).maximum();
            let expected: f64 = squares / rows;
            assert!((variance / expected - 1.0).abs() < 1e-6, "{variance} {expected}");
            let gain = squares - rows - rows * expected.ln();
            assert!((excess - gain).abs() < 1e-9 * (1.0 + gain), "{excess} {gain}");
            assert!((free(squares, rows).freedom() - rows).abs() < 1e-12);
        }
        // A direction with a² = 0.05 and c² = 3 alone: s² + a² = c².
        let one = VarianceLikelihood {
            directions: vec![(0.05, 3.0)],
            residual_squares: 0.0,
            free_rows: 0.0,
        };
        assert!((one.maximum().0 - 2.95).abs() < 1e-5, "{:?}", one.maximum());
        assert!((one.freedom() - 1.05_f64.powi(-2)).abs() < 1e-12);
    }

    #[test]
    fn directions_of_noise_have_their_squares() {
        // A = U diag(0.2, 0, 3) Vᵀ: the first two directions are counted, with c = Uᵀy.
        let turn = |a, b, c| nalgebra::Rotation3::from_euler_angles(a, b, c).into_inner();
        let (left, right) = (turn(0.3, -0.7, 1.1), turn(-0.2, 0.5, 0.9));
        let size = nalgebra::Vector3::new(0.2, 0.0, 3.0);
        let a = left * nalgebra::Matrix3::from_diagonal(&size) * right.transpose();
        let y = left * nalgebra::Vector3::new(2.0, -0.5, 7.0);
        let a = DMatrix::from_column_slice(3, 3, a.as_slice());
        let mut counted = noise_directions(&a, &DVector::from_column_slice(y.as_slice()));
        counted.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert_eq!(counted.len(), 2, "{counted:?}");
        for ((square, c), (expected, projection)) in
            counted.into_iter().zip([(0.0, 0.25), (0.04, 4.0)])
        {
            assert!((square - expected).abs() < 1e-12 && (c - projection).abs() < 1e-12);
        }
    }
}
