//! Effect added by a user of the library: declared, fitted, traced and found by the loop, as
//! described in docs/effects.md.

use crate::common::arms::golden_problem;
use crate::common::made::{at_random, divided, normal};
use flexcal::error::InputErrorKind;
use flexcal::fit::{Options, Placement, identify};
use flexcal::least_squares::jacobian;
use flexcal::measurement::{Dataset, Measurements};
use flexcal::model::effect::{CustomEffect, DataCoverage, Term};
use flexcal::model::parameter::{ArmField, JointField, ParameterSite, Quantity, Regressor};
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::{Effect, Problem};
use flexcal::select::{close, trace};
use nalgebra::{DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Motor that warms up during operation: its joint drifts with time, and sags as a bump function of
/// the payload.
#[derive(Debug)]
struct Creep {
    /// Number of the joint, from 1.
    joint: usize,
}

impl CustomEffect for Creep {
    fn name(&self) -> &'static str {
        "joint-creep"
    }

    fn place(&self) -> String {
        self.joint.to_string()
    }

    fn terms(&self, problem: &Problem) -> Vec<Term> {
        let site = ParameterSite::coordinate(problem, self.joint);
        let heavy = Regressor::Spline { of: Quantity::Payload, begin: 0.0, step: 0.5 };
        vec![
            Term::driven("rate", site, Regressor::Elapsed, 1e-6),
            Term::driven("sag", site, heavy, 1e-3),
        ]
    }

    fn describe(&self) -> String {
        format!("the motor of joint {} creeps\nand = [sags", self.joint)
    }

    fn untestable(&self, _: &Problem, data: &DataCoverage) -> Option<&'static str> {
        (!data.carries()).then_some("no payload is carried")
    }
}

fn creep(joint: usize) -> Effect {
    Effect::custom(Creep { joint })
}

