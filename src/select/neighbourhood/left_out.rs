//! Prediction of parts of the data from the other parts, for many trial priors, by normal equations
//! of each part.

use nalgebra::{DMatrix, DMatrixView, DVector, Matrix3};

use super::linear::LinearNeighbourhood;
use super::orthonormal::MIN_INDEPENDENT_LENGTH;
use crate::numeric::parallel;
use crate::numeric::{gram, inverse_factor, lower_factor, solve_positive};

/// Products JᵀJ, Jᵀr and rᵀr over some poses, with the number of their rows.
struct Squares {
    gram: DMatrix<f64>,
    product: DVector<f64>,
    residual: f64,
    rows: usize,
}

impl Squares {
    fn of(columns: &DMatrix<f64>, residual: &DVector<f64>, poses: &[usize]) -> Self {
        let rows: Vec<usize> = poses.iter().flat_map(|pose| 3 * pose..3 * pose + 3).collect();
        let (j, r) = (columns.select_rows(&rows), residual.select_rows(&rows));
        Self { gram: gram(&j), product: j.tr_mul(&r), residual: r.norm_squared(), rows: rows.len() }
    }
}

/// Products JᵀJ, Jᵀr and rᵀr over all poses of a fit, and over each part that is left out in turn.
pub(in crate::select) struct PartSquares {
    whole: Squares,
    parts: Vec<Squares>,
}

impl PartSquares {
    /// Creates the products from the Jacobian J = `columns`, shape = (3 N, n), and the residual r.
    /// Each of `parts` contains pose indices.
    pub fn new(columns: &DMatrix<f64>, residual: &DVector<f64>, parts: &[Vec<usize>]) -> Self {
        let every: Vec<usize> = (0..residual.len() / 3).collect();
        let parts = parallel::map_items(parts, |poses| Squares::of(columns, residual, poses));
        Self { whole: Squares::of(columns, residual, &every), parts }
    }

    /// Returns the values of the unknowns fitted to all poses, and their posterior variances for
    /// noise of variance 1; priors are as in [`Self::left_out`]. `None` if the normal matrix is not
    /// positive definite.
    pub fn posterior(&self, priors: &[(f64, Option<f64>)]) -> Option<(DVector<f64>, DVector<f64>)> {
        let (normal, pull) = self.normal_of_all(priors);
        let root = inverse_factor(&normal)?;
        let mut x = -root.tr_mul(&(&root * pull));
        for (j, prior) in priors.iter().enumerate() {
            x[j] += prior.0;
        }
        let variances = root.column_iter().map(|column| column.norm_squared());
        Some((x, DVector::from_iterator(root.ncols(), variances)))
    }

    /// Returns −2 ln p(r) of all poses for noise of variance φ, up to a constant; `None` if it is
    /// not finite. Priors are as in [`Self::left_out`], with 1 σ divided by √φ.
    ///
    /// With W = diag(1/σ²), G = JᵀJ + W, g = Jᵀr + W x₀ and x₀ the present values, it is ln det G −
    /// Σ ln (1/σ²) + (x₀ᵀW x₀ − gᵀG⁻¹g)/φ.
    pub fn evidence(&self, priors: &[(f64, Option<f64>)], variance: f64) -> Option<f64> {
        let (normal, mut along) = self.normal_of_all(priors);
        let lower = lower_factor(normal)?;
        if !lower.solve_lower_triangular_mut(&mut along) {
            return None;
        }
        let ln_determinant = 2.0 * lower.diagonal().map(f64::ln).sum();
        let widths: f64 = priors.iter().filter_map(|prior| Some(2.0 * prior.1?.ln())).sum();
        let pulls: f64 = priors.iter().filter_map(|&(x, sigma)| Some((x / sigma?).powi(2))).sum();
        let squares = (pulls - along.norm_squared()) / variance;
        Some(ln_determinant + widths + squares).filter(|value| value.is_finite())
    }

