//! Jacobian of predicted positions with respect to the joint commands.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::command_term::TermSite;
use super::{Model, Pose, PoseResiduals};
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares as _};
use crate::mechanics::MOTION_LEN;
use crate::model::parameter::{BeamField, JointField, ParameterSite, Regressor};
use crate::problem::Problem;

impl Model {
    /// Returns ∂p/∂q of the predicted positions at the full parameter vector `x`, shape = (3,
    /// joints) for each pose, measuring frame \[m/rad\], for prismatic joints \[m/m\]. Columns of
    /// joints without a command (fixed and mimic joints) are 0; all are NaN without equilibrium.
    ///
    /// A command moves its joint, and every coordinate, strain, small motion, base and reading with
    /// a term that depends on it. With Δθ the terms at the joint and s these other quantities,
    /// ∂p/∂q = ∂p/∂θ (1 + ∂Δθ/∂q) + Σ ∂p/∂s ∂s/∂q. Directions of
    /// approach are kept constant.
    pub(crate) fn command_jacobian(
        &self,
        problem: &Problem,
        poses: Vec<Pose>,
        x: &DVector<f64>,
    ) -> Vec<DMatrix<f64>> {
        let arm = self.with_free_commands(problem, x);
        let joints = arm.joints();
        let commanded = arm.moving_joints().len();
        let arm = arm.with_mimic_joints(problem);
        let moving = arm.moving_joints();
        // Terms that depend on commands also add to sites that are not joint coordinates.
        let other_terms = arm.non_joint_terms_that_follow_commands();
        let probes: Vec<(ParameterSite, f64)> =
            other_terms.iter().map(|term| (term.site, 0.0)).collect();
        let arm = arm.with_probes(&probes);
        let columns = moving.len() + probes.len();
        // Of a row with an orientation, too, only the position is differentiated.
        let position = |pose| Pose { sigma: 1.0, orientation: None, ..pose };
        let poses: Vec<Pose> = poses.into_iter().map(position).collect();
        let count = poses.len();
        let unknowns: Vec<usize> = (0..columns).collect();
        let residuals = PoseResiduals::new(&arm, poses, unknowns, DVector::zeros(columns));
        let chunk = |first: usize| {
            let items = first..count.min(first + CHUNK_ITEMS);
            let mut block = Block::zeros(3 * items.len(), columns);
            residuals.linearise(&DVector::zeros(columns), items.clone(), &mut block);
            let of_pose = |(k, pose): (usize, &Pose)| {
                let rows = 3 * k..3 * k + 3;
                let mut by_coordinate = DMatrix::zeros(3, joints);
                for (column, &joint) in moving.iter().enumerate() {
                    // The block contains derivatives of measured − predicted.
                    by_coordinate
                        .column_mut(joint)
                        .copy_from_slice(&block.column(column)[rows.clone()]);
                    by_coordinate.column_mut(joint).neg_mut();
                }
                // Without equilibrium, the residual is NaN and no derivatives are written.
                if block.column(columns)[rows.clone()].iter().any(|value| value.is_nan()) {
                    return DMatrix::from_element(3, joints, f64::NAN);
                }
                let mut jacobian = by_coordinate.clone();
                for term in &arm.fixed_terms {
                    let TermSite::Joint(joint_of_term) = term.site else { continue };
                    for &joint in &moving {
                        let slope = term.value * term.regressor.slope(&pose.setup, joint);
                        jacobian.column_mut(joint).axpy(
                            slope,
                            &by_coordinate.column(joint_of_term),
                            1.0,
                        );
                    }
                }
                for (term, column) in other_terms.iter().zip(moving.len()..) {
                    let by_site = &block.column(column)[rows.clone()];
                    for &joint in &moving {
                        let slope = term.size * term.regressor.slope(&pose.setup, joint);
                        // The block contains derivatives of measured − predicted.
                        for (entry, by_site) in jacobian.column_mut(joint).iter_mut().zip(by_site) {
                            *entry -= slope * by_site;
                        }
                    }
                }
                // Mimic joints take no command.
                moving
                    .iter()
                    .skip(commanded)
                    .for_each(|&joint| jacobian.column_mut(joint).fill(0.0));
                jacobian
            };
            residuals.poses()[items].iter().enumerate().map(of_pose).collect::<Vec<_>>()
        };
        (0..count).into_par_iter().step_by(CHUNK_ITEMS).flat_map_iter(chunk).collect()
    }
}

/// Term size × regressor that adds to a strain, a small motion, a base or a reading, not to a
/// joint's coordinate.
struct NonJointTerm {
    site: ParameterSite,
    regressor: Regressor,
    size: f64,
}

