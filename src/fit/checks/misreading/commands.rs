//! Misreadings of the columns of joints.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use nalgebra::DVector;

use super::{Kind, Misreading, numbers_of};
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::stages::fitting::Fitting;
use crate::measurement::Measurements;
use crate::problem::{Effect, JointKind, Problem};

/// Maximum number of joints for which every pair is tried as exchanged or coupled.
const MAX_PAIRED: usize = 12;
/// Step between trial errors of a joint's zero position \[°\]. A full fit finds values between
/// them.
const ZERO_POSITION_STEP: i16 = 15;
/// Trial ratios of the motion of a joint to its command, in hundredths. A full fit finds values
/// between them.
/// The last one is that of degrees to radians.
const TRIAL_RATIOS: [i16; 21] =
    [1, 5, 10, 20, 25, 33, 50, 67, 80, 90, 97, 103, 110, 125, 150, 200, 300, 400, 500, 1000, 5730];
/// Numbers of units to a turn, of units that are taken for degrees, with their names.
const TURN_UNITS: [(f64, &str); 8] = [
    (1.0, "turns"),
    (6.0, "divided by 60"),
    (2000.0 * PI, "milliradians"),
    (21_600.0, "minutes of arc"),
    (1_296_000.0, "seconds of arc"),
    (400.0, "gradians"),
    (3600.0, "tenths of a degree"),
    (36_000.0, "hundredths of a degree"),
];
/// Usual numbers of counts of encoders to a turn.
const COUNTS: [u32; 17] = [
    1000, 1024, 2000, 2048, 2500, 4000, 4096, 5000, 8000, 8192, 10_000, 16_384, 32_768, 65_536,
    131_072, 262_144, 1_048_576,
];
/// Maximum number of joints in another unit than the rest of which every subset is tried.
const MAX_SUBSETS: usize = 4;
/// Maximum number of joints of which every three are tried as exchanged in a ring.
const MAX_CYCLED: usize = 7;
/// Usual leads of ball screws \[mm\]. A full fit finds values near them.
const SCREW_LEADS: [i16; 12] = [4, 5, 6, 8, 10, 12, 16, 20, 25, 32, 40, 50];

/// Ratios of a quantity in one unit to the same quantity in another unit: degrees and radians,
/// millimetres and metres.
const UNIT_RATIOS: [f64; 4] = [PI / 180.0, 180.0 / PI, 1e-3, 1e3];
/// Largest relative deviation of a fitted ratio from one of [`UNIT_RATIOS`] at which the column is
/// in another unit; gear errors are smaller.
const UNIT_RATIO_TOLERANCE: f64 = 0.05;
/// Largest relative deviation of a ratio of motion to command from that of two units, at which the
/// text names the units.
const NAMED_UNIT_TOLERANCE: f64 = 0.02;

/// Returns true if a ratio of motion to command is that of two units, see [`UNIT_RATIOS`].
pub(super) fn is_unit_ratio(size: f64) -> bool {
    UNIT_RATIOS.iter().any(|ratio| (size / ratio - 1.0).abs() < UNIT_RATIO_TOLERANCE)
}

/// Returns the words for the misreading of joint columns that explains the positions of `rows` best,
/// to an rms error below `limit` \[m\], with the full parameter vector `x` of the arm; `None` if none
/// does.
pub(in crate::fit) fn reading_of_rows(
    fit: &CheckedFit,
    (x, limit): (&DVector<f64>, f64),
    rows: &[usize],
) -> Option<String> {
    let Fitting { placement, model, measurements: table, .. } = *fit.fitting;
    let mut corrected = table.clone();
    let mut best = (limit, None);
    for reading in of_commands(fit.problem) {
        for &row in rows {
            let place = row * table.joints..(row + 1) * table.joints;
            let q = &mut corrected.configurations[place];
            q.copy_from_slice(table.configuration(row));
            reading.commands.iter().for_each(|correct| correct(q));
        }
        let rms = fit.rms(rows, &placement.position_errors(model, x, &corrected, rows));
        if rms < best.0 {
            best = (rms, Some(reading.words));
        }
    }
    best.1.map(|words| format!("they fit with {words}"))
}

