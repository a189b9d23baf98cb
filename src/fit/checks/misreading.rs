//! Search for misread units, signs or orders that would explain why the nominal arm misses its
//! measurements.

use std::f64::consts::PI;
use std::fmt;

use crate::fit::Placement;
use crate::fit::stages::fitting::Fitting;
use crate::least_squares::LinearisationCache;
use crate::measurement::{Measurements, Split};
use crate::model::Model;
use crate::problem::{Joint, JointKind, Problem};

/// Largest error with a misreading corrected, relative to the error as read, at which the
/// misreading is an explanation.
const EXPLAINED: f64 = 0.2;
/// Largest ratio to the smallest error at which a misreading is named in addition to the best one.
const AS_GOOD: f64 = 1.5;
/// Largest error, as a multiple of the arm's reach, at which misreadings are tried. Millimetres
/// read as metres give a factor of 1000.
const MAX_REACHES: f64 = 1e4;
/// Maximum number of rows on which misreadings are tried.
const MAX_ROWS: usize = 200;
/// Maximum number of moving joints of which every subset is tried as reversed.
const MAX_REVERSED: usize = 7;
/// Smallest declared length that may be a number of millimetres \[m\].
const LONG: f64 = 1.0;

/// Misreading: a quantity that may have been declared in the wrong unit, sign or order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Misreading {
    /// Joint angles are in degrees, declared as radians.
    Degrees,
    /// Joint angles are in radians, declared as degrees.
    Radians,
    /// Positions are in metres, declared as millimetres.
    Metres,
    /// Positions are in millimetres, declared as metres.
    Millimetres,
    /// Positions are in a left-handed frame: two coordinates are exchanged, or one has the wrong
    /// sign.
    Mirrored,
    /// Joints whose measured angle has the opposite sign.
    Reversed {
        /// Set of joints: bit k is joint k + 1.
        joints: u64,
    },
    /// The target of `[tool]` is in millimetres, declared as metres.
    TargetInMillimetres,
    /// Lengths of joints are in millimetres, declared as metres; likewise a target longer than 1 m.
    ArmInMillimetres,
}

impl fmt::Display for Misreading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Degrees => f.write_str("joint angles that are degrees, declared as radians"),
            Self::Radians => f.write_str("joint angles that are radians, declared as degrees"),
            Self::Metres => f.write_str("positions that are metres, declared as millimetres"),
            Self::Millimetres => f.write_str("positions that are millimetres, declared as metres"),
            Self::Mirrored => {
                f.write_str("two of x, y and z that are exchanged, or one of the other sign")
            }
            Self::Reversed { joints } => {
                let numbers: Vec<String> =
                    numbers_of(*joints).map(|joint| joint.to_string()).collect();
                match numbers.as_slice() {
                    [joint] => write!(f, "joint {joint} that counts the other way"),
                    [first @ .., last] => {
                        write!(f, "joints {} and {last} that count the other way", first.join(", "))
                    }
                    [] => Ok(()),
                }
            }
            Self::TargetInMillimetres => {
                f.write_str("a target of [tool] that is in millimetres, declared in metres")
            }
            Self::ArmInMillimetres => {
                f.write_str("lengths of joints that are in millimetres, declared in metres")
            }
        }
    }
}

/// Returns the numbers, counted from 1, of the joints in a set.
fn numbers_of(joints: u64) -> impl Iterator<Item = usize> {
    (0..64).filter(move |joint| joints >> joint & 1 == 1).map(|joint| joint + 1)
}

impl Misreading {
    /// Creates the misreading that the signs of these joints, counted from 1, are reversed.
    pub fn reversed(joints: &[usize]) -> Self {
        Self::Reversed { joints: joints.iter().map(|joint| 1 << (joint - 1)).sum() }
    }

