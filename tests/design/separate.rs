//! Plans that separate two effects, measured on the virtual test rig: the loop must name the right
//! effect.

use std::path::Path;

use flexcal::design::{
    Candidates, Criterion, DesignError, EffectPair, Extremes, PairSeparation, PlanOptions, separate,
};
use flexcal::fit::Options;
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::{Effect, Problem};
use flexcal::rig::{Cause, TrueEffect, Truth};
use flexcal::select::{close, separation};
use rayon::prelude::*;

use super::bench::{lunar, measure, ranges, true_arm};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Two effects as a problem declares them, with their values on the rig, SI units.
type Case = ([&'static str; 2], [&'static [f64]; 2]);

/// Pairs of effects that 28 random poses hardly separate (docs/sweep.md).
const CASES: [Case; 3] = [
    (
        ["gear-ratio = { joint = 3 }", "joint-harmonic = { joint = 3, orders = [1] }"],
        [&[7e-4], &[0.0, 0.05 * DEGREE]],
    ),
    (["unmodelled-mass = { link = \"B\" }", "hoist-force"], [&[0.3, 0.8], &[0.03]]),
    (
        [
            "joint-harmonic = { joint = 4, orders = [1] }",
            "joint-harmonic = { joint = 4, orders = [2] }",
        ],
        [&[0.16 * DEGREE, 0.0], &[0.0, 0.08 * DEGREE]],
    ),
];

fn pair(problem: &Problem, names: [&str; 2]) -> Result<EffectPair, DesignError> {
    EffectPair::new(problem, names.map(|name| problem.effect(name, Path::new("test")).unwrap()))
}

/// Plans 28 poses that separate the two effects, chosen from candidates within the ranges of the
/// rig, or from few of them.
fn planned(
    problem: &Problem,
    truth: &Truth,
    names: [&str; 2],
    few: bool,
) -> (Measurements, PairSeparation) {
    let within = ranges(truth);
    let candidates = if few {
        Candidates::Rows(Box::new(within.draw(problem, 300, Extremes::Often, 1, 0)))
    } else {
        Candidates::Within(within)
    };
    let options = PlanOptions {
        poses: 28,
        criterion: &Criterion::S,
        seed: 1,
        progress: None,
        workspace: None,
    };
    let (plan, told) =
        separate(&pair(problem, names).unwrap(), &candidates, None, &options).unwrap();
    (plan.poses, told)
}

/// Returns true if the loop names only the effect of an arm drawn from TRUTH.toml, from these
/// poses.
fn is_named(
    problem: &Problem,
    truth: &Truth,
    poses: &Measurements,
    true_effect: &(Effect, &[f64]),
    seed: u64,
) -> bool {
    let mut truth = truth.clone();
    let (effect, strengths) = true_effect;
    truth.effects = vec![
        TrueEffect::new(Cause::Catalogued(effect.clone()), strengths, &problem.joints).unwrap(),
    ];
    let held_out = ranges(&truth).draw(problem, 4, Extremes::No, 700 + seed, 0);
    let mut rows = below(poses, &held_out);
    let (rig, _) = true_arm(problem, &truth, &rows, seed);
    measure(&rig, &mut rows, truth.noise_sigma, 5000 + seed);
    let split = Split {
        identification: (0..poses.len()).collect(),
        held_out: (poses.len()..rows.len()).collect(),
    };
    let closure = close(problem, &Dataset::new(rows, split), &Options::default()).unwrap();
    closure.effects.len() == 1 && closure.effects[0].effect == *effect
}

/// Concatenates two tables.
fn below(one: &Measurements, other: &Measurements) -> Measurements {
    let mut all = one.clone();
    let both = |one: &mut Option<Vec<f64>>, other: &Option<Vec<f64>>| {
        if let (Some(one), Some(other)) = (one, other) {
            one.extend(other);
        }
    };
    all.origin.extend(&other.origin);
    all.configurations.extend(&other.configurations);
    all.positions.extend(&other.positions);
    all.time = (0_u32..).take(all.positions.len()).map(f64::from).collect();
    all.session.of_row.extend(&other.session.of_row);
    both(&mut all.payload, &other.payload);
    both(&mut all.hoist, &other.hoist);
    all
}

/// Counts in how many seeds the loop names each effect: from planned poses, and from as many random
/// ones.
fn named(case: &Case, few: bool, seeds: u64) -> ([usize; 2], [usize; 2], PairSeparation) {
    let (problem, truth) = lunar();
    let (names, strengths) = case;
    let (planned, told) = planned(&problem, &truth, *names, few);
    let random = |seed| ranges(&truth).draw(&problem, 28, Extremes::No, 300 + seed, 0);
    let count = |side: usize, planned_poses: bool| {
        let strong_effect = (told.effects[side].clone(), strengths[side]);
        let right = |&seed: &u64| {
            let poses = if planned_poses { planned.clone() } else { random(seed) };
            is_named(&problem, &truth, &poses, &strong_effect, seed)
        };
        (0..seeds).into_par_iter().filter(right).count()
    };
    ([count(0, true), count(1, true)], [count(0, false), count(1, false)], told)
}

