//! The joints between two links, from axis to axis.

use nalgebra::Vector3;

use super::read::{Joint, Kind, Robot};
use crate::error::{InputError, UrdfErrorKind};
use crate::problem::Problem;
use crate::spatial::Frame;

/// Most joints of a chain: as many as a problem may have, with a fixed one at each end.
const MOST_JOINTS: usize = 98;

/// The joints of a robot from one link to another.
pub struct Chain<'a> {
    pub(super) robot: &'a Robot,
    pub(super) base: usize,
    pub(super) tip: usize,
    /// Indices of the joints from base to tip.
    pub(super) joints: Vec<usize>,
    /// The moving ones.
    pub(super) stages: Vec<Stage>,
    /// What lies behind the last axis frame: the tip as seen from there.
    pub(super) end: Frame<f64>,
}

/// A moving joint: what lies between the axis frame before it and its own. An axis frame stands in
/// a joint before it moves, its z along the axis.
pub(super) struct Stage {
    /// Index of the joint in the robot.
    pub joint: usize,
    /// Its axis frame as seen from the axis frame before it, the addend of a mimic joint in it.
    pub step: Frame<f64>,
    /// The axis frame as seen from the joint's own frame.
    pub axis: Frame<f64>,
    /// Stage whose command it follows, and the factor.
    pub mimic: Option<(usize, f64)>,
    /// Addend of a mimic joint \[rad\] or \[m\].
    pub addend: f64,
}

impl<'a> Chain<'a> {
    /// The chain from `base` to `tip`; without them from the root to the only leaf below the base.
    ///
    /// # Errors
    /// A tree that is none, several roots or leaves to choose from, a joint that no arm has, no
    /// joint that moves.
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
        let tip = match tip {
            Some(name) => robot.link(name)?,
            None => leaf(robot, &above, base)?,
        };
        let name =
            |link: usize| robot.links.get(link).map_or(String::new(), |own| own.name.clone());
        let (mut joints, mut passed, mut at) = (Vec::new(), Vec::new(), tip);
        while at != base {
            let Some((joint, parent)) = above.get(at).copied().flatten() else {
                return Err(robot.error(UrdfErrorKind::NotBelow {
                    base: name(base),
                    tip: name(tip),
                    above: passed,
                }));
            };
            joints.push(joint);
            passed.push(name(parent));
            at = parent;
        }
        joints.reverse();
        if joints.len() > MOST_JOINTS {
            return Err(robot
                .error(UrdfErrorKind::TooManyJoints { found: joints.len(), most: MOST_JOINTS }));
        }
        let mut chain =
            Self { robot, base, tip, joints, stages: Vec::new(), end: Frame::identity() };
        chain.walk()?;
        if chain.stages.is_empty() {
            return Err(
                robot.error(UrdfErrorKind::NothingMoves { base: name(base), tip: name(tip) })
            );
        }
        Ok(chain)
    }

    /// The chain that a problem was made from, between the ends that it names.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(robot: &'a Robot, problem: &Problem) -> Result<Self, InputError> {
        let ends = problem.urdf.as_ref();
        Self::new(robot, ends.map(|ends| ends.base.as_str()), ends.map(|ends| ends.tip.as_str()))
    }

    /// Finds the stages.
    fn walk(&mut self) -> Result<(), InputError> {
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
            let axis = axis_frame(&joint.axis);
            let (leader, addend) = self.leader(index)?;
            leaders.push(leader);
            step = moved(&step.compose(&axis), joint, addend);
            self.stages.push(Stage { joint: index, step, axis, mimic: None, addend });
            // What follows is seen from the axis frame: back to the joint's own first.
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

    /// The first joint of the chain whose command a joint follows in the end, with factor and
    /// addend; none where no joint of the chain leads it, so that it is commanded itself.
    fn leader(&self, index: usize) -> Result<(Option<(usize, f64)>, f64), InputError> {
        let (mut factor, mut addend, mut at) = (1.0, 0.0, index);
        let mut last = (None, 0.0);
        for _ in 0..=self.robot.joints.len() {
            let Some((leader, by, plus)) = self.robot.joints.get(at).and_then(|own| own.mimic)
            else {
                return Ok(last);
            };
            addend += factor * plus;
            factor *= by;
            at = leader;
            if self.joints.contains(&at) {
                last = (Some((at, factor)), addend);
            }
        }
        Err(self.robot.error_at(index, UrdfErrorKind::MimicCircle))
    }

    /// Names of the moving joints.
    pub fn joint_names(&self) -> Vec<String> {
        self.stages
            .iter()
            .filter_map(|stage| Some(self.robot.joints.get(stage.joint)?.name.clone()))
            .collect()
    }

    /// Names of the first and the last link.
    pub fn ends(&self) -> (&str, &str) {
        let name = |link: usize| self.robot.links.get(link).map_or("", |own| own.name.as_str());
        (name(self.base), name(self.tip))
    }
}

