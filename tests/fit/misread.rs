//! Misreadings of a table, of the target and of lengths are named, and sound tables are not.

use flexcal::fit::FindingCode;
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use nalgebra::{UnitQuaternion, Vector3};

use crate::common::arms::parse;
use crate::common::made::fit_as_command;
use crate::judged::{PRIORS, measured, text};

/// Returns the arm of [`crate::judged`] with a free base, and its measurements.
fn arm() -> (Problem, Dataset) {
    let problem = parse(&text(&format!("{PRIORS}\n'base.*' = {{ free = true }}")));
    let data = measured(&problem, 8);
    (problem, data)
}

/// Fits a problem to a table and returns the text of the finding with this code.
fn named(problem: &Problem, data: &Dataset, code: FindingCode) -> String {
    let found = fit_as_command(problem, data);
    assert!(!found.is_trusted(), "{:?}", found.findings);
    let finding = found.finding(code).map(ToString::to_string);
    assert!(finding.is_some(), "{:?}", found.findings);
    finding.unwrap_or_default()
}

#[test]
fn a_scale_of_all_positions_is_named() {
    let (problem, clean) = arm();
    for scale in [1.05, 0.93] {
        let mut data = clean.clone();
        data.measurements.positions.iter_mut().for_each(|position| *position *= scale);
        let found = fit_as_command(&problem, &data);
        let first = found.first_error().unwrap_or_else(|| panic!("{:?}", found.findings));
        let words = first.to_string();
        // Parameters take a smaller scale up, so that its finding is about them.
        let is_scale = match first.code {
            FindingCode::Misread => {
                words.contains("positions on another scale than the joint table")
                    && words.contains(&format!("{scale:.2}"))
            }
            FindingCode::ScaleContradicted => {
                let error = first.number("error").unwrap();
                (error - (scale - 1.0)).abs() < 0.01
            }
            _ => false,
        };
        assert!(is_scale, "{words}");
    }
}

#[test]
fn a_scale_within_the_priors_is_contradicted_from_one_percent_on() {
    // The lengths of the arm are 2 % shorter than declared: 4.2 σ of their priors, or 2.8 σ.
    for (sigma_mm, is_contradicted) in [(4.2, true), (6.3, false)] {
        let priors = format!(
            "'joint*' = {{ sigma_deg = 0.3, sigma_mm = {sigma_mm} }}\n'tool.*' = {{ sigma_mm = 5 \
             }}\n'base.*' = {{ free = true }}"
        );
        let problem = parse(&text(&priors));
        let mut data = measured(&problem, 8);
        data.measurements.positions.iter_mut().for_each(|position| *position *= 0.98);
        let found = fit_as_command(&problem, &data);
        let finding = found.finding(FindingCode::ScaleContradicted);
        assert_eq!(finding.is_some(), is_contradicted, "{sigma_mm} {:?}", found.findings);
        let sigmas = finding.and_then(|finding| finding.number("sigmas"));
        assert!(sigmas.is_none_or(|sigmas| (3.5..5.0).contains(&sigmas.abs())), "{sigmas:?}");
    }
}

/// Change of the joint angles of one row.
type JointMistake = fn(&mut [f64]);

#[test]
fn units_and_orders_of_joint_columns_are_named() {
    let (problem, clean) = arm();
    let mistakes: [(JointMistake, &str); 5] = [
        (
            |q| q.iter_mut().for_each(|angle| *angle *= 4096.0 / 360.0),
            "joint angles that are counts of 4096 to a turn",
        ),
        (
            |q| q[1..3].iter_mut().for_each(|angle| *angle = angle.to_radians()),
            "joints 2 and 3 alone that are in radians, declared as degrees",
        ),
        (
            |q| q[1..4].rotate_left(1),
            "columns of joints 2, 3 and 4 that hold the angles of joints 3, 4 and 2",
        ),
        (
            |q| q.iter_mut().for_each(|angle| *angle = angle.to_radians() * 1e3),
            "joint angles that are milliradians",
        ),
        (
            |q| {
                q.swap(0, 1);
                q.swap(2, 4);
            },
            "columns of joints 1 and 2 that are exchanged, and those of joints 3 and 5",
        ),
    ];
    for (mistake, expected) in mistakes {
        let mut data = clean.clone();
        let joints = data.measurements.joints;
        data.measurements.configurations.chunks_exact_mut(joints).for_each(mistake);
        let words = named(&problem, &data, FindingCode::Misread);
        assert!(words.contains(expected), "{words}");
    }
}

#[test]
fn units_and_scales_of_positions_are_named() {
    let (problem, clean) = arm();
    let mistakes: [(Mistake, &str); 3] = [
        (|at| *at *= 1e3, "positions that are micrometres, declared as millimetres"),
        (|at| *at /= 304.8, "positions that are feet, declared as millimetres"),
        (|at| at.y *= 1.053, "y of the positions that is 1.05"),
    ];
    for (mistake, expected) in mistakes {
        let mut data = clean.clone();
        data.measurements.position_unit = Some(1e-3);
        data.measurements.positions.iter_mut().for_each(mistake);
        let words = named(&problem, &data, FindingCode::Misread);
        assert!(words.contains(expected), "{words}");
    }
}

#[test]
fn tenths_of_degrees_are_named() {
    let (problem, mut data) = arm();
    data.measurements.configurations.iter_mut().for_each(|q| *q *= 10.0);
    let words = named(&problem, &data, FindingCode::Misread);
    assert!(words.contains("joint angles that are tenths of a degree"), "{words}");
}

