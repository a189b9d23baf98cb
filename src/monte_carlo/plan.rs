//! What a study asks for, as plain data in SI units.

use std::path::Path;

use super::read;
use crate::error::InputError;
use crate::identify::{SolverChoice, Strategy};
use crate::model::parameter::Parameter;
use crate::problem::Problem;
use crate::simulate::Truth;

/// A study as declared in `STUDY.toml`.
#[derive(Debug, Clone)]
pub struct Campaign {
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
pub enum Source {
    /// The model that is fitted, at the true parameters: no error but noise.
    Model,
    /// The virtual test rig: independent physics, and effects that the model lacks.
    Rig,
}

/// What is fitted, to how many poses, under how much noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// 1 σ of a measured coordinate, in the measurements and as declared to the fit [m].
    pub sigma: f64,
    /// Poses to identify with.
    pub poses: usize,
    /// Which parameters are fitted together.
    pub strategy: Strategy,
    /// By which solver; never `auto`.
    pub solver: SolverChoice,
}

impl Campaign {
    /// Reads a study; `path` is its file, or the folder that holds a `STUDY.toml`.
    ///
    /// # Errors
    /// The first mistake found, in it or in the files that it names; a file that cannot be read among them.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        read::file(path)
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
