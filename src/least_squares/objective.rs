//! Objective over many items: its cost and its triangular linearisation, formed chunk by chunk.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{DMatrix, DVector};

use super::chord::{BasePoint, Chunk};
use super::curvature::curvature_by_differences;
use super::linearisation_cache::LinearisationKey;
use super::{
    Block, LeastSquares, LinearRows, Linearisation, LinearisationCache, Loss, MANY_UNKNOWNS,
    Objective, RowsError, Triangle, slopes,
};
use crate::numeric::kernel::{dot, sum_of_squares};
use crate::numeric::parallel;

/// Number of items (poses) that are reduced to one triangular factor at a time. Larger problems
/// keep only n × n factors, never the m × n matrix.
pub const CHUNK_ITEMS: usize = 256;

/// Fraction of a step at which residuals are evaluated for the second derivative along the step.
const ACCELERATION_STEP: f64 = 0.1;

/// Rows per unknown that one thread absorbs chunk after chunk before factors are merged. Merging
/// two factors costs as much as absorbing n/2 rows.
const ROWS_PER_UNKNOWN_AND_THREAD: usize = 4;

/// Maximum number of chunks whose results are in memory at a time.
const MAX_CHUNKS_IN_MEMORY: usize = 64;

/// Maximum number of derivatives that a provisional fit stores for later points: 128 MB of 8-byte
/// numbers.
const MAX_KEPT_DERIVATIVES: usize = 1 << 24;

/// Objective of a least-squares problem with optional linear rows (priors, gauge conditions).
///
/// Items are processed in chunks of [`CHUNK_ITEMS`]. Each chunk, or each run of chunks if there are
/// many unknowns, is reduced to a [`Triangle`]. The triangles are merged in an order that does not
/// depend on the number of threads, so results are reproducible to the bit. A single chunk stays on
/// the calling thread.
#[derive(Debug, Clone)]
pub struct Fit<'a, P> {
    problem: &'a P,
    rows: Vec<LinearRows>,
    loss: Loss,
    cache: Option<(&'a LinearisationCache, u64, f64)>,
}

impl<'a, P: LeastSquares> Fit<'a, P> {
    /// Creates the objective of the data alone, with squared loss.
    pub fn new(problem: &'a P) -> Self {
        Self { problem, rows: Vec::new(), loss: Loss::Squares, cache: None }
    }

    /// Sets the loss of each item's residual (an item is a pose). Linear rows, such as priors,
    /// always enter with their squares.
    #[must_use]
    pub fn with_loss(mut self, loss: Loss) -> Self {
        self.loss = loss;
        self
    }

    /// Stores linearisations in `cache` and reuses those stored there. `data` identifies the data
    /// set; `unit` is what its residuals are divided by, such as 1 σ of a position \[m\].
    #[must_use]
    pub fn with_cache(mut self, cache: &'a LinearisationCache, data: u64, unit: f64) -> Self {
        self.cache = Some((cache, data, unit));
        self
    }

    /// Adds the squared residuals of linear rows to the cost.
    ///
    /// # Errors
    /// Returns an error if the rows do not have one column per unknown and one constant per row.
    pub fn with_rows(mut self, rows: LinearRows) -> Result<Self, RowsError> {
        let (matrix, columns) = rows.matrix.shape();
        let parameters = self.problem.parameters();
        if columns != parameters {
            return Err(RowsError::Columns { columns, parameters });
        }
        if matrix != rows.constant.len() {
            return Err(RowsError::Rows { matrix, constant: rows.constant.len() });
        }
        self.rows.push(rows);
        Ok(self)
    }

    fn chunk_count(&self) -> usize {
        self.problem.items().div_ceil(CHUNK_ITEMS)
    }

    fn items_of_chunk(&self, index: usize) -> Range<usize> {
        let start = index * CHUNK_ITEMS;
        start..(start + CHUNK_ITEMS).min(self.problem.items())
    }

