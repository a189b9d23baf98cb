//! Import and export of URDF, and other forms of joints in a problem.

#![expect(
    clippy::unwrap_used,
    clippy::unreadable_literal,
    reason = "a test that fails may panic; numbers stand as they were computed"
)]

mod bad;
#[path = "../common/mod.rs"]
mod common;
mod export;
mod forms;
mod init;
mod public;
mod tree;

use crate::common::arms::parse;
use common::made::model_of;
use common::reading::read_dataset;
use flexcal::fit::{Options, Placement, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::rig::{Truth, simulate};
use flexcal::urdf::{Chain, Robot, describe};
use nalgebra::{DVector, Vector3};

/// Reads a URDF of `tests/urdf`.
pub(crate) fn robot(name: &str) -> Robot {
    Robot::read(&common::arms::path("tests/urdf").join(name)).unwrap()
}

/// Returns the problem of a chain.
pub(crate) fn problem_of(chain: &Chain) -> Problem {
    parse(&describe(chain).unwrap().text)
}

/// Returns origin, x and z axis of the last frame for given configurations, with the parameters at
/// `x`.
pub(crate) fn tips(
    problem: &Problem,
    configurations: &[Vec<f64>],
    x: &DVector<f64>,
) -> Vec<[Vector3<f64>; 3]> {
    let rows = Dataset::poses(configurations).measurements().unwrap();
    let all: Vec<usize> = (0..rows.len()).collect();
    let at = |target: Vector3<f64>| {
        let mut moved = problem.clone();
        moved.tool.target = target;
        model_of(&moved, &rows).predict(Placement::of(&rows).poses(&rows, &all, 1.0), x)
    };
    let [origin, x, z] = [Vector3::zeros(), Vector3::x(), Vector3::z()].map(at);
    (0..rows.len()).map(|k| [origin[k], x[k] - origin[k], z[k] - origin[k]]).collect()
}

/// Returns the largest difference of frames.
pub(crate) fn apart(one: &[[Vector3<f64>; 3]], other: &[[Vector3<f64>; 3]]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter()
        .flatten()
        .zip(other.iter().flatten())
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

/// Every arm of `problems` with a truth is simulated and identified.
#[test]
fn the_gallery_runs() {
    for arm in ["panda", "ur10-urdf", "scara", "gantry"] {
        let problem = Problem::read(&common::arms::path("problems").join(arm)).unwrap();
        let truth = Truth::read(&common::arms::path("problems").join(arm), &problem).unwrap();
        let data = read_dataset(&problem, &simulate(&problem, &truth, 80, 1).unwrap().csv());
        let fit = identify(&problem, &data, &Options::default()).unwrap();
        assert!(fit.is_trusted(), "{arm}");
        assert!(fit.fitted.held_out.mean.norm < 0.6 * fit.registered.held_out.mean.norm, "{arm}");
        let all = fit.estimates.iter().filter(|estimate| estimate.std_error.is_none()).count();
        assert_eq!(all, 0, "{arm}: what is free is told apart");
    }
}
