//! Residuals of the identification rows and the priors as a function of the unknowns, for solvers
//! outside of flexcal.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::fit::identification::identify_model;
use crate::fit::stages::placement::ASSUMED_SIGMA;
use crate::fit::{IdentifyError, Options, Placement, Strategy};
use crate::least_squares::{jacobian_and_residual, residual_vector};
use crate::measurement::Dataset;
use crate::model::parameter::Parameter;
use crate::model::{Model, PoseResiduals};
use crate::observation::Observation;
use crate::problem::Problem;

/// Number of residuals that [`PoseResiduals`] reserves for the measured numbers of each row; three
/// more follow if orientations are fitted.
const NUMBERS: usize = 3;

/// Whitened residuals of the identification rows and of the priors as a function of the unknowns.
///
/// r(x) consists of (measured − predicted) / σ for every measured number, and x / σ for every
/// unknown with a prior. Half its squared length is the cost that an identification with squared
/// loss minimises.
#[derive(Debug, Clone)]
pub struct ResidualFunction {
    model: Model,
    data: Arc<Dataset>,
    placement: Placement,
    /// Indices of the unknowns among the parameters of the model.
    unknowns: Vec<usize>,
    /// Full parameter vector of the registered nominal arm.
    start: DVector<f64>,
    /// 1 σ of a coordinate \[m\] in rows that state none: declared, or else assumed.
    sigma: f64,
    /// Declared 1 σ of an orientation about each axis \[rad\]; `None` if orientations are not
    /// fitted.
    turn_sigma: Option<f64>,
}

/// Measured number or prior from which one residual comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResidualOrigin {
    /// Number `coordinate` that a row of the table measures; 3 to 5 are the axes of an orientation.
    Measured {
        /// Index of the row in the table, from 0.
        row: usize,
        /// Index of the number among those of the row.
        coordinate: usize,
    },
    /// Prior of the unknown with this index.
    Prior(usize),
}

impl ResidualFunction {
    /// Creates the function for the parameters that `strategy` varies. It starts at the nominal
    /// arm, with free bases and targets fitted.
    ///
    /// # Errors
    /// Returns an error if problem, data and strategy are not compatible.
    pub fn new(
        problem: &Problem,
        data: Arc<Dataset>,
        strategy: Strategy,
    ) -> Result<Self, IdentifyError> {
        let placement = Placement::of(&data.measurements);
        let model = strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
        // The fit is only set up: it checks the input and registers the nominal arm.
        let options =
            Options { strategy, provisional: true, max_steps: Some(0), ..Options::default() };
        let set_up = identify_model(&model, problem, &data, &options)?;
        let index = |name: &String| model.parameters.iter().position(|known| known.name == *name);
        Ok(Self {
            unknowns: set_up.unknowns.iter().filter_map(index).collect(),
            start: set_up.registered_x,
            sigma: problem.data.position_sigma.unwrap_or(ASSUMED_SIGMA),
            turn_sigma: problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation),
            model,
            data,
            placement,
        })
    }

    /// Returns the unknowns, in the order of x.
    pub fn parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.unknowns.iter().map(|&k| &self.model.parameters[k])
    }

    /// Returns the unknowns x of the registered nominal arm, at which a fit starts: deviations from
    /// nominal.
    pub fn start(&self) -> DVector<f64> {
        DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|&k| self.start[k]))
    }

    /// Returns the origin of each residual, in their order.
    pub fn origins(&self) -> Vec<ResidualOrigin> {
        let is_turned = self.turn_sigma.is_some();
        let measured = self.data.split.identification.iter().flat_map(|&row| {
            let observation = self.data.measurements.observation(row);
            let turned = is_turned && self.is_oriented(row, observation);
            let turns = if turned { NUMBERS..2 * NUMBERS } else { 0..0 };
            let coordinates = (0..observation.coordinates()).chain(turns);
            coordinates.map(move |coordinate| ResidualOrigin::Measured { row, coordinate })
        });
        let priors = self.parameters().enumerate();
        let priors = priors.filter(|(_, parameter)| parameter.sigma.is_some());
        measured.chain(priors.map(|(unknown, _)| ResidualOrigin::Prior(unknown))).collect()
    }

    /// Returns the residuals r(x), without unit; NaN in rows where the arm has no equilibrium.
    pub fn residuals(&self, x: &DVector<f64>) -> DVector<f64> {
        let measured = self.without_padding(residual_vector(&self.rows(), x).as_slice());
        let priors = self.parameters().zip(x.iter());
        let priors = priors.filter_map(|(parameter, x)| Some(x / parameter.sigma?));
        DVector::from_vec(measured.into_iter().chain(priors).collect())
    }

    /// Returns the derivatives ∂r/∂x of the whitened residuals, shape = (residuals, unknowns).
    pub fn jacobian(&self, x: &DVector<f64>) -> DMatrix<f64> {
        let measured = jacobian_and_residual(&self.rows(), x).0;
        let origins = self.origins();
        let mut jacobian = DMatrix::zeros(origins.len(), self.unknowns.len());
        for (mut out, column) in jacobian.column_iter_mut().zip(measured.column_iter()) {
            let used = self.without_padding(column.as_slice());
            out.iter_mut().zip(used).for_each(|(out, value)| *out = value);
        }
        for (row, origin) in origins.iter().enumerate() {
            if let ResidualOrigin::Prior(unknown) = *origin {
                let sigma = self.model.parameters[self.unknowns[unknown]].sigma;
                jacobian[(row, unknown)] = sigma.map_or(0.0, f64::recip);
            }
        }
        jacobian
    }

    fn is_oriented(&self, row: usize, observation: Observation) -> bool {
        observation.is_position() && self.data.measurements.orientation(row).is_some()
    }

    /// Returns the identification rows as a least-squares problem.
    fn rows(&self) -> PoseResiduals<'_> {
        let rows = &self.data.split.identification;
        let sigmas = (self.sigma, self.turn_sigma);
        let poses = self.placement.oriented_poses(&self.data.measurements, rows, sigmas);
        PoseResiduals::new(&self.model, poses, self.unknowns.clone(), self.start.clone())
    }

    /// Returns `values` without the zeros that pad every identification row to the same number of
    /// residuals.
    fn without_padding(&self, values: &[f64]) -> Vec<f64> {
        let rows = &self.data.split.identification;
        let size = if rows.is_empty() { NUMBERS } else { values.len() / rows.len() };
        let mut used = Vec::with_capacity(values.len());
        for (&row, values) in rows.iter().zip(values.chunks(size.max(1))) {
            let observation = self.data.measurements.observation(row);
            let (numbers, turns) = values.split_at(NUMBERS.min(values.len()));
            used.extend(numbers.iter().take(observation.coordinates()));
            if self.turn_sigma.is_some() && self.is_oriented(row, observation) {
                used.extend(turns);
            }
        }
        used
    }
}
