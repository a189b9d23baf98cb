//! The running QR decomposition of a tall matrix, block by block.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, DVector};

use super::{Block, Linearisation};
use crate::numeric::kernel::{PANEL, dot, dots, norm, subtract, sum_of_squares};

/// Widths of the panels of reflectors applied as matrix products, each with the number of remaining
/// columns from which it is used.
///
/// A wider panel costs more itself and needs fewer passes over the columns behind it.
const PANEL_WIDTHS: [(usize, usize); 2] = [(WIDE_PANEL, 384), (NARROW_PANEL, MIN_BLOCKED_COLUMNS)];
/// Number of Householder reflectors in the widest panel, which are applied together.
const WIDE_PANEL: usize = 96;
/// Number of reflectors in the narrower panel, and in each part of the widest one.
const NARROW_PANEL: usize = 32;
/// Number of columns from which reflectors are applied as matrix products.
pub(super) const MIN_BLOCKED_COLUMNS: usize = 128;

/// Running triangular factor of all rows absorbed so far.
///
/// \[R c; 0 d\] = Qᵀ \[J r\], so ‖J p + r‖² = ‖R p + c‖² + ‖d‖²
/// [Golub & Van Loan 2013, §5.2 and §6.5.3]
///
/// A block of rows is absorbed by n reflectors; R being triangular, reflector k touches only row k
/// of R and the rows of the block. Work: 2 n² per row, memory: n². No m × n matrix is ever kept.
#[derive(Debug, Clone)]
pub struct Triangle {
    pub(super) parameters: usize,
    /// Triangular factor R of all absorbed rows beside the projected residual c, row after row.
    pub(super) rows: Vec<f64>,
    /// Sum of squares ‖r‖² of all rows absorbed.
    squares: f64,
}

impl Triangle {
    /// Creates the factor of no rows, for `parameters` unknowns.
    pub fn new(parameters: usize) -> Self {
        Self { parameters, rows: vec![0.0; parameters * (parameters + 1)], squares: 0.0 }
    }

    /// Returns the triangular factor R of a matrix, shape = (n, n).
    ///
    /// Large matrices are sorted by the first non-zero column of each row, which saves work for
    /// stacks of triangular factors.
    pub(crate) fn factor(matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let (m, n) = matrix.shape();
        let mut order: Vec<usize> = (0..m).collect();
        if n >= MIN_BLOCKED_COLUMNS {
            let first =
                |row: &usize| matrix.row(*row).iter().position(|value| *value != 0.0).unwrap_or(n);
            order.sort_by_cached_key(first);
        }
        let mut block = Block::zeros(m, n);
        for (out, column) in block.values.chunks_exact_mut(m.max(1)).zip(matrix.column_iter()) {
            out.iter_mut().zip(&order).for_each(|(out, &row)| *out = column[row]);
        }
        let mut triangle = Self::new(n);
        triangle.absorb_rows(&mut block);
        triangle.into_linearisation().triangle
    }

    /// Returns ‖r‖² of all rows absorbed so far.
    pub fn sum_of_squares(&self) -> f64 {
        self.squares
    }

    /// Replaces ‖r‖² by the cost of a robust loss, which the weighted rows do not sum to.
    #[must_use]
    pub(super) fn with_sum_of_squares(mut self, squares: f64) -> Self {
        self.squares = squares;
        self
    }

    /// Multiplies all rows by `factor`, as a change of the residual unit does.
    pub(super) fn scaled(mut self, factor: f64) -> Self {
        if factor.to_bits() != 1.0_f64.to_bits() {
            self.rows.iter_mut().for_each(|value| *value *= factor);
            self.squares *= factor * factor;
        }
        self
    }

    /// Replaces the residual of the factor: `constant` is the new c, `squares` the new ‖r‖².
    pub(super) fn with_residual(mut self, constant: &DVector<f64>, squares: f64) -> Self {
        let n = self.parameters;
        self.rows
            .chunks_exact_mut(n + 1)
            .zip(constant.iter())
            .for_each(|(row, value)| row[n] = *value);
        self.squares = squares;
        self
    }

