//! Measurements together with their division into fitted and held-out rows.

use std::path::PathBuf;

use super::{ColumnTable, Measurements, Split};
use crate::error::{InputError, Warning};
use crate::problem::Problem;

/// Measured poses, and which of them are fitted and which only judge.
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
    /// Every row, in the order of the files or arrays.
    pub measurements: Measurements,
    /// Which rows are fitted and which are held out.
    pub split: Split,
}

impl Dataset {
    /// Measurements divided as given; the numbers in `split` are rows of `measurements`, each part
    /// in ascending order.
    pub fn new(measurements: Measurements, split: Split) -> Self {
        Self { measurements, split }
    }

    /// Measurements divided as the problem says (`held_out` of `[data]`, or their column `split`).
    ///
    /// # Errors
    /// An empty part, a session that nobody measured, no word on what is held out, or an unknown
    /// point, anchor or surface with too few rows to say more than where it is.
    pub fn of(problem: &Problem, measurements: Measurements) -> Result<Self, InputError> {
        measurements.enough_contacts(problem)?;
        let split = Split::new(problem, &measurements)?;
        Ok(Self { measurements, split })
    }

    /// The files that the problem names, divided as it says; and the columns that were passed over.
    ///
    /// # Errors
    /// The first mistake found in the files or in their division.
    pub fn read(problem: &Problem) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_files(&problem.data.files, problem)
    }

    /// As [`read`](Self::read), from other files than those that the problem names.
    ///
    /// # Errors
    /// The first mistake found in the files or in their division.
    pub fn read_files(
        files: &[PathBuf],
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        let (measurements, mut warnings) = Measurements::read(files, problem)?;
        warnings.extend(measurements.repeated_rows(problem.data.position_sigma));
        warnings.extend(measurements.time_going_back());
        Ok((Self::of(problem, measurements)?, warnings))
    }

    /// As [`read`](Self::read), from a table in memory.
    ///
    /// # Errors
    /// The first mistake found in the table or in its division.
    pub fn read_columns(
        table: ColumnTable,
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        let (measurements, mut warnings) = Measurements::read_columns(table, problem)?;
        warnings.extend(measurements.repeated_rows(problem.data.position_sigma));
        warnings.extend(measurements.time_going_back());
        Ok((Self::of(problem, measurements)?, warnings))
    }
}
