//! Derivatives taken once for several points: the chord method.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DMatrixView, DVector};
use rayon::prelude::*;

use super::kernel::sum_of_squares;
use super::{Block, Fit, LeastSquares, Linearisation, Triangle};
use crate::numeric::{gram, inverse_factor};

/// Part of what derivatives foresee up to which what they miss is little.
const MISSED: f64 = 0.01;
/// Part of a column's length² below which what of it is its own is taken for nothing.
const UNSEEN: f64 = 1e-10;

/// Residuals and derivatives at a point, which serve at others.
///
/// About x₀ with J₀ = Q₀ R₀: r(x) = r₀ + J₀ δ + ρ, δ = x − x₀. By J₀ the linearised problem at x is
/// [R₀ c], c = Q₀ᵀ r(x) = c₀ + R₀ δ + R₀ (R₀ᵀR₀)⁻¹ J₀ᵀ ρ; it leaves (J(x) − J₀)ᵀ r out of the gradient. Derivatives serve where ‖ρ‖ is a small part of
/// ‖J₀ δ‖, or where ‖ρ‖² is no more than the mean square of one number: that changes N ln ‖r‖² by no more than 1.
#[derive(Debug)]
pub(super) struct Base {
    /// Which data.
    pub data: u64,
    /// Unit of the residuals.
    unit: f64,
    x: DVector<f64>,
    blocks: Vec<Block>,
    triangle: Triangle,
    /// Made when first derivatives are asked to serve elsewhere.
    within: OnceLock<Within>,
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
    fn new(triangle: &Triangle) -> Self {
        let Linearisation { triangle: mut scaled, projected: constant, .. } = triangle.clone().into_linearisation();
        let n = constant.len();
        let lengths = scaled.column_iter().map(|column| if column.amax() > 0.0 { column.norm() } else { 1.0 });
        let lengths = DVector::from_iterator(n, lengths);
        scaled.column_iter_mut().zip(&lengths).for_each(|(mut column, length)| column /= *length);
        let mut normal = gram(&scaled);
        (0..n).for_each(|j| normal[(j, j)] += UNSEEN);
        let root = inverse_factor(&normal).unwrap_or_else(|| DMatrix::zeros(n, n));
        Self { scaled, constant, lengths, root }
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
    /// Takes derivatives at `x`.
    pub fn new<P: LeastSquares>(fit: &Fit<P>, x: &DVector<f64>, (data, unit): (u64, f64)) -> Self {
        let blocks: Vec<Block> = (0..fit.chunks()).into_par_iter().map(|index| fit.block(x, index)).collect();
        let triangle = fit.reduce_by(&|index, block: &mut Block| block.clone_from(&blocks[index]));
        Self { data, unit, x: x.clone(), blocks, triangle, within: OnceLock::new() }
    }

    /// Whether it was taken there, of residuals in this unit.
    pub fn is_at(&self, x: &DVector<f64>, unit: f64) -> bool {
        self.x == *x && self.unit.to_bits() == unit.to_bits()
    }

    /// Residuals and derivatives of a chunk.
    pub fn block(&self, index: usize) -> &Block {
        &self.blocks[index]
    }

    /// The factor where it was taken.
    pub fn triangle(&self) -> Triangle {
        self.triangle.clone()
    }

    /// The factor at `x` for residuals in this `unit`; `None` where derivatives do not serve there.
    pub fn at<P: LeastSquares>(&self, fit: &Fit<P>, x: &DVector<f64>, unit: f64) -> Option<Triangle> {
        let (step, larger) = (x - &self.x, self.unit / unit);
        let n = step.len();
        let missed = |index: usize| {
            let block = &self.blocks[index];
            let mut residual = vec![0.0; block.rows()];
            fit.problem().residuals(x, fit.chunk(index), &mut residual);
            let square = sum_of_squares(&residual);
            let columns = DMatrixView::from_slice(&block.values[..n * block.rows()], block.rows(), n);
            let way = columns * &step;
            let own = block.column(n).iter().zip(&way).map(|(start, way)| start + way);
            let rest: Vec<f64> = residual.iter().zip(own).map(|(there, foreseen)| there / larger - foreseen).collect();
            let rest = DVector::from_vec(rest);
            Missed {
                squares: [square, sum_of_squares(way.as_slice()), sum_of_squares(rest.as_slice())],
                gradient: columns.tr_mul(&rest),
            }
        };
        let all: Vec<Missed> = (0..self.blocks.len()).into_par_iter().map(missed).collect();
        let mut gradient = DVector::zeros(n);
        let mut sums = [0.0; 3];
        for own in all {
            gradient += own.gradient;
            sums.iter_mut().zip(own.squares).for_each(|(sum, square)| *sum += square);
        }
        let [squares, way, rest] = sums;
        let rows: usize = self.blocks.iter().map(Block::rows).sum();
        let serves = rest <= (MISSED * MISSED * way).max(squares / (larger * larger * rows as f64));
        serves.then(|| {
            let constant = self.within.get_or_init(|| Within::new(&self.triangle)).constant(&step, &gradient);
            self.triangle().with_residual(&constant, squares / (larger * larger)).times(larger)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;

    /// A curve through many points whose first two unknowns do the same, in some unit.
    struct Curve {
        unit: f64,
    }

    impl LeastSquares for Curve {
        fn parameters(&self) -> usize {
            4
        }

        fn items(&self) -> usize {
            700
        }

        fn rows_per_item(&self) -> usize {
            1
        }

        fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
            for (out, t) in out.iter_mut().zip(items.map(|i| i as f64 / 700.0)) {
                *out = (x[0] + x[1] + t * x[2] + (x[3] * t).sin() - (40.0 * t).cos()) / self.unit;
            }
        }

        fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
            self.residuals(x, items.clone(), block.column_mut(4));
            for (row, t) in items.map(|i| i as f64 / 700.0).enumerate() {
                let slopes = [1.0, 1.0, t, t * (x[3] * t).cos()];
                slopes.into_iter().enumerate().for_each(|(j, slope)| block.column_mut(j)[row] = slope / self.unit);
            }
        }
    }

    #[test]
    fn derivatives_serve_near_where_they_were_taken() {
        let (curve, start) = (Curve { unit: 0.1 }, DVector::from_vec(vec![0.3, -0.1, 0.2, 1.0]));
        let fit = Fit::new(&curve);
        let base = Base::new(&fit, &start, (1, 0.1));
        let columns = super::super::jacobian(&curve, &start);
        for (unit, step) in [(0.1, 0.0), (0.1, 0.02), (0.5, 0.02)] {
            let curve = Curve { unit };
            let fit = Fit::new(&curve);
            let x = &start + DVector::from_vec(vec![step, -2.0 * step, step, 0.5 * step]);
            let there = base.at(&fit, &x, unit).unwrap().into_linearisation();
            let residual = super::super::residual_vector(&curve, &x);
            let gradient = columns.tr_mul(&residual) * (0.1 / unit);
            assert!((there.triangle.tr_mul(&there.projected) - &gradient).norm() < 1e-6 * gradient.norm());
            assert!((2.0 * there.cost / residual.norm_squared() - 1.0).abs() < 1e-12);
            // What two unknowns do alike is no part of what is left.
            assert!(there.projected.norm_squared() < residual.norm_squared());
        }
        assert!(base.at(&fit, &(&start * 3.0), 0.1).is_none());
    }
}