/// Effect with arbitrary terms and no place.
#[derive(Debug)]
struct Terms(&'static str, Vec<Term>);

impl CustomEffect for Terms {
    fn name(&self) -> &str {
        self.0
    }

    fn terms(&self, _: &Problem) -> Vec<Term> {
        self.1.clone()
    }

    fn describe(&self) -> String {
        "anything".to_owned()
    }
}

fn custom(terms: Vec<Term>) -> Effect {
    Effect::custom(Terms("own", terms))
}

fn model(problem: &Problem, rows: &Measurements) -> Result<Model, InputErrorKind> {
    let Placement { bases, targets, .. } = Placement::of(rows);
    Model::new(problem, &bases, &targets).map_err(|error| *error.kind)
}

fn bench() -> (Problem, Measurements) {
    let mut problem = golden_problem();
    problem.data.position_sigma = Some(2e-5);
    let mut rows = at_random(&problem, 40, 1.2, &mut ChaCha8Rng::seed_from_u64(1));
    rows.payload = Some((0..40).map(|k| 0.5 * f64::from(k % 5)).collect());
    rows.time = (0..40).map(|k| 90.0 * f64::from(k)).collect();
    (problem, rows)
}

/// Simulates measurements in which joint 3 drifts and sags by these amounts.
fn crept(rate: f64, sag: f64) -> (Problem, Dataset) {
    let (problem, mut rows) = bench();
    let declared = problem.with_effect(creep(3));
    let model = model(&declared, &rows).unwrap();
    let values = |name: &str| match name {
        "joint-creep[3].rate" => Some(rate),
        "joint-creep[3].sag" => Some(sag),
        _ => model
            .parameters
            .iter()
            .find(|parameter| parameter.name == name)
            .map(|parameter| parameter.nominal),
    };
    let truth = model.parameter_vector(values).unwrap();
    let all: Vec<usize> = (0..rows.len()).collect();
    let poses = Placement::of(&rows).poses(&rows, &all, 1.0);
    let errors = model.residuals(poses, &truth);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for (position, error) in rows.positions.iter_mut().zip(errors) {
        *position += Vector3::from_fn(|_, _| 2e-5 * normal(&mut rng)) - error;
    }
    let data = divided(30, &rows);
    (problem, data)
}

#[test]
fn an_effect_of_one_s_own_is_fitted_beside_the_declared_model() {
    let (problem, data) = crept(1.5e-7, -4e-4);
    let found = identify(&problem.with_effect(creep(3)), &data, &Options::default()).unwrap();
    for (name, truth) in [("joint-creep[3].rate", 1.5e-7), ("joint-creep[3].sag", -4e-4)] {
        let fitted = found.estimates.iter().find(|estimate| estimate.name == name).unwrap();
        let (estimate, error) = (fitted.estimate, fitted.std_error.unwrap());
        assert!(
            (estimate - truth).abs() < 4.0 * error && error < 0.1 * truth.abs(),
            "{estimate} ± {error}"
        );
    }
}

#[test]
fn trace_and_loop_find_it() {
    let (problem, data) = crept(1.5e-7, -4e-4);
    let options = Options::default().with_candidates(vec![creep(1), creep(3)]);
    let traced = trace(&problem, &data, &options).unwrap();
    assert_eq!(traced.ranking[0].effect, creep(3));
    assert!(traced.ranking[0].p_value < 1e-6);
    let closure = close(&problem, &data, &options).unwrap();
    assert!(closure.effects.iter().any(|found| found.effect == creep(3)), "{:?}", closure.effects);
    assert_eq!(closure.before.describe(&creep(3)), "the motor of joint 3 creeps\nand = [sags");
    // The description stays a comment of the closed problem, over any number of lines.
    let text = std::fs::read_to_string(crate::common::arms::golden("problem.toml")).unwrap();
    let closed = flexcal::report::closed_problem(&text, &problem, &closure, [&[], &[]]).unwrap();
    assert!(
        closed.contains(
            "\n# Found by flexcal loop: the motor of joint 3 creeps and = [sags, p-value"
        ),
        "{closed}"
    );
    assert!(
        Problem::parse(&closed, std::path::Path::new("problem.closed.toml")).is_ok(),
        "{closed}"
    );
    let (before, after) = (&closure.before.fit.fitted.held_out, &closure.after.fitted.held_out);
    assert!(after.rms.norm < 0.5 * before.rms.norm);
}

#[test]
fn what_data_cannot_show_is_said() {
    let (problem, mut data) = crept(0.0, 0.0);
    data.measurements.payload = None;
    let options = Options::default().with_candidates(vec![creep(3), creep(9)]);
    let traced = trace(&problem, &data, &options).unwrap();
    assert!(traced.untestable.contains(&(creep(3), "no payload is carried")));
    assert!(traced.untestable.iter().any(|(effect, _)| *effect == creep(9)));
}

#[test]
fn rules_may_speak_of_it() {
    let (mut problem, rows) = bench();
    let text = "name = 'rules'\n[[joint]]\n[parameters]\n\"joint-creep.rate\" = { fixed = true }";
    problem.parameters = crate::common::arms::parse(text).parameters;
    let model = model(&problem.with_effect(creep(3)), &rows).unwrap();
    let names: Vec<String> = model.parameters.into_iter().map(|parameter| parameter.name).collect();
    assert_eq!(names, ["joint-creep[3].sag"]);
}

#[test]
fn what_the_model_has_no_room_for_is_refused() {
    let (problem, rows) = bench();
    let refused = |terms: Vec<Term>| model(&problem.with_effect(custom(terms)), &rows).unwrap_err();
    let theta = ParameterSite::of_joint(3, JointField::Theta);
    assert!(matches!(
        refused(vec![Term::constant("x", theta, 1.0)]),
        InputErrorKind::SiteOccupied { .. }
    ));
    let nowhere = |site, regressor| {
        let kind = refused(vec![Term::driven("x", site, regressor, 1.0)]);
        assert!(matches!(kind, InputErrorKind::SiteAbsent { .. }), "{regressor:?}: {kind}");
    };
    nowhere(ParameterSite::of_joint(8, JointField::Theta), Regressor::Elapsed);
    nowhere(ParameterSite::of_joint(0, JointField::Theta), Regressor::Elapsed);
    let of = Quantity::Command(9);
    nowhere(theta, Regressor::Command(9));
    nowhere(theta, Regressor::Sine(9, 1));
    nowhere(theta, Regressor::Spline { of, begin: 0.0, step: 1.0 });
    nowhere(theta, Regressor::Bump { of, centre: 0.0, width: 1.0 });
    nowhere(theta, Regressor::Step { of, centre: 0.0, width: 1.0 });
    let length = ParameterSite::of_joint(3, JointField::A);
    let driven = Term::driven("x", length, Regressor::Elapsed, 1.0);
    assert!(matches!(refused(vec![driven]), InputErrorKind::RegressorNotAllowed { .. }));
    let twice = vec![
        Term::constant("x", ParameterSite::Scale, 1.0),
        Term::constant("y", ParameterSite::Scale, 1.0),
    ];
    assert!(matches!(refused(twice), InputErrorKind::SiteOccupied { .. }));
    let beside = problem.with_effect(Effect::TrackerScale);
    let scale = custom(vec![Term::constant("x", ParameterSite::Scale, 1.0)]);
    assert!(matches!(
        model(&beside.with_effect(scale), &rows),
        Err(InputErrorKind::SiteOccupied { .. })
    ));
    let reserved = Effect::custom(Terms("gear-ratio", Vec::new()));
    assert!(matches!(
        model(&problem.with_effect(reserved), &rows),
        Err(InputErrorKind::ReservedName { .. })
    ));
}

#[test]
fn any_free_slot_of_the_catalogue_serves() {
    let (problem, rows) = bench();
    let terms = vec![
        Term::constant("compliance", ParameterSite::of_joint(1, JointField::LateralX), 1e-4),
        Term::constant("gravity", ParameterSite::Arm(ArmField::GravityX), 0.1),
        Term::driven(
            "tracker",
            ParameterSite::Shift { axis: 2 },
            Regressor::Warming { reference: 20.0 },
            1e-4,
        ),
    ];
    let mut warm = rows;
    warm.temperature = Some((0..40).map(|k| 15.0 + f64::from(k % 7)).collect());
    let model = model(&problem.with_effect(custom(terms)), &warm).unwrap();
    let n = model.parameters.len();
    let poses = Placement::of(&warm).poses(&warm, &[0, 1, 2, 3, 4], 1e-3);
    let residuals = PoseResiduals::new(&model, poses, (n - 3..n).collect(), DVector::zeros(n));
    let columns = jacobian(&residuals, &DVector::zeros(3));
    assert!(columns.column_iter().all(|column| column.norm() > 0.0));
}