    fn normal_of_all(&self, priors: &[(f64, Option<f64>)]) -> (DMatrix<f64>, DVector<f64>) {
        self.normal(self.whole.gram.clone(), self.whole.product.clone(), priors)
    }

    /// Returns the normal equations of some poses, given JᵀJ and Jᵀr, with the priors added.
    ///
    /// `MIN_INDEPENDENT_LENGTH`² of each column's squared length is added to the diagonal, so that
    /// directions that no pose determines do not change.
    fn normal(
        &self,
        mut gram: DMatrix<f64>,
        mut product: DVector<f64>,
        priors: &[(f64, Option<f64>)],
    ) -> (DMatrix<f64>, DVector<f64>) {
        for j in 0..product.len() {
            gram[(j, j)] +=
                MIN_INDEPENDENT_LENGTH * MIN_INDEPENDENT_LENGTH * self.whole.gram[(j, j)]
                    + f64::MIN_POSITIVE;
        }
        for (j, (x, sigma)) in priors.iter().enumerate() {
            let weight = sigma.map_or(0.0, |sigma| sigma.powi(-2));
            gram[(j, j)] += weight;
            product[j] += weight * x;
        }
        (gram, product)
    }

    /// Returns Σ rows · ln(mean squared residual) over the parts, each predicted from the others;
    /// `None` if the others do not determine the fit. `priors` holds the present value of each of
    /// the first unknowns, and 1 σ of its prior about 0.
    pub fn left_out(&self, priors: &[(f64, Option<f64>)]) -> Option<f64> {
        let predicted = |part: &Squares| {
            let (gram, product) =
                (&self.whole.gram - &part.gram, &self.whole.product - &part.product);
            let (normal, pull) = self.normal(gram, product, priors);
            let step = -solve_positive(normal, pull)?;
            let squares =
                part.residual + 2.0 * part.product.dot(&step) + step.dot(&(&part.gram * &step));
            Some(part.rows as f64 * (squares / part.rows as f64).ln())
        };
        let terms: Option<Vec<f64>> =
            parallel::map_items(&self.parts, predicted).into_iter().collect();
        terms.map(|terms| terms.iter().sum()).filter(|sum: &f64| sum.is_finite())
    }
}

/// Fit to all poses, with the diagonal blocks of its hat matrix H = Q Qᵀ, shape = (3, 3), one for
/// each pose. Some of the poses are then taken out of it.
pub(in crate::select) struct HatBlocks {
    fit: LinearNeighbourhood,
    blocks: Vec<Matrix3<f64>>,
}

impl HatBlocks {
    /// Creates the blocks of a fit with the orthonormal basis Q.
    pub fn new(fit: LinearNeighbourhood) -> Self {
        Self { blocks: blocks_of_squares(fit.fitted()), fit }
    }

    /// Returns the blocks of H and the residual of the fit in which the poses `aside` have 1 − w
    /// times their weight. If that fit does not exist because of rounding, they stay in it.
    ///
    /// With the rows Q_S of these poses, H = Q G⁻¹ Qᵀ with G = 1 − w Q_SᵀQ_S, and r changes by
    /// w Q G⁻¹ Q_Sᵀr_S. For few poses, with 1/w − Q_S Q_Sᵀ = L Lᵀ and T = Q (L⁻¹Q_S)ᵀ, H = Q Qᵀ + T
    /// Tᵀ, and r changes by T L⁻¹ r_S.
    pub fn without(&self, aside: &[usize], w: f64) -> (Vec<Matrix3<f64>>, DVector<f64>) {
        let rows: Vec<usize> = aside.iter().flat_map(|pose| 3 * pose..3 * pose + 3).collect();
        let residual = self.fit.residual().rows(0, self.fit.rows());
        let (removed, r) = (self.fit.fitted().select_rows(&rows), residual.select_rows(&rows));
        let (n, few) = (removed.ncols(), rows.len() < removed.ncols());
        let inner = if few {
            DMatrix::identity(rows.len(), rows.len()) / w - &removed * removed.transpose()
        } else {
            DMatrix::identity(n, n) - gram(&removed) * w
        };
        let Some(inverse) = inverse_factor(&inner) else {
            return (self.blocks.clone(), residual.into_owned());
        };
        let (within, step) = if few {
            (&inverse * &removed, &inverse * r)
        } else {
            (inverse.clone(), inverse * removed.tr_mul(&r) * w)
        };
        let along = self.fit.fitted() * within.transpose();
        let mut blocks = blocks_of_squares(along.as_view());
        if few {
            blocks.iter_mut().zip(&self.blocks).for_each(|(block, all)| *block += all);
        }
        (blocks, residual + along * step)
    }
}

