//! Measured poses, stored by column in SI units.
//!
//! [`Dataset::read`] reads the tables that a problem names, and [`Dataset::builder`] takes arrays.
//! [`Dataset::poses`] makes rows without positions. `docs/problem.md` lists columns and units.

#[deny(clippy::indexing_slicing)]
mod appended;
#[deny(clippy::indexing_slicing)]
mod beginning;
mod builder;
mod cell_style;
mod cell_words;
mod clocks;
#[deny(clippy::indexing_slicing)]
mod column_table;
#[deny(clippy::indexing_slicing)]
mod columns;
#[deny(clippy::indexing_slicing)]
mod concatenated;
mod cut_end;
mod dataset;
#[deny(clippy::indexing_slicing)]
mod dialect;
#[deny(clippy::indexing_slicing)]
mod doubtful_rows;
#[deny(clippy::indexing_slicing)]
mod duplicates;
#[deny(clippy::indexing_slicing)]
mod foreign_name;
mod guessed_names;
mod headerless;
mod instants;
#[deny(clippy::indexing_slicing)]
mod join_key;
mod joined;
mod joined_row;
mod key_column;
#[deny(clippy::indexing_slicing)]
mod labels;
mod latin;
mod limits;
#[deny(clippy::indexing_slicing)]
mod lines;
#[deny(clippy::indexing_slicing)]
mod mapped;
#[deny(clippy::indexing_slicing)]
mod meaning;
#[deny(clippy::indexing_slicing)]
mod observed;
mod order;
#[deny(clippy::indexing_slicing)]
mod orientation;
mod other_units;
mod paired_times;
#[deny(clippy::indexing_slicing)]
mod read;
mod repeats;
#[deny(clippy::indexing_slicing)]
mod required;
#[deny(clippy::indexing_slicing)]
mod role;
mod rows;
mod settled;
mod shared_name;
mod spelling;
mod split;
mod start_times;
#[deny(clippy::indexing_slicing)]
mod table;
#[deny(clippy::indexing_slicing)]
mod time;
mod unmeasured;

use std::{collections::HashSet, path::PathBuf};

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::{Location, Warning};
use crate::problem::digest::hexadecimal;
use crate::problem::{LazyPast, Observation, PoseConditions, PoseView, Problem};

pub use builder::{DatasetBuilder, DatasetError};
#[doc(hidden)]
pub use column_table::{ColumnTable, ColumnValues};
pub use dataset::Dataset;
pub(crate) use dataset::MAX_FITTED_BASES;
pub(crate) use order::{RowOrder, Stop};
pub(crate) use repeats::count_distinct;
pub use split::Split;
pub(crate) use start_times::StartTimes;