    fn empty_block(&self) -> Block {
        let items = self.problem.items().min(CHUNK_ITEMS);
        Block::zeros(items * self.problem.rows_per_item(), self.problem.parameters())
    }

    fn chunk_loss(&self, x: &DVector<f64>, index: usize, buffer: &mut [f64]) -> f64 {
        let items = self.items_of_chunk(index);
        let out = &mut buffer[..items.len() * self.problem.rows_per_item()];
        self.problem.residuals(x, items, out);
        self.loss.sum_of_losses(out, self.problem.rows_per_item())
    }

    /// Returns the number of chunks that one thread absorbs in sequence.
    fn chunks_per_thread(&self) -> usize {
        let rows = CHUNK_ITEMS * self.problem.rows_per_item().max(1);
        (ROWS_PER_UNKNOWN_AND_THREAD * self.problem.parameters()).div_ceil(rows).max(1)
    }

    /// Fills a block with the residuals of chunk `index` and their derivatives at x.
    fn linearise_chunk(&self, x: &DVector<f64>, index: usize, block: &mut Block) {
        let items = self.items_of_chunk(index);
        block.reshape(items.len() * self.problem.rows_per_item());
        self.problem.linearise(x, items, block);
    }

    /// Returns the triangular factor of a run of chunks, each written by `fill`.
    fn run_triangle(
        &self,
        fill: &impl Fn(usize, &mut Block),
        run: Range<usize>,
        block: &mut Block,
    ) -> Triangle {
        let mut triangle = Triangle::new(self.problem.parameters());
        for index in run {
            fill(index, block);
            let before = triangle.sum_of_squares();
            let robust = self.loss.apply_weights(block, self.problem.rows_per_item());
            triangle.absorb(block);
            if let Some(sum) = robust {
                triangle = triangle.with_sum_of_squares(before + sum);
            }
        }
        triangle
    }

    /// Returns the triangular factor of all data at x.
    fn reduce(&self, x: &DVector<f64>) -> Triangle {
        self.reduce_by(&|index, block: &mut Block| self.linearise_chunk(x, index, block))
    }

    /// Returns the triangular factor of all chunks, each written by `fill`.
    ///
    /// With few unknowns, merging is cheap and chunks are merged one by one in order; otherwise
    /// [`Fit::reduce_halves`] merges them pairwise.
    fn reduce_by(&self, fill: &(impl Fn(usize, &mut Block) + Sync)) -> Triangle {
        if self.chunks_per_thread() > 1 {
            return self.reduce_halves(fill, 0..self.chunk_count(), &Mutex::default());
        }
        let mut total: Option<Triangle> = None;
        let map = |index, block: &mut Block| self.run_triangle(fill, index..index + 1, block);
        let take = |triangle: Triangle| match &mut total {
            Some(total) => total.merge(&triangle),
            None => total = Some(triangle),
        };
        map_in_order(self.chunk_count(), || self.empty_block(), map, take);
        total.unwrap_or_else(|| Triangle::new(self.problem.parameters()))
    }

    /// Returns the triangular factor of a range of chunks by bisection, the halves in parallel.
    /// `spare` holds blocks for reuse.
    fn reduce_halves(
        &self,
        fill: &(impl Fn(usize, &mut Block) + Sync),
        chunks: Range<usize>,
        spare: &Mutex<Vec<Block>>,
    ) -> Triangle {
        if chunks.len() <= self.chunks_per_thread() {
            let spare = || spare.lock().unwrap_or_else(PoisonError::into_inner);
            let reused = spare().pop();
            let mut block = reused.unwrap_or_else(|| self.empty_block());
            let triangle = self.run_triangle(fill, chunks, &mut block);
            spare().push(block);
            return triangle;
        }
        let middle = chunks.start + chunks.len() / 2;
        let half = |chunks| move || self.reduce_halves(fill, chunks, spare);
        let (mut first, second) = rayon::join(half(chunks.start..middle), half(middle..chunks.end));
        first.merge(&second);
        first
    }

