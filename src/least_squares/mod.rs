//! Nonlinear least squares over many small items; knows no arms.
//!
//! A problem is a sum over items (poses, data points) of whitened residuals r(x). Solvers never see
//! the m × n Jacobian: it is reduced, block by block, to the triangular factor of its QR
//! decomposition.

mod chord;
mod curvature;
mod derivative;
mod identifiability;
mod inverse;
pub(crate) mod kernel;
mod loss;
mod memory;
mod objective;
mod singular;
pub mod solver;
mod triangle;
mod uncertainty;
mod variance;
mod weak;
mod whole;

use std::ops::Range;

use curvature::{Slopes, by_differences};
use nalgebra::{DMatrix, DVector};

pub use derivative::{ColumnCheck, JacobianCheck, check_jacobian};
pub(crate) use identifiability::Blind;
pub use identifiability::{Identifiability, UnidentifiableCombination};
pub use loss::Loss;
pub use memory::Memory;
pub use objective::{CHUNK_ITEMS, Fit, LinearRows, RowsError};
pub use triangle::Triangle;
pub use uncertainty::Uncertainty;
pub use variance::VarianceLikelihood;
pub use weak::{Steadied, WEAK_BELOW, Weak};
pub use whole::{jacobian, jacobian_and_residual, residual_vector};

/// Unknowns from which on taking derivatives and reducing them is nearly all of the work of a fit.
pub(crate) const MANY_UNKNOWNS: usize = 100;

/// Residuals of many small items, and their derivatives.
pub trait LeastSquares: Sync {
    /// Number of unknowns n.
    fn parameters(&self) -> usize;

    /// Number of items (poses).
    fn items(&self) -> usize;

    /// Residuals per item (3 for a position).
    fn rows_per_item(&self) -> usize;

    /// Writes the whitened residuals of `items`, item after item; a value that is not finite marks
    /// x as out of the domain.
    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]);

    /// Writes the whitened residuals of `items` and their derivatives ∂r/∂x.
    ///
    /// `block` comes filled with zeros and has exactly the rows of `items`.
    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block);
}

/// A block of rows [∂r/∂x  r], stored column after column.
#[derive(Debug, Clone)]
pub struct Block {
    rows: usize,
    parameters: usize,
    values: Vec<f64>,
}

impl Block {
    /// A block of zeros with `rows` rows for `parameters` unknowns.
    pub fn zeros(rows: usize, parameters: usize) -> Self {
        Self { rows, parameters, values: vec![0.0; rows * (parameters + 1)] }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of unknowns n.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Sets every value to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Changes the number of rows and sets every value to zero; keeps the memory.
    pub fn reshape(&mut self, rows: usize) {
        self.rows = rows;
        self.values.clear();
        self.values.resize(rows * (self.parameters + 1), 0.0);
    }

    /// Derivative of every row with respect to unknown `j`; `j = n` is the residual itself.
    pub fn column(&self, j: usize) -> &[f64] {
        &self.values[j * self.rows..(j + 1) * self.rows]
    }

    /// As [`Block::column`], to write.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.values[j * self.rows..(j + 1) * self.rows]
    }

    /// All columns one after another, the residual last.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }
}

/// What solvers minimise: ½‖r(x)‖², given by its value and its triangular linearisation.
pub trait Objective {
    /// Number of unknowns n.
    fn parameters(&self) -> usize;

    /// ½‖r(x)‖² (½Σρ with a robust loss), or infinity outside the domain.
    fn cost(&self, x: &DVector<f64>) -> f64;

    /// The linearised problem min ‖J p + r‖ at x, reduced by an orthogonal transformation.
    fn linearise(&self, x: &DVector<f64>) -> Linearisation;

    /// S = ∂(Jᵀr)/∂x − JᵀJ at x, what the linearised problem leaves out of the second derivatives
    /// of the cost.
    ///
    /// By differences of the gradient unless an objective knows better; evaluated only where
    /// `within` allows. Nothing where derivatives are not finite.
    fn curvature(
        &self,
        x: &DVector<f64>,
        within: &dyn Fn(&DVector<f64>) -> bool,
    ) -> Option<DMatrix<f64>> {
        by_differences(|x| slopes(self.linearise(x)), x, within)
    }

    /// How far each unknown may plausibly go, where that is known.
    fn reach(&self) -> Vec<Option<f64>> {
        vec![None; self.parameters()]
    }

    /// Jᵀ r″, r″ the second derivative of r along a step p from x; nothing where it is not known or
    /// not finite.
    fn bend(&self, x: &DVector<f64>, step: &DVector<f64>) -> Option<DVector<f64>> {
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

    fn reach(&self) -> Vec<Option<f64>> {
        (**self).reach()
    }

    fn bend(&self, x: &DVector<f64>, step: &DVector<f64>) -> Option<DVector<f64>> {
        (**self).bend(x, step)
    }
}

/// J = Q R at one point: ‖J p + r‖² = ‖R p + Qᵀr‖² + rest; rows are weighted where there is a
/// robust loss.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// ½‖r‖², or ½Σρ.
    pub cost: f64,
    /// R, upper triangular, n × n.
    pub triangle: DMatrix<f64>,
    /// The first n entries of Qᵀr.
    pub projected: DVector<f64>,
}

impl Linearisation {
    /// The same with further rows W p = 0 for the step p, whose cost is left out.
    #[must_use]
    pub fn with_rows(self, rows: &DMatrix<f64>) -> Self {
        let n = self.projected.len();
        let mut block = Block::zeros(n + rows.nrows(), n);
        for j in 0..n {
            let (own, more) = block.column_mut(j).split_at_mut(n);
            own.copy_from_slice(self.triangle.column(j).as_slice());
            more.copy_from_slice(rows.column(j).as_slice());
        }
        block.column_mut(n)[..n].copy_from_slice(self.projected.as_slice());
        let mut triangle = Triangle::new(n);
        triangle.absorb(&mut block);
        Self { cost: self.cost, ..triangle.into_linearisation() }
    }
}

/// What a linearised problem says of slopes.
fn slopes(Linearisation { cost, triangle, projected }: Linearisation) -> Slopes {
    Slopes { cost, gradient: triangle.tr_mul(&projected), normal: triangle.tr_mul(&triangle) }
}
