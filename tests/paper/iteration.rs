//! Solvers of eq. 45: pseudo-inverse iteration and argmin's Gauss–Newton method.

use flexcal::least_squares::solver::{
    Divergence, GaussNewtonSettings, PseudoInverseSettings, Settings, Termination, minimise,
    minimise_gauss_newton, minimise_pseudo_inverse,
};
use flexcal::least_squares::{Fit, jacobian};
use flexcal::model::{Model, Pose, PoseResiduals};
use nalgebra::{DVector, Vector3};

use super::arm::{model, problem, rigid};
use crate::common::golden::{GoldenRow, golden_rows};

/// Returns exact poses of the rigid arm with the geometry of table 2.
fn poses(rows: &[GoldenRow]) -> Vec<Pose<'_>> {
    let pose = |row| Pose {
        setup: GoldenRow::setup(row),
        base: 0,
        target: 0,
        observation: flexcal::problem::Observation::default(),
        measured: &row.values[1],
        sigma: 1.0,
        orientation: None,
    };
    rows.iter().map(pose).collect()
}

/// Returns the parameters that the poses separate, in descending order of visibility.
fn identifiable(model: &Model, poses: &[Pose]) -> Vec<usize> {
    let n = model.parameters.len();
    let x = DVector::zeros(n);
    let all = PoseResiduals::new(model, poses.to_vec(), (0..n).collect(), x.clone());
    let qr = jacobian(&all, &x).col_piv_qr();
    let diagonal = qr.r().diagonal();
    let rank = diagonal.iter().filter(|value| value.abs() > 1e-6 * diagonal[0].abs()).count();
    let mut order = DVector::from_fn(n, |k, _| k as f64).transpose();
    qr.p().permute_columns(&mut order);
    (0..rank).map(|k| (0..n).find(|&j| (order[k] - j as f64).abs() < 0.5).unwrap()).collect()
}

