//! Rows that stand out of the fit of the declared problem: gross errors, or rows in which an effect
//! acts most.

use std::path::Path;

use flexcal::fit::{FindingCode, Options, identify};
use flexcal::measurement::{Dataset, Split};
use flexcal::results::LoopResult;
use flexcal::rig::{Truth, simulate};
use flexcal::select::{Verdict, close};
use flexcal::study::table;
use nalgebra::Vector3;

use super::evidence::seven;
use crate::common::arms::lunar_case;

#[test]
fn an_effect_that_displaces_few_rows_most_explains_them_together_with_the_others() {
    let arm = seven(true);
    // Joint 2 turns with the cube of its moment, which is large in the last two poses alone.
    let poses = |range: [f64; 2], count: usize| {
        let text = format!(
            "[random]\n'joint*.theta' = {{ sigma_deg = 0.1 }}\n'joint*.a' = {{ sigma_mm = 0.3 }}\n\
             [[effect]]\njoint-nonlinear-stiffness = {{ joint = 2 }}\ncubic_rad_per_N3_m3 = 4e-8\n\
             [noise]\nposition_sigma_mm = 0.05\n[poses]\nq1_deg = [-160, 160]\nq2_deg = {range:?}\n\
             q3_deg = [-160, 160]\nq4_deg = [-30, -10]\nq5_deg = [-160, 160]\nq6_deg = [5, 200]\n\
             q7_deg = [-160, 160]\n"
        );
        let truth = Truth::parse(&text, Path::new("TRUTH.toml"), &arm).unwrap();
        simulate(&arm, &truth, count, 5).unwrap().rows
    };
    let rows = [poses([-10.0, 10.0], 34), poses([85.0, 90.0], 2)].concat();
    let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
    let data = Dataset::new(table(&rows), split);
    let closure = close(&arm, &data, &Options::default()).unwrap();
    assert_eq!(closure.set_aside, []);
    assert_eq!(closure.effects.len(), 1, "{:?}", closure.effects);
    assert!(closure.after.reduced_chi2.is_some_and(|chi2| chi2 < 1.5));
}

#[test]
fn rows_that_nothing_explains_are_not_called_noise() {
    let (problem, data) = lunar_case("a-none.csv");
    let Dataset { mut measurements, split } = data;
    let row = split.identification[3];
    measurements.positions[row] += Vector3::new(3.2, 3.6, 0.2) * 1e-3;
    let data = Dataset::new(measurements, split);
    let closure = close(&problem, &data, &Options::default()).unwrap();
    assert_eq!(closure.set_aside, [data.measurements.location(row)]);
    assert_eq!((closure.effects.len(), closure.verdict), (0, Verdict::Unexplained));
    let text = flexcal::report::loop_text(&problem, &closure, None).replace('\n', " ");
    assert!(text.contains("1 pose stands out"), "{text}");
    assert!(LoopResult::new(&problem, &closure).unexplained.is_none());
}

#[test]
fn held_out_rows_nearer_than_gross_errors_contradict_the_prediction() {
    let (problem, data) = lunar_case("a-none.csv");
    let Dataset { mut measurements, split } = data;
    for place in [5, 20, 35] {
        measurements.positions[split.held_out[place]].x += 0.4e-3;
    }
    let data = Dataset::new(measurements, split);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert_eq!(found.held_out_outliers.len(), 3);
    assert!(found.has(FindingCode::HeldOutBeyondPrediction));
}
