//! Arms of the tests.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use flexcal::measurement::{Dataset, Measurements};
use flexcal::mechanics::{Angle, Arm};
use flexcal::model::parameter::{JointField, Parameter, ParameterSite};
use flexcal::problem::Problem;
use nalgebra::DVector;

/// Identified α \[°\], a \[m\], θ \[°\], d \[m\], β \[°\] of each joint [Chen2021, table 2].
pub const TABLE_2: [[f64; 5]; 4] = [
    [0.019, 0.0, -0.008, 0.097, 0.304],
    [89.996, -0.002, 0.304, -0.084, 0.007],
    [-0.001, 1.974, 0.189, -0.095, 0.0],
    [-0.019, 1.766, -0.790, -0.092, 0.005],
];

/// Arm with the features that the lunar sampler lacks: a fixed and a prismatic joint, a link along
/// −x, different bending stiffnesses, an inclined rope, and a payload away from the target.
pub const ODD: &str = include_str!("odd.toml");

/// Tree of joints with nested branches, one on the base, beams, a rope, and a target inside the
/// arm.
pub const TREE: &str = include_str!("tree.toml");

/// Returns a path below the package folder.
pub fn path(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// Returns a path in `tests/golden`.
pub fn golden(name: &str) -> PathBuf {
    path("tests/golden").join(name)
}

/// Reads the problem of the lunar sampler.
pub fn golden_problem() -> Problem {
    Problem::read(&golden("problem.toml")).unwrap()
}

/// Parses a problem from its text.
pub fn parse(text: &str) -> Problem {
    Problem::parse(text, Path::new("problem.toml")).unwrap()
}

/// Reads the problem in `file` with the section `[parameters]` replaced by `rules`.
pub fn with_parameters(file: &str, rules: &str) -> Problem {
    let text = fs::read_to_string(path(file)).unwrap();
    let (before, after) = text.split_once("[parameters]\n").unwrap();
    let (_, after) = after.split_once("\n[data]\n").unwrap();
    let mut problem = parse(&format!("{before}[parameters]\n{rules}\n[data]\n{after}"));
    problem.data.files =
        problem.data.files.iter().map(|data| path(file).with_file_name(data)).collect();
    problem
}

/// Reads measurements from `files` below the package folder.
pub fn measured(problem: &Problem, files: &[&str]) -> Measurements {
    let files: Vec<PathBuf> = files.iter().map(|file| path(file)).collect();
    Measurements::read(&files, problem).unwrap().0
}

/// Reads the lunar sampler of `tests/cases` and the measurements of one case.
pub fn lunar_case(file: &str) -> (Problem, Dataset) {
    let problem = Problem::read(&path("tests/cases")).unwrap();
    let rows = measured(&problem, &[&format!("tests/cases/{file}")]);
    let data = Dataset::from_measurements(&problem, rows).unwrap();
    (problem, data)
}

/// Replaces the nominal geometry by that of table 2.
pub fn table_2(mut arm: Arm<f64>) -> Arm<f64> {
    for (joint, [alpha, a, theta, d, beta]) in arm.joints.iter_mut().zip(TABLE_2) {
        joint.alpha = Angle::new(alpha.to_radians());
        (joint.a, joint.theta, joint.d) = (a, theta.to_radians(), d);
        joint.beta = Angle::new(beta.to_radians());
    }
    arm
}

/// Returns table 2 as deviations of free parameters; zero for parameters outside the table.
pub fn table_2_deviations(parameters: &[Parameter]) -> DVector<f64> {
    let of = |parameter: &Parameter| {
        let ParameterSite::Joint { joint, field } = parameter.site else { return 0.0 };
        let [alpha, a, theta, d, beta] = TABLE_2[joint];
        let value = match field {
            JointField::Alpha => alpha.to_radians(),
            JointField::A => a,
            JointField::Theta => theta.to_radians(),
            JointField::D => d,
            JointField::Beta => beta.to_radians(),
            _ => return 0.0,
        };
        value - parameter.nominal
    };
    DVector::from_iterator(parameters.len(), parameters.iter().map(of))
}

/// Makes all joints and links rigid.
pub fn without_elasticity(mut problem: Problem) -> Problem {
    for joint in &mut problem.joints {
        (joint.stiffness, joint.beam) = (None, None);
    }
    problem
}
