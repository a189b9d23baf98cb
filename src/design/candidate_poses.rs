//! Candidate poses: random draws from ranges and variations of given poses.

use std::path::PathBuf;

use nalgebra::Vector3;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::DesignError;
use crate::measurement::{Labels, Measurements};
use crate::numeric::range;
use crate::problem::{Joint, JointKind, PoseRanges, Problem};
use crate::random;

/// Resolution to which commanded angles are rounded [°].
const ANGLE_STEP: f64 = 1e-4;
/// Resolution to which commanded lengths are rounded \[m\].
const LENGTH_STEP: f64 = 1e-6;
/// Offset of the random stream of temperatures and covariates. A separate stream leaves the drawn
/// poses unchanged if these quantities are added.
const SETTINGS_STREAM: u64 = 1 << 32;
/// Resolution to which commanded forces \[N\] and temperatures [°C] are rounded.
const SETTING_STEP: f64 = 0.1;

/// Frequency with which drawn quantities lie at a limit of their range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Extremes {
    /// Poses are drawn uniformly: every joint, load and temperature within its range.
    No,
    /// Every quantity is at one of its limits with probability one half.
    Often,
}

impl PoseRanges {
    /// Returns the joint limits that the problem declares, as ranges of poses without payloads and
    /// other conditions.
    ///
    /// # Errors
    /// Returns an error if a moving joint lacks a limit.
    pub fn of(problem: &Problem) -> Result<Self, DesignError> {
        for joint in problem.joints.iter().filter(|joint| joint.takes_command()) {
            for (end, limit) in [("min", joint.limits.0), ("max", joint.limits.1)] {
                if !limit.is_finite() {
                    return Err(DesignError::no_range(joint, end));
                }
            }
        }
        let joints = problem.joints.iter().map(|joint| joint.limits).collect();
        Ok(Self { joints, ..Self::default() })
    }

    /// Returns the joint limits that the problem declares, and the range of the commands in `rows`
    /// for joints that lack one. The payloads are those of the rows.
    #[doc(hidden)]
    pub fn declared_or_measured(problem: &Problem, rows: &Measurements) -> Self {
        let of_joint = |(k, joint): (usize, &Joint)| {
            let values = (0..rows.len()).map(|row| rows.configuration(row)[k]);
            let (low, high) = range(values);
            let (from, to) = joint.limits;
            if from.is_finite() && to.is_finite() { (from, to) } else { (low, high) }
        };
        let mut payloads = rows.payload.clone().unwrap_or_default();
        payloads.sort_by(f64::total_cmp);
        payloads.dedup();
        let joints = problem.joints.iter().enumerate().map(of_joint).collect();
        let measured = |of: &Option<Vec<f64>>| of.as_ref().map(|of| range(of.iter().copied()));
        let (hoist, temperature) = (measured(&rows.hoist), measured(&rows.temperature));
        Self { joints, payloads, hoist, temperature, ..Self::default() }.relevant_to(problem)
    }

    /// Draws `count` poses from the ranges; measured positions are set to 0. A larger count leaves
    /// the first poses unchanged. Quantities are independent, and targets alternate from row to
    /// row.
    #[doc(hidden)]
    pub fn draw(
        &self,
        problem: &Problem,
        count: usize,
        extremes: Extremes,
        seed: u64,
        stream: u64,
    ) -> Measurements {
        let (mut random, mut settings) =
            (random::stream(seed, stream), random::stream(seed, SETTINGS_STREAM + stream));
        let value = |random: &mut ChaCha8Rng, (from, to): (f64, f64)| {
            let (kind, within) = (random.random::<f64>(), random.random::<f64>());
            match extremes {
                Extremes::Often if kind < 0.25 => from,
                Extremes::Often if kind < 0.5 => to,
                _ => from + (to - from) * within,
            }
        };
        let mut drawn = PoseTable::new(self, problem);
        for pose in 0..count {
            let joints = self.joints.iter().map(|&range| value(&mut random, range)).collect();
            let choice = value(&mut random, (0.0, 1.0));
            let hoist = self.hoist.map(|range| value(&mut random, range));
            let temperature = self.temperature.map(|range| value(&mut settings, range));
            let covariates =
                self.covariates.iter().map(|&range| value(&mut settings, range)).collect();
            let sides = self.joints.iter().map(|_| random.random()).collect();
            let target = pose % problem.targets.len().max(1);
            drawn.push(
                problem,
                &Draft { joints, choice, hoist, temperature, covariates, sides, target },
            );
        }
        drawn.finish()
    }

    /// Returns each row of `poses` followed by `count` variations of it. A variation changes each
    /// quantity with probability one half by up to `reach` times its range, and sometimes changes
    /// payload or approach side.
    pub(super) fn vary(
        &self,
        problem: &Problem,
        poses: &Measurements,
        count: usize,
        reach: f64,
        (seed, stream): (u64, u64),
    ) -> Measurements {
        let mut random = random::stream(seed, stream);
        let mut drawn = PoseTable::new(self, problem);
        for row in 0..poses.len() {
            let base = Draft::of(self, poses, row);
            drawn.push(problem, &base);
            for _ in 0..count {
                let mut next = base.clone();
                let mut vary = |value: &mut f64, (from, to): (f64, f64)| {
                    let (moves, step) =
                        (random.random::<bool>(), 2.0 * random.random::<f64>() - 1.0);
                    if moves {
                        *value = (*value + step * reach * (to - from)).clamp(from, to);
                    }
                };
                next.joints.iter_mut().zip(&self.joints).for_each(|(q, &range)| vary(q, range));
                next.hoist
                    .iter_mut()
                    .zip(&self.hoist)
                    .for_each(|(force, &range)| vary(force, range));
                next.temperature
                    .iter_mut()
                    .zip(&self.temperature)
                    .for_each(|(degrees, &range)| vary(degrees, range));
                next.covariates
                    .iter_mut()
                    .zip(&self.covariates)
                    .for_each(|(value, &range)| vary(value, range));
                if random.random::<f64>() < 0.25 {
                    next.choice = random.random();
                }
                for side in &mut next.sides {
                    *side ^= random.random::<f64>() < 0.25;
                }
                drawn.push(problem, &next);
            }
        }
        drawn.finish()
    }
}

