//! Data sets from plain arrays.

use std::path::PathBuf;

use nalgebra::{UnitQuaternion, Vector3};

use super::{Dataset, Labels, Measurements, Split};
use crate::problem::item::GREATEST;

/// Arrays that make no data set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// A configuration of another length than the first.
    #[error("configuration {row} has {found} joints, the first {expected}")]
    Joints {
        /// Row, counted from 0.
        row: usize,
        /// Joints of the first row.
        expected: usize,
        /// Joints of this row.
        found: usize,
    },
    /// A column of another length than the configurations.
    #[error("{column}: {found} values for {expected} rows")]
    Length {
        /// What the column holds.
        column: &'static str,
        /// Rows.
        expected: usize,
        /// Values.
        found: usize,
    },
    /// A value that is infinite or no number.
    #[error("{column}: the value of row {row} is not finite")]
    NotFinite {
        /// What the column holds.
        column: &'static str,
        /// Row, counted from 0.
        row: usize,
    },
    /// A value outside of what its column may hold.
    #[error("{column}: the value of row {row} is {rule}")]
    OutOfRange {
        /// What the column holds.
        column: &'static str,
        /// Row, counted from 0.
        row: usize,
        /// What is wrong with it.
        rule: &'static str,
    },
    /// A held-out row that does not exist.
    #[error("row {row} cannot be held out: there are {rows}")]
    NoSuchRow {
        /// The row, counted from 0.
        row: usize,
        /// Rows.
        rows: usize,
    },
}

/// A [`Dataset`] under construction; every method takes one value per row, and a later call
/// replaces an earlier one.
#[derive(Debug, Clone)]
pub struct DatasetBuilder {
    configurations: Vec<Vec<f64>>,
    positions: Vec<Vector3<f64>>,
    measured: bool,
    orientations: Option<Vec<UnitQuaternion<f64>>>,
    sigma: Option<Vec<f64>>,
    payload: Option<Vec<f64>>,
    hoist: Option<Vec<f64>>,
    temperature: Option<Vec<f64>>,
    time: Option<Vec<f64>>,
    approach: Option<Vec<Vec<f64>>>,
    covariates: Vec<Vec<f64>>,
    session: Option<Labels>,
    target: Option<Labels>,
    held_out: Vec<usize>,
}

impl Dataset {
    /// From plain arrays: configurations, shape = (rows)(joints) \[rad\] or \[m\], fixed joints
    /// included with any value, and measured positions, shape = (rows), measuring frame \[m\].
    /// Other columns follow by name; no row is held out unless
    /// [`held_out`](DatasetBuilder::held_out) says so.
    pub fn builder<C: AsRef<[f64]>>(
        configurations: impl IntoIterator<Item = C>,
        positions: impl IntoIterator<Item = Vector3<f64>>,
    ) -> DatasetBuilder {
        DatasetBuilder {
            configurations: rows_of(configurations),
            positions: positions.into_iter().collect(),
            measured: true,
            orientations: None,
            sigma: None,
            payload: None,
            hoist: None,
            temperature: None,
            time: None,
            approach: None,
            covariates: Vec::new(),
            session: None,
            target: None,
            held_out: Vec::new(),
        }
    }

    /// Poses to predict: as [`builder`](Self::builder), with all positions 0.
    pub fn poses<C: AsRef<[f64]>>(configurations: impl IntoIterator<Item = C>) -> DatasetBuilder {
        let configurations = rows_of(configurations);
        let positions = vec![Vector3::zeros(); configurations.len()];
        DatasetBuilder { measured: false, ..Self::builder(configurations, positions) }
    }
}

impl DatasetBuilder {
    /// Measured orientation of the target, measuring frame; fitted where the problem has an
    /// `orientation_sigma`.
    #[must_use]
    pub fn orientation(mut self, orientations: Vec<UnitQuaternion<f64>>) -> Self {
        self.orientations = Some(orientations);
        self
    }

