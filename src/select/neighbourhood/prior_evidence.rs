//! Evidence for the widths of priors: normal equations of a fit, made once for many priors.

use nalgebra::{DMatrix, DVector};

use super::orthonormal::RANK;
use crate::numeric::{gram, inverse_factor};

/// Products JᵀJ and Jᵀr of a fit whose unknowns have values x₀.
pub(in crate::select) struct PriorEvidence {
    gram: DMatrix<f64>,
    product: DVector<f64>,
}

/// Posterior of the unknowns under some priors.
pub(in crate::select) struct Posterior {
    /// Values of the unknowns.
    pub x: DVector<f64>,
    /// Their variances.
    pub variances: DVector<f64>,
    /// Log density ln p(r) of the residual, up to a constant.
    pub ln_evidence: f64,
}

impl PriorEvidence {
    /// Creates the products from columns, shape = (3 N, n), and the residual, both whitened.
    pub fn new(columns: &DMatrix<f64>, residual: &DVector<f64>) -> Self {
        Self { gram: gram(columns), product: columns.tr_mul(residual) }
    }

    /// Returns the posterior under priors, each the present value x₀ and 1 σ about 0, `None` where
    /// the unknowns are not determined.
    ///
    /// With W = diag(1/σ²), G = JᵀJ + W and g = Jᵀr + W x₀: x = x₀ − G⁻¹g, and
    /// −2 ln p(r) = ln det G − Σ ln (1/σ²) + x₀ᵀW x₀ − gᵀG⁻¹g + const. Directions that no pose sees
    /// stay where they are: the diagonal of G gains (RANK)² of each column's length².
    pub fn posterior(&self, priors: &[(f64, Option<f64>)]) -> Option<Posterior> {
        let (mut normal, mut pull) = (self.gram.clone(), self.product.clone());
        let mut constant = 0.0;
        for (j, &(x, sigma)) in priors.iter().enumerate() {
            let weight = sigma.map_or(0.0, |sigma| sigma.powi(-2));
            normal[(j, j)] += weight + RANK * RANK * self.gram[(j, j)] + f64::MIN_POSITIVE;
            pull[j] += weight * x;
            constant += weight * x * x + sigma.map_or(0.0, |sigma| 2.0 * sigma.ln());
        }
        let root = inverse_factor(&normal)?;
        let along = &root * pull;
        let ln_determinant = -2.0 * root.diagonal().map(f64::ln).sum();
        let mut x = -root.tr_mul(&along);
        x.iter_mut().zip(priors).for_each(|(x, prior)| *x += prior.0);
        let variances = root.column_iter().map(|column| column.norm_squared());
        let ln_evidence = -0.5 * (ln_determinant + constant - along.norm_squared());
        ln_evidence.is_finite().then(|| Posterior {
            x,
            variances: DVector::from_iterator(root.ncols(), variances),
            ln_evidence,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evidence_is_the_density_of_the_residual() {
        let columns = DMatrix::from_fn(40, 3, |i, j| (1.7 * i as f64 + 2.3 * j as f64).sin());
        let residual = DVector::from_fn(40, |i, _| (0.9 * i as f64).cos());
        let present = [0.3, -0.2, 0.1];
        // ln p(r | σ) of r₀ = r − J x₀ ~ N(0, 1 + J σ² Jᵀ), for two widths.
        let density = |sigma: f64| {
            let at_zero = &residual - &columns * DVector::from_column_slice(&present);
            let covariance =
                DMatrix::identity(40, 40) + &columns * columns.transpose() * (sigma * sigma);
            let factor = covariance.cholesky().unwrap();
            let squares = at_zero.dot(&factor.solve(&at_zero));
            -0.5 * (squares + 2.0 * factor.l().diagonal().map(f64::ln).sum())
        };
        let evidence = PriorEvidence::new(&columns, &residual);
        let ln_evidence = |sigma: f64| {
            let priors = present.map(|x| (x, Some(sigma)));
            evidence.posterior(&priors).unwrap().ln_evidence
        };
        let expected = density(0.5) - density(2.0);
        assert!((ln_evidence(0.5) - ln_evidence(2.0) - expected).abs() < 1e-6);
    }
}