/// Measured poses with one column per quantity, in the order of the files.
#[derive(Debug, Clone, Default)]
pub struct Measurements {
    /// Files that were read.
    pub files: Vec<PathBuf>,
    /// File index and line of each row, for messages.
    pub origin: Vec<(u32, u32)>,
    /// Number of joints of the arm, including fixed ones.
    pub joints: usize,
    /// Configurations, shape = (rows, joints), row-major \[rad\] or \[m\]; 0 at fixed joints.
    pub configurations: Vec<f64>,
    /// Configurations from the other joint source (commands or readings), if the table has both.
    pub other_configurations: Option<Vec<f64>>,
    /// Measurements of fixed points between the poses; they take no part in fits.
    #[doc(hidden)]
    pub nests: Vec<NestReading>,
    /// Unmeasured poses of the joint table by which the arm came to rows, in the order of these.
    #[doc(hidden)]
    pub stops: Vec<Stop>,
    /// Observation of each row; empty if all rows measure positions.
    #[doc(hidden)]
    pub observations: Vec<Observation>,
    /// Names of the two points of each known distance, sorted, and the observation of its row.
    #[doc(hidden)]
    pub distance_names: Vec<(Observation, [String; 2])>,
    /// Measured numbers of each row, padded with zeros: a position in the measuring frame \[m\], a
    /// distance \[m\], tilts \[rad\] or pixels; 0 for a contact.
    pub positions: Vec<Vector3<f64>>,
    /// True if the positions were measured; false for planned poses.
    pub position_measured: bool,
    /// Unit of the positions in the first file \[m\]; `None` without a file or positions.
    pub position_unit: Option<f64>,
    /// Measured orientations of the target in the measuring frame; `None` if a column is missing.
    /// Rows that measure no position have the identity.
    pub orientations: Option<Vec<UnitQuaternion<f64>>>,
    /// Standard deviation of the noise of each row's coordinates, from the column `sigma_mm` or the
    /// kind of the row, in the unit of the row; NaN if unknown.
    pub sigma: Option<Vec<f64>>,
    /// Payload of each row \[kg\]; `None` without a column.
    pub payload: Option<Vec<f64>>,
    /// Hoist force of each row \[N\]; `None` without a column.
    pub hoist: Option<Vec<f64>>,
    /// Temperature of each row [°C]; `None` without a column.
    pub temperature: Option<Vec<f64>>,
    /// Time of each row \[s\]; without a column, the number of the row, counted from 0.
    pub time: Vec<f64>,
    /// True if `time` was recorded, false if it is the row number.
    pub time_measured: bool,
    /// Direction from which each joint approached, −1, 0 or +1, shape = (rows, joints).
    pub approach: Option<Vec<f64>>,
    /// Velocities of the joints, shape = (rows, joints) \[rad/s\] or \[m/s\]; 0 without a column.
    #[doc(hidden)]
    pub velocities: Option<Vec<f64>>,
    /// Values of the declared covariates in their order and units, shape = (rows, covariates).
    pub covariates: Vec<f64>,
    /// Pose numbers from the column `pose`, if every row has a number there.
    pub pose: Option<Vec<f64>>,
    /// Pose names from the column `pose`, if every row has one and not all are numbers.
    #[doc(hidden)]
    pub pose_names: Option<Labels>,
    /// Session of each row; without a column, all rows have one session with an empty name.
    #[doc(hidden)]
    pub session: Labels,
    /// Target of each row; `None` without a column.
    #[doc(hidden)]
    pub target: Option<Labels>,
    /// True for rows marked `validation` in the column that the problem names, or else in `split`;
    /// `None` without the column.
    pub marked_held_out: Option<Vec<bool>>,
    /// True if numbers of the first file have decimal commas, so that commands for it have them too.
    #[doc(hidden)]
    pub has_decimal_commas: bool,
    /// Value of `offset_s` \[s\] that undoes a shift by so many rows, of tables joined by time.
    #[doc(hidden)]
    pub clock_offsets: Vec<(i8, f64)>,
    /// Columns of the commands in the first file, one per moving joint; empty without a file.
    #[doc(hidden)]
    pub command_columns: Vec<CommandColumn>,
    /// Warnings about the files, for reports.
    pub warnings: Vec<Warning>,
    /// Chronological order of the rows. It is computed at first use, so rows may change only before
    /// that or in a copy.
    #[doc(hidden)]
    pub order: RowOrder,
}

/// Measurement of a fixed point without the arm. Repeated, it shows whether the instrument has
/// moved.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct NestReading {
    /// File index and line, for messages.
    pub origin: (u32, u32),
    /// Name of the fixed point.
    pub name: String,
    /// Measured position, measuring frame \[m\].
    pub position: Vector3<f64>,
    /// Time \[s\], if there is a column.
    pub time: Option<f64>,
    /// Number of rows of the arm before this measurement, which is used if there is no time.
    pub after: usize,
    /// Session; empty without a column.
    pub session: String,
    /// Standard deviation of each coordinate, if there is a column \[m\].
    pub sigma: Option<f64>,
}

/// Column of a joint's commands in a table file.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct CommandColumn {
    /// Joint, counted from 0.
    pub joint: usize,
    /// Name of the column in the table.
    pub name: String,
    /// Unit of the column in rad or m, for example π/180 for degrees.
    pub unit: f64,
}

/// One word per row, stored as an index into the distinct words in order of appearance.
#[doc(hidden)]
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Labels {
    /// Distinct words in order of appearance.
    pub names: Vec<String>,
    /// Index of the word of each row.
    pub of_row: Vec<usize>,
}