/// Drawn pose before rounding to command steps.
#[derive(Clone)]
struct Draft {
    /// Joint coordinates \[rad\] or \[m\].
    joints: Vec<f64>,
    /// Position in the list of payloads, from 0 (first payload) to 1 (last payload).
    choice: f64,
    /// Hoist force \[N\]; `None` without a range of it.
    hoist: Option<f64>,
    /// Temperature [°C]; `None` without a range of it.
    temperature: Option<f64>,
    /// Values of the covariates of the problem, in their units.
    covariates: Vec<f64>,
    /// For each joint, true if its column `approach` is 1, false if it is −1.
    sides: Vec<bool>,
    /// Index of the target of the tool that is measured in this pose, from 0.
    target: usize,
}

impl Draft {
    /// Returns a row that was drawn from these ranges as a draft, with the rounded values.
    fn of(ranges: &PoseRanges, poses: &Measurements, row: usize) -> Self {
        let in_row = |column: &Option<Vec<f64>>| column.as_ref().map(|values| values[row]);
        let index = in_row(&poses.payload).and_then(|mass| {
            ranges.payloads.iter().position(|&payload| payload.to_bits() == mass.to_bits())
        });
        let n = poses.joints;
        let sides = poses.approach.as_ref().map_or_else(
            || vec![false; n],
            |sides| sides[row * n..(row + 1) * n].iter().map(|&side| side > 0.0).collect(),
        );
        Self {
            joints: poses.configuration(row).to_vec(),
            choice: (index.unwrap_or(0) as f64 + 0.5) / ranges.payloads.len().max(1) as f64,
            hoist: in_row(&poses.hoist),
            temperature: in_row(&poses.temperature),
            covariates: poses.covariates_of(row).to_vec(),
            sides,
            target: poses.target.as_ref().map_or(0, |target| target.of_row[row]),
        }
    }
}

/// Table under construction of poses rounded to command steps.
struct PoseTable<'a> {
    ranges: &'a PoseRanges,
    rows: Measurements,
}

impl<'a> PoseTable<'a> {
    fn new(ranges: &'a PoseRanges, problem: &Problem) -> Self {
        let names: Vec<String> = problem.targets.iter().map(|target| target.name.clone()).collect();
        let rows = Measurements {
            files: vec![PathBuf::from("plan.csv")],
            joints: problem.joints.len(),
            payload: (!ranges.payloads.is_empty()).then(Vec::new),
            hoist: ranges.hoist.map(|_| Vec::new()),
            temperature: ranges.temperature.map(|_| Vec::new()),
            approach: ranges.approach.then(Vec::new),
            session: Labels { names: vec![String::new()], of_row: Vec::new() },
            target: (!names.is_empty()).then_some(Labels { names, of_row: Vec::new() }),
            ..Measurements::default()
        };
        Self { ranges, rows }
    }

    /// Rounds a drawn pose and appends it.
    fn push(&mut self, problem: &Problem, draft: &Draft) {
        let Self { ranges, rows } = self;
        for (k, joint) in problem.joints.iter().enumerate() {
            let ((from, to), q) = (ranges.joints[k], draft.joints[k]);
            let q = match joint.command_kind() {
                JointKind::Fixed => 0.0,
                JointKind::Prismatic => rounded(q, LENGTH_STEP, (from, to)),
                JointKind::Revolute => {
                    rounded(q.to_degrees(), ANGLE_STEP, (from.to_degrees(), to.to_degrees()))
                        .to_radians()
                }
            };
            rows.configurations.push(q);
            rows.approach.iter_mut().for_each(|column| {
                column.push(match joint.command_kind() {
                    JointKind::Fixed => 0.0,
                    _ if draft.sides[k] => 1.0,
                    _ => -1.0,
                });
            });
        }
        let choices = ranges.payloads.len();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rounded down to an index"
        )]
        let choice = (draft.choice * choices as f64) as usize;
        let payload = ranges.payloads.get(choice.min(choices.saturating_sub(1)));
        let set = |value: Option<f64>, range: Option<(f64, f64)>| {
            Some(rounded(value?, SETTING_STEP, range?))
        };
        for (column, value) in [
            (&mut rows.payload, payload.copied()),
            (&mut rows.hoist, set(draft.hoist, ranges.hoist)),
            (&mut rows.temperature, set(draft.temperature, ranges.temperature)),
        ] {
            if let Some(column) = column {
                column.extend(value);
            }
        }
        rows.covariates.extend(&draft.covariates);
        rows.target.iter_mut().for_each(|target| target.of_row.push(draft.target));
        rows.session.of_row.push(0);
        rows.positions.push(Vector3::zeros());
    }

    /// Returns the table, with the row index as time \[s\].
    fn finish(self) -> Measurements {
        let count = self.rows.len();
        Measurements {
            origin: (2_u32..).take(count).map(|line| (0, line)).collect(),
            time: (0_u32..).take(count).map(f64::from).collect(),
            ..self.rows
        }
    }
}

/// Returns the multiple of `step` nearest to `value`, or `value` if that leaves the range.
fn rounded(value: f64, step: f64, (from, to): (f64, f64)) -> f64 {
    let steps = step.recip().round();
    let rounded = (value * steps).round() / steps;
    if (from..=to).contains(&rounded) { rounded } else { value }
}
