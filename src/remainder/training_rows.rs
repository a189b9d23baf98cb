//! Rows that a remainder is trained on, linearised about an identification.

use rand::seq::SliceRandom as _;

use super::kernel::Hyperparameters;
use super::prior::ParameterPrior;
use super::rows::{AXES, Layout, Rows};
use crate::random::stream;

/// Minimum share of σ² in the variance of a residual, against a rank that is lost by rounding.
const MIN_NOISE_SHARE: f64 = 1e-4;
/// Maximum rows up to which the processes are exact: all rows are centres.
const MAX_EXACT_ROWS: usize = 500;
/// Maximum rows that the functions are expanded about if not all are, beside knots.
const MAX_CENTRES: usize = 150;
/// Maximum rows that are left out to judge predictions.
const MAX_JUDGED_ROWS: usize = 1000;
/// Seed of the rows for hyperparameters, of the centres, and of the folds.
const SEED: u64 = 0x7265_6d61_696e;

/// Training rows of an identification.
pub(super) struct TrainingRows {
    pub layout: Layout,
    /// Places of the free parameters that move these rows.
    pub unknowns: Vec<usize>,
    pub rows: Rows,
    pub prior: ParameterPrior,
    /// Root mean square length of a residual \[m\].
    pub size: f64,
    pub configurations: Vec<Vec<usize>>,
    /// Rows that are left out to judge predictions: all, or those of some configurations.
    pub judged: Vec<usize>,
}

impl TrainingRows {
    /// Divides rows into configurations, and chooses those that are left out to judge predictions.
    pub fn new(
        (layout, unknowns): (Layout, Vec<usize>),
        rows: Rows,
        prior: ParameterPrior,
    ) -> Self {
        let size = (rows.residual.norm_squared() / rows.len().max(1) as f64).sqrt();
        let configurations = rows.configurations();
        let judged = Vec::new();
        let mut training = Self { layout, unknowns, rows, prior, size, configurations, judged };
        training.judged = training.some_rows(MAX_JUDGED_ROWS, 3);
        training
    }

    /// Some rows of whole configurations, at most `count` of them unless one configuration has
    /// more.
    pub fn some_rows(&self, count: usize, number: u64) -> Vec<usize> {
        if self.rows.len() <= count {
            return (0..self.rows.len()).collect();
        }
        let mut configurations = self.configurations.clone();
        configurations.shuffle(&mut stream(SEED, number));
        let mut picked = Vec::new();
        for rows in configurations {
            if picked.len() + rows.len() > count && !picked.is_empty() {
                break;
            }
            picked.extend(rows);
        }
        picked.sort_unstable();
        picked
    }

    /// Divides the configurations into at most `count` folds at random. Returns the rows of each
    /// fold and the other rows.
    pub fn folds(&self, count: usize) -> Vec<(Vec<usize>, Vec<usize>)> {
        let mut configurations = self.configurations.clone();
        configurations.shuffle(&mut stream(SEED, 2));
        let count = count.min(configurations.len());
        let mut fold_of_row = vec![0; self.rows.len()];
        for (number, rows) in configurations.iter().enumerate() {
            for &row in rows {
                fold_of_row[row] = number % count;
            }
        }
        let divided = |fold: usize| (0..self.rows.len()).partition(|&row| fold_of_row[row] == fold);
        (0..count).map(divided).collect()
    }

    /// Number of rows that the functions are expanded about.
    pub fn centres(&self) -> usize {
        if self.rows.len() <= MAX_EXACT_ROWS { MAX_EXACT_ROWS } else { MAX_CENTRES }
    }

    /// True where rows of one configuration may share noise: a tenth of them repeats one.
    pub fn shares_noise(&self) -> bool {
        10 * self.configurations.len() < 9 * self.rows.len()
    }

    /// Noise of predictions without a remainder: σ² from the scatter within configurations, σ_c²
    /// from what their means scatter beyond that.
    pub fn noise(&self) -> Hyperparameters {
        let coordinate = |row: usize, axis: usize| self.rows.residual[AXES * row + axis];
        let coordinates = (AXES * self.rows.len()) as f64;
        let freedom = (coordinates - self.unknowns.len() as f64).max(1.0);
        let whole = self.rows.residual.norm_squared() / freedom;
        if !self.shares_noise() {
            return Hyperparameters::without_remainder(whole.sqrt(), 0.0);
        }
        let mut within = 0.0;
        for rows in &self.configurations {
            for axis in 0..AXES {
                let mean = rows.iter().map(|&row| coordinate(row, axis)).sum::<f64>();
                let mean = mean / rows.len() as f64;
                within +=
                    rows.iter().map(|&row| (coordinate(row, axis) - mean).powi(2)).sum::<f64>();
            }
        }
        let repeated = AXES * (self.rows.len() - self.configurations.len());
        let within = (within / repeated.max(1) as f64).clamp(MIN_NOISE_SHARE * whole, whole);
        Hyperparameters::without_remainder(within.sqrt(), (whole - within).sqrt())
    }
}
