//! Rows that repeat a pose.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::Measurements;
use crate::problem::{Effect, JointKind, Observation, Problem};

/// Configurations agree where each angle does to this \[rad\].
const ANGLE_STEP: f64 = 0.01 * std::f64::consts::PI / 180.0;
/// Configurations agree where each length does to this \[m\].
const LENGTH_STEP: f64 = 1e-4;
/// Payloads and hoist forces agree where they do to this part of the largest.
const LOAD_STEP: f64 = 0.01;
/// Temperatures agree where they do to this \[K\].
const TEMPERATURE_STEP: f64 = 1.0;
/// Numbers of words and directions agree where they are the same.
const SAME: f64 = 0.5;

impl Measurements {
    /// The configuration of each row and how many there are, numbered in an order that is not that
    /// of the rows: by session, by pose number and time where they were written down, then by what
    /// was measured.
    pub(super) fn configurations(&self, problem: &Problem) -> (Vec<usize>, usize) {
        let mut order: Vec<usize> = (0..self.len()).collect();
        let keys: Vec<_> = order.iter().map(|&row| self.key(row)).collect();
        let compare = |a: &(&str, Vec<f64>), b: &(&str, Vec<f64>)| {
            let numbers = a.1.iter().zip(&b.1).map(|(a, b)| a.total_cmp(b));
            a.0.cmp(b.0).then(numbers.fold(Ordering::Equal, Ordering::then))
        };
        order.sort_by(|&a, &b| compare(&keys[a], &keys[b]));
        numbered(&self.joint_columns(problem), &order)
    }

    /// By what rows are ordered: session, pose number, time, configuration, position.
    fn key(&self, row: usize) -> (&str, Vec<f64>) {
        let session = self.session.names.get(self.session.of_row[row]).map_or("", String::as_str);
        let pose = self.pose.as_ref().map(|poses| poses[row]);
        let time = self.time_measured.then(|| self.time[row]);
        let fixture = self.observation(row).fixture().map(|fixture| fixture as f64);
        let measured =
            self.configuration(row).iter().chain(&self.positions[row]).copied().chain(fixture);
        (session, pose.into_iter().chain(time).chain(measured).collect())
    }

    /// The pose of each row, numbered in order of appearance: rows of one pose tell the same about
    /// the arm.
    ///
    /// They agree in configuration, session and target, in payload and hoist where something of the
    /// arm gives way or an effect is declared, and in temperature and approach where a declared
    /// effect depends on them.
    pub fn pose_numbers(&self, problem: &Problem) -> Vec<usize> {
        self.numbers(problem, true)
    }

    /// The same whatever the target: rows of several targets in one pose show one pose of the arm.
    pub fn arm_pose_numbers(&self, problem: &Problem) -> Vec<usize> {
        self.numbers(problem, false)
    }

    fn numbers(&self, problem: &Problem, by_target: bool) -> Vec<usize> {
        let mut columns = self.joint_columns(problem);
        let words = |of_row: &[usize]| Column {
            values: of_row.iter().map(|&word| word as f64).collect(),
            step: SAME,
        };
        columns.push(words(&self.session.of_row));
        columns
            .extend(self.target.iter().filter(|_| by_target).map(|target| words(&target.of_row)));
        if by_target && !self.observations.is_empty() {
            let mut kinds: BTreeMap<Observation, usize> = BTreeMap::new();
            let number = |row: usize| {
                let next = kinds.len();
                *kinds.entry(self.observation(row)).or_insert(next)
            };
            columns.push(words(&(0..self.len()).map(number).collect::<Vec<_>>()));
        }
        let declared =
            |matters: fn(&Effect) -> bool| problem.effects.iter().any(|own| matters(&own.effect));
        let gives_way =
            problem.joints.iter().any(|joint| joint.stiffness.is_some() || joint.beam.is_some());
        if gives_way || !problem.effects.is_empty() {
            for load in [&self.payload, &self.hoist].into_iter().flatten() {
                let largest = load.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
                let step = if largest > 0.0 { LOAD_STEP * largest } else { 1.0 };
                columns.push(Column { values: load.clone(), step });
            }
        }
        if let Some(temperature) =
            self.temperature.as_ref().filter(|_| declared(Effect::is_thermal))
        {
            columns.push(Column { values: temperature.clone(), step: TEMPERATURE_STEP });
        }
        if let Some(approach) = self.approach.as_ref().filter(|_| declared(Effect::has_sides)) {
            let side = |joint: usize| {
                (0..self.len()).map(|row| approach[row * self.joints + joint]).collect()
            };
            columns
                .extend((0..self.joints).map(|joint| Column { values: side(joint), step: SAME }));
        }
        numbered(&columns, &(0..self.len()).collect::<Vec<_>>()).0
    }

    fn joint_columns(&self, problem: &Problem) -> Vec<Column> {
        let column = |(index, kind): (usize, JointKind)| Column {
            values: (0..self.len()).map(|row| self.configuration(row)[index]).collect(),
            step: if kind == JointKind::Prismatic { LENGTH_STEP } else { ANGLE_STEP },
        };
        problem.joints.iter().map(|joint| joint.kind).enumerate().map(column).collect()
    }
}

/// How many different numbers some rows have.
pub(crate) fn different(numbers: &[usize], rows: impl IntoIterator<Item = usize>) -> usize {
    rows.into_iter().map(|row| numbers[row]).collect::<BTreeSet<_>>().len()
}

/// A value of every row, and within what values agree.
struct Column {
    values: Vec<f64>,
    step: f64,
}

/// The group of each row, numbered as they appear in `order`, which holds every row, and how many
/// groups there are.
///
/// A row belongs to the group of an earlier row if every column differs by at most its step. Only
/// rows are compared whose weighted sums Σ wⱼ vⱼ/stepⱼ, in bins of Σ wⱼ, fall in the same or
/// neighbouring bins: rows that agree always do.
fn numbered(columns: &[Column], order: &[usize]) -> (Vec<usize>, usize) {
    // Weights without a common measure, so that unlike rows seldom share a bin.
    let weights: Vec<f64> =
        (1..=columns.len()).map(|j| 0.5 + (j as f64 * 0.618_033_988_749_895).fract()).collect();
    let width: f64 = weights.iter().sum();
    let mut first_rows: HashMap<i64, Vec<(usize, usize)>> = HashMap::new();
    let mut of_row = vec![0; order.len()];
    let mut count = 0;
    for &row in order {
        let sum: f64 = columns
            .iter()
            .zip(&weights)
            .map(|(own, weight)| weight * own.values[row] / own.step)
            .sum();
        let bin = floor(sum / width);
        let agrees = |&&(first, _): &&(usize, usize)| {
            columns.iter().all(|own| (own.values[row] - own.values[first]).abs() <= own.step)
        };
        let near = (-1..=1).filter_map(|side| first_rows.get(&bin.saturating_add(side))).flatten();
        let number = near.clone().find(agrees).map_or(count, |&(_, number)| number);
        if number == count {
            first_rows.entry(bin).or_default().push((row, number));
            count += 1;
        }
        of_row[row] = number;
    }
    (of_row, count)
}

#[expect(clippy::cast_possible_truncation, reason = "the cast keeps to the range of i64")]
fn floor(value: f64) -> i64 {
    value.floor() as i64
}
