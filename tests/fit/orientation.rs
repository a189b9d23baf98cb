//! Orientations fitted together with positions, on arms of the virtual rig.

use std::fs;
use std::path::Path;

use crate::common::arms::{parse, path};
use crate::common::made::fit;
use crate::common::reading::try_poses;
use flexcal::fit::{
    FindingCode, Identification, Options, Placement, compensate, identify, seen_from_base,
    waypoints,
};
use flexcal::least_squares::check_jacobian;
use flexcal::measurement::Dataset;
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::{Effect, Problem};
use flexcal::rig::{Simulation, Truth, simulate};
use flexcal::select::close;
use nalgebra::{DVector, UnitQuaternion, Vector3};

/// Returns the UR10 with free geometry, base and tool, and orientations measured to 0.02°.
fn ur10() -> Problem {
    let text = fs::read_to_string(path("problems/ur10-ipa/problem.toml")).unwrap();
    let (arm, _) = text.split_once("[parameters]").unwrap();
    let arm = arm.replace("[tool]\n", "[tool]\nrotation_deg = [10, -20, 100]\n");
    let text = format!(
        "{arm}[parameters]\n'joint*.alpha' = {{ sigma_deg = 0.5 }}\n'joint*.a' = {{ sigma_mm = 3 }}\n'joint*.theta' = {{ sigma_deg = 0.5 }}\n\
         'joint*.d' = {{ sigma_mm = 3 }}\n'joint*.beta' = {{ sigma_deg = 0.5 }}\n'base.*' = {{ free = true }}\n'tool.*' = {{ sigma_mm = 5, sigma_deg = 2 }}\n\
         [data]\nposition_sigma_mm = 0.05\norientation_sigma_deg = 0.02\nheld_out = {{ column = 'split' }}\n"
    );
    parse(&text)
}

fn rig(problem: &Problem, poses: usize, seed: u64, more: &str) -> (Simulation, Dataset) {
    let ranges: Vec<String> =
        (1..=problem.joints.len()).map(|k| format!("q{k}_deg = [-100, 100]\n")).collect();
    let ranges = ranges.concat();
    let truth = format!(
        "[random]\n'*' = {{ sigma_deg = 0.2, sigma_mm = 1.0, sigma_relative = 0.1 }}\n[noise]\nposition_sigma_mm = 0.05\n[poses]\n{ranges}{more}"
    );
    let truth = Truth::parse(&truth, Path::new("TRUTH.toml"), problem).unwrap();
    let simulation = simulate(problem, &truth, poses, seed).unwrap();
    let data =
        Dataset::from_measurements(problem, try_poses(problem, &simulation.csv()).unwrap().0)
            .unwrap();
    (simulation, data)
}

#[test]
fn derivatives_of_orientations_are_those_of_differences() {
    let lunar = fs::read_to_string(path("tests/cases/problem.toml")).unwrap();
    let lunar = lunar.replace(
        "\"tool.*\" = { sigma_mm = 5.0 }",
        "\"tool.*\" = { sigma_mm = 5.0, sigma_deg = 1.0 }\n\"base.*\" = { free = true }",
    );
    let lunar = lunar.replace(
        "position_sigma_mm = 0.05",
        "position_sigma_mm = 0.05\norientation_sigma_deg = 0.02",
    );
    let lunar = parse(&lunar);
    let bent =
        lunar.with_effect(Effect::GearRatio { joint: 2 }).with_effect(Effect::BaseCompliance);
    for problem in [ur10(), lunar, bent] {
        let (_, mut data) = rig(&problem, 6, 3, "held_out = 0.3\n");
        data.measurements.session = ["A", "B", "A", "B", "B", "A"].into_iter().collect();
        let placement = Placement::of(&data.measurements);
        let model = Model::new(&problem, &placement.bases, &placement.targets).unwrap();
        let n = model.parameters.len();
        let rows: Vec<usize> = (0..6).collect();
        let poses = placement.oriented_poses(&data.measurements, &rows, (1e-3, Some(1e-3)));
        let residuals = PoseResiduals::new(&model, poses, (0..n).collect(), DVector::zeros(n));
        // Bases are rotated by about 0.3 rad.
        let size = |k: usize| if model.parameters[k].site.is_placement() { 0.3 } else { 2e-3 };
        let at = DVector::from_fn(n, |k, _| size(k) * (k as f64 + 0.5).sin());
        let checked = check_jacobian(&residuals, &at, &DVector::from_element(n, 1e-2));
        let (k, worst) = checked.worst().unwrap();
        assert!(worst.relative_error < 1e-6, "{}: {worst:?}", model.parameters[k].name);
    }
}

