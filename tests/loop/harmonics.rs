//! Joints with harmonics of many orders: all orders under one prior, no harm outside the measured
//! range, and the same result for any number and order of poses.

use std::fmt::Write as _;
use std::path::Path;

use crate::common::arms::parse;
use crate::common::made::{normal, predicted};
use flexcal::fit::{Identification, Options};
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::{Effect, EffectDeclaration, Freedom, Problem};
use flexcal::rig::{Truth, simulate};
use flexcal::select::{Verdict, close};
use flexcal::study::table;
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const POSES: usize = 1500;
/// Number of orders of each joint with an error.
const ORDERS: u32 = 24;
/// Start of the held-out part of the range of joint 1 [rad].
const BEYOND: f64 = 0.8;

/// Returns an arm of three joints and two massless links.
fn arm() -> Problem {
    parse(
        "name = 'wavy'\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\n[[joint]]\na_m = 0.6\n[tool]\n\
         target_m = [0.5, 0.05, 0.0]\n[parameters]\n'joint*.theta' = { sigma_deg = 0.5 }\n'joint3.a' = { sigma_mm = 3 }\n\
         [data]\nposition_sigma_mm = 0.05\n",
    )
}

/// Simulates the arm with waves of joints 1 and 2, whose amplitude decreases with the order.
fn measured(problem: &Problem, random: &mut ChaCha8Rng) -> Measurements {
    let mut text =
        "[random]\n'joint*.theta' = { sigma_deg = 0.1 }\n[noise]\nposition_sigma_mm = 0.05\n\
                    [poses]\nq1_deg = [-75, 75]\nq2_deg = [-75, 75]\nq3_deg = [-75, 75]\n"
            .to_owned();
    for joint in 1..=2 {
        let orders: Vec<u32> = (1..=ORDERS).collect();
        writeln!(text, "[[effect]]\njoint-harmonic = {{ joint = {joint}, orders = {orders:?} }}")
            .unwrap();
        for order in orders {
            let size = 0.02 / f64::from(order).sqrt();
            let [sine, cosine] = [size * normal(random), size * normal(random)];
            writeln!(text, "sin{order}_deg = {sine}\ncos{order}_deg = {cosine}").unwrap();
        }
    }
    let truth = Truth::parse(&text, Path::new("TRUTH.toml"), problem).unwrap();
    table(&simulate(problem, &truth, POSES, 3).unwrap().rows)
}

/// Returns the orders of a declared effect.
fn orders(declared: &EffectDeclaration) -> Option<&Vec<u32>> {
    match &declared.effect {
        Effect::JointHarmonic { orders, .. } => Some(orders),
        _ => None,
    }
}

/// Returns true if every order up to the highest is present.
fn is_dense(orders: &[u32]) -> bool {
    orders.len() > 5 && (1..).zip(orders).all(|(order, known)| order == *known)
}

/// Returns the root mean square error length at some rows [m].
fn rms(problem: &Problem, measured: &Measurements, found: &Identification, rows: &[usize]) -> f64 {
    let predicted = predicted(problem, measured, &found.x);
    let squares: f64 =
        rows.iter().map(|&row| (measured.positions[row] - predicted[row]).norm_squared()).sum();
    (squares / rows.len() as f64).sqrt()
}

