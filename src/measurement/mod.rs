//! Measured poses, as columns in SI units.

mod builder;
#[deny(clippy::indexing_slicing)]
mod cells;
#[deny(clippy::indexing_slicing)]
mod column_table;
#[deny(clippy::indexing_slicing)]
mod columns;
mod dataset;
#[deny(clippy::indexing_slicing)]
mod dialect;
#[deny(clippy::indexing_slicing)]
mod duplicates;
#[deny(clippy::indexing_slicing)]
mod labels;
mod limits;
#[deny(clippy::indexing_slicing)]
mod lines;
#[deny(clippy::indexing_slicing)]
mod mapped;
#[deny(clippy::indexing_slicing)]
mod observed;
mod order;
#[deny(clippy::indexing_slicing)]
mod orientation;
#[deny(clippy::indexing_slicing)]
mod read;
mod repeats;
#[deny(clippy::indexing_slicing)]
mod role;
mod settled;
mod split;
#[deny(clippy::indexing_slicing)]
mod table;
#[deny(clippy::indexing_slicing)]
mod time;

use std::collections::HashMap;
use std::path::PathBuf;

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::{Location, Warning};
use crate::problem::{Observation, PastOf, PoseConditions, PoseView, Problem};

pub use builder::{DatasetBuilder, DatasetError};
pub use column_table::{ColumnTable, ColumnValues};
pub use dataset::Dataset;
pub use order::RowOrder;
pub(crate) use repeats::different;
pub use split::Split;

/// Measured poses, a column for each quantity, in the order of the files.
#[derive(Debug, Clone, Default)]
pub struct Measurements {
    /// The files that were read.
    pub files: Vec<PathBuf>,
    /// File index and line of each row, for messages.
    pub origin: Vec<(u32, u32)>,
    /// Number of joints of the arm, fixed ones included.
    pub joints: usize,
    /// Configurations, shape = (rows, joints), row after row \[rad\] or \[m\]; 0 at fixed joints.
    pub configurations: Vec<f64>,
    /// The same from the other of commands and readings, where the table has both.
    pub other_configurations: Option<Vec<f64>>,
    /// Fixed points that were measured in between; they take no part in fits.
    pub nests: Vec<NestReading>,
    /// What each row measures; empty where all of them measure positions.
    pub observations: Vec<Observation>,
    /// The measured numbers of each row, zeros behind them \[m\]: positions in the measuring frame,
    /// distances, 0 of a contact.
    pub positions: Vec<Vector3<f64>>,
    /// Whether they were measured; 0 otherwise, in poses that are still to be measured.
    pub position_measured: bool,
    /// Unit of the positions in the first file in SI: 1/1000 for millimetres; `None` where they
    /// came from no file.
    pub position_unit: Option<f64>,
    /// Measured orientations of the target in the measuring frame, where there are all of their
    /// columns; NaN in a row without one.
    pub orientations: Option<Vec<UnitQuaternion<f64>>>,
    /// 1 σ of each coordinate from the column `sigma_mm`, or of the row's kind where there are
    /// several; NaN where it is not known \[m\].
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
    /// Direction from which each joint came, −1, 0 or +1, shape = (rows, joints); 0 at joints
    /// without a column.
    pub approach: Option<Vec<f64>>,
    /// Values of the problem's own covariates, in their order and units, shape = (rows,
    /// covariates); empty where there are none.
    pub covariates: Vec<f64>,
    /// Number of each pose from the column `pose`, where every row has one and it is a number.
    pub pose: Option<Vec<f64>>,
    /// Name of each pose from that column, where every row has one and not all are numbers.
    pub pose_names: Option<Labels>,
    /// Session of each row; one unnamed label where there is no column.
    pub session: Labels,
    /// Target of each row; `None` where there is no column.
    pub target: Option<Labels>,
    /// Whether the row is marked `validation`: in the column that the problem names, or in `split`
    /// where it says nothing.
    pub marked_held_out: Option<Vec<bool>>,
    /// How the first file writes the commands, a column a joint; none where they came from no file.
    pub command_columns: Vec<CommandColumn>,
    /// What was passed over in the files, for reports.
    pub warnings: Vec<Warning>,
    /// In which order the rows were measured: found when it is first asked for, so rows change
    /// before that or in a copy.
    pub order: RowOrder,
}

