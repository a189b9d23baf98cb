//! Arguments for the region in which the target must stay, in mm.

use clap::Args;
use flexcal::design::{RegionError, Workspace};

use super::values;

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
