//! The arms of the tests.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use flexcal::measurement::Measurements;
use flexcal::mechanics::{Angle, Arm};
use flexcal::model::parameter::{JointField, Parameter, ParameterSite};
use flexcal::problem::Problem;
use nalgebra::DVector;

/// Table 2 of [Chen2021]: identified α°, a m, θ°, d m, β° of each joint.
pub const TABLE_2: [[f64; 5]; 4] = [
    [0.019, 0.0, -0.008, 0.097, 0.304],
    [89.996, -0.002, 0.304, -0.084, 0.007],
    [-0.001, 1.974, 0.189, -0.095, 0.0],
    [-0.019, 1.766, -0.790, -0.092, 0.005],
];

/// An arm with everything that the lunar sampler lacks: a fixed and a prismatic joint, a link along
/// −x, bending stiffnesses that differ, a rope that leans, a payload away from the target.
pub const ODD: &str = include_str!("odd.toml");

/// A tree of joints: branches of branches, one on the base, beams, a rope, a target in the midst of
/// the arm.
pub const TREE: &str = include_str!("tree.toml");

/// A path below the package's folder.
pub fn path(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// A file of `tests/golden`.
pub fn golden(name: &str) -> PathBuf {
    path("tests/golden").join(name)
}

/// The lunar sampler.
pub fn golden_problem() -> Problem {
    Problem::read(&golden("problem.toml")).unwrap()
}

/// A problem from its text.
pub fn parse(text: &str) -> Problem {
    Problem::parse(text, Path::new("problem.toml")).unwrap()
}

/// The problem in `file` with the section `[parameters]` replaced by these lines.
pub fn with_parameters(file: &str, rules: &str) -> Problem {
    let text = fs::read_to_string(path(file)).unwrap();
    let (before, after) = text.split_once("[parameters]\n").unwrap();
    let (_, after) = after.split_once("\n[data]\n").unwrap();
    let mut problem = parse(&format!("{before}[parameters]\n{rules}\n[data]\n{after}"));
    problem.data.files =
        problem.data.files.iter().map(|data| path(file).with_file_name(data)).collect();
    problem
}

/// Measurements in `files` below the package's folder.
pub fn measured(problem: &Problem, files: &[&str]) -> Measurements {
    let files: Vec<PathBuf> = files.iter().map(|file| path(file)).collect();
    Measurements::read(&files, problem).unwrap().0
}

/// Table 2 in place of the nominal geometry.
pub fn table_2(mut arm: Arm<f64>) -> Arm<f64> {
    for (joint, [alpha, a, theta, d, beta]) in arm.joints.iter_mut().zip(TABLE_2) {
        joint.alpha = Angle::new(alpha.to_radians());
        (joint.a, joint.theta, joint.d) = (a, theta.to_radians(), d);
        joint.beta = Angle::new(beta.to_radians());
    }
    arm
}

/// Table 2 as deviations of free parameters; zero for what it does not hold.
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

/// Nothing in the arm bends.
pub fn without_elasticity(mut problem: Problem) -> Problem {
    for joint in &mut problem.joints {
        (joint.stiffness, joint.beam) = (None, None);
    }
    problem
}