#[test]
fn many_waves_fade_out_where_nothing_was_measured() {
    let problem = arm();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let measured = measured(&problem, &mut random);
    let (beyond, within): (Vec<usize>, Vec<usize>) =
        (0..POSES).partition(|&row| measured.configuration(row)[0] > BEYOND);
    let (among, identification): (Vec<usize>, Vec<usize>) =
        within.into_iter().partition(|_| random.random_bool(0.1));
    let held_out = beyond.iter().chain(&among).copied().collect();
    let split = Split { identification, held_out };

    let closure =
        close(&problem, &Dataset::new(measured.clone(), split), &Options::default()).unwrap();
    let prior = closure.harmonic_prior.as_ref().unwrap();
    let (order, sigma) = *prior.by_order.last().unwrap();
    let rule = closure.closed.parameters.last().unwrap();
    assert_eq!(rule.pattern, format!("joint-harmonic.cos{order}"));
    assert!(
        matches!(&rule.freedom, Freedom::Free { sigma: prior, .. } if prior.angle == Some(sigma))
    );
    let waves: Vec<&Vec<u32>> = closure.closed.effects.iter().filter_map(orders).collect();
    println!("{prior:?}, orders {waves:?}");
    assert!(
        waves.len() >= 2 && waves.iter().filter(|orders| is_dense(orders)).count() >= 2,
        "{waves:?}"
    );

    let errors = |rows: &[usize]| {
        let before = rms(&problem, &measured, &closure.before.fit, rows);
        let after = rms(&closure.closed, &measured, &closure.after, rows);
        println!(
            "{} poses: rms {:.4} mm before, {:.4} mm after",
            rows.len(),
            before * 1e3,
            after * 1e3
        );
        (before, after)
    };
    let (before, after) = errors(&among);
    assert!(after < 0.2 * before);
    let (before, after) = errors(&beyond);
    assert!(after < before);
    assert!(closure.after.is_trusted(), "{:?}", closure.after.findings);
    assert!(closure.effects.iter().all(|found| found.p_value < 0.05), "{:?}", closure.effects);
}

/// Returns a problem of two joints, each with twelve harmonics.
fn two_joints() -> Problem {
    parse(
        "name = 'two joints'\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\n[tool]\ntarget_m = [0.5, 0.05, 0.0]\n\
         [parameters]\n'joint*.theta' = { sigma_deg = 0.5 }\n[data]\nposition_sigma_mm = 0.05\n",
    )
}

/// Returns the verdict and the effects by name, place and orders, from the first `identification`
/// rows; the last hundred are held out.
fn found(
    problem: &Problem,
    measured: &Measurements,
    identification: Vec<usize>,
) -> (Verdict, Vec<Effect>) {
    let held_out = (measured.len() - 100..measured.len()).collect();
    let data = Dataset::new(measured.clone(), Split { identification, held_out });
    let closed = close(problem, &data, &Options::default()).unwrap();
    let mut effects: Vec<Effect> = closed.effects.into_iter().map(|found| found.effect).collect();
    effects.sort_by_key(|effect| format!("{effect:?}"));
    (closed.verdict, effects)
}

#[test]
fn the_number_and_the_order_of_poses_decide_nothing() {
    let problem = two_joints();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut text =
        "[random]\n'joint*.theta' = { sigma_deg = 0.1 }\n[noise]\nposition_sigma_mm = 0.05\n\
                    [poses]\nq1_deg = [-150, 150]\nq2_deg = [-75, 75]\n"
            .to_owned();
    let orders: Vec<u32> = (1..=12).collect();
    for joint in 1..=2 {
        writeln!(text, "[[effect]]\njoint-harmonic = {{ joint = {joint}, orders = {orders:?} }}")
            .unwrap();
        for order in &orders {
            let [sine, cosine] = [0.1 * normal(&mut random), 0.1 * normal(&mut random)];
            writeln!(text, "sin{order}_deg = {sine}\ncos{order}_deg = {cosine}").unwrap();
        }
    }
    let truth = Truth::parse(&text, Path::new("TRUTH.toml"), &problem).unwrap();
    let measured = table(&simulate(&problem, &truth, 1110, 4).unwrap().rows);
    let expected = found(&problem, &measured, (0..1000).collect());
    assert!(expected.0 == Verdict::Explained && expected.1.len() == 2, "{expected:?}");
    for (joint, effect) in (1..).zip(&expected.1) {
        assert!(
            effect.covers(&Effect::JointHarmonic { joint, orders: orders.clone() }),
            "{effect:?}"
        );
    }
    for poses in [990, 1010] {
        assert_eq!(found(&problem, &measured, (0..poses).collect()), expected, "{poses} poses");
    }
    let mut rows: Vec<usize> = (0..1110).collect();
    rows[..1000].shuffle(&mut random);
    assert_eq!(
        found(&problem, &measured.select(&rows), (0..1000).collect()),
        expected,
        "rows in another order"
    );
}