/// Change of one measured position.
type Mistake = fn(&mut Vector3<f64>);

#[test]
fn coordinates_are_told_apart_where_the_base_is_held() {
    let problem = parse(&text(PRIORS));
    let clean = measured(&problem, 8);
    let mistakes: [(Mistake, &str); 2] = [
        (|at| at.y = -at.y, "y of the positions that has the other sign"),
        (|at| at.swap_rows(0, 1), "x and y of the positions that are exchanged"),
    ];
    for (mistake, expected) in mistakes {
        let mut data = clean.clone();
        data.measurements.positions.iter_mut().for_each(mistake);
        let words = named(&problem, &data, FindingCode::Misread);
        assert!(words.contains(expected), "{words}");
    }
}

#[test]
fn reversed_rows_are_named_and_shuffled_ones_do_not_depend_on_their_joints() {
    let (problem, clean) = arm();
    let mut data = clean.clone();
    data.measurements.positions.reverse();
    let words = named(&problem, &data, FindingCode::Misread);
    assert!(words.contains("positions in the opposite order of the rows"), "{words}");
    let mut data = clean.clone();
    let rows = clean.measurements.len();
    for (row, position) in data.measurements.positions.iter_mut().enumerate() {
        *position = clean.measurements.positions[(row * 37 + 11) % rows];
    }
    let words = named(&problem, &data, FindingCode::ColumnDoubted);
    assert!(words.contains("do not depend on the joint angles of their rows"), "{words}");
    // A table of another arm depends on its joints.
    let mut other = problem.clone();
    for (joint, a) in other.joints.iter_mut().zip([0.1, 0.35, 0.2, 0.3, 0.15]) {
        joint.a = a;
    }
    let found = fit_as_command(&problem, &measured(&other, 8));
    let doubted = found.finding(FindingCode::ColumnDoubted).map(ToString::to_string);
    let doubted = doubted.unwrap_or_default();
    assert!(!found.is_trusted() && !doubted.contains("do not depend"), "{doubted}");
}

#[test]
fn exchanged_lengths_of_neighbouring_joints_and_an_exchanged_target_are_named() {
    let (mut problem, data) = arm();
    let (third, fourth) = (problem.joints[2].a, problem.joints[3].a);
    (problem.joints[2].a, problem.joints[3].a) = (fourth, third);
    let words = named(&problem, &data, FindingCode::Misread);
    assert!(words.contains("a of row 3 and a of row 4 of the joint table"), "{words}");
    let (mut problem, data) = arm();
    problem.tool.target.swap_rows(0, 2);
    let found = fit_as_command(&problem, &data);
    assert!(!found.is_trusted());
    let said = found.findings.iter().any(|finding| {
        let words = finding.to_string();
        words.contains("x and z seem to be exchanged") || words.contains("target that lies")
    });
    assert!(said, "{:?}", found.findings);
}

#[test]
fn inverse_poses_are_named() {
    let (problem, mut data) = arm();
    let rows = &mut data.measurements;
    let turns: Vec<UnitQuaternion<f64>> = (0..rows.len())
        .map(|row| {
            let angle = 0.7 * (row as f64).sin();
            UnitQuaternion::from_euler_angles(angle, 0.9 * (row as f64).cos(), 2.0 * angle)
        })
        .collect();
    for (position, turn) in rows.positions.iter_mut().zip(&turns) {
        *position = -(turn.inverse() * *position);
    }
    rows.orientations = Some(turns.iter().map(UnitQuaternion::inverse).collect());
    let words = named(&problem, &data, FindingCode::Misread);
    assert!(words.contains("poses that are inverse"), "{words}");
}

#[test]
fn a_number_of_the_joint_table_that_was_typed_wrongly_is_named() {
    type Mistake = fn(&mut Problem);
    let cases: [(Mistake, &str); 2] = [
        (|arm| arm.joints[2].a = 0.96, "a of joint 3 that is about"),
        (|arm| arm.joints[3].alpha += 0.7, "alpha of joint 4 that is about -"),
    ];
    for (mistake, words) in cases {
        let (mut problem, data) = arm();
        mistake(&mut problem);
        let text = named(&problem, &data, FindingCode::Misread);
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn two_mistakes_at_once_are_named() {
    let (mut problem, mut data) = arm();
    problem.joints[1].theta += std::f64::consts::FRAC_PI_2;
    data.measurements.positions.iter_mut().for_each(|position| position.swap_rows(0, 1));
    let text = named(&problem, &data, FindingCode::Misread);
    assert!(text.contains("two of x, y and z") && text.contains("joint 2 whose zero"), "{text}");
}

#[test]
fn a_misreading_beside_wrong_rows_is_named() {
    let (problem, mut data) = arm();
    let joints = data.measurements.joints;
    for row in 0..90 {
        data.measurements.configurations[row * joints + 2] *= -1.0;
    }
    for row in [11, 43] {
        data.measurements.positions[row].x += 0.7;
    }
    let text = named(&problem, &data, FindingCode::Misread);
    assert!(text.contains("joint 3 that counts the other way"), "{text}");
    assert!(text.contains("which are wrong besides"), "{text}");
}

#[test]
fn a_row_that_one_of_two_joined_tables_lacks_is_named() {
    let (problem, mut data) = arm();
    // The table of positions lacks row 17.
    for row in 17..89 {
        data.measurements.positions[row] = data.measurements.positions[row + 1];
    }
    let text = named(&problem, &data, FindingCode::Misread);
    assert!(text.contains("configuration 1 row after, from"), "{text}");
}
