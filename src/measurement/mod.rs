//! Measured poses, as columns in SI units.

mod builder;
#[deny(clippy::indexing_slicing)]
mod column_table;
#[deny(clippy::indexing_slicing)]
mod columns;
mod dataset;
#[deny(clippy::indexing_slicing)]
mod duplicates;
#[deny(clippy::indexing_slicing)]
mod limits;
#[deny(clippy::indexing_slicing)]
mod lines;
#[deny(clippy::indexing_slicing)]
mod read;
mod repeats;
mod split;
#[deny(clippy::indexing_slicing)]
mod table;

use std::collections::HashMap;
use std::path::PathBuf;

use nalgebra::Vector3;

use crate::error::{Location, Warning};

pub use builder::{DatasetBuilder, DatasetError};
pub use column_table::{ColumnTable, ColumnValues};
pub use dataset::Dataset;
pub(crate) use repeats::different;
pub use split::Split;

/// Measured poses, a column for each quantity, in the order of the files.
#[derive(Debug, Clone)]
pub struct Measurements {
    /// The files that were read.
    pub files: Vec<PathBuf>,
    /// File index and line of each row, for messages.
    pub origin: Vec<(u32, u32)>,
    /// Number of joints of the arm, fixed ones included.
    pub joints: usize,
    /// Configurations, shape = (rows, joints), row after row \[rad\] or \[m\]; 0 at fixed joints.
    pub configurations: Vec<f64>,
    /// Measured positions in the measuring frame \[m\].
    pub positions: Vec<Vector3<f64>>,
    /// 1 σ of each coordinate from the column `sigma_mm` \[m\].
    pub sigma: Option<Vec<f64>>,
    /// Payload \[kg\].
    pub payload: Option<Vec<f64>>,
    /// Hoist force \[N\].
    pub hoist: Option<Vec<f64>>,
    /// Temperature [°C].
    pub temperature: Option<Vec<f64>>,
    /// Time \[s\]; the row's order where there is no column.
    pub time: Vec<f64>,
    /// Whether `time` was measured, not counted.
    pub time_measured: bool,
    /// Direction from which each joint came, −1, 0 or +1, shape = (rows, joints); 0 at joints without a column.
    pub approach: Option<Vec<f64>>,
    /// Number of each pose from the column `pose`, where every row has one and it is a number.
    pub pose: Option<Vec<f64>>,
    /// Session of each row; one unnamed label where there is no column.
    pub session: Labels,
    /// Target of each row; `None` where there is no column.
    pub target: Option<Labels>,
    /// Whether the row is marked `validation`: in the column that the problem names, or in `split` where it says nothing.
    pub marked_held_out: Option<Vec<bool>>,
    /// What was passed over in the files, for reports.
    pub warnings: Vec<Warning>,
}

/// A word per row, stored as an index into the distinct words in order of appearance.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Labels {
    /// Distinct words.
    pub names: Vec<String>,
    /// Word of each row.
    pub of_row: Vec<usize>,
}

/// Words of the rows in order.
impl<W: AsRef<str>> FromIterator<W> for Labels {
    fn from_iter<I: IntoIterator<Item = W>>(words: I) -> Self {
        let mut labels = Self::default();
        let mut known = HashMap::new();
        for word in words {
            let word = word.as_ref();
            let place = *known.entry(word.to_owned()).or_insert_with(|| {
                labels.names.push(word.to_owned());
                labels.names.len() - 1
            });
            labels.of_row.push(place);
        }
        labels
    }
}

impl Measurements {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// File and line of a row, for messages.
    pub fn location(&self, row: usize) -> Location {
        let (file, line) = self.origin[row];
        Location::file(&self.files[file as usize]).at_line(line as usize)
    }

    /// Configuration of a row, shape = (joints) \[rad\] or \[m\].
    pub fn configuration(&self, row: usize) -> &[f64] {
        &self.configurations[row * self.joints..(row + 1) * self.joints]
    }

    /// The rows with these numbers, in this order; words that none of them uses are kept.
    #[must_use]
    pub fn select(&self, rows: &[usize]) -> Self {
        let one = |column: &[f64]| rows.iter().map(|&row| column[row]).collect::<Vec<f64>>();
        let each = |column: &[f64]| {
            rows.iter().flat_map(|&row| &column[row * self.joints..(row + 1) * self.joints]).copied().collect()
        };
        let words = |labels: &Labels| Labels {
            names: labels.names.clone(),
            of_row: rows.iter().map(|&row| labels.of_row[row]).collect(),
        };
        Self {
            files: self.files.clone(),
            origin: rows.iter().map(|&row| self.origin[row]).collect(),
            joints: self.joints,
            configurations: each(&self.configurations),
            positions: rows.iter().map(|&row| self.positions[row]).collect(),
            sigma: self.sigma.as_deref().map(one),
            payload: self.payload.as_deref().map(one),
            hoist: self.hoist.as_deref().map(one),
            temperature: self.temperature.as_deref().map(one),
            time: one(&self.time),
            time_measured: self.time_measured,
            approach: self.approach.as_deref().map(each),
            pose: self.pose.as_deref().map(one),
            session: words(&self.session),
            target: self.target.as_ref().map(words),
            marked_held_out: self.marked_held_out.as_ref().map(|marked| rows.iter().map(|&row| marked[row]).collect()),
            warnings: self.warnings.clone(),
        }
    }

    /// These rows, then those of a table with the same columns and words.
    #[must_use]
    pub(crate) fn and(&self, other: &Self) -> Self {
        let joined = |own: &[f64], other: &[f64]| [own, other].concat();
        let both = |own: &Option<Vec<f64>>, other: &Option<Vec<f64>>| Some(joined(own.as_ref()?, other.as_ref()?));
        let mut all = self.clone();
        all.origin.extend(&other.origin);
        all.configurations.extend(&other.configurations);
        all.positions.extend(&other.positions);
        all.sigma = both(&self.sigma, &other.sigma);
        all.payload = both(&self.payload, &other.payload);
        all.hoist = both(&self.hoist, &other.hoist);
        all.temperature = both(&self.temperature, &other.temperature);
        all.time.extend(&other.time);
        all.approach = both(&self.approach, &other.approach);
        all.pose = both(&self.pose, &other.pose);
        all.session.of_row.extend(&other.session.of_row);
        all
    }
}
