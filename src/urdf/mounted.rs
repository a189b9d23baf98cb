//! Cameras and markers that are mounted on the arm, as links of a URDF.

use super::branch::Branch;
use super::patches::Patches;
use super::read::{Kind, Robot};
use crate::mechanics::Arm;
use crate::model::Model;
use crate::problem::{JointKind, Problem};
use crate::spatial::Frame;

/// Camera or marker that is mounted on a frame of the arm, as a link of a URDF.
#[derive(Debug, Clone, PartialEq)]
pub struct MountedLink {
    /// Name of the link: that of the camera or marker with the suffix `_optical_frame` or
    /// `_marker`.
    pub link: String,
    /// Index of the frame that the camera or marker moves with: 0 is the base, i the frame of joint
    /// i.
    pub carrier: usize,
    /// Pose of the camera or marker in the frame `carrier`.
    pub pose: Frame<f64>,
}

/// Returns the cameras and markers that are mounted on the arm. Their poses follow from the full
/// parameter vector `x` of the model.
pub fn mounted_links(problem: &Problem, model: &Model, x: &[f64]) -> Vec<MountedLink> {
    let fixtures = problem.fixtures.iter().zip(model.fixtures(x));
    fixtures
        .filter_map(|(fixture, values)| {
            let carrier = fixture.carrier.filter(|_| fixture.kind.has_pose())?;
            let is_camera = fixture.kind.word() == "camera";
            let suffix = if is_camera { "_optical_frame" } else { "_marker" };
            let name = fixture.name.strip_suffix(suffix).unwrap_or(&fixture.name);
            Some(MountedLink { link: format!("{name}{suffix}"), carrier, pose: values.frame() })
        })
        .collect()
}

/// Returns the target that was measured, such as a camera whose poses another program gave, as a link
/// of a URDF. Its pose follows from the full parameter vector `x` of the model.
pub fn mounted_target(problem: &Problem, model: &Model, x: &[f64], link: &str) -> MountedLink {
    let position = model.target_positions(x).first().copied().unwrap_or(problem.tool.target);
    let turn = model.target_rotations(x).first().copied().unwrap_or(problem.tool.rotation);
    let pose = Frame::from_rotation_vector(position, &turn);
    MountedLink { link: link.to_owned(), carrier: model.target_joint(0) + 1, pose }
}

/// Adds a link with a fixed joint for each of the `mounted`. If the file has the link on the same
/// parent, or behind further fixed joints, the origin of its joint is changed instead. Returns the names of the links that the file
/// has elsewhere, which stay as they are. The first of the branches ends at the tip.
pub(super) fn mount(
    patches: &mut Patches,
    branches: &[Branch],
    arm: &Arm<f64>,
    mounted: &[MountedLink],
) -> Vec<String> {
    let (robot, mut elsewhere) = (patches.robot, Vec::new());
    for MountedLink { link, carrier, pose } in mounted {
        let Some((parent, carried)) = carrying_link(branches, arm, *carrier) else { continue };
        let origin = carried.compose(pose);
        // The link of a camera may have its name itself, as "head_camera_optical".
        let bare = link.strip_suffix("_optical_frame").filter(|name| name.contains("optical"));
        let position = |name: &str| robot.links.iter().position(|known| known.name == name);
        let Some(index) = bare.and_then(position).or_else(|| position(link)) else {
            let name = robot.links.get(parent).map_or("", |link| link.name.as_str());
            patches.append_link(link, name, &origin);
            continue;
        };
        let is_in_chain =
            |joint: &usize| branches.iter().any(|branch| branch.chain.joints.contains(joint));
        let path = fixed_joints(robot, parent, index).unwrap_or_default();
        match path.split_last().filter(|_| !path.iter().any(is_in_chain)) {
            Some((&last, before)) => {
                let before = patches.through(before);
                patches.set_origin(last, &before.inverse().compose(&origin));
            }
            None => elsewhere.push(link.clone()),
        }
    }
    elsewhere
}

/// Returns the indices of the fixed joints that lead from one link down to another; `None` if a
/// joint between them moves, or if the second is not below the first.
fn fixed_joints(robot: &Robot, from: usize, to: usize) -> Option<Vec<usize>> {
    let (mut path, mut at) = (Vec::new(), to);
    while at != from && path.len() < robot.joints.len() {
        let above = robot.joints.iter().position(|joint| joint.child == at)?;
        let joint = robot.joints.get(above).filter(|joint| joint.kind == Kind::Fixed)?;
        path.push(above);
        at = joint.parent;
    }
    path.reverse();
    (at == from).then_some(path)
}

/// Returns the index of the link that moves with frame `carrier` of the problem, and that frame in
/// the frame of the link. It is the tip for the last joint of the first branch, otherwise the link
/// behind the moving joint at or before the carrier.
fn carrying_link(
    branches: &[Branch],
    arm: &Arm<f64>,
    carrier: usize,
) -> Option<(usize, Frame<f64>)> {
    let last = carrier.checked_sub(1);
    let is_on = |branch: &&Branch| last.is_none_or(|last| branch.path.contains(&last));
    let Branch { chain, path, gauges } = branches.iter().find(is_on)?;
    let is_first = branches.first().is_some_and(|first| first.path == *path);
    if is_first && last.is_some() && path.last().copied() == last {
        return Some((chain.tip, Frame::identity()));
    }
    let (mut parent, mut frame, mut moving) = (chain.base, Frame::identity(), 0);
    for &index in path.iter().take_while(|&&index| last.is_some_and(|last| index <= last)) {
        let Some(joint) = arm.joints.get(index) else { continue };
        joint.advance_to_zero(&mut frame);
        if joint.kind != JointKind::Fixed {
            moving += 1;
            if let (Some(stage), Some(gauge)) = (chain.stages.get(moving - 1), gauges.get(moving)) {
                parent = chain.robot.joints.get(stage.joint).map_or(parent, |joint| joint.child);
                frame = stage.axis.compose(gauge);
            }
        }
        frame.rotate_y(joint.beta.sin_cos);
    }
    Some((parent, frame))
}
