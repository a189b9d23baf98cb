//! Predictions of an identified arm, and residuals of measurements.

use std::collections::HashSet;

use nalgebra::{DVector, Vector3};

use crate::error::InputError;
use crate::fit::IdentifyError;
use crate::fit::outcome::Identification;
use crate::fit::stages::placement::Placement;
use crate::measurement::{Dataset, Measurements};
use crate::model::{Model, Pose};
use crate::observation::FixtureValues;
use crate::problem::{Observation, Problem};
use crate::spatial::Frame;

/// Residual of a row of measurements, with its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Residual {
    /// Row of the measurements, counted from 0.
    pub row: usize,
    /// True if the row is held out.
    pub held_out: bool,
    /// Predicted value of what the row measures: for positions and contacts with a point, the
    /// position of the target, measuring frame \[m\]. Other rows have their numbers in the unit of
    /// their kind, a single number along x.
    pub predicted: Vector3<f64>,
    /// Residual measured − predicted: for positions and contacts with a point, that of the position
    /// of the target, measuring frame \[m\]. Other rows have their numbers in the unit of their
    /// kind, a single number along x. NaN if the arm has no equilibrium.
    pub position: Vector3<f64>,
    /// Residual of the measured numbers divided by 1 σ of a coordinate \[1\].
    pub whitened: Vector3<f64>,
    /// Rotation vector from the predicted to the measured orientation, measuring frame \[rad\];
    /// `None` if orientation is not fitted.
    pub orientation: Option<Vector3<f64>>,
    /// Residual `orientation` divided by 1 σ about an axis \[1\].
    pub whitened_orientation: Option<Vector3<f64>>,
    /// True if the residual is too large to be noise: the row is one of the fit's
    /// [outliers](Identification::outliers) or [held-out
    /// outliers](Identification::held_out_outliers).
    pub outlier: bool,
}

impl Residual {
    /// Returns the length of the whitened residual vector \[1\], orientation included.
    pub(crate) fn length(&self) -> f64 {
        self.whitened.norm().hypot(self.whitened_orientation.map_or(0.0, |turn| turn.norm()))
    }
}

impl Identification {
    /// Returns the model of `problem` that the strategy fitted, with the bases and targets of
    /// `placement`.
    pub(crate) fn model(
        &self,
        problem: &Problem,
        placement: &Placement,
    ) -> Result<Model, InputError> {
        let declared = Model::new(problem, &placement.bases, &placement.targets)?;
        Ok(self.strategy.model(declared))
    }

    /// Returns the base frame of each session of `rows`, measuring frame.
    pub(crate) fn base_frames(
        &self,
        problem: &Problem,
        rows: &Measurements,
    ) -> Result<Vec<Frame<f64>>, IdentifyError> {
        let model = self.model(problem, &Placement::of(rows))?;
        let x = self.vector(&model)?;
        Ok(model.base_frames(x.as_slice()))
    }

    /// Predicts the positions of the identified arm in the poses of `rows`, measuring frame \[m\];
    /// NaN where the arm has no equilibrium.
    ///
    /// The positions in `rows` are not used ([`Dataset::poses`] makes rows without any). Their
    /// sessions and targets must be among those identified. `problem` is the one that was
    /// identified.
    ///
    /// # Errors
    /// Returns an error if a parameter of the problem, or of a session or target of `rows`, was not
    /// identified, if the problem lacks an identified parameter, or if the number of joints
    /// differs.
    pub fn predict(
        &self,
        problem: &Problem,
        rows: &Measurements,
    ) -> Result<Vec<Vector3<f64>>, IdentifyError> {
        self.predict_with(&self.model(problem, &Placement::of(rows))?, rows)
    }

    /// Predicts positions as [`predict`](Self::predict) does, with a `model` that the caller may
    /// have changed.
    ///
    /// # Errors
    /// Returns an error if a parameter of the model was not identified.
    pub(crate) fn predict_with(
        &self,
        model: &Model,
        rows: &Measurements,
    ) -> Result<Vec<Vector3<f64>>, IdentifyError> {
        let errors = self.errors(model, &rows.with_sides(self.has_approach))?;
        Ok(rows.positions.iter().zip(errors).map(|(measured, error)| measured - error).collect())
    }

