//! Chain of joints between two links of a URDF.

use nalgebra::Vector3;

use super::read::{Joint, Kind, Robot};
use crate::error::{InputError, UrdfErrorKind};
use crate::problem::Problem;
use crate::spatial::Frame;

/// Maximum number of joints in a chain: the maximum of a problem minus a fixed joint at each end.
const MAX_JOINTS: usize = 98;
/// Minimum number of moving joints from the base to a leaf at which the leaf is chosen as the tip
/// although there are others.
const MIN_PLAIN_JOINTS: usize = 4;

/// Joints of a robot from one link to another.
pub struct Chain<'a> {
    pub(super) robot: &'a Robot,
    /// Index of the first link.
    pub(super) base: usize,
    /// Index of the last link.
    pub(super) tip: usize,
    /// Indices of the joints from base to tip.
    pub(super) joints: Vec<usize>,
    /// Moving joints of the chain.
    pub(super) stages: Vec<Stage>,
    /// Frame of the tip in the last axis frame.
    pub(super) end: Frame<f64>,
    /// Descriptions of the other leaves, with their numbers of moving joints, if the tip was chosen
    /// among several; otherwise empty.
    pub(super) other_leaves: Vec<String>,
    /// Name of the camera whose link was given as the tip; `None` for other chains.
    pub(super) camera: Option<String>,
}

impl Chain<'_> {
    /// Returns the chain up to the link that carries the camera, if the tip is a link of a camera behind
    /// fixed joints: its pose is to be found. The camera has the name of that link.
    ///
    /// # Errors
    /// Returns the errors of [`Chain::new`].
    pub(crate) fn up_to_carrier_of_camera(self) -> Result<Self, InputError> {
        let name = |link: usize| self.robot.link_name(link);
        let is_camera = |link: usize| {
            let lower = name(link).to_lowercase();
            lower.contains("camera") || lower.contains("optical")
        };
        let mut carrier = self.tip;
        for joint in self.joints.iter().rev().filter_map(|&joint| self.robot.joints.get(joint)) {
            if joint.kind != Kind::Fixed || !is_camera(carrier) {
                break;
            }
            carrier = joint.parent;
        }
        if carrier == self.tip {
            return Ok(self);
        }
        let camera = name(self.tip);
        let camera = camera.strip_suffix("_optical_frame").unwrap_or(&camera).to_owned();
        let chain = Self::new(self.robot, Some(&name(self.base)), Some(&name(carrier)))?;
        Ok(Self { camera: Some(camera), ..chain })
    }
}

/// Orders chains to further tips so that each joint's branches follow it directly: after each chain
/// comes the one that shares most joints with it.
///
/// # Errors
/// Returns an error if two chains have the same tip.
pub(crate) fn in_tree_order<'a>(
    first: &Chain<'a>,
    mut further: Vec<Chain<'a>>,
) -> Result<Vec<Chain<'a>>, InputError> {
    let mut ordered: Vec<Chain<'a>> = Vec::with_capacity(further.len());
    while !further.is_empty() {
        let last = ordered.last().unwrap_or(first);
        let shared = |chain: &Chain| {
            let pairs = chain.stages.iter().zip(&last.stages);
            pairs.take_while(|(one, other)| one.joint == other.joint).count()
        };
        let places = further.iter().enumerate().rev();
        let nearest = places.max_by_key(|(_, chain)| shared(chain)).map_or(0, |(place, _)| place);
        let next = further.remove(nearest);
        if std::iter::once(first).chain(&ordered).any(|other| other.tip == next.tip) {
            let name = next.ends().1.to_owned();
            return Err(first.robot.error(UrdfErrorKind::RepeatedTip { name }));
        }
        ordered.push(next);
    }
    Ok(ordered)
}

/// Moving joint of the chain. Its axis frame is the URDF's frame of the joint before motion,
/// rotated so that z is the axis of the joint.
pub(super) struct Stage {
    /// Index of the joint in the robot.
    pub joint: usize,
    /// Axis frame in the previous axis frame, or in the base for the first stage, including the
    /// offset of a mimic joint.
    pub step: Frame<f64>,
    /// Axis frame in the URDF's frame of the joint.
    pub axis: Frame<f64>,
    /// Index of the stage whose command a mimic joint follows, and the factor; `None` for a joint
    /// with its own command.
    pub mimic: Option<(usize, f64)>,
    /// Offset of a mimic joint \[rad\] or \[m\]; 0 for other joints.
    pub offset: f64,
}