    /// Returns the triangular factor of all data at x. A provisional fit takes it from the
    /// derivatives of an earlier point where these are accurate enough.
    fn triangle_at(&self, x: &DVector<f64>) -> Triangle {
        let Some((cache, data, unit)) = self.cache else { return self.reduce(x) };
        cache.get_or_reduce(&LinearisationKey { data, loss: self.loss, x: x.clone() }, unit, || {
            if !(cache.is_provisional() && self.keeps_derivatives()) {
                return self.reduce(x);
            }
            let earlier =
                cache.base_point(data).and_then(|base| base.triangle_at(self.problem, x, unit));
            earlier.unwrap_or_else(|| {
                let base = self.linearise_base_point(x, (data, unit));
                let triangle = base.triangle();
                if triangle.sum_of_squares().is_finite() {
                    cache.set_base_point(Arc::new(base));
                }
                triangle
            })
        })
    }

    /// Returns residuals and derivatives of all data at x with their triangular factor, to be
    /// reused as a base point; `key` is (data set, unit of residuals).
    fn linearise_base_point(&self, x: &DVector<f64>, key: (u64, f64)) -> BasePoint {
        let chunk = |index| {
            let mut block = Block::zeros(0, self.problem.parameters());
            self.linearise_chunk(x, index, &mut block);
            Chunk { items: self.items_of_chunk(index), block }
        };
        let chunks = parallel::map(self.chunk_count(), chunk);
        let triangle =
            self.reduce_by(&|index, block: &mut Block| block.clone_from(&chunks[index].block));
        BasePoint::new(x, key, chunks, triangle)
    }

    /// Returns true if a provisional fit may keep the derivatives of all data: squared loss, many
    /// unknowns, and no more than [`MAX_KEPT_DERIVATIVES`] numbers.
    fn keeps_derivatives(&self) -> bool {
        let (n, rows) =
            (self.problem.parameters(), self.problem.items() * self.problem.rows_per_item());
        self.loss == Loss::Squares && n >= MANY_UNKNOWNS && rows * n <= MAX_KEPT_DERIVATIVES
    }

    /// Returns Jᵀ r″ of one chunk with r″ = 2 (r(x + h p) − r − h J p) / h².
    fn chunk_acceleration_gradient(
        &self,
        (x, step): (&DVector<f64>, &DVector<f64>),
        index: usize,
        block: &mut Block,
    ) -> DVector<f64> {
        self.linearise_chunk(x, index, block);
        let n = block.parameters();
        let mut moved = vec![0.0; block.rows()];
        self.problem.residuals(
            &(x + ACCELERATION_STEP * step),
            self.items_of_chunk(index),
            &mut moved,
        );
        for (i, moved) in moved.iter_mut().enumerate() {
            let linear: f64 = (0..n).map(|j| block.column(j)[i] * step[j]).sum();
            *moved = 2.0 * ((*moved - block.column(n)[i]) / ACCELERATION_STEP - linear)
                / ACCELERATION_STEP;
        }
        let weights = self.loss.weights(block.column(n), self.problem.rows_per_item());
        moved.iter_mut().zip(&weights).for_each(|(second, weight)| *second *= weight);
        DVector::from_fn(n, |j, _| dot(block.column(j), &moved))
    }
}

/// Applies `map` to the index of each of `count` chunks and a `buffer`, in parallel if there are
/// several chunks. Passes the results to `take` in the order of the chunks.
fn map_in_order<B: Send, T: Send>(
    count: usize,
    buffer: impl Fn() -> B + Sync,
    map: impl Fn(usize, &mut B) -> T + Sync,
    mut take: impl FnMut(T),
) {
    if count <= 1 {
        (0..count).for_each(|index| take(map(index, &mut buffer())));
        return;
    }
    for group in (0..count).step_by(MAX_CHUNKS_IN_MEMORY) {
        let chunks = MAX_CHUNKS_IN_MEMORY.min(count - group);
        let results =
            parallel::map_with(chunks, &buffer, |chunk, buffer| map(group + chunk, buffer));
        results.into_iter().for_each(&mut take);
    }
}

