//! What no law explains is corrected where poses left out gain, and predictions have bounds.

use std::f64::consts::TAU;
use std::path::Path;

use flexcal::fit::{Identification, Options, Placement, SavedEstimate, identify};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;
use flexcal::remainder::{self, Bounds, Correction, Fitted};
use flexcal::results::{Document as _, IdentificationResult};
use flexcal::rig::{Truth, simulate};
use nalgebra::DVector;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::common::arms::path;
use crate::common::made::{at_random, csv, divided, measure, model_of};
use crate::common::program::{Folder, assert_contains, number};
use crate::common::reading::read_dataset;

/// 1 σ of a coordinate [m].
const SIGMA: f64 = 2e-5;
/// Rows that are fitted; as many more are held out.
const FITTED: usize = 90;

fn panda() -> Problem {
    Problem::read(&path("problems/panda")).unwrap()
}

/// Rows of an arm whose second and fourth joints err by `size` sin(5 q) [rad].
fn measured(problem: &Problem, size: f64, seed: u64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut rows = at_random(problem, 2 * FITTED, 1.0, &mut rng);
    let mut moved = rows.clone();
    let n = moved.joints;
    for configuration in moved.configurations.chunks_mut(n) {
        for joint in [1, 3] {
            configuration[joint] += size * (5.0 * configuration[joint]).sin();
        }
    }
    let x = DVector::zeros(model_of(problem, &rows).parameters.len());
    measure(problem, &mut moved, &x, SIGMA, &mut rng);
    rows.positions = moved.positions;
    divided(FITTED, &rows)
}

fn fitted(problem: &Problem, data: &Dataset) -> (Identification, Fitted) {
    let found = identify(problem, data, &Options::default()).unwrap();
    let fitted = remainder::fit(&found, problem, data).unwrap().unwrap();
    (found, fitted)
}

#[test]
fn smooth_errors_of_joints_are_corrected_and_bounded() {
    let problem = panda();
    let data = measured(&problem, 3e-4, 1);
    let (found, fitted) = fitted(&problem, &data);
    let corrected = fitted.residuals.as_ref().unwrap();
    let (before, after) = (&found.fitted.held_out, &corrected.errors.held_out);
    assert!(after.mean.norm < 0.6 * before.mean.norm, "{before:?} {after:?}");
    let gain = fitted.gain.unwrap();
    assert!(gain.with < gain.without && gain.error.ratio() > 3.0, "{gain:?}");
    // The file holds everything: what is predicted from it are the residuals of the fit.
    let remainder = fitted.remainder.as_ref().unwrap();
    let file = Path::new("remainder.json");
    let read = Correction::parse(&remainder.to_json(), file).unwrap();
    read.check(&problem, file).unwrap();
    let json =
        IdentificationResult::new(&problem, &found).with_predictions(&found, &fitted).to_json();
    let saved = SavedEstimate::parse(&json, Path::new("estimate.json")).unwrap();
    assert_eq!(saved.remainder.as_deref(), Some("remainder.json"));
    let rows = &data.measurements;
    let own = remainder::predict(&problem, &saved, &read, rows, None).unwrap();
    for (predicted, fitted) in own.prediction.residuals.unwrap().iter().zip(&corrected.rows) {
        assert!((predicted.position - fitted.position).norm() < 1e-9);
        assert!((predicted.predicted - fitted.predicted).norm() < 1e-9);
    }
    // A bound of 95 % holds for about as many of the poses held out.
    let bounds = Bounds::new(&read, own.poses, 0.95);
    let held_out = &data.split.held_out;
    let within = held_out
        .iter()
        .filter(|&&row| corrected.rows[row].position.norm() <= bounds.bound(row))
        .count();
    assert!((within as f64) > 0.85 * held_out.len() as f64, "{within} of {}", held_out.len());
    // Far from all poses nothing is corrected, and that is said.
    let mut far = rows.select(&[0]);
    far.configurations.iter_mut().for_each(|q| *q += 0.5 * TAU);
    let far = remainder::predict(&problem, &saved, &read, &far, None).unwrap().poses[0];
    assert!(
        far.is_extrapolated && far.shift.norm() < 1e-5 && far.size > 2.0 * bounds.poses[0].size
    );
}

