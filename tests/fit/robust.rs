//! Gross errors in the data of the lunar sampler, with and without a robust loss.

use flexcal::fit::{FindingCode, Identification, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::{Effect, Problem, Robust, RobustLoss};
use flexcal::select::{Verdict, close};
use nalgebra::Vector3;

use crate::common::arms::lunar_case;

/// Length of a gross error [m].
const GROSS: f64 = 5e-3;

/// Moves every 33rd identification row by 5 mm in different directions; returns these rows.
fn spoil(Dataset { measurements, split }: &mut Dataset) -> Vec<usize> {
    let rows: Vec<usize> = split.identification.iter().copied().skip(7).step_by(33).collect();
    for (k, &row) in rows.iter().enumerate() {
        let angle = 2.4 * k as f64;
        measurements.positions[row] +=
            GROSS * Vector3::new(0.6 * angle.cos(), 0.6 * angle.sin(), 0.8);
    }
    rows
}

fn rows(result: &Identification) -> Vec<usize> {
    result.outliers.iter().map(|outlier| outlier.row).collect()
}

#[test]
fn a_robust_loss_keeps_gross_errors_from_ruling_the_fit() {
    let (mut problem, mut data) = lunar_case("h-none-large.csv");
    assert_eq!(data.split.identification.len(), 200);
    let clean = identify(&problem, &data, &Options::default()).unwrap();
    assert!(clean.outliers.is_empty(), "{:?}", clean.outliers);
    let clean_rms = clean.fitted.held_out.rms.norm;
    let spoiled = spoil(&mut data);
    assert_eq!(spoiled.len(), 6);

    let squares = identify(&problem, &data, &Options::default()).unwrap();
    let ratio = squares.fitted.held_out.rms.norm / clean_rms;
    println!(
        "clean {:.4} mm; squares {ratio:.3} times that, {:?}",
        clean_rms * 1e3,
        rows(&squares)
    );
    assert!(ratio > 1.3);
    for loss in [RobustLoss::Huber, RobustLoss::L1] {
        problem.robust = Some(Robust { loss, threshold: None });
        let robust = identify(&problem, &data, &Options::default()).unwrap();
        let ratio = robust.fitted.held_out.rms.norm / clean_rms;
        println!(
            "{loss:?}: {ratio:.3} times the clean rms; {} after {} steps; χ² {:.3}; {:.3} s (squares {} steps, {:.3} s)",
            robust.termination,
            robust.iterations,
            robust.reduced_chi2.unwrap(),
            robust.seconds,
            squares.iterations,
            squares.seconds
        );
        assert!(robust.is_trusted() && ratio < 1.3);
        assert_eq!(rows(&robust), spoiled);
        for outlier in &robust.outliers {
            assert!((outlier.error.norm() / GROSS - 1.0).abs() < 0.1 && outlier.distance > 50.0);
            assert_eq!(outlier.location, data.measurements.location(outlier.row));
        }
        assert!((robust.reduced_chi2.unwrap() - 1.0).abs() < 0.25 && robust.noise_factor < 1.5);
        // Standard errors of a robust fit exceed those of a clean one slightly, by the loss of
        // efficiency.
        for (robust, clean) in robust.estimates.iter().zip(&clean.estimates) {
            if let (Some(robust_error), Some(error)) = (robust.std_error, clean.std_error) {
                let ratio = robust_error / error;
                assert!((0.95..1.35).contains(&ratio), "{}: {ratio}", robust.name);
                let off = (robust.estimate - clean.estimate) / error;
                assert!(off.abs() < 1.5, "{}: {off} σ", robust.name);
            }
        }
    }
}

#[test]
fn a_robust_loss_costs_little_on_clean_data() {
    let (mut problem, data) = lunar_case("h-none-large.csv");
    let squares = identify(&problem, &data, &Options::default()).unwrap();
    problem.robust = Some(Robust { loss: RobustLoss::Huber, threshold: Some(1e3) });
    let wide = identify(&problem, &data, &Options::default()).unwrap();
    assert!((&wide.x - &squares.x).amax() < 1e-9);
    problem.robust = Some(Robust { loss: RobustLoss::Huber, threshold: None });
    let huber = identify(&problem, &data, &Options::default()).unwrap();
    let ratio = huber.fitted.held_out.rms.norm / squares.fitted.held_out.rms.norm;
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn gross_errors_hide_no_effect_from_the_loop() {
    let (mut problem, mut data) = lunar_case("b-joint-harmonic.csv");
    for (row, along) in [
        (data.split.identification[5], Vector3::x()),
        (data.split.identification[19], Vector3::z()),
    ] {
        data.measurements.positions[row] += 10.0 * GROSS * along;
    }
    let found = |problem: &Problem| close(problem, &data, &Options::default()).unwrap();
    let is_wave = |effect: &Effect| matches!(effect, Effect::JointHarmonic { joint: 2, .. });
    let squares = found(&problem);
    let rows = [5, 19].map(|place| data.measurements.location(data.split.identification[place]));
    assert_eq!(squares.set_aside, rows);
    assert!(squares.effects.iter().all(|chosen| is_wave(&chosen.effect)), "{:?}", squares.effects);
    problem.robust = Some(Robust { loss: RobustLoss::Huber, threshold: None });
    let robust = found(&problem);
    // The law is the most probable one; whether it is sure enough to explain is not the question.
    assert_ne!(robust.verdict, Verdict::NothingFound);
    assert!(
        robust.effects.len() == 1 && is_wave(&robust.effects[0].effect),
        "{:?}",
        robust.effects
    );
}

#[test]
fn rows_that_a_cause_selects_are_not_passed_over_as_gross_errors() {
    let (mut problem, mut data) = lunar_case("h-none-large.csv");
    problem.robust = Some(Robust { loss: RobustLoss::L1, threshold: None });
    // The station moves by 2 mm before the last quarter of the rows.
    let late = data.measurements.len() * 3 / 4;
    for position in &mut data.measurements.positions[late..] {
        *position += Vector3::new(1.2e-3, -1.0e-3, 1.2e-3);
    }
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let finding = found.finding(FindingCode::RowsSetAside).unwrap();
    assert_eq!(finding.word("depends_on"), Some("time"), "{finding}");
    let closed = close(&problem, &data, &Options::default()).unwrap();
    assert_ne!(closed.verdict, Verdict::NothingFound);
    let effects: Vec<&Effect> = closed.effects.iter().map(|found| &found.effect).collect();
    assert!(
        effects.iter().any(|effect| effect.declaration().contains("station")),
        "{effects:?} {:?}",
        closed.unexplained.first().map(|left| &left.depends_on)
    );
}
