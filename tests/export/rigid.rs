//! Tables of rigid geometry.

use flexcal::export::StandardTable;
use flexcal::mechanics::{Angle, Arm};
use flexcal::problem::Problem;
use flexcal::spatial::Frame;
use nalgebra::Vector3;

use super::common::arms::{parse, path};
use super::lunar_sampler;

/// Returns the lists and numbers of a YAML table in their order, each with its key.
fn numbers(text: &str) -> Vec<(String, Vec<f64>)> {
    let line = |line: &str| {
        let (key, value) = line.trim().split_once(": ")?;
        let value = value.trim_matches(['[', ']']);
        let values: Result<Vec<f64>, _> = value.split(", ").map(str::parse).collect();
        Some((key.to_owned(), values.ok()?))
    };
    text.lines().filter(|line| !line.starts_with('#')).filter_map(line).collect()
}

/// Returns the tip of an arm given as base, tool and rows of θ, d, a, α and perhaps β, by their
/// commands.
fn tip(text: &str, commands: &[f64]) -> Frame<f64> {
    let all = numbers(text);
    let placed = |k: usize| {
        Frame::from_xyz_rpy(
            &Vector3::from_row_slice(&all[k].1),
            &Vector3::from_row_slice(&all[k + 1].1),
        )
    };
    let mut frame = placed(0);
    let width = if all.iter().any(|(key, _)| key == "beta_rad") { 5 } else { 4 };
    for (row, q) in all[4..].chunks(width).zip(commands) {
        frame.rotate_z((row[0].1[0] + q).sin_cos());
        frame.translate_z(row[1].1[0]);
        frame.translate_x(row[2].1[0]);
        frame.rotate_x(row[3].1[0].sin_cos());
        if let Some(beta) = row.get(4) {
            frame.rotate_y(beta.1[0].sin_cos());
        }
    }
    frame.compose(&placed(2))
}

#[test]
fn standard_parameters_describe_the_identified_arm() {
    let folder = lunar_sampler();
    let cases = path("tests/cases");
    let export = |form: &str, more: &str| {
        let words = format!(
            "export {} --estimate out/estimate.json --format {form} --out {form}.yaml --force {more}",
            cases.display()
        );
        let run = folder.flexcal(&words).success();
        (folder.read(format!("{form}.yaml")), run.stdout)
    };
    let problem = Problem::read(&cases).unwrap();
    let (standard, modified) = (export("dh", "").0, export("mdh", "").0);
    let rows = numbers(&modified);
    for k in 0..20 {
        let q: Vec<f64> =
            (0..problem.joints.len()).map(|j| (1.3 * f64::from(k) + j as f64).sin()).collect();
        let mut frame = Frame::identity();
        for (row, q) in rows.chunks(5).zip(&q) {
            frame.rotate_x(row[0].1[0].sin_cos());
            frame.translate_x(row[1].1[0]);
            frame.rotate_z((row[2].1[0] + q).sin_cos());
            frame.translate_z(row[3].1[0]);
            frame.rotate_y(row[4].1[0].sin_cos());
        }
        let other = tip(&standard, &q);
        assert!((frame.origin - other.origin).norm() < 1e-9);
        let turn = frame.axes.iter().zip(&other.axes).map(|(a, b)| (a - b).norm());
        assert!(turn.fold(0.0, f64::max) < 1e-9);
    }
    // The best rigid arm of a workspace is nearer to the whole model than the identified geometry.
    let (best, said) =
        export("mdh", "--best-rigid --workspace-mm=-3000,3000,-3000,3000,-1000,3000");
    assert_ne!(best, modified);
    let said = said.replace('\n', " ");
    let line = &said[said.find("differs from the exported geometry").unwrap()..];
    let values: Vec<f64> = line.split([' ', '(']).filter_map(|word| word.parse().ok()).collect();
    assert!(values[0] < 0.9 * values[2], "{line}");
    // A rigid arm fitted to the measured poses is nearer to them, and the next command says so.
    assert!(said.contains("--format mdh --fitted-alone"), "{said}");
    let (alone, said) = export("mdh", "--fitted-alone");
    assert!(alone != modified && alone != best);
    assert!(alone.contains("# Base and tool of this geometry") && alone.contains("tool.x = "));
    assert!(said.contains("Base and tool of this geometry"), "{said}");
    assert!(said.contains("tool.x = "), "{said}");
    assert!(!said.contains("Not the best"), "{said}");
}