    /// Absorbs the rows of `block` and overwrites its values.
    ///
    /// The block must have the same number of unknowns; only debug builds check it.
    pub fn absorb(&mut self, block: &mut Block) {
        self.squares += sum_of_squares(block.column(block.parameters));
        self.reduce(block, |_| usize::MAX);
    }

    /// Absorbs rows that are sorted by their first non-zero column, as rows of priors are.
    ///
    /// With many unknowns, the first reflectors then touch only few of the rows. Unsorted rows are
    /// absorbed by [`Triangle::absorb`].
    pub(super) fn absorb_rows(&mut self, block: &mut Block) {
        let n = block.parameters;
        if n < MIN_BLOCKED_COLUMNS {
            return self.absorb(block);
        }
        let first =
            |row: usize| (0..n).find(|&j| block.values[j * block.rows + row] != 0.0).unwrap_or(n);
        let firsts: Vec<usize> = (0..block.rows).map(first).collect();
        if !firsts.is_sorted() {
            return self.absorb(block);
        }
        self.squares += sum_of_squares(block.column(n));
        self.reduce(block, |columns| firsts.partition_point(|&first| first < columns));
    }

    /// Absorbs all rows that `other` has absorbed.
    pub fn merge(&mut self, other: &Triangle) {
        let n = other.parameters;
        let mut block = Block::zeros(n, n);
        for (i, row) in other.rows.chunks_exact(n + 1).enumerate() {
            for (j, value) in row.iter().enumerate().skip(i) {
                block.values[j * n + i] = *value;
            }
        }
        // Below its diagonal the block is zero: columns up to k fill only its first k rows.
        self.reduce(&mut block, |columns| columns);
        self.squares += other.squares;
    }

    /// Returns \[R c\] = (`triangle`, `projected`) with added rows diag(d) p = 0; its cost is zero.
    pub(crate) fn damped(
        triangle: &DMatrix<f64>,
        projected: &DVector<f64>,
        diagonal: &DVector<f64>,
    ) -> Linearisation {
        let n = diagonal.len();
        let mut damped = Self::new(n);
        let mut block = Block::zeros(n, n);
        for i in 0..n {
            for j in i..n {
                damped.rows[i * (n + 1) + j] = triangle[(i, j)];
            }
            damped.rows[i * (n + 1) + n] = projected[i];
            block.values[i * n + i] = diagonal[i];
        }
        damped.reduce(&mut block, |columns| columns);
        damped.into_linearisation()
    }

    /// Returns the linearised problem of all rows absorbed.
    pub fn into_linearisation(self) -> Linearisation {
        let n = self.parameters;
        Linearisation {
            cost: 0.5 * self.squares,
            triangle: DMatrix::from_fn(
                n,
                n,
                |i, j| if i <= j { self.rows[i * (n + 1) + j] } else { 0.0 },
            ),
            projected: DVector::from_fn(n, |i, _| self.rows[i * (n + 1) + n]),
        }
    }

    /// Reduces the block to zero, panel after panel. `filled(k)` bounds the number of non-zero rows
    /// of its first k columns.
    pub(super) fn reduce_dense(&mut self, block: &mut Block, filled: impl Fn(usize) -> usize) {
        let (n, m) = (self.parameters, block.rows);
        debug_assert_eq!(n, block.parameters);
        if m == 0 {
            return;
        }
        let mut first = 0;
        while let Some(&(wide, _)) = PANEL_WIDTHS.iter().find(|(_, least)| n - first >= *least) {
            let used = filled(first + wide).min(m);
            let mut factors = [0.0; WIDE_PANEL];
            let end = first + wide;
            for (part, part_factors) in factors[..wide].chunks_mut(NARROW_PANEL).enumerate() {
                let first = first + part * NARROW_PANEL;
                self.reduce_columns(
                    block,
                    first..first + part_factors.len(),
                    first + part_factors.len(),
                    |_| used,
                    part_factors,
                );
                self.apply_panel(block, (first, end), used, part_factors);
            }
            self.apply_panel(block, (first, n + 1), used, &factors[..wide]);
            first = end;
        }
        self.reduce_columns(block, first..n, n + 1, filled, &mut []);
    }