fn rms(errors: &[Vector3<f64>]) -> f64 {
    (errors.iter().map(Vector3::norm_squared).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn converges_on_identifiable_parameters() {
    let problem = rigid(problem());
    let model = model(&problem);
    let rows = golden_rows("rigid.csv");
    let poses = poses(&rows);
    let unknowns = identifiable(&model, &poses);
    let n = model.parameters.len();
    println!("{} of {n} geometric parameters are identifiable", unknowns.len());
    assert!((10..n).contains(&unknowns.len()));
    let fit = PoseResiduals::new(&model, poses, unknowns.clone(), DVector::zeros(n));
    let start = || DVector::zeros(unknowns.len());
    let settings = PseudoInverseSettings { tolerance: 0.0, ..Default::default() };
    let ours = minimise_pseudo_inverse(Fit::new(&fit), start(), &settings);
    println!(
        "pseudo-inverse: {} after {} steps, cost {:.1e}",
        ours.termination, ours.iterations, ours.cost
    );
    assert!(ours.termination.converged() && ours.iterations < 10);
    assert_eq!(ours.linearisations, ours.iterations + 1);
    assert!(rms(&fit.position_errors(&ours.x)) < 2e-9);
    let argmin = minimise_gauss_newton(Fit::new(&fit), start(), &GaussNewtonSettings::default());
    println!(
        "Gauss–Newton: {} after {} steps, cost {:.1e}",
        argmin.termination, argmin.iterations, argmin.cost
    );
    assert_eq!(argmin.termination, Termination::Unchanged);
    let damped = minimise(Fit::new(&fit), start(), &Settings::default());
    assert!((&ours.x - &damped.x).amax() < 1e-7 && (&ours.x - &argmin.x).amax() < 1e-7);
}

#[test]
fn with_all_redundant_columns_diverges_untruncated_and_says_so() {
    let problem = rigid(problem());
    let model = model(&problem);
    let rows = golden_rows("rigid.csv");
    let n = model.parameters.len();
    let fit = PoseResiduals::new(&model, poses(&rows), (0..n).collect(), DVector::zeros(n));
    let start = || DVector::zeros(n);
    let before = rms(&fit.position_errors(&start()));

    let untruncated = PseudoInverseSettings { tolerance: 0.0, ..Default::default() };
    let lost = minimise_pseudo_inverse(Fit::new(&fit), start(), &untruncated);
    println!(
        "untruncated: {} after {} steps, best cost {:.1e}",
        lost.termination, lost.iterations, lost.cost
    );
    assert_eq!(lost.termination, Termination::Diverged);
    assert!(!lost.termination.converged());
    assert!(rms(&fit.position_errors(&lost.x)) <= before, "the best point seen is handed back");

    let truncated = PseudoInverseSettings { tolerance: 1e-6, ..Default::default() };
    let found = minimise_pseudo_inverse(Fit::new(&fit), start(), &truncated);
    println!(
        "truncated: {} after {} steps, cost {:.1e}",
        found.termination, found.iterations, found.cost
    );
    assert!(found.termination.converged());
    assert!(rms(&fit.position_errors(&found.x)) < 2e-9);

    let argmin = minimise_gauss_newton(Fit::new(&fit), start(), &GaussNewtonSettings::default());
    println!(
        "Gauss–Newton: {} after {} steps, best cost {:.1e}",
        argmin.termination, argmin.iterations, argmin.cost
    );
    assert!(!argmin.termination.converged());
}

#[test]
fn gauss_newton_reports_a_singular_jacobian() {
    let problem = rigid(problem());
    let model = model(&problem);
    let rows = golden_rows("rigid.csv");
    // With the target on axis 4, θ₄ moves nothing.
    let mut on_axis = problem.clone();
    on_axis.tool.target.fill(0.0);
    let hidden = Model::new(&on_axis, &[String::new()], &[String::new()]).unwrap();
    let unknowns = (0..model.parameters.len())
        .filter(|&k| model.parameters[k].name == "joint4.theta")
        .collect();
    let fit =
        PoseResiduals::new(&hidden, poses(&rows), unknowns, DVector::zeros(model.parameters.len()));
    let solution =
        minimise_gauss_newton(Fit::new(&fit), DVector::zeros(1), &GaussNewtonSettings::default());
    println!("Gauss–Newton: {}", solution.termination);
    assert_eq!(solution.termination, Termination::Singular);
    assert_eq!(solution.x, DVector::zeros(1));
    let solution = minimise_pseudo_inverse(
        Fit::new(&fit),
        DVector::zeros(1),
        &PseudoInverseSettings::default(),
    );
    assert_eq!((solution.termination, solution.x[0]), (Termination::Step, 0.0));
}

#[test]
fn starts_that_cannot_be_used_are_named() {
    let problem = rigid(problem());
    let model = model(&problem);
    let rows = golden_rows("rigid.csv");
    let n = model.parameters.len();
    let fit = PoseResiduals::new(&model, poses(&rows), (0..n).collect(), DVector::zeros(n));
    let settings = PseudoInverseSettings {
        divergence: Divergence { growth: 1.0, patience: 0 },
        ..Default::default()
    };
    let solve = |start| minimise_pseudo_inverse(Fit::new(&fit), start, &settings).termination;
    assert_eq!(solve(DVector::zeros(n + 1)), Termination::SizeMismatch);
    assert_eq!(solve(DVector::from_element(n, f64::NAN)), Termination::OutsideDomainAtStart);
    let solve = |start| {
        minimise_gauss_newton(Fit::new(&fit), start, &GaussNewtonSettings::default()).termination
    };
    assert_eq!(solve(DVector::zeros(n + 1)), Termination::SizeMismatch);
    assert_eq!(solve(DVector::from_element(n, f64::NAN)), Termination::OutsideDomainAtStart);
    let one = PseudoInverseSettings { max_iterations: 1, ..Default::default() };
    let solution = minimise_pseudo_inverse(Fit::new(&fit), DVector::zeros(n), &one);
    assert_eq!(solution.termination, Termination::IterationLimit);
}
