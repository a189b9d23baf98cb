//! Laws that a problem declares: read with located mistakes, differentiated, and found from data.

use std::path::Path;

use flexcal::error::InputErrorKind;
use flexcal::fit::{Options, Placement, identify};
use flexcal::least_squares::{check_jacobian, jacobian};
use flexcal::measurement::Measurements;
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::{Effect, Problem};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::catalogue::{lunar, poses};
use crate::common::arms::parse;
use crate::common::made::{divided, draw, measure, model_of};
use crate::common::reading::problem_error;

/// 1 σ of a coordinate [m].
const NOISE: f64 = 2e-5;
const WOBBLE: &str = "law = { name = 'wobble', at = 'joint3', sigma_deg = 0.05, \
                      terms = ['sin(q2)*cos(q3)', 'cos(q2)*cos(q3)'] }";
const BELT: &str = "law = { name = 'belt', at = 'joint2', terms = ['T*exp(-k*abs(q2))'], \
                    sigma_deg = 0.02, k = { start = 0.5, min = 0, max = 5 } }";

fn law(problem: &Problem, text: &str) -> Effect {
    problem.effect(text, Path::new("law")).unwrap_or_else(|error| panic!("{error}")).effect
}

/// The lunar sampler with one more law, and poses in which everything varies.
fn bench(text: &str, seed: u64) -> (Problem, Measurements) {
    let (mut arm, _) = lunar();
    arm.data.position_sigma = Some(NOISE);
    let problem = arm.with_effect(law(&arm, text));
    let rows = poses(&problem, 60, true, &mut ChaCha8Rng::seed_from_u64(seed));
    (problem, rows)
}

/// The full parameter vector in which the named parameters have these values.
fn with(model: &Model, values: &[(&str, f64)]) -> DVector<f64> {
    let mut x = DVector::zeros(model.parameters.len());
    for (name, value) in values {
        let k = model.parameters.iter().position(|own| own.name == *name);
        let k = k.unwrap_or_else(|| panic!("no parameter {name}"));
        x[k] = model.parameters[k].deviation(*value);
    }
    x
}

#[test]
fn laws_are_found_from_data_and_so_are_the_parameters_inside() {
    let cases: [(&str, &[(&str, f64)]); 2] = [
        (WOBBLE, &[("law[wobble].1", 4e-4), ("law[wobble].2", -7e-4)]),
        (BELT, &[("law[belt].1", 1.5e-4), ("law[belt].k", 0.9)]),
    ];
    for (number, (text, values)) in cases.into_iter().enumerate() {
        let (problem, mut rows) = bench(text, 7 + number as u64);
        let model = model_of(&problem, &rows);
        let mut rng = ChaCha8Rng::seed_from_u64(70);
        let mut truth = 0.3 * draw(&model, |_| 0.0, &mut rng);
        let strong = with(&model, values);
        for (name, _) in values {
            let k = model.parameters.iter().position(|own| own.name == *name).unwrap();
            truth[k] = strong[k];
        }
        measure(&problem, &mut rows, &truth, NOISE, &mut rng);
        let found = identify(&problem, &divided(50, &rows), &Options::default()).unwrap();
        for (name, value) in values {
            let estimate = found.estimate(name).unwrap();
            let error = estimate.std_error.unwrap();
            let off = (estimate.estimate - value) / error;
            assert!(off.abs() < 4.0 && error < 0.2 * value.abs(), "{name}: {off} σ, ± {error}");
        }
    }
}

