//! Agreement with positions of another independent simulator (`tests/golden`).

use std::time::Instant;

use flexcal::problem::Problem;
use flexcal::rig::Rig;

use super::bench::{position, stiffer, table_2};
use super::common::arms::golden_problem;
use super::common::golden::{GoldenRow, golden_rows};

/// Returns the largest distance [mm] from vector `k` of the rows.
fn worst(arm: &Problem, rows: &[GoldenRow], k: usize) -> f64 {
    let distance = |row: &GoldenRow| {
        (position(arm, Vec::new(), &row.conditions()) - row.values[k]).norm() * 1e3
    };
    rows.iter().map(distance).fold(0.0, f64::max)
}

#[test]
fn rigid_positions_agree_to_a_nanometre() {
    let rows = golden_rows("rigid.csv");
    let nominal = worst(&stiffer(golden_problem(), 0.0, 0.0, 0.0), &rows, 0);
    let table_2 = worst(&stiffer(table_2(), 0.0, 0.0, 0.0), &rows, 1);
    println!("rigid: nominal {nominal:.1e} mm, table 2 {table_2:.1e} mm");
    assert!(nominal < 1e-6 && table_2 < 1e-6);
}

#[test]
fn small_displacements_agree_for_each_part() {
    let rows = golden_rows("first_order.csv");
    let straight = stiffer(golden_problem(), 0.0, 0.0, 0.0);
    // Deflections ten thousand times smaller are in the linear limit; scaled back, eleven digits
    // remain.
    let scale = 1e4;
    let parts = [
        ("joints", [scale, 0.0, 0.0]),
        ("link A", [0.0, scale, 0.0]),
        ("link B", [0.0, 0.0, scale]),
        ("all", [scale, scale, scale]),
    ];
    for (k, (name, [joints, link_a, link_b])) in parts.into_iter().enumerate() {
        let arm = stiffer(golden_problem(), joints, link_a, link_b);
        let mut worst = 0.0_f64;
        for row in &rows {
            let at = |arm| position(arm, Vec::new(), &row.conditions());
            worst = worst.max(((at(&arm) - at(&straight)) * scale - row.values[k]).norm() * 1e3);
        }
        println!("first order, {name}: {worst:.5} mm");
        assert!(worst < 0.003, "{name}: {worst} mm");
    }
}

#[test]
fn equilibrium_positions_agree() {
    let rows = golden_rows("equilibrium.csv");
    let (nominal, table_2) = (worst(&golden_problem(), &rows, 0), worst(&table_2(), &rows, 1));
    println!("equilibrium: nominal {nominal:.5} mm, table 2 {table_2:.5} mm");
    assert!(nominal < 0.005 && table_2 < 0.005, "{nominal} and {table_2} mm");
}

#[test]
fn the_error_falls_with_the_square_of_the_number_of_segments() {
    let rows = golden_rows("equilibrium.csv");
    let at = |segments: usize, row: &GoldenRow| {
        Rig::new(golden_problem(), Vec::new())
            .with_segments(segments)
            .position(&row.conditions())
            .unwrap()
    };
    let error = |segments| {
        let distance = |row: &GoldenRow| (at(segments, row) - at(256, row)).norm() * 1e3;
        rows[..10].iter().map(distance).fold(0.0, f64::max)
    };
    let begun = Instant::now();
    let errors = [2, 4, 8, 32].map(error);
    println!("error with 2, 4, 8, 32 segments a beam: {errors:?} mm ({:?})", begun.elapsed());
    for pair in errors.windows(2) {
        assert!(pair[1] < pair[0] / 3.5, "{errors:?}");
    }
    assert!(errors[3] < 1e-4);
}

#[test]
fn a_pose_takes_a_fraction_of_a_millisecond() {
    let (arm, rows) = (golden_problem(), golden_rows("equilibrium.csv"));
    let rig = Rig::new(arm, Vec::new());
    let begun = Instant::now();
    for row in &rows {
        rig.position(&row.conditions()).unwrap();
    }
    let each = begun.elapsed() / u32::try_from(rows.len()).unwrap();
    println!("{each:?} a pose");
    assert!(each.as_millis() < 10, "{each:?}");
}
