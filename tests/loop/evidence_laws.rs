//! Laws that the evidence states for simulated causes: drifts and moves of the station, bending of a
//! slide, functions of a covariate, of a command and of temperature, and waves of a joint.

use std::fs;
use std::path::Path;

use crate::common::arms::parse;
use crate::common::made::{divided, measure, model_of};
use crate::evidence::{STATED, stated};
use flexcal::fit::Options;
use flexcal::measurement::{Dataset, NestReading, Split};
use flexcal::problem::{Effect, Problem};
use flexcal::residual_tests::Covariate;
use flexcal::rig::{Truth, simulate};
use flexcal::select::{ReferenceVerdict, Site, Status, Verdict, close, trace};
use flexcal::study::table;
use nalgebra::{DVector, Rotation3, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

#[test]
fn a_fixed_point_measured_again_speaks_for_or_against_a_drift() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let problem = Problem::read(&cases.join("problem.toml")).unwrap();
    let (data, _) = Dataset::read_files(&[cases.join("f-two.csv")], &problem).unwrap();
    let last = data.measurements.time.iter().copied().fold(0.0, f64::max);
    let plain = close(&problem, &data, &Options::default()).unwrap();
    let found = plain.effects.iter().find(|found| found.effect.name() == "tracker-drift").unwrap();
    let drift = Vector3::from_iterator(found.estimates.iter().map(|estimate| estimate.estimate));
    for (moves, says) in
        [(1.0, Some(ReferenceVerdict::Corroborated)), (0.0, Some(ReferenceVerdict::Contradicted))]
    {
        let mut data = data.clone();
        for k in 0..5 {
            let time = last * f64::from(k) / 4.0;
            let position = Vector3::new(1.0, 2.0, 0.5) + drift * moves * time;
            let (name, session) = ("floor".to_owned(), String::new());
            data.measurements.nests.push(NestReading {
                sigma: None,
                origin: (0, 2),
                name,
                position,
                time: Some(time),
                after: 0,
                session,
            });
        }
        let closure = close(&problem, &data, &Options::default()).unwrap();
        let hypothesis =
            |name: &str| closure.effects.iter().find(|found| found.effect.name() == name).unwrap();
        let drift = hypothesis("tracker-drift");
        assert_eq!(drift.reference_check.as_ref().map(|check| check.verdict), says);
        assert_eq!(
            (drift.status == Status::Found, closure.verdict == Verdict::Explained),
            (moves > 0.0, moves > 0.0)
        );
        assert_eq!(hypothesis("gear-ratio").reference_check, None);
    }
}

/// Returns a column with a lift and a boom with a payload at its end; the boom extends along +z or
/// −z.
fn boom(turned: f64) -> Problem {
    let text = format!(
        "name = 'boom'\n[[joint]]\nd_m = 0.4\n[[joint]]\nkind = 'prismatic'\n[[joint]]\nkind = 'prismatic'\nalpha_deg = {turned}\n\
         [[joint.body]]\nmass_kg = 9\ncom_m = [0, 0.05, 0.02]\n[[joint]]\na_m = 0.1\n\
         [tool]\ntarget_m = [0.2, 0, 0.1]\npayload_at_m = [0.15, 0, 0.05]\n\
         [data]\nfiles = ['measurements.csv']\nposition_sigma_mm = 0.03\n[parameters]\n'joint*.alpha' = {{ sigma_deg = 0.2 }}\n\
         'joint*.theta' = {{ sigma_deg = 0.2 }}\n'joint4.a' = {{ sigma_mm = 1 }}\n'tool.*' = {{ sigma_mm = 2 }}\n"
    );
    parse(&text)
}