#[test]
fn derivatives_by_coefficients_and_inner_parameters_are_exact() {
    let laws = [
        WOBBLE,
        BELT,
        "law = { name = 'tilt', at = 'measurement.z', terms = ['sin(q1)', 't/1000'], sigma_mm = 1 }",
        "law = { name = 'sag', at = 'base.rx', terms = ['tanh(s*payload)'], sigma_deg = 0.1, \
         s = { start = 0.4 } }",
        "law = { name = 'lift', at = 'base.z', terms = ['T^2'], sigma_mm = 1 }",
        "law = { name = 'bow', at = 'A.curvature_y', terms = ['T/(1 + r*T)'], sigma_per_m = 1e-3, \
         r = { start = 0.1 } }",
        "law = { name = 'ranging', at = 'measurement.range', terms = ['T', 'sin(2*q1)'], sigma_mm = 1 }",
        "law = { name = 'windup', at = 'joint2', terms = ['tanh(M2/k)', 'M2*q3'], sigma_deg = 0.1, \
         k = { start = 40 } }",
        "law = { name = 'race', at = 'joint3.ry', terms = ['sin(q3)', 'cos(q3)'], sigma_deg = 0.1 }",
        "law = { name = 'rail', at = 'joint2.y', terms = ['q2^2'], sigma_mm = 1 }",
        "law = { name = 'wrist', at = 'joint2.after.rz', terms = ['M2', 'T'], sigma_deg = 0.1 }",
        "law = { name = 'flange', at = 'joint3.after.z', terms = ['T'], sigma_mm = 1 }",
        "law = { name = 'gripper', at = 'tool.rx', terms = ['payload*sin(q1)'], sigma_deg = 0.1 }",
        "law = { name = 'edge', at = 'joint2', terms = ['sqrt(abs(q2 - c))'], sigma_deg = 0.1, \
         c = { start = 0.2 } }",
    ];
    for (number, text) in laws.into_iter().enumerate() {
        let (problem, rows) = bench(text, number as u64);
        let model = model_of(&problem, &rows);
        let unknowns: Vec<usize> = (0..model.parameters.len())
            .filter(|&k| model.parameters[k].name.starts_with("law["))
            .collect();
        let mut x = DVector::zeros(model.parameters.len());
        for (j, &k) in unknowns.iter().enumerate() {
            x[k] = if model.parameters[k].nominal == 0.0 { 1e-3 * (1.0 + j as f64) } else { 0.05 };
        }
        let all: Vec<usize> = (0..rows.len()).collect();
        let residuals = PoseResiduals::new(
            &model,
            Placement::of(&rows).poses(&rows, &all, 1e-3),
            unknowns.clone(),
            x.clone(),
        );
        let (at, step) = (residuals.unknowns_in(&x), DVector::from_element(unknowns.len(), 1e-3));
        let columns = jacobian(&residuals, &at);
        for (j, check) in check_jacobian(&residuals, &at, &step).columns.iter().enumerate() {
            let name = &model.parameters[unknowns[j]].name;
            assert!(columns.column(j).norm() > 0.0, "{name} does nothing");
            assert!(check.relative_error < 1e-7_f64.max(check.accuracy), "{name}: {check:?}");
        }
    }
}

#[test]
fn a_law_of_the_moment_is_a_compliance() {
    let (arm, _) = lunar();
    let rows = poses(&arm, 20, true, &mut ChaCha8Rng::seed_from_u64(6));
    let all: Vec<usize> = (0..rows.len()).collect();
    let moved = |text: &str| {
        let model = model_of(&arm.with_effect(law(&arm, text)), &rows);
        let zero = DVector::zeros(model.parameters.len());
        let mut x = zero.clone();
        let first = model.parameters.iter().position(|own| {
            own.name.starts_with("law[") || own.name.starts_with("joint-compliance")
        });
        x[first.unwrap()] = 1e-8;
        let of =
            |x: &DVector<f64>| model.residuals(Placement::of(&rows).poses(&rows, &all, 1.0), x);
        of(&x).into_iter().zip(of(&zero)).map(|(a, b)| a - b).collect::<Vec<_>>()
    };
    let (catalogued, written) = (
        moved("joint-compliance = { joint = 3 }"),
        moved("law = { name = 'a', at = 'joint3', terms = ['M3'] }"),
    );
    // The compliance acts on the deflected arm, the law on the rigid one.
    let squares = |all: &[nalgebra::Vector3<f64>]| {
        all.iter().map(nalgebra::Vector3::norm_squared).sum::<f64>()
    };
    let apart: Vec<_> = catalogued.iter().zip(&written).map(|(a, b)| a - b).collect();
    let (apart, whole) = (squares(&apart).sqrt(), squares(&catalogued).sqrt());
    assert!(whole > 0.0 && apart < 0.1 * whole, "{apart} of {whole}");
}