/// A fixed point that was measured again, to see whether the instrument stayed.
#[derive(Debug, Clone, PartialEq)]
pub struct NestReading {
    /// File index and line, for messages.
    pub origin: (u32, u32),
    /// Which point.
    pub name: String,
    /// Measured position, measuring frame \[m\].
    pub position: Vector3<f64>,
    /// Time \[s\], where there is a column for it.
    pub time: Option<f64>,
    /// Number of rows of the arm before it: what stands for the time where that is counted.
    pub after: usize,
    /// Session, empty where there is no column for it.
    pub session: String,
    /// 1 σ of each coordinate, where there is a column for it \[m\].
    pub sigma: Option<f64>,
}

/// A column of a joint's commands as a table has it.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandColumn {
    /// Joint, counted from 0.
    pub joint: usize,
    /// Its name in the table.
    pub name: String,
    /// Its unit in SI: π/180 for degrees.
    pub unit: f64,
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

    /// What a row measures.
    pub fn observation(&self, row: usize) -> Observation {
        self.observations.get(row).copied().unwrap_or_default()
    }

    /// What rows measure, one observation of each kind that there is, positions first.
    pub fn kinds(&self) -> Vec<Observation> {
        let mut kinds: Vec<Observation> =
            (0..self.len()).map(|row| self.observation(row)).collect();
        kinds.sort_unstable();
        kinds.dedup_by_key(|own| own.kind());
        kinds
    }

    /// The first of them: what errors are told of.
    pub fn leading(&self) -> Observation {
        self.kinds().first().copied().unwrap_or_default()
    }

    /// The orientation of a row that has one, measuring frame.
    pub fn orientation(&self, row: usize) -> Option<&UnitQuaternion<f64>> {
        self.orientations.as_ref().map(|all| &all[row]).filter(|own| !own.w.is_nan())
    }

    /// 1 σ of a row that has one of its own \[m\].
    pub fn sigma_of(&self, row: usize) -> Option<f64> {
        self.sigma.as_ref().map(|all| all[row]).filter(|sigma| !sigma.is_nan())
    }

    /// Whether every row has a σ of its own.
    pub fn knows_sigma(&self) -> bool {
        self.sigma.as_ref().is_some_and(|all| all.iter().all(|sigma| !sigma.is_nan()))
    }

    /// Whether the σ of every row is known, from columns or from `[data]`.
    pub fn noise_is_declared(&self, problem: &Problem) -> bool {
        self.knows_sigma()
            || (self.observations.is_empty() && problem.data.position_sigma.is_some())
    }

    /// File and line of a row, for messages.
    pub fn location(&self, row: usize) -> Location {
        let (file, line) = self.origin[row];
        Location::file(&self.files[file as usize]).at_line(line as usize)
    }

    /// What was set in a row; time counts from its own first one.
    pub fn conditions(&self, row: usize) -> PoseConditions {
        self.setup(row, self.first_time()).to_owned()
    }

    /// The same of every row, without what was before it, which the other rows say.
    pub fn all_conditions(&self) -> Vec<PoseConditions> {
        let first = self.first_time();
        let alone = |row| PoseView { past: PastOf::default(), ..self.setup(row, first) }.to_owned();
        (0..self.len()).map(alone).collect()
    }

    /// Time of the first pose \[s\].
    pub(crate) fn first_time(&self) -> f64 {
        self.time.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The same to read, where the time of the first pose \[s\] is known.
    pub(crate) fn setup(&self, row: usize, first: f64) -> PoseView<'_> {
        let narrow = u32::try_from(row).unwrap_or(u32::MAX);
        PoseView {
            configuration: self.configuration(row),
            payload: self.payload.as_ref().map(|all| &all[row]),
            hoist: self.hoist.as_ref().map(|all| &all[row]),
            temperature: self.temperature.as_ref().map(|all| &all[row]),
            time: self.time[row],
            elapsed: self.time[row] - first,
            approach: self
                .approach
                .as_ref()
                .map(|all| &all[row * self.joints..(row + 1) * self.joints]),
            covariates: self.covariates_of(row),
            past: PastOf::row(self, narrow),
            strains: None,
        }
    }

    /// The problem's own covariates in a row, in their order and units; empty where there are none.
    pub fn covariates_of(&self, row: usize) -> &[f64] {
        let n = self.covariates.len() / self.len().max(1);
        &self.covariates[row * n..(row + 1) * n]
    }

    /// Configuration of a row, shape = (joints) \[rad\] or \[m\].
    pub fn configuration(&self, row: usize) -> &[f64] {
        &self.configurations[row * self.joints..(row + 1) * self.joints]
    }

    /// The same rows with the other of commands and readings as configurations, where the table has
    /// both and they differ.
    pub fn by_other_joints(&self) -> Option<Self> {
        let other =
            self.other_configurations.as_ref().filter(|other| **other != self.configurations)?;
        let (configurations, own) = (other.clone(), self.configurations.clone());
        Some(Self { configurations, other_configurations: Some(own), ..self.clone() })
    }

    /// The rows with these numbers, in this order; words that none of them uses are kept.
    #[must_use]
    pub fn select(&self, rows: &[usize]) -> Self {
        let one = |column: &[f64]| rows.iter().map(|&row| column[row]).collect::<Vec<f64>>();
        let each = |column: &[f64]| {
            rows.iter()
                .flat_map(|&row| &column[row * self.joints..(row + 1) * self.joints])
                .copied()
                .collect()
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
            other_configurations: self.other_configurations.as_deref().map(each),
            nests: self.nests.clone(),
            observations: match &self.observations[..] {
                [] => Vec::new(),
                all => rows.iter().map(|&row| all[row]).collect(),
            },
            positions: rows.iter().map(|&row| self.positions[row]).collect(),
            position_measured: self.position_measured,
            position_unit: self.position_unit,
            orientations: self
                .orientations
                .as_ref()
                .map(|all| rows.iter().map(|&row| all[row]).collect()),
            sigma: self.sigma.as_deref().map(one),
            payload: self.payload.as_deref().map(one),
            hoist: self.hoist.as_deref().map(one),
            temperature: self.temperature.as_deref().map(one),
            time: one(&self.time),
            time_measured: self.time_measured,
            approach: self.approach.as_deref().map(each),
            covariates: rows.iter().flat_map(|&row| self.covariates_of(row)).copied().collect(),
            pose: self.pose.as_deref().map(one),
            pose_names: self.pose_names.as_ref().map(words),
            session: words(&self.session),
            target: self.target.as_ref().map(words),
            marked_held_out: self
                .marked_held_out
                .as_ref()
                .map(|marked| rows.iter().map(|&row| marked[row]).collect()),
            command_columns: self.command_columns.clone(),
            warnings: self.warnings.clone(),
            order: RowOrder::default(),
        }
    }

    /// These rows, then those of a table with the same columns and words.
    #[must_use]
    pub(crate) fn and(&self, other: &Self) -> Self {
        let joined = |own: &[f64], other: &[f64]| [own, other].concat();
        let both = |own: &Option<Vec<f64>>, other: &Option<Vec<f64>>| {
            Some(joined(own.as_ref()?, other.as_ref()?))
        };
        let mut all = self.clone();
        all.origin.extend(&other.origin);
        all.configurations.extend(&other.configurations);
        all.other_configurations = both(&self.other_configurations, &other.other_configurations);
        if !self.observations.is_empty() || !other.observations.is_empty() {
            let each = |of: &Self| (0..of.len()).map(|row| of.observation(row)).collect::<Vec<_>>();
            all.observations = [each(self), each(other)].concat();
        }
        all.positions.extend(&other.positions);
        all.orientations = self
            .orientations
            .as_ref()
            .and_then(|own| Some([own.as_slice(), other.orientations.as_deref()?].concat()));
        all.sigma = both(&self.sigma, &other.sigma);
        all.payload = both(&self.payload, &other.payload);
        all.hoist = both(&self.hoist, &other.hoist);
        all.temperature = both(&self.temperature, &other.temperature);
        all.time.extend(&other.time);
        all.approach = both(&self.approach, &other.approach);
        all.covariates.extend(&other.covariates);
        all.pose = both(&self.pose, &other.pose);
        all.session.of_row.extend(&other.session.of_row);
        if let (Some(own), Some(other)) = (&mut all.target, &other.target) {
            own.of_row.extend(&other.of_row);
        }
        if let (Some(own), Some(other)) = (&mut all.marked_held_out, &other.marked_held_out) {
            own.extend(other);
        }
        all.nests.extend(other.nests.iter().cloned());
        all
    }
}
