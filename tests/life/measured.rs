//! Figures of docs/life.md, from many arms of the rig: `cargo test --release --test life -- --ignored
//! --nocapture`.

#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

use rayon::prelude::*;

use flexcal::life::{CauseKind, Watch};
use flexcal::problem::Problem;
use nalgebra::Vector3;

use crate::bench::{Bench, warmed, with_tool, with_zero};
use crate::prior::again;
use crate::watch::{calibrated, judged};

/// Arms of the rig for each figure.
const ARMS: u64 = 100;

/// Returns the root mean square of numbers.
fn rms(numbers: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = numbers.map(|number| number * number).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
#[ignore = "a minute in release"]
fn errors_with_the_earlier_estimate_as_prior() {
    let bench = Bench::new();
    for (poses, zero, limit) in [(5, 0.0, 1.15), (8, 0.05, 1.15), (8, 0.2, 1.15)] {
        let runs: Vec<(f64, f64, f64, usize)> = (0..ARMS)
            .into_par_iter()
            .map(|seed| {
                let (full, prior, found) = again(&bench, seed, poses, zero);
                let truth = with_zero(&bench.arm(seed), 2, zero);
                let (inside, all) = covered(&found, &truth);
                (full, prior, inside, all)
            })
            .collect();
        let (full, prior) = (rms(runs.iter().map(|r| r.0)), rms(runs.iter().map(|r| r.1)));
        let covered =
            runs.iter().map(|r| r.2).sum::<f64>() / runs.iter().map(|r| r.3).sum::<usize>() as f64;
        println!(
            "{poses} poses, zero moved by {zero}°: full {:.4} mm, prior {:.4} mm, ratio {:.3}; 1.96 σ covers {:.1} %",
            1e3 * full,
            1e3 * prior,
            prior / full,
            100.0 * covered
        );
        assert!(prior < limit * full);
    }
}

/// Counts the parameters whose 95 % interval covers the truth.
fn covered(found: &flexcal::fit::Identification, truth: &Problem) -> (f64, usize) {
    let value = |name: &str| {
        let (joint, field) = name.strip_prefix("joint")?.split_once('.')?;
        let joint = &truth.joints[joint.parse::<usize>().ok()? - 1];
        match field {
            "alpha" => Some(joint.alpha),
            "a" => Some(joint.a),
            "theta" => Some(joint.theta),
            "d" => Some(joint.d),
            "stiffness" => joint.stiffness,
            _ => None,
        }
    };
    let (mut inside, mut all) = (0.0, 0);
    for estimate in &found.estimates {
        let (Some(truth), Some(error)) = (value(&estimate.name), estimate.std_error) else {
            continue;
        };
        inside += f64::from(u8::from((estimate.estimate - truth).abs() < 1.96 * error));
        all += 1;
    }
    (inside, all)
}

/// Replays of each figure of `watch`.
const REPLAYS: u64 = 400;

/// Watches changed arms, and counts replays with an alarm, and those whose most probable cause is
/// right.
fn count(
    what: &str,
    (poses, noise): (usize, f64),
    changed: impl Fn(&Problem, u64) -> Problem + Sync,
    is_right: impl Fn(&Watch) -> bool + Sync,
) -> (f64, f64) {
    let bench = Bench::new();
    let replay = |seed: u64| {
        let (arm, estimate) = calibrated(&bench, seed);
        let rows = bench.measure(&changed(&arm, seed), poses, 20_000 + seed, noise);
        let verdict = judged(&bench, &estimate, &rows);
        (verdict.is_changed(), verdict.is_changed() && is_right(&verdict))
    };
    let replays: Vec<(bool, bool)> = (0..REPLAYS).into_par_iter().map(replay).collect();
    let share = |of: fn(&(bool, bool)) -> bool| {
        replays.iter().filter(|replay| of(replay)).count() as f64 / REPLAYS as f64
    };
    let (seen, right) = (share(|replay| replay.0), share(|replay| replay.1));
    println!(
        "{what}: {REPLAYS} replays of {poses} poses, alarm in {:.1} %, so in {:.1} %",
        100.0 * seen,
        100.0 * right
    );
    (seen, right)
}

/// Returns true if a verdict names a change of the geometry.
fn is_geometry(verdict: &Watch) -> bool {
    let kinds = [CauseKind::Zero, CauseKind::Link, CauseKind::Tool, CauseKind::Base];
    verdict.named().is_some_and(|cause| kinds.contains(&cause.kind))
}

#[test]
#[ignore = "a minute in release"]
fn false_alarms_of_watch() {
    let (alarms, _) = count("unchanged", (50, 1.0), |arm: &Problem, _| arm.clone(), |_| true);
    assert!(alarms <= 0.015);
}

#[test]
#[ignore = "a minute in release"]
fn changes_that_watch_sees() {
    let is_zero_2 = |verdict: &Watch| verdict.causes[0].label == "zero of joint 2";
    let zero = |arm: &Problem, _| with_zero(arm, 2, 0.01);
    let zeros =
        [6, 3, 12].map(|poses| count("zero of joint 2 by 0.01°", (poses, 1.0), zero, is_zero_2));
    let tool = |arm: &Problem, seed: u64| {
        let turn = seed as f64;
        let direction = Vector3::new(turn.cos(), turn.sin(), (1.7 * turn).sin()).normalize();
        with_tool(arm, 0.2e-3 * direction)
    };
    let is_tool = |verdict: &Watch| verdict.causes[0].kind == CauseKind::Tool;
    let tools = [6, 3, 12].map(|poses| count("tool by 0.2 mm", (poses, 1.0), tool, is_tool));
    assert!([zeros[0], tools[0]].iter().all(|(seen, right)| *seen >= 0.95 && *right >= 0.9));
}

#[test]
#[ignore = "a minute in release"]
fn noise_and_warmth_are_not_named_geometry() {
    let same = |arm: &Problem, _| arm.clone();
    let noises = [2.0, 3.0]
        .map(|noise| count(&format!("noise × {noise}: geometry"), (20, noise), same, is_geometry));
    let warm = |arm: &Problem, _| warmed(arm, 3e-4);
    let warms = count("links warmer by 13 K: geometry", (12, 1.0), warm, is_geometry);
    assert!(noises.iter().chain([&warms]).all(|(_, wrong)| *wrong <= 0.05));
}

#[test]
#[ignore = "a minute in release"]
fn errors_with_the_fleet_as_prior() {
    let bench = Bench::new();
    let runs: Vec<(f64, f64)> =
        (0..20).into_par_iter().map(|number| crate::fleet::errors(&bench, number, 20)).collect();
    let (fleet, sheet) = (rms(runs.iter().map(|r| r.0)), rms(runs.iter().map(|r| r.1)));
    println!(
        "6 poses of a new arm: data sheet {:.4} mm, fleet of 20 {:.4} mm, ratio {:.3}",
        1e3 * sheet,
        1e3 * fleet,
        fleet / sheet
    );
    assert!(fleet <= 0.5 * sheet);
}
