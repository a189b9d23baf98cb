//! Where poses that are still to be measured come from.

use std::path::PathBuf;

use clap::Args;
use flexcal::design::{DesignError, Ranges};
use flexcal::error::InputError;
use flexcal::measurement::Measurements;
use flexcal::problem::{Effect, Problem};
use flexcal::rig::Truth;

use super::diagnostic;

/// Ranges or a table.
#[derive(Debug, Args)]
pub struct Source {
    /// Tables of poses to take, with the columns of measurements; positions are not needed
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    pub candidates: Vec<PathBuf>,
    /// Where poses may lie: [poses] of this file, instead of the limits of the joints (min_deg, max_deg)
    #[arg(long, value_name = "TRUTH.toml")]
    pub truth: Option<PathBuf>,
    /// Seed of every random number
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}

impl Source {
    /// The table of candidates, if one is named.
    pub fn table(&self, problem: &Problem, quiet: bool) -> Result<Option<Measurements>, InputError> {
        if self.candidates.is_empty() {
            return Ok(None);
        }
        let (poses, warnings) = Measurements::read_poses(&self.candidates, problem)?;
        if !quiet {
            diagnostic::print_warnings(&warnings);
        }
        Ok(Some(poses))
    }

    /// Where poses may lie.
    pub fn ranges(&self, problem: &Problem) -> Result<Ranges, DesignError> {
        let Some(file) = &self.truth else { return Ranges::of(problem) };
        let poses = Truth::read(file, problem)?.poses;
        // What no declared effect depends on need not be set.
        let declared = |matters: fn(&Effect) -> bool| problem.effects.iter().any(|own| matters(&own.effect));
        let thermal = declared(|effect| {
            matches!(
                effect,
                Effect::JointThermalDrift { .. }
                    | Effect::LinkThermalBending { .. }
                    | Effect::LinkThermalExpansion { .. }
            )
        });
        let sided = declared(|effect| matches!(effect, Effect::Backlash { .. }));
        Ok(Ranges {
            joints: poses.joints,
            payloads: poses.payloads,
            hoist: poses.hoist,
            temperature: poses.temperature.filter(|_| thermal),
            approach: poses.approach && sided,
        })
    }

    /// The same, if it is known: a TRUTH.toml that is named must be right, limits may be missing.
    pub fn known_ranges(&self, problem: &Problem) -> Result<Option<Ranges>, DesignError> {
        match self.ranges(problem) {
            Err(DesignError::NoRange { .. }) => Ok(None),
            other => other.map(Some),
        }
    }
}
