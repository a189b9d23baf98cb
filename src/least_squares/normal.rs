//! The normal equations of a fit with priors and active constraints: covariance, step, rank, degrees of freedom.

use nalgebra::{DMatrix, DVector};

/// Eigenvalues of a normal matrix of unit diagonal below this count as zero: nothing sees their direction.
///
/// Forming and decomposing such a matrix of n unknowns leaves errors of about n ε, 1e-13 for hundreds of them; what is below
/// is rounding. It is the square of a singular value: directions of which less than 1e-6 of a column's length is left are
/// not told from blind ones here. Where they have to be, [`Uncertainty`](super::Uncertainty) works on the factor itself.
pub const UNSEEN: f64 = 1e-12;

/// An eigenvalue of AᵀA, the rows of A of length one, below which all of them leave its direction open.
const OPEN: f64 = 1e-10;

/// N dx = −g with N = JᵀJ + Λ, on the directions that data or priors see and active constraints leave open.
///
/// J, shape = (coordinates, n), are the whitened derivatives of the residual with respect to the unknowns, Λ = diag(1/σ²) is of
/// their priors, and A dx = 0 for the rows A of active constraints. With D = diag(N)^½ and Z an orthonormal basis of the null
/// space of A D⁻¹, the covariance is C = D⁻¹ Z (Zᵀ D⁻¹ N D⁻¹ Z)⁺ Zᵀ D⁻¹.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
    covariance: DMatrix<f64>,
    priors: Vec<Option<f64>>,
    rank: usize,
}

impl NormalEquations {
    /// Of columns J, shape = (coordinates, n), 1 σ of each unknown's prior, shape = (n), and the rows of the active
    /// constraints, shape = (constraints, n).
    pub fn new(columns: &DMatrix<f64>, priors: Vec<Option<f64>>, constraints: &DMatrix<f64>) -> Self {
        Self::from_information(columns.transpose() * columns, priors, constraints)
    }

    /// Of JᵀJ, shape = (n, n), the priors left out. Unknowns whose column is not finite count as unseen.
    pub fn from_information(mut normal: DMatrix<f64>, priors: Vec<Option<f64>>, constraints: &DMatrix<f64>) -> Self {
        let n = normal.ncols();
        for j in (0..n).filter(|&j| !normal[(j, j)].is_finite()).collect::<Vec<_>>() {
            normal.column_mut(j).fill(0.0);
            normal.row_mut(j).fill(0.0);
        }
        for (j, sigma) in priors.iter().enumerate() {
            if let Some(sigma) = sigma {
                normal[(j, j)] += sigma.powi(-2);
            }
        }
        if n == 0 {
            return Self { covariance: normal, priors, rank: 0 };
        }
        let scale: Vec<f64> = normal.diagonal().iter().map(|d| if *d > 0.0 { d.sqrt() } else { 1.0 }).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] / (scale[i] * scale[j]));
        let (scaled, rank) = match open_directions(constraints, &scale) {
            Some(open) if open.is_empty() => (DMatrix::zeros(n, n), 0),
            Some(open) => {
                let (inverse, rank) = pseudo_inverse(open.transpose() * scaled * &open);
                (&open * inverse * open.transpose(), rank)
            }
            None => pseudo_inverse(scaled),
        };
        let covariance = DMatrix::from_fn(n, n, |i, j| scaled[(i, j)] / (scale[i] * scale[j]));
        Self { covariance, priors, rank }
    }

    /// C, shape = (n, n): the covariance of the unknowns for whitened residuals of unit scatter; 0 in directions that are not
    /// seen or not open.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// Rows and columns of C of some unknowns, shape = (k, k).
    pub fn block(&self, unknowns: &[usize]) -> DMatrix<f64> {
        self.covariance.select_rows(unknowns).select_columns(unknowns)
    }

    /// 1 σ of the prior of each unknown.
    pub fn priors(&self) -> &[Option<f64>] {
        &self.priors
    }

    /// dx = −C g: from where the derivatives were taken to the optimum of what they describe.
    ///
    /// g = Jᵀr + Λ x is the gradient there, with x the deviations of the unknowns from the means of their priors.
    pub fn step(&self, gradient: &DVector<f64>) -> DVector<f64> {
        -(&self.covariance * gradient)
    }

    /// Directions that are seen and open.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// tr(C JᵀJ) = rank − Σ C_jj / σ_j²: how many unknowns the data decide, the priors' share taken off.
    ///
    /// The data's degrees of freedom are the number of coordinates less this.
    pub fn effective_parameters(&self) -> f64 {
        let share =
            |(j, sigma): (usize, &Option<f64>)| sigma.map_or(0.0, |sigma| self.covariance[(j, j)] / (sigma * sigma));
        self.rank as f64 - self.priors.iter().enumerate().map(share).sum::<f64>()
    }
}

/// Z with A D⁻¹ Z = 0 and ZᵀZ = I for the rows A of active constraints, shape = (constraints, n), and the scale D of the
/// unknowns, shape = (n); `None` where nothing holds them.
pub fn open_directions(constraints: &DMatrix<f64>, scale: &[f64]) -> Option<DMatrix<f64>> {
    let mut rows = DMatrix::from_fn(constraints.nrows(), constraints.ncols(), |i, j| constraints[(i, j)] / scale[j]);
    if rows.iter().all(|coefficient| *coefficient == 0.0) {
        return None;
    }
    for mut row in rows.row_iter_mut() {
        let length = row.norm();
        if length > 0.0 {
            row /= length;
        }
    }
    let eigen = (rows.transpose() * &rows).symmetric_eigen();
    let left: Vec<usize> = (0..constraints.ncols()).filter(|&k| eigen.eigenvalues[k] < OPEN).collect();
    Some(eigen.eigenvectors.select_columns(&left))
}