    /// 1 σ of each coordinate of a position, above 0 \[m\].
    #[must_use]
    pub fn sigma(mut self, sigma: Vec<f64>) -> Self {
        self.sigma = Some(sigma);
        self
    }

    /// Payload, not negative \[kg\].
    #[must_use]
    pub fn payload(mut self, payload: Vec<f64>) -> Self {
        self.payload = Some(payload);
        self
    }

    /// Hoist force \[N\].
    #[must_use]
    pub fn hoist(mut self, hoist: Vec<f64>) -> Self {
        self.hoist = Some(hoist);
        self
    }

    /// Temperature [°C].
    #[must_use]
    pub fn temperature(mut self, temperature: Vec<f64>) -> Self {
        self.temperature = Some(temperature);
        self
    }

    /// Time \[s\]; without it, the number of the row.
    #[must_use]
    pub fn time(mut self, time: Vec<f64>) -> Self {
        self.time = Some(time);
        self
    }

    /// Direction from which each joint came, shape = (rows)(joints): −1, 0 (unknown) or +1.
    #[must_use]
    pub fn approach<A: AsRef<[f64]>>(mut self, approach: impl IntoIterator<Item = A>) -> Self {
        self.approach = Some(rows_of(approach));
        self
    }

    /// The problem's own covariates, shape = (rows)(covariates), in the order of its
    /// `[data.covariates]` and in their units.
    #[must_use]
    pub fn covariates<C: AsRef<[f64]>>(mut self, covariates: impl IntoIterator<Item = C>) -> Self {
        self.covariates = rows_of(covariates);
        self
    }

    /// Session of each row: rows of one session share a base.
    #[must_use]
    pub fn session<W: AsRef<str>>(mut self, session: impl IntoIterator<Item = W>) -> Self {
        self.session = Some(session.into_iter().collect());
        self
    }

    /// Target of each row: rows of one target share the measured point of the tool.
    #[must_use]
    pub fn target<W: AsRef<str>>(mut self, target: impl IntoIterator<Item = W>) -> Self {
        self.target = Some(target.into_iter().collect());
        self
    }

    /// Rows that are not fitted but judge the fit, counted from 0; in any order.
    #[must_use]
    pub fn held_out(mut self, rows: impl IntoIterator<Item = usize>) -> Self {
        self.held_out = rows.into_iter().collect();
        self
    }

    /// The data set, once every array is found to fit the others.
    ///
    /// # Errors
    /// The first array that does not fit.
    pub fn build(self) -> Result<Dataset, DatasetError> {
        let rows = self.configurations.len();
        let mut held_out = vec![false; rows];
        for &row in &self.held_out {
            *held_out.get_mut(row).ok_or(DatasetError::NoSuchRow { row, rows })? = true;
        }
        let (held_out, identification) = (0..rows).partition(|&row| held_out[row]);
        Ok(Dataset {
            measurements: self.measurements()?,
            split: Split { identification, held_out },
        })
    }