#[test]
fn a_slide_that_bends_as_it_goes_out_is_named() {
    for (joint, strength, turned, out) in [
        (3, 5e-6, 90.0, "[0.3, 1.3]"),
        (3, 5e-6, -90.0, "[-1.3, -0.3]"),
        (2, 2e-6, 90.0, "[0.3, 1.3]"),
    ] {
        let problem = boom(turned);
        let text = format!(
            "[random]\n'joint*.alpha' = {{ sigma_deg = 0.1 }}\n'joint*.theta' = {{ sigma_deg = 0.1 }}\n'tool.*' = {{ sigma_mm = 1 }}\n[[effect]]\nslide-bending = {{ joint = {joint} }}\n\
             flexibility_per_N_m2 = {strength}\n[noise]\nposition_sigma_mm = 0.03\n[poses]\nq1_deg = [-150, 150]\n\
             q2_m = [0.2, 1.0]\nq3_m = {out}\nq4_deg = [-150, 150]\npayload_kg = [0, 5]\n"
        );
        let truth = Truth::parse(&text, Path::new("TRUTH.toml"), &problem).unwrap();
        let rows = simulate(&problem, &truth, 60, 3).unwrap().rows;
        let split = Split { identification: (0..42).collect(), held_out: (42..60).collect() };
        let closure =
            close(&problem, &Dataset::new(table(&rows), split), &Options::default()).unwrap();
        let [found] = closure.effects.as_slice() else { panic!("{:?}", closure.effects) };
        assert_eq!(found.effect, Effect::SlideBending { joint });
        assert!(
            (found.status == Status::Found) && closure.verdict == Verdict::Explained,
            "{found:?}"
        );
        let estimate = &found.estimates[0];
        assert!(
            (estimate.estimate - strength).abs() < 4.0 * estimate.std_error.unwrap(),
            "{estimate:?}"
        );
    }
}

#[test]
fn a_link_that_tilts_behind_its_joint_with_temperature_is_named() {
    let problem = parse(
        "name = 'elbow'\njoint = [{ d_m = 0.45 }, { alpha_deg = 90, a_m = 0.05 }, { a_m = 0.6 }, \
         { alpha_deg = 90, a_m = 0.5 }]\ntool.target_m = [0.15, 0.02, 0.1]\n[data]\nfiles = \
         ['m.csv']\nposition_sigma_mm = 0.03\nreference_temperature_C = 20\n[parameters]\n\
         'joint*.*' = { sigma_deg = 0.2, sigma_mm = 1 }\n'tool.*' = { sigma_mm = 2 }\n\
         'base.*' = { free = true }\n",
    );
    let text = "[random]\n'joint*.*' = { sigma_deg = 0.1, sigma_mm = 0.5 }\n[noise]\n\
                position_sigma_mm = 0.03\n[[effect]]\nlaw = { name = 'tilt', at = \
                'joint2.after.ry', terms = ['T'] }\nc1_deg = 0.004\n[poses]\n\
                q1_deg = [-150, 150]\nq2_deg = [0, 120]\nq3_deg = [-130, -10]\n\
                q4_deg = [-100, 100]\ntemperature_C = [15, 35]\n";
    let truth = Truth::parse(text, Path::new("TRUTH.toml"), &problem).unwrap();
    let rows = simulate(&problem, &truth, 60, 3).unwrap().rows;
    let split = Split { identification: (0..60).collect(), held_out: Vec::new() };
    let closure = close(&problem, &Dataset::new(table(&rows), split), &Options::default()).unwrap();
    let [found] = closure.effects.as_slice() else { panic!("{:?}", closure.effects) };
    let Effect::Law(law) = &found.effect else { panic!("{found:?}") };
    assert_eq!((law.site().as_str(), law.formulas().concat().as_str()), ("joint2.after.ry", "T"));
    assert!(found.status <= Status::Probable, "{:?}", found.claims);
}

