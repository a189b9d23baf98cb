//! A law of the user's own: declared, fitted, traced and found by the loop. The walk-through of
//! docs/effects.md.

use std::path::Path;

use crate::common::arms::golden_problem;
use crate::common::made::{at_random, divided, normal};
use flexcal::error::InputErrorKind;
use flexcal::fit::{Options, Placement, identify};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::model::Model;
use flexcal::problem::{Effect, Problem};
use flexcal::select::{close, trace};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A motor that warms up while the arm works: its joint creeps with time, and sags by a bump of the
/// payload that it carries.
fn creep(problem: &Problem, joint: usize) -> Effect {
    let law = format!(
        "law = {{ name = 'creep{joint}', at = 'joint{joint}', sigma_rad = 1e-3, \
         terms = ['t/1000', 'spline(payload/0.5)'] }}"
    );
    problem.effect(&law, Path::new("creep")).unwrap().effect
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

/// Measurements in which joint 3 creeps and sags by these amounts.
fn crept(rate: f64, sag: f64) -> (Problem, Dataset) {
    let (problem, mut rows) = bench();
    let declared = problem.with_effect(creep(&problem, 3));
    let model = model(&declared, &rows).unwrap();
    let values = |name: &str| match name {
        "law[creep3].1" => Some(1e3 * rate),
        "law[creep3].2" => Some(sag),
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
    let found =
        identify(&problem.with_effect(creep(&problem, 3)), &data, &Options::default()).unwrap();
    for (name, truth) in [("law[creep3].1", 1.5e-4), ("law[creep3].2", -4e-4)] {
        let own = found.estimates.iter().find(|estimate| estimate.name == name).unwrap();
        let (estimate, error) = (own.estimate, own.std_error.unwrap());
        assert!(
            (estimate - truth).abs() < 4.0 * error && error < 0.1 * truth.abs(),
            "{estimate} ± {error}"
        );
    }
}

#[test]
fn trace_and_loop_find_it() {
    let (problem, data) = crept(1.5e-7, -4e-4);
    let options = Options::default().with_candidates(vec![creep(&problem, 1), creep(&problem, 3)]);
    let traced = trace(&problem, &data, &options).unwrap();
    assert_eq!(traced.ranking[0].effect, creep(&problem, 3));
    assert!(traced.ranking[0].p_value < 1e-6);
    let closure = close(&problem, &data, &options).unwrap();
    assert!(
        closure.effects.iter().any(|found| found.effect == creep(&problem, 3)),
        "{:?}",
        closure.effects
    );
    let words = "joint 3 errs by multiples of t/1000 and spline(payload/0.5) (law “creep3”)";
    assert_eq!(closure.before.describe(&creep(&problem, 3)), words);
    // The extended problem declares it.
    let text = std::fs::read_to_string(crate::common::arms::golden("problem.toml")).unwrap();
    let closed = flexcal::report::closed_problem(&text, &problem, &closure, [&[], &[]]).unwrap();
    assert!(closed.contains(&format!("\n# Found by flexcal loop: {words}, p-value")), "{closed}");
    let closed = Problem::parse(&closed, Path::new("problem.closed.toml")).unwrap();
    assert!(closed.effects.iter().any(|declared| declared.effect == creep(&problem, 3)));
    let (before, after) = (&closure.before.fit.fitted.held_out, &closure.after.fitted.held_out);
    assert!(after.rms.norm < 0.5 * before.rms.norm);
}

#[test]
fn what_data_cannot_show_is_said() {
    let (problem, mut data) = crept(0.0, 0.0);
    data.measurements.payload = None;
    let creep = creep(&problem, 3);
    let traced = trace(&problem, &data, &Options::default().with_candidates(vec![creep.clone()]));
    assert!(traced.unwrap().untestable.contains(&(creep, "no payload is carried")));
}

#[test]
fn rules_may_speak_of_it() {
    let (mut problem, rows) = bench();
    let text = "name = 'rules'\n[[joint]]\n[parameters]\n\"law[creep3].1\" = { fixed = true }";
    problem.parameters = crate::common::arms::parse(text).parameters;
    let model = model(&problem.with_effect(creep(&problem, 3)), &rows).unwrap();
    let names: Vec<String> = model.parameters.into_iter().map(|parameter| parameter.name).collect();
    assert_eq!(names, ["law[creep3].2"]);
}
