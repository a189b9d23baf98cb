//! Linear residual rows that are added to a least-squares problem.

use nalgebra::{DMatrix, DVector};

use super::Block;

/// Linear residual rows r = A x + b added to the data: priors and gauge conditions.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearRows {
    /// Matrix A of the linear residuals r = A x + b of the unknowns x, shape = (k, n).
    pub matrix: DMatrix<f64>,
    /// Constant b of the linear residuals r = A x + b, length k.
    pub constant: DVector<f64>,
}

/// Error of linear rows whose shape does not match the problem.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RowsError {
    /// The number of columns of the linear rows' matrix A differs from the number of unknowns.
    #[error(
        "adding linear rows: the matrix has {columns} columns, the problem {parameters} unknowns"
    )]
    Columns {
        /// Number of columns of the matrix A of the linear rows.
        columns: usize,
        /// Number of unknowns of the least-squares problem.
        parameters: usize,
    },
    /// Matrix A and constant b of the linear rows differ in their number of rows.
    #[error("adding linear rows: the matrix has {matrix} rows, the constant {constant}")]
    Rows {
        /// Number of rows of the matrix A of the linear rows.
        matrix: usize,
        /// Number of entries of the constant b of the linear rows.
        constant: usize,
    },
}

impl LinearRows {
    /// Returns the block [A  A x + b] of derivatives and residuals at x.
    pub(super) fn block(&self, x: &DVector<f64>) -> Block {
        let (k, n) = self.matrix.shape();
        let mut block = Block::zeros(k, n);
        block.values[..k * n].copy_from_slice(self.matrix.as_slice());
        block.values[k * n..].copy_from_slice((&self.matrix * x + &self.constant).as_slice());
        block
    }
}
