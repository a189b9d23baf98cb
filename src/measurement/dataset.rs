//! Measurements together with their split into fitted and held-out rows.

use std::path::PathBuf;

use super::{ColumnTable, Measurements, Split};
use crate::error::{InputError, InputErrorKind, Location, Warning};
use crate::problem::pattern::matches;
use crate::problem::{Freedom, Problem};

/// Maximum number of sessions whose bases are fitted. They take some ten seconds; covariances and
/// correlations of all parameters grow with the square of their number.
pub(crate) const MAX_FITTED_BASES: usize = 150;
/// Maximum number of sessions or targets whose tools are fitted. A tool has half as many parameters
/// as a base.
const MAX_FITTED_TOOLS: usize = 500;

/// Measured poses with their split into fitted rows and held-out rows, which are only used to judge
/// the fit.
///
/// ```
/// use flexcal::measurement::Dataset;
/// use flexcal::nalgebra::Vector3;
///
/// let configurations = [[0.0, 0.5], [0.3, -0.2], [1.0, 0.1]];
/// let positions = [Vector3::new(0.9, 0.2, 0.0), Vector3::new(0.95, 0.2, 0.0), Vector3::new(0.5, 0.8, 0.0)];
/// let data = Dataset::builder(configurations, positions).temperature(vec![20.0, 21.5, 19.0]).held_out([2]).build()?;
/// assert_eq!((data.split.identification, data.split.held_out), (vec![0, 1], vec![2]));
/// # Ok::<(), flexcal::measurement::DatasetError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Dataset {
    /// All rows in the order of the files or arrays.
    pub measurements: Measurements,
    /// Fitted rows and held-out rows.
    pub split: Split,
}

/// Checks that not too many bases or tools are fitted.
fn check_setups(problem: &Problem, measurements: &Measurements) -> Result<(), InputError> {
    // The last rule that matches a parameter applies.
    let is_fitted = |name: &str| {
        ["x", "y", "z", "rx", "ry", "rz"].iter().any(|axis| {
            let parameter = format!("{name}.{axis}");
            let mut rules = problem.parameters.iter().rev();
            let rule = rules.find(|rule| matches(&rule.pattern, &parameter));
            rule.is_some_and(|rule| !matches!(rule.freedom, Freedom::Fixed))
        })
    };
    let sessions = measurements.session.names.len();
    let (tools, targets) = match &measurements.target {
        Some(target) => ("targets, each with a tool of its own", target.names.len()),
        None => ("sessions, each with a tool of its own", sessions),
    };
    for (parameters, what, found, most) in [
        ("base", "sessions, each with a base of its own", sessions, MAX_FITTED_BASES),
        ("tool", tools, targets, MAX_FITTED_TOOLS),
    ] {
        if found > most && is_fitted(parameters) {
            let kind = InputErrorKind::TooMany { what, found, most };
            let file = measurements.files.first().cloned().unwrap_or_default();
            return Err(Location::file(&file).error(kind));
        }
    }
    Ok(())
}

impl Dataset {
    /// Creates a data set from measurements and a split.
    #[doc(hidden)]
    pub fn new(measurements: Measurements, split: Split) -> Self {
        Self { measurements, split }
    }

    /// Splits measurements as the problem declares (`held_out` of `[data]`, or the column `split`).
    ///
    /// # Errors
    /// Returns an error if a part of the split is empty, the held-out session does not exist, or no
    /// split is declared. It also returns an error if a fixture at an unknown position has too few
    /// rows to contribute information, or if too many bases or tools would be fitted.
    #[doc(hidden)]
    pub fn from_measurements(
        problem: &Problem,
        measurements: Measurements,
    ) -> Result<Self, InputError> {
        check_setups(problem, &measurements)?;
        measurements.check_contacts(problem)?;
        let split = Split::new(problem, &measurements)?;
        Ok(Self { measurements, split })
    }

    /// Reads the files of the problem and splits their rows; also returns warnings, for example
    /// about ignored columns.
    ///
    /// # Errors
    /// Returns the first error in the files or in the split.
    pub fn read(problem: &Problem) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_files(&problem.data.files, problem)
    }

    /// Reads other files than those of the problem; see [`read`](Self::read).
    ///
    /// # Errors
    /// Returns the first error in the files or in the split.
    pub fn read_files(
        files: &[PathBuf],
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        let (measurements, mut warnings) = Measurements::read(files, problem)?;
        warnings.extend(measurements.row_warnings(problem));
        Ok((Self::from_measurements(problem, measurements)?, warnings))
    }

    /// Reads a table in memory; see [`read`](Self::read).
    ///
    /// # Errors
    /// Returns the first error in the table or in the split.
    #[doc(hidden)]
    pub fn read_columns(
        table: ColumnTable,
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        let (measurements, mut warnings) = Measurements::read_columns(table, problem)?;
        warnings.extend(measurements.row_warnings(problem));
        Ok((Self::from_measurements(problem, measurements)?, warnings))
    }
}
