//! Derivatives taken once for several points: the chord method.

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DMatrixView, DVector};
use rayon::prelude::*;

use super::kernel::sum_of_squares;
use super::{Block, LeastSquares, Linearisation, Triangle};
use crate::numeric::{gram, inverse_factor};

/// Part of what derivatives foresee up to which what they miss is little.
const MISSED: f64 = 0.01;
/// Part of a column's length² below which what of it is its own is taken for nothing.
const UNSEEN: f64 = 1e-10;

/// Residuals and derivatives at a point, which serve at others.
///
/// About x₀ with J₀ = Q₀ R₀: r(x) = r₀ + J₀ δ + ρ, δ = x − x₀. By J₀ the linearised problem at x is
/// [R₀ c], c = Q₀ᵀ r(x) = c₀ + R₀ δ + R₀ (R₀ᵀR₀)⁻¹ J₀ᵀ ρ; it leaves (J(x) − J₀)ᵀ r out of the
/// gradient, which is of the order of ρ. So derivatives serve where ‖ρ‖ is a small part of ‖J₀ δ‖,
/// or ‖ρ‖² no more than the mean ‖r‖² / N of one number, and no unknown was without effect at x₀:
/// such a one may have one elsewhere.
#[derive(Debug)]
pub(super) struct Base {
    /// Which data.
    pub data: u64,
    /// Unit of the residuals.
    unit: f64,
    x: DVector<f64>,
    chunks: Vec<Chunk>,
    triangle: Triangle,
    /// Made when first derivatives are asked to serve elsewhere.
    within: OnceLock<Option<Within>>,
}

/// Some items with their residuals and derivatives.
#[derive(Debug)]
pub(super) struct Chunk {
    pub items: Range<usize>,
    pub block: Block,
}

/// What takes J₀ᵀ ρ to Q₀ᵀ ρ.
#[derive(Debug)]
struct Within {
    /// R₀ S⁻¹ and c₀, S the lengths of the columns.
    scaled: DMatrix<f64>,
    constant: DVector<f64>,
    lengths: DVector<f64>,
    /// L⁻¹ with L Lᵀ = S⁻¹R₀ᵀR₀S⁻¹, a little added to the diagonal.
    root: DMatrix<f64>,
}

impl Within {
    /// `None` where an unknown has no effect, or numbers are not finite.
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
        (0..n).for_each(|j| normal[(j, j)] += UNSEEN);
        let root = inverse_factor(&normal)?;
        Some(Self { scaled, constant, lengths, root })
    }

    /// c₀ + R₀ δ + R₀ (R₀ᵀR₀)⁻¹ J₀ᵀ ρ.
    fn constant(&self, step: &DVector<f64>, gradient: &DVector<f64>) -> DVector<f64> {
        let along = self.root.tr_mul(&(&self.root * gradient.component_div(&self.lengths)));
        &self.constant + &self.scaled * (step.component_mul(&self.lengths) + along)
    }
}

/// Of some items: J₀ᵀ ρ and the squares of r(x), J₀ δ and ρ.
struct Missed {
    gradient: DVector<f64>,
    squares: [f64; 3],
}

impl Base {
    /// Of all items, linearised at `x`, and their factor.
    pub fn new(
        x: &DVector<f64>,
        (data, unit): (u64, f64),
        chunks: Vec<Chunk>,
        triangle: Triangle,
    ) -> Self {
        Self { data, unit, x: x.clone(), chunks, triangle, within: OnceLock::new() }
    }

    /// The factor where it was taken.
    pub fn triangle(&self) -> Triangle {
        self.triangle.clone()
    }

    /// The factor at `x` for residuals in this `unit`; `None` where derivatives do not serve there.
    pub fn at(&self, problem: &impl LeastSquares, x: &DVector<f64>, unit: f64) -> Option<Triangle> {
        let (step, larger) = (x - &self.x, self.unit / unit);
        let n = step.len();
        let missed = |Chunk { items, block }: &Chunk| {
            let mut residual = vec![0.0; block.rows()];
            problem.residuals(x, items.clone(), &mut residual);
            let square = sum_of_squares(&residual);
            let columns =
                DMatrixView::from_slice(&block.values[..n * block.rows()], block.rows(), n);
            let way = columns * &step;
            let own = block.column(n).iter().zip(&way).map(|(start, way)| start + way);
            let rest: Vec<f64> = residual
                .iter()
                .zip(own)
                .map(|(there, foreseen)| there / larger - foreseen)
                .collect();
            let rest = DVector::from_vec(rest);
            Missed {
                squares: [square, sum_of_squares(way.as_slice()), sum_of_squares(rest.as_slice())],
                gradient: columns.tr_mul(&rest),
            }
        };
        let all: Vec<Missed> = self.chunks.par_iter().map(missed).collect();
        let mut gradient = DVector::zeros(n);
        let mut sums = [0.0; 3];
        for own in all {
            gradient += own.gradient;
            sums.iter_mut().zip(own.squares).for_each(|(sum, square)| *sum += square);
        }
        let [squares, way, rest] = sums;
        let rows: usize = self.chunks.iter().map(|chunk| chunk.block.rows()).sum();
        let least = (MISSED * MISSED * way).max(squares / (larger * larger * rows as f64));
        // An infinite residual is no more than an infinite one.
        if !(rest.is_finite() && rest <= least) {
            return None;
        }
        let constant = self.within()?.constant(&step, &gradient);
        Some(self.triangle().with_residual(&constant, squares / (larger * larger)).times(larger))
    }

    fn within(&self) -> Option<&Within> {
        if let Some(known) = self.within.get() {
            return known.as_ref();
        }
        // Before the cell waits for it: it is made on several threads.
        let new = Within::new(&self.triangle);
        self.within.get_or_init(|| new).as_ref()
    }
}