/// The inverse of a normal matrix of unit diagonal, or of a part of one, 0 in directions that nothing sees; and its rank.
fn pseudo_inverse(matrix: DMatrix<f64>) -> (DMatrix<f64>, usize) {
    let eigen = matrix.symmetric_eigen();
    let inverted = eigen.eigenvalues.map(|value| if value > UNSEEN { value.recip() } else { 0.0 });
    let rank = inverted.iter().filter(|value| **value > 0.0).count();
    (&eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose(), rank)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four columns: the third is the sum of the first two, the last is zero.
    fn columns() -> DMatrix<f64> {
        let one = DMatrix::from_fn(9, 2, |i, j| ((i + 3) as f64 * (j + 1) as f64).sin() * 1000_f64.powf(j as f64));
        DMatrix::from_fn(9, 4, |i, j| match j {
            0 | 1 => one[(i, j)],
            2 => one[(i, 0)] + one[(i, 1)],
            _ => 0.0,
        })
    }

    #[test]
    fn without_priors_the_inverse_is_that_of_the_seen_directions() {
        let none = DMatrix::zeros(0, 4);
        let found = NormalEquations::new(&columns(), vec![None; 4], &none);
        assert_eq!(found.rank(), 2);
        assert!((found.effective_parameters() - 2.0).abs() < 1e-12);
        let two = NormalEquations::new(&columns().columns(0, 2).into_owned(), vec![None; 2], &DMatrix::zeros(0, 2));
        let exact = (columns().columns(0, 2).transpose() * columns().columns(0, 2)).try_inverse().unwrap();
        assert!((two.covariance() - &exact).component_div(&exact).amax() < 1e-9);
        // What is predicted does not depend on how the blind combination is shared out.
        let residual = DVector::from_fn(9, |i, _| (i as f64).cos());
        let predicted = |found: &NormalEquations, n: usize| {
            let columns = columns().columns(0, n).into_owned();
            &columns * found.step(&columns.tr_mul(&residual))
        };
        assert!((predicted(&found, 4) - predicted(&two, 2)).amax() < 1e-9);
    }

    #[test]
    fn priors_see_what_the_data_do_not_and_take_their_share() {
        let priors = vec![Some(0.5), None, Some(2.0), Some(3.0)];
        let found = NormalEquations::new(&columns(), priors, &DMatrix::zeros(0, 4));
        assert_eq!(found.rank(), 4);
        assert!((found.covariance()[(3, 3)] - 9.0).abs() < 1e-9, "the prior alone");
        let data = columns().transpose() * columns();
        let trace = (found.covariance() * data).trace();
        assert!((found.effective_parameters() - trace).abs() < 1e-6, "{} and {trace}", found.effective_parameters());
        assert_eq!(found.block(&[3, 0]).shape(), (2, 2));
        assert!((found.block(&[3, 0])[(0, 1)] - found.covariance()[(3, 0)]).abs() < 1e-15);
    }

    #[test]
    fn steps_keep_active_constraints() {
        let constraints = DMatrix::from_row_slice(1, 4, &[1.0, -200.0, 0.0, 0.0]);
        let found = NormalEquations::new(&columns(), vec![Some(1.0); 4], &constraints);
        assert_eq!(found.rank(), 3);
        let step = found.step(&DVector::from_fn(4, |j, _| 1.0 + j as f64));
        assert!((constraints * &step).amax() < 1e-9 * step.amax());
        // All held: nothing moves.
        let held = NormalEquations::new(&columns(), vec![Some(1.0); 4], &DMatrix::identity(4, 4));
        assert!(held.rank() == 0 && held.covariance().amax() < 1e-300);
    }

    #[test]
    fn a_column_that_is_no_number_says_nothing() {
        let mut columns = columns();
        columns[(2, 0)] = f64::NAN;
        let found = NormalEquations::new(&columns, vec![None; 4], &DMatrix::zeros(0, 4));
        assert_eq!(found.rank(), 2);
        assert!(found.covariance().iter().all(|value| value.is_finite()));
    }

    #[test]
    fn what_is_open_keeps_every_constraint() {
        // The third row follows from the others, the last says nothing.
        let closed = DMatrix::from_row_slice(4, 4, &[1., -1., 0., 0., 0., 0., 2., 0., 1., -1., 2., 0., 0., 0., 0., 0.]);
        let scale = [10.0, 1.0, 1e-3, 5.0];
        let left = open_directions(&closed, &scale).unwrap_or_default();
        assert_eq!(left.shape(), (4, 2));
        assert!((left.transpose() * &left - DMatrix::identity(2, 2)).amax() < 1e-14);
        let moved = DMatrix::from_fn(4, 2, |j, k| left[(j, k)] / scale[j]);
        assert!((closed * moved).amax() < 1e-12);
        assert_eq!(open_directions(&DMatrix::zeros(1, 3), &[1.0; 3]), None);
    }
}
