//! Chord method: derivatives at one point reused at neighbouring points.

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::{Block, LeastSquares, Linearisation, Triangle};
use crate::numeric::kernel::sum_of_squares;
use crate::numeric::parallel;
use crate::numeric::{gram, inverse_factor};

/// Largest ‖ρ‖ / ‖J₀ δ‖ at which the derivatives J₀ of the base point are reused after a step δ,
/// where ρ is the change of the residuals that J₀ δ does not predict.
const MAX_LINEARISATION_ERROR: f64 = 0.01;
/// Ridge added to the diagonal of the scaled normal matrix S⁻¹R₀ᵀR₀S⁻¹, whose entries are 1, so
/// that its Cholesky factor exists.
const NORMAL_RIDGE: f64 = 1e-10;

/// Residuals and derivatives at a base point x₀, reused for linearisations at points nearby.
///
/// With J₀ = Q₀ R₀ and δ = x − x₀, r(x) = r₀ + J₀ δ + ρ. The problem linearised at x with J₀ is
/// [R₀ c], c = Q₀ᵀ r(x) = c₀ + R₀ δ + R₀ (R₀ᵀR₀)⁻¹ J₀ᵀ ρ. It neglects (J(x) − J₀)ᵀ r in the
/// gradient, a term of the order of ρ. Derivatives are therefore reused only where ‖ρ‖ is a small
/// part of ‖J₀ δ‖, or ‖ρ‖² is below the mean square ‖r‖² / N of one residual. No unknown may be
/// without effect at x₀, since it may have an effect elsewhere.
#[derive(Debug)]
pub(super) struct BasePoint {
    /// Identifier of the data set at which residuals and derivatives were computed; another one
    /// makes them invalid.
    pub data: u64,
    /// Unit by which the stored residuals were divided, such as 1 σ of a position \[m\].
    unit: f64,
    x: DVector<f64>,
    chunks: Vec<Chunk>,
    triangle: Triangle,
    /// Map from J₀ᵀ ρ to Q₀ᵀ ρ, formed at the first use. Contains `None` if an unknown has no
    /// effect or a number is not finite.
    projector: OnceLock<Option<Projector>>,
}

/// Consecutive items with their residuals and derivatives at the base point.
#[derive(Debug)]
pub(super) struct Chunk {
    pub items: Range<usize>,
    pub block: Block,
}

/// Linear map from J₀ᵀ ρ to Q₀ᵀ ρ = R₀ (R₀ᵀR₀)⁻¹ J₀ᵀ ρ.
#[derive(Debug)]
struct Projector {
    /// R₀ S⁻¹, where S = diag(`lengths`) holds the column norms of R₀.
    scaled: DMatrix<f64>,
    /// Projected residual c₀ = Q₀ᵀ r₀ at the base point, length n.
    constant: DVector<f64>,
    lengths: DVector<f64>,
    /// Inverse Cholesky factor L⁻¹ of the scaled normal matrix: L Lᵀ = S⁻¹R₀ᵀR₀S⁻¹ + ridge, shape =
    /// (n, n).
    root: DMatrix<f64>,
}

impl Projector {
    /// Forms the map from the factor at the base point, or returns `None` if an unknown has no
    /// effect or a number is not finite.
    fn new(triangle: &Triangle) -> Option<Self> {
        let Linearisation { triangle: mut scaled, projected: constant, .. } =
            triangle.clone().into_linearisation();
        let n = constant.len();
        let lengths = DVector::from_iterator(n, scaled.column_iter().map(|column| column.norm()));
        if !lengths.iter().all(|length| length.is_normal()) {
            return None;
        }
        scaled.column_iter_mut().zip(&lengths).for_each(|(mut column, length)| column /= *length);
        let mut normal = gram(&scaled);
        (0..n).for_each(|j| normal[(j, j)] += NORMAL_RIDGE);
        let root = inverse_factor(&normal)?;
        Some(Self { scaled, constant, lengths, root })
    }

