//! Linear least-squares steps from one factorisation: Gauss–Newton, damped, and limited in length.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use super::pivoted::{Pivoted, is_well_conditioned};
use super::spectrum::Spectrum;

/// Linear least-squares problem min ‖B q + c‖, factorised once on first use and solved for any
/// damping.
///
/// A column-pivoted QR of B with unit columns decides whether B has full rank: `|Rₙₙ| >
/// tolerance·|R₁₁|`. If so, all steps come from it. Otherwise they come from B = U Σ Vᵀ, where
/// singular values `σ ≤ tolerance·σ₁` are dropped (fewer if some columns are much shorter than the
/// longest). Combinations of unknowns in the dropped directions do not change.
#[derive(Debug, Clone)]
pub struct Factor {
    matrix: DMatrix<f64>,
    constant: DVector<f64>,
    tolerance: f64,
    pivoted: OnceLock<Option<Pivoted>>,
    well_conditioned: OnceLock<bool>,
    spectrum: Option<Spectrum>,
}

impl Factor {
    /// Prepares min ‖B q + c‖, where singular values up to `tolerance`·σ₁ count as zero.
    pub fn new(matrix: DMatrix<f64>, constant: DVector<f64>, tolerance: f64) -> Self {
        let (pivoted, well_conditioned) = (OnceLock::new(), OnceLock::new());
        Self { matrix, constant, tolerance, pivoted, well_conditioned, spectrum: None }
    }

    /// Returns the matrix B.
    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Returns the constant c.
    pub fn projected(&self) -> &DVector<f64> {
        &self.constant
    }

    /// Returns the fraction of σ₁ below which singular values count as zero.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Returns the product B q.
    pub fn image(&self, q: &DVector<f64>) -> DVector<f64> {
        &self.matrix * q
    }

    /// Returns Bᵀc, the gradient of ½‖B q + c‖² at q = 0.
    pub fn gradient(&self) -> DVector<f64> {
        self.matrix.tr_mul(&self.constant)
    }

    /// Returns the Gauss–Newton step, the shortest minimiser of ‖B q + c‖.
    pub fn gauss_newton(&mut self) -> DVector<f64> {
        match self.pivoted() {
            Some(pivoted) => pivoted.solution(),
            None => self.damped(0.0),
        }
    }

    /// Returns the minimiser of ‖B q + c‖² + λ‖q‖², the shortest one for λ = 0.
    ///
    /// q(λ) = −Σ σᵢ/(σᵢ² + λ) (uᵢᵀc) vᵢ, a vector of length n, with B = Σ σᵢ uᵢ vᵢᵀ of n columns
    /// [Golub & Van Loan 2013, §6.1.4]
    pub fn damped(&mut self, lambda: f64) -> DVector<f64> {
        let n = self.matrix.ncols();
        self.spectrum().solution(lambda, n)
    }

    /// Returns the change of the minimiser of ½‖B q + c‖² + ½λ‖q‖² when `gradient` is added to the
    /// gradient of this function. Returns `None` if B lacks rank.
    pub fn response(&self, gradient: &DVector<f64>, lambda: f64) -> Option<DVector<f64>> {
        self.pivoted()?.response(gradient, lambda)
    }

    /// Returns the minimiser of ‖B q + c‖ subject to ‖q‖ ≤ `radius`, and its damping λ. The radius
    /// is met to within 10 %.
    pub fn limited(&mut self, radius: f64) -> (DVector<f64>, f64) {
        if let Some(step) = self.pivoted().and_then(|pivoted| pivoted.limited(radius)) {
            return step;
        }
        let lambda = self.spectrum().secular_root(radius);
        (self.damped(lambda), lambda)
    }

    /// Returns true if B is an upper triangle so well conditioned that any subset of its columns
    /// can be factorised without pivoting.
    pub(super) fn is_well_conditioned(&self) -> bool {
        *self.well_conditioned.get_or_init(|| match self.pivoted.get() {
            Some(pivoted) => pivoted.as_ref().is_some_and(|pivoted| pivoted.is_unpivoted),
            None => is_well_conditioned(&self.matrix, self.tolerance),
        })
    }

    fn pivoted(&self) -> Option<&Pivoted> {
        self.pivoted
            .get_or_init(|| Pivoted::new(&self.matrix, &self.constant, self.tolerance))
            .as_ref()
    }

    fn spectrum(&mut self) -> &Spectrum {
        let cut =
            if self.pivoted().is_some() { 0.0 } else { spectral_cut(&self.matrix, self.tolerance) };
        let Self { matrix, constant, spectrum, .. } = self;
        spectrum.get_or_insert_with(|| Spectrum::new(matrix, constant, cut))
    }
}

