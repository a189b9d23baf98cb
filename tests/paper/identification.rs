//! Complete procedure of the paper, eq. 42-45, on positions of the dual-number model.

use flexcal::least_squares::solver::Termination;
use flexcal::mechanics::{StaticState, Workspace};
use flexcal::paper::{
    Form, Identified, IdentifyError, Measured, Misprint, Options, Parameters, Reading,
    StiffnessStage, identify,
};
use flexcal::problem::Problem;
use nalgebra::{DVector, Vector3};

use super::arm::{end, model, place_in_e, problem, table_2_errors};
use crate::common::golden::{GoldenRow, golden_rows};

/// Number of fitted poses; the others are held out.
const FITTED: usize = 28;

/// Simulates positions of the sampler with a fraction `part` of the errors of table 2 and
/// stiffnesses multiplied by `stiffness`.
fn measured<'a>(
    problem: &Problem,
    rows: &'a [GoldenRow],
    part: f64,
    stiffness: f64,
) -> Vec<Measured<'a>> {
    let model = model(problem);
    let e = table_2_errors(problem);
    let x = model
        .parameters
        .iter()
        .map(|p| place_in_e(p).map_or(stiffness.ln(), |place| part * e[place]));
    let x = DVector::from_iterator(model.parameters.len(), x);
    let arm = model.arm(|k| x[k]);
    let (mut ws, mut rest) = (Workspace::default(), StaticState::default());
    rows.iter()
        .map(|row| {
            arm.equilibrate(&row.setup(), &mut ws, &mut rest).unwrap();
            Measured { setup: row.setup(), position: rest.frame.point(&problem.tool.target) }
        })
        .collect()
}

/// Returns the mean distance [mm] between measured and predicted positions.
fn mean_error(
    problem: &Problem,
    rows: &[GoldenRow],
    poses: &[Measured],
    parameters: &Parameters,
    reading: Reading,
) -> f64 {
    let errors = rows.iter().zip(poses).map(|(row, pose)| {
        (pose.position - end(problem, parameters, row, reading).position(parameters)).norm() * 1e3
    });
    errors.sum::<f64>() / rows.len() as f64
}

struct Case<'a> {
    problem: &'a Problem,
    rows: &'a [GoldenRow],
    poses: Vec<Measured<'a>>,
}

impl Case<'_> {
    /// Identifies, and returns the mean error at the other poses [mm].
    fn run(&self, options: Options) -> (Identified, f64) {
        let found = identify(self.problem, &self.poses[..FITTED], &options).unwrap();
        let error = self.judge(&found.parameters, options.reading);
        let Identified { iteration, .. } = &found;
        println!("{error:.4} mm; {} after {} steps", iteration.termination, iteration.iterations);
        (found, error)
    }

    fn judge(&self, parameters: &Parameters, reading: Reading) -> f64 {
        mean_error(self.problem, &self.rows[FITTED..], &self.poses[FITTED..], parameters, reading)
    }
}

fn corrected(stiffness: StiffnessStage) -> Options {
    Options::new(Form::Corrected, stiffness)
}

#[test]
fn stiffness_first_works_where_the_geometry_is_nominal() {
    let (problem, rows) = (problem(), golden_rows("equilibrium.csv"));
    let case = Case { problem: &problem, rows: &rows, poses: measured(&problem, &rows, 0.0, 0.8) };
    assert!(case.judge(&Parameters::nominal(&problem), Reading::default()) > 7.0);
    let (found, error) = case.run(corrected(StiffnessStage::Positions));
    assert!(error < 0.2 && found.iteration.termination.converged());
    // The remaining error is of second order: positions move along arcs, D_f does not.
    let (_, error) = case.run(corrected(StiffnessStage::Nominal));
    assert!(
        (1.0..2.5).contains(&error),
        "a stiffness known wrongly by a fifth is made up for by geometry, in part"
    );
}

#[test]
fn geometry_is_found_with_the_stiffness_known() {
    let (problem, rows) = (problem(), golden_rows("equilibrium.csv"));
    let case = Case { problem: &problem, rows: &rows, poses: measured(&problem, &rows, 1.0, 1.0) };
    assert!(case.judge(&Parameters::nominal(&problem), Reading::default()) > 40.0);
    let (found, error) = case.run(corrected(StiffnessStage::Nominal));
    assert!(
        error < 0.1 && found.iteration.termination.converged() && found.iteration.iterations <= 10
    );
}

