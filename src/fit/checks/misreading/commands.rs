//! Misreadings of the columns of joints: their candidates and corrections.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use super::{Misreading, numbers_of, power_of_ten};
use crate::measurement::Measurements;
use crate::problem::{Joint, JointKind, Problem};

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
/// Number that stands for the 2000 π milliradians of a turn.
pub(super) const MILLIRADIANS: u32 = 6283;
/// Numbers of units to a turn, of units that are taken for degrees: turns, degrees divided by 60,
/// gradians, tenths and hundredths of a degree, milliradians, minutes and seconds of arc,
/// and usual numbers of counts of encoders.
pub(super) const TURN_UNITS: [u32; 25] = [
    1,
    6,
    MILLIRADIANS,
    21_600,
    1_296_000,
    400,
    1000,
    1024,
    2000,
    2048,
    2500,
    3600,
    4000,
    4096,
    5000,
    8000,
    8192,
    10_000,
    16_384,
    32_768,
    36_000,
    65_536,
    131_072,
    262_144,
    1_048_576,
];
/// Maximum number of joints in another unit than the rest of which every subset is tried.
const MAX_SUBSETS: usize = 4;
/// Maximum number of joints of which every three are tried as exchanged in a ring.
const MAX_CYCLED: usize = 7;
/// Usual leads of ball screws \[mm\]. A full fit finds values near them.
const SCREW_LEADS: [i16; 12] = [4, 5, 6, 8, 10, 12, 16, 20, 25, 32, 40, 50];

/// Returns the misreadings that some turning joints alone are in radians, declared as degrees, or the
/// reverse: those whose commands are as small, or as large, as such numbers read.
pub(super) fn of_mixed_units(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
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
        sets.into_iter().map(move |joints| Misreading::MixedUnits { joints, is_radians })
    });
    sets.collect()
}

/// Returns the misreadings that three of the joints are exchanged in a ring, in either direction.
fn of_rings(joints: &[usize]) -> impl Iterator<Item = Misreading> {
    let joints = if joints.len() > MAX_CYCLED { &[] } else { joints };
    let triples = joints.iter().enumerate().flat_map(move |(k, &a)| {
        let later = &joints[k + 1..];
        let pairs = later
            .iter()
            .enumerate()
            .flat_map(move |(l, &b)| later[l + 1..].iter().map(move |&c| (b, c)));
        pairs.map(move |(b, c)| (a, b, c))
    });
    triples.flat_map(|(a, b, c)| [[a, b, c], [a, c, b]].map(|joints| Misreading::Cycled { joints }))
}

/// Returns the misreadings that two pairs of the joints are exchanged.
fn of_pairs(joints: &[usize]) -> Vec<Misreading> {
    let joints = if joints.len() > MAX_CYCLED { &[] } else { joints };
    let pairs = joints
        .iter()
        .enumerate()
        .flat_map(|(k, &joint)| joints[k + 1..].iter().map(move |&with| [joint, with]));
    let pairs: Vec<[usize; 2]> = pairs.collect();
    let of_first = |(k, &[a, b]): (usize, &[usize; 2])| {
        let apart =
            pairs[k + 1..].iter().filter(move |pair| !pair.contains(&a) && !pair.contains(&b));
        apart.map(move |&[c, d]| Misreading::ExchangedPairs { joints: [a, b, c, d] }).collect()
    };
    pairs.iter().enumerate().flat_map::<Vec<_>, _>(of_first).collect()
}