    /// Returns the residual of every row of `data`, in the order of the rows.
    ///
    /// # Errors
    /// Returns an error if a parameter of the problem, or of a session or target of the data, was
    /// not identified.
    pub fn residuals(
        &self,
        problem: &Problem,
        data: &Dataset,
    ) -> Result<Vec<Residual>, IdentifyError> {
        let Dataset { measurements, split } = data;
        let model = self.model(problem, &Placement::of(measurements))?;
        let errors = self.errors(&model, measurements)?;
        let turns = self.turns(problem, &model, measurements)?;
        let turn_sigma = problem.data.orientation_sigma.unwrap_or(f64::NAN);
        let sigma = |row: usize| measurements.sigma_of(row).unwrap_or(self.sigma);
        let outliers: HashSet<usize> = self
            .outliers
            .iter()
            .chain(&self.held_out_outliers)
            .map(|outlier| outlier.row)
            .collect();
        let x = self.vector(&model)?;
        let (fixtures, bases) = (model.fixtures(x.as_slice()), model.base_frames(x.as_slice()));
        let residual = |(row, error): (usize, Vector3<f64>)| {
            let (predicted, position) = in_space(measurements, row, (&fixtures, &bases), &error);
            Residual {
                row,
                predicted,
                held_out: split.held_out.binary_search(&row).is_ok(),
                position,
                whitened: error / sigma(row),
                orientation: turns.as_ref().map(|turns| turns[row]),
                whitened_orientation: turns.as_ref().map(|turns| turns[row] / turn_sigma),
                outlier: outliers.contains(&row),
            }
        };
        Ok(errors.into_iter().enumerate().map(residual).collect())
    }

    /// Returns the errors measured − predicted of every row: positions in the measuring frame
    /// \[m\], other rows in the unit of their kind.
    fn errors(
        &self,
        model: &Model,
        rows: &Measurements,
    ) -> Result<Vec<Vector3<f64>>, IdentifyError> {
        if rows.joints != model.joints() {
            return Err(IdentifyError::JointCount { found: rows.joints, joints: model.joints() });
        }
        Ok(model.residuals(self.poses(rows, None), &self.vector(model)?))
    }

    /// Returns the rotation vectors from the predicted to the measured orientation of every row,
    /// measuring frame \[rad\]; `None` where orientation is not fitted.
    fn turns(
        &self,
        problem: &Problem,
        model: &Model,
        rows: &Measurements,
    ) -> Result<Option<Vec<Vector3<f64>>>, IdentifyError> {
        let fitted = problem.data.fits_orientation && rows.orientations.is_some();
        if !fitted {
            return Ok(None);
        }
        Ok(Some(model.orientation_residuals(self.poses(rows, Some(1.0)), &self.vector(model)?)))
    }

    /// Returns every row as a pose. `turn` is 1 σ of its orientation \[rad\], or `None` to leave
    /// out orientations. The elapsed time of a pose is that since the start of its session in the
    /// identification.
    pub(in crate::fit) fn poses<'a>(
        &self,
        rows: &'a Measurements,
        turn: Option<f64>,
    ) -> Vec<Pose<'a>> {
        let all_rows: Vec<usize> = (0..rows.len()).collect();
        let placement = Placement::of(rows);
        let mut poses = placement.oriented_poses(rows, &all_rows, (1.0, turn));
        placement.count_time_from(&self.start_times, &mut poses);
        poses
    }

    /// Returns the full parameter vector of `model`, with the estimated deviations of the
    /// parameters of the same names.
    ///
    /// # Errors
    /// Returns an error if a parameter of `model` was not identified, or if `model` lacks an
    /// identified parameter other than those of bases and tools.
    pub(crate) fn vector(&self, model: &Model) -> Result<DVector<f64>, IdentifyError> {
        let x = model.parameters.iter().map(|parameter| {
            let place = self.estimates.iter().position(|estimate| estimate.name == parameter.name);
            place
                .map(|k| self.x[k])
                .ok_or_else(|| IdentifyError::NoEstimate { name: parameter.name.clone() })
        });
        let x = x.collect::<Result<Vec<f64>, _>>()?;
        let is_in_model = |name: &str| model.parameters.iter().any(|known| known.name == name);
        // Rows of one session do not need the base of another.
        let placed = |name: &str| name.starts_with("base") || name.starts_with("tool");
        if let Some(lost) = self
            .estimates
            .iter()
            .find(|estimate| !is_in_model(&estimate.name) && !placed(&estimate.name))
        {
            return Err(IdentifyError::NotInModel { name: lost.name.clone() });
        }
        Ok(DVector::from_vec(x))
    }
}

/// Returns the predicted value and the residual of a row. For a contact with a point, both are
/// converted to the position of the target in the measuring frame \[m\]; the residuals of such rows
/// are in the base frame.
pub(in crate::fit) fn in_space(
    rows: &Measurements,
    row: usize,
    (fixtures, bases): (&[FixtureValues<f64>], &[Frame<f64>]),
    residual: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    match rows.observation(row) {
        Observation::Point(point) => {
            let residual = bases[rows.session.of_row[row]].vector(residual);
            (fixtures[point].position() - residual, residual)
        }
        _ => (rows.positions[row] - residual, *residual),
    }
}