/// Returns the fraction of σ₁ up to which singular values count as zero: `tolerance`, lowered (down
/// to rounding) so that short columns are kept.
fn spectral_cut(matrix: &DMatrix<f64>, tolerance: f64) -> f64 {
    let norms = || matrix.column_iter().map(|c| c.norm()).filter(|&norm| norm > 0.0);
    let spread = norms().fold(f64::INFINITY, f64::min) / norms().fold(0.0, f64::max);
    let rounding = 8.0 * matrix.ncols() as f64 * f64::EPSILON;
    (tolerance * spread.min(1.0)).max(rounding.min(tolerance))
}

#[cfg(test)]
mod tests {
    use super::super::settings::MAX_RADIUS_DEVIATION;
    use super::*;

    fn example(n: usize) -> (DMatrix<f64>, DVector<f64>) {
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            if i <= j { ((1 + 3 * i + 7 * j + i * j) as f64).sin() } else { 0.0 }
        });
        (matrix, DVector::from_fn(n, |i, _| (i as f64 + 0.5).cos()))
    }

    #[test]
    fn pivoted_and_spectral_solutions_agree() {
        let (matrix, constant) = example(6);
        let mut factor = Factor::new(matrix.clone(), constant.clone(), 1e-13);
        let step = factor.gauss_newton();
        assert!((&matrix * &step + &constant).norm() < 1e-9 * step.norm());
        assert!((factor.damped(0.0) - &step).norm() < 1e-9 * step.norm());
    }

    #[test]
    fn limited_steps_have_the_radius_and_satisfy_the_normal_equations() {
        let (matrix, constant) = example(7);
        let mut factor = Factor::new(matrix.clone(), constant.clone(), 1e-13);
        let full = factor.gauss_newton().norm();
        for fraction in [0.7, 0.1, 1e-3, 1e-8] {
            let (step, lambda) = factor.limited(fraction * full);
            assert!((step.norm() / (fraction * full) - 1.0).abs() <= MAX_RADIUS_DEVIATION + 1e-12);
            let normal = matrix.tr_mul(&(&matrix * &step + &constant)) + lambda * &step;
            assert!(normal.norm() <= 1e-10 * factor.gradient().norm());
        }
    }

    #[test]
    fn responses_are_differences_of_solutions() {
        let (matrix, constant) = example(6);
        let shift = DVector::from_fn(6, |i, _| 0.3 - i as f64);
        for (matrix, lambda) in
            [(matrix.clone(), 0.0), (matrix.clone(), 0.7), (matrix.transpose(), 0.2)]
        {
            let mut first = Factor::new(matrix.clone(), constant.clone(), 1e-13);
            let mut second = Factor::new(matrix.clone(), &constant + &shift, 1e-13);
            let expected = second.damped(lambda) - first.damped(lambda);
            let response = first.response(&matrix.tr_mul(&shift), lambda).unwrap();
            assert!((response - &expected).norm() < 1e-9 * expected.norm());
        }
    }

    #[test]
    fn undetermined_combinations_do_not_move() {
        let (mut matrix, constant) = example(5);
        let first = matrix.column(0).clone_owned();
        matrix.set_column(3, &first);
        matrix.column_mut(4).fill(0.0);
        let mut factor = Factor::new(matrix, constant.clone(), 1e-12);
        let step = factor.gauss_newton();
        assert!((step[0] - step[3]).abs() < 1e-12 * step.norm());
        assert!(step[4].abs() < 1e-14);
        let (short, lambda) = factor.limited(0.1 * step.norm());
        assert!((short.norm() / step.norm() - 0.1).abs() < 0.0101 && lambda > 0.0);
        let normal = factor.matrix().tr_mul(&(factor.image(&short) + &constant)) + lambda * &short;
        assert!(normal.norm() <= 1e-10 * factor.gradient().norm());
        assert_eq!(
            Factor::new(DMatrix::zeros(5, 5), constant, 1e-12).gauss_newton(),
            DVector::zeros(5)
        );
    }

    #[test]
    fn triangles_are_well_conditioned_whatever_the_units() {
        let well = |matrix: &DMatrix<f64>, tolerance| {
            let factor = Factor::new(matrix.clone(), DVector::zeros(3), tolerance);
            factor.is_well_conditioned()
        };
        let triangle = |last: f64| {
            DMatrix::from_row_slice(3, 3, &[1e6, 2.0, 1.0, 0.0, 3.0, -1.0, 0.0, 0.0, last])
        };
        assert!(well(&triangle(0.5), 1e-12));
        assert!(!well(&triangle(1e-10), 1e-12) && !well(&triangle(0.0), 1e-12));
        // Not if the tolerance asks for a rank, nor for another matrix.
        assert!(!well(&triangle(0.5), 1e-6) && !well(&triangle(0.5).transpose(), 1e-12));
    }
}
