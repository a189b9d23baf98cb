//! Rows to fit and rows to judge by.

use std::collections::HashMap;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::Measurements;
use crate::error::{InputError, InputErrorKind, NoRows};
use crate::problem::{HeldOut, JointKind, Problem};

/// Configurations agree where each angle does to this [rad].
const ANGLE_STEP: f64 = 0.01 * std::f64::consts::PI / 180.0;
/// Configurations agree where each length does to this [m].
const LENGTH_STEP: f64 = 1e-4;

/// Rows to identify with and rows held out, each in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// Rows that take part in fitting and in choosing.
    pub identification: Vec<usize>,
    /// Rows that take part in neither.
    pub held_out: Vec<usize>,
}

impl Split {
    /// Divides the rows as the problem says; neither part may be empty.
    ///
    /// # Errors
    /// An empty part, a session that nobody measured, or no word on what is held out.
    pub fn new(problem: &Problem, measurements: &Measurements) -> Result<Self, InputError> {
        let error = |kind| problem.data.held_out_location.clone().error(kind);
        let marked = || measurements.marked_held_out.clone().ok_or_else(|| error(InputErrorKind::NoHeldOut));
        let held_out = match &problem.data.held_out {
            None | Some(HeldOut::Column(_)) => marked()?,
            Some(HeldOut::Session(session)) => of_session(session, measurements).map_err(error)?,
            Some(HeldOut::Fraction { fraction, seed }) => at_random(*fraction, *seed, problem, measurements),
        };
        let (held_out, identification): (Vec<_>, Vec<_>) = (0..measurements.len()).partition(|&row| held_out[row]);
        let cause = |word| match &problem.data.held_out {
            None => NoRows::Column { column: "split".to_owned(), word },
            Some(HeldOut::Column(column)) => NoRows::Column { column: column.clone(), word },
            Some(HeldOut::Session(session)) => NoRows::Session { session: session.clone() },
            Some(HeldOut::Fraction { fraction, .. }) => NoRows::Fraction {
                rows: measurements.len(),
                configurations: configurations(problem, measurements).1,
                fraction: fraction.to_string(),
            },
        };
        if held_out.is_empty() {
            return Err(error(InputErrorKind::NoHeldOutRows { cause: cause("identification") }));
        }
        if identification.is_empty() {
            return Err(error(InputErrorKind::NoIdentificationRows { cause: cause("validation") }));
        }
        Ok(Self { identification, held_out })
    }
}

/// Marks the rows of one session.
fn of_session(session: &str, measurements: &Measurements) -> Result<Vec<bool>, InputErrorKind> {
    let labels = &measurements.session;
    match labels.names.iter().position(|name| name == session) {
        Some(held_out) => Ok(labels.of_row.iter().map(|&label| label == held_out).collect()),
        None => Err(InputErrorKind::UnknownSession {
            session: session.to_owned(),
            sessions: labels.names.iter().filter(|name| !name.is_empty()).cloned().collect(),
        }),
    }
}

/// Marks rows until they make up the fraction; rows of one configuration stay together.
fn at_random(fraction: f64, seed: u64, problem: &Problem, measurements: &Measurements) -> Vec<bool> {
    let (of_row, count) = configurations(problem, measurements);
    let mut sizes = vec![0_usize; count];
    for &configuration in &of_row {
        sizes[configuration] += 1;
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let wanted = fraction * measurements.len() as f64;
    let mut chosen = vec![false; count];
    let mut rows = 0;
    for configuration in order {
        if rows as f64 >= wanted {
            break;
        }
        chosen[configuration] = true;
        rows += sizes[configuration];
    }
    of_row.into_iter().map(|configuration| chosen[configuration]).collect()
}

/// The configuration of each row, numbered in order of appearance, and how many there are.
///
/// A row is of an earlier one's configuration when every joint agrees with it within its step. The rows to compare with are
/// found along one weighted sum of all joints, which differs by no more than one bin then.
fn configurations(problem: &Problem, measurements: &Measurements) -> (Vec<usize>, usize) {
    let steps: Vec<f64> = problem
        .joints
        .iter()
        .map(|joint| if joint.kind == JointKind::Prismatic { LENGTH_STEP } else { ANGLE_STEP })
        .collect();
    // Weights without a common measure, so that unlike configurations seldom share a bin.
    let weights: Vec<f64> = (1..=steps.len()).map(|j| 0.5 + (j as f64 * 0.618_033_988_749_895).fract()).collect();
    let width: f64 = weights.iter().sum();
    let mut first_rows: HashMap<i64, Vec<(usize, usize)>> = HashMap::new();
    let mut of_row = Vec::with_capacity(measurements.len());
    let mut count = 0;
    for row in 0..measurements.len() {
        let q = measurements.configuration(row);
        let sum: f64 = q.iter().zip(&steps).zip(&weights).map(|((q, step), weight)| weight * q / step).sum();
        let bin = floor(sum / width);
        let agrees = |&&(first, _): &&(usize, usize)| {
            let pairs = q.iter().zip(measurements.configuration(first)).zip(&steps);
            pairs.into_iter().all(|((a, b), step)| (a - b).abs() <= *step)
        };
        let near = (-1..=1).filter_map(|side| first_rows.get(&bin.saturating_add(side))).flatten();
        let number = near.clone().find(agrees).map_or(count, |&(_, number)| number);
        if number == count {
            first_rows.entry(bin).or_default().push((row, number));
            count += 1;
        }
        of_row.push(number);
    }
    (of_row, count)
}

#[expect(clippy::cast_possible_truncation, reason = "the cast keeps to the range of i64")]
fn floor(value: f64) -> i64 {
    value.floor() as i64
}