#[test]
fn what_follows_a_covariate_is_named_and_other_functions_of_it_are_not() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let arm = fs::read_to_string(cases.join("problem.toml")).unwrap();
    let arm = format!(
        "{arm}\n[data.covariates]\ntilt_deg = 'tilt of the carriage'\noil_bar = 'pressure'\n"
    );
    let problem = Problem::parse(&arm, &cases.join("problem.toml")).unwrap();
    let truth = fs::read_to_string(cases.join("truth.toml")).unwrap();
    let truth = truth.split("[[effect]]").next().unwrap().replacen(
        "[poses]\n",
        "[poses]\ncovariates = { tilt_deg = [-2, 2], oil_bar = [80, 120] }\n",
        1,
    );
    for (effect, strength, name) in [
        (
            "covariate = { base = true, of = 'tilt_deg' }",
            "rx_deg_per_unit = 0.02\nz_mm_per_unit = 0.1",
            "base",
        ),
        ("covariate = { joint = 2, of = 'oil_bar' }", "rate_deg_per_unit = 0.002", "joint 2"),
    ] {
        let text = format!("{truth}\n[[effect]]\n{effect}\n{strength}\n");
        let truth = Truth::parse(&text, Path::new("TRUTH.toml"), &problem).unwrap();
        let rows = simulate(&problem, &truth, 28, 3).unwrap().rows;
        let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
        let mut data = Dataset::new(table(&rows), split);
        let evidence = trace(&problem, &data, &Options::default()).unwrap().evidence.unwrap();
        assert_eq!(stated(&evidence), ["covariate"], "{:?}", evidence.best());
        assert_eq!(evidence.best()[0].site.to_string(), name);
        // A curved function of the same quantity is no linear law.
        let bent = |value: &mut f64| *value = (*value / 2.0).powi(3);
        data.measurements.covariates.iter_mut().step_by(2).for_each(bent);
        data.measurements
            .covariates
            .iter_mut()
            .skip(1)
            .step_by(2)
            .for_each(|bar| *bar = ((*bar - 100.0) / 20.0).powi(3));
        let evidence = trace(&problem, &data, &Options::default()).unwrap().evidence.unwrap();
        assert_eq!(stated(&evidence), Vec::<String>::new(), "{:?}", evidence.best());
    }
}

#[test]
fn a_station_that_is_set_up_anew_moves_and_turns() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let problem = Problem::read(&cases.join("problem.toml")).unwrap();
    let truth = fs::read_to_string(cases.join("truth.toml")).unwrap();
    let truth = truth.split("[[effect]]").next().unwrap();
    let (at_time, shift, turn) = (1500.0, [0.4, -0.6, 0.2], [0.02, -0.03, 0.05]);
    let [x, y, z] = shift;
    let [rx, ry, rz] = turn;
    let text = format!(
        "{truth}\n[[effect]]\nstation-move = {{ at_time_s = {at_time} }}\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\nrx_deg = {rx}\nry_deg = {ry}\n\
         rz_deg = {rz}\n"
    );
    let truth = Truth::parse(&text, Path::new("TRUTH.toml"), &problem).unwrap();
    let rows = simulate(&problem, &truth, 70, 3).unwrap().rows;
    let split = Split { identification: (0..40).collect(), held_out: (40..70).collect() };
    let data = Dataset::new(table(&rows), split);
    let closure = close(&problem, &data, &Options::default()).unwrap();
    let [found] = closure.effects.as_slice() else { panic!("{:?}", closure.effects) };
    let Effect::StationMove { at_time: moved } = found.effect else { panic!("{found:?}") };
    // Both shifts are between the same two poses.
    let before =
        |time: f64| data.measurements.time.iter().filter(|row_time| **row_time < time).count();
    assert_eq!(before(moved), before(at_time), "{moved}");
    assert!((found.status == Status::Found) && closure.verdict == Verdict::Explained, "{found:?}");
    let truth = shift.map(|mm: f64| mm * 1e-3).into_iter().chain(turn.map(f64::to_radians));
    for (estimate, truth) in found.estimates.iter().zip(truth) {
        assert!(
            (estimate.estimate - truth).abs() < 4.0 * estimate.std_error.unwrap(),
            "{estimate:?} {truth}"
        );
    }
    // Three fixed points that moved with the station confirm the move; points that stayed
    // contradict it.
    let turn = Rotation3::new(Vector3::from(turn.map(f64::to_radians)));
    for (moves, says) in
        [(true, ReferenceVerdict::Corroborated), (false, ReferenceVerdict::Contradicted)]
    {
        let mut data = data.clone();
        for (name, place) in
            [("door", [3.0, 0.5, 1.0]), ("floor", [-1.0, 2.0, 0.0]), ("wall", [0.5, -3.0, 2.0])]
        {
            for (time, has_moved) in [(at_time - 900.0, false), (at_time + 900.0, moves)] {
                let place = Vector3::from(place);
                let moved = turn * place + Vector3::from(shift) * 1e-3;
                data.measurements.nests.push(NestReading {
                    sigma: None,
                    origin: (0, 2),
                    name: name.to_owned(),
                    position: if has_moved { moved } else { place },
                    time: Some(time),
                    after: 0,
                    session: String::new(),
                });
            }
        }
        let closure = close(&problem, &data, &Options::default()).unwrap();
        let found =
            closure.effects.iter().find(|found| found.effect.name() == "station-move").unwrap();
        assert_eq!(found.reference_check.as_ref().map(|check| check.verdict), Some(says));
    }
}