impl Model {
    /// Returns the terms of strains, small motions, bases and readings that depend on commands.
    fn non_joint_terms_that_follow_commands(&self) -> Vec<NonJointTerm> {
        let of_arm = self.fixed_terms.iter().filter_map(|term| {
            let site = match term.site {
                TermSite::Joint(_) => return None,
                TermSite::Strain { joint, which } => {
                    ParameterSite::Beam { joint, field: BeamField::STRAINS[which] }
                }
                TermSite::Motion { joint, which } => {
                    let field = which.checked_sub(MOTION_LEN);
                    let field = field.map_or(JointField::Before(which), JointField::After);
                    ParameterSite::Joint { joint, field }
                }
            };
            Some(NonJointTerm { site, regressor: term.regressor.clone(), size: term.value })
        });
        let [shifts, turns] = self.instrument.terms();
        let of_shift = |&(axis, ref regressor, size): &(usize, Regressor, f64)| NonJointTerm {
            site: ParameterSite::Shift { axis },
            regressor: regressor.clone(),
            size,
        };
        let of_turn = |&(axis, ref regressor, size): &(usize, Regressor, f64)| NonJointTerm {
            site: ParameterSite::Turn { axis },
            regressor: regressor.clone(),
            size,
        };
        let terms = of_arm.chain(shifts.iter().map(of_shift)).chain(turns.iter().map(of_turn));
        terms.filter(|term| term.regressor.follows_commands()).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::model::MeasuredOrientation;
    use crate::observation::Observation;
    use crate::problem::PoseView;

    /// Step of the central differences \[rad\].
    const STEP: f64 = 1e-4;

    #[test]
    fn laws_at_every_site_that_follow_commands() {
        let sites = [
            "joint2",
            "joint2.x",
            "joint3.ry",
            "joint2.after.rz",
            "joint1.after.y",
            "tool.rx",
            "tool.z",
            "base.x",
            "base.rz",
            "measurement.y",
            "measurement.range",
            "link.curvature_y",
            "link.curvature_z",
            "link.strain",
        ];
        let laws: Vec<String> = sites
            .iter()
            .enumerate()
            .map(|(k, site)| {
                let law = "[[effect]]\nlaw = { name = 'w";
                format!("{law}{k}', at = '{site}', terms = ['sin(2*q1 + {k}) + q2*q3'] }}\n")
            })
            .collect();
        for stiffness in ["", "stiffness_N_m_per_rad = 2e4\n"] {
            let text = format!(
                "name = 'arm'\n[[joint]]\n{stiffness}[[joint]]\nalpha_deg = 90\n[[joint]]\na_m = 0.8\n\
                 [joint.beam]\nname = 'link'\nmass_kg = 5\nEIy_N_m2 = 3e4\nEIz_N_m2 = 1.2e4\n\
                 [tool]\ntarget_m = [0.3, 0.1, 0.2]\n[base]\nxyz_m = [1.0, 2.0, 0.5]\n{}",
                laws.concat()
            );
            let problem = Problem::parse(&text, "problem.toml".as_ref()).unwrap();
            let model = Model::new(&problem, &[String::new()], &[String::new()]).unwrap();
            let size = |name: &str| if name.starts_with("law") { 3e-3 } else { 0.0 };
            let x = model.parameters.iter().map(|parameter| size(&parameter.name));
            let x = DVector::from_iterator(model.parameters.len(), x);
            let nowhere = Vector3::zeros();
            let pose = |configuration: &[f64]| -> Vector3<f64> {
                let pose = at(configuration, &nowhere);
                model.predict(vec![pose], &x)[0]
            };
            let configuration = [0.4, -0.7, 1.1];
            let exact = model.command_jacobian(&problem, vec![at(&configuration, &nowhere)], &x);
            for joint in 0..3 {
                let moved = |step: f64| {
                    let mut moved = configuration;
                    moved[joint] += step;
                    pose(&moved)
                };
                let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                let off = (slope - exact[0].column(joint)).norm();
                assert!(off < 1e-7, "joint {joint}: {off}");
            }
        }
    }

    #[test]
    fn orientations_change_no_position() {
        let text = "name = 'arm'\n[[joint]]\n[[joint]]\nalpha_deg = 90\n[tool]\ntarget_m = [0.3, 0.1, 0.2]\n";
        let problem = Problem::parse(text, "problem.toml".as_ref()).unwrap();
        let model = Model::new(&problem, &[String::new()], &[String::new()]).unwrap();
        let x = DVector::zeros(model.parameters.len());
        let nowhere = Vector3::zeros();
        let orientation = Some(MeasuredOrientation { measured: None, sigma: 0.1 });
        let configurations = [[0.4, -0.7], [0.1, 0.2], [1.4, 0.3]];
        let jacobians = |orientation| {
            let pose = |q| Pose { orientation, ..at(q, &nowhere) };
            let poses = configurations.iter().map(|q| pose(q.as_slice())).collect();
            model.command_jacobian(&problem, poses, &x)
        };
        assert_eq!(jacobians(orientation), jacobians(None));
    }

    fn at<'a>(configuration: &'a [f64], measured: &'a Vector3<f64>) -> Pose<'a> {
        Pose {
            setup: PoseView::from_configuration(configuration),
            base: 0,
            target: 0,
            observation: Observation::Position,
            measured,
            sigma: 1.0,
            orientation: None,
        }
    }
}