#[test]
fn untruncated_iteration_of_all_5n_parameters_diverges_and_says_so() {
    let (problem, rows) = (problem(), golden_rows("equilibrium.csv"));
    let case = Case { problem: &problem, rows: &rows, poses: measured(&problem, &rows, 1.0, 1.0) };
    let mut options = corrected(StiffnessStage::Nominal);
    options.iteration.tolerance = 0.0;
    let (found, _) = case.run(options);
    assert_eq!(found.iteration.termination, Termination::Diverged);
}

#[test]
fn one_sweep_takes_geometric_errors_for_deflection() {
    let (problem, rows) = (problem(), golden_rows("equilibrium.csv"));
    let case = Case { problem: &problem, rows: &rows, poses: measured(&problem, &rows, 1.0, 1.0) };
    let (found, error) = case.run(corrected(StiffnessStage::Positions));
    assert!((5.0..15.0).contains(&error));
    let nominal = Parameters::nominal(&problem);
    let times: Vec<f64> =
        nominal.flexibilities().iter().map(|&c| found.parameters.get(c) / nominal.get(c)).collect();
    println!("flexibilities over nominal {times:.2?}");
    assert!(times.iter().any(|&c| c > 5.0) && times.iter().any(|&c| c < 0.0));
}

#[test]
fn printed_forms_find_the_arm_less_well() {
    let (problem, rows) = (problem(), golden_rows("equilibrium.csv"));
    let case = Case { problem: &problem, rows: &rows, poses: measured(&problem, &rows, 1.0, 1.0) };
    let (found, printed) = case.run(Options::new(Form::Printed, StiffnessStage::Nominal));
    assert!(found.iteration.termination.converged(), "what the authors can have run");
    let (_, right) = case.run(corrected(StiffnessStage::Nominal));
    let (_, rigid) = case.run(corrected(StiffnessStage::Rigid));
    assert!(printed > 5.0 * right && rigid > 5.0 * right, "{printed} {right} {rigid}");
    for misprint in Misprint::EACH {
        print!("{misprint:?} alone: ");
        let (found, error) = case.run(Options::new(misprint, StiffnessStage::Nominal));
        assert!(error > 0.9 * right);
        let hopeless = [Misprint::GeometricSide, Misprint::EndFrame];
        assert_eq!(
            found.iteration.termination.converged(),
            !hopeless.contains(&misprint),
            "{misprint:?}"
        );
    }
}

#[test]
fn load_differences_find_the_stiffness_beside_geometric_errors() {
    let (problem, rows) = (problem(), golden_rows("equilibrium.csv"));
    // Every pose is measured again under a load that lifts the arm.
    let lifted = |row: &GoldenRow| GoldenRow {
        q: row.q.clone(),
        payload: 0.0,
        hoist: row.hoist + 15.0,
        values: Vec::new(),
    };
    let again = rows.iter().map(lifted);
    let twice: Vec<GoldenRow> = again.collect();
    let poses = measured(&problem, &rows, 1.0, 0.8);
    let both = [&poses[..FITTED], &measured(&problem, &twice[..FITTED], 1.0, 0.8)].concat();
    let (case, options) = (
        Case { problem: &problem, rows: &rows, poses },
        corrected(StiffnessStage::LoadDifferences),
    );
    let found = identify(&problem, &both, &options).unwrap();
    let error = case.judge(&found.parameters, options.reading);
    let positions = identify(&problem, &both, &corrected(StiffnessStage::Positions)).unwrap();
    let misled = case.judge(&positions.parameters, options.reading);
    println!("stage 1 from load differences {error:.4} mm, from positions {misled:.4} mm");
    assert!(error < 1.0 && misled > 5.0 * error);
    let single = identify(&problem, &case.poses[..FITTED], &options).unwrap_err();
    assert_eq!(single, IdentifyError::NoLoadDifferences);
}

#[test]
fn poses_that_cannot_be_used_are_named() {
    let problem = problem();
    let rows = golden_rows("equilibrium.csv");
    let poses = measured(&problem, &rows, 1.0, 1.0);
    let options = corrected(StiffnessStage::Positions);
    let few = IdentifyError::TooFewPoses { unknowns: 20, needed: 7, poses: 6 };
    assert_eq!(identify(&problem, &poses[..6], &options).unwrap_err(), few);
    let mut other = poses.clone();
    other[3].setup.configuration = &rows[3].q[..3];
    let joints = IdentifyError::Joints { pose: 4, found: 3, expected: 4 };
    assert_eq!(identify(&problem, &other, &options).unwrap_err(), joints);
    let mut broken = poses;
    broken[0].position = Vector3::from_element(f64::NAN);
    assert_eq!(identify(&problem, &broken, &options).unwrap_err(), IdentifyError::NotFinite);
}