impl<'a> Chain<'a> {
    /// Finds the chain from `base` to `tip`. The default base is the root. The default tip is the
    /// only leaf below the base, or the leaf with at least twice as many moving joints as every
    /// other one.
    ///
    /// # Errors
    /// Returns an error if the links form no tree, several roots or leaves are possible, a joint
    /// type is unsupported, or no joint moves.
    pub fn new(
        robot: &'a Robot,
        base: Option<&str>,
        tip: Option<&str>,
    ) -> Result<Self, InputError> {
        let above = parents(robot)?;
        let base = match base {
            Some(name) => robot.link(name)?,
            None => root(robot, &above)?,
        };
        let (tip, other_leaves) = match tip {
            Some(name) => (robot.link(name)?, Vec::new()),
            None => leaf(robot, &above, base)?,
        };
        let name = |link: usize| robot.link_name(link);
        let (mut joints, mut passed, mut at) = (Vec::new(), Vec::new(), tip);
        while at != base {
            let Some((joint, parent)) = above.get(at).copied().flatten() else {
                let parent = |link: &usize| above.get(*link).copied().flatten().map(|of| of.1);
                let is_exchanged = std::iter::successors(parent(&base), parent).any(|of| of == tip);
                let (base, tip) = (name(base), name(tip));
                return Err(robot.error(if is_exchanged {
                    UrdfErrorKind::EndsExchanged { base, tip }
                } else {
                    UrdfErrorKind::NotBelow { base, tip, above: passed }
                }));
            };
            joints.push(joint);
            passed.push(name(parent));
            at = parent;
        }
        joints.reverse();
        if joints.len() > MAX_JOINTS {
            let (found, most) = (joints.len(), MAX_JOINTS);
            return Err(robot.error(UrdfErrorKind::TooManyJoints { found, most }));
        }
        let (stages, end) = (Vec::new(), Frame::identity());
        let mut chain = Self { robot, base, tip, joints, stages, end, other_leaves, camera: None };
        chain.compute_stages()?;
        if chain.stages.is_empty() {
            let is_inner = |link: usize| robot.joints.iter().any(|joint| joint.parent == link);
            let ends = (0..robot.links.len()).filter(|&link| link != tip && !is_inner(link));
            let ends = ends.map(name).collect();
            let (base, tip) = (name(base), name(tip));
            return Err(robot.error(UrdfErrorKind::NothingMoves {
                base,
                tip,
                ends,
                links: robot.links.len(),
            }));
        }
        Ok(chain)
    }

    /// Finds the chain of a problem that was made from a URDF, between the links that it states.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new), and an error if the URDF has no link with one of
    /// these names.
    pub fn from_problem(robot: &'a Robot, problem: &Problem) -> Result<Self, InputError> {
        let ends = problem.urdf.as_ref();
        let named = ends.into_iter().flat_map(|ends| [&ends.base, &ends.tip]);
        if let Some(link) = named.into_iter().find(|link| robot.link(link).is_err()) {
            let (problem, robot_name) = (problem.name.clone(), robot.name.clone());
            let link = link.clone();
            let kind = UrdfErrorKind::OtherRobot { link, problem, robot: robot_name };
            return Err(robot.error(kind));
        }
        Self::new(robot, ends.map(|ends| ends.base.as_str()), ends.map(|ends| ends.tip.as_str()))
    }

    /// Returns the chain from the same base to the link that the last of some joints moves.
    ///
    /// # Errors
    /// Returns an error if the moving joints of that chain are not `joints`.
    pub(super) fn branch(&self, joints: &[String]) -> Result<Self, InputError> {
        let name = joints.last();
        let last = self.robot.joints.iter().find(|joint| Some(&joint.name) == name);
        let name = |link: usize| self.robot.links.get(link).map(|link| link.name.as_str());
        let tip = last.map_or(self.base, |joint| joint.child);
        let (base, tip) = (name(self.base), name(tip));
        let branch = Self::new(self.robot, base, tip)?;
        let found = branch.joint_names();
        if found == joints {
            return Ok(branch);
        }
        let [base, tip] = [base, tip].map(|name| name.unwrap_or_default().to_owned());
        let expected = joints.to_vec();
        Err(self.robot.error(UrdfErrorKind::OtherJoints { base, tip, found, expected }))
    }

    /// Returns the name of the last moving joint if no fixed joint follows it, so that no origin of
    /// the URDF can hold a transform after it; `None` otherwise.
    #[doc(hidden)]
    pub fn moving_end(&self) -> Option<&str> {
        let last = self.stages.last()?.joint;
        let joint = self.robot.joints.get(last)?;
        (self.joints.last() == Some(&last)).then_some(joint.name.as_str())
    }

