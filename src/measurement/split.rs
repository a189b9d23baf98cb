//! Split of the rows into fitted and held-out ones.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::Measurements;
use crate::error::{InputError, InputErrorKind, NoRows};
use crate::problem::{HeldOut, Observation, Problem};

/// Rows that are fitted and rows that are held out, each in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// Rows used for fitting and for choosing effects.
    pub identification: Vec<usize>,
    /// Rows that take no part in fitting or in choosing effects.
    pub held_out: Vec<usize>,
}

impl Split {
    /// Splits the rows as the problem declares.
    ///
    /// # Errors
    /// Returns an error if a part is empty, the held-out session does not exist, or no split is
    /// declared.
    #[doc(hidden)]
    pub fn new(problem: &Problem, measurements: &Measurements) -> Result<Self, InputError> {
        let error = |kind| problem.data.held_out_location.clone().error(kind);
        let marked =
            || measurements.marked_held_out.clone().ok_or_else(|| error(InputErrorKind::NoHeldOut));
        let held_out = match &problem.data.held_out {
            None | Some(HeldOut::Column(_)) => marked()?,
            Some(HeldOut::Session(session)) => of_session(session, measurements).map_err(error)?,
            Some(HeldOut::Fraction { fraction, seed }) => {
                random_fraction(*fraction, *seed, problem, measurements)
            }
            Some(HeldOut::Nothing) => {
                let (identification, held_out) = ((0..measurements.len()).collect(), Vec::new());
                return Ok(Self { identification, held_out });
            }
        };
        let held_out = with_known_distances(held_out, measurements);
        let (held_out, identification): (Vec<_>, Vec<_>) =
            (0..measurements.len()).partition(|&row| held_out[row]);
        let cause = |word| match &problem.data.held_out {
            None | Some(HeldOut::Nothing) => NoRows::Column { column: "split".to_owned(), word },
            Some(HeldOut::Column(column)) => NoRows::Column { column: column.clone(), word },
            Some(HeldOut::Session(session)) => NoRows::Session { session: session.clone() },
            Some(HeldOut::Fraction { fraction, .. }) => NoRows::Fraction {
                rows: measurements.len(),
                configurations: measurements.configurations(problem).1,
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

/// Moves the row of each known distance to the fitted rows if fitted rows touch both of its points,
/// otherwise to the held-out rows. `held_out` is true for held-out rows.
fn with_known_distances(mut held_out: Vec<bool>, measurements: &Measurements) -> Vec<bool> {
    let touched = |point: usize| {
        (0..measurements.len())
            .any(|row| !held_out[row] && measurements.observation(row) == Observation::Point(point))
    };
    let row_and_use = |row: usize| match measurements.observation(row) {
        Observation::Between(first, second) => {
            Some((row, !(touched(first as usize) && touched(second as usize))))
        }
        _ => None,
    };
    for (row, is_held_out) in (0..measurements.len()).filter_map(row_and_use).collect::<Vec<_>>() {
        held_out[row] = is_held_out;
    }
    held_out
}

/// Returns, for each row, true if it belongs to the session, whose rows are held out.
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

/// Returns, for each row, true if it is held out. All rows of randomly chosen configurations are
/// held out, until their number reaches the `fraction` of all rows.
fn random_fraction(
    fraction: f64,
    seed: u64,
    problem: &Problem,
    measurements: &Measurements,
) -> Vec<bool> {
    let (of_row, count) = measurements.configurations(problem);
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
