//! Rows and columns that contradict the others are named, with what is wrong in them.

use flexcal::fit::{FindingCode, Identification};
use flexcal::measurement::Dataset;
use nalgebra::Vector3;

use crate::common::arms::parse;
use crate::common::made::{fit, fit_as_command, labels};
use crate::judged::{PRIORS, measured, text};

/// Mistake in the rows of a range, as a function of a row's position.
type Mistake = fn(&mut Vector3<f64>);

/// Returns the arm of [`crate::judged`] with a free base, and its measurements.
fn arm() -> (flexcal::problem::Problem, Dataset) {
    let problem = parse(&text(&format!("{PRIORS}\n'base.*' = {{ free = true }}")));
    let data = measured(&problem, 3);
    (problem, data)
}

/// Returns the number of doubted rows and the text of the finding on them.
fn doubted(found: &Identification) -> Option<(usize, String)> {
    let finding = found.finding(FindingCode::RowsDoubted)?;
    let rows = finding.value("rows")?.as_array()?.len();
    Some((rows, finding.to_string()))
}

#[test]
fn a_coordinate_that_stands_still_or_is_copied_is_named() {
    let (problem, clean) = arm();
    let cases: [(Mistake, &str); 2] = [
        (|at| at.z = 0.35, "the coordinate z holds the same number in all 60 rows"),
        (|at| at.y = at.x, "each of the coordinates x and y equals the other in all 60 rows"),
    ];
    for (mistake, words) in cases {
        let mut data = clean.clone();
        data.measurements.positions.iter_mut().for_each(mistake);
        let found = fit(&problem, &data);
        let finding = found.finding(FindingCode::ColumnDoubted).map(ToString::to_string);
        assert!(finding.as_ref().is_some_and(|text| text.contains(words)), "{finding:?}");
    }
}

#[test]
fn rows_that_contradict_the_others_are_named_with_their_mistake() {
    let (problem, clean) = arm();
    assert_eq!(doubted(&fit(&problem, &clean)), None);
    let cases: [(std::ops::Range<usize>, Mistake, &str); 5] = [
        (20..35, |at| at.y = -at.y, "their y has the other sign"),
        (20..35, |at| at.swap_rows(0, 2), "their x and z are exchanged"),
        (40..50, |at| *at *= 1e3, "another unit: divide them by 1000"),
        (10..20, |at| at.z += 0.3, "their z alone is wrong"),
        (30..60, |at| *at += Vector3::new(0.5, -0.8, 0.2), "column session"),
    ];
    for (rows, mistake, words) in cases {
        let mut data = clean.clone();
        data.measurements.positions[rows.clone()].iter_mut().for_each(mistake);
        let found = fit(&problem, &data);
        let (count, text) = doubted(&found).unwrap_or_else(|| panic!("{words}: {found:?}"));
        assert!(count + 2 >= rows.len() && count <= rows.len(), "{words}: {count}, {text}");
        assert!(text.contains(words), "{words}: {text}");
        assert!(!found.is_trusted());
    }
    // Joint columns are wrong in some rows.
    let turned = |factor: f64, joints: std::ops::Range<usize>| {
        let mut data = clean.clone();
        for row in 30..45 {
            let of_row = row * 5..(row + 1) * 5;
            let configuration = &mut data.measurements.configurations[of_row];
            configuration[joints.clone()].iter_mut().for_each(|q| *q *= factor);
        }
        doubted(&fit(&problem, &data)).unwrap().1
    };
    let radians = turned(1_f64.to_radians(), 0..5);
    assert!(radians.contains("their joint angles are in radians"), "{radians}");
    let reversed = turned(-1.0, 2..3);
    assert!(reversed.contains("their q3 has the other sign"), "{reversed}");
    // A session with a base of its own, in metres under a name in millimetres.
    let mut data = clean.clone();
    data.measurements.session = labels((0..90).map(|row| if row % 90 < 36 { "A" } else { "B" }));
    data.measurements.positions[36..60].iter_mut().for_each(|at| *at *= 1e-3);
    let (count, text) = doubted(&fit(&problem, &data)).unwrap();
    assert!(count == 24 && text.contains("another unit: multiply them by 1000"), "{text}");
    let mut data = clean;
    data.measurements.positions.swap(20, 21);
    let (count, text) = doubted(&fit(&problem, &data)).unwrap();
    assert!(count == 2 && text.contains("each other's joint angles"), "{text}");
}