    /// Returns every misreading that is possible for the problem and the columns of its table.
    fn all(problem: &Problem, rows: &Measurements) -> Vec<Self> {
        let turns = |radians| {
            (0..problem.joints.len()).any(|joint| turns_in(problem, rows, joint, radians))
        };
        let lengths = |metres| rows.position_unit.is_none_or(|unit| (unit >= 1.0) == metres);
        let long = problem
            .joints
            .iter()
            .any(|joint| lengths_of(&mut joint.clone()).iter().any(|length| length.abs() > LONG));
        let mut all = Vec::new();
        all.extend(turns(true).then_some(Self::Degrees));
        all.extend(turns(false).then_some(Self::Radians));
        all.extend(lengths(false).then_some(Self::Metres));
        all.extend(lengths(true).then_some(Self::Millimetres));
        all.push(Self::Mirrored);
        all.extend(is_far(problem).then_some(Self::TargetInMillimetres));
        all.extend(long.then_some(Self::ArmInMillimetres));
        let moving = (1..)
            .zip(&problem.joints)
            .filter(|(_, joint)| joint.command_kind() != JointKind::Fixed);
        all.extend(
            moving.filter(|(joint, _)| *joint <= 64).map(|(joint, _)| Self::reversed(&[joint])),
        );
        all
    }

    /// Returns the problem with the misreading corrected; `None` if the misreading concerns the
    /// table.
    fn rewritten(self, problem: &Problem) -> Option<Problem> {
        let mut problem = problem.clone();
        match self {
            Self::TargetInMillimetres => {}
            Self::ArmInMillimetres => {
                for length in problem
                    .joints
                    .iter_mut()
                    .flat_map(lengths_of)
                    .filter(|length| length.abs() > LONG)
                {
                    *length *= 1e-3;
                }
            }
            _ => return None,
        }
        if is_far(&problem) {
            problem.tool.target *= 1e-3;
        }
        Some(problem)
    }

    /// Corrects the misreading in `rows`.
    fn mend(self, rows: &mut Measurements, problem: &Problem) {
        let (factor, chosen): (f64, &dyn Fn(usize) -> bool) = match self {
            Self::Degrees => (PI / 180.0, &|joint| turns_in(problem, rows, joint, true)),
            Self::Radians => (180.0 / PI, &|joint| turns_in(problem, rows, joint, false)),
            Self::Reversed { joints } => {
                (-1.0, &move |joint| joint < 64 && joints >> joint & 1 == 1)
            }
            _ => (1.0, &|_| false),
        };
        let chosen: Vec<bool> = (0..problem.joints.len()).map(chosen).collect();
        let read = rows.configurations.iter_mut().zip(chosen.iter().cycle());
        read.filter(|(_, chosen)| **chosen).for_each(|(q, _)| *q *= factor);
        match self {
            Self::Metres => rows.positions.iter_mut().for_each(|position| *position *= 1e3),
            Self::Millimetres => rows.positions.iter_mut().for_each(|position| *position *= 1e-3),
            Self::Mirrored => {
                rows.positions.iter_mut().for_each(|position| position.swap_rows(0, 1));
            }
            _ => {}
        }
    }

    /// Returns the root mean squared error of the registered nominal arm with this misreading
    /// corrected \[m\].
    fn rms(
        self,
        fitting: &Fitting,
        problem: &Problem,
        rows: &Measurements,
        split: &Split,
    ) -> Option<f64> {
        let mut mended = rows.clone();
        self.mend(&mut mended, problem);
        let other;
        let model = if let Some(problem) = self.rewritten(problem) {
            other =
                Model::new(&problem, &fitting.placement.bases, &fitting.placement.targets).ok()?;
            &other
        } else {
            fitting.model
        };
        let placement = &Placement::of(rows);
        let held_out_only = placement.held_out_only(model, rows, split);
        // Linearisations of another model are not those of this one.
        let cache = &LinearisationCache::default();
        let fitting = Fitting {
            model,
            measurements: &mended,
            split,
            placement,
            held_out_only,
            turn_sigma: None,
            cache,
            linear_model: None,
            ..*fitting
        };
        let registered = fitting.registered().ok()?;
        Some(fitting.errors(&registered).identification.rms.norm)
    }
}

