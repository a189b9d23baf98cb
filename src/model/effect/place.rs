//! Names, places and arguments of effects.

use crate::model::parameter::{Driver, JointField, Slot};
use crate::problem::effects::NAMES;
use crate::problem::{Body, Effect, Joint, JointKind, Problem};

/// An argument of an effect as the files write it.
#[derive(Debug, Clone, PartialEq)]
pub enum Argument {
    /// Number of a joint, from 1.
    Joint(usize),
    /// Orders of harmonics.
    Orders(Vec<u32>),
    /// Name of a beam.
    Link(String),
    /// A time [s].
    Time(f64),
}

/// Name in problem files.
pub fn name(effect: &Effect) -> &'static str {
    NAMES[match effect {
        Effect::JointCompliance { .. } => 0,
        Effect::JointHarmonic { .. } => 1,
        Effect::GearRatio { .. } => 2,
        Effect::Backlash { .. } => 3,
        Effect::JointNonlinearStiffness { .. } => 4,
        Effect::JointLateralCompliance { .. } => 5,
        Effect::JointThermalDrift { .. } => 6,
        Effect::JointCoupling { .. } => 7,
        Effect::LinkBending { .. } => 8,
        Effect::LinkThermalBending { .. } => 9,
        Effect::LinkThermalExpansion { .. } => 10,
        Effect::UnmodelledMass { .. } => 11,
        Effect::PayloadMass => 12,
        Effect::HoistForce => 13,
        Effect::HoistDirection => 14,
        Effect::BaseCompliance => 15,
        Effect::GravityDirection => 16,
        Effect::DeflectedEquilibrium => 17,
        Effect::TrackerScale => 18,
        Effect::TrackerDrift => 19,
        Effect::StationShift { .. } => 20,
    }]
}

/// Arguments by key, in the order of the files.
pub fn arguments(effect: &Effect) -> Vec<(&'static str, Argument)> {
    match effect {
        Effect::JointCompliance { joint }
        | Effect::GearRatio { joint }
        | Effect::Backlash { joint }
        | Effect::JointNonlinearStiffness { joint }
        | Effect::JointLateralCompliance { joint }
        | Effect::JointThermalDrift { joint }
        | Effect::LinkBending { joint } => vec![("joint", Argument::Joint(*joint))],
        Effect::JointHarmonic { joint, orders } => {
            vec![("joint", Argument::Joint(*joint)), ("orders", Argument::Orders(orders.clone()))]
        }
        Effect::JointCoupling { joint, from } => {
            vec![("joint", Argument::Joint(*joint)), ("from", Argument::Joint(*from))]
        }
        Effect::LinkThermalBending { link }
        | Effect::LinkThermalExpansion { link }
        | Effect::UnmodelledMass { link } => vec![("link", Argument::Link(link.clone()))],
        Effect::StationShift { at_time } => vec![("at_time_s", Argument::Time(*at_time))],
        Effect::PayloadMass
        | Effect::HoistForce
        | Effect::HoistDirection
        | Effect::BaseCompliance
        | Effect::GravityDirection
        | Effect::DeflectedEquilibrium
        | Effect::TrackerScale
        | Effect::TrackerDrift => Vec::new(),
    }
}

/// Where an effect is, as its parameters' names say it in brackets: a joint's number, a link, a time; empty for the whole.
pub fn place(effect: &Effect) -> String {
    let word = |argument: Argument| match argument {
        Argument::Joint(joint) => Some(joint.to_string()),
        Argument::Link(link) => Some(link),
        Argument::Time(time) => Some(time.to_string()),
        Argument::Orders(_) => None,
    };
    let words: Vec<String> = arguments(effect).into_iter().filter_map(|(_, argument)| word(argument)).collect();
    words.join(",")
}

/// What an error of a joint, counted from 1, adds to: d where it slides, else θ.
pub(super) fn coordinate(problem: &Problem, joint: usize) -> Slot {
    let field = if slides(problem, joint) { JointField::D } else { JointField::Theta };
    Slot::Joint { joint: joint - 1, field }
}

/// What a joint, counted from 1, is told.
pub(super) fn command(problem: &Problem, joint: usize) -> Driver {
    if slides(problem, joint) { Driver::Travel(joint - 1) } else { Driver::Command(joint - 1) }
}

/// Whether a joint, counted from 1, slides.
pub(super) fn slides(problem: &Problem, joint: usize) -> bool {
    problem.joints[joint - 1].kind == JointKind::Prismatic
}

/// Numbers, from 1, of the joints that take a command.
pub(super) fn commanded(problem: &Problem) -> impl Iterator<Item = usize> + '_ {
    let takes = |&(_, joint): &(usize, &crate::problem::Joint)| joint.kind != JointKind::Fixed;
    problem.joints.iter().enumerate().filter(takes).map(|(index, _)| index + 1)
}

/// The weight of everything that is declared beyond a joint, counted from 1, at the length of the arm beyond it [N·m].
pub(super) fn greatest_moment(problem: &Problem, joint: usize) -> f64 {
    let all = |bodies: &[Body]| bodies.iter().map(|body| body.mass).sum::<f64>();
    let beam = |joint: &Joint| joint.beam.as_ref().map_or(0.0, |beam| beam.mass + all(&beam.masses));
    let (own, beyond) = (&problem.joints[joint - 1], &problem.joints[joint..]);
    let mass = all(&own.bodies) + beyond.iter().map(|joint| all(&joint.bodies) + beam(joint)).sum::<f64>();
    let reach: f64 = beyond.iter().map(|joint| joint.a.hypot(joint.d)).sum();
    problem.gravity.norm() * (mass + problem.tool.payload_mass) * (reach + problem.tool.target.norm())
}

/// Index of the joint whose beam has that name.
pub(super) fn carrier(problem: &Problem, link: &str) -> Option<usize> {
    problem.joints.iter().position(|joint| joint.beam.as_ref().is_some_and(|beam| beam.name == link))
}

/// Names of all beams.
pub(super) fn links(problem: &Problem) -> impl Iterator<Item = String> + '_ {
    problem.joints.iter().filter_map(|joint| joint.beam.as_ref()).map(|beam| beam.name.clone())
}

/// Whether some rope hoists the arm.
pub(super) fn is_hoisted(problem: &Problem) -> bool {
    problem.joints.iter().any(|joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some()))
}
