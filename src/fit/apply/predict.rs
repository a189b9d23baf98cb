//! What an identified arm predicts, and what it leaves of measurements.

use std::collections::HashSet;

use nalgebra::{DVector, Vector3};

use crate::fit::identification::IdentifyError;
use crate::fit::outcome::Identification;
use crate::fit::stages::placement::Placement;
use crate::measurement::{Dataset, Measurements};
use crate::model::{Model, Pose};
use crate::observation::FixtureValues;
use crate::problem::{Observation, Problem};
use crate::spatial::Frame;

/// A measured pose and what a fit leaves of it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Residual {
    /// Row of the measurements, counted from 0.
    pub row: usize,
    /// Whether the row was held out.
    pub held_out: bool,
    /// What was predicted \[m\]: the position of the target in the measuring frame, also where that
    /// was at a point; a distance.
    pub predicted: Vector3<f64>,
    /// Measured − predicted position, measuring frame, or distance \[m\]; NaN where the identified
    /// arm has no equilibrium.
    pub position: Vector3<f64>,
    /// The same over 1 σ of a coordinate \[1\].
    pub whitened: Vector3<f64>,
    /// Rotation vector from the predicted to the measured orientation, measuring frame \[rad\],
    /// where orientation is fitted.
    pub orientation: Option<Vector3<f64>>,
    /// The same over 1 σ about an axis \[1\].
    pub whitened_orientation: Option<Vector3<f64>>,
    /// Whether the row is too far off to be noise: one of the fit's
    /// [outliers](Identification::outliers) or
    /// [held-out outliers](Identification::held_out_outliers).
    pub outlier: bool,
}

impl Residual {
    /// Length of everything that is left of the row over 1 σ of each part \[1\].
    pub fn length(&self) -> f64 {
        self.whitened.norm().hypot(self.whitened_orientation.map_or(0.0, |turn| turn.norm()))
    }
}

impl Identification {
    /// Positions of the identified arm in the poses of `rows`, measuring frame \[m\]; NaN where it
    /// has no equilibrium.
    ///
    /// The positions in `rows` do not matter ([`Dataset::poses`] makes rows without any); their
    /// sessions and targets have to be among those identified. `problem` is the one that was
    /// identified.
    ///
    /// # Errors
    /// A parameter of the problem, or of a session or target of `rows`, that was not identified, or
    /// one that was and that the problem lacks; configurations of another number of joints.
    pub fn predict(
        &self,
        problem: &Problem,
        rows: &Measurements,
    ) -> Result<Vec<Vector3<f64>>, IdentifyError> {
        let placement = Placement::of(rows);
        let model = self.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
        self.predict_with(&model, rows)
    }

    /// As [`predict`](Self::predict), with a model of the problem that the caller has changed.
    ///
    /// # Errors
    /// A parameter of the model that was not identified.
    pub fn predict_with(
        &self,
        model: &Model,
        rows: &Measurements,
    ) -> Result<Vec<Vector3<f64>>, IdentifyError> {
        let errors = self.errors(model, rows)?;
        Ok(rows.positions.iter().zip(errors).map(|(measured, error)| measured - error).collect())
    }

    /// What the identified arm leaves of every row, in the order of the rows.
    ///
    /// # Errors
    /// A parameter of the problem, or of a session or target of the data, that was not identified.
    pub fn residuals(
        &self,
        problem: &Problem,
        data: &Dataset,
    ) -> Result<Vec<Residual>, IdentifyError> {
        let Dataset { measurements, split } = data;
        let placement = Placement::of(measurements);
        let model = self.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
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
        let residual = |(row, position): (usize, Vector3<f64>)| Residual {
            row,
            predicted: in_space(measurements, row, (&fixtures, &bases), &position).0,
            held_out: split.held_out.binary_search(&row).is_ok(),
            position: in_space(measurements, row, (&fixtures, &bases), &position).1,
            whitened: position / sigma(row),
            orientation: turns.as_ref().map(|all| all[row]),
            whitened_orientation: turns.as_ref().map(|all| all[row] / turn_sigma),
            outlier: outliers.contains(&row),
        };
        Ok(errors.into_iter().enumerate().map(residual).collect())
    }

    /// Measured − predicted of every row, measuring frame \[m\].
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

    /// Rotation vectors from the predicted to the measured orientation of every row, measuring
    /// frame \[rad\], where it is fitted.
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

    /// Every row as a pose, its orientation with the σ `turn`; time counts from the first pose that
    /// was identified.
    fn poses<'a>(&self, rows: &'a Measurements, turn: Option<f64>) -> Vec<Pose<'a>> {
        let all: Vec<usize> = (0..rows.len()).collect();
        let mut poses = Placement::of(rows).oriented_poses(rows, &all, (1.0, turn));
        for pose in &mut poses {
            pose.setup.elapsed = pose.setup.time - self.first_time;
        }
        poses
    }

    /// The full parameter vector of a model with the parameters that were identified, by their
    /// names.
    pub(in crate::fit) fn vector(&self, model: &Model) -> Result<DVector<f64>, IdentifyError> {
        let x = model.parameters.iter().map(|parameter| {
            let place = self.estimates.iter().position(|estimate| estimate.name == parameter.name);
            place
                .map(|k| self.x[k])
                .ok_or_else(|| IdentifyError::NoEstimate { name: parameter.name.clone() })
        });
        let x = x.collect::<Result<Vec<f64>, _>>()?;
        let own = |name: &str| model.parameters.iter().any(|parameter| parameter.name == name);
        // Rows of one session need no base of another.
        let placed = |name: &str| name.starts_with("base") || name.starts_with("tool");
        if let Some(lost) =
            self.estimates.iter().find(|estimate| !own(&estimate.name) && !placed(&estimate.name))
        {
            return Err(IdentifyError::NotInModel { name: lost.name.clone() });
        }
        Ok(DVector::from_vec(x))
    }
}

/// What was predicted of a row, and what is left of it, measuring frame: of a contact with a point
/// the position of the target.
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