#[test]
fn planned_poses_tell_apart_what_random_ones_confuse() {
    let (planned, _, told) = named(&CASES[1], true, 3);
    assert_eq!(planned, [3, 3]);
    for (k, side) in told.planned.sides.iter().enumerate() {
        let random = told.random(|random| random.sides[k].told.worst);
        let least = side.told.worst.unwrap();
        assert!(least < 0.7 * random, "{least} {random}");
        let size = side.found.worst.unwrap();
        let p = told.random(|random| Some(random.sides[k].expected_p(size)));
        assert!(side.expected_p(size) < p, "{} {p}", side.expected_p(size));
    }
    assert!(told.planned.angle.unwrap() > told.random(|random| random.angle));
}

/// Computes the figures of docs/plan.md.
#[test]
#[ignore = "minutes: cargo test --release --test design -- --ignored --nocapture right_effect"]
fn the_right_effect_is_named_from_planned_poses() {
    for case in &CASES {
        let (planned, random, told) = named(case, false, 10);
        let angle = |angle: f64| angle.to_degrees();
        println!(
            "{:?}: planned {planned:?}, random {random:?} of 10; angle {:.1}° planned, {:.1}° random",
            case.0,
            angle(told.planned.angle.unwrap()),
            angle(told.random(|random| random.angle)),
        );
        for side in 0..2 {
            println!(
                "  told from {:.3e} planned, {:.3e} random; strengths {:?}",
                told.planned.sides[side].told.worst.unwrap(),
                told.random(|random| random.sides[side].told.worst),
                case.1[side],
            );
        }
        assert!(planned.iter().all(|&count| count >= 9), "{:?}", case.0);
    }
}

#[test]
fn a_pair_must_be_two_effects_that_poses_show() {
    let (problem, _) = lunar();
    let refused = |names| pair(&problem, names).unwrap_err().to_string();
    assert!(refused(["hoist-force", "hoist-force = true"]).contains("the same"));
    assert!(
        refused(["hoist-force", "tracker-drift"]).contains("depends on the time of measurement")
    );
    let springs = [0.2, 0.3].map(|free| {
        format!("gravity-compensator = {{ joint = 2, anchor_m = [0.1, -0.25], lever_m = [0.3, 0.15], free_length_m = {free} }}")
    });
    assert!(refused([&springs[0], &springs[1]]).contains("the same"));
    assert!(problem.effect("gear-ratio = { joint = 9 }", Path::new("test")).is_err());
    let mut declared = problem.clone();
    declared.effects.push(problem.effect("hoist-force", Path::new("test")).unwrap());
    assert!(
        pair(&declared, ["hoist-force", "payload-mass"])
            .unwrap_err()
            .to_string()
            .contains("already")
    );
}

#[test]
fn one_cause_with_two_names_is_not_planned_for() {
    let (problem, truth) = lunar();
    let names = ["base-compliance = true", "joint-lateral-compliance = { joint = 1 }"];
    let poses = ranges(&truth).draw(&problem, 40, Extremes::No, 1, 0);
    let two = pair(&problem, names).unwrap();
    let [one, other] = &two.effects;
    assert!(separation(&two.plain, &poses, [one, other]).unwrap().is_alike());
    // A scale is a special case of a strain, whose other entries the poses show.
    let nested = pair(&problem, ["tracker-scale = true", "frame-strain = true"]).unwrap();
    let [one, other] = &nested.effects;
    assert!(!separation(&nested.plain, &poses, [one, other]).unwrap().is_alike());
    let options = PlanOptions {
        poses: 8,
        criterion: &Criterion::S,
        seed: 1,
        progress: None,
        workspace: None,
    };
    let refused = separate(&two, &Candidates::Rows(Box::new(poses)), None, &options);
    assert!(matches!(refused, Err(DesignError::CausesAlike { .. })));
}

#[test]
fn a_spring_is_told_from_a_wave_of_its_joint() {
    let (problem, truth) = lunar();
    let poses = ranges(&truth).draw(&problem, 40, Extremes::No, 1, 0);
    let spring = "gravity-compensator = { joint = 2, anchor_m = [0.1, -0.25], lever_m = [0.3, 0.15], free_length_m = 0 }";
    let spring = problem.effect(spring, Path::new("test")).unwrap().effect;
    let wave = Effect::JointHarmonic { joint: 2, orders: vec![1] };
    // The preload separates them; the rate acts like a wave.
    let angle = separation(&problem, &poses, [&spring, &wave]).unwrap().angle.unwrap();
    assert!(angle > 0.02, "{angle} rad");
}