/// Returns the misreadings of the joint columns: signs, exchanged columns, couplings, zero
/// positions and ratios.
pub(super) fn of_commands(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let kind = |joint: usize| problem.joints[joint - 1].command_kind();
    let moving: Vec<usize> = (1..=problem.joints.len().min(64))
        .filter(|&joint| kind(joint) != JointKind::Fixed)
        .collect();
    let is_ordered = moving.len() > 3 && moving.iter().all(|&joint| kind(joint) == kind(moving[0]));
    let turning = moving.iter().copied().filter(|&joint| kind(joint) == JointKind::Revolute);
    let turning: Vec<usize> = turning.collect();
    let mut misreadings: Vec<Misreading> =
        moving.iter().map(|&joint| Misreading::reversed(&[joint])).collect();
    misreadings.extend(is_ordered.then_some(Misreading::OppositeOrder));
    let is_alphabetical = by_name(problem).is_sorted();
    misreadings.extend((is_ordered && !is_alphabetical).then_some(Misreading::Alphabetical));
    let places = if is_ordered { moving.len() } else { 1 };
    misreadings.extend((1..places).map(|by| Misreading::Rotated { by }));
    for (k, &joint) in moving.iter().enumerate().take(MAX_PAIRED) {
        for &with in &moving[k + 1..moving.len().min(MAX_PAIRED)] {
            if kind(joint) != kind(with) {
                let is_sliding = kind(joint) == JointKind::Prismatic;
                let (joint, from) = if is_sliding { (with, joint) } else { (joint, with) };
                let screw = |lead| Misreading::Screw { joint, from, lead };
                misreadings.extend(SCREW_LEADS.iter().flat_map(|&lead| [lead, -lead].map(screw)));
                continue;
            }
            misreadings.push(Misreading::Exchanged { joint, with });
            for (joint, from) in [(joint, with), (with, joint)] {
                let coupled = |is_opposite| Misreading::Coupled { joint, from, is_opposite };
                misreadings.extend([false, true].map(coupled));
            }
        }
    }
    misreadings.extend(of_rings(&turning));
    misreadings.extend(of_pairs(&turning));
    keep_different_orders(&mut misreadings, problem, table);
    for &joint in &turning {
        let steps =
            (1 - 180 / ZERO_POSITION_STEP..=180 / ZERO_POSITION_STEP).filter(|&step| step != 0);
        misreadings.extend(
            steps.map(|step| Misreading::Zero { joint, degrees: step * ZERO_POSITION_STEP }),
        );
    }
    for &joint in &moving {
        misreadings.extend(TRIAL_RATIOS.map(|percent| Misreading::Ratio { joint, percent }));
    }
    misreadings
}

/// Removes exchanges of columns that give the same order as an earlier one.
fn keep_different_orders(of: &mut Vec<Misreading>, problem: &Problem, table: &Measurements) {
    use Misreading::{Alphabetical, Cycled, Exchanged, ExchangedPairs, OppositeOrder, Rotated};
    let mut orders = Vec::new();
    of.retain(|misreading| {
        let exchanges = matches!(
            misreading,
            OppositeOrder
                | Alphabetical
                | Rotated { .. }
                | Exchanged { .. }
                | Cycled { .. }
                | ExchangedPairs { .. }
        );
        let mut order: Vec<f64> = (0_u16..).map(f64::from).take(problem.joints.len()).collect();
        misreading.undo_command(&mut order, problem, table);
        let is_new = !exchanges || !orders.contains(&order);
        orders.extend((exchanges && is_new).then_some(order));
        is_new
    });
}

/// Returns the indices of the joints that take commands, in the alphabetical order of their names.
pub(super) fn by_name(problem: &Problem) -> Vec<usize> {
    let moves = |joint: &usize| problem.joints[*joint].command_kind() != JointKind::Fixed;
    let mut joints: Vec<usize> = (0..problem.joints.len()).filter(moves).collect();
    joints.sort_by_key(|&joint| &problem.joints[joint].name);
    joints
}

/// Returns true if a joint is revolute and its column was read as radians, or as degrees if
/// `radians` is false. Returns true for both if the unit of the column is not known.
pub(super) fn turns_in(
    problem: &Problem,
    table: &Measurements,
    joint: usize,
    radians: bool,
) -> bool {
    let turns =
        problem.joints.get(joint).is_some_and(|joint| joint.command_kind() == JointKind::Revolute);
    let column = table.command_columns.iter().find(|column| column.joint == joint);
    turns && column.is_none_or(|column| (column.unit >= 1.0) == radians)
}

