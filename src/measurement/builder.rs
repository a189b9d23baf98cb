//! Builder of data sets from plain arrays.

use std::path::PathBuf;

use nalgebra::{UnitQuaternion, Vector3};

use super::{Dataset, Labels, Measurements, Split};
use crate::problem::item::MAX_MAGNITUDE;

/// Error of arrays that do not form a data set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// A configuration has another length than the first.
    #[error("configuration {row} has {found} joints, the first {expected}")]
    Joints {
        /// Row, counted from 0.
        row: usize,
        /// Number of joints in the first row.
        expected: usize,
        /// Number of joints in the row at fault.
        found: usize,
    },
    /// A column has another length than the configurations.
    #[error("{column}: {found} values for {expected} rows")]
    Length {
        /// Name of the column.
        column: &'static str,
        /// Number of rows of the configurations.
        expected: usize,
        /// Number of values in the column.
        found: usize,
    },
    /// A value is infinite or not a number.
    #[error("{column}: the value of row {row} is not finite")]
    NotFinite {
        /// Name of the column.
        column: &'static str,
        /// Row, counted from 0.
        row: usize,
    },
    /// A value is outside the range of its column.
    #[error("{column}: the value of row {row} is {rule}")]
    OutOfRange {
        /// Name of the column.
        column: &'static str,
        /// Row, counted from 0.
        row: usize,
        /// Rule that the value breaks.
        rule: &'static str,
    },
    /// A held-out row does not exist.
    #[error("row {row} cannot be held out: there are {rows}")]
    NoSuchRow {
        /// Row, counted from 0.
        row: usize,
        /// Number of rows of the configurations.
        rows: usize,
    },
}

/// Builder of a [`Dataset`]. A method that sets a column takes one value per row, and a later call
/// replaces an earlier one.
#[derive(Debug, Clone, Default)]
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

