//! Directions in which no unknown of a stage moves any pose, such as z of a planar arm.

use nalgebra::{DVector, Matrix3, SymmetricEigen, Vector3};

use super::stage::Stage;
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares as _};
use crate::model::Pose;

/// Largest sum of squared derivatives of positions along a direction, relative to that along the
/// strongest direction, that is only rounding: no unknown moves a pose along it.
const MAX_UNMOVED_RATIO: f64 = 1e-15;
/// Number of poses that are examined first. On most arms unknowns move them in every direction, so
/// that the other poses need not be examined.
const FIRST_EXAMINED_POSES: usize = 32;

/// Orthonormal directions of the measuring frame in which no unknown moves any pose. Residuals
/// along them do not depend on the unknowns, and are left out of χ² and of the degrees of freedom.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unmoved(Vec<Vector3<f64>>);

impl Unmoved {
    /// Returns the number of directions, 0…2.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Finds the directions in which none of several unknowns moves any pose. Each of `columns`
    /// holds the derivatives with respect to one unknown, with `per_pose` rows for each pose, of
    /// which the first three are the position. If no unknown moves anything, there are no
    /// directions.
    pub fn from_columns<'a>(columns: impl Iterator<Item = &'a [f64]>, per_pose: usize) -> Self {
        let square = |column: &[f64]| -> Matrix3<f64> {
            let slopes =
                column.chunks_exact(per_pose).map(|row| Vector3::new(row[0], row[1], row[2]));
            slopes.map(|slope| slope * slope.transpose()).sum()
        };
        Self(unmoved_by(columns.map(square)))
    }

    /// Returns the sum of squares of the components of whitened `residuals` along the directions.
    /// Each pose has `per_pose` residuals, of which the first three are a position.
    pub fn squares(&self, residuals: &[f64], per_pose: usize) -> f64 {
        let along = |residual: Vector3<f64>| -> f64 {
            self.0.iter().map(|direction| direction.dot(&residual).powi(2)).sum()
        };
        let poses = residuals.chunks_exact(per_pose).filter(|_| self.count() > 0);
        poses.map(|r| along(Vector3::new(r[0], r[1], r[2]))).sum()
    }

    /// Returns a position residual without its components along the directions.
    pub fn moved_part(&self, residual: Vector3<f64>) -> Vector3<f64> {
        self.0.iter().fold(residual, |left, direction| left - direction * direction.dot(&residual))
    }
}

impl Stage<'_> {
    /// Finds the directions in which no unknown moves any pose at the full parameter vector `at`.
    /// There are none if some rows measure anything but positions, or if the stage has no unknowns.
    pub fn unmoved(&self, at: &DVector<f64>) -> Unmoved {
        let is_position =
            |pose: &Pose| pose.observation.is_position() && pose.orientation.is_none();
        if self.unknowns.is_empty() || !self.poses.iter().all(is_position) {
            return Unmoved::default();
        }
        let first = self.unmoved_in(at, FIRST_EXAMINED_POSES);
        if first.is_empty() || self.poses.len() <= FIRST_EXAMINED_POSES {
            return Unmoved(first);
        }
        Unmoved(self.unmoved_in(at, self.poses.len()))
    }

    /// Returns unit vectors along which no unknown moves any of the first `count` poses, measuring
    /// frame.
    fn unmoved_in(&self, at: &DVector<f64>, count: usize) -> Vec<Vector3<f64>> {
        let residuals = self.residuals(at);
        let (x, n) = (residuals.unknowns_in(at), self.unknowns.len());
        let per_pose = self.coordinates();
        let count = count.min(self.poses.len());
        let mut squares: Vec<Matrix3<f64>> = vec![Matrix3::zeros(); n];
        for start in (0..count).step_by(CHUNK_ITEMS) {
            let items = start..(start + CHUNK_ITEMS).min(count);
            let mut block = Block::zeros(per_pose * items.len(), n);
            residuals.linearise(&x, items, &mut block);
            for (j, square) in squares.iter_mut().enumerate() {
                for row in block.column(j).chunks_exact(per_pose) {
                    let slope = Vector3::new(row[0], row[1], row[2]);
                    *square += slope * slope.transpose();
                }
            }
        }
        unmoved_by(squares.into_iter())
    }
}

/// Returns unit vectors along which no unknown moves any pose. `squares` holds, for each unknown,
/// the sum over poses of d dᵀ with the derivative d of the position with respect to the unknown.
fn unmoved_by(squares: impl Iterator<Item = Matrix3<f64>>) -> Vec<Vector3<f64>> {
    // Each matrix is divided by its trace, because effects of angles and lengths are not
    // comparable.
    let scaled = squares.map(|square| match square.trace() {
        trace if trace > 0.0 => square / trace,
        _ => Matrix3::zeros(),
    });
    let eigen = SymmetricEigen::new(scaled.sum::<Matrix3<f64>>());
    let largest = eigen.eigenvalues.max();
    let is_unmoved = |k: &usize| eigen.eigenvalues[*k] <= MAX_UNMOVED_RATIO * largest;
    if !(largest.is_finite() && largest > 0.0) {
        return Vec::new();
    }
    (0..3).filter(is_unmoved).map(|k| eigen.eigenvectors.column(k).into_owned()).collect()
}
