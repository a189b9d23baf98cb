//! Export of identified geometry into the origins of a URDF. All other bytes are unchanged.

use super::branch::Branch;
use super::chain::Chain;
use super::mounted::{MountedLink, mount};
use super::patches::{MovedOrigin, Patches};
use crate::error::{InputError, UrdfErrorKind};
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};

/// URDF with identified origins.
#[derive(Debug, Clone)]
pub struct Export {
    /// Text of the whole file.
    pub text: String,
    /// Origins that were changed, from base to tip.
    #[doc(hidden)]
    pub moved: Vec<MovedOrigin>,
    /// Links of cameras and markers that were not changed, because the file has them on another
    /// parent.
    #[doc(hidden)]
    pub elsewhere: Vec<String>,
}

/// Writes the geometry of `arm` into the URDF of `chain`, from which `problem` was made.
///
/// The tip then has the pose of the rigid arm in every configuration. Parameters of one joint may
/// change the origin of the next. Inertial data and everything outside the chain stay unchanged.
///
/// # Errors
/// Returns an error if problem and chain describe different arms, or if no origin after the last
/// joint can hold its parameters.
pub fn export(chain: &Chain, problem: &Problem, arm: &Arm<f64>) -> Result<Export, InputError> {
    export_with_links(chain, problem, arm, &[])
}

/// Writes the geometry of `arm` as [`export`] does, and the `mounted` cameras and markers as links
/// with a fixed joint. Links that the file has are moved; others are added at the end of the file.
///
/// Of a tree, each branch is written up to its last axis, and the branch of `chain` up to its tip.
/// What a problem declares behind the last axis of another branch moves the links mounted there.
///
/// # Errors
/// Returns the errors of [`export`].
pub fn export_with_links(
    chain: &Chain,
    problem: &Problem,
    arm: &Arm<f64>,
    mounted: &[MountedLink],
) -> Result<Export, InputError> {
    let nominal = Arm::nominal(problem);
    let paths = paths(problem);
    let moving = |path: &[usize]| -> Vec<String> {
        let joints = path.iter().filter_map(|&joint| problem.joints.get(joint));
        let moving = joints.filter(|joint| joint.kind != JointKind::Fixed);
        moving.map(|joint| joint.name.clone()).collect()
    };
    let names = chain.joint_names();
    let with_tool = |path: &&Vec<usize>| path.contains(&problem.tool.joint);
    let is_main = |path: &&Vec<usize>| moving(path) == names;
    let main = paths.iter().filter(with_tool).find(is_main).or_else(|| paths.iter().find(is_main));
    let Some(main) = main else {
        let declared = paths.iter().find(with_tool).or(paths.first());
        let expected = declared.map(|path| moving(path)).unwrap_or_default();
        return Err(other_joints(chain, names, expected));
    };
    let mut patches = Patches::new(chain.robot);
    let mut branches = Vec::new();
    let main = Branch::new(chain, main, &nominal)?;
    main.write(&mut patches, arm);
    main.write_end(&mut patches, (&nominal, arm))?;
    let others = paths.iter().filter(|path| **path != main.path && !moving(path).is_empty());
    for path in others.clone() {
        branches.push((path, chain.branch(&moving(path))?));
    }
    let mut written = vec![main];
    for (path, chain) in &branches {
        let branch = Branch::new(chain, path, &nominal)?;
        branch.write(&mut patches, arm);
        written.push(branch);
    }
    let elsewhere = mount(&mut patches, &written, arm, mounted);
    let (text, moved) = patches.finish();
    Ok(Export { text, moved, elsewhere })
}

/// Returns the joints from the base to each joint without a child, in the order of the problem.
fn paths(problem: &Problem) -> Vec<Vec<usize>> {
    let parent = |joint: &usize| problem.joints.get(*joint).and_then(|joint| joint.parent);
    let is_leaf = |joint: &usize| !problem.joints.iter().any(|other| other.parent == Some(*joint));
    let path = |leaf: usize| {
        let mut path: Vec<usize> = std::iter::successors(Some(leaf), parent).collect();
        path.reverse();
        path
    };
    (0..problem.joints.len()).filter(is_leaf).map(path).collect()
}

fn other_joints(chain: &Chain, found: Vec<String>, expected: Vec<String>) -> InputError {
    let (base, tip) = chain.ends();
    let (base, tip) = (base.to_owned(), tip.to_owned());
    chain.robot.error(UrdfErrorKind::OtherJoints { base, tip, found, expected })
}