/// Six axes of a data sheet: axes 2 and 3 are parallel, axes 4 to 6 meet in a point.
const SHEET: &str = "name = 'sheet'
dh = 'standard'
joint = [
  { d_mm = 495, a_mm = 175, alpha_deg = -90, min_deg = -160, max_deg = 160 },
  { theta_deg = -90, a_mm = 900, min_deg = -90, max_deg = 70 },
  { a_mm = 115, alpha_deg = -90, min_deg = -60, max_deg = 120 },
  { d_mm = 960, alpha_deg = 90, min_deg = -170, max_deg = 170 },
  { alpha_deg = -90, min_deg = -110, max_deg = 110 },
  { d_mm = 135, min_deg = -175, max_deg = 175 },
]
tool.target_mm = [40, -20, 70]
[data]
files = ['measurements.csv']
position_sigma_mm = 0.05
";

/// Returns the tip of an arm in the form of the problem; the last joint is fixed.
fn modified_tip(arm: &Arm<f64>, commands: &[f64]) -> Frame<f64> {
    let mut frame = Frame::identity();
    for (joint, q) in arm.joints.iter().zip(commands.iter().chain([&0.0])) {
        frame.rotate_x(joint.alpha.sin_cos);
        frame.translate_x(joint.a);
        frame.rotate_z((joint.theta + q).sin_cos());
        frame.translate_z(joint.d);
        frame.rotate_y(joint.beta.sin_cos);
    }
    frame
}

#[test]
fn a_standard_sheet_comes_back_near_its_values() {
    let problem = parse(SHEET);
    let nominal = Arm::nominal(&problem);
    let table = StandardTable::new(&problem, &nominal).unwrap();
    assert!(table.notes().is_empty(), "{:?}", table.notes());
    let cells = table.cells();
    assert_eq!(cells[1][1..], ["0.0000", "495.000", "175.000", "-90.0000"]);
    assert_eq!(cells[2][1..], ["-90.0000", "0.000", "900.000", "0.0000"]);
    assert_eq!(cells[6][1..], ["0.0000", "135.000", "0.000", "0.0000"]);
    let sheet = numbers(&table.yaml());
    for (with_beta, count) in [(false, 28), (true, 34)] {
        let mut arm = nominal.clone();
        let deviation = |k: usize, size: f64| size * (1.7 * k as f64 + 0.4).sin();
        for (k, joint) in arm.joints.iter_mut().enumerate() {
            let [angle, length] = [5e-3, 2e-3];
            joint.alpha = Angle::new(joint.alpha.value + deviation(5 * k, angle));
            joint.a += deviation(5 * k + 1, length);
            joint.theta += deviation(5 * k + 2, angle);
            joint.d += deviation(5 * k + 3, length);
            if with_beta {
                joint.beta = Angle::new(deviation(5 * k + 4, angle));
            }
        }
        let table = StandardTable::new(&problem, &arm).unwrap();
        let text = table.yaml();
        let rows = numbers(&text);
        assert_eq!(rows.len(), count, "{text}");
        assert_eq!(table.notes().len(), usize::from(with_beta), "{text}");
        // Every value stays near the sheet, although two axes are nearly parallel.
        for (key, value) in rows.iter().filter(|(key, _)| key != "beta_rad") {
            let nominal = |(other, values): &&(String, Vec<f64>)| {
                other == key && values.iter().zip(value).all(|(a, b)| (a - b).abs() < 0.02)
            };
            assert!(sheet.iter().any(|entry| nominal(&entry)), "{key} {value:?}\n{text}");
        }
        for k in 0..20 {
            let q: Vec<f64> = (0..6).map(|j| (1.3 * f64::from(k) + f64::from(j)).sin()).collect();
            let (expected, found) = (modified_tip(&arm, &q), tip(&text, &q));
            assert!((expected.origin - found.origin).norm() < 1e-9, "{text}");
            let turn = expected.axes.iter().zip(&found.axes).map(|(a, b)| (a - b).norm());
            assert!(turn.fold(0.0, f64::max) < 1e-9);
        }
    }
}