    /// Reduces `columns` of the block and updates the columns behind them up to `end`. Writes the
    /// factors τ of the reflectors into `factors`, as far as it has room.
    fn reduce_columns(
        &mut self,
        block: &mut Block,
        columns: Range<usize>,
        end: usize,
        filled: impl Fn(usize) -> usize,
        factors: &mut [f64],
    ) {
        let (n, m) = (self.parameters, block.rows);
        for first in columns.clone().step_by(PANEL) {
            let width = PANEL.min(columns.end - first);
            let used = filled(first + width).min(m);
            let (panel, trailing) = block.values[first * m..end * m].split_at_mut(width * m);
            let panel_factors = self.factor_panel(first, width, panel, m, used);
            factors
                .iter_mut()
                .skip(first - columns.start)
                .zip(&panel_factors[..width])
                .for_each(|(out, factor)| *out = *factor);
            let vectors: [&[f64]; PANEL] =
                std::array::from_fn(|i| &panel[i.min(width - 1) * m..][..used]);
            let coupling = reflector_products(&vectors, width);
            for (j, column) in trailing.chunks_exact_mut(m).enumerate() {
                let column = &mut column[..used];
                let mut s = dots(&vectors, column);
                for i in 0..width {
                    let index = (first + i) * (n + 1) + first + width + j;
                    let earlier: f64 = (0..i).map(|l| coupling[i][l] * s[l]).sum();
                    s[i] = panel_factors[i] * (self.rows[index] + s[i] - earlier);
                    self.rows[index] -= s[i];
                }
                s[width..].fill(0.0);
                subtract(column, &s, &vectors);
            }
        }
    }

    /// Applies the reflectors of the panel at column `first` to the columns behind it up to `end`,
    /// as matrix products.
    ///
    /// With the reflector vectors V below their leading ones, H₁ … H_k = 1 − U T Uᵀ: W = Tᵀ (R + Vᵀ
    /// C), R ← R − W, C ← C − V W [Schreiber & Van Loan 1989].
    fn apply_panel(
        &mut self,
        block: &mut Block,
        (first, end): (usize, usize),
        used: usize,
        factors: &[f64],
    ) {
        let wide = factors.len();
        if first + wide == end {
            return;
        }
        let (n, m) = (self.parameters, block.rows);
        let (panel, trailing) = block.values[first * m..].split_at_mut(wide * m);
        let behind = end - first - wide;
        let vectors = DMatrixView::from_slice_with_strides(panel, used, wide, 1, m);
        let transposed = vectors.transpose();
        let mut columns = DMatrixViewMut::from_slice_with_strides_mut(trailing, used, behind, 1, m);
        let corner = &mut self.rows[first * (n + 1) + first + wide..];
        let mut rows = DMatrixViewMut::from_slice_with_strides_mut(corner, wide, behind, n + 1, 1);
        let mut products = DMatrix::zeros(wide, wide);
        products.gemm(1.0, &transposed, &vectors, 0.0);
        let mut triangle = DMatrix::zeros(wide, wide);
        for (i, &factor) in factors.iter().enumerate() {
            for j in 0..i {
                let coupled: f64 = (j..i).map(|l| triangle[(j, l)] * products[(l, i)]).sum();
                triangle[(j, i)] = -factor * coupled;
            }
            triangle[(i, i)] = factor;
        }
        let mut update = rows.clone_owned();
        update.gemm(1.0, &transposed, &columns, 1.0);
        let update = triangle.transpose() * update;
        rows -= &update;
        columns.gemm(-1.0, &vectors, &update, 1.0);
    }

    /// Replaces `width` columns by their reflector vectors and returns the factors τ of H = I − τ u
    /// uᵀ.
    fn factor_panel(
        &mut self,
        first: usize,
        width: usize,
        panel: &mut [f64],
        m: usize,
        used: usize,
    ) -> [f64; PANEL] {
        let stride = self.parameters + 1;
        let mut factors = [0.0; PANEL];
        for i in 0..width {
            let row = (first + i) * stride + first;
            let (head, tail) = panel.split_at_mut((i + 1) * m);
            let vector = &mut head[i * m..][..used];
            let (diagonal, factor) = reflector(self.rows[row + i], vector);
            self.rows[row + i] = diagonal;
            factors[i] = factor;
            for (l, column) in tail.chunks_exact_mut(m).enumerate() {
                let column = &mut column[..used];
                let index = row + i + 1 + l;
                let s = factor * (self.rows[index] + dot(vector, column));
                self.rows[index] -= s;
                column.iter_mut().zip(&*vector).for_each(|(c, v)| *c -= s * v);
            }
        }
        factors
    }
}

