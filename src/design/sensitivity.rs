//! Sensitivity of the measurements of each pose to each parameter.

use nalgebra::{DMatrix, DMatrixView, DVector};

use crate::least_squares::{Block, LeastSquares as _, Triangle};
use crate::model::{Model, Pose, PoseResiduals};
use crate::numeric::parallel;

/// Number of poses that are differentiated together.
const BLOCK_POSES: usize = 64;

/// Derivatives of the measured coordinates of poses, divided by their σ, with respect to every free
/// parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivity {
    /// Matrix Jᵀ, shape = (parameters, coordinates · poses) [1 / unit of x]; not finite for a pose
    /// without equilibrium.
    pub rows: DMatrix<f64>,
    /// Number of measured coordinates of a pose: three, six with its orientation, or twelve for
    /// compressed views of cameras.
    pub coordinates: usize,
}

impl Sensitivity {
    /// Computes the sensitivity of `poses` at the full parameter vector `at`; it does not depend on
    /// measured values.
    pub fn of(model: &Model, poses: &[Pose], at: &DVector<f64>) -> Self {
        let n = model.parameters.len();
        let residuals = PoseResiduals::new(model, poses.to_vec(), (0..n).collect(), at.clone());
        let coordinates = residuals.rows_per_item();
        let blocks = parallel::map(poses.len().div_ceil(BLOCK_POSES), |block| {
            let start = block * BLOCK_POSES;
            let items = start..(start + BLOCK_POSES).min(poses.len());
            let mut block = Block::zeros(coordinates * items.len(), n);
            residuals.linearise(at, items, &mut block);
            (start, block)
        });
        let mut rows = DMatrix::zeros(n, coordinates * poses.len());
        for (start, block) in blocks {
            for j in 0..n {
                for (k, value) in block.column(j).iter().enumerate() {
                    rows[(j, coordinates * start + k)] = *value;
                }
            }
        }
        Self { rows, coordinates }
    }

    /// Returns the number of poses.
    pub fn len(&self) -> usize {
        self.rows.ncols() / self.coordinates
    }

    /// Returns true if there is no pose.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns Jᵢᵀ of one pose, shape = (parameters, coordinates).
    pub fn pose(&self, pose: usize) -> DMatrixView<'_, f64> {
        self.rows.columns(self.coordinates * pose, self.coordinates)
    }

    /// Returns true if the arm has an equilibrium in a pose.
    pub fn is_finite(&self, pose: usize) -> bool {
        self.pose(pose).iter().all(|value| value.is_finite())
    }

    /// Returns the sensitivity of the poses with these indices, in this order.
    #[must_use]
    pub fn select(&self, poses: &[usize]) -> Self {
        let of_pose = self.coordinates;
        let mut rows = DMatrix::zeros(self.rows.nrows(), of_pose * poses.len());
        for (k, &pose) in poses.iter().enumerate() {
            rows.columns_mut(of_pose * k, of_pose).copy_from(&self.pose(pose));
        }
        Self { rows, coordinates: of_pose }
    }

    /// Returns the sensitivity of these poses followed by that of the poses of `other`.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let (columns, n) = (self.rows.ncols(), self.rows.nrows());
        let mut rows = DMatrix::zeros(n, columns + other.rows.ncols());
        rows.columns_mut(0, columns).copy_from(&self.rows);
        rows.columns_mut(columns, other.rows.ncols()).copy_from(&other.rows);
        Self { rows, coordinates: self.coordinates }
    }

    /// Returns the information Σ JᵢᵀJᵢ, shape = (parameters, parameters).
    pub fn information(&self) -> DMatrix<f64> {
        &self.rows * self.rows.transpose()
    }

    /// Returns the triangular factor R of J, shape = (parameters, parameters), with RᵀR = Σ JᵢᵀJᵢ.
    pub fn triangle(&self) -> DMatrix<f64> {
        let n = self.rows.nrows();
        let mut block = Block::zeros(self.rows.ncols(), n);
        for j in 0..n {
            block
                .column_mut(j)
                .iter_mut()
                .zip(self.rows.row(j).iter())
                .for_each(|(out, value)| *out = *value);
        }
        let mut triangle = Triangle::new(n);
        triangle.absorb(&mut block);
        triangle.into_linearisation().triangle
    }
}
