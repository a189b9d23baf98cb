//! Notes for the user about numbers of a URDF that look wrong or were interpreted.

use std::f64::consts::TAU;

use super::chain::Chain;
use super::read::{Joint, Kind};

/// Maximum plausible angle of an origin \[rad\]: one turn, with a margin for rounding.
const MAX_PLAUSIBLE_ANGLE: f64 = TAU + 0.01;
/// Maximum plausible coordinate of an origin \[m\]; no joint of an arm is farther from the previous
/// one.
const MAX_PLAUSIBLE_LENGTH: f64 = 20.0;

/// Maximum plausible mass of a link \[kg\].
const MAX_PLAUSIBLE_MASS: f64 = 1000.0;

/// Smallest number of moving joints of another branch at which it is one to calibrate, not a
/// gripper.
const MIN_BRANCH_JOINTS: usize = 2;

/// Returns the notes about a chain, the `further` ones of a tree, and about joints outside them.
pub(super) fn of_chain(chain: &Chain, further: &[Chain]) -> Vec<String> {
    let mut indices = chain.joints.clone();
    indices.extend(further.iter().flat_map(|branch| &branch.joints));
    let joints: Vec<&Joint> =
        indices.iter().filter_map(|&index| chain.robot.joints.get(index)).collect();
    let mut notes: Vec<String> = chosen_tip(chain).into_iter().chain(moving_end(chain)).collect();
    notes.extend(other_branch(chain, &indices).filter(|_| further.is_empty()));
    notes.extend(right_angles(&joints));
    notes.extend(joints.iter().filter_map(|joint| angle_in_degrees(joint)));
    notes.extend(joints.iter().filter_map(|joint| length_in_millimetres(joint)));
    notes.extend(limits_in_degrees(&joints));
    notes.extend(mass_in_grams(chain));
    notes.extend(joints.iter().filter_map(|joint| unlimited_slide(joint)));
    let beside =
        chain.robot.joints.iter().enumerate().filter(|(index, _)| !indices.contains(index));
    notes.extend(beside.filter_map(|(_, joint)| {
        let (_, kind) = joint.broken_mimic.as_ref()?;
        Some(format!(
            "{}: <mimic>: {kind}; ignored, because the joint is beside the chain",
            joint.name
        ))
    }));
    notes
}

/// Returns a note if the tip was chosen among several leaves.
fn chosen_tip(chain: &Chain) -> Option<String> {
    let others = &chain.other_leaves;
    (!others.is_empty()).then(|| {
        format!(
            "tip {} taken, which has by far the most moving joints; others are {}, chosen with \
             --tip",
            chain.ends().1,
            others.join(", ")
        )
    })
}

/// Returns a note if another branch leaves the joints of the chain and moves by itself: the link at
/// its end with the most joints.
fn other_branch(chain: &Chain, joints: &[usize]) -> Option<String> {
    let robot = chain.robot;
    let above = |link: usize| {
        let mut above = robot.joints.iter().enumerate().filter(move |(_, of)| of.child == link);
        above.next().filter(|(index, _)| !joints.contains(index)).map(|(_, joint)| joint)
    };
    let moving = |leaf: usize| {
        let path = std::iter::successors(above(leaf), |joint| above(joint.parent));
        path.filter(|joint| joint.kind != Kind::Fixed && joint.mimic.is_none()).count()
    };
    let is_leaf = |link: &usize| !robot.joints.iter().any(|joint| joint.parent == *link);
    let leaves = (0..robot.links.len()).filter(is_leaf).map(|leaf| (moving(leaf), leaf));
    let (_, leaf) = leaves
        .filter(|(moving, _)| *moving >= MIN_BRANCH_JOINTS)
        .max_by_key(|&(moving, leaf)| (moving, usize::MAX - leaf))?;
    Some(format!(
        "{} moves beside this chain, with frames of the common joints that differ from those of a \
         chain of its own: for both in one problem, --tip {} --tip {}",
        robot.link_name(leaf),
        chain.ends().1,
        robot.link_name(leaf)
    ))
}