#[test]
fn a_function_of_a_command_that_grows_with_temperature_is_located() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let problem = Problem::read(&cases.join("problem.toml")).unwrap();
    let reference = problem.data.reference_temperature.unwrap();
    let text = fs::read_to_string(cases.join("truth.toml")).unwrap();
    let plain = text.split("[[effect]]").next().unwrap();
    let wave = format!(
        "{plain}\n[[effect]]\njoint-harmonic = {{ joint = 2, orders = [3] }}\nsin3_deg = 0.03\ncos3_deg = 0.01\n"
    );
    let [rows, bent] = [plain, wave.as_str()].map(|text| {
        let truth = Truth::parse(text, Path::new("TRUTH.toml"), &problem).unwrap();
        table(&simulate(&problem, &truth, 90, 11).unwrap().rows)
    });
    let mut measured = rows.clone();
    let temperatures = rows.temperature.as_ref().unwrap();
    for (k, position) in measured.positions.iter_mut().enumerate() {
        *position +=
            (bent.positions[k] - rows.positions[k]) * ((temperatures[k] - reference) / 10.0);
    }
    let split = Split { identification: (0..90).collect(), held_out: Vec::new() };
    let evidence = trace(&problem, &Dataset::new(measured, split), &Options::default())
        .unwrap()
        .evidence
        .unwrap();
    let [hypothesis] = evidence.best() else { panic!("{:?}", evidence.best()) };
    let on = [Covariate::Command(1), Covariate::Temperature];
    assert_eq!(
        (hypothesis.site, hypothesis.depends_on.as_slice()),
        (Site::Joint(1), &on[..]),
        "{hypothesis:?}"
    );
    assert!(
        evidence.claims(hypothesis).depends_on.1 >= STATED,
        "{:?}",
        evidence.claims(hypothesis)
    );
    // A law that the search writes down may be the product of both.
    assert!(stated(&evidence).iter().all(|law| law == "law"), "{hypothesis:?}");
}

