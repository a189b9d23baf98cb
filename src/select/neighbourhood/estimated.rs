//! A linear fit as its optimum and the covariance of its unknowns: they get a prior or leave it
//! without a look at the data.

use nalgebra::{DMatrix, DVector};

/// Unknowns x that are estimated with the covariance C, and the sum of squares left.
#[derive(Debug, Clone)]
pub(crate) struct Estimated {
    covariance: DMatrix<f64>,
    optimum: DVector<f64>,
    squares: f64,
}

impl Estimated {
    /// From a root T of C = T Tᵀ.
    pub(super) fn new(root: &DMatrix<f64>, optimum: DVector<f64>, squares: f64) -> Self {
        Self { covariance: root * root.transpose(), optimum, squares }
    }

    /// The sum of squares.
    pub fn squares(&self) -> f64 {
        self.squares
    }

    /// Gives an unknown, whose x is 0 without any data, a prior of 1 σ.
    ///
    /// C ← C − c cᵀ / (σ² + cₓ), x ← x − c x / (σ² + cₓ), S ← S + x² / (σ² + cₓ) with its column c
    /// of C and its own entry cₓ.
    pub fn with_prior(&mut self, unknown: usize, sigma: f64) {
        let column = self.covariance.column(unknown).into_owned();
        let (value, inverse) = (self.optimum[unknown], (sigma * sigma + column[unknown]).recip());
        self.covariance.ger(-inverse, &column, &column, 1.0);
        self.optimum.axpy(-inverse * value, &column, 1.0);
        self.squares += value * value * inverse;
    }

    /// C_·x C_xx⁻¹ and xᵀ C_xx⁻¹ x of some unknowns x; `None` where the fit does not tell them from
    /// others.
    fn share(&self, unknowns: &[usize]) -> Option<(DMatrix<f64>, f64)> {
        let columns = self.covariance.select_columns(unknowns);
        let scale: Vec<f64> = unknowns.iter().map(|&j| self.covariance[(j, j)].sqrt()).collect();
        if !scale.iter().all(|own| own.is_normal()) {
            return None;
        }
        let k = unknowns.len();
        let own = DMatrix::from_fn(k, k, |i, j| columns[(unknowns[i], j)] / (scale[i] * scale[j]));
        let factor = own.cholesky()?;
        let x = DVector::from_fn(k, |i, _| self.optimum[unknowns[i]] / scale[i]);
        let mut inverse = factor.inverse();
        (0..k).for_each(|j| (0..k).for_each(|i| inverse[(i, j)] /= scale[i] * scale[j]));
        Some((columns * inverse, x.dot(&factor.solve(&x))))
    }

    /// By how much the sum of squares is larger without some unknowns; `None` where the fit does
    /// not tell them from others.
    pub fn loss_without(&self, unknowns: &[usize]) -> Option<f64> {
        self.share(unknowns).map(|(_, loss)| loss)
    }

    /// Takes some unknowns out of the fit; those that it does not tell from others stay.
    pub fn leave_out(&mut self, unknowns: &[usize]) {
        let Some((share, loss)) = self.share(unknowns) else { return };
        let rows = self.covariance.select_rows(unknowns);
        let x = self.optimum.select_rows(unknowns);
        self.covariance.gemm(-1.0, &share, &rows, 1.0);
        self.optimum.gemv(-1.0, &share, &x, 1.0);
        self.squares += loss;
        for &j in unknowns {
            self.covariance.row_mut(j).fill(0.0);
            self.covariance.column_mut(j).fill(0.0);
            self.optimum[j] = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::linear::{LinearNeighbourhood, Unknowns};
    use super::*;

    fn matrix(rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            (12.9898 * i as f64 + 78.233 * (j + 1) as f64).sin() * 43.7 % 1.0
        })
    }

    #[test]
    fn priors_and_leavings_are_those_of_fits_of_their_own() {
        let (columns, residual) = (matrix(30, 5), matrix(30, 1).column(0).into_owned());
        let unknowns = |priors: Vec<Option<f64>>, x: Vec<f64>| {
            let active = DMatrix::zeros(0, priors.len());
            Unknowns { x, priors, active }
        };
        let x = vec![0.1, -0.2, 0.3];
        let first = LinearNeighbourhood::new(
            &columns.columns(0, 3).into_owned(),
            &residual,
            &unknowns(vec![None, Some(0.5), None], x.clone()),
            0,
        );
        let mut found = first.with(&columns.columns(3, 2).into_owned()).estimated();
        found.with_prior(3, 0.02);
        found.with_prior(4, 0.3);
        let priors = vec![None, Some(0.5), None, Some(0.02), Some(0.3)];
        let whole = LinearNeighbourhood::new(
            &columns,
            &residual,
            &unknowns(priors, [x, vec![0.0; 2]].concat()),
            0,
        );
        assert!((found.squares() - whole.sums().squares).abs() < 1e-10);
        for own in [vec![3], vec![4, 2], vec![0, 1]] {
            let (one, other) =
                (found.loss_without(&own).unwrap(), whole.loss_without(&own).unwrap());
            assert!((one - other).abs() < 1e-9 * other, "{one} {other}");
        }
        let (without, lost) = (found.squares(), found.loss_without(&[3]).unwrap());
        found.leave_out(&[3]);
        assert!((found.squares() - without - lost).abs() < 1e-12);
        let rest = columns.select_columns(&[0, 1, 2, 4]);
        let rest = LinearNeighbourhood::new(
            &rest,
            &residual,
            &unknowns(vec![None, Some(0.5), None, Some(0.3)], vec![0.1, -0.2, 0.3, 0.0]),
            0,
        );
        assert!((found.squares() - rest.sums().squares).abs() < 1e-10);
        let (one, other) = (found.loss_without(&[4]).unwrap(), rest.loss_without(&[3]).unwrap());
        assert!((one - other).abs() < 1e-9 * other && found.loss_without(&[3]).is_none());
    }
}
