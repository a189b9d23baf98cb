//! Promised gains of plans, measured on the virtual test rig, which shares no mechanics with the
//! model.

use flexcal::design::{Candidates, Criterion, Extremes, Plan, PlanOptions, plan};
use flexcal::problem::Problem;
use flexcal::rig::Truth;
use nalgebra::DVector;
use rayon::prelude::*;

use super::bench::{fit, lunar, measure, ranges, rms, true_arm};

/// Errors of the fit of one arm, with the standard errors that it reports.
struct Fitted {
    error: DVector<f64>,
    stated: DVector<f64>,
}

/// Fits arms drawn from TRUTH.toml with new noise: in the planned poses, and in as many random
/// ones.
fn fits(problem: &Problem, truth: &Truth, plan: &Plan, arms: u64) -> [Vec<Fitted>; 2] {
    let within = ranges(truth);
    [true, false].map(|planned| {
        let of = |arm: u64| {
            let mut rows = if planned {
                plan.poses.clone()
            } else {
                within.draw(problem, plan.poses.len(), Extremes::No, 1000 + arm, 0)
            };
            let (rig, x) = true_arm(problem, truth, &rows, arm);
            measure(&rig, &mut rows, truth.noise_sigma, 5000 + arm);
            let fitted = fit(problem, &rows);
            let stated =
                fitted.estimates.iter().map(|estimate| estimate.std_error.unwrap_or(f64::NAN));
            Fitted { error: fitted.x - x, stated: DVector::from_vec(stated.collect()) }
        };
        (0..arms).into_par_iter().map(of).collect()
    })
}

/// Returns the geometric mean over parameters of the ratio of a quantity after random poses to that
/// after planned ones (root mean squares).
fn gain(
    fits: &[Vec<Fitted>; 2],
    of: impl Fn(&Fitted) -> &DVector<f64>,
    parameters: &[usize],
) -> f64 {
    let [planned, random] =
        fits.each_ref().map(|all| all.iter().map(|fit| of(fit).clone()).collect::<Vec<_>>());
    let logs = parameters.iter().map(|&k| (rms(&random, k) / rms(&planned, k)).ln());
    (logs.sum::<f64>() / parameters.len() as f64).exp()
}

#[test]
fn planned_poses_give_smaller_errors_than_random_ones() {
    let (problem, truth) = lunar();
    let options = PlanOptions {
        poses: 28,
        criterion: &Criterion::S,
        seed: 1,
        progress: None,
        workspace: None,
    };
    let plan = plan(&problem, &Candidates::Within(ranges(&truth)), None, &options).unwrap();
    let meaningful = plan.meaningful();
    assert!(meaningful.len() > 12, "{meaningful:?}");
    let promised = plan.gain(&meaningful).unwrap();
    assert!(promised > 2.0, "{promised}");
    let measured = gain(&fits(&problem, &truth, &plan, 40), |fit| &fit.error, &meaningful);
    assert!(measured > 1.7, "{measured}");
}

/// Computes the figures of docs/plan.md.
#[test]
#[ignore = "minutes: cargo test --release --test design -- --ignored --nocapture planned"]
fn planned_poses_halve_the_errors() {
    let (problem, truth) = lunar();
    let mut halved = Vec::new();
    for criterion in [Criterion::S, Criterion::A, Criterion::D, Criterion::E] {
        for seed in [1, 2] {
            let options = PlanOptions {
                poses: 28,
                criterion: &criterion,
                seed,
                progress: None,
                workspace: None,
            };
            let plan = plan(&problem, &Candidates::Within(ranges(&truth)), None, &options).unwrap();
            let (meaningful, all) =
                (plan.meaningful(), (0..plan.planned.expected.len()).collect::<Vec<_>>());
            let found = fits(&problem, &truth, &plan, 1000);
            let (promised, measured) =
                (plan.gain(&meaningful).unwrap(), gain(&found, |fit| &fit.error, &meaningful));
            let stated = gain(&found, |fit| &fit.stated, &meaningful);
            println!(
                "{} seed {seed}: promised {promised:.3}, measured {measured:.3}, stated {stated:.3} over {} parameters; over all {:.3}, \
                 {:.3}",
                criterion.as_str(),
                meaningful.len(),
                plan.gain(&all).unwrap(),
                gain(&found, |fit| &fit.error, &all),
            );
            if criterion == Criterion::S {
                halved.push((stated, measured));
            }
        }
    }
    assert!(halved.iter().all(|&(stated, measured)| stated > 2.0 && measured > 1.9), "{halved:?}");
}