/// Computes the Householder reflector that maps (α, v) to (β, 0) and returns (β, τ).
///
/// β = −sign(α) ‖(α, v)‖, τ = (β − α)/β, u = (1, v/(α − β)) [Golub & Van Loan 2013, alg. 5.1.1]
///
/// `vector` becomes the part of u below its leading 1. For v = 0 it stays unchanged and τ = 0.
pub(super) fn reflector(alpha: f64, vector: &mut [f64]) -> (f64, f64) {
    let norm = norm(vector);
    if norm == 0.0 {
        return (alpha, 0.0);
    }
    let beta = -alpha.hypot(norm).copysign(alpha);
    let pivot = alpha - beta;
    let inverse = pivot.recip();
    if inverse.is_normal() {
        for v in vector {
            *v *= inverse;
        }
    } else {
        for v in vector {
            *v /= pivot;
        }
    }
    (beta, -pivot / beta)
}

/// Returns the products `vᵢᵀvₗ` for l < i.
fn reflector_products(vectors: &[&[f64]; PANEL], width: usize) -> [[f64; PANEL]; PANEL] {
    let mut products = [[0.0; PANEL]; PANEL];
    for i in 1..width {
        for l in 0..i {
            products[i][l] = dot(vectors[i], vectors[l]);
        }
    }
    products
}

