//! Nonlinear least squares over many small items, independent of robots.
//!
//! A problem is a sum over items (poses, data points) of whitened residuals r(x). Solvers never see
//! the m × n Jacobian: the rows are reduced, block by block, to the triangular factor of its QR
//! decomposition.

mod chord;
mod curvature;
mod derivative;
mod identifiability;
mod inverse;
mod linear_rows;
mod linearisation_cache;
mod loss;
mod objective;
mod singular;
pub mod solver;
mod sparse;
mod triangle;
mod tridiagonal;
mod uncertainty;
mod variance;
mod weak;
mod whole;

use std::ops::Range;

use curvature::{QuadraticModel, curvature_by_differences};
use nalgebra::{DMatrix, DVector};

pub(crate) use identifiability::UnidentifiableSpace;
pub use identifiability::{Identifiability, UnidentifiableCombination};
pub(crate) use uncertainty::Uncertainty;
pub(crate) use variance::VarianceLikelihood;
pub(crate) use weak::{StabilisedObjective, WEAK_THRESHOLD, Weak};
pub(crate) use whole::jacobian_and_residual;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    derivative::check_jacobian,
    linear_rows::{LinearRows, RowsError},
    linearisation_cache::LinearisationCache,
    loss::Loss,
    objective::{CHUNK_ITEMS, Fit},
    triangle::Triangle,
    whole::{jacobian, residual_vector},
};

/// Smallest number of unknowns at which forming and reducing derivatives takes nearly all the time
/// of a fit.
pub(crate) const MANY_UNKNOWNS: usize = 100;

/// Least-squares problem given by the residuals of many small items and their derivatives.
#[doc(hidden)]
pub trait LeastSquares: Sync {
    /// Returns the number of unknowns n.
    fn parameters(&self) -> usize;

    /// Returns the number of items (poses).
    fn items(&self) -> usize;

    /// Returns the number of residuals per item (3 for a position).
    fn rows_per_item(&self) -> usize;

    /// Writes the whitened residuals of `items`, item after item. A value that is not finite marks
    /// x as outside the domain.
    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]);

    /// Writes the whitened residuals of `items` and their derivatives ∂r/∂x.
    ///
    /// `block` arrives filled with zeros and has exactly the rows of `items`.
    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block);
}

/// Block of rows [∂r/∂x  r], stored column after column.
#[doc(hidden)]
#[derive(Debug, Clone)]
pub struct Block {
    rows: usize,
    parameters: usize,
    values: Vec<f64>,
}

impl Block {
    /// Creates a block of zeros with `rows` rows for `parameters` unknowns.
    pub fn zeros(rows: usize, parameters: usize) -> Self {
        Self { rows, parameters, values: vec![0.0; rows * (parameters + 1)] }
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the number of unknowns n.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Sets every value to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Changes the number of rows and sets every value to zero; keeps the allocated memory.
    pub fn reshape(&mut self, rows: usize) {
        self.rows = rows;
        self.values.clear();
        self.values.resize(rows * (self.parameters + 1), 0.0);
    }

    /// Returns the derivative of every row with respect to unknown `j`; `j = n` is the residual.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.values[j * self.rows..(j + 1) * self.rows]
    }

    /// Returns column `j` of the block for writing; `j = n` is the residual.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.values[j * self.rows..(j + 1) * self.rows]
    }

    /// Returns all columns one after another, the residual last.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }
}

/// Function ½‖r(x)‖² that solvers minimise, given by its value and its triangular linearisation.
pub trait Objective {
    /// Returns the number of unknowns n.
    fn parameters(&self) -> usize;

    /// Returns ½‖r(x)‖² (½Σρ with a robust loss), or infinity outside the domain.
    fn cost(&self, x: &DVector<f64>) -> f64;

    /// Returns the linearised problem min ‖J p + r‖ at x, reduced by an orthogonal transformation.
    fn linearise(&self, x: &DVector<f64>) -> Linearisation;

    /// Returns S = ∂(Jᵀr)/∂x − JᵀJ at x, the part of the Hessian that Gauss–Newton neglects.
    ///
    /// The default implementation differences the gradient, at points for which `within` returns
    /// true. Returns `None` if a derivative is not finite.
    fn curvature(
        &self,
        x: &DVector<f64>,
        within: &dyn Fn(&DVector<f64>) -> bool,
    ) -> Option<DMatrix<f64>> {
        curvature_by_differences(|x| slopes(self.linearise(x)), x, within)
    }

    /// Returns the plausible size (1 σ of its prior) of each unknown, in its unit; `None` if it has
    /// none.
    fn plausible_sizes(&self) -> Vec<Option<f64>> {
        vec![None; self.parameters()]
    }

    /// Returns Jᵀ r″, where r″ is the second derivative of r along the step p from x.
    ///
    /// Steps use it for geodesic acceleration [Transtrum & Sethna 2012]. Returns `None` if it is
    /// not available or not finite.
    fn acceleration_gradient(&self, x: &DVector<f64>, step: &DVector<f64>) -> Option<DVector<f64>> {
        let _ = (x, step);
        None
    }
}

impl<O: Objective + ?Sized> Objective for &O {
    fn parameters(&self) -> usize {
        (**self).parameters()
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        (**self).cost(x)
    }

    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        (**self).linearise(x)
    }

    fn curvature(
        &self,
        x: &DVector<f64>,
        within: &dyn Fn(&DVector<f64>) -> bool,
    ) -> Option<DMatrix<f64>> {
        (**self).curvature(x, within)
    }

    fn plausible_sizes(&self) -> Vec<Option<f64>> {
        (**self).plausible_sizes()
    }

    fn acceleration_gradient(&self, x: &DVector<f64>, step: &DVector<f64>) -> Option<DVector<f64>> {
        (**self).acceleration_gradient(x, step)
    }
}

/// Linearised problem at one point: J = Q R, so that ‖J p + r‖² = ‖R p + Qᵀr‖² + constant. A robust
/// loss weights the rows first.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// Cost at the point of linearisation: ½‖r‖², or ½ Σ ρ(‖rᵢ‖²) with a robust loss ρ.
    pub cost: f64,
    /// Triangular factor R of the Jacobian J = Q R, shape = (n, n).
    pub triangle: DMatrix<f64>,
    /// First n entries of Qᵀr, the residual r projected on the columns of the Jacobian J = Q R.
    pub projected: DVector<f64>,
}

/// Returns the gradient Jᵀr and the Gauss–Newton matrix JᵀJ of a linearised problem.
fn slopes(Linearisation { cost, triangle, projected }: Linearisation) -> QuadraticModel {
    QuadraticModel {
        cost,
        gradient: triangle.tr_mul(&projected),
        normal: triangle.tr_mul(&triangle),
    }
}
