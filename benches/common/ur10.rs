//! A rigid UR10 with random parameter errors and noisy measurements.

use flexcal::least_squares::LeastSquares as _;
use flexcal::least_squares::solver::Bounds;
use flexcal::model::{Model, Pose, PoseResiduals};
use flexcal::problem::Problem;
use flexcal::problem::{Observation, PoseView};
use nalgebra::{DVector, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// Standard deviation of the noise of a coordinate [m].
pub const NOISE: f64 = 5e-5;
/// Standard deviation of the parameter errors: angles [rad], lengths [m].
const ERRORS: (f64, f64) = (4e-3, 2e-3);
/// Bounds of the unknowns [standard deviations of the parameter errors], narrow enough that a few
/// true values are outside.
const BOUND: f64 = 1.5;
/// A gross error is added to every `GROSS_INTERVAL`-th pose.
const GROSS_INTERVAL: usize = 10;
/// Largest gross error of a coordinate [m].
const GROSS_ERROR: f64 = 5e-3;
/// Parameters whose effect on positions other parameters have too: d of parallel axes, β where the
/// next link has an α, and those of the last link that the target's coordinates replace.
const REDUNDANT: [&str; 8] = [
    "joint1.beta",
    "joint2.d",
    "joint3.d",
    "joint4.beta",
    "joint5.beta",
    "joint6.theta",
    "joint6.d",
    "joint6.beta",
];

/// A UR10 and its measured poses.
pub struct Ur10 {
    pub model: Model,
    pub configurations: Vec<[f64; 6]>,
    pub measured: Vec<Vector3<f64>>,
    /// Indices of the 25 parameters that positions identify.
    pub identifiable: Vec<usize>,
    /// Indices of all 33 parameters of joints and target.
    pub geometric: Vec<usize>,
}

impl Ur10 {
    /// Measures `poses` random configurations, the same in every run.
    pub fn new(poses: usize) -> Self {
        let mut problem = Problem::read(&super::file("problems/ur10-ipa/problem.toml")).unwrap();
        problem.tool.target = Vector3::new(0.06, 0.04, 0.109);
        let model = Model::new(&problem, &[String::new()], &[String::new()]).unwrap();
        let names = || model.parameters.iter().map(|parameter| parameter.name.as_str()).enumerate();
        let geometric: Vec<usize> =
            names().filter(|(_, name)| !name.starts_with("base")).map(|(k, _)| k).collect();
        let identifiable = geometric.iter().copied();
        let identifiable =
            identifiable.filter(|&k| !REDUNDANT.contains(&model.parameters[k].name.as_str()));

        let mut random = ChaCha8Rng::seed_from_u64(2024);
        let normal = |random: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(random) };
        let mut truth = DVector::zeros(model.parameters.len());
        for k in identifiable.clone() {
            let angle = model.parameters[k].unit() == flexcal::quantity::Unit::Angle;
            truth[k] = normal(&mut random) * if angle { ERRORS.0 } else { ERRORS.1 };
        }
        let configurations: Vec<[f64; 6]> =
            (0..poses).map(|_| std::array::from_fn(|_| random.random_range(-3.0..3.0))).collect();
        let mut ur10 = Self {
            identifiable: identifiable.collect(),
            measured: vec![Vector3::zeros(); poses],
            configurations,
            geometric,
            model,
        };
        let errors = ur10.residuals_at(Vec::new(), truth).position_errors(&DVector::zeros(0));
        ur10.measured = errors
            .iter()
            .map(|error| Vector3::from_fn(|i, _| NOISE * normal(&mut random) - error[i]))
            .collect();
        ur10
    }

    /// Returns the residuals as a function of `unknowns`, with the other parameters nominal.
    pub fn residuals(&self, unknowns: &[usize]) -> PoseResiduals<'_> {
        self.residuals_at(unknowns.to_vec(), DVector::zeros(self.model.parameters.len()))
    }

    /// Returns the residuals as a function of `unknowns`, with the other parameters from `fixed`.
    fn residuals_at(&self, unknowns: Vec<usize>, fixed: DVector<f64>) -> PoseResiduals<'_> {
        let poses =
            self.configurations.iter().zip(&self.measured).map(|(configuration, measured)| Pose {
                setup: PoseView::from_configuration(configuration),
                base: 0,
                target: 0,
                observation: Observation::default(),
                measured,
                sigma: NOISE,
                orientation: None,
            });
        PoseResiduals::new(&self.model, poses.collect::<Vec<_>>(), unknowns, fixed)
    }

    /// Returns symmetric bounds of `unknowns` around their nominal values.
    pub fn bounds(&self, unknowns: &[usize]) -> Bounds {
        let angle = |&k: &usize| self.model.parameters[k].unit() == flexcal::quantity::Unit::Angle;
        let width = |k: &usize| BOUND * if angle(k) { ERRORS.0 } else { ERRORS.1 };
        let upper = DVector::from_iterator(unknowns.len(), unknowns.iter().map(width));
        Bounds::new(-&upper, upper).unwrap()
    }

    /// Adds gross errors to some of the measurements.
    pub fn with_gross_errors(mut self) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(2026);
        for measured in self.measured.iter_mut().step_by(GROSS_INTERVAL) {
            *measured += Vector3::from_fn(|_, _| random.random_range(-GROSS_ERROR..GROSS_ERROR));
        }
        self
    }

    /// Returns a point away from the nominal one, at which derivatives are compared.
    pub fn some_point(residuals: &PoseResiduals) -> DVector<f64> {
        DVector::from_fn(residuals.parameters(), |k, _| 2e-3 * (k as f64 + 0.5).sin())
    }
}
