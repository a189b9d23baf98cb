//! The lunar sampler: two elastic links, three elastic joints, loads on the deflected arm, and 32
//! parameters with priors.

use flexcal::fit::Placement;
use flexcal::least_squares::{Fit, LinearRows};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::Problem;
use nalgebra::{DMatrix, DVector};

/// The arm with its 28 identification poses.
pub struct Lunar {
    model: Model,
    data: Dataset,
    placement: Placement,
    sigma: f64,
}

impl Lunar {
    /// Reads `problems/lunar-sampler`.
    pub fn new() -> Self {
        let problem = Problem::read(&super::file("problems/lunar-sampler/problem.toml")).unwrap();
        let files = [super::file("problems/lunar-sampler/measurements.csv")];
        let (measurements, _) = Measurements::read(&files, &problem).unwrap();
        let placement = Placement::of(&measurements);
        Self {
            model: Model::new(&problem, &placement.bases, &placement.targets).unwrap(),
            data: Dataset::from_measurements(&problem, measurements).unwrap(),
            placement,
            sigma: problem.data.position_sigma.unwrap(),
        }
    }

    /// Returns the number of parameters.
    pub fn parameters(&self) -> usize {
        self.model.parameters.len()
    }

    /// Returns the number of identification poses.
    pub fn poses(&self) -> usize {
        self.data.split.identification.len()
    }

    /// Returns the residuals of the identification poses as a function of all parameters.
    pub fn residuals(&self) -> PoseResiduals<'_> {
        let n = self.parameters();
        let poses = self.placement.poses(
            &self.data.measurements,
            &self.data.split.identification,
            self.sigma,
        );
        PoseResiduals::new(&self.model, poses, (0..n).collect(), DVector::zeros(n))
    }

    /// Returns the objective of `residuals` and the priors of all parameters.
    pub fn fit<'a>(&self, residuals: &'a PoseResiduals<'a>) -> Fit<'a, PoseResiduals<'a>> {
        let weights =
            self.model.parameters.iter().map(|parameter| parameter.sigma.unwrap().recip());
        let matrix = DMatrix::from_diagonal(&DVector::from_iterator(self.parameters(), weights));
        Fit::new(residuals)
            .with_rows(LinearRows { matrix, constant: DVector::zeros(self.parameters()) })
            .unwrap()
    }
}