/// Returns the misreadings of the unit of the joint columns.
pub(super) fn of_joint_units(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let turning = |radians| -> Vec<usize> {
        (0..problem.joints.len()).filter(|&j| turns_in(problem, table, j, radians)).collect()
    };
    let [in_radians, in_degrees] = [true, false].map(turning);
    let scaled = |words: &str, joints: &[usize], factor: f64| {
        Misreading::of_factor(format!("joint angles that are {words}"), joints.to_vec(), factor)
    };
    let mut units = Vec::new();
    if !in_radians.is_empty() {
        let words = "degrees, declared as radians";
        units.push(scaled(words, &in_radians, PI / 180.0).of_kind(Kind::Usual));
    }
    if !in_degrees.is_empty() {
        let words = "radians, declared as degrees";
        units.push(scaled(words, &in_degrees, 180.0 / PI).of_kind(Kind::Usual));
        let of_turn = |per_turn: f64, name: &str| {
            scaled(&format!("{name}, declared as degrees"), &in_degrees, 360.0 / per_turn)
        };
        units.extend(TURN_UNITS.map(|(per_turn, name)| of_turn(per_turn, name)));
        units.extend(COUNTS.map(|of| of_turn(f64::from(of), &format!("counts of {of} to a turn"))));
    }
    units.extend(of_mixed_units(problem, table));
    let slides = |joint: usize| {
        problem.joints.get(joint).is_some_and(|joint| joint.command_kind() == JointKind::Prismatic)
    };
    let sliding: Vec<usize> = (0..problem.joints.len()).filter(|&joint| slides(joint)).collect();
    let column = table.command_columns.iter().find(|column| slides(column.joint));
    units.extend(column.map(|column| {
        let (found, declared, factor) = if column.unit >= 1.0 {
            ("millimetres", "metres", 1e-3)
        } else {
            ("metres", "millimetres", 1e3)
        };
        let words =
            format!("columns of sliding joints that are in {found}, declared in {declared}");
        Misreading::of_factor(words, sliding, factor)
    }));
    units
}

/// Returns the misreadings that some turning joints alone are in radians, declared as degrees, or the
/// reverse: those whose commands are as small, or as large, as such numbers read.
fn of_mixed_units(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let largest = |joint: usize| {
        let commands = (0..table.len()).filter_map(|row| table.configuration(row).get(joint));
        commands.fold(0.0, |most: f64, q| most.max(q.abs()))
    };
    let sets = [true, false].into_iter().flat_map(|is_radians| {
        let turning: Vec<usize> = (0..problem.joints.len().min(64))
            .filter(|&joint| turns_in(problem, table, joint, !is_radians))
            .collect();
        let is_of_set = |joint: &usize| match largest(*joint) {
            most if is_radians => 0.0 < most && most <= (2.0 * PI).to_radians(),
            most => most > 2.0 * PI,
        };
        let set: Vec<u64> =
            turning.iter().filter(|&j| is_of_set(j)).map(|joint| 1 << joint).collect();
        let part = |bits: u64| -> u64 {
            set.iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1).map(|(_, bit)| bit).sum()
        };
        let parts = if set.len() > MAX_SUBSETS { 1 } else { 1_u64 << set.len() };
        let is_mixed = |joints: &u64| joints.count_ones() > 1 && set.len() < turning.len();
        let whole = set.iter().sum::<u64>();
        let sets: BTreeSet<u64> = (1..parts).map(part).chain([whole]).filter(is_mixed).collect();
        let (found, declared, factor) = if is_radians {
            ("radians", "degrees", 180.0 / PI)
        } else {
            ("degrees", "radians", PI / 180.0)
        };
        sets.into_iter().map(move |joints| {
            let numbers = listed_joints(joints);
            let words =
                format!("joints {numbers} alone that are in {found}, declared as {declared}");
            let joints = numbers_of(joints).map(|joint| joint - 1).collect();
            Misreading::of_factor(words, joints, factor).of_kind(Kind::Usual)
        })
    });
    sets.collect()
}

/// Returns every choice of `count` of some joints.
pub(super) fn choices(joints: &[usize], count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let with_first = |(k, &first): (usize, &usize)| {
        let rest = choices(&joints[k + 1..], count - 1).into_iter();
        rest.map(move |rest| [vec![first], rest].concat()).collect::<Vec<_>>()
    };
    joints.iter().enumerate().flat_map(with_first).collect()
}

