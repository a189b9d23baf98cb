//! Grouping of rows that repeat a configuration or a pose.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::Measurements;
use crate::problem::{Effect, JointKind, Observation, Problem};

/// Difference up to which commanded angles count as equal \[rad\]: 0.01°.
const ANGLE_TOLERANCE: f64 = 0.01 * std::f64::consts::PI / 180.0;
/// Difference up to which commanded lengths count as equal \[m\].
const LENGTH_TOLERANCE: f64 = 1e-4;
/// Difference up to which payloads, or hoist forces, count as equal, as a fraction of the largest.
const LOAD_TOLERANCE: f64 = 0.01;
/// Difference up to which temperatures count as equal \[K\].
const TEMPERATURE_TOLERANCE: f64 = 1.0;
/// Difference below which integer codes of words and directions count as equal: less than one.
const WORD_TOLERANCE: f64 = 0.5;

impl Measurements {
    /// Returns the index of each row's configuration and the number of distinct configurations. The
    /// indices do not depend on the order of the rows: they follow session, pose number, time and
    /// measured values.
    pub(crate) fn configurations(&self, problem: &Problem) -> (Vec<usize>, usize) {
        let mut order: Vec<usize> = (0..self.len()).collect();
        let keys: Vec<_> = order.iter().map(|&row| self.key(row)).collect();
        let compare = |a: &(&str, Vec<f64>), b: &(&str, Vec<f64>)| {
            let numbers = a.1.iter().zip(&b.1).map(|(a, b)| a.total_cmp(b));
            a.0.cmp(b.0).then(numbers.fold(Ordering::Equal, Ordering::then))
        };
        order.sort_by(|&a, &b| compare(&keys[a], &keys[b]));
        group_rows(&self.joint_columns(problem), &order)
    }

    /// Returns the sort key of a row: session, pose number, time, configuration, position.
    fn key(&self, row: usize) -> (&str, Vec<f64>) {
        let session = self.session.names.get(self.session.of_row[row]).map_or("", String::as_str);
        let pose = self.pose.as_ref().map(|poses| poses[row]);
        let time = self.time_measured.then(|| self.time[row]);
        let fixture = self.observation(row).fixture().map(|fixture| fixture as f64);
        let measured =
            self.configuration(row).iter().chain(&self.positions[row]).copied().chain(fixture);
        (session, pose.into_iter().chain(time).chain(measured).collect())
    }

    /// Returns the index of each row's pose, in order of appearance. Rows of one pose contain the
    /// same information about the arm.
    ///
    /// Rows of one pose agree in configuration, session, target and measured quantity. They also
    /// agree in payload and hoist force if the arm is elastic or an effect is declared, and in
    /// temperature and approach if a declared effect depends on them.
    #[doc(hidden)]
    pub fn pose_numbers(&self, problem: &Problem) -> Vec<usize> {
        self.numbers(problem, true)
    }

    /// Returns the index of each row's pose of the arm, in order of appearance. Unlike for
    /// [`pose_numbers`](Self::pose_numbers), rows that measure different targets or quantities may
    /// have one pose.
    pub(crate) fn arm_pose_numbers(&self, problem: &Problem) -> Vec<usize> {
        self.numbers(problem, false)
    }

    /// Returns the index of each row's pose; `by_target` is true if the rows of a pose must agree
    /// in target and measured quantity.
    fn numbers(&self, problem: &Problem, by_target: bool) -> Vec<usize> {
        let mut columns = self.joint_columns(problem);
        let words = |of_row: &[usize]| Column {
            values: of_row.iter().map(|&word| word as f64).collect(),
            tolerance: WORD_TOLERANCE,
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
        let declared = |matters: fn(&Effect) -> bool| {
            problem.effects.iter().any(|declared| matters(&declared.effect))
        };
        let is_elastic =
            problem.joints.iter().any(|joint| joint.stiffness.is_some() || joint.beam.is_some());
        if is_elastic || !problem.effects.is_empty() {
            for load in [&self.payload, &self.hoist].into_iter().flatten() {
                let largest = load.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
                let tolerance = if largest > 0.0 { LOAD_TOLERANCE * largest } else { 1.0 };
                columns.push(Column { values: load.clone(), tolerance });
            }
        }
        if let Some(temperature) =
            self.temperature.as_ref().filter(|_| declared(Effect::is_thermal))
        {
            columns.push(Column { values: temperature.clone(), tolerance: TEMPERATURE_TOLERANCE });
        }
        if let Some(approach) = self.approach.as_ref().filter(|_| declared(Effect::has_sides)) {
            let side = |joint: usize| {
                (0..self.len()).map(|row| approach[row * self.joints + joint]).collect()
            };
            columns.extend(
                (0..self.joints)
                    .map(|joint| Column { values: side(joint), tolerance: WORD_TOLERANCE }),
            );
        }
        group_rows(&columns, &(0..self.len()).collect::<Vec<_>>()).0
    }

    /// Returns the commands of the joints that both the problem and the table have.
    fn joint_columns(&self, problem: &Problem) -> Vec<Column> {
        let column = |(index, kind): (usize, JointKind)| Column {
            values: (0..self.len()).map(|row| self.configuration(row)[index]).collect(),
            tolerance: if kind == JointKind::Prismatic {
                LENGTH_TOLERANCE
            } else {
                ANGLE_TOLERANCE
            },
        };
        let kinds = problem.joints.iter().map(|joint| joint.kind);
        kinds.take(self.joints).enumerate().map(column).collect()
    }
}

/// Returns the number of distinct `numbers` among some rows.
pub(crate) fn count_distinct(numbers: &[usize], rows: impl IntoIterator<Item = usize>) -> usize {
    rows.into_iter().map(|row| numbers[row]).collect::<BTreeSet<_>>().len()
}

/// Values of all rows in one column, and the difference up to which they count as equal.
struct Column {
    values: Vec<f64>,
    tolerance: f64,
}

/// Returns the group of each row and the number of groups, numbered in the order of the rows in
/// `order`.
///
/// A row belongs to the group of an earlier row if every column differs by at most its tolerance.
/// Candidates are found by weighted sums Σ wⱼ vⱼ/tⱼ of the values vⱼ over the tolerances tⱼ, in
/// bins of width Σ wⱼ: rows that agree lie in the same or neighbouring bins.
fn group_rows(columns: &[Column], order: &[usize]) -> (Vec<usize>, usize) {
    // With weights in irrational ratios, different rows rarely share a bin.
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
            .map(|(column, weight)| weight * column.values[row] / column.tolerance)
            .sum();
        let bin = floor(sum / width);
        let agrees = |&&(first, _): &&(usize, usize)| {
            columns
                .iter()
                .all(|column| (column.values[row] - column.values[first]).abs() <= column.tolerance)
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

/// Returns the largest integer up to `value`, within the range of i64.
#[expect(clippy::cast_possible_truncation, reason = "the cast keeps to the range of i64")]
fn floor(value: f64) -> i64 {
    value.floor() as i64
}