#[test]
fn waves_are_named_with_their_orders_and_whole_numbers_are_harmonics() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let problem = Problem::read(&cases.join("problem.toml")).unwrap();
    let truth = fs::read_to_string(cases.join("truth.toml")).unwrap();
    let truth = truth.split("[[effect]]").next().unwrap();
    for (effect, waves, order) in [
        ("joint-wave = { joint = 1, order = 6.4 }", "sin_deg = 0.012\ncos_deg = -0.008", 6.4),
        ("joint-wave = { joint = 2, order = 81.7 }", "sin_deg = -0.004\ncos_deg = 0.012", 81.7),
        (
            "joint-harmonic = { joint = 1, orders = [6] }",
            "sin6_deg = 0.012\ncos6_deg = -0.008",
            6.0,
        ),
        (
            "joint-harmonic = { joint = 2, orders = [160] }",
            "sin160_deg = -0.004\ncos160_deg = 0.012",
            160.0,
        ),
    ] {
        let text = format!("{truth}\n[[effect]]\n{effect}\n{waves}\n");
        let truth = Truth::parse(&text, Path::new("TRUTH.toml"), &problem).unwrap();
        let rows = simulate(&problem, &truth, 80, 5).unwrap().rows;
        let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
        let evidence = trace(&problem, &Dataset::new(table(&rows), split), &Options::default())
            .unwrap()
            .evidence
            .unwrap();
        assert_eq!(stated(&evidence), [effect.split(' ').next().unwrap()], "{:?}", evidence.best());
        let found = match evidence.best()[0].effect().unwrap() {
            Effect::JointWave { order, .. } => *order,
            Effect::JointHarmonic { orders, .. } => f64::from(orders[0]),
            _ => f64::NAN,
        };
        assert!((found - order).abs() < 0.1, "{found}, not {order}");
    }
}

#[test]
fn the_lead_of_a_screw_is_found() {
    let gantry = Path::new(env!("CARGO_MANIFEST_DIR")).join("problems/gantry");
    let problem = Problem::read(&gantry.join("problem.toml")).unwrap();
    let truth = fs::read_to_string(gantry.join("TRUTH.toml")).unwrap();
    let scale = truth.find("[[effect]]").unwrap()..truth.find("[noise]").unwrap();
    for (joint, lead) in [(3, 0.005), (4, 0.01)] {
        let order = std::f64::consts::TAU / lead;
        let wave = format!(
            "[[effect]]\njoint-wave = {{ joint = {joint}, order = {order} }}\nsin_mm = 0.1\ncos_mm = 0.07\n"
        );
        let truth = Truth::parse(
            &truth.replace(&truth[scale.clone()], &wave),
            Path::new("TRUTH.toml"),
            &problem,
        )
        .unwrap();
        let rows = simulate(&problem, &truth, 80, 4).unwrap().rows;
        let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
        let evidence = trace(&problem, &Dataset::new(table(&rows), split), &Options::default())
            .unwrap()
            .evidence
            .unwrap();
        assert_eq!(stated(&evidence), ["joint-wave"], "{:?}", evidence.best());
        let Some(&Effect::JointWave { joint: named_joint, order: found }) =
            evidence.best()[0].effect()
        else {
            panic!()
        };
        assert!(
            named_joint == joint && (found / order - 1.0).abs() < 1e-3,
            "{joint} {order}: {named_joint} {found}"
        );
    }
}

#[test]
fn an_order_between_whole_numbers_is_neither_where_a_joint_moves_little() {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let problem = Problem::read(&cases.join("problem.toml")).unwrap();
    let truth = fs::read_to_string(cases.join("truth.toml")).unwrap();
    let truth = truth.split("[[effect]]").next().unwrap().replacen(
        "q1_deg = [-90, 90]",
        "q1_deg = [-40, 40]",
        1,
    );
    let evidence = |effect: &str, seed: u64| {
        let truth = Truth::parse(
            &format!("{truth}\n[[effect]]\n{effect}\n"),
            Path::new("TRUTH.toml"),
            &problem,
        )
        .unwrap();
        let rows = simulate(&problem, &truth, 40, seed).unwrap().rows;
        let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
        trace(&problem, &Dataset::new(table(&rows), split), &Options::default())
            .unwrap()
            .evidence
            .unwrap()
    };
    let harmonic = |order: u32| Effect::JointHarmonic { joint: 1, orders: vec![order] };
    let between = "joint-wave = { joint = 1, order = 11.5 }\nsin_deg = 0.003\ncos_deg = -0.002";
    let whole =
        "joint-harmonic = { joint = 1, orders = [12] }\nsin12_deg = 0.003\ncos12_deg = -0.002";
    for seed in 1..=12 {
        let evidence = evidence(between, seed);
        let law = |effect: Effect| evidence.claims_of(&effect).map_or(0.0, |claims| claims.law.1);
        assert!(
            law(harmonic(11)) < STATED && law(harmonic(12)) < STATED,
            "{seed}: {:?}",
            evidence.sets[0]
        );
    }
    // An integer order is more common, but a non-integer wave is not excluded.
    for seed in 1..=4 {
        let evidence = evidence(whole, seed);
        let wave = evidence.probability(|hypothesis| {
            hypothesis.effect().is_some_and(|effect| effect.name() == "joint-wave")
        });
        let law = evidence.claims_of(&harmonic(12)).unwrap().law.1;
        assert!(law > wave && wave > 0.02, "{seed}: {law} {wave}");
    }
}