/// Returns the misreadings of the joint columns: signs, exchanged columns, couplings, zero
/// positions and ratios.
pub(super) fn of_commands(problem: &Problem) -> Vec<Misreading> {
    let kind = |joint: usize| problem.joints[joint - 1].command_kind();
    let moving: Vec<usize> = (1..=problem.joints.len().min(64))
        .filter(|&joint| kind(joint) != JointKind::Fixed)
        .collect();
    let is_ordered = moving.len() > 3 && moving.iter().all(|&joint| kind(joint) == kind(moving[0]));
    let turning = moving.iter().copied().filter(|&joint| kind(joint) == JointKind::Revolute);
    let turning: Vec<usize> = turning.collect();
    let mut misreadings: Vec<Misreading> =
        moving.iter().map(|&joint| Misreading::reversed(1 << (joint - 1))).collect();
    // Exchanges of columns that give the same order as an earlier one are left out.
    let mut orders: Vec<Vec<usize>> = Vec::new();
    let mut ordered = |words: String, order: Vec<usize>| {
        let is_new = !orders.contains(&order);
        orders.extend(is_new.then(|| order.clone()));
        is_new.then(|| Misreading::of_column_order(words, order))
    };
    let identity: Vec<usize> = (0..problem.joints.len()).collect();
    // The order in which each of the joints in `to` takes the coordinate of that in `from`.
    let moved = |to: &[usize], from: &[usize]| {
        let mut order = identity.clone();
        to.iter().zip(from).for_each(|(&to, &from)| order[to] = from);
        order
    };
    let exchanged = |pairs: &[[usize; 2]]| {
        let mut order = identity.clone();
        for [one, other] in pairs {
            order.swap(one - 1, other - 1);
        }
        order
    };
    let commanded: Vec<usize> =
        identity.iter().copied().filter(|&joint| kind(joint + 1) != JointKind::Fixed).collect();
    if is_ordered {
        let opposite: Vec<usize> = commanded.iter().rev().copied().collect();
        let words = "columns of all joints in the opposite order".to_owned();
        misreadings.extend(ordered(words, moved(&commanded, &opposite)));
        let mut by_name = commanded.clone();
        by_name.sort_by_key(|&joint| &problem.joints[joint].name);
        if by_name != commanded {
            let words = "columns of all joints in the alphabetical order of the joints' names (as in \
                         ROS joint_states; name the columns after the joints)";
            misreadings.extend(ordered(words.to_owned(), moved(&by_name, &commanded)));
        }
        for by in 1..moving.len() {
            let mut from = commanded.clone();
            from.rotate_left(by % commanded.len().max(1));
            let places = if by == 1 { "place" } else { "places" };
            let words = format!("columns of the joints that are moved on by {by} {places}");
            let rotated = ordered(words, moved(&commanded, &from));
            misreadings.extend(rotated.map(|of| of.in_group("rotated")));
        }
    }
    for pair in choices(&moving[..moving.len().min(MAX_PAIRED)], 2) {
        let (joint, with) = (pair[0], pair[1]);
        if kind(joint) != kind(with) {
            let is_sliding = kind(joint) == JointKind::Prismatic;
            let (joint, from) = if is_sliding { (with, joint) } else { (joint, with) };
            let leads = SCREW_LEADS.iter().flat_map(|&lead| [lead, -lead]);
            misreadings.extend(leads.map(|lead| {
                let words =
                    format!("joint {joint} that also turns once per {lead} mm of joint {from}");
                let radians_per_metre = 2.0 * PI * 1e3 / f64::from(lead);
                Misreading::coupled(words, (joint, from), radians_per_metre, Kind::Screw)
            }));
            continue;
        }
        let words = format!("columns of joints {joint} and {with} that are exchanged");
        let order = ordered(words, exchanged(&[[joint, with]]));
        misreadings.extend(order.map(|of| of.of_kind(Kind::Usual)));
        for (joint, from) in [(joint, with), (with, joint)] {
            misreadings.extend([("", 1.0), ("minus ", -1.0)].map(|(sign, factor)| {
                let words =
                    format!("joint {joint} that also turns by {sign}the command of joint {from}");
                Misreading::coupled(words, (joint, from), factor, Kind::Coupled)
            }));
        }
    }
    let cycled: &[usize] = if turning.len() > MAX_CYCLED { &[] } else { &turning };
    for of in choices(cycled, 3) {
        for [a, b, c] in [[of[0], of[1], of[2]], [of[0], of[2], of[1]]] {
            let words = format!(
                "columns of joints {a}, {b} and {c} that hold the angles of joints {b}, {c} and {a}"
            );
            misreadings.extend(ordered(words, exchanged(&[[a, b], [a, c]])));
        }
    }
    let pairs = choices(cycled, 2);
    for (k, first) in pairs.iter().enumerate() {
        let apart = pairs[k + 1..].iter().filter(|pair| !pair.iter().any(|of| first.contains(of)));
        for second in apart {
            let [a, b, c, d] = [first[0], first[1], second[0], second[1]];
            let words = format!(
                "columns of joints {a} and {b} that are exchanged, and those of joints {c} and {d}"
            );
            misreadings.extend(ordered(words, exchanged(&[[a, b], [c, d]])));
        }
    }
    let steps = 180 / ZERO_POSITION_STEP;
    let angles = (1 - steps..=steps).filter(|&step| step != 0);
    for &joint in &turning {
        let zero = |step| Misreading::of_zero(joint, step * ZERO_POSITION_STEP);
        misreadings.extend(angles.clone().map(zero));
    }
    for &joint in &moving {
        misreadings.extend(TRIAL_RATIOS.map(|percent| of_ratio(problem, joint, percent)));
    }
    misreadings
}