#[test]
fn orientations_lower_the_errors_of_the_wrist_as_theory_says() {
    let problem = ur10();
    let (_, data) = rig(&problem, 60, 1, "held_out = 0.3\n");
    let (both, alone) = (fit(&problem, &data), fit(&problem.positions_alone(), &data));
    assert!(
        both.is_trusted()
            && both.estimate("tool.rx").is_some()
            && alone.estimate("tool.rx").is_none()
    );
    assert!(
        both.reduced_chi2.is_some_and(|chi2| (0.75..1.3).contains(&chi2)),
        "{:?}",
        both.reduced_chi2
    );
    // Expected covariance (JᵀJ + P)⁻¹ of both kinds of rows at the nominal arm.
    let expected = |problem: &Problem| {
        let site = flexcal::design::Site::new(problem, &[&data.measurements]).unwrap();
        let told = site.sensitivity(&data.measurements.select(&data.split.identification), None);
        let mut information = told.information();
        for (k, parameter) in site.model.parameters.iter().enumerate() {
            information[(k, k)] += parameter.sigma.map_or(1e-9, |sigma| sigma.powi(-2));
        }
        let covariance = information.try_inverse().unwrap();
        move |name: &str| {
            let k =
                site.model.parameters.iter().position(|parameter| parameter.name == name).unwrap();
            covariance[(k, k)].sqrt()
        }
    };
    let (with, without) = (expected(&problem), expected(&problem.positions_alone()));
    let mut compared = 0;
    for name in [
        "joint4.alpha",
        "joint5.alpha",
        "joint5.a",
        "joint5.theta",
        "joint6.alpha",
        "joint6.a",
        "tool.x",
        "tool.y",
    ] {
        let estimates = [&alone, &both].map(|found| found.estimate(name).unwrap());
        let [Some(before), Some(after)] = estimates.map(|estimate| estimate.std_error) else {
            continue;
        };
        let (fell, theory) = (before / after, without(name) / with(name));
        println!("{name}: {fell:.3}, theory {theory:.3}");
        assert!(fell > 0.999, "{name}: {fell}");
        // If the prior dominates, nominal and fitted arm differ in the share of the data.
        if estimates.iter().all(|estimate| estimate.identified > 0.99) {
            compared += 1;
            assert!((fell / theory - 1.0).abs() < 0.1, "{name}: {fell}, theory {theory}");
        }
    }
    assert!(compared >= 3, "{compared}");
    let held_out = |found: &Identification| {
        found
            .orientation
            .as_ref()
            .map(|found| (found.registered.held_out.mean.norm, found.fitted.held_out.mean.norm))
    };
    let (before, after) = held_out(&both).unwrap();
    println!(
        "held-out orientation {:.4}° before, {:.4}° after",
        before.to_degrees(),
        after.to_degrees()
    );
    assert!(after < 0.2 * before && after.to_degrees() < 0.06);
}

#[test]
fn standard_errors_cover_the_truth() {
    let problem = ur10();
    let (mut inside, mut count) = (0, 0);
    for seed in 0..24 {
        let (simulation, data) = rig(&problem, 40, seed, "held_out = 0.1\n");
        let found = fit(&problem, &data);
        for (estimate, truth) in found.estimates.iter().filter_map(|estimate| {
            Some((
                estimate,
                simulation.parameters.iter().find(|truth| truth.name == estimate.name)?,
            ))
        }) {
            if let (Some(error), true) = (estimate.std_error, estimate.identified > 0.99) {
                count += 1;
                inside += usize::from((estimate.estimate - truth.value).abs() < 1.96 * error);
            }
        }
    }
    let share =
        f64::from(u32::try_from(inside).unwrap()) / f64::from(u32::try_from(count).unwrap());
    println!("{inside} of {count} within 1.96 σ");
    // The expected share is 0.95; with 24 fits of about 12 independent directions, 0.91 to 0.99 is
    // within 3 σ.
    assert!(count > 300 && (0.91..0.99).contains(&share), "{inside} of {count}");
}

