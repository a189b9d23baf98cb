//! Misprints of the paper, and their size on the lunar sampler.

use flexcal::paper::published::{
    BEFORE, ERRORS, NOMINAL, Published, WITH_ELASTICITY, is_published_arm,
};
use flexcal::paper::{Form, Misprint, Parameters, Reading};
use flexcal::problem::Problem;

use super::arm::{both, end, problem, table_2, table_2_errors};
use crate::common::golden::{GoldenRow, golden_rows};

fn largest(of: impl Iterator<Item = f64>) -> f64 {
    of.fold(0.0, f64::max)
}

/// Returns the largest change [mm] of `D_f` by one misprint over the golden poses.
fn elastic(
    problem: &Problem,
    parameters: &Parameters,
    rows: &[GoldenRow],
    misprint: Misprint,
) -> f64 {
    let size = |row: &GoldenRow| {
        let deflection =
            |reading: Reading| end(problem, parameters, row, reading).deflection(parameters);
        let corrected = Reading::from(Form::Corrected);
        (deflection(corrected.with(misprint, Form::Printed)) - deflection(corrected)).norm() * 1e3
    };
    largest(rows.iter().map(size))
}

/// Returns the largest change [mm] of `D_g` at table 2 by one misprint.
fn geometric(problem: &Problem, rows: &[GoldenRow], misprint: Misprint) -> f64 {
    let (nominal, e) = (Parameters::nominal(problem), table_2_errors(problem));
    let size = |row: &GoldenRow| {
        let error = |reading: Reading| end(problem, &nominal, row, reading).jacobian() * &e;
        let corrected = Reading::from(Form::Corrected);
        (error(corrected.with(misprint, Form::Printed)) - error(corrected)).norm() * 1e3
    };
    largest(rows.iter().map(size))
}

#[test]
fn misprints_of_the_elastic_formulas_have_these_sizes() {
    let problem = problem();
    let (rows, [nominal, table_2]) = (golden_rows("first_order.csv"), both(&problem));
    let whole = largest(rows.iter().map(|row| {
        end(&problem, &nominal, row, Form::Corrected).deflection(&nominal).norm() * 1e3
    }));
    println!("largest deflection: {whole:.3} mm");
    // Limits in mm for the nominal geometry, then for that of table 2.
    let limits = [
        (Misprint::TipForceLever, 2.7..2.9, 2.8..3.0),
        (Misprint::HoistBending, 3.0..3.3, 3.0..3.3),
        (Misprint::SlopePlaces, 3.3..3.5, 3.3..3.5),
        (Misprint::Stretch, 0.001..0.0014, 0.001..0.0014),
        (Misprint::HoistBeyond, 27.0..28.5, 27.5..29.5),
        (Misprint::JointTwoLength, 0.0..1e-12, 2.1..2.4),
        (Misprint::JointAxis, 0.0..1e-12, 0.0005..0.0015),
        (Misprint::TransferIndex, 20.0..21.5, 20.5..22.0),
        (Misprint::LinkSide, 30.0..32.5, 31.5..33.5),
        (Misprint::LinkTransfer, 47.0..50.0, 49.0..52.0),
        (Misprint::EndFrame, 90.0..94.0, 92.0..97.0),
    ];
    for (misprint, at_nominal, at_table_2) in limits {
        let sizes =
            [&nominal, &table_2].map(|parameters| elastic(&problem, parameters, &rows, misprint));
        println!("{misprint:?}: {:.5} mm nominal, {:.5} mm table 2", sizes[0], sizes[1]);
        assert!(
            at_nominal.contains(&sizes[0]) && at_table_2.contains(&sizes[1]),
            "{misprint:?} {sizes:?}"
        );
    }
}

#[test]
fn misprints_of_the_geometric_formulas_have_these_sizes() {
    let problem = problem();
    let rows = golden_rows("rigid.csv");
    let (nominal, e) = (Parameters::nominal(&problem), table_2_errors(&problem));
    let whole =
        largest(rows.iter().map(|row| {
            (end(&problem, &nominal, row, Form::Corrected).jacobian() * &e).norm() * 1e3
        }));
    println!("largest geometric error: {whole:.3} mm");
    let limits = [(Misprint::GeometricSide, 99.0..104.0), (Misprint::EndFrame, 90.0..94.0)];
    for (misprint, limit) in limits {
        let size = geometric(&problem, &rows, misprint);
        println!("{misprint:?}: {size:.5} mm of D_g at table 2");
        assert!(limit.contains(&size), "{misprint:?} {size}");
    }
    // The displacement by β alone at table 2 is what an E_j without β misses.
    let only_beta = e.map_with_location(|k, _, e| if k % 5 == 4 { e } else { 0.0 });
    let size = largest(rows.iter().map(|row| {
        (end(&problem, &nominal, row, Form::Corrected).jacobian() * &only_beta).norm() * 1e3
    }));
    println!("BetaLeftOut: β of table 2 moves the end point by {size:.5} mm");
    assert!((20.0..21.5).contains(&size));
}

