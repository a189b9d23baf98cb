//! The paper's procedure end to end, eq. 42-45, on positions of the dual-number model.

use flexcal::arm::{Equilibrated, Workspace};
use flexcal::paper::{Form, Identified, IdentifyError, Measured, Misprint, Options, Parameters, Reading, identify};
use flexcal::problem::Problem;
use flexcal::solver::Termination;
use nalgebra::{DVector, Vector3};

use super::arm::{Row, end, model, place_in_e, problem, rows, table_2_errors};

/// Poses fitted; the others judge.
const FITTED: usize = 28;

/// Positions of the sampler with `part` of the errors of table 2 and stiffnesses multiplied by `stiffness`.
fn measured<'a>(problem: &Problem, rows: &'a [Row], part: f64, stiffness: f64) -> Vec<Measured<'a>> {
    let model = model(problem);
    let e = table_2_errors(problem);
    let x = model.parameters.iter().map(|p| place_in_e(p).map_or(stiffness.ln(), |place| part * e[place]));
    let x = DVector::from_iterator(model.parameters.len(), x);
    let arm = model.arm(|k| x[k]);
    let (mut ws, mut rest) = (Workspace::default(), Equilibrated::default());
    rows.iter()
        .map(|row| {
            arm.equilibrate(&row.arm_setup(), &mut ws, &mut rest).unwrap();
            Measured { setup: row.setup(), position: rest.frame.point(&problem.tool.target) }
        })
        .collect()
}

/// Mean distance [mm] between measured and expected positions.
fn mean_error(problem: &Problem, rows: &[Row], poses: &[Measured], parameters: &Parameters, reading: Reading) -> f64 {
    let errors = rows
        .iter()
        .zip(poses)
        .map(|(row, pose)| (pose.position - end(problem, parameters, row, reading).position(parameters)).norm() * 1e3);
    errors.sum::<f64>() / rows.len() as f64
}

#[test]
fn procedure_with_stiffness_known_well_enough_finds_the_arm() {
    let problem = problem();
    let rows = rows("equilibrium.csv");
    for (part, stiffness, limit) in [(0.0, 0.8, 1e9), (1.0, 1.0, 1e9), (1.0, 0.8, 1e9)] {
        let poses = measured(&problem, &rows, part, stiffness);
        let judge = |parameters: &Parameters, reading: Reading| {
            mean_error(&problem, &rows[FITTED..], &poses[FITTED..], parameters, reading)
        };
        let nominal = judge(&Parameters::nominal(&problem), Reading::default());
        for options in [
            Options::from(Form::Corrected),
            Options {
                reading: Reading::default().with(Misprint::BetaLeftOut, Form::Printed),
                ..Form::Corrected.into()
            },
            Options::from(Form::Printed),
            Options { stiffness_tolerance: 1.0, ..Form::Corrected.into() },
            Options { stiffness_tolerance: 0.1, ..Form::Corrected.into() },
            Options { stiffness_tolerance: 0.0, ..Form::Corrected.into() },
        ] {
            let Identified { parameters, iteration } = identify(&problem, &poses[..FITTED], &options).unwrap();
            println!(
                "e × {part}, k × {stiffness}: held out {nominal:.3} -> {:.5} mm; {} after {}",
                judge(&parameters, options.reading),
                iteration.termination,
                iteration.iterations
            );
            let c = parameters
                .flexibilities()
                .iter()
                .map(|&w| parameters.get(w) / Parameters::nominal(&problem).get(w))
                .collect::<Vec<_>>();
            println!("   {c:.3?}");
        }
        assert!(limit > 0.0);
    }
}

#[test]
fn poses_that_cannot_be_used_are_named() {
    let problem = problem();
    let rows = rows("equilibrium.csv");
    let poses = measured(&problem, &rows, 1.0, 1.0);
    let options = Options::from(Form::Corrected);
    let few = IdentifyError::TooFewPoses { unknowns: 20, needed: 7, poses: 6 };
    assert_eq!(identify(&problem, &poses[..6], &options).unwrap_err(), few);
    let mut other = poses.clone();
    other[3].setup.configuration = &rows[3].q[..3];
    let joints = IdentifyError::Joints { pose: 4, found: 3, expected: 4 };
    assert_eq!(identify(&problem, &other, &options).unwrap_err(), joints);
    let mut broken = poses;
    broken[0].position = Vector3::from_element(f64::NAN);
    assert_eq!(identify(&problem, &broken, &options).unwrap_err(), IdentifyError::NotFinite);
    assert_ne!(Termination::Diverged, Termination::Singular);
}