/// Declares methods that set a column of one value per row.
macro_rules! columns {
    ($($(#[$doc:meta])* $method:ident, $field:ident: $value:ty;)*) => {
        $(
            $(#[$doc])*
            #[must_use]
            pub fn $method(mut self, values: Vec<$value>) -> Self {
                self.$field = Some(values);
                self
            }
        )*
    };
}

impl Dataset {
    /// Returns a builder from plain arrays.
    ///
    /// `configurations`, shape = (rows)(joints) \[rad\] or \[m\], include fixed joints, whose
    /// values are not used. `positions`, shape = (rows), are the measured ones in the measuring
    /// frame \[m\]. No row is held out without a call of [`held_out`](DatasetBuilder::held_out).
    pub fn builder<C: AsRef<[f64]>>(
        configurations: impl IntoIterator<Item = C>,
        positions: impl IntoIterator<Item = Vector3<f64>>,
    ) -> DatasetBuilder {
        DatasetBuilder {
            configurations: rows_of(configurations),
            positions: positions.into_iter().collect(),
            measured: true,
            ..DatasetBuilder::default()
        }
    }

    /// Returns a builder of poses to predict, without measured positions.
    pub fn poses<C: AsRef<[f64]>>(configurations: impl IntoIterator<Item = C>) -> DatasetBuilder {
        let configurations = rows_of(configurations);
        let positions = vec![Vector3::zeros(); configurations.len()];
        DatasetBuilder { measured: false, ..Self::builder(configurations, positions) }
    }
}

impl DatasetBuilder {
    columns! {
        /// Sets the measured orientations of the target, measuring frame; they are fitted if the
        /// problem declares an `orientation_sigma`.
        orientation, orientations: UnitQuaternion<f64>;
        /// Sets the standard deviation of the noise of each row's coordinates, above 0 \[m\].
        sigma, sigma: f64;
        /// Sets the payload, not negative \[kg\].
        payload, payload: f64;
        /// Sets the hoist force \[N\].
        hoist, hoist: f64;
        /// Sets the temperature [°C].
        temperature, temperature: f64;
        /// Sets the time \[s\]; the default is the row number, counted from 0.
        time, time: f64;
    }

    /// Sets the direction from which each joint approached, shape = (rows)(joints): −1, 0 (unknown)
    /// or +1.
    #[must_use]
    pub fn approach<A: AsRef<[f64]>>(mut self, approach: impl IntoIterator<Item = A>) -> Self {
        self.approach = Some(rows_of(approach));
        self
    }

    /// Sets the declared covariates, shape = (rows)(covariates), in the order and units of
    /// `[data.covariates]`.
    #[must_use]
    pub fn covariates<C: AsRef<[f64]>>(mut self, covariates: impl IntoIterator<Item = C>) -> Self {
        self.covariates = rows_of(covariates);
        self
    }

    /// Sets the session of each row; rows of one session share a base.
    #[must_use]
    pub fn session<W: AsRef<str>>(mut self, session: impl IntoIterator<Item = W>) -> Self {
        self.session = Some(session.into_iter().collect());
        self
    }

    /// Sets the target of each row; rows of one target share the measured point of the tool.
    #[must_use]
    pub fn target<W: AsRef<str>>(mut self, target: impl IntoIterator<Item = W>) -> Self {
        self.target = Some(target.into_iter().collect());
        self
    }

    /// Sets the rows that are not fitted but used to judge the fit: their indices from 0, in any
    /// order.
    #[must_use]
    pub fn held_out(mut self, rows: impl IntoIterator<Item = usize>) -> Self {
        self.held_out = rows.into_iter().collect();
        self
    }

    /// Builds the data set after checking that all arrays agree.
    ///
    /// # Errors
    /// Returns an error about the first array that does not agree with the others.
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

    /// Builds the measurements without a split.
    ///
    /// # Errors
    /// Returns an error about the first array that does not agree with the others.
    #[doc(hidden)]
    pub fn measurements(self) -> Result<Measurements, DatasetError> {
        let rows = self.configurations.len();
        let covariates = covariates(&self.covariates, rows)?;
        let joints = self.configurations.first().map_or(0, Vec::len);
        let flat = |column, values: &[Vec<f64>]| {
            check_length(column, values.len(), rows)?;
            for (row, values) in values.iter().enumerate() {
                if values.len() != joints {
                    return Err(DatasetError::Joints {
                        row,
                        expected: joints,
                        found: values.len(),
                    });
                }
                check_finite(column, row, values)?;
            }
            Ok(values.concat())
        };
        let column_values = |column, values: Option<Vec<f64>>| {
            let Some(values) = values else { return Ok(None) };
            check_length(column, values.len(), rows)?;
            values
                .iter()
                .enumerate()
                .try_for_each(|(row, value)| check_finite(column, row, &[*value]))?;
            Ok(Some(values))
        };
        let within = |column, values: Option<Vec<f64>>, rule, wrong: fn(&f64) -> bool| {
            let values = column_values(column, values)?;
            match values.iter().flatten().position(wrong) {
                Some(row) => Err(DatasetError::OutOfRange { column, row, rule }),
                None => Ok(values),
            }
        };
        let words = |column, labels: Option<Labels>| {
            let Some(labels) = labels else { return Ok(None) };
            check_length(column, labels.of_row.len(), rows).map(|()| Some(labels))
        };
        check_length("positions", self.positions.len(), rows)?;
        for (row, position) in self.positions.iter().enumerate() {
            check_finite("positions", row, position.as_slice())?;
        }
        if let Some(orientations) = &self.orientations {
            check_length("orientations", orientations.len(), rows)?;
            for (row, orientation) in orientations.iter().enumerate() {
                check_finite("orientations", row, orientation.coords.as_slice())?;
            }
        }
        let time = column_values("time", self.time)?;
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
            hoist: column_values("hoist", self.hoist)?,
            temperature: column_values("temperature", self.temperature)?,
            time_measured: time.is_some(),
            time: time.unwrap_or_else(|| (0..rows).map(|row| row as f64).collect()),
            approach: self
                .approach
                .map(|approach| checked_directions(flat("approach", &approach)?, joints))
                .transpose()?,
            covariates,
            session: words("session", self.session)?.unwrap_or_else(unnamed),
            target: words("target", self.target)?,
            ..Measurements::default()
        })
    }
}

/// Returns the covariates of all rows as one list; every row must have as many as the first.
fn covariates(rows_of_values: &[Vec<f64>], rows: usize) -> Result<Vec<f64>, DatasetError> {
    let (column, rule) = ("covariates", "not as long as the first");
    let Some(first) = rows_of_values.first() else { return Ok(Vec::new()) };
    check_length(column, rows_of_values.len(), rows)?;
    for (row, values) in rows_of_values.iter().enumerate() {
        check_finite(column, row, values)?;
        if values.len() != first.len() {
            return Err(DatasetError::OutOfRange { column, row, rule });
        }
    }
    Ok(rows_of_values.concat())
}

/// Checks that all directions of approach are −1, 0 or +1, and returns them.
fn checked_directions(values: Vec<f64>, joints: usize) -> Result<Vec<f64>, DatasetError> {
    match values.iter().position(|value| ![-1.0, 0.0, 1.0].contains(value)) {
        Some(place) => {
            let (column, row) = ("approach", place / joints.max(1));
            Err(DatasetError::OutOfRange { column, row, rule: "none of −1, 0 and +1" })
        }
        None => Ok(values),
    }
}

/// Copies rows of numbers.
fn rows_of<C: AsRef<[f64]>>(rows: impl IntoIterator<Item = C>) -> Vec<Vec<f64>> {
    rows.into_iter().map(|row| row.as_ref().to_vec()).collect()
}

/// Checks that a column has one value per row.
fn check_length(column: &'static str, found: usize, expected: usize) -> Result<(), DatasetError> {
    if found == expected { Ok(()) } else { Err(DatasetError::Length { column, expected, found }) }
}

/// Checks that the values of a row are finite and at most 10¹⁵⁰ in magnitude.
fn check_finite(column: &'static str, row: usize, values: &[f64]) -> Result<(), DatasetError> {
    if !values.iter().all(|value| value.is_finite()) {
        return Err(DatasetError::NotFinite { column, row });
    }
    let is_in_range = values.iter().all(|value| value.abs() <= MAX_MAGNITUDE);
    if is_in_range {
        Ok(())
    } else {
        Err(DatasetError::OutOfRange { column, row, rule: "larger than 1e150" })
    }
}