/// Returns true if a joint is revolute and its column is in radians (if `radians`), else in
/// degrees. Without a declared unit, both are possible.
fn turns_in(problem: &Problem, rows: &Measurements, joint: usize, radians: bool) -> bool {
    let turns =
        problem.joints.get(joint).is_some_and(|joint| joint.command_kind() == JointKind::Revolute);
    let column = rows.command_columns.iter().find(|column| column.joint == joint);
    turns && column.is_none_or(|column| (column.unit >= 1.0) == radians)
}

/// Returns the declared lengths of a joint \[m\]: a, d and the translation of its placement.
fn lengths_of(joint: &mut Joint) -> Vec<&mut f64> {
    let placement = joint.placement.as_mut().map(|placement| placement.xyz.iter_mut());
    [&mut joint.a, &mut joint.d].into_iter().chain(placement.into_iter().flatten()).collect()
}

/// Returns true if the target of `[tool]` is so far from its frame that its coordinates may be in
/// millimetres.
fn is_far(problem: &Problem) -> bool {
    problem.targets.is_empty() && problem.tool.target.norm() > LONG
}

/// Returns the misreadings that explain, each alone, why the registered nominal arm has the error
/// `rms` \[m\]; best first.
pub(in crate::fit) fn misreadings(
    fitting: &Fitting,
    problem: &Problem,
    rms: f64,
) -> Vec<Misreading> {
    if rms.is_nan() || rms > MAX_REACHES * fitting.model.reach() {
        return Vec::new();
    }
    let identification = &fitting.split.identification;
    let chosen: Vec<usize> = identification
        .iter()
        .copied()
        .step_by(identification.len().div_ceil(MAX_ROWS).max(1))
        .collect();
    let rows = fitting.measurements.select(&chosen);
    let split = Split { identification: (0..rows.len()).collect(), held_out: Vec::new() };
    let error = |misreading: Misreading| {
        Some((misreading, misreading.rms(fitting, problem, &rows, &split)?))
    };
    // Contacts with one point agree with every arm that hardly moves.
    let is_tested = |misreading: &Misreading| {
        rows.leading().is_position() || matches!(misreading, Misreading::Reversed { .. })
    };
    let explains = |found: &(Misreading, f64)| found.1 < EXPLAINED * rms;
    let singles: Vec<Misreading> =
        Misreading::all(problem, &rows).into_iter().filter(is_tested).collect();
    let mut explained: Vec<(Misreading, f64)> =
        singles.iter().copied().filter_map(error).filter(explains).collect();
    if explained.is_empty() {
        explained.extend(several_reversed(&singles, error).filter(explains));
    }
    explained.sort_by(|a, b| a.1.total_cmp(&b.1));
    let best = explained.first().map_or(0.0, |found| found.1);
    explained
        .into_iter()
        .filter(|(_, left)| *left <= AS_GOOD * best)
        .map(|(found, _)| found)
        .collect()
}

/// Returns the set of at least two joints whose reversal leaves the smallest error, with that
/// error. Among sets with about the same error, it is the one with the fewest joints.
fn several_reversed(
    singles: &[Misreading],
    error: impl Fn(Misreading) -> Option<(Misreading, f64)>,
) -> impl Iterator<Item = (Misreading, f64)> {
    let joints: Vec<u64> = singles
        .iter()
        .filter_map(|misreading| match misreading {
            Misreading::Reversed { joints } => Some(*joints),
            _ => None,
        })
        .take(MAX_REVERSED)
        .collect();
    let set = |bits: u64| -> u64 {
        joints.iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1).map(|(_, joint)| joint).sum()
    };
    let sets = (1..1_u64 << joints.len()).filter(|bits| bits.count_ones() > 1).map(set);
    let sets = sets.filter_map(|joints| error(Misreading::Reversed { joints }));
    let errors: Vec<(Misreading, f64)> = sets.collect();
    let best = errors.iter().map(|(_, error)| *error).fold(f64::INFINITY, f64::min);
    let size = |found: &(Misreading, f64)| match found.0 {
        Misreading::Reversed { joints } => joints.count_ones(),
        _ => 0,
    };
    errors
        .into_iter()
        .filter(move |(_, error)| *error <= AS_GOOD * best)
        .min_by_key(size)
        .into_iter()
}
