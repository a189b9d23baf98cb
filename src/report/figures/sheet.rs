//! Data of a figure as a table.

use super::pose::PoseError;
use crate::files::csv;
use crate::report::quantity::fixed;

/// Table of the data that a figure draws.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sheet {
    /// Column names with units.
    pub header: Vec<String>,
    /// Rows of the table.
    pub rows: Vec<Vec<String>>,
}

impl Sheet {
    pub fn new(header: &[&str], rows: Vec<Vec<String>>) -> Self {
        Self { header: header.iter().map(|&name| name.to_owned()).collect(), rows }
    }

    /// Creates a table of poses: file and line, true if held out, and additional columns.
    pub fn of_poses<'a>(
        columns: &[&str],
        rows: impl IntoIterator<Item = (&'a PoseError, Vec<f64>)>,
    ) -> Self {
        let header = [&["row", "held_out"], columns].concat();
        let cells = |(pose, values): (&PoseError, Vec<f64>)| {
            let pose = [pose.place.clone(), pose.held_out.to_string()];
            pose.into_iter().chain(values.into_iter().map(|value| fixed(value, 6))).collect()
        };
        Self::new(&header, rows.into_iter().map(cells).collect())
    }

    /// Returns the table as CSV text.
    pub fn csv(&self) -> String {
        csv(self.header.clone(), self.rows.iter().cloned())
    }
}