#[test]
fn base_and_tool_are_found_from_poses_without_a_guess() {
    let mut problem = ur10();
    let (_, mut data) = rig(&problem, 30, 5, "held_out = 0.3\n");
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.5, 2.0, -1.5));
    for (position, orientation) in
        data.measurements.positions.iter_mut().zip(data.measurements.orientations.as_mut().unwrap())
    {
        *position = turn * *position + Vector3::new(3.0, -2.0, 1.0);
        *orientation =
            turn * *orientation * UnitQuaternion::from_scaled_axis(Vector3::new(1.0, 0.0, 2.0));
    }
    let text = "'tool.*' = { free = true }\n'base.*' = { free = true }";
    let rules = Problem::parse(
        &format!("name = 'arm'\n[[joint]]\n[parameters]\n{text}\n"),
        Path::new("rules.toml"),
    )
    .unwrap();
    problem
        .parameters
        .retain(|rule| !rule.pattern.starts_with("tool") && !rule.pattern.starts_with("base"));
    problem.parameters.extend(rules.parameters);
    let found = fit(&problem, &data);
    assert!(found.is_trusted(), "{:?}", found.findings);
    assert!(
        found.reduced_chi2.is_some_and(|chi2| (0.6..1.5).contains(&chi2)),
        "{:?}",
        found.reduced_chi2
    );
    // Fitted orientations have to be measured.
    data.measurements.orientations = None;
    let error = identify(&problem, &data, &Options::default()).unwrap_err().to_string();
    assert!(
        error.contains("orientations are to be fitted, and the measurements contain none"),
        "{error}"
    );
}

#[test]
fn commands_keep_orientations() {
    let problem = ur10();
    let (simulation, data) = rig(&problem, 60, 2, "held_out = 0.3\n");
    let found = fit(&problem, &data);
    let rows = &data.measurements;
    let placement = Placement::of(rows);
    let model = Model::new(&problem, &placement.bases, &placement.targets).unwrap();
    // Waypoints are the poses that the nominal arm predicts.
    let targets = waypoints(&problem, &model, &found.x, rows).unwrap();
    let commands = compensate(&problem, &model, &found.x, &targets).unwrap();
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for command in commands.iter().filter(|command| command.is_reached()) {
        let there = |configuration: &[f64]| {
            let mut set = simulation.rows[command.row].conditions.clone();
            set.configuration = configuration.to_vec();
            simulation
                .rig
                .pose(&set)
                .unwrap()
                .1
                .angle_to(&targets.orientations.as_ref().unwrap()[command.row])
        };
        before.push(there(rows.configuration(command.row)));
        after.push(there(&command.configuration));
    }
    let mean = |all: &[f64]| (all.iter().sum::<f64>() / all.len() as f64).to_degrees();
    println!(
        "{} targets: turned by {:.4}° before, {:.4}° after",
        after.len(),
        mean(&before),
        mean(&after)
    );
    assert!(after.len() > 50 && mean(&before) > 0.2 && mean(&after) < 0.05);
    // The same targets in the frame of the base.
    let base = model.base_frames(found.x.as_slice())[0];
    let mut of_base = targets.clone();
    let turn = UnitQuaternion::from_matrix(&nalgebra::Matrix3::from_columns(&base.axes));
    for (position, orientation) in
        of_base.positions.iter_mut().zip(of_base.orientations.as_mut().unwrap())
    {
        *position = base.resolve(&(*position - base.origin));
        *orientation = turn.inverse() * *orientation;
    }
    let seen = seen_from_base(&model, &found.x, &of_base);
    for row in 0..rows.len() {
        assert!((seen.positions[row] - targets.positions[row]).norm() < 1e-9);
        let apart = seen.orientations.as_ref().unwrap()[row]
            .angle_to(&targets.orientations.as_ref().unwrap()[row]);
        assert!(apart < 1e-7, "{apart}");
    }
}

