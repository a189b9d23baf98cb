//! A solver of the caller, and predictions with their covariance.

use std::sync::Arc;

use flexcal::fit::{CustomSolver, IdentifyError, Options, SolverChoice, identify};
use flexcal::least_squares::Objective;
use flexcal::least_squares::solver::{Bounds, Solution, Termination};
use nalgebra::DVector;

use crate::common::arms::parse;
use crate::judged::{PRIORS, SIGMA, measured, text};

/// Undamped Gauss–Newton method.
struct GaussNewton;

impl CustomSolver for GaussNewton {
    fn minimise(
        &self,
        objective: &dyn Objective,
        mut x: DVector<f64>,
        _bounds: &Bounds,
        max_steps: u64,
    ) -> Solution {
        let (n, mut iterations, mut termination) = (x.len(), 0, Termination::IterationLimit);
        while iterations < max_steps {
            let linear = objective.linearise(&x);
            let step = linear.triangle.solve_upper_triangular(&-linear.projected).unwrap();
            iterations += 1;
            x += &step;
            if step.norm() < 1e-10 {
                termination = Termination::Cost;
                break;
            }
        }
        Solution {
            cost: objective.cost(&x),
            x,
            termination,
            iterations,
            cost_evaluations: 1,
            linearisations: iterations,
            at_bound: vec![None; n],
            at_limit: Vec::new(),
        }
    }
}

#[test]
fn a_solver_of_the_caller_comes_to_the_same_estimates() {
    let problem = parse(&text(PRIORS));
    let data = measured(&problem, 11);
    let own = Options::default().with_custom_solver(Arc::new(GaussNewton));
    let found = identify(&problem, &data, &own).unwrap();
    let expected = identify(&problem, &data, &Options::default()).unwrap();
    assert_eq!(found.solver, SolverChoice::Custom);
    assert!((&found.x - &expected.x).amax() < 1e-7, "{}", (&found.x - &expected.x).amax());
    let without = Options::default().with_solver(SolverChoice::Custom);
    let error = identify(&problem, &data, &without).unwrap_err();
    assert!(matches!(error, IdentifyError::NoCustomSolver), "{error}");
    let bounded = parse(&text("'joint*.a' = { min_mm = -5, max_mm = 5 }"));
    let error = identify(&bounded, &data, &own).unwrap_err();
    assert!(matches!(error, IdentifyError::BoundsIgnored { .. }), "{error}");
}

#[test]
fn predictions_scatter_as_their_covariance_says() {
    let problem = parse(&text(PRIORS));
    let mut squares = 0.0;
    let count = 12;
    for seed in 0..count {
        // The rows 60 and later are held out, with noise of SIGMA.
        let data = measured(&problem, 100 + seed);
        let found = identify(&problem, &data, &Options::default()).unwrap();
        let predicted = found.predict_with_covariance(&problem, &data.measurements).unwrap();
        for (measured, predicted) in data.measurements.positions.iter().zip(&predicted).skip(60) {
            let error = measured - predicted.position;
            let noise = nalgebra::Matrix3::identity() * SIGMA.powi(2);
            let whitened = (predicted.covariance + noise).cholesky().unwrap();
            squares += error.dot(&whitened.solve(&error)) / 90.0;
        }
    }
    let mean = squares / count as f64;
    assert!((0.9..1.1).contains(&mean), "{mean}");
}

#[test]
fn the_covariance_of_a_prediction_does_not_depend_on_the_sigma_of_a_row() {
    let problem = parse(&text(PRIORS));
    let data = measured(&problem, 99);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let mut rows = data.measurements;
    let plain = found.predict_with_covariance(&problem, &rows).unwrap();
    rows.sigma = Some(vec![2e-4; rows.len()]);
    let stated = found.predict_with_covariance(&problem, &rows).unwrap();
    for (plain, stated) in plain.iter().zip(&stated) {
        let difference = (plain.covariance - stated.covariance).norm();
        assert!(difference < 1e-12 * plain.covariance.norm(), "{difference}");
    }
}
