//! Heavy six-joint arm, declared with rigid links and joints, with one to three effects of
//! industrial arms: `cargo test --release --test sweep industrial -- --ignored --nocapture`.

use std::path::Path;

use flexcal::measurement::{Dataset, Split};
use flexcal::problem::{Effect, Problem};
use flexcal::rig::{Cause, HeldOutRows, TrueEffect, Truth, simulate};
use flexcal::study::table;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::bench::{Set, Size};
use crate::calibration::{Set as Stated, calibrated};
use crate::families::Lacking;
use crate::judged::{LoopVerdict, name};

/// Random deviations of a data set, and its poses.
const DRAWN: &str = "[random]\n'joint*.*' = { sigma_deg = 0.05, sigma_mm = 0.5 }\n[noise]\nposition_sigma_mm = 0.05\n[poses]\n\
                     q1_deg = [-160, 160]\nq2_deg = [-150, -10]\nq3_deg = [-80, 150]\nq4_deg = [-170, 170]\nq5_deg = [-110, 110]\n\
                     q6_deg = [-350, 350]\ntemperature_C = [18, 30]\ntime_step_s = [20, 40]\n";

/// Returns the arm of `tests/honest/six.toml` with rigid joints.
fn arm() -> Problem {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/honest/six.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let rigid: Vec<&str> = text.lines().filter(|line| !line.contains("stiffness")).collect();
    Problem::parse(&rigid.join("\n"), &path).unwrap()
}

/// Returns effects of a realistic size.
fn catalogue() -> Vec<Lacking> {
    let mut all = vec![
        Lacking::new(Effect::BaseCompliance, &[3e-7, 2e-7]),
        Lacking::new(Effect::TrackerScale, &[1.5e-4]),
        Lacking::new(Effect::TrackerDrift, &[3e-8, 2e-8, -2e-8]),
        Lacking::new(Effect::JointCoupling { joint: 6, from: 5 }, &[8e-4]),
        Lacking::new(Effect::JointCoupling { joint: 5, from: 4 }, &[4e-4]),
    ];
    // Listed twice: compliance at one joint usually comes with compliance at others.
    for (joint, compliance) in [(2, 1e-6), (3, 1.5e-6), (4, 1e-5), (5, 1e-5)].repeat(2) {
        all.push(Lacking::new(Effect::JointCompliance { joint }, &[compliance]));
    }
    for joint in 2..=4 {
        all.push(Lacking::new(Effect::JointLateralCompliance { joint }, &[6e-7, 4e-7]));
    }
    for joint in 1..=5 {
        all.push(Lacking::new(Effect::JointHarmonic { joint, orders: vec![2] }, &[1.5e-4, -1e-4]));
        all.push(Lacking::new(Effect::Backlash { joint }, &[1.5e-4]));
        all.push(Lacking::new(Effect::GearRatio { joint }, &[3e-4]));
    }
    all
}

fn drawn(seed: u64) -> Vec<Lacking> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (all, count) = (catalogue(), rng.random_range(1..=3));
    let mut chosen: Vec<Lacking> = Vec::new();
    while chosen.len() < count {
        let mut one = all[rng.random_range(0..all.len())].clone();
        let factor = 2.0_f64.powf(rng.random_range(-1.0..1.0));
        one.values.iter_mut().for_each(|value| *value *= factor);
        if !chosen.iter().any(|known| known.effect == one.effect) {
            chosen.push(one);
        }
    }
    chosen
}

fn judge(seed: u64) -> Stated {
    let (arm, lacking) = (arm(), drawn(seed));
    let size = Size { identification: [40, 80, 150][(seed % 3) as usize], held_out: 50 };
    let effects: Vec<Effect> = lacking.iter().map(|one| one.effect.clone()).collect();
    let mut truth = Truth::parse(DRAWN, Path::new("truth.toml"), &arm).unwrap();
    let of = |one: &Lacking| {
        TrueEffect::new(Cause::Catalogued(one.effect.clone()), &one.values, &arm.joints).unwrap()
    };
    truth.effects = lacking.iter().map(of).collect();
    truth.held_out = HeldOutRows::AllBut(size.identification);
    let rows = simulate(&arm, &truth, size.identification + size.held_out, seed).unwrap().rows;
    let (held_out, identification) = (0..rows.len()).partition(|&row| rows[row].held_out);
    let set = Set { data: Dataset::new(table(&rows), Split { identification, held_out }) };
    let judged = LoopVerdict::with(arm.clone(), &set, &effects);
    println!("{}", judged.line(&name(&lacking), size, seed));
    Stated::of(&judged, &effects, (&arm, seed))
}

#[test]
#[ignore = "minutes"]
fn what_is_stated_of_an_industrial_arm() {
    calibrated(judge, 9000, 120);
}