/// Returns a number as 32 bits, the largest one instead of a larger number.
fn narrow(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

impl Measurements {
    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns true if there are no rows.
    #[doc(hidden)]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Returns the quantity that a row measures.
    #[doc(hidden)]
    pub fn observation(&self, row: usize) -> Observation {
        self.observations.get(row).copied().unwrap_or_default()
    }

    /// Returns one observation of each kind in the table, positions first.
    pub(crate) fn kinds(&self) -> Vec<Observation> {
        let mut kinds: Vec<Observation> =
            (0..self.len()).map(|row| self.observation(row)).collect();
        kinds.sort_unstable();
        kinds.dedup_by_key(|observation| observation.kind());
        kinds
    }

    /// Returns the first of [`kinds`](Self::kinds), on which error summaries are based.
    pub(crate) fn leading(&self) -> Observation {
        self.kinds().first().copied().unwrap_or_default()
    }

    /// Returns the orientation of a row in the measuring frame; `None` if the table has none.
    #[doc(hidden)]
    pub fn orientation(&self, row: usize) -> Option<&UnitQuaternion<f64>> {
        self.orientations
            .as_ref()
            .map(|column| &column[row])
            .filter(|orientation| !orientation.w.is_nan())
    }

    /// Returns the standard deviation stated for the noise of a row, in the unit of the row; `None`
    /// if it is unknown.
    pub(crate) fn sigma_of(&self, row: usize) -> Option<f64> {
        self.sigma.as_ref().map(|column| column[row]).filter(|sigma| !sigma.is_nan())
    }

    /// Returns true if every row states its standard deviation.
    pub(crate) fn has_sigma_in_every_row(&self) -> bool {
        self.sigma.as_ref().is_some_and(|column| column.iter().all(|sigma| !sigma.is_nan()))
    }

    /// Returns true if the standard deviation of every row is known from columns or from `[data]`.
    pub(crate) fn has_declared_noise(&self, problem: &Problem) -> bool {
        self.has_sigma_in_every_row()
            || (self.observations.is_empty() && problem.data.position_sigma.is_some())
    }

    /// Returns file and line of a row, for messages.
    #[doc(hidden)]
    pub fn location(&self, row: usize) -> Location {
        let (file, line) = self.origin[row];
        Location::file(&self.files[file as usize]).at_line(line as usize)
    }

    /// Returns a copy of the conditions of a row; time elapses from the first pose of its session.
    #[doc(hidden)]
    pub fn conditions(&self, row: usize) -> PoseConditions {
        self.setup(row, &self.session_starts()).to_owned()
    }

    /// Returns the conditions of all rows without their past, which consists of other rows.
    pub(crate) fn conditions_without_past(&self) -> Vec<PoseConditions> {
        let starts = self.session_starts();
        let alone =
            |row| PoseView { past: LazyPast::default(), ..self.setup(row, &starts) }.to_owned();
        (0..self.len()).map(alone).collect()
    }

    /// Returns the conditions of all rows as poses to simulate, each with the name of its target,
    /// which is empty if `problem` declares none.
    #[doc(hidden)]
    pub fn poses_to_simulate(&self, problem: &Problem) -> Vec<(PoseConditions, String)> {
        let target = self.target.as_ref().filter(|_| !problem.targets.is_empty());
        let name = |row: usize| {
            let name = target.and_then(|labels| labels.names.get(*labels.of_row.get(row)?));
            name.cloned().unwrap_or_default()
        };
        let conditions = self.conditions_without_past().into_iter().enumerate();
        conditions.map(|(row, conditions)| (conditions, name(row))).collect()
    }

    /// Returns a view of the conditions of a row; `starts` are the times of the first pose of each
    /// session, as [`Self::session_starts`] returns them \[s\].
    pub(crate) fn setup(&self, row: usize, starts: &[f64]) -> PoseView<'_> {
        let session = self.session.of_row.get(row).copied().unwrap_or(0);
        PoseView {
            configuration: self.configuration(row),
            payload: self.payload.as_ref().map(|column| &column[row]),
            hoist: self.hoist.as_ref().map(|column| &column[row]),
            temperature: self.temperature.as_ref().map(|column| &column[row]),
            time: self.time[row],
            elapsed: self.time[row] - starts.get(session).copied().unwrap_or(0.0),
            approach: self
                .approach
                .as_ref()
                .map(|column| &column[row * self.joints..(row + 1) * self.joints]),
            covariates: self.covariates_of(row),
            past: LazyPast::row(self, narrow(row)),
            offsets: None,
        }
    }

    /// Returns the declared covariates of a row in their order and units; empty if there are none.
    #[doc(hidden)]
    pub fn covariates_of(&self, row: usize) -> &[f64] {
        let n = self.covariates.len() / self.len().max(1);
        &self.covariates[row * n..(row + 1) * n]
    }

    /// Returns a digest of a row, 16 hexadecimal digits. It is computed from joints, measured
    /// numbers, and session, target, payload and time if the table states them. It does not depend
    /// on the file, nor on the units in which the values are written. The digest of a known
    /// distance is computed from its points, length and σ alone, so that it is the same with any
    /// table.
    pub(crate) fn row_digest(&self, row: usize) -> String {
        let observation = self.observation(row);
        let names = self.distance_names.iter().find(|(of, _)| *of == observation);
        let Some((_, [first, second])) = names else { return self.digest_of_conditions(row) };
        let sigma = self.sigma_of(row).unwrap_or(0.0);
        let length = self.positions[row].x;
        digest(&format!("known distance {length:.9e} {sigma:.9e}\n{first}\n{second}"))
    }

    /// Returns true if `digests` contains that of a row, or that of a known distance as earlier
    /// versions wrote it.
    pub(crate) fn is_among(&self, row: usize, digests: &HashSet<String>) -> bool {
        digests.contains(&self.row_digest(row))
            || (matches!(self.observation(row), Observation::Between(..))
                && digests.contains(&self.digest_of_conditions(row)))
    }

    /// Returns the digest of a row that is no known distance. Earlier versions digested known
    /// distances in this way, too.
    fn digest_of_conditions(&self, row: usize) -> String {
        let orientation = self.orientation(row).map(UnitQuaternion::scaled_axis);
        let turn = orientation.iter().flat_map(|turn| turn.iter());
        let numbers = self.configuration(row).iter().chain(&self.positions[row]).chain(turn);
        let payload = self.payload.as_ref().map(|payload| (&payload[row], "payload"));
        let time = self.time_measured.then(|| (&self.time[row], "time"));
        let words = [Some(&self.session), self.target.as_ref()].into_iter().flatten();
        // Adding 0 turns −0 into 0. Ten digits stay the same if the unit is changed.
        let text = numbers.fold(format!("{:?}", self.observation(row)), |text, number| {
            format!("{text} {:.9e}", number + 0.0)
        });
        let text = payload
            .into_iter()
            .chain(time)
            .fold(text, |text, (number, name)| format!("{text} {name} {:.9e}", number + 0.0));
        let words = words.filter_map(|labels| labels.names.get(*labels.of_row.get(row)?));
        let text = words.fold(text, |text, word| format!("{text}\n{word}"));
        digest(&text)
    }

    /// Returns the configuration of a row, shape = (joints) \[rad\] or \[m\].
    pub fn configuration(&self, row: usize) -> &[f64] {
        &self.configurations[row * self.joints..(row + 1) * self.joints]
    }

    /// Returns these rows with configurations from the other joint source (commands or readings),
    /// if the table has both and they differ.
    #[doc(hidden)]
    pub fn with_other_joint_source(&self) -> Option<Self> {
        let other =
            self.other_configurations.as_ref().filter(|other| **other != self.configurations)?;
        let (configurations, current) = (other.clone(), self.configurations.clone());
        Some(Self { configurations, other_configurations: Some(current), ..self.clone() })
    }

    /// Returns a copy with the given rows in the given order. Labels keep words that no longer
    /// occur.
    #[must_use]
    pub fn select(&self, rows: &[usize]) -> Self {
        let pick = |column: &[f64]| rows.iter().map(|&row| column[row]).collect::<Vec<f64>>();
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
            stops: self.stops_before(rows),
            observations: match &self.observations[..] {
                [] => Vec::new(),
                observations => rows.iter().map(|&row| observations[row]).collect(),
            },
            distance_names: self.distance_names.clone(),
            positions: rows.iter().map(|&row| self.positions[row]).collect(),
            position_measured: self.position_measured,
            position_unit: self.position_unit,
            orientations: self
                .orientations
                .as_ref()
                .map(|column| rows.iter().map(|&row| column[row]).collect()),
            sigma: self.sigma.as_deref().map(pick),
            payload: self.payload.as_deref().map(pick),
            hoist: self.hoist.as_deref().map(pick),
            temperature: self.temperature.as_deref().map(pick),
            time: pick(&self.time),
            time_measured: self.time_measured,
            approach: self.approach.as_deref().map(each),
            velocities: self.velocities.as_deref().map(each),
            covariates: rows.iter().flat_map(|&row| self.covariates_of(row)).copied().collect(),
            pose: self.pose.as_deref().map(pick),
            pose_names: self.pose_names.as_ref().map(words),
            session: words(&self.session),
            target: self.target.as_ref().map(words),
            marked_held_out: (self.marked_held_out.as_ref())
                .map(|marked| rows.iter().map(|&row| marked[row]).collect()),
            has_decimal_commas: self.has_decimal_commas,
            clock_offsets: self.clock_offsets.clone(),
            command_columns: self.command_columns.clone(),
            warnings: self.warnings.clone(),
            order: RowOrder::default(),
        }
    }
}

/// Returns the digest of a text, 16 hexadecimal digits.
fn digest(text: &str) -> String {
    hexadecimal(text).chars().take(16).collect()
}