#[test]
fn the_loop_is_that_of_positions() {
    let problem = ur10();
    let more = "held_out = 0.3\n[[effect]]\ngear-ratio = { joint = 3 }\nerror_relative = 1e-3\n";
    let (_, data) = rig(&problem, 80, 4, more);
    let with = close(&problem, &data, &Options::default()).unwrap();
    let without = close(&problem.positions_alone(), &data, &Options::default()).unwrap();
    assert_eq!((with.verdict, &with.after.x), (without.verdict, &without.after.x));
    assert!(with.effects.iter().any(|found| found.effect == Effect::GearRatio { joint: 3 }));
}

#[test]
fn a_sigma_in_radians_and_a_sign_of_rotation_vectors_are_named() {
    let problem = ur10();
    let (_, mut data) = rig(&problem, 60, 3, "held_out = 0.3\n");
    let turns = data.measurements.orientations.clone().unwrap();
    let reversed = |turn: &UnitQuaternion<f64>| {
        let vector = turn.scaled_axis();
        UnitQuaternion::from_scaled_axis(Vector3::new(vector.x, vector.y, -vector.z))
    };
    data.measurements.orientations = Some(turns.iter().map(reversed).collect());
    let remedy = |problem: &Problem, data: &Dataset| {
        let found = fit(problem, data);
        found.finding(FindingCode::OrientationMisfit).map(|finding| finding.remedy.clone())
    };
    let named = remedy(&problem, &data).unwrap();
    assert!(named.contains("rotations whose z (rz or qz) has the other sign"), "{named}");
    let noisy = |(row, turn): (usize, &UnitQuaternion<f64>)| {
        let noise = |factor: f64| 5e-4 * (factor * row as f64).sin();
        turn * UnitQuaternion::from_scaled_axis(Vector3::new(noise(1.3), noise(2.1), noise(2.9)))
    };
    data.measurements.orientations = Some(turns.iter().enumerate().map(noisy).collect());
    assert_eq!(remedy(&problem, &data), None);
    let mut declared = problem.clone();
    declared.data.orientation_sigma = declared.data.orientation_sigma.map(f64::to_radians);
    let named = remedy(&declared, &data).unwrap();
    assert!(named.contains("in radians: write 0.020"), "{named}");
}

#[test]
fn a_probe_that_is_mounted_in_another_way_is_no_misread_table() {
    let mounted = ur10();
    let (_, data) = rig(&mounted, 50, 4, "");
    let mut declared = mounted;
    declared.tool.rotation = Vector3::new(0.0, 0.0, 10_f64.to_radians());
    let found = fit(&declared, &data);
    assert!(!found.has(FindingCode::Misread), "{:?}", found.findings);
    let beyond = found.finding(FindingCode::BeyondPrior).unwrap().to_string();
    assert!(beyond.starts_with("tool.r"), "{beyond}");
}

/// Orientation that a table gives in each row.
type Turn<'a> = &'a dyn Fn(usize) -> UnitQuaternion<f64>;

#[test]
fn orientations_of_other_rows_and_of_a_turned_target_are_named() {
    let problem = ur10();
    let (_, data) = rig(&problem, 60, 3, "held_out = 0.3\n");
    let turns = data.measurements.orientations.clone().unwrap();
    let quarter = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 1.57));
    let reordered = |turn: &UnitQuaternion<f64>| {
        let (x, y, z) = turn.euler_angles();
        UnitQuaternion::from_scaled_axis(Vector3::new(z, y, x))
    };
    let late = |row: usize| turns[row.saturating_sub(1)];
    let turned = |row: usize| if row < 30 { turns[row] } else { turns[row] * quarter };
    let cases: [(Turn, &str); 3] = [
        (&late, "each orientation belongs to the row before"),
        (&turned, "on the measured frame is turned by 90.0°"),
        (&|row| reordered(&turns[row]), "R = Rz Ry Rx whose columns hold z, y, x"),
    ];
    for (turn, words) in cases {
        let mut data = data.clone();
        data.measurements.orientations = Some((0..turns.len()).map(turn).collect());
        let found = fit(&problem, &data);
        let remedy = found.finding(FindingCode::OrientationMisfit).map(|of| of.remedy.clone());
        assert!(remedy.as_ref().is_some_and(|of| of.contains(words)), "{words}: {remedy:?}");
    }
}