impl<P: LeastSquares> Objective for Fit<'_, P> {
    fn parameters(&self) -> usize {
        self.problem.parameters()
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        let rows = self.problem.items().min(CHUNK_ITEMS) * self.problem.rows_per_item();
        let mut squares = 0.0;
        let map = |index, buffer: &mut Vec<f64>| self.chunk_loss(x, index, buffer);
        map_in_order(self.chunk_count(), || vec![0.0; rows], map, |s| squares += s);
        for rows in &self.rows {
            squares += sum_of_squares((&rows.matrix * x + &rows.constant).as_slice());
        }
        half_if_finite(squares)
    }

    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let mut total = self.triangle_at(x);
        for rows in &self.rows {
            total.absorb_rows(&mut rows.block(x));
        }
        let mut linearisation = total.into_linearisation();
        linearisation.cost = half_if_finite(2.0 * linearisation.cost);
        linearisation
    }

    /// Differences the gradients of exact linearisations; derivatives cached at other points are
    /// not used.
    fn curvature(
        &self,
        x: &DVector<f64>,
        within: &dyn Fn(&DVector<f64>) -> bool,
    ) -> Option<DMatrix<f64>> {
        let plain =
            Fit { problem: self.problem, rows: self.rows.clone(), loss: self.loss, cache: None };
        curvature_by_differences(|x| slopes(plain.linearise(x)), x, within)
    }

    /// Returns 1 σ of the prior of each unknown that has one: a row a x + b of this unknown alone
    /// has σ = 1/|a|.
    fn plausible_sizes(&self) -> Vec<Option<f64>> {
        let mut sizes = vec![None; self.parameters()];
        for row in self.rows.iter().flat_map(|rows| rows.matrix.row_iter()) {
            let mut entries = row.iter().enumerate().filter(|(_, value)| **value != 0.0);
            if let (Some((j, value)), None) = (entries.next(), entries.next()) {
                sizes[j] = Some(value.abs().recip());
            }
        }
        sizes
    }

    fn acceleration_gradient(&self, x: &DVector<f64>, step: &DVector<f64>) -> Option<DVector<f64>> {
        // In a provisional fit, one more step costs less than the acceleration of this one.
        if self.cache.is_some_and(|(cache, ..)| cache.is_provisional()) && self.keeps_derivatives()
        {
            return None;
        }
        let mut total = DVector::zeros(x.len());
        let map =
            |index, block: &mut Block| self.chunk_acceleration_gradient((x, step), index, block);
        map_in_order(self.chunk_count(), || self.empty_block(), map, |chunk| total += chunk);
        total.iter().all(|value| value.is_finite()).then_some(total)
    }
}