    /// The measurements alone.
    ///
    /// # Errors
    /// The first array that does not fit.
    pub fn measurements(self) -> Result<Measurements, DatasetError> {
        let rows = self.configurations.len();
        let covariates = covariates(&self.covariates, rows)?;
        let joints = self.configurations.first().map_or(0, Vec::len);
        let flat = |column, values: &[Vec<f64>]| {
            length(column, values.len(), rows)?;
            for (row, values) in values.iter().enumerate() {
                if values.len() != joints {
                    return Err(DatasetError::Joints {
                        row,
                        expected: joints,
                        found: values.len(),
                    });
                }
                finite(column, row, values)?;
            }
            Ok(values.concat())
        };
        let one = |column, values: Option<Vec<f64>>| {
            let Some(values) = values else { return Ok(None) };
            length(column, values.len(), rows)?;
            values
                .iter()
                .enumerate()
                .try_for_each(|(row, value)| finite(column, row, &[*value]))?;
            Ok(Some(values))
        };
        let within = |column, values: Option<Vec<f64>>, rule, wrong: fn(&f64) -> bool| {
            let values = one(column, values)?;
            match values.iter().flatten().position(wrong) {
                Some(row) => Err(DatasetError::OutOfRange { column, row, rule }),
                None => Ok(values),
            }
        };
        let words = |column, labels: Option<Labels>| {
            let Some(labels) = labels else { return Ok(None) };
            length(column, labels.of_row.len(), rows).map(|()| Some(labels))
        };
        length("positions", self.positions.len(), rows)?;
        for (row, position) in self.positions.iter().enumerate() {
            finite("positions", row, position.as_slice())?;
        }
        if let Some(orientations) = &self.orientations {
            length("orientations", orientations.len(), rows)?;
            for (row, own) in orientations.iter().enumerate() {
                finite("orientations", row, own.coords.as_slice())?;
            }
        }
        let time = one("time", self.time)?;
        let unnamed = || Labels { names: vec![String::new()], of_row: vec![0; rows] };
        Ok(Measurements {
            files: vec![PathBuf::from("arrays")],
            origin: (1_u32..).take(rows).map(|row| (0, row)).collect(),
            joints,
            configurations: flat("configurations", &self.configurations)?,
            positions: self.positions,
            position_measured: self.measured,
            position_unit: None,
            orientations: self.orientations,
            sigma: within("sigma", self.sigma, "not above 0", |sigma| *sigma <= 0.0)?,
            payload: within("payload", self.payload, "below 0", |payload| *payload < 0.0)?,
            hoist: one("hoist", self.hoist)?,
            temperature: one("temperature", self.temperature)?,
            time_measured: time.is_some(),
            time: time.unwrap_or_else(|| (0..rows).map(|row| row as f64).collect()),
            approach: self
                .approach
                .map(|approach| directions(flat("approach", &approach)?, joints))
                .transpose()?,
            covariates,
            session: words("session", self.session)?.unwrap_or_else(unnamed),
            target: words("target", self.target)?,
            ..Measurements::default()
        })
    }
}

/// The covariates of all rows, so many of each.
fn covariates(all: &[Vec<f64>], rows: usize) -> Result<Vec<f64>, DatasetError> {
    let (column, rule) = ("covariates", "not as long as the first");
    let Some(first) = all.first() else { return Ok(Vec::new()) };
    length(column, all.len(), rows)?;
    for (row, values) in all.iter().enumerate() {
        finite(column, row, values)?;
        if values.len() != first.len() {
            return Err(DatasetError::OutOfRange { column, row, rule });
        }
    }
    Ok(all.concat())
}

/// Directions −1, 0 and +1, so many of each row.
fn directions(values: Vec<f64>, joints: usize) -> Result<Vec<f64>, DatasetError> {
    match values.iter().position(|value| ![-1.0, 0.0, 1.0].contains(value)) {
        Some(place) => {
            let (column, row) = ("approach", place / joints.max(1));
            Err(DatasetError::OutOfRange { column, row, rule: "none of −1, 0 and +1" })
        }
        None => Ok(values),
    }
}

fn rows_of<C: AsRef<[f64]>>(rows: impl IntoIterator<Item = C>) -> Vec<Vec<f64>> {
    rows.into_iter().map(|row| row.as_ref().to_vec()).collect()
}

fn length(column: &'static str, found: usize, expected: usize) -> Result<(), DatasetError> {
    if found == expected { Ok(()) } else { Err(DatasetError::Length { column, expected, found }) }
}

fn finite(column: &'static str, row: usize, values: &[f64]) -> Result<(), DatasetError> {
    if !values.iter().all(|value| value.is_finite()) {
        return Err(DatasetError::NotFinite { column, row });
    }
    let reckoned_with = values.iter().all(|value| value.abs() <= GREATEST);
    if reckoned_with {
        Ok(())
    } else {
        Err(DatasetError::OutOfRange { column, row, rule: "larger than 1e150" })
    }
}
