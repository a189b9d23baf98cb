//! Detectable sizes of effects, compared with data sets that contain the effects.

use std::path::Path;

use flexcal::design::Extremes;
use flexcal::fit::Options;
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::{Effect, Freedom, Problem};
use flexcal::select::{detectable, trace};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::bench::{lunar, ranges};
use super::common::made::{draw, measure, model_of};

/// Returns the lunar sampler with stiffnesses known to 20 %, and 28 poses.
fn bench() -> (Problem, Measurements) {
    let (mut problem, truth) = lunar();
    for rule in &mut problem.parameters {
        if let Freedom::Free { sigma, .. } = &mut rule.freedom {
            sigma.relative = sigma.relative.map(|_| 0.2);
        }
    }
    let mut within = ranges(&truth);
    (within.temperature, within.approach) = (truth.poses.temperature, true);
    let rows = within.draw(&problem, 28, Extremes::No, 4, 0);
    (problem, rows)
}

/// Returns true if a trace of the poses finds an effect of this size in an arm drawn from the
/// priors.
fn is_found(problem: &Problem, rows: &Measurements, effect: &Effect, size: f64, seed: u64) -> bool {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut with = problem.clone();
    let text = written(effect);
    with.effects.push(problem.effect(&text, Path::new("test")).unwrap());
    let model = model_of(&with, rows);
    let mut x = draw(&model, |_| 0.0, &mut random);
    let parameters = effect.parameters(&with);
    let sign = if seed.is_multiple_of(2) { size } else { -size };
    for (k, parameter) in
        model.parameters.iter().enumerate().filter(|(_, p)| p.name == parameters[0].name)
    {
        assert!(parameter.sigma.is_some());
        x[k] = sign;
    }
    let mut rows = rows.clone();
    measure(&with, &mut rows, &x, problem.data.position_sigma.unwrap(), &mut random);
    let split = Split { identification: (0..rows.len()).collect(), held_out: vec![0] };
    let trace = trace(problem, &Dataset::new(rows, split), &Options::default()).unwrap();
    trace.ranking.iter().any(|ranked| ranked.effect == *effect && ranked.p_value < trace.level)
}

fn written(effect: &Effect) -> String {
    match effect {
        Effect::GearRatio { joint } => format!("gear-ratio = {{ joint = {joint} }}"),
        Effect::JointThermalDrift { joint } => {
            format!("joint-thermal-drift = {{ joint = {joint} }}")
        }
        Effect::LinkThermalExpansion { link } => {
            format!("link-thermal-expansion = {{ link = \"{link}\" }}")
        }
        other => other.name().to_owned(),
    }
}

/// Returns the shares of data sets in which effects of their stated size, times `factor`, are
/// found.
fn power(factor: f64, sets: u64) -> Vec<(Effect, f64)> {
    let (problem, rows) = bench();
    let detection = detectable(&problem, &rows).unwrap();
    let of = |effect: Effect| {
        let stated = detection.effects.iter().find(|row| row.effect == effect).unwrap().sizes[0]
            .worst
            .unwrap();
        let found = (0..sets)
            .into_par_iter()
            .filter(|&seed| is_found(&problem, &rows, &effect, factor * stated, seed));
        (effect.clone(), found.count() as f64 / sets as f64)
    };
    let effects = [
        Effect::GearRatio { joint: 2 },
        Effect::JointThermalDrift { joint: 3 },
        Effect::LinkThermalExpansion { link: "A".to_owned() },
        Effect::PayloadMass,
    ];
    effects.into_iter().map(of).collect()
}

#[test]
fn effects_of_the_stated_size_are_found_in_four_of_five_sets() {
    let all = power(1.0, 13);
    let mean = all.iter().map(|(_, power)| power).sum::<f64>() / all.len() as f64;
    assert!((0.65..0.95).contains(&mean), "{all:?}");
}

#[test]
fn effects_of_half_that_size_are_found_in_few() {
    let all = power(0.5, 4);
    let mean = all.iter().map(|(_, power)| power).sum::<f64>() / all.len() as f64;
    assert!(mean < 0.4, "{all:?}");
}

/// Computes the figures of docs/plan.md.
#[test]
#[ignore = "minutes: cargo test --release --test design -- --ignored --nocapture stated_size"]
fn effects_of_the_stated_size_are_found_as_often_as_stated() {
    for (factor, shares) in [(0.5, 0.0..0.4), (1.0, 0.65..0.95), (1.5, 0.95..1.01)] {
        let all = power(factor, 50);
        println!("{factor}: {all:?}");
        let mean = all.iter().map(|(_, power)| power).sum::<f64>() / all.len() as f64;
        assert!(shares.contains(&mean), "{factor}: {all:?}");
    }
}

#[test]
fn what_the_fit_takes_up_is_not_to_be_seen() {
    let (problem, rows) = bench();
    let detection = detectable(&problem, &rows).unwrap();
    let size = |effect: Effect| {
        &detection.effects.iter().find(|row| row.effect == effect).unwrap().sizes[0]
    };
    // No moment acts about the vertical axis of joint 1.
    assert!(!size(Effect::JointCompliance { joint: 1 }).is_within_prior());
    assert!(!size(Effect::TrackerScale).is_within_prior());
    assert!(size(Effect::GearRatio { joint: 2 }).is_within_prior());
    let sides = size(Effect::JointLateralCompliance { joint: 2 });
    assert!(sides.best < sides.worst || sides.worst.is_none(), "{sides:?}");
    // Four times the poses detect half the size.
    let (_, truth) = lunar();
    let more = ranges(&truth).draw(&problem, 112, Extremes::No, 4, 0);
    let finer = detectable(&problem, &more).unwrap();
    let effect = Effect::GearRatio { joint: 2 };
    let fine =
        finer.effects.iter().find(|row| row.effect == effect).unwrap().sizes[0].worst.unwrap();
    let ratio = size(effect).worst.unwrap() / fine;
    assert!((1.5..3.5).contains(&ratio), "{ratio}");
    // An effect that needs a temperature says so.
    assert!(
        finer
            .untestable
            .iter()
            .any(|(effect, _)| matches!(effect, Effect::JointThermalDrift { .. }))
    );
}