/// Returns half the sum of squares, or infinity if it is not finite.
fn half_if_finite(squares: f64) -> f64 {
    if squares.is_finite() { 0.5 * squares } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::least_squares::{jacobian, residual_vector};

    /// Straight line through many points; records the largest number of points requested at once.
    struct Line {
        points: usize,
        largest: AtomicUsize,
    }

    impl LeastSquares for Line {
        fn parameters(&self) -> usize {
            2
        }

        fn items(&self) -> usize {
            self.points
        }

        fn rows_per_item(&self) -> usize {
            1
        }

        fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
            self.largest.fetch_max(items.len(), Ordering::Relaxed);
            out.iter_mut().zip(items).for_each(|(out, t)| *out = x[0] + x[1] * t as f64 - 1.0);
        }

        fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
            self.residuals(x, items.clone(), block.column_mut(2));
            for (row, t) in items.enumerate() {
                block.column_mut(0)[row] = 1.0;
                block.column_mut(1)[row] = t as f64;
            }
        }
    }

    #[test]
    fn no_more_than_a_chunk_of_rows_is_ever_held() {
        let line = Line { points: 100_000, largest: AtomicUsize::new(0) };
        let fit = Fit::new(&line);
        let x = DVector::from_vec(vec![0.5, 1e-6]);
        let linearisation = fit.linearise(&x);
        assert_eq!(linearisation.triangle.shape(), (2, 2));
        assert!((linearisation.cost / fit.cost(&x) - 1.0).abs() < 1e-12);
        assert_eq!(line.largest.load(Ordering::Relaxed), CHUNK_ITEMS);
    }

    #[test]
    fn what_is_remembered_is_not_asked_for_again() {
        let line = Line { points: 500, largest: AtomicUsize::new(0) };
        let cache = LinearisationCache::default();
        let (x, shifted) = (DVector::from_vec(vec![0.5, 1e-3]), DVector::from_vec(vec![0.5, 2e-3]));
        let robust = Loss::Huber { threshold: 1.0 };
        let is_evaluated_anew = |x: &DVector<f64>, loss: Loss, data: u64| {
            let fit = Fit::new(&line).with_loss(loss);
            let plain = fit.linearise(x);
            assert!((fit.cost(x) / plain.cost - 1.0).abs() < 1e-12);
            line.largest.store(0, Ordering::Relaxed);
            let cached = fit.with_cache(&cache, data, 1.0).linearise(x);
            assert_eq!((plain.triangle, plain.projected), (cached.triangle, cached.projected));
            line.largest.load(Ordering::Relaxed) > 0
        };
        // The last two points and the first one of the same data are kept; anything else is reduced
        // again.
        assert!(is_evaluated_anew(&x, Loss::Squares, 1));
        assert!(
            !is_evaluated_anew(&x, Loss::Squares, 1)
                && is_evaluated_anew(&x, robust, 1)
                && !is_evaluated_anew(&x, Loss::Squares, 1)
        );
        assert!(
            is_evaluated_anew(&x, Loss::Squares, 2)
                && is_evaluated_anew(&shifted, Loss::Squares, 1)
                && !is_evaluated_anew(&x, Loss::Squares, 1)
        );
        assert!(is_evaluated_anew(&x, Loss::Squares, 2));
    }

    /// Curve through many points with two exchangeable unknowns and residuals in some unit.
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
                slopes
                    .into_iter()
                    .enumerate()
                    .for_each(|(j, slope)| block.column_mut(j)[row] = slope / self.unit);
            }
        }
    }

    #[test]
    fn derivatives_serve_near_where_they_were_taken() {
        let (curve, start) = (Curve { unit: 0.1 }, DVector::from_vec(vec![0.3, -0.1, 0.2, 1.0]));
        let fit = Fit::new(&curve);
        let base = fit.linearise_base_point(&start, (1, 0.1));
        let columns = jacobian(&curve, &start);
        for (unit, step) in [(0.1, 0.0), (0.1, 0.02), (0.5, 0.02)] {
            let curve = Curve { unit };
            let x = &start + DVector::from_vec(vec![step, -2.0 * step, step, 0.5 * step]);
            let predicted = base.triangle_at(&curve, &x, unit).unwrap().into_linearisation();
            let residual = residual_vector(&curve, &x);
            let gradient = columns.tr_mul(&residual) * (0.1 / unit);
            assert!(
                (predicted.triangle.tr_mul(&predicted.projected) - &gradient).norm()
                    < 1e-6 * gradient.norm()
            );
            assert!((2.0 * predicted.cost / residual.norm_squared() - 1.0).abs() < 1e-12);
            // The two exchangeable unknowns do not grow with opposite signs.
            assert!(predicted.projected.norm_squared() < residual.norm_squared());
        }
        assert!(base.triangle_at(&curve, &(&start * 3.0), 0.1).is_none());
    }
}