/// Arm of six joints with heavy links, declared rigid.
const HEAVY: &str = "name = 'six'
[[joint]]
d_m = 0.5
[[joint]]
alpha_deg = -90
a_m = 0.15
[[joint.body]]
name = 'upper arm'
mass_kg = 48
com_m = [0.4, 0.05, 0.12]
[[joint]]
a_m = 0.85
[[joint.body]]
name = 'forearm'
mass_kg = 30
com_m = [0.08, 0.1, -0.05]
[[joint]]
alpha_deg = -90
a_m = 0.12
d_m = 0.82
[[joint.body]]
name = 'wrist'
mass_kg = 14
com_m = [0, 0, -0.1]
[[joint]]
alpha_deg = 90
[[joint]]
alpha_deg = -90
d_m = 0.11
[tool]
target_m = [0.08, 0.03, 0.14]
[parameters]
'joint*' = { sigma_deg = 0.5, sigma_mm = 3 }
'tool.*' = { sigma_mm = 5 }
'base.*' = { free = true }
[data]
position_sigma_mm = 0.05
";

/// Ten values of each joint in turn; the other joints rest.
fn sweeps() -> Vec<[f64; 6]> {
    let rest = [10.0_f64, -70.0, 5.0, 20.0, 30.0, 15.0];
    let reach = [120.0, 45.0, 60.0, 150.0, 110.0, 170.0];
    let pose = |k: usize| {
        let mut pose = rest;
        pose[k / 10] += reach[k / 10] * ((k % 10) as f64 / 4.5 - 1.0);
        pose.map(f64::to_radians)
    };
    (0..60).map(pose).collect()
}

#[test]
fn two_compliances_that_sweeps_of_single_joints_confound_are_no_bending_link() {
    let problem = parse(HEAVY);
    let effects = "[[effect]]\njoint-compliance = { joint = 2 }\n[[effect]]\njoint-compliance = { joint = 3 }\n";
    let compliant = parse(&format!("{HEAVY}{effects}"));
    for seed in [1, 2] {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let poses = sweeps();
        let rows = Dataset::builder(poses.iter(), vec![Vector3::zeros(); poses.len()]);
        let mut rows = rows.measurements().unwrap();
        let size = |name: &str| match name {
            "joint-compliance[2].compliance" => 3e-6,
            "joint-compliance[3].compliance" => 4e-6,
            _ => 0.0,
        };
        let parameters = model_of(&compliant, &rows).parameters;
        let truth = parameters.iter().map(|parameter| size(&parameter.name));
        let truth = DVector::from_iterator(parameters.len(), truth);
        measure(&compliant, &mut rows, &truth, 5e-5, &mut rng);
        let closed = close(&problem, &divided(60, &rows), &Options::default()).unwrap();
        for found in &closed.effects {
            let is_true = matches!(found.effect, Effect::JointCompliance { joint: 2 | 3 });
            assert!(is_true || found.status != Status::Found, "{seed}: {:?}", found.effect);
            if let Effect::LinkBending { .. } = found.effect {
                let named: Vec<&Effect> = found.alternatives.iter().map(|(of, _)| of).collect();
                assert!(named.contains(&&Effect::JointCompliance { joint: 2 }), "{named:?}");
            }
        }
    }
}
