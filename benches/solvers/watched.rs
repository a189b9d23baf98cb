//! A problem that counts its evaluations and stops a solver at a time limit.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

use flexcal::least_squares::{Block, LeastSquares};
use nalgebra::DVector;

/// Problem with counted evaluations. After the deadline all residuals are NaN, as outside the
/// domain, which makes any solver stop.
pub struct Watched<'a> {
    problem: &'a dyn LeastSquares,
    deadline: Instant,
    late: AtomicBool,
    /// Number of items evaluated without and with derivatives.
    items: [AtomicUsize; 2],
}

impl<'a> Watched<'a> {
    pub fn new(problem: &'a dyn LeastSquares, limit: Duration) -> Self {
        Self {
            problem,
            deadline: Instant::now() + limit,
            late: AtomicBool::new(false),
            items: Default::default(),
        }
    }

    /// Returns the number of evaluations of the whole residual alone, and of residual and Jacobian.
    pub fn evaluations(&self) -> (usize, usize) {
        let count = |k: usize| self.items[k].load(Relaxed) / self.problem.items();
        (count(0), count(1))
    }

    /// True if the deadline passed before the solver ended.
    pub fn is_late(&self) -> bool {
        self.late.load(Relaxed)
    }

    /// Counts items evaluated without (`k` = 0) or with derivatives; returns true after the deadline.
    fn count(&self, k: usize, items: usize) -> bool {
        self.items[k].fetch_add(items, Relaxed);
        let late = Instant::now() > self.deadline;
        if late {
            self.late.store(true, Relaxed);
        }
        late
    }
}

impl LeastSquares for Watched<'_> {
    fn parameters(&self) -> usize {
        self.problem.parameters()
    }

    fn items(&self) -> usize {
        self.problem.items()
    }

    fn rows_per_item(&self) -> usize {
        self.problem.rows_per_item()
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        if self.count(0, items.len()) {
            out.fill(f64::NAN);
        } else {
            self.problem.residuals(x, items, out);
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        if self.count(1, items.len()) {
            block.values_mut().fill(f64::NAN);
        } else {
            self.problem.linearise(x, items, block);
        }
    }
}