#[test]
fn a_law_of_a_catalogue_s_formula_is_that_of_the_catalogue() {
    let pairs = [
        ("gear-ratio = { joint = 2 }", "law = { name = 'a', at = 'joint2', terms = ['q2'] }"),
        (
            "joint-wave = { joint = 3, order = 2.5 }",
            "law = { name = 'b', at = 'joint3', terms = ['sin(2.5*q3)', 'cos(2.5*q3)'] }",
        ),
        (
            "tracker-settling = { time_constant_s = 90 }",
            "law = { name = 'c', at = 'measurement.x', terms = ['1 - exp(-t/90)'] }",
        ),
    ];
    let (arm, _) = lunar();
    let rows = poses(&arm, 20, true, &mut ChaCha8Rng::seed_from_u64(5));
    let all: Vec<usize> = (0..rows.len()).collect();
    for (catalogued, written) in pairs {
        let residuals = |text: &str| {
            let model = model_of(&arm.with_effect(law(&arm, text)), &rows);
            let mut x = DVector::zeros(model.parameters.len());
            let first = arm_parameters(&model);
            x[first] = 3e-3;
            model.residuals(Placement::of(&rows).poses(&rows, &all, 1.0), &x)
        };
        for (a, b) in residuals(catalogued).iter().zip(residuals(written)) {
            assert!((a - b).norm() < 1e-15, "{written}: {a} {b}");
        }
    }
}

/// First parameter of an effect.
fn arm_parameters(model: &Model) -> usize {
    let of_effect = |name: &str| {
        ["law[", "gear", "joint-wave", "tracker"].iter().any(|own| name.starts_with(own))
    };
    model.parameters.iter().position(|own| of_effect(&own.name)).unwrap()
}

#[test]
fn mistakes_are_located() {
    let arm = "name = 'arm'\njoint = [{}, { name = 'elbow' }, { kind = 'fixed' }]\n";
    let cases = [
        (
            "at = 'joint2', terms = ['sin(q2)', 'cos(q3) + elbo']",
            "terms[2]",
            "column 11 of the formula: unknown word elbo (did you mean elbow?)",
        ),
        ("at = 'joint2', terms = ['q2 + T']", "terms[1]", "rad and K cannot be added"),
        ("at = 'joint9', terms = ['1']", "at", "no joint 9; the arm has 3, counted from 1"),
        ("at = 'joint3', terms = ['q1']", "at", "joint 3 is fixed and takes no command"),
        ("at = 'joint2.rw', terms = ['q1']", "at", "joint2.rw is no site; write joint2, joint2.x"),
        ("at = 'tool.w', terms = ['q1']", "at", "tool.w is no site; write tool.x"),
        ("at = 'measurement.r', terms = ['q1']", "at", "write measurement.x, .y, .z or .range"),
        ("at = 'lever', terms = ['q1']", "at", "lever is no site; write joint1"),
        ("at = 'joint2', terms = []", "terms", "no formula"),
        (
            "at = 'joint2', terms = ['k*q1']",
            "terms[1]",
            "unknown word k; a parameter of the formula takes k = { start = … }",
        ),
        ("at = 'joint2', terms = ['q1'], k = { start = 1 }", "k", "no formula of this law uses k"),
        (
            "at = 'joint2', terms = ['k*q1'], k = { start = 9, max = 5 }",
            "k.start",
            "lies outside of its bounds",
        ),
        (
            "at = 'joint2', terms = ['T*q1'], T = { start = 1 }",
            "T",
            "\"T\" cannot name a parameter of a formula",
        ),
        ("at = 'joint2', terms = ['q1'], sigma_mm = 1", "sigma_mm", "an angle"),
        ("at = 'joint2', terms = ['q1'], sigma_deg = 0", "sigma_deg", "0"),
        ("at = 'joint2', terms = ['q1'], size = 3", "size", "unknown key"),
        ("at = 'joint2', terms = ['T']", "law", "reference_temperature_C"),
    ];
    for (arguments, key, words) in cases {
        let text = format!("{arm}[[effect]]\nlaw = {{ name = 'a', {arguments} }}\n");
        let error = problem_error(&text);
        let said = error.to_string();
        assert!(said.contains(words), "{arguments}: {said}");
        assert!(said.starts_with("problem.toml:4: ") && said.contains(key), "{arguments}: {said}");
    }
    let twice =
        format!("{arm}{0}{0}", "[[effect]]\nlaw = { name = 'a', at = 'joint1', terms = ['q1'] }\n");
    let error = problem_error(&twice);
    assert!(matches!(*error.kind, InputErrorKind::RepeatedEffect { .. }), "{error}");
    // The word itself is underlined.
    let text =
        format!("{arm}[[effect]]\nlaw = {{ name = 'a', at = 'joint1', terms = ['sin(qq)'] }}\n");
    let error = problem_error(&text);
    let excerpt = error.location.excerpt.unwrap();
    assert_eq!(excerpt.text.get(excerpt.span), Some("qq"));
}

