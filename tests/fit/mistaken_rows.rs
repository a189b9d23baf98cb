//! The mistake in a column, in a block of rows or in held-out rows is named by what fits instead.

use flexcal::fit::{FindingCode, Identification};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use nalgebra::Vector3;

use crate::common::arms::parse;
use crate::common::made::{fit, fit_as_command};
use crate::judged::{PRIORS, measured, text};

/// Number in a row of a column, as a function of the row and the right column.
type Number = fn(usize, &[f64]) -> f64;

/// Number of joints of the arm.
const JOINTS: usize = 5;

/// Returns the arm of [`crate::judged`] with a free base, and its measurements.
fn arm() -> (Problem, Dataset) {
    let problem = parse(&text(&format!("{PRIORS}\n'base.*' = {{ free = true }}")));
    let data = measured(&problem, 3);
    (problem, data)
}

/// Returns the positions of the arm of a problem whose target sits 40 mm elsewhere.
fn elsewhere(text: &str) -> Vec<Vector3<f64>> {
    let problem = parse(&text.replace("0.05, 0.02, 0.12", "0.05, -0.02, 0.12"));
    measured(&problem, 3).measurements.positions
}

/// Returns the finding with a code as text; empty if there is none.
fn told(found: &Identification, code: FindingCode) -> String {
    found.finding(code).map(ToString::to_string).unwrap_or_default()
}

#[test]
fn what_the_numbers_of_a_column_are_is_named() {
    let (problem, clean) = arm();
    let cases: [(usize, Number, &str); 4] = [
        (2, |row, q| q[row.saturating_sub(1)], "each of its numbers belongs to the row before"),
        (3, |row, q| q[(row + 1).min(89)], "each of its numbers belongs to the row after"),
        (1, |row, q| q[if (20..35).contains(&row) { 20 } else { row }], "it holds one number"),
        (
            3,
            |row, q| if row < 45 { q[row] } else { q[row] + 1.5 },
            "its numbers are too large by 8",
        ),
    ];
    for (joint, number, words) in cases {
        let mut data = clean.clone();
        let column: Vec<f64> =
            (0..90).map(|row| clean.measurements.configuration(row)[joint]).collect();
        for row in 0..90 {
            data.measurements.configurations[row * JOINTS + joint] = number(row, &column);
        }
        let text = told(&fit_as_command(&problem, &data), FindingCode::ColumnDoubted);
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn the_reading_with_which_a_block_of_rows_fits_is_named() {
    let (problem, clean) = arm();
    let text = |data: &Dataset| told(&fit(&problem, data), FindingCode::RowsDoubted);
    let mut data = clean.clone();
    for row in 20..40 {
        data.measurements.configurations.swap(row * JOINTS + 1, row * JOINTS + 2);
    }
    let exchanged = text(&data);
    assert!(exchanged.contains("columns of joints 2 and 3 that are exchanged"), "{exchanged}");
    let mut data = clean.clone();
    data.measurements.positions[20..40].rotate_right(1);
    let shifted = text(&data);
    assert!(shifted.contains("belong to the joint angles of the row before"), "{shifted}");
    let mut data = clean;
    for at in &mut data.measurements.positions[..9] {
        *at += Vector3::new(0.4, -0.3, 0.2);
    }
    let moved = text(&data);
    assert!(moved.contains("they fit where the base stands elsewhere, by"), "{moved}");
}

#[test]
fn the_mistake_in_held_out_rows_is_named() {
    let (problem, clean) = arm();
    assert!(!fit_as_command(&problem, &clean).has(FindingCode::HeldOutMissed));
    let other = elsewhere(&text(&format!("{PRIORS}\n'base.*' = {{ free = true }}")));
    let text = |change: &dyn Fn(usize, &mut Dataset)| {
        let mut data = clean.clone();
        (60..90).for_each(|row| change(row, &mut data));
        told(&fit_as_command(&problem, &data), FindingCode::HeldOutMissed)
    };
    let exchanged = text(&|row, data| data.measurements.positions[row].swap_rows(0, 1));
    assert!(exchanged.contains("their x and y are exchanged"), "{exchanged}");
    let reversed = text(&|row, data| data.measurements.configurations[row * JOINTS + 2] *= -1.0);
    assert!(reversed.contains("their q3 has the other sign"), "{reversed}");
    let target = text(&|row, data| data.measurements.positions[row] = other[row]);
    assert!(target.contains("with the target 40.0 mm elsewhere in its frame"), "{target}");
}

#[test]
fn places_that_change_twice_or_by_turns_are_named() {
    let (problem, clean) = arm();
    let mut data = clean.clone();
    let positions = &mut data.measurements.positions;
    positions[20..].iter_mut().for_each(|at| *at += Vector3::new(3e-3, 0.0, 1e-3));
    positions[40..].iter_mut().for_each(|at| *at += Vector3::new(0.0, -4e-3, 1e-3));
    let twice = told(&fit_as_command(&problem, &data), FindingCode::RowsChanged);
    let parts = ["(40 of 60 rows) the base stands", "(20 of 60 rows) the base stands"];
    assert!(parts.iter().all(|part| twice.contains(part)), "{twice}");

    let free = PRIORS.replace("{ sigma_mm = 2 }", "{ free = true }");
    let text = text(&format!("{free}\n'base.*' = {{ free = true }}"));
    let problem = parse(&text);
    let mut data = measured(&problem, 3);
    let other = elsewhere(&text);
    for row in (0..90).filter(|row| row % 3 == 1) {
        data.measurements.positions[row] = other[row];
    }
    let turns = told(&fit_as_command(&problem, &data), FindingCode::RowsChanged);
    assert!(turns.contains("(20 of 60 rows) the target sits 40.0 mm elsewhere"), "{turns}");
}