#[test]
fn table_1_as_printed_turns_the_arm_over() {
    let mut problem = problem();
    let row = &golden_rows("rigid.csv")[0];
    let position = |problem: &Problem, q: &[f64]| {
        flexcal::paper::Chain::new(problem, &Parameters::nominal(problem).geometry, q).position()
    };
    let here = position(&problem, &row.q);
    problem.joints[1].alpha = -std::f64::consts::FRAC_PI_2;
    let there = position(&problem, &row.q);
    println!("table 1, α₂ = −90°: {:.1} mm", (there - here).norm() * 1e3);
    assert!((there - here).norm() > 1.0);
    // Both tables describe the same arm if θ₂ to θ₄ and the offsets along their axes change sign.
    problem.joints[1..].iter_mut().for_each(|joint| joint.d = -joint.d);
    problem.tool.target.z = -problem.tool.target.z;
    let mirrored = position(&problem, &[row.q[0], -row.q[1], -row.q[2], -row.q[3]]);
    assert!((mirrored - here).norm() < 1e-12);
}

#[test]
fn lengths_of_the_tables_are_metres() {
    let problem = problem();
    let reach: f64 = table_2().iter().map(|link| link.a).sum();
    let largest =
        golden_rows("rigid.csv").iter().map(|row| row.values[0].norm()).fold(0.0, f64::max);
    println!("tables 1 and 2: links of {reach:.3} m, not mm; errors of 49 mm need them");
    assert!(reach > 3.7 && largest < reach + 0.7);
    // Read in mm, table 2 moves the end point by micrometres, not by the 49 mm of table 3.
    let mut small = problem.clone();
    for joint in &mut small.joints {
        (joint.a, joint.d) = (joint.a * 1e-3, joint.d * 1e-3);
    }
    small.tool.target *= 1e-3;
    let nominal = Parameters::nominal(&small);
    let angles = table_2_errors(&problem)
        .map_with_location(|k, _, e| if [0, 2, 4].contains(&(k % 5)) { e } else { 0.0 });
    let moved = golden_rows("rigid.csv")
        .iter()
        .map(|row| (end(&small, &nominal, row, Form::Corrected).jacobian() * &angles).norm() * 1e3)
        .fold(0.0, f64::max);
    assert!(moved < 0.05, "{moved} mm");
}

#[test]
fn reductions_of_table_3_from_its_own_numbers() {
    let reduction = |before: f64, after: f64| 100.0 * (1.0 - after / before);
    let [max, mean] = [|table: &Published| table.max[3], |table: &Published| table.mean[3]];
    assert!(
        (reduction(max(&BEFORE), max(&WITH_ELASTICITY)) - 88.68).abs() < 0.005,
        "the text prints 88.63 %"
    );
    assert!((reduction(mean(&BEFORE), mean(&WITH_ELASTICITY)) - 92.16).abs() < 0.005, "as printed");
}

#[test]
fn readings_keep_what_they_are_told_to() {
    let printed = Reading::from(Form::Printed);
    for misprint in Misprint::EACH {
        assert_eq!(printed.keeps(misprint), !Misprint::CONTRADICTED.contains(&misprint));
        assert!(!Reading::default().keeps(misprint));
        assert!(Reading::from(misprint).keeps(misprint));
        assert_eq!(Misprint::EACH[misprint as usize], misprint);
    }
}

#[test]
fn the_papers_arm_is_known_by_its_tables() {
    let mut problem = problem();
    assert!(is_published_arm(&problem), "by the α₂ of table 2");
    problem.joints[1].alpha = -problem.joints[1].alpha;
    assert!(is_published_arm(&problem), "by the α₂ of table 1");
    let identified = NOMINAL.iter().zip(&ERRORS).map(|(nominal, error)| nominal[1] + error[1]);
    assert!(identified.zip(table_2()).all(|(a, link)| (a - link.a).abs() < 1e-12), "table 2");
    problem.joints[2].a += 1e-6;
    assert!(!is_published_arm(&problem));
}
