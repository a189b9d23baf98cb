//! An effect that no catalogue holds, added by a user of the library without touching it: the walk-through of
//! docs/effects.md.

mod common;

use common::arms::golden_problem;
use common::made::{at_random, divided, normal};
use flexcal::identify::{Options, Placement, identify_model};
use flexcal::least_squares::jacobian;
use flexcal::measurement::Measurements;
use flexcal::model::effect::{Term, named};
use flexcal::model::parameter::{ArmField, Driver, JointField, Quantity, Slot};
use flexcal::model::{Model, PoseResiduals, TermsError};
use flexcal::problem::Problem;
use nalgebra::{DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A motor that warms up while the arm works: joint 3 creeps with time, and sags by a bump of the payload that it carries.
fn creep(joint: usize) -> Vec<Term> {
    let slot = Slot::Joint { joint: joint - 1, field: JointField::Theta };
    let heavy = Driver::Spline { of: Quantity::Payload, begin: 0.0, step: 0.5 };
    vec![Term::driven("rate", slot, Driver::Elapsed, 1e-6), Term::driven("sag", slot, heavy, 1e-3)]
}

fn model(problem: &Problem, rows: &Measurements, terms: Vec<Term>) -> Result<Model, TermsError> {
    let Placement { bases, targets, .. } = Placement::of(rows);
    Model::with_terms(problem, &bases, &targets, &named("joint-creep", "3", terms))
}

fn bench() -> (Problem, Measurements) {
    let mut problem = golden_problem();
    problem.data.position_sigma = Some(2e-5);
    let mut rows = at_random(&problem, 40, 1.2, &mut ChaCha8Rng::seed_from_u64(1));
    rows.payload = Some((0..40).map(|k| 0.5 * f64::from(k % 5)).collect());
    rows.time = (0..40).map(|k| 90.0 * f64::from(k)).collect();
    (problem, rows)
}

#[test]
fn an_effect_of_one_s_own_is_fitted_beside_the_declared_model() {
    let (problem, mut rows) = bench();
    let model = model(&problem, &rows, creep(3)).unwrap();
    let place = |name: &str| model.parameters.iter().position(|parameter| parameter.name == name).unwrap();
    let (rate, sag) = (place("joint-creep[3].rate"), place("joint-creep[3].sag"));
    assert_eq!(model.parameters[rate].sigma, Some(1e-6));

    let mut truth = DVector::zeros(model.parameters.len());
    (truth[rate], truth[sag]) = (1.5e-7, -4e-4);
    let all: Vec<usize> = (0..rows.len()).collect();
    let poses = Placement::of(&rows).poses(&rows, &all, 1.0);
    let errors = PoseResiduals::new(&model, poses, Vec::new(), truth.clone()).position_errors(&DVector::zeros(0));
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for (position, error) in rows.positions.iter_mut().zip(errors) {
        *position += Vector3::from_fn(|_, _| 2e-5 * normal(&mut rng)) - error;
    }
    let found = identify_model(&model, &problem, &divided(30, &rows), &Options::default()).unwrap();
    for k in [rate, sag] {
        let (estimate, error) = (found.estimates[k].estimate, found.estimates[k].std_error.unwrap());
        assert!((estimate - truth[k]).abs() < 4.0 * error && error < 0.1 * truth[k].abs(), "{estimate} ± {error}");
    }
}

#[test]
fn rules_may_speak_of_it() {
    let (mut problem, rows) = bench();
    let text = "name = 'rules'\n[[joint]]\n[parameters]\n\"joint-creep.rate\" = { fixed = true }";
    problem.parameters = common::arms::parse(text).parameters;
    let names: Vec<String> =
        model(&problem, &rows, creep(3)).unwrap().parameters.into_iter().map(|parameter| parameter.name).collect();
    assert_eq!(names, ["joint-creep[3].sag"]);
}

#[test]
fn what_the_model_has_no_room_for_is_refused() {
    let (problem, rows) = bench();
    let joint = |joint, field| Slot::Joint { joint, field };
    let refused = |term: Term| model(&problem, &rows, vec![term]).unwrap_err();
    let theta = joint(2, JointField::Theta);
    assert!(matches!(refused(Term::constant("x", theta, 1.0)), TermsError::Occupied { .. }));
    assert!(matches!(
        refused(Term::driven("x", joint(7, JointField::Theta), Driver::Elapsed, 1.0)),
        TermsError::Nowhere { .. }
    ));
    assert!(matches!(refused(Term::driven("x", theta, Driver::Command(9), 1.0)), TermsError::Nowhere { .. }));
    let length = joint(2, JointField::A);
    assert!(matches!(refused(Term::driven("x", length, Driver::Elapsed, 1.0)), TermsError::NotDrivable { .. }));
    let twice = vec![Term::constant("x", Slot::Scale, 1.0), Term::constant("y", Slot::Scale, 1.0)];
    assert!(matches!(model(&problem, &rows, twice), Err(TermsError::Occupied { .. })));
}

#[test]
fn any_free_slot_of_the_catalogue_serves() {
    let (problem, rows) = bench();
    let terms = vec![
        Term::constant("compliance", Slot::Joint { joint: 0, field: JointField::LateralX }, 1e-4),
        Term::constant("gravity", Slot::Arm(ArmField::GravityX), 0.1),
        Term::driven("tracker", Slot::Shift { axis: 2 }, Driver::Warming { reference: 20.0 }, 1e-4),
    ];
    let mut warm = rows;
    warm.temperature = Some((0..40).map(|k| 15.0 + f64::from(k % 7)).collect());
    let model = model(&problem, &warm, terms).unwrap();
    let n = model.parameters.len();
    let poses = Placement::of(&warm).poses(&warm, &[0, 1, 2, 3, 4], 1e-3);
    let residuals = PoseResiduals::new(&model, poses, (n - 3..n).collect(), DVector::zeros(n));
    let columns = jacobian(&residuals, &DVector::zeros(3));
    assert!(columns.column_iter().all(|column| column.norm() > 0.0));
}
