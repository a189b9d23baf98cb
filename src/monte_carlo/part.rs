//! Parts of a study: what is done at a stretch, kept, and dealt out to machines.

use std::ops::Range;
use std::str::FromStr;

use super::plan::Campaign;

/// Repetitions in a part. What is kept is sums over parts, so another number rounds differently.
pub(super) const REPETITIONS: usize = 50;

/// Some repetitions of one cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Index of the cell.
    pub cell: usize,
    /// The repetitions, counted from 0.
    pub repetitions: Range<usize>,
}

impl Campaign {
    /// Every part, cell by cell.
    pub fn parts(&self) -> Vec<Part> {
        let of_cell = |cell| {
            let starts = (0..self.repetitions).step_by(REPETITIONS);
            starts.map(move |start| Part { cell, repetitions: start..self.repetitions.min(start + REPETITIONS) })
        };
        (0..self.cells.len()).flat_map(of_cell).collect()
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
