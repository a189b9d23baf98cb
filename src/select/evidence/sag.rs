//! Sag under a weight that the problem does not declare.
//!
//! A body of mass m with its centre at s in the frame of link k exerts about the axis z of joint j
//! ≤ k the moment
//!
//! M = z · ((o_k + R_k s − o_j) × m g),
//!
//! linear in (m, m s). A compliance c at the joint displaces the arm by c M. For each link outboard
//! of the joint this is a combination of four known functions of the configuration, for any masses.
//! Sag is therefore neither a law of the catalogue, which needs masses, nor a free function.

use nalgebra::{DMatrix, DVector, Vector3};

use super::columns::Columns;
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use crate::mechanics::Arm;
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::{JointKind, Problem};
use crate::residual_tests::Covariate;

/// Smallest singular value of the moment functions, relative to the largest one, at which a
/// combination of them is kept.
const MIN_NEW_SIZE: f64 = 1e-3;

/// Returns true if gravity acts on an arm without declared masses.
fn is_weight_unknown(problem: &Problem) -> bool {
    let has_mass =
        problem.joints.iter().any(|joint| !joint.bodies.is_empty() || joint.beam.is_some());
    problem.gravity.norm() > 0.0 && !has_mass
}

impl Columns<'_, '_> {
    /// Adds the hypotheses that single revolute joints, or all of them, sag under a weight that is
    /// not declared.
    pub(super) fn add_sag(&mut self) {
        if !is_weight_unknown(self.problem) {
            return;
        }
        let mut columns_of_joints: Vec<DMatrix<f64>> = Vec::new();
        for joint in (0..self.problem.joints.len())
            .filter(|&j| self.problem.joints[j].kind == JointKind::Revolute)
        {
            let site = ParameterSite::Joint { joint, field: JointField::Theta };
            let Some(lever) = self.linearised.column_at(site) else { continue };
            let Some(columns) = self.sag_columns(joint, &lever) else { continue };
            let site = Site::Joint(joint);
            let hypothesis =
                Hypothesis::new(HypothesisKind::Sag, site, None, vec![Covariate::Load]);
            self.add("sag", 1.0, hypothesis, || columns.clone());
            columns_of_joints.push(columns);
        }
        if columns_of_joints.len() > 1 {
            let hypothesis =
                Hypothesis::new(HypothesisKind::Sag, Site::Arm, None, vec![Covariate::Load]);
            let columns: Vec<_> = columns_of_joints.iter().flat_map(DMatrix::column_iter).collect();
            self.add("sag", columns_of_joints.len() as f64, hypothesis, || {
                DMatrix::from_columns(&columns)
            });
        }
    }

    /// Returns the displacements of the target by a compliance of the joint: the derivative of each
    /// position by the joint angle (`lever`) times each moment function about the joint's axis.
    /// Linearly dependent functions are dropped. Shape = (3 N, functions); `None` if gravity exerts
    /// no moment about the joint.
    fn sag_columns(&self, joint: usize, lever: &DVector<f64>) -> Option<DMatrix<f64>> {
        let moments = moments(
            self.problem,
            joint,
            self.linearised.poses().iter().map(|pose| pose.setup.configuration),
        );
        // The same functions need fewer columns: M = U Σ Vᵀ, and coefficients with equal priors on
        // the columns of M equal such coefficients on those of U Σ.
        let decomposition = moments.rows(0, self.evidence_poses).into_owned().svd(false, true);
        let turned = decomposition.v_t?.transpose();
        let most = decomposition.singular_values.max();
        let kept: Vec<usize> = (0..turned.ncols())
            .filter(|&k| most > 0.0 && decomposition.singular_values[k] > MIN_NEW_SIZE * most)
            .collect();
        let functions = moments * turned.select_columns(&kept);
        let column = |row: usize, k: usize| lever[row] * functions[(row / 3, k)];
        (!kept.is_empty()).then(|| DMatrix::from_fn(lever.len(), kept.len(), column))
    }
}

/// Returns, as columns, moments of weights about the axis of `joint` \[N·m\], shape = (N,
/// functions). For each link that the joint moves there are four: the moment of 1 kg at the link's
/// origin, and its changes if the mass moves along x, y and z by the mean length of the links.
fn moments<'a>(
    problem: &Problem,
    joint: usize,
    configurations: impl Iterator<Item = &'a [f64]>,
) -> DMatrix<f64> {
    let arm = Arm::nominal(problem);
    let lengths = problem.joints.iter().map(|joint| joint.a.abs() + joint.d.abs()).sum::<f64>();
    let length = lengths / problem.joints.len() as f64;
    let of_pose = |configuration: &[f64]| -> Vec<f64> {
        let joints = arm.rigid_joints(configuration);
        let (at, axis, _) = joints[joint];
        let about = |place: Vector3<f64>| axis.dot(&place.cross(&problem.gravity));
        let of_link = |frame: &crate::spatial::Frame<f64>| {
            let along = frame.axes.map(|axis| about(axis * length));
            std::iter::once(about(frame.origin - at)).chain(along).collect::<Vec<f64>>()
        };
        let outboard = joints.iter().enumerate().filter(|(k, _)| arm.tree.path_contains(joint, *k));
        outboard.flat_map(|(_, (.., frame))| of_link(frame)).collect()
    };
    let rows: Vec<Vec<f64>> = configurations.map(of_pose).collect();
    DMatrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |pose, k| rows[pose][k])
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn moments_are_those_of_weights_at_levers() {
        let text =
            "name = 'arm'\n[[joint]]\nalpha_deg = 90\n[[joint]]\na_m = 0.5\n[[joint]]\na_m = 0.5\n";
        let problem = Problem::parse(text, Path::new("problem.toml")).unwrap();
        assert!(is_weight_unknown(&problem));
        let (first, second) = (0.3_f64, 0.4_f64);
        let configuration = [first, second, 0.0];
        // The axis of joint 2 is horizontal, and the origin of frame 3 is half a metre from it
        // along the link.
        let moments = moments(&problem, 1, std::iter::once(&configuration[..]));
        assert_eq!(moments.shape(), (1, 8));
        let g = problem.gravity.norm();
        assert!(moments[(0, 0)].abs() < 1e-12);
        assert!(
            (moments[(0, 4)].abs() - 0.5 * g * (first + second).cos()).abs() < 1e-9,
            "{moments}"
        );
        let heavy = format!("{text}[[joint.body]]\nmass_kg = 1\n");
        assert!(!is_weight_unknown(&Problem::parse(&heavy, Path::new("problem.toml")).unwrap()));
    }
}
