//! Tables of rigid geometry.

use flexcal::problem::Problem;
use flexcal::spatial::Frame;
use nalgebra::Vector3;

use super::common::arms::path;
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

/// Returns the tip of an arm given as base, tool and rows of θ, d, a, α, by their commands.
fn tip(text: &str, commands: &[f64]) -> Frame<f64> {
    let all = numbers(text);
    let placed = |k: usize| {
        Frame::from_xyz_rpy(
            &Vector3::from_row_slice(&all[k].1),
            &Vector3::from_row_slice(&all[k + 1].1),
        )
    };
    let mut frame = placed(0);
    for (row, q) in all[4..].chunks(4).zip(commands) {
        frame.rotate_z((row[0].1[0] + q).sin_cos());
        frame.translate_z(row[1].1[0]);
        frame.translate_x(row[2].1[0]);
        frame.rotate_x(row[3].1[0].sin_cos());
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
    let line = said.lines().find(|line| line.starts_with("In the workspace")).unwrap();
    let values: Vec<f64> = line.split([' ', '(']).filter_map(|word| word.parse().ok()).collect();
    assert!(values[0] < 0.9 * values[2], "{line}");
}