#[test]
fn the_declared_sigma_changes_nothing_beside_a_column_of_sigma() {
    let problem = panda();
    let file = path("problems/panda/problem.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let other = text.replace("position_sigma_mm = 0.05", "position_sigma_mm = 1.0");
    assert_ne!(other, text);
    let other = Problem::parse(&other, &file).unwrap();
    let table = csv(&problem, &measured(&problem, 3e-4, 5));
    let mut lines = table.lines();
    let header = format!("{},sigma_mm", lines.next().unwrap());
    let table = lines.fold(header, |table, line| format!("{table}\n{line},0.02"));
    let [one, two] =
        [&problem, &other].map(|problem| fitted(problem, &read_dataset(problem, &table)));
    let gains = [&one, &two].map(|(_, fitted)| fitted.gain.unwrap());
    assert!((gains[0].ln_evidence - gains[1].ln_evidence).abs() < 1e-6, "{gains:?}");
    assert!((gains[0].density.mean - gains[1].density.mean).abs() < 1e-6);
    assert!([&one, &two].iter().all(|(_, fitted)| fitted.remainder.is_some()));
    // Left-out errors are as large as they are expected to be.
    let json = IdentificationResult::new(&other, &two.0).with_predictions(&two.0, &two.1).to_json();
    let json: Value = serde_json::from_str(&json).unwrap();
    let scores = json["prediction"]["scores"]["single"].as_array().unwrap();
    let squares: f64 = scores.iter().map(|score| score.as_f64().unwrap().powi(2)).sum();
    assert!((0.8..1.25).contains(&(squares / scores.len() as f64).sqrt()), "{squares}");
}

#[test]
fn commands_bring_the_corrected_arm_to_its_targets() {
    let problem = panda();
    let data = measured(&problem, 3e-4, 2);
    let (found, fitted) = fitted(&problem, &data);
    let json =
        IdentificationResult::new(&problem, &found).with_predictions(&found, &fitted).to_json();
    let saved = SavedEstimate::parse(&json, Path::new("estimate.json")).unwrap();
    let remainder = fitted.remainder.as_ref().unwrap();
    let targets: Measurements = data.measurements.select(&[3, 70, 120]);
    let placement = Placement::of(&targets);
    let model = model_of(&problem, &targets);
    let x = saved.vector(&problem, &model).unwrap();
    assert_eq!(placement.bases.len(), 1);
    let commands =
        remainder::compensate(&problem, &model, (&saved, &x), &targets, remainder).unwrap();
    let mut reached = targets.clone();
    reached.configurations =
        commands.iter().flat_map(|(command, _)| command.configuration.clone()).collect();
    let predicted = remainder::predict(&problem, &saved, remainder, &reached, None).unwrap();
    for (residual, (command, _)) in predicted.prediction.residuals.unwrap().iter().zip(&commands) {
        assert!(command.is_reached() && command.miss.norm() < 1e-8, "{:?}", command.miss);
        assert!(residual.position.norm() < 1e-8, "{residual:?}");
    }
}

#[test]
fn nothing_is_kept_where_only_noise_is_left() {
    let problem = panda();
    let kept = (10..16)
        .filter(|&seed| fitted(&problem, &measured(&problem, 0.0, seed)).1.remainder.is_some());
    assert_eq!(kept.count(), 0);
    // Rows of the rig, which shares no physics with the model.
    let problem = Problem::read(&path("tests/cases/problem.toml")).unwrap();
    let (data, _) = Dataset::read_files(&[path("tests/cases/h-none-large.csv")], &problem).unwrap();
    let (_, fitted) = fitted(&problem, &data);
    assert!(fitted.remainder.is_none(), "{:?}", fitted.gain);
}

/// Results of one set of the rig without any discrepancy.
struct Plain {
    is_kept: bool,
    /// Mean held-out error with over that without a remainder.
    ratio: f64,
    /// Held-out rows, and those within their bound of 95 %.
    rows: usize,
    within: usize,
}

fn plain(problem: &Problem, truth: &Truth, seed: u64) -> Plain {
    let data = read_dataset(problem, &simulate(problem, truth, 78, seed).unwrap().csv());
    let (found, fitted) = fitted(problem, &data);
    let after = fitted.residuals.as_ref().map_or(&found.fitted.held_out, |of| &of.errors.held_out);
    let json = IdentificationResult::new(problem, &found).to_json();
    let saved = SavedEstimate::parse(&json, Path::new("estimate.json")).unwrap();
    let correction = fitted.remainder.as_ref().unwrap_or(&fitted.alone);
    let rows = data.measurements.select(&data.split.held_out);
    let predicted = remainder::predict(problem, &saved, correction, &rows, None).unwrap();
    let bounds = Bounds::new(correction, predicted.poses, 0.95);
    let errors = predicted.prediction.residuals.unwrap();
    let is_within = |row: &usize| errors[*row].position.norm() <= bounds.bound(*row);
    Plain {
        is_kept: fitted.remainder.is_some(),
        ratio: after.mean.norm / found.fitted.held_out.mean.norm,
        rows: rows.len(),
        within: (0..rows.len()).filter(is_within).count(),
    }
}

/// At most 2 % of the sets may get a remainder, and 93 to 97 % of the rows lie within their bounds.
#[test]
#[ignore = "200 identifications take minutes"]
fn rigs_without_discrepancy_get_no_remainder_and_calibrated_bounds() {
    let problem = Problem::read(&path("tests/cases/problem.toml")).unwrap();
    let truth = Truth::read(&path("tests/cases/truth.toml"), &problem).unwrap();
    let sets: Vec<Plain> = (0..200).map(|seed| plain(&problem, &truth, 5000 + seed)).collect();
    let kept: Vec<f64> = sets.iter().filter(|set| set.is_kept).map(|set| set.ratio).collect();
    let rows: usize = sets.iter().map(|set| set.rows).sum();
    let share = sets.iter().map(|set| set.within).sum::<usize>() as f64 / rows as f64;
    println!("kept in {} of 200 sets {kept:.3?}; within bounds {share:.4}", kept.len());
    assert!(kept.len() <= 4 && kept.iter().all(|ratio| *ratio < 1.1));
    assert!((0.93..0.97).contains(&share), "{share}");
}

#[test]
fn files_name_the_remainder_and_switch_it_off() {
    let problem = panda();
    let rows = csv(&problem, &measured(&problem, 3e-4, 3));
    let folder = Folder::with([("rows.csv", &rows)]);
    folder.copy("problems/panda/problem.toml", "problem.toml");
    let norm = |of: &Value| number(&of["mean_mm"]["norm"]);
    let estimate = folder.flexcal("identify . --data rows.csv --remainder --json --out out").json();
    let remainder = &estimate["remainder"];
    assert!(norm(&estimate["held_out"]) < norm(&remainder["held_out_without"]));
    assert_eq!(remainder["file"], "remainder.json");
    let predict = || {
        let predict = "predict . --estimate out/estimate.json --data rows.csv --json";
        folder.flexcal(&format!("{predict} --out predicted")).json()
    };
    let with = predict();
    let columns = folder.table("predicted/predictions.csv").columns;
    let expected = ["sigma_x_mm", "sigma_y_mm", "sigma_z_mm", "bound95_mm", "extrapolated"];
    assert_eq!(columns[columns.len() - 5..], expected);
    assert!(number(&with["coverage"]) > 0.9, "{with}");
    // The remainder of another run of the same arm is refused beside this estimate.
    let others = csv(&problem, &measured(&problem, 3e-4, 4));
    folder.write("others.csv", others);
    folder.flexcal("identify . --data others.csv --remainder --out other --quiet").code(0);
    folder.write("other/estimate.json", folder.read("out/estimate.json"));
    let run = folder.flexcal("predict . --estimate other/estimate.json --data rows.csv --out not");
    assert_contains(&run.code(2).stderr, &["remainder.json: belongs to another estimate"]);
    let declared = "\n[remainder]\nfile = \"out/remainder.json\"\n";
    folder.map("problem.toml", |text| format!("{text}{declared}"));
    assert_eq!(predict(), with);
    folder.map("problem.toml", |text| format!("{text}use = false\n"));
    assert!(norm(&predict()["all"]) > norm(&with["all"]));
}