impl Linearisation {
    /// Adds rows W p = 0 for the step p, with W = `rows`, shape = (k, n). The cost stays unchanged.
    #[must_use]
    pub(crate) fn with_rows(self, rows: &DMatrix<f64>) -> Self {
        let n = self.projected.len();
        let mut block = Block::zeros(n + rows.nrows(), n);
        for j in 0..n {
            let (triangle_part, added_part) = block.column_mut(j).split_at_mut(n);
            triangle_part.copy_from_slice(self.triangle.column(j).as_slice());
            added_part.copy_from_slice(rows.column(j).as_slice());
        }
        block.column_mut(n)[..n].copy_from_slice(self.projected.as_slice());
        let mut triangle = Triangle::new(n);
        triangle.absorb(&mut block);
        Self { cost: self.cost, ..triangle.into_linearisation() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns entry `i` of a repeatable sequence in (−1, 1).
    fn wave(i: usize) -> f64 {
        (1.7 * i as f64 + 0.3 * (i * i % 101) as f64).sin()
    }

    fn block(rows: usize, n: usize, offset: usize, scale: f64) -> Block {
        let mut block = Block::zeros(rows, n);
        block.values_mut().iter_mut().enumerate().for_each(|(i, v)| *v = scale * wave(i + offset));
        block
    }

    fn dense(block: &Block) -> DMatrix<f64> {
        DMatrix::from_column_slice(block.rows, block.parameters + 1, &block.values)
    }

    /// Asserts that `RᵀR`, `Rᵀc` and the cost equal those of the stacked rows.
    fn assert_same_problem(triangle: Triangle, stacked: &DMatrix<f64>, tolerance: f64) {
        let n = stacked.ncols() - 1;
        let gram = stacked.tr_mul(stacked);
        let reduced = triangle.into_linearisation();
        let scale = gram.amax();
        assert!(
            (reduced.triangle.tr_mul(&reduced.triangle) - gram.view((0, 0), (n, n))).amax()
                <= tolerance * scale
        );
        assert!(
            (reduced.triangle.tr_mul(&reduced.projected) - gram.view((0, n), (n, 1))).amax()
                <= tolerance * scale
        );
        assert!((2.0 * reduced.cost - gram[(n, n)]).abs() <= tolerance * scale);
    }

    #[test]
    fn absorbs_blocks_of_any_shape() {
        for n in [1, 2, 3, 4, 5, 7, 8, 13, 127, 128, 150, 201, 390] {
            let mut triangle = Triangle::new(n);
            let mut stacked = DMatrix::zeros(0, n + 1);
            for (k, rows) in [1, 3, 4, 30, 257].into_iter().enumerate() {
                let mut block = block(rows, n, 1000 * k, 1.0);
                let top = stacked.nrows();
                stacked = stacked.insert_rows(top, rows, 0.0);
                stacked.view_mut((top, 0), (rows, n + 1)).copy_from(&dense(&block));
                triangle.absorb(&mut block);
            }
            assert_same_problem(triangle, &stacked, 1e-13);
        }
    }

    #[test]
    fn merging_equals_absorbing() {
        for (n, rows) in [(11, 40), (170, 40), (170, 400), (400, 450)] {
            assert_merge_equals_absorb(n, rows);
        }
    }

    #[test]
    fn rows_of_priors_are_absorbed_as_any() {
        for n in [5, 170, 400] {
            // Unknowns 0, 2, 3, 5, … have a prior; every row also has an entry two columns further
            // on.
            let rows: Vec<usize> = (0..n).filter(|j| j % 3 != 1).collect();
            let mut priors = Block::zeros(rows.len(), n);
            for (i, &j) in rows.iter().enumerate() {
                for column in [j, (j + 2).min(n)] {
                    priors.column_mut(column)[i] = wave(7 * i + column);
                }
            }
            for data in [0, 3, 400] {
                let mut triangle = Triangle::new(n);
                triangle.absorb(&mut block(data, n, 0, 1.0));
                let mut sorted = triangle.clone();
                triangle.absorb(&mut priors.clone());
                sorted.absorb_rows(&mut priors.clone());
                let [any, sorted] = [triangle, sorted].map(Triangle::into_linearisation);
                assert!((any.cost / sorted.cost - 1.0).abs() < 1e-14);
                assert!(
                    (any.triangle - sorted.triangle).amax() < 1e-13
                        && (any.projected - sorted.projected).amax() < 1e-13
                );
            }
        }
    }

    #[test]
    fn a_factor_does_not_depend_on_the_order_of_the_rows() {
        for n in [6, 130, 400] {
            // The matrix has rows of a factor, rows of priors below them, a row of zeros and a full
            // row.
            let entry = |i: usize, j: usize| match i {
                i if i < n => f64::from(u8::from(i <= j)) * wave(i + 31 * j),
                i if i < 2 * n => f64::from(u8::from(i - n == j)),
                i => (i - 2 * n) as f64 * wave(j),
            };
            let matrix = DMatrix::from_fn(2 * n + 2, n, entry);
            let triangle = Triangle::factor(&matrix);
            let gram = matrix.tr_mul(&matrix);
            assert!((triangle.tr_mul(&triangle) - &gram).amax() < 1e-13 * gram.amax());
            assert!(triangle.lower_triangle().iter().filter(|value| **value != 0.0).count() <= n);
        }
    }

    fn assert_merge_equals_absorb(n: usize, rows: usize) {
        let (first, second) = (block(rows, n, 0, 1.0), block(rows, n, 5000, 2.0));
        let mut stacked = DMatrix::zeros(2 * rows, n + 1);
        stacked.view_mut((0, 0), (rows, n + 1)).copy_from(&dense(&first));
        stacked.view_mut((rows, 0), (rows, n + 1)).copy_from(&dense(&second));
        let mut triangle = Triangle::new(n);
        triangle.absorb(&mut first.clone());
        let mut merged = Triangle::new(n);
        merged.absorb(&mut second.clone());
        triangle.merge(&merged);
        assert_same_problem(triangle, &stacked, 1e-13);
    }

    #[test]
    fn extreme_sizes_and_zero_columns_stay_finite() {
        for scale in [1e-200, 1e-308, 1e150, 1e200] {
            let mut block = block(20, 6, 0, scale);
            block.column_mut(2).fill(0.0);
            let expected = norm(block.column(0));
            let mut triangle = Triangle::new(6);
            triangle.absorb(&mut block);
            let reduced = triangle.into_linearisation();
            assert!(reduced.triangle.iter().all(|v| v.is_finite()));
            assert!((reduced.triangle[(0, 0)].abs() / expected - 1.0).abs() < 1e-6, "{scale}");
            assert!(reduced.triangle.column(2).iter().skip(2).all(|v| *v == 0.0));
        }
    }
}