    /// Returns c = c₀ + R₀ δ + R₀ (R₀ᵀR₀)⁻¹ J₀ᵀ ρ, where `gradient` is J₀ᵀ ρ.
    fn projected_residual(&self, step: &DVector<f64>, gradient: &DVector<f64>) -> DVector<f64> {
        let along = self.root.tr_mul(&(&self.root * gradient.component_div(&self.lengths)));
        &self.constant + &self.scaled * (step.component_mul(&self.lengths) + along)
    }
}

/// Linearisation error of one chunk.
struct ChunkError {
    /// Vector J₀ᵀ ρ: change of the gradient by the residual change ρ that the derivatives J₀ do not
    /// predict.
    gradient: DVector<f64>,
    /// Sums of squares over the chunk: of the residuals r(x), of their predicted change J₀ δ, and
    /// of the unpredicted change ρ.
    squares: [f64; 3],
}

impl BasePoint {
    /// Stores the chunks of all items, linearised at `x`, with their triangular factor. `data`
    /// identifies the data set; residuals were divided by `unit`.
    pub fn new(
        x: &DVector<f64>,
        (data, unit): (u64, f64),
        chunks: Vec<Chunk>,
        triangle: Triangle,
    ) -> Self {
        Self { data, unit, x: x.clone(), chunks, triangle, projector: OnceLock::new() }
    }

    /// Returns the triangular factor of all items at the base point.
    pub fn triangle(&self) -> Triangle {
        self.triangle.clone()
    }

    /// Returns the triangular factor at `x`, computed with the derivatives of the base point, for
    /// residuals divided by `unit`. Returns `None` if the linearisation error at `x` is too large.
    pub fn triangle_at(
        &self,
        problem: &impl LeastSquares,
        x: &DVector<f64>,
        unit: f64,
    ) -> Option<Triangle> {
        let (step, scale) = (x - &self.x, self.unit / unit);
        let n = step.len();
        let error = |Chunk { items, block }: &Chunk| {
            let mut residual = vec![0.0; block.rows()];
            problem.residuals(x, items.clone(), &mut residual);
            let square = sum_of_squares(&residual);
            let columns =
                DMatrixView::from_slice(&block.values[..n * block.rows()], block.rows(), n);
            let change = columns * &step;
            let predicted = block.column(n).iter().zip(&change).map(|(r0, change)| r0 + change);
            let error: Vec<f64> = residual
                .iter()
                .zip(predicted)
                .map(|(actual, predicted)| actual / scale - predicted)
                .collect();
            let error = DVector::from_vec(error);
            ChunkError {
                squares: [
                    square,
                    sum_of_squares(change.as_slice()),
                    sum_of_squares(error.as_slice()),
                ],
                gradient: columns.tr_mul(&error),
            }
        };
        let errors = parallel::map_items(&self.chunks, error);
        let mut gradient = DVector::zeros(n);
        let mut sums = [0.0; 3];
        for chunk in errors {
            gradient += chunk.gradient;
            sums.iter_mut().zip(chunk.squares).for_each(|(sum, square)| *sum += square);
        }
        let [squares, change, error] = sums;
        let rows: usize = self.chunks.iter().map(|chunk| chunk.block.rows()).sum();
        let tolerated = (MAX_LINEARISATION_ERROR * MAX_LINEARISATION_ERROR * change)
            .max(squares / (scale * scale * rows as f64));
        // If error and residual are both infinite, the comparison alone would accept the error.
        if !(error.is_finite() && error <= tolerated) {
            return None;
        }
        let constant = self.projector()?.projected_residual(&step, &gradient);
        Some(self.triangle().with_residual(&constant, squares / (scale * scale)).scaled(scale))
    }

    fn projector(&self) -> Option<&Projector> {
        if let Some(projector) = self.projector.get() {
            return projector.as_ref();
        }
        // The projector is formed before `get_or_init`: its products run on several threads, which
        // must not wait for the cell.
        let new = Projector::new(&self.triangle);
        self.projector.get_or_init(|| new).as_ref()
    }
}