/// Returns a note if no fixed joint follows the last moving one.
fn moving_end(chain: &Chain) -> Option<String> {
    let (joint, tip) = (chain.moving_end()?, chain.ends().1);
    Some(format!(
        "no fixed joint follows the moving joint {joint}, so that a URDF that export corrects can hold no rotation of the tool \
         frame; for that, add a fixed joint after {tip}, and choose its link with --tip"
    ))
}

/// Returns a note if an angle of an origin is more than one turn, so that it is probably in
/// degrees.
fn angle_in_degrees(joint: &Joint) -> Option<String> {
    let angle = joint.origin.written.iter().find(|angle| angle.abs() > MAX_PLAUSIBLE_ANGLE)?;
    Some(format!(
        "{}: rpy holds {angle} rad, which is more than one turn; if the URDF has degrees there, \
         convert them to radians \
         and run init again",
        joint.name
    ))
}

/// Returns a note about the heaviest link if it is too heavy for an arm.
fn mass_in_grams(chain: &Chain) -> Option<String> {
    let heaviest = chain.robot.links.iter().max_by(|a, b| a.mass.total_cmp(&b.mass))?;
    (heaviest.mass > MAX_PLAUSIBLE_MASS).then(|| {
        format!(
            "{}: mass holds {} kg; if the URDF has grams there, convert them to kilograms and run \
             init again",
            heaviest.name, heaviest.mass
        )
    })
}

/// Returns a note if an origin is implausibly far from the previous one, so that it is probably in
/// millimetres.
fn length_in_millimetres(joint: &Joint) -> Option<String> {
    let length = joint.origin.xyz.iter().find(|length| length.abs() > MAX_PLAUSIBLE_LENGTH)?;
    Some(format!(
        "{}: xyz holds {length} m; if the URDF has millimetres there, convert them to metres \
         and run init again",
        joint.name
    ))
}

/// Returns a note if limits of revolute joints were ignored because they look like degrees.
fn limits_in_degrees(joints: &[&Joint]) -> Option<String> {
    let limits = |joint: &&Joint| {
        let (lower, upper) = joint.limits_in_degrees?;
        Some(format!("{} ({lower} to {upper})", joint.name))
    };
    let named: Vec<String> = joints.iter().filter_map(limits).collect();
    (!named.is_empty()).then(|| {
        format!(
            "limits of more than two turns, which a URDF gives in radians, are taken as none: {}; if \
             they are degrees, convert them and run init again",
            named.join(", ")
        )
    })
}

/// Returns a note if a commanded prismatic joint lacks a limit, which planning needs.
fn unlimited_slide(joint: &Joint) -> Option<String> {
    let is_unlimited = !joint.limits.0.is_finite() || !joint.limits.1.is_finite();
    (joint.kind == Kind::Prismatic && is_unlimited && joint.mimic.is_none()).then(|| {
        format!("{}: slides without limits; write min_m and max_m in its [[joint]] before check or plan", joint.name)
    })
}

/// Returns a note if angles were read as multiples of 45° from their rounded decimals.
fn right_angles(origins: &[&Joint]) -> Option<String> {
    let (mut values, mut degrees): (Vec<String>, Vec<String>) = Default::default();
    let mut joints = Vec::new();
    for joint in origins {
        let pairs = joint.origin.written.iter().zip(joint.origin.meant.iter());
        let rounded: Vec<(f64, f64)> = pairs
            .filter(|(written, meant)| written.to_bits() != meant.to_bits())
            .map(|(written, meant)| (written.abs(), meant.abs()))
            .collect();
        if !rounded.is_empty() {
            joints.push(joint.name.as_str());
        }
        for (written, meant) in rounded {
            let value = written.to_string();
            if !values.contains(&value) {
                values.push(value);
                degrees.push(format!("{}°", meant.to_degrees().round()));
            }
        }
    }
    (!values.is_empty()).then(|| {
        let [verb, subject] = if values.len() == 1 {
            ["is", "it is a rounded value"]
        } else {
            ["are", "they are rounded values"]
        };
        let (values, joints, degrees) = (values.join(", "), joints.join(", "), degrees.join(", "));
        format!(
            "{values} rad at {joints} {verb} read as exactly {degrees}, of which {subject}; \
             values with more decimals are used as written"
        )
    })
}
