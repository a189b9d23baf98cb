//! Declaration of a study in SI units, and its division into parts.

use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;

use crate::fit::{SolverChoice, Strategy};
use crate::model::parameter::Parameter;
use crate::problem::Problem;
use crate::rig::Truth;

/// Maximum number of repetitions in a part. Statistics are summed part by part, so another number
/// would change their rounding.
const PART_REPETITIONS: usize = 50;

/// Monte Carlo study as declared in `STUDY.toml`.
#[derive(Debug, Clone)]
pub struct Study {
    /// Files that the study was read from: study, problem, and truth if it has a file.
    pub files: Vec<PathBuf>,
    /// Short name; results are written to `out/<name>` by default.
    pub name: String,
    /// Title in results, one line.
    pub title: String,
    /// Problem that is fitted.
    pub problem: Problem,
    /// Free parameters of the problem.
    pub parameters: Vec<Parameter>,
    /// Distribution of true arms and poses, without noise.
    pub truth: Truth,
    /// True if the true values of declared effects are drawn from their priors unless the truth
    /// states them.
    pub draws_effects: bool,
    /// Source of the simulated measurements.
    pub source: Source,
    /// Seed of every random number.
    pub seed: u64,
    /// Number of fits per cell.
    pub repetitions: usize,
    /// Number of held-out poses per repetition.
    pub held_out: usize,
    /// All combinations of noise level, number of poses, strategy and solver. The solver varies
    /// fastest, the noise level slowest.
    pub cells: Vec<Cell>,
    /// Text of the problem file, from which the key of a finished part is computed, too.
    pub(super) problem_text: String,
}

worded! {
    /// Source of the simulated measurements.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Source: as_str {
        /// The fitted model at the true parameters, so that noise is the only error.
        Model = "model";
        /// The virtual test rig, with independent physics and effects that the model may lack.
        Rig = "rig";
    }
}

/// Combination of noise level, number of poses, strategy and solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Standard deviation of the noise of a measured coordinate, which is also declared to the fit
    /// \[m\].
    pub sigma: f64,
    /// Number of identification poses.
    pub poses: usize,
    /// Strategy: the parameters that are fitted together.
    pub strategy: Strategy,
    /// Solver of the fits; never `auto`.
    pub solver: SolverChoice,
}

/// Range of repetitions of one cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Index of the cell.
    pub cell: usize,
    /// Repetitions, counted from 0.
    pub repetitions: Range<usize>,
}

impl Study {
    /// Divides the study into parts, cell by cell.
    pub fn parts(&self) -> Vec<Part> {
        let of_cell = |cell| {
            let starts = (0..self.repetitions).step_by(PART_REPETITIONS);
            starts.map(move |start| Part {
                cell,
                repetitions: start..self.repetitions.min(start + PART_REPETITIONS),
            })
        };
        (0..self.cells.len()).flat_map(of_cell).collect()
    }
}

/// Subset of the parts that one of `count` machines computes: every `count`-th part, so that each
/// machine has parts of every cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Number of the machine, from 1 to `count`.
    index: usize,
    count: usize,
}

/// Error of a text that is not a shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("write i/n: share i of n, counted from 1")]
pub struct ShardError;

impl Shard {
    /// Shard that contains every part.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Creates shard `index` of `count`, counted from 1; `None` outside 1..=`count`.
    pub fn new(index: usize, count: usize) -> Option<Self> {
        (1..=count).contains(&index).then_some(Self { index, count })
    }

    /// Returns true if the part with this index, from 0, belongs to the shard.
    pub fn holds(self, part: usize) -> bool {
        part % self.count == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let (index, count) = text.split_once('/').ok_or(ShardError)?;
        let number = |text: &str| text.parse().map_err(|_| ShardError);
        Self::new(number(index)?, number(count)?).ok_or(ShardError)
    }
}
