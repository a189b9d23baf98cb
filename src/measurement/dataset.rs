//! Measurements together with their split into fitted and held-out rows.

use std::path::PathBuf;

use super::{ColumnTable, Measurements, Split};
use crate::error::{InputError, Warning};
use crate::problem::Problem;

/// Measured poses with their split into fitted rows and held-out rows, which only judge the fit.
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

impl Dataset {
    /// Creates a data set from measurements and a split; `split` holds row numbers in ascending
    /// order.
    #[doc(hidden)]
    pub fn new(measurements: Measurements, split: Split) -> Self {
        Self { measurements, split }
    }

    /// Splits measurements as the problem declares (`held_out` of `[data]`, or the column `split`).
    ///
    /// # Errors
    /// Returns an error if a part of the split is empty, the held-out session does not exist, or no
    /// split is declared. Also if an unknown point, anchor or surface has too few rows to
    /// contribute information.
    #[doc(hidden)]
    pub fn from_measurements(
        problem: &Problem,
        measurements: Measurements,
    ) -> Result<Self, InputError> {
        measurements.enough_contacts(problem)?;
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
        warnings.extend(measurements.repeated_rows(problem.data.position_sigma));
        warnings.extend(measurements.time_going_back());
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
        warnings.extend(measurements.repeated_rows(problem.data.position_sigma));
        warnings.extend(measurements.time_going_back());
        Ok((Self::from_measurements(problem, measurements)?, warnings))
    }
}