#[test]
fn a_column_that_the_positions_do_not_follow_is_named() {
    let (problem, clean) = arm();
    for joint in [0, 2, 3, 4] {
        let mut data = clean.clone();
        let rows = data.measurements.len();
        for row in 0..rows {
            let q = ((row * 7919) % 211) as f64 / 60.0 - 1.7;
            data.measurements.configurations[row * 5 + joint] = q;
        }
        let found = fit_as_command(&problem, &data);
        let finding =
            found.finding(FindingCode::ColumnDoubted).unwrap_or_else(|| panic!("{found:?}"));
        let columns = finding.value("columns").unwrap();
        assert_eq!(columns[0], format!("q{}", joint + 1), "{finding}");
        let [before, after] = ["before", "after"].map(|name| finding.number(name).unwrap());
        assert!(after < 0.1 * before, "{finding}");
        // The headline states the cause.
        let misfit = found.first_error().unwrap();
        assert!(misfit.to_string().contains("do not follow the column"), "{misfit}");
    }
}

#[test]
fn rows_with_the_word_of_another_session_are_named() {
    let (problem, mut data) = arm();
    let exchanged = [10, 20, 50, 55];
    data.measurements.positions[36..].iter_mut().for_each(|at| *at += Vector3::new(1.0, 0.5, 0.0));
    let words = (0..90).map(|row| if (row < 36) == exchanged.contains(&row) { "B" } else { "A" });
    data.measurements.session = labels(words);
    let (count, text) = doubted(&fit(&problem, &data)).unwrap();
    assert!(count == 4 && text.contains("they fit in session A or B instead"), "{text}");
}

/// Returns the place and the text of the finding on a change from a row on.
fn changed(problem: &flexcal::problem::Problem, data: &Dataset) -> Option<(String, String)> {
    let found = fit_as_command(problem, data);
    let finding = found.finding(FindingCode::RowsChanged)?;
    Some((finding.word("place")?.to_owned(), finding.to_string()))
}

#[test]
fn a_place_that_changes_between_two_rows_is_named() {
    let (problem, clean) = arm();
    assert_eq!(changed(&problem, &clean), None);
    // A joint loses its zero position.
    let mut data = clean.clone();
    for row in 40..90 {
        data.measurements.configurations[row * 5 + 2] += 0.01;
    }
    let (place, text) = changed(&problem, &data).unwrap();
    assert!(place == "zero" && text.contains("zero position of joint 3 is off by"), "{text}");
    assert!(text.contains("0.57") && text.contains("fit the rows before and after"), "{text}");
    // The station moves by less than a misfit.
    let mut data = clean.clone();
    data.measurements.positions[30..]
        .iter_mut()
        .for_each(|at| *at += Vector3::new(3e-3, 0.0, 1e-3));
    let (place, text) = changed(&problem, &data).unwrap();
    assert!(place == "base" && text.contains("another word in a column session"), "{text}");
    // A drift over the rows and a dependence on a joint are no change from a row on.
    let mut data = clean.clone();
    for (row, at) in data.measurements.positions.iter_mut().enumerate() {
        at.z += 4e-5 * row as f64;
    }
    assert_eq!(changed(&problem, &data), None);
    // A drift in the middle third of the fitted rows: a step explains nine tenths of it, an even
    // drift as much.
    let mut data = clean.clone();
    for (row, at) in data.measurements.positions.iter_mut().enumerate() {
        at.z += 1e-4 * row.clamp(20, 40) as f64;
    }
    assert_eq!(changed(&problem, &data), None);
    // Another arm measured the later rows.
    let mut data = clean.clone();
    let other = measured(&problem, 4).measurements;
    data.measurements.positions[30..].copy_from_slice(&other.positions[30..]);
    data.measurements.configurations[150..].copy_from_slice(&other.configurations[150..]);
    let (place, text) = changed(&problem, &data).unwrap();
    assert!(place == "arm" && text.contains("30 of 60 rows"), "{text}");
    let mut data = clean;
    for row in 0..90 {
        if data.measurements.configuration(row)[1] > 0.3 {
            data.measurements.positions[row].y += 3e-3;
        }
    }
    assert_eq!(changed(&problem, &data), None);
}

#[test]
fn a_base_that_is_held_while_another_is_free_is_named() {
    let problem = parse(&text(&format!("{PRIORS}\n'base[A].*' = {{ free = true }}")));
    let mut data = arm().1;
    data.measurements.session = labels((0..90).map(|row| if row < 60 { "A" } else { "B" }));
    data.measurements.positions[60..].iter_mut().for_each(|at| at.x += 2.0);
    let found = fit(&problem, &data);
    let finding = found.finding(FindingCode::HeldOutMissed);
    let finding = finding.unwrap_or_else(|| panic!("{:?}", found.findings));
    assert!(finding.remedy.contains("\"base[B].*\" = { free = true }"), "{finding}");
}
