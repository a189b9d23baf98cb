//! Parameter sites at which the hypotheses need derivatives.

use super::hypothesis::Site;
use crate::laws::FOCAL;
use crate::model::effect::Term;
use crate::model::parameter::{BeamField, JointField, ParameterSite, Regressor};
use crate::problem::{CENTRE_X, FOCAL_X, Problem};

/// Small motions of the frame behind a joint at which laws are searched, each with its axis and name
/// in files. Motions along and about x are those of the next joint, motions along and about z those
/// of the joint's coordinate and offset.
pub(super) const MOTIONS_BEHIND: [(usize, &str); 2] = [(1, "y"), (4, "ry")];

/// Returns the parameter sites of hypotheses without a law, for which derivatives are needed in
/// addition to those of the effects.
pub(super) fn hypothesis_sites(problem: &Problem) -> Vec<ParameterSite> {
    let mut sites: Vec<ParameterSite> = geometry_sites(problem).collect();
    sites.extend(
        (0..3).flat_map(|axis| [ParameterSite::Shift { axis }, ParameterSite::Turn { axis }]),
    );
    sites.extend((0..3).map(|axis| tool_site(problem, axis)));
    sites.extend(camera_sites(problem).map(|(_, site)| site));
    for joint in 0..problem.joints.len() {
        let behind = MOTIONS_BEHIND
            .map(|(axis, _)| ParameterSite::Joint { joint, field: JointField::After(axis) });
        sites.extend(behind.into_iter().filter(|_| problem.joints[joint].takes_command()));
        sites.extend(
            [JointField::Compliance, JointField::LateralX]
                .map(|field| ParameterSite::Joint { joint, field }),
        );
        if problem.joints[joint].beam.is_some() && problem.data.reference_temperature.is_some() {
            sites.extend(BeamField::STRAINS.map(|field| ParameterSite::Beam { joint, field }));
        }
    }
    sites
}

/// Returns the site of a displacement of the tool along an axis, 0 to 2, in the frame of the joint
/// that carries it.
pub(super) fn tool_site(problem: &Problem, axis: usize) -> ParameterSite {
    ParameterSite::Joint { joint: tool_joint(problem), field: JointField::After(axis) }
}

/// Returns the joint, from 0, that carries the tool.
pub(super) fn tool_joint(problem: &Problem) -> usize {
    problem.tool.joint.min(problem.joints.len().saturating_sub(1))
}

/// Returns the sites of changes of the focal lengths and centres of all cameras, with their names in
/// files.
pub(super) fn camera_sites(
    problem: &Problem,
) -> impl Iterator<Item = (String, ParameterSite)> + '_ {
    let cameras = problem.fixtures.iter().enumerate();
    cameras.filter(|(_, of)| of.kind.word() == "camera").flat_map(|(fixture, of)| {
        [(FOCAL, FOCAL_X, 2), ("cx", CENTRE_X, 1), ("cy", CENTRE_X + 1, 1)].map(
            |(field, axis, count)| {
                let site = ParameterSite::FixtureShift { fixture, kind: of.kind, axis, count };
                (format!("camera[{}].{field}", of.name), site)
            },
        )
    })
}

/// Returns the sites of the geometric parameters of every joint.
pub(super) fn geometry_sites(problem: &Problem) -> impl Iterator<Item = ParameterSite> + '_ {
    (0..problem.joints.len()).flat_map(|joint| {
        JointField::GEOMETRY.into_iter().map(move |field| ParameterSite::Joint { joint, field })
    })
}

/// Returns true if each parameter of an effect acts about another axis of the arm, so that one of
/// them may act alone. This holds for two compliances, but not for a shift of the measurement or a
/// harmonic.
pub(super) fn acts_along_axes(terms: &[Term]) -> bool {
    let is_axis = |term: &Term| {
        term.regressor == Regressor::Constant
            && term.nominal == 0.0
            && Site::of(term.site) != Site::Measurement
    };
    let distinct =
        |(k, term): (usize, &Term)| terms[..k].iter().all(|other| other.site != term.site);
    terms.len() > 1 && terms.iter().all(is_axis) && terms.iter().enumerate().all(distinct)
}