/// Returns the misreading that a joint moves by a multiple of its command, in hundredths.
fn of_ratio(problem: &Problem, joint: usize, percent: i16) -> Misreading {
    let ratio = f64::from(percent) / 100.0;
    let words = format!("joint {joint} that turns by {ratio} times its command");
    let is_prismatic = problem.joints[joint - 1].kind == JointKind::Prismatic;
    let moves = if is_prismatic { "moves" } else { "turns" };
    let with_ratio = move |size: f64| {
        let unit = unit_of_ratio(size, is_prismatic);
        format!("joint {joint} that {moves} by {size:.4} times its command{unit}")
    };
    let parameter = format!("gear-ratio[{joint}].error");
    Misreading::of_factor(words, vec![joint - 1], ratio)
        .of_kind(Kind::Ratio(joint - 1))
        .in_group(format!("ratio {joint}"))
        .with_size(
            (parameter, Some(Effect::GearRatio { joint })),
            move |x| ratio * (1.0 + x),
            with_ratio,
        )
}

impl Misreading {
    /// Returns the effect with which the model fits the table as it was read, and the value of its
    /// parameter for a misreading of this `size`. `None` if there is no such effect, or if the size
    /// is the ratio of two units.
    pub(super) fn expressed(&self, size: f64) -> Option<(Effect, f64)> {
        let effect = self.size.as_ref()?.effect.clone()?;
        match effect {
            Effect::TrackerScale => Some((effect, size - 1.0)),
            Effect::GearRatio { .. } => (!is_unit_ratio(size)).then_some((effect, size - 1.0)),
            _ => Some((effect, size)),
        }
    }

    /// Creates the misreading of the unit or sign of the joints with these indices: their coordinates
    /// must be multiplied by a factor.
    fn of_factor(words: String, joints: Vec<usize>, factor: f64) -> Self {
        Self::of_commands(words, move |q| {
            for &joint in &joints {
                q.get_mut(joint).into_iter().for_each(|q| *q *= factor);
            }
        })
    }

    /// Creates the misreading of the order of columns: each joint has the coordinate of the joint with
    /// the index that `order` gives.
    fn of_column_order(words: String, order: Vec<usize>) -> Self {
        Self::of_commands(words, move |q| {
            let read = q.to_vec();
            for (q, &from) in q.iter_mut().zip(&order) {
                read.get(from).into_iter().for_each(|from| *q = *from);
            }
        })
    }

    /// Creates the misreading that the angles of the joints in a set of bits have the opposite sign.
    pub(super) fn reversed(joints: u64) -> Self {
        let (joint, count) =
            if joints.count_ones() > 1 { ("joints", "count") } else { ("joint", "counts") };
        let words = format!("{joint} {} that {count} the other way", listed_joints(joints));
        let places = numbers_of(joints).map(|joint| joint - 1).collect();
        Self::of_factor(words, places, -1.0).of_kind(Kind::Reversed(joints))
    }