/// A frame with its z along `axis`: none where that is z already, else the shortest turn.
fn axis_frame(axis: &Vector3<f64>) -> Frame<f64> {
    let level = axis.x.hypot(axis.y);
    let mut frame = Frame::identity();
    if level > 0.0 || axis.z < 0.0 {
        let about =
            if level > 0.0 { Vector3::new(-axis.y, axis.x, 0.0) / level } else { Vector3::x() };
        frame.rotate(&(about * level.atan2(axis.z)));
    }
    frame
}

/// `frame` after the joint has moved by q, its axis along z.
pub(super) fn moved(frame: &Frame<f64>, joint: &Joint, q: f64) -> Frame<f64> {
    let mut frame = *frame;
    match joint.kind {
        Kind::Revolute => frame.rotate_z(q.sin_cos()),
        Kind::Prismatic => frame.translate_z(q),
        Kind::Fixed | Kind::Other(_) => {}
    }
    frame
}

/// The joint above each link and the link above that.
fn parents(robot: &Robot) -> Result<Vec<Option<(usize, usize)>>, InputError> {
    let mut above: Vec<Option<(usize, usize)>> = vec![None; robot.links.len()];
    let link = |index: usize| robot.links.get(index).map_or(String::new(), |own| own.name.clone());
    for (index, joint) in robot.joints.iter().enumerate() {
        let Some(place) = above.get_mut(joint.child) else { continue };
        if let Some((first, _)) = place.replace((index, joint.parent)) {
            let first = robot.joints.get(first).map_or(String::new(), |own| own.name.clone());
            let (link, second) = (link(joint.child), joint.name.clone());
            return Err(robot.error_at(index, UrdfErrorKind::TwoParents { link, first, second }));
        }
    }
    // Every link is at most as deep as there are links.
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

fn root(robot: &Robot, above: &[Option<(usize, usize)>]) -> Result<usize, InputError> {
    let roots: Vec<usize> =
        (0..above.len()).filter(|&link| above.get(link).is_some_and(Option::is_none)).collect();
    match *roots.as_slice() {
        [root] => Ok(root),
        [] => Err(robot.error(UrdfErrorKind::NoLinks)),
        _ => {
            let roots = roots
                .iter()
                .filter_map(|&link| Some(robot.links.get(link)?.name.clone()))
                .collect();
            Err(robot.error(UrdfErrorKind::Roots { roots }))
        }
    }
}

/// The only link below `base` that no joint has as its parent.
fn leaf(robot: &Robot, above: &[Option<(usize, usize)>], base: usize) -> Result<usize, InputError> {
    let is_parent = |link: usize| robot.joints.iter().any(|joint| joint.parent == link);
    // Moving joints from the base to a link, if it is below.
    let depth = |link: usize| {
        let (mut at, mut moving) = (link, 0);
        while at != base {
            let (joint, parent) = above.get(at).copied().flatten()?;
            moving +=
                usize::from(robot.joints.get(joint).is_some_and(|own| own.kind != Kind::Fixed));
            at = parent;
        }
        Some(moving)
    };
    let ends = (0..robot.links.len()).filter(|&link| !is_parent(link));
    let mut leaves: Vec<(usize, usize)> =
        ends.filter_map(|link| Some((depth(link)?, link))).collect();
    if let [(_, leaf)] = *leaves.as_slice() {
        return Ok(leaf);
    }
    leaves.sort_by_key(|&(moving, link)| (usize::MAX - moving, link));
    let named = |(moving, link): &(usize, usize)| {
        let plural = if *moving == 1 { "" } else { "s" };
        Some(format!("{} ({moving} moving joint{plural})", robot.links.get(*link)?.name))
    };
    let base = robot.links.get(base).map_or(String::new(), |own| own.name.clone());
    Err(robot
        .error(UrdfErrorKind::Leaves { base, leaves: leaves.iter().filter_map(named).collect() }))
}
