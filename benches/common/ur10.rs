//! A rigid UR10 with errors drawn at random, measured with noise.

use flexcal::least_squares::LeastSquares as _;
use flexcal::least_squares::solver::Bounds;
use flexcal::model::{Model, Pose, PoseResiduals};
use flexcal::problem::Problem;
use flexcal::problem::{Observation, PoseView};
use nalgebra::{DVector, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// 1 σ of a measured coordinate [m].
pub const NOISE: f64 = 5e-5;
/// 1 σ of the errors of the arm: angles [rad], lengths [m].
const ERRORS: (f64, f64) = (4e-3, 2e-3);
/// Bounds of the unknowns [σ of the errors]: a few of the true values lie beyond.
const WITHIN: f64 = 1.5;
/// Every so many-th pose has a gross error of up to so much on each coordinate [m].
const GROSS: (usize, f64) = (10, 5e-3);
/// Parameters that positions cannot tell from others: d of parallel axes, β where the next link has
/// an α, and those of the last link that the target's coordinates replace.
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
    /// The 25 parameters that positions identify.
    pub identifiable: Vec<usize>,
    /// All 33 of joints and target.
    pub geometric: Vec<usize>,
}

impl Ur10 {
    /// With `poses` random configurations, the same on every run.
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

    /// Residuals as a function of `unknowns`.
    pub fn residuals(&self, unknowns: &[usize]) -> PoseResiduals<'_> {
        self.residuals_at(unknowns.to_vec(), DVector::zeros(self.model.parameters.len()))
    }

    fn residuals_at(&self, unknowns: Vec<usize>, at: DVector<f64>) -> PoseResiduals<'_> {
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
        PoseResiduals::new(&self.model, poses.collect::<Vec<_>>(), unknowns, at)
    }

    /// Bounds on `unknowns`.
    pub fn bounds(&self, unknowns: &[usize]) -> Bounds {
        let angle = |&k: &usize| self.model.parameters[k].unit() == flexcal::quantity::Unit::Angle;
        let width = |k: &usize| WITHIN * if angle(k) { ERRORS.0 } else { ERRORS.1 };
        let upper = DVector::from_iterator(unknowns.len(), unknowns.iter().map(width));
        Bounds::new(-&upper, upper).unwrap()
    }

    /// The same arm with gross errors among its measurements.
    pub fn with_gross_errors(mut self) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(2026);
        for measured in self.measured.iter_mut().step_by(GROSS.0) {
            *measured += Vector3::from_fn(|_, _| random.random_range(-GROSS.1..GROSS.1));
        }
        self
    }

    /// A parameter vector away from nominal, where derivatives are compared.
    pub fn some_point(residuals: &PoseResiduals) -> DVector<f64> {
        DVector::from_fn(residuals.parameters(), |k, _| 2e-3 * (k as f64 + 0.5).sin())
    }
}