    /// Creates the misreading that a joint also turns by the command of another one times a factor.
    fn coupled(words: String, (joint, from): (usize, usize), factor: f64, kind: Kind) -> Self {
        let parameter = format!("joint-coupling[{joint},{from}].factor");
        let with_size = move |size: f64| {
            if kind == Kind::Screw {
                format!(
                    "joint {joint} that also turns by {:.3}°/mm of joint {from} (as a ball screw \
                     does; declare joint-coupling)",
                    size.to_degrees() * 1e-3
                )
            } else {
                format!(
                    "joint {joint} that also turns by {size:.3} times the command of joint {from} \
                     (declare joint-coupling)"
                )
            }
        };
        Self::of_commands(words, move |q| q[joint - 1] += factor * q[from - 1])
            .of_kind(kind)
            .in_group(format!("coupling {joint} {from}"))
            .with_size(
                (parameter, Some(Effect::JointCoupling { joint, from })),
                move |x| factor + x,
                with_size,
            )
    }

    /// Creates the misreading that the zero position of a joint, counted from 1, is off by an angle
    /// \[°\].
    fn of_zero(joint: usize, degrees: i16) -> Self {
        let angle = f64::from(degrees).to_radians();
        let words = format!("joint {joint} whose zero position is {degrees}° off");
        Self::of_commands(words, move |q| q[joint - 1] += angle)
            .of_kind(Kind::Zero(joint, degrees))
            .in_group(format!("zero {joint}"))
            .with_size(
                (format!("joint{joint}.theta"), None),
                move |x| angle + x,
                move |size| {
                    format!("joint {joint} whose zero position is {:.2}° off", size.to_degrees())
                },
            )
    }

    /// Returns the misreadings that the zero positions of two joints are off by quarter turns.
    pub(super) fn of_two_zeros(joints: &[usize]) -> impl Iterator<Item = Self> {
        let (one, other) = (joints[0], joints[1]);
        let quarters = [1_i16, 2, -1];
        let turns = quarters.into_iter().flat_map(move |first| quarters.map(|of| [first, of]));
        turns.map(move |turns| {
            let [first, second] = turns.map(|quarters| 90 * quarters);
            let words = format!(
                "joints {one} and {other} whose zero positions are {first}° and {second}° off"
            );
            Self::of_commands(words, move |q| {
                for (joint, quarters) in [one, other].into_iter().zip(turns) {
                    q[joint - 1] += f64::from(quarters) * PI / 2.0;
                }
            })
            .in_group(format!("zeros {one} {other}"))
        })
    }
}

/// Returns true if a joint is revolute and its column was read as radians, or as degrees if
/// `radians` is false. Returns true for both if the unit of the column is not known.
fn turns_in(problem: &Problem, table: &Measurements, joint: usize, radians: bool) -> bool {
    let turns =
        problem.joints.get(joint).is_some_and(|joint| joint.command_kind() == JointKind::Revolute);
    let column = table.command_columns.iter().find(|column| column.joint == joint);
    turns && column.is_none_or(|column| (column.unit >= 1.0) == radians)
}

/// Returns the text about the unit of a joint's column that follows from a ratio of motion to
/// command. Empty if the ratio is not that of two units.
fn unit_of_ratio(ratio: f64, is_prismatic: bool) -> &'static str {
    let is = |other: f64| (ratio / other - 1.0).abs() < NAMED_UNIT_TOLERANCE;
    if is_prismatic && is(1e-3) {
        " (its column is in millimetres, declared in metres)"
    } else if is_prismatic && is(1e3) {
        " (its column is in metres, declared in millimetres)"
    } else if !is_prismatic && is(180.0 / PI) {
        " (its column is in radians, declared in degrees)"
    } else if !is_prismatic && is(PI / 180.0) {
        " (its column is in degrees, declared in radians)"
    } else {
        ""
    }
}

/// Lists the numbers of a set of joints: "1, 2 and 4".
fn listed_joints(joints: u64) -> String {
    let numbers: Vec<String> = numbers_of(joints).map(|joint| joint.to_string()).collect();
    match numbers.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => numbers.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_all_different() {
        assert_eq!(choices(&[1, 2, 3], 2), [[1, 2], [1, 3], [2, 3]]);
        assert_eq!(choices(&[1, 2, 3, 4, 5], 3).len(), 10);
    }
}
