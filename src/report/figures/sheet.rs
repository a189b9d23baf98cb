//! The numbers of a figure, for other programs.

use super::pose::PoseError;
use crate::files::csv;
use crate::report::quantity::fixed;

/// A table of what a figure shows.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sheet {
    /// Names of the columns, each with its unit.
    pub header: Vec<String>,
    /// Its rows.
    pub rows: Vec<Vec<String>>,
}

impl Sheet {
    pub fn new(header: &[&str], rows: Vec<Vec<String>>) -> Self {
        Self { header: header.iter().map(|&name| name.to_owned()).collect(), rows }
    }

    /// Of poses: the file and line of each, whether it was held out, and further columns.
    pub fn of_poses<'a>(
        further: &[&str],
        rows: impl IntoIterator<Item = (&'a PoseError, Vec<f64>)>,
    ) -> Self {
        let header = [&["row", "held_out"], further].concat();
        let cells = |(pose, values): (&PoseError, Vec<f64>)| {
            let own = [pose.place.clone(), pose.held_out.to_string()];
            own.into_iter().chain(values.into_iter().map(|value| fixed(value, 6))).collect()
        };
        Self::new(&header, rows.into_iter().map(cells).collect())
    }

    /// As CSV.
    pub fn csv(&self) -> String {
        csv(self.header.clone(), self.rows.iter().cloned())
    }
}