/// Returns the diagonal blocks of A Aᵀ, shape = (3, 3), one for each pose.
fn blocks_of_squares(a: DMatrixView<f64>) -> Vec<Matrix3<f64>> {
    let mut blocks = vec![Matrix3::zeros(); a.nrows() / 3];
    for column in a.column_iter() {
        for (pose, block) in blocks.iter_mut().enumerate() {
            let entries = column.fixed_rows::<3>(3 * pose);
            *block += entries * entries.transpose();
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::super::Unknowns;
    use super::*;

    #[test]
    fn poses_are_taken_out_of_a_fit_as_if_they_had_no_weight() {
        let columns = DMatrix::from_fn(60, 4, |i, j| (1.7 * i as f64 + 2.3 * j as f64).sin());
        let residual = DVector::from_fn(60, |i, _| (0.9 * i as f64).cos());
        let unknowns = Unknowns {
            x: vec![0.0; 4],
            priors: vec![None, Some(0.5), None, None],
            active: DMatrix::zeros(0, 4),
        };
        let fit = LinearNeighbourhood::new(&columns, &residual, &unknowns, 0);
        let all = HatBlocks::new(fit);
        for aside in [vec![], vec![7], vec![2, 3, 11, 19]] {
            let (mut left, mut r) = (columns.clone(), residual.clone());
            for &pose in &aside {
                left.rows_mut(3 * pose, 3).scale_mut(1e-4);
                r.rows_mut(3 * pose, 3).scale_mut(1e-4);
            }
            let without = LinearNeighbourhood::new(&left, &r, &unknowns, 0);
            let (blocks, residuals) = all.without(&aside, 1.0 - 1e-8);
            for (pose, block) in blocks_of_squares(without.fitted()).iter().enumerate() {
                let scale = if aside.contains(&pose) { 1e4 } else { 1.0 };
                assert!((block * scale * scale - blocks[pose]).amax() < 1e-6);
                let expected = without.residual().rows(3 * pose, 3) * scale;
                assert!((expected - residuals.rows(3 * pose, 3)).amax() < 1e-9, "{pose}");
            }
        }
    }

    #[test]
    fn evidence_is_the_density_of_the_residual() {
        let columns = DMatrix::from_fn(42, 3, |i, j| (1.7 * i as f64 + 2.3 * j as f64).sin());
        let residual = DVector::from_fn(42, |i, _| (0.9 * i as f64).cos());
        let present = [0.3, -0.2, 0.1];
        // −2 ln p(r) of r₀ = r − J x₀ ~ N(0, 1 + J σ² Jᵀ).
        let density = |sigma: f64| {
            let at_zero = &residual - &columns * DVector::from_column_slice(&present);
            let covariance =
                DMatrix::identity(42, 42) + &columns * columns.transpose() * (sigma * sigma);
            let factor = covariance.cholesky().unwrap();
            let ln_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
            at_zero.dot(&factor.solve(&at_zero)) + ln_determinant
        };
        let squares = PartSquares::new(&columns, &residual, &[]);
        let evidence =
            |sigma: f64| squares.evidence(&present.map(|x| (x, Some(sigma))), 1.0).unwrap();
        let expected = density(0.5) - density(2.0);
        assert!((evidence(0.5) - evidence(2.0) - expected).abs() < 1e-6);
    }
}
