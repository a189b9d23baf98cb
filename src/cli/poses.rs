//! Arguments for the source of poses that are to be measured, and for the region in which the target
//! must stay.

use std::path::PathBuf;

use clap::Args;
use flexcal::design::{DesignError, RegionError, Workspace};
use flexcal::error::InputError;
use flexcal::measurement::Measurements;
use flexcal::problem::{PoseRanges, Problem};
use flexcal::rig::Truth;

use super::flags::{Flags, file_in};
use super::values;

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

/// Arguments for the box and the half-spaces in which the nominal target must stay.
#[derive(Debug, Args)]
pub struct Region {
    /// Box that the nominal target stays in, frame of the arm's base
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = values::numbers::<6>, allow_hyphen_values = true)]
    workspace_mm: Option<[f64; 6]>,
    /// Plane that the nominal target stays beyond, frame of the arm's base: N·p ≥ D for a normal N
    #[arg(long, value_name = "NX,NY,NZ,D", value_parser = values::numbers::<4>, allow_hyphen_values = true)]
    keep_out_mm: Vec<[f64; 4]>,
}

/// Error of region arguments that are invalid.
#[derive(Debug, thiserror::Error)]
#[error("--workspace-mm, --keep-out-mm: {0}")]
pub struct RegionArgumentError(#[from] RegionError);

impl Region {
    /// Converts the region from mm to m; `None` if no argument restricts it.
    pub fn workspace(&self) -> Result<Option<Workspace>, RegionArgumentError> {
        Ok(Workspace::from_mm(self.workspace_mm, &self.keep_out_mm)?)
    }

    /// Formats the arguments of the region as they are given on the command line.
    pub fn words(&self) -> Vec<String> {
        let listed =
            |numbers: &[f64]| numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        let corners = self.workspace_mm.iter().map(|of| format!("--workspace-mm={}", listed(of)));
        let planes = self.keep_out_mm.iter().map(|of| format!("--keep-out-mm={}", listed(of)));
        corners.chain(planes).collect()
    }
}
