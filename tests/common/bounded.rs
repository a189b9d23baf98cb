//! Lunar sampler within bounds and constraints as a solver problem: declared σ, start at nominal
//! values.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::path::Path;

use flexcal::fit::Placement;
use flexcal::least_squares::solver::{Bounds, Inequalities};
use flexcal::least_squares::{Fit, LinearRows};
use flexcal::measurement::Dataset;
use flexcal::model::parameter::{LinearConstraint, Parameter};
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::Problem;
use nalgebra::{DMatrix, DVector};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cases/bounded");

/// Problem of `tests/cases/bounded`.
pub struct Bounded {
    pub problem: Problem,
    pub data: Dataset,
    pub model: Model,
    pub bounds: Bounds,
    pub rows: Inequalities,
    placement: Placement,
}

/// Spacing of the rows with gross errors in [`Bounded::with_gross_errors`], and the error along x [m].
const SPOILT: (usize, f64) = (7, 5e-3);

impl Bounded {
    pub fn read(name: &str) -> Self {
        Self::of(Problem::read(&Path::new(FOLDER).join(format!("{name}.toml"))).unwrap())
    }

    pub fn of(problem: Problem) -> Self {
        let (data, _) = Dataset::read(&problem).unwrap();
        let placement = Placement::of(&data.measurements);
        let model = Model::new(&problem, &placement.bases, &placement.targets).unwrap();
        let (n, m) = (model.parameters.len(), model.constraints.len());
        let limit =
            |of: fn(&Parameter) -> f64| DVector::from_iterator(n, model.parameters.iter().map(of));
        let bounds =
            Bounds::new(limit(|limits| limits.lower), limit(|limits| limits.upper)).unwrap();
        let mut matrix = DMatrix::zeros(m, n);
        for (i, constraint) in model.constraints.iter().enumerate() {
            constraint.terms.iter().for_each(|&(k, coefficient)| matrix[(i, k)] = coefficient);
        }
        let side = |of: fn(&LinearConstraint) -> f64| {
            DVector::from_iterator(m, model.constraints.iter().map(of))
        };
        let rows = Inequalities::new(
            matrix,
            side(|constraint| constraint.lower),
            side(|constraint| constraint.upper),
        )
        .unwrap();
        Self { problem, data, model, bounds, rows, placement }
    }

    /// Adds gross errors to the measurements.
    pub fn with_gross_errors(mut self) -> Self {
        self.data
            .measurements
            .positions
            .iter_mut()
            .step_by(SPOILT.0)
            .for_each(|position| position.x += SPOILT.1);
        self
    }

    pub fn nominal(&self) -> DVector<f64> {
        DVector::zeros(self.model.parameters.len())
    }

    pub fn residuals(&self) -> PoseResiduals<'_> {
        let sigma = self.problem.data.position_sigma.unwrap();
        let poses =
            self.placement.poses(&self.data.measurements, &self.data.split.identification, sigma);
        PoseResiduals::new(
            &self.model,
            poses,
            (0..self.model.parameters.len()).collect(),
            self.nominal(),
        )
    }

    pub fn priors(&self) -> LinearRows {
        let weights =
            self.model.parameters.iter().map(|parameter| parameter.sigma.map_or(0.0, f64::recip));
        let matrix =
            DMatrix::from_diagonal(&DVector::from_iterator(self.model.parameters.len(), weights));
        LinearRows { matrix, constant: self.nominal() }
    }

    /// Returns the objective with the priors.
    pub fn fit<'a>(&self, residuals: &'a PoseResiduals<'a>) -> Fit<'a, PoseResiduals<'a>> {
        Fit::new(residuals).with_rows(self.priors()).unwrap()
    }
}