impl Misreading {
    /// Corrects the misreading in a configuration `q` of `table`.
    pub(super) fn undo_command(self, q: &mut [f64], problem: &Problem, table: &Measurements) {
        match self {
            Self::Degrees | Self::Radians | Self::TurnUnit { .. } => {
                let (factor, is_radians) = match self {
                    Self::Degrees => (PI / 180.0, true),
                    Self::TurnUnit { per_turn: MILLIRADIANS } => (0.18 / PI, false),
                    Self::TurnUnit { per_turn } => (360.0 / f64::from(per_turn), false),
                    _ => (180.0 / PI, false),
                };
                let turning = (0..q.len()).filter(|&j| turns_in(problem, table, j, is_radians));
                turning.for_each(|joint| q[joint] *= factor);
            }
            Self::Slides { power } => {
                let slides = |joint: &usize| {
                    let kind = problem.joints.get(*joint).map(Joint::command_kind);
                    kind == Some(JointKind::Prismatic)
                };
                (0..q.len()).filter(slides).for_each(|joint| q[joint] *= power_of_ten(power));
            }
            Self::OppositeOrder | Self::Rotated { .. } => {
                let commanded: Vec<usize> = (0..q.len().min(problem.joints.len()))
                    .filter(|&joint| problem.joints[joint].command_kind() != JointKind::Fixed)
                    .collect();
                let mut values: Vec<f64> = commanded.iter().map(|&joint| q[joint]).collect();
                match self {
                    Self::Rotated { by } => values.rotate_left(by % commanded.len().max(1)),
                    _ => values.reverse(),
                }
                commanded.iter().zip(values).for_each(|(&joint, value)| q[joint] = value);
            }
            Self::Alphabetical => {
                let sorted = by_name(problem);
                let mut commanded = sorted.clone();
                commanded.sort_unstable();
                let values: Vec<f64> = commanded.iter().map(|&joint| q[joint]).collect();
                sorted.iter().zip(values).for_each(|(&joint, value)| q[joint] = value);
            }
            Self::Reversed { joints } => {
                numbers_of(joints).for_each(|joint| q[joint - 1] = -q[joint - 1]);
            }
            Self::MixedUnits { joints, is_radians } => {
                let factor = if is_radians { 180.0 / PI } else { PI / 180.0 };
                numbers_of(joints).for_each(|joint| q[joint - 1] *= factor);
            }
            Self::Cycled { joints: [first, second, third] } => {
                q.swap(first - 1, second - 1);
                q.swap(first - 1, third - 1);
            }
            Self::Exchanged { joint, with } => q.swap(joint - 1, with - 1),
            Self::ExchangedPairs { joints: [a, b, c, d] } => {
                q.swap(a - 1, b - 1);
                q.swap(c - 1, d - 1);
            }
            Self::Coupled { joint, from, is_opposite } => {
                let sign = if is_opposite { -1.0 } else { 1.0 };
                q[joint - 1] += sign * q[from - 1];
            }
            Self::Screw { joint, from, lead } => {
                q[joint - 1] += radians_per_metre(lead) * q[from - 1];
            }
            Self::Zero { joint, degrees } => q[joint - 1] += f64::from(degrees).to_radians(),
            Self::Zeros { joints, quarters } => {
                joints.iter().zip(quarters).for_each(|(joint, quarters)| {
                    q[joint - 1] += f64::from(quarters) * PI / 2.0;
                });
            }
            Self::Ratio { joint, percent } => q[joint - 1] *= f64::from(percent) / 100.0,
            _ => {}
        }
    }
}

/// Returns the rotation of a screw divided by its travel \[rad/m\], given its lead \[mm\].
pub(super) fn radians_per_metre(lead: i16) -> f64 {
    2.0 * PI * 1e3 / f64::from(lead)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_pairs_of_joints_are_disjoint() {
        let pairs = of_pairs(&[1, 2, 3, 4, 5]);
        assert_eq!(pairs.len(), 15);
        assert!(pairs.contains(&Misreading::ExchangedPairs { joints: [1, 2, 3, 5] }));
        for pair in pairs {
            let Misreading::ExchangedPairs { joints } = pair else { panic!() };
            assert_eq!(BTreeSet::from(joints).len(), 4, "{joints:?}");
        }
    }
}