    /// Computes the stages and the end frame from the joints of the chain.
    fn compute_stages(&mut self) -> Result<(), InputError> {
        let robot = self.robot;
        let (mut step, mut leaders) = (Frame::identity(), Vec::new());
        for &index in &self.joints {
            let Some(joint) = robot.joints.get(index) else { continue };
            step = step.compose(&joint.origin.frame());
            if let Kind::Other(kind) = &joint.kind {
                return Err(robot.error_at(index, UrdfErrorKind::Kind { kind: kind.clone() }));
            }
            if joint.kind == Kind::Fixed {
                continue;
            }
            if let Some((location, kind)) = &joint.broken_mimic {
                return Err(location.clone().error(kind.clone()));
            }
            let axis = axis_frame(&joint.axis);
            let (leader, offset) = self.leader(index)?;
            leaders.push(leader);
            step = moved(&step.compose(&axis), joint, offset);
            self.stages.push(Stage { joint: index, step, axis, mimic: None, offset });
            // The next step starts in the joint's URDF frame, seen from the axis frame.
            step = axis.inverse();
        }
        self.end = step;
        let stage = |joint: usize| self.stages.iter().position(|stage| stage.joint == joint);
        let mimics: Vec<_> = leaders
            .into_iter()
            .map(|leader| leader.and_then(|(joint, by)| Some((stage(joint)?, by))))
            .collect();
        for (stage, mimic) in self.stages.iter_mut().zip(mimics) {
            stage.mimic = mimic;
        }
        Ok(())
    }

    /// Returns the index of the joint of the chain whose command a joint follows, directly or
    /// through other mimic joints, with factor and offset. `None` if the joint takes a command
    /// itself.
    fn leader(&self, index: usize) -> Result<(Option<(usize, f64)>, f64), InputError> {
        let (mut factor, mut offset, mut at) = (1.0, 0.0, index);
        let mut last = (None, 0.0);
        for _ in 0..=self.robot.joints.len() {
            let Some((leader, by, plus)) = self.robot.joints.get(at).and_then(|joint| joint.mimic)
            else {
                return Ok(last);
            };
            offset += factor * plus;
            factor *= by;
            at = leader;
            if self.joints.contains(&at) {
                last = (Some((at, factor)), offset);
            }
        }
        Err(self.robot.error_at(index, UrdfErrorKind::MimicCircle))
    }

    /// Returns the names of the moving joints.
    pub(crate) fn joint_names(&self) -> Vec<String> {
        self.stages
            .iter()
            .filter_map(|stage| Some(self.robot.joints.get(stage.joint)?.name.clone()))
            .collect()
    }

    /// Returns the names of the first and the last link.
    pub(crate) fn ends(&self) -> (&str, &str) {
        let name = |link: usize| self.robot.links.get(link).map_or("", |link| link.name.as_str());
        (name(self.base), name(self.tip))
    }
}

