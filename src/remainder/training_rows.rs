//! Training rows of a remainder, linearised about an identification.

use rand::seq::SliceRandom as _;

use super::kernel::Hyperparameters;
use super::prior::ParameterPrior;
use super::rows::{AXES, Layout, Rows};
use crate::random::stream;

/// Smallest variance σ² within configurations that is assumed, as a fraction of the residuals'
/// variance. It keeps the noise covariance invertible.
const MIN_NOISE_SHARE: f64 = 1e-4;
/// Maximum number of rows for which the processes are exact, with every row a centre.
const MAX_EXACT_ROWS: usize = 500;
/// Maximum number of rows that are centres above [`MAX_EXACT_ROWS`]; knots come in addition.
const MAX_CENTRES: usize = 150;
/// Maximum number of rows that are left out to test predictions.
const MAX_JUDGED_ROWS: usize = 1000;
/// Seed of the random choice of the rows for hyperparameters, of the centres, and of the folds.
const SEED: u64 = 0x7265_6d61_696e;

/// Training rows of an identification, with the prior of its parameters.
pub(super) struct TrainingRows {
    pub layout: Layout,
    /// Indices of the free parameters that affect these rows.
    pub unknowns: Vec<usize>,
    pub rows: Rows,
    /// Unit of the rows' relative σ: root mean square of their σ \[m\].
    pub sigma: f64,
    pub prior: ParameterPrior,
    /// Root mean square length of a residual \[m\].
    pub size: f64,
    /// Row indices of each configuration.
    pub configurations: Vec<Vec<usize>>,
    /// Indices of the rows that are left out to test predictions: all, or those of some
    /// configurations.
    pub judged: Vec<usize>,
    /// True if a remainder can be fitted: joint errors move no rows but these.
    pub takes_remainder: bool,
}

impl TrainingRows {
    /// Groups the rows by configuration, and chooses those that are left out to test predictions.
    pub fn new(
        (layout, unknowns): (Layout, Vec<usize>),
        rows: Rows,
        (prior, sigma): (ParameterPrior, f64),
        takes_remainder: bool,
    ) -> Self {
        let size = (rows.residual.norm_squared() / rows.len().max(1) as f64).sqrt();
        let configurations = rows.configurations();
        let judged = Vec::new();
        let mut training = Self {
            layout,
            unknowns,
            rows,
            sigma,
            prior,
            size,
            configurations,
            judged,
            takes_remainder,
        };
        training.judged = training.some_rows(MAX_JUDGED_ROWS, 3);
        training
    }

    /// Returns at most `count` rows at random, in whole configurations; more only if a single
    /// configuration has more. `number` selects the random stream.
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

    /// Divides the configurations into at most `count` random folds. Returns, for each fold, its
    /// rows and all other rows.
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

    /// Returns the maximum number of rows that are centres of the Gaussian processes.
    pub fn max_centres(&self) -> usize {
        if self.rows.len() <= MAX_EXACT_ROWS { MAX_EXACT_ROWS } else { MAX_CENTRES }
    }

    /// Returns true if noise shared by rows of one configuration can be estimated: more than a
    /// tenth of the rows repeat a configuration.
    pub fn shares_noise(&self) -> bool {
        10 * self.configurations.len() < 9 * self.rows.len()
    }

    /// Estimates the noise of a model without a remainder. σ² is the variance of the residuals
    /// within configurations, each in units of the row's relative σ. σ_c² is what then remains of
    /// the variance of all residuals.
    pub fn noise(&self) -> Hyperparameters {
        let relative = |row: usize| self.rows.relative_sigma[row];
        let coordinate = |row: usize, axis: usize| self.rows.residual[AXES * row + axis];
        let coordinates = (AXES * self.rows.len()) as f64;
        let freedom = (coordinates - self.unknowns.len() as f64).max(1.0);
        let sum_over = |of: &dyn Fn(usize, usize) -> f64| -> f64 {
            (0..self.rows.len()).map(|row| (0..AXES).map(|axis| of(row, axis)).sum::<f64>()).sum()
        };
        let relative_variance =
            sum_over(&|row, axis| (coordinate(row, axis) / relative(row)).powi(2)) / freedom;
        if !self.shares_noise() {
            return Hyperparameters::without_remainder(relative_variance.sqrt(), 0.0);
        }
        let mut within = 0.0;
        for rows in &self.configurations {
            // The mean is weighted by the precision of the rows.
            let weight = |row: usize| relative(row).powi(-2);
            let weights: f64 = rows.iter().map(|&row| weight(row)).sum();
            for axis in 0..AXES {
                let sum = rows.iter().map(|&row| weight(row) * coordinate(row, axis)).sum::<f64>();
                let deviation = |row: usize| coordinate(row, axis) - sum / weights;
                within += rows.iter().map(|&row| weight(row) * deviation(row).powi(2)).sum::<f64>();
            }
        }
        let repeated = AXES * (self.rows.len() - self.configurations.len());
        let within = (within / repeated.max(1) as f64)
            .clamp(MIN_NOISE_SHARE * relative_variance, relative_variance);
        let whole = sum_over(&|row, axis| coordinate(row, axis).powi(2)) / freedom;
        let independent = sum_over(&|row, _| within * relative(row).powi(2)) / coordinates;
        Hyperparameters::without_remainder(within.sqrt(), (whole - independent).max(0.0).sqrt())
    }
}
