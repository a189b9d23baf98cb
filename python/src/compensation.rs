//! Commands that bring an identified arm to targets.

use std::path::Path;
use std::sync::Arc;

use flexcal::design::rivals;
use flexcal::fit::{SavedEstimate, missing_target_columns};
use flexcal::measurement::Measurements;
use flexcal::problem::Problem;
use flexcal::remainder::{self, CompensationError, Correction, TargetFrame};
use flexcal::report::{self, Doubts};
use flexcal::results::{CompensationResult, Document as _, commands_csv};
use pyo3::prelude::*;

use crate::data::{Poses, Source};
use crate::error::{of_argument, raised};
use crate::pool::detached;

/// Commands for a table of targets.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Compensation {
    problem: Problem,
    found: remainder::Compensation,
    /// Remarks on the targets.
    #[pyo3(get)]
    warnings: Vec<String>,
}

#[pymethods]
impl Compensation {
    /// Returns the result that `flexcal compensate --json` prints.
    fn json(&self) -> String {
        let result = CompensationResult::new(&self.problem, &self.found.commands)
            .with_uncorrected(&self.found.uncorrected);
        match &self.found.bounds {
            Some(bounds) => result.with_bounds(bounds).to_json(),
            None => result.to_json(),
        }
    }

    /// Returns the text that the command line prints.
    fn summary(&self) -> String {
        let remainder::Compensation { targets, commands, bounds, .. } = &self.found;
        report::commands_text(&self.problem, targets, commands, bounds.as_ref())
    }

    /// Returns commands.csv.
    fn csv(&self) -> String {
        let remainder::Compensation { targets, commands, bounds, .. } = &self.found;
        commands_csv(&self.problem, targets, commands, bounds.as_ref())
    }
}

/// Returns the argument that chooses a frame.
fn frame_argument(frame: TargetFrame) -> String {
    let name = match frame {
        TargetFrame::Measuring => "measuring",
        TargetFrame::Base => "base",
    };
    format!("frame=\"{name}\"")
}

impl Compensation {
    /// Finds commands for targets with the estimate.json `estimate` and its correction.
    pub fn new(
        py: Python<'_>,
        problem: &Problem,
        (estimate, correction): (&str, Option<&Correction>),
        source: Source,
        (frame, level): (&str, f64),
    ) -> PyResult<Self> {
        let frame = match frame {
            "measuring" => TargetFrame::Measuring,
            "base" => TargetFrame::Base,
            _ => {
                let message = format!("frame: \"{frame}\" is none of measuring, base");
                return Err(of_argument("frame", message));
            }
        };
        if !(0.0 < level && level < 1.0) {
            let message = "level: a probability between 0 and 1 is needed".to_owned();
            return Err(of_argument("level", message));
        }
        let input = source.owned()?;
        let mut problem = problem.clone();
        // Every row is a target.
        problem.data.held_out = None;
        let poses = detached(py, || Poses::read(input, &problem))?;
        let Poses { rows, mut warnings } = poses.map_err(|error| raised(&error))?;
        let missing = missing_target_columns(&problem, &rows);
        let text =
            |missing| format!("{missing}; the commands neglect the effects that depend on it");
        warnings.extend(missing.iter().map(text));
        let estimate = SavedEstimate::parse(estimate, Path::new("estimate.json"))
            .map_err(|error| raised(&error))?;
        warnings.extend(estimate.doubted_bounds.clone());
        let rivals = rivals(&problem).unwrap_or_else(|error| {
            warnings.push(format!("{error}; what the loop did not decide is not in the bounds"));
            Vec::new()
        });
        let found = detached(py, || {
            let targets = Arc::unwrap_or_clone(rows);
            let fitted = (&estimate, correction, rivals.as_slice());
            let solve = |targets: Measurements, frame: TargetFrame| {
                remainder::Compensation::new(&problem, fitted, targets, frame, level)
            };
            let found = solve(targets.clone(), frame)?;
            let as_given = (&targets, frame, found.commands.as_slice());
            let doubts = Doubts::new(&problem, as_given, frame_argument, |targets, frame| {
                solve(targets, frame).ok().map(|found| found.commands)
            });
            Ok((found, doubts))
        })?;
        let (found, Doubts { misplaced, others }) =
            found.map_err(|error: CompensationError| raised(&error))?;
        warnings.extend(misplaced.into_iter().chain(others));
        let undecided = report::undecided_commands(&found, &rivals).map(|(said, _)| said);
        warnings.extend(report::uncorrected_commands(&found, undecided.is_some()));
        warnings.extend(undecided);
        let unreached: Vec<usize> =
            found.commands.iter().filter(|of| !of.is_reached()).map(|of| of.row).collect();
        if let [first, ..] = unreached.as_slice() {
            warnings.push(format!(
                "{} of {} targets are out of reach, the first in row {} of the targets: their commands \
                 are NaN",
                unreached.len(),
                found.commands.len(),
                first + 1
            ));
        }
        if found.is_base_open {
            warnings.push(
                "the estimate does not know where the arm's base is in the measuring frame, so targets \
                 in that frame are reached as far as it happens to be assumed; frame=\"base\" takes them \
                 in the frame of the base"
                    .to_owned(),
            );
        }
        Ok(Self { problem, found, warnings })
    }
}
