//! What a study asks for, as plain data in SI units, and the parts in which it is done.

use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;

use crate::fit::{SolverChoice, Strategy};
use crate::model::parameter::Parameter;
use crate::problem::Problem;
use crate::rig::Truth;

/// Repetitions in a part. What is kept is sums over parts, so another number rounds differently.
const REPETITIONS: usize = 50;

/// A study as declared in `STUDY.toml`.
#[derive(Debug, Clone)]
pub struct Study {
    /// The files that it was read from: its own, that of its problem, and that of its truth where
    /// it has one.
    pub files: Vec<PathBuf>,
    /// Short name; results go to `out/<name>` by default.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// The arm that is fitted.
    pub problem: Problem,
    /// Its free parameters.
    pub parameters: Vec<Parameter>,
    /// From what arms and poses are drawn; without noise.
    pub truth: Truth,
    /// Whether true strengths of declared effects are drawn from their priors, where the truth does
    /// not give them.
    pub draws_effects: bool,
    /// What measures.
    pub source: Source,
    /// Seed of every random number.
    pub seed: u64,
    /// Fits per cell.
    pub repetitions: usize,
    /// Poses per repetition that are held out.
    pub held_out: usize,
    /// Every combination of noise level, number of poses, strategy and solver, in this order.
    pub cells: Vec<Cell>,
    /// Text of the problem file: kept results belong to it to the letter.
    pub(super) problem_text: String,
}

/// What measures the true arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Source {
    /// The model that is fitted, at the true parameters: no error but noise.
    Model,
    /// The virtual test rig: independent physics, and effects that the model lacks.
    Rig,
}

/// What is fitted, to how many poses, under how much noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// 1 σ of a measured coordinate, in the measurements and as declared to the fit \[m\].
    pub sigma: f64,
    /// Poses to identify with.
    pub poses: usize,
    /// Which parameters are fitted together.
    pub strategy: Strategy,
    /// By which solver; never `auto`.
    pub solver: SolverChoice,
}

/// Some repetitions of one cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Index of the cell.
    pub cell: usize,
    /// The repetitions, counted from 0.
    pub repetitions: Range<usize>,
}

impl Study {
    /// Every part, cell by cell.
    pub fn parts(&self) -> Vec<Part> {
        let of_cell = |cell| {
            let starts = (0..self.repetitions).step_by(REPETITIONS);
            starts.map(move |start| Part {
                cell,
                repetitions: start..self.repetitions.min(start + REPETITIONS),
            })
        };
        (0..self.cells.len()).flat_map(of_cell).collect()
    }
}

impl Source {
    /// Word in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Model => "model",
            Self::Rig => "rig",
        }
    }
}

/// One machine's share of the parts: every n-th of them, so that each has some of every cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

/// Not a shard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("write i/n: share i of n, counted from 1")]
pub struct ShardError;

impl Shard {
    /// Everything.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Share `index` of `count`, counted from 1; `None` outside of 1..=`count`.
    pub fn new(index: usize, count: usize) -> Option<Self> {
        (1..=count).contains(&index).then_some(Self { index, count })
    }

    /// Whether the part with this index is in the share.
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