#[test]
fn coefficients_have_the_unit_of_the_site_divided_by_that_of_their_formula() {
    let (arm, _) = lunar();
    for (at, term, unit) in [
        ("joint2", "sin(q1)", "rad"),
        ("joint2", "q1", "1"),
        ("joint2", "q1^2", "rad/rad²"),
        ("joint2", "M2", "rad/(N·m)"),
        ("joint2", "2*M2^3", "rad/(N·m)³"),
        ("joint2", "T*q3", "rad/(rad·K)"),
        ("joint2", "sqrt(abs(M2))", "rad/unit"),
        ("measurement.x", "hoist", "m/N"),
        ("base.rx", "payload*t", "rad/(kg·s)"),
        ("A.curvature_y", "T^2", "1/(m·K²)"),
        ("A.strain", "M2", "1/(N·m)"),
    ] {
        let law = law(&arm, &format!("law = {{ name = 'a', at = '{at}', terms = ['{term}'] }}"));
        assert_eq!(law.parameters(&arm)[0].unit().symbol(), unit, "{term} at {at}");
    }
}

#[test]
fn a_formula_without_a_value_at_a_pose_is_refused_with_its_row() {
    let (problem, rows) = bench("law = { name = 'a', at = 'joint2', terms = ['log(q2)'] }", 3);
    let error = identify(&problem, &divided(50, &rows), &Options::default()).unwrap_err();
    assert!(error.to_string().contains("log(q2) has no finite value in row"), "{error}");
}

#[test]
fn joints_covariates_and_laws_print_as_they_are_read() {
    let problem = parse(
        "name = 'arm'\njoint = [{}, { name = 'elbow' }]\n[data]\nfiles = []\n[data.covariates]\n'tilt deg' = 'tilt'\n",
    );
    let law = law(
        &problem,
        "law = { name = 'a', at = 'elbow', terms = ['elbow*`tilt deg`'], sigma_rad = 0.1 }",
    );
    let written =
        "law = { name = \"a\", at = \"joint2\", terms = [\"q2*`tilt deg`\"], sigma_rad = 0.1 }";
    assert_eq!(law.declaration(), written);
    let json =
        r#"{"effect":"law","name":"a","at":"joint2","terms":["q2*`tilt deg`"],"sigma_rad":0.1}"#;
    assert_eq!(serde_json::to_string(&law).unwrap(), json);
    assert_eq!(law.describe(), "joint 2 errs by a multiple of q2*`tilt deg` (law “a”)");
}