/// Returns the names of the moving joints of a chain, then those of each further chain that the ones
/// before it do not move.
pub(crate) fn names_of_joints(chain: &Chain, further: &[Chain]) -> Vec<String> {
    let mut names = chain.joint_names();
    for name in further.iter().flat_map(Chain::joint_names) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// Returns a frame whose z axis is along `axis`, by the smallest rotation from the identity.
fn axis_frame(axis: &Vector3<f64>) -> Frame<f64> {
    let horizontal = axis.x.hypot(axis.y);
    let mut frame = Frame::identity();
    if horizontal > 0.0 || axis.z < 0.0 {
        let about = if horizontal > 0.0 {
            Vector3::new(-axis.y, axis.x, 0.0) / horizontal
        } else {
            Vector3::x()
        };
        frame.rotate(&(about * horizontal.atan2(axis.z)));
    }
    frame
}

/// Returns `frame` after the joint has moved by `q` \[rad\] about or \[m\] along z of the frame.
pub(super) fn moved(frame: &Frame<f64>, joint: &Joint, q: f64) -> Frame<f64> {
    let mut frame = *frame;
    match joint.kind {
        Kind::Revolute => frame.rotate_z(q.sin_cos()),
        Kind::Prismatic => frame.translate_z(q),
        Kind::Fixed | Kind::Other(_) => {}
    }
    frame
}

/// Returns, for each link, the joint that has it as child and that joint's parent link; `None` for
/// the root. A link with two parents and a loop of joints are errors.
fn parents(robot: &Robot) -> Result<Vec<Option<(usize, usize)>>, InputError> {
    let mut above: Vec<Option<(usize, usize)>> = vec![None; robot.links.len()];
    let link = |index: usize| robot.link_name(index);
    for (index, joint) in robot.joints.iter().enumerate() {
        let Some(place) = above.get_mut(joint.child) else { continue };
        if let Some((first, _)) = place.replace((index, joint.parent)) {
            let first = robot.joints.get(first).map_or(String::new(), |link| link.name.clone());
            let (link, second) = (link(joint.child), joint.name.clone());
            return Err(robot.error_at(index, UrdfErrorKind::TwoParents { link, first, second }));
        }
    }
    // In a tree no link is deeper than the number of links.
    for start in 0..robot.links.len() {
        let (mut at, mut steps) = (start, 0);
        while let Some((joint, parent)) = above.get(at).copied().flatten() {
            (at, steps) = (parent, steps + 1);
            if steps > robot.links.len() {
                return Err(robot.error_at(joint, UrdfErrorKind::Loop { link: link(at) }));
            }
        }
    }
    Ok(above)
}

/// Returns the index of the only link without a parent.
fn root(robot: &Robot, above: &[Option<(usize, usize)>]) -> Result<usize, InputError> {
    let roots: Vec<usize> =
        (0..above.len()).filter(|&link| above.get(link).is_some_and(Option::is_none)).collect();
    match *roots.as_slice() {
        [root] => Ok(root),
        [] => Err(robot.error(UrdfErrorKind::NoLinks)),
        _ => {
            let roots = roots.iter().map(|&link| robot.link_name(link)).collect();
            Err(robot.error(UrdfErrorKind::Roots { roots }))
        }
    }
}

/// Returns the index of the only leaf below `base`, or of the leaf with at least twice as many
/// moving joints as every other one. Also returns descriptions of the other leaves.
fn leaf(
    robot: &Robot,
    above: &[Option<(usize, usize)>],
    base: usize,
) -> Result<(usize, Vec<String>), InputError> {
    let is_parent = |link: usize| robot.joints.iter().any(|joint| joint.parent == link);
    // Returns the number of moving joints from the base to a link below it.
    let depth = |link: usize| {
        let (mut at, mut moving) = (link, 0);
        while at != base {
            let (joint, parent) = above.get(at).copied().flatten()?;
            moving +=
                usize::from(robot.joints.get(joint).is_some_and(|joint| joint.kind != Kind::Fixed));
            at = parent;
        }
        Some(moving)
    };
    let ends = (0..robot.links.len()).filter(|&link| !is_parent(link));
    let mut leaves: Vec<(usize, usize)> =
        ends.filter_map(|link| Some((depth(link)?, link))).collect();
    if let [(_, leaf)] = *leaves.as_slice() {
        return Ok((leaf, Vec::new()));
    }
    leaves.sort_by_key(|&(moving, link)| (usize::MAX - moving, link));
    let named = |(moving, link): &(usize, usize)| {
        let plural = if *moving == 1 { "" } else { "s" };
        format!("{} ({moving} moving joint{plural})", robot.link_name(*link))
    };
    if let [(most, leaf), (second, _), ..] = *leaves.as_slice()
        && most >= MIN_PLAIN_JOINTS
        && 2 * second <= most
    {
        return Ok((leaf, leaves.iter().skip(1).map(named).collect()));
    }
    // A leaf that no joint moves, such as a second frame of the base, is no end of the arm.
    if leaves.iter().filter(|(moving, _)| *moving > 0).count() > 1 {
        leaves.retain(|(moving, _)| *moving > 0);
    }
    // The last link above all leaves, where a tool or a gripper branches.
    let path = |link: usize| {
        let up = |at: &usize| {
            let above = above.get(*at).copied().flatten().filter(|_| *at != base);
            above.map(|(_, parent)| parent)
        };
        std::iter::successors(Some(link), up).collect::<Vec<usize>>()
    };
    let paths: Vec<Vec<usize>> = leaves.iter().map(|&(_, link)| path(link)).collect();
    let is_common = |link: &&usize| paths.iter().all(|path| path.contains(link));
    let fork = paths.first().and_then(|path| path.iter().find(is_common)).copied();
    let is_moved = |link: &usize| depth(*link).is_some_and(|moving| moving > 0);
    let fork = fork.filter(is_moved).map(|link| robot.link_name(link));
    let (base, leaves) = (robot.link_name(base), leaves.iter().map(named).collect());
    Err(robot.error(UrdfErrorKind::Leaves { base, leaves, fork }))
}
