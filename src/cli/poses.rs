//! Arguments for the source of poses that are to be measured.

use std::path::PathBuf;

use clap::Args;
use flexcal::design::DesignError;
use flexcal::error::InputError;
use flexcal::measurement::Measurements;
use flexcal::problem::{PoseRanges, Problem};
use flexcal::rig::Truth;

use super::flags::{Flags, file_in};

/// Arguments for the ranges in which poses are drawn, or for tables of poses.
#[derive(Debug, Args)]
pub struct Source {
    /// Tables of poses to take, with the columns of measurements; positions are not needed
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    pub candidates: Vec<PathBuf>,
    /// Ranges of the poses: [poses] of this file or of the one in this folder, instead of the
    /// limits of the joints (min_deg, max_deg)
    #[arg(long, value_name = "TRUTH.toml")]
    pub truth: Option<PathBuf>,
    /// Seed of every random number
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}

impl Source {
    /// Returns the files that the arguments name: tables of candidates, and TRUTH.toml.
    pub fn files(&self) -> Vec<PathBuf> {
        let truth = self.truth.iter().map(|truth| file_in(truth, "TRUTH.toml"));
        self.candidates.iter().cloned().chain(truth).collect()
    }

    /// Reads the tables of candidates as one table; `None` if none is named.
    pub fn table(
        &self,
        problem: &Problem,
        flags: &Flags,
    ) -> Result<Option<Measurements>, InputError> {
        if self.candidates.is_empty() {
            return Ok(None);
        }
        let (poses, warnings) = Measurements::read_poses(&self.candidates, problem)?;
        flags.warn(&warnings);
        Ok(Some(poses))
    }

    /// Returns the ranges of all quantities of a pose, from TRUTH.toml or from the joint limits.
    /// Returns an error if a limit is missing.
    pub fn all_ranges(&self, problem: &Problem) -> Result<PoseRanges, DesignError> {
        let Some(file) = &self.truth else { return PoseRanges::of(problem) };
        Ok(Truth::read_ranges(file, problem)?)
    }

    /// Returns the ranges of a pose without the temperature and the approach directions if no
    /// declared effect depends on them.
    pub fn ranges(&self, problem: &Problem) -> Result<PoseRanges, DesignError> {
        Ok(self.all_ranges(problem)?.relevant_to(problem))
    }

    /// Returns the ranges of all quantities of a pose; `None` if a joint limit is missing. A
    /// TRUTH.toml that is named must be valid.
    pub fn known_ranges(&self, problem: &Problem) -> Result<Option<PoseRanges>, DesignError> {
        match self.all_ranges(problem) {
            Err(DesignError::NoRange(_)) => Ok(None),
            other => other.map(Some),
        }
    }
}
