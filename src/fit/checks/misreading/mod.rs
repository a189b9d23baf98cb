//! Misreadings of a table or problem: mistakes that would explain why an arm does not fit its
//! measurements.
//!
//! A [`Misreading`] holds the functions that correct it in a copy of table and problem, and its
//! words. The nominal arm is registered to that copy ([`search`]). The misreadings with the smallest
//! errors are then fitted in full. Linearised tests at a fit with a large error would not find them.

mod axis_scale;
mod candidates;
mod chosen_rows;
mod commands;
mod entries;
mod explanation;
mod held_places;
mod images;
mod known_arm;
mod loads;
mod masses;
mod payload_rows;
mod reversed;
mod search;
mod target;
mod two_mistakes;
mod typed;
mod views;

use std::sync::Arc;

use nalgebra::Vector3;

pub(in crate::fit) use candidates::POSITION_UNITS;
pub(in crate::fit) use commands::reading_of_rows;
pub(in crate::fit) use explanation::Explanations;
pub(crate) use explanation::MisreadEffect;
pub(in crate::fit) use explanation::first_of;
pub(in crate::fit) use images::is_of_views;
pub(crate) use known_arm::misread_table;
pub(in crate::fit) use masses::{error_with_priors, misread_masses};
pub(in crate::fit) use search::{MAX_CLEAR_RATIO, MAX_NOISE_SIGMAS};
pub(in crate::fit) use views::{start_of_fit, with_readings};

use crate::measurement::Measurements;
use crate::problem::{Effect, ParameterRule, Problem};

/// Quantity of table or problem that may have been declared in the wrong unit, sign, order or
/// convention.
#[derive(Clone, Default)]
pub(in crate::fit) struct Misreading {
    pub(super) kind: Kind,
    /// Description.
    pub words: String,
    /// Description with names of the problem or the place in its file; `None` if it has neither.
    located: Option<String>,
    /// Key of misreadings that differ only in size; `None` for one that differs from all others.
    group: Option<String>,
    /// Corrects a configuration.
    commands: Option<Correction<[f64]>>,
    /// Corrects a measured position.
    position: Option<Correction<Vector3<f64>>>,
    /// Returns the chosen rows of a table, corrected.
    rows: Option<Choice>,
    /// Corrects the problem; `None` if that changes nothing.
    problem: Option<Rewriting>,
    size: Option<Size>,
}

/// Function that corrects what was read.
type Correction<T> = Arc<dyn Fn(&mut T) + Send + Sync>;
/// Function that returns the chosen rows of a table, corrected.
type Choice = Arc<dyn Fn(&Measurements, &[usize]) -> Measurements + Send + Sync>;
/// Function that corrects a problem; `None` if that changes nothing.
type Rewriting = Arc<dyn Fn(&mut Problem) -> Option<()> + Send + Sync>;

/// Kind of a misreading, as far as the search treats it unlike others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Kind {
    #[default]
    Other,
    /// Nothing is misread.
    Declared,
    /// The misreading often comes with another one.
    Usual,
    /// Angles of the joints in a set of bits have the opposite sign: bit k (from 0) is set for joint
    /// k + 1.
    Reversed(u64),
    /// The zero position of a joint, counted from 1, is wrong by an angle \[°\].
    Zero(usize, i16),
    /// The joint at this index turns by a multiple of its command.
    Ratio(usize),
    /// A joint also turns with another one.
    Coupled,
    /// A turning joint also turns with a sliding one, as the nut of a ball screw does.
    Screw,
    /// All positions are in another unit; number by which they must be multiplied.
    Unit(f64),
    /// The same of a unit that often comes with another mistake.
    UsualUnit(f64),
    /// All positions are longer or shorter by one factor.
    Scale,
    /// Positions are in a left-handed frame.
    Mirrored,
    /// One coordinate of the positions is longer by a factor \[millionths\].
    AxisScale(usize, u32),
    /// Positions belong to the configuration so many rows before theirs, from a row on.
    Shifted(i8, usize),
    /// Rows of one of two joined tables are sorted by the text of their numbers.
    TextOrder,
    /// The angle α of a joint is wrong by a multiple of 90°.
    Twist,
    /// The angle α of the joint with this number, from 1, has the other sign.
    AlphaSign(usize),
    /// An entry of the joint table is another number.
    Typed,
    /// The base stands elsewhere than declared, and the problem holds it there.
    HeldBase,
    /// The target lies elsewhere than declared, and the problem holds it there.
    HeldTarget,
}

/// Size of a misreading, which a full fit finds.
#[derive(Clone)]
struct Size {
    /// Name of the parameter that stands for the size.
    parameter: String,
    /// Effect that has this parameter; `None` for one of the arm.
    effect: Option<Effect>,
    /// Returns the size for the deviation of the parameter.
    of: Arc<dyn Fn(f64) -> f64 + Send + Sync>,
    /// Describes the misreading with its size.
    words: Arc<dyn Fn(f64) -> String + Send + Sync>,
}

impl Misreading {
    /// Creates the misreading with these words that `correct` corrects in a configuration.
    fn of_commands(
        words: impl Into<String>,
        correct: impl Fn(&mut [f64]) + Send + Sync + 'static,
    ) -> Self {
        Self { words: words.into(), commands: Some(Arc::new(correct)), ..Self::default() }
    }

    /// Creates the misreading that `correct` corrects in a measured position.
    fn of_positions(
        words: impl Into<String>,
        correct: impl Fn(&mut Vector3<f64>) + Send + Sync + 'static,
    ) -> Self {
        Self { words: words.into(), position: Some(Arc::new(correct)), ..Self::default() }
    }

    /// Creates the misreading that `correct` corrects in the chosen rows of a table.
    fn of_rows(
        words: impl Into<String>,
        correct: impl Fn(&mut Measurements) + Send + Sync + 'static,
    ) -> Self {
        Self::of_order(words, move |table, chosen| {
            let mut rows = table.select(chosen);
            correct(&mut rows);
            rows
        })
    }

    /// Creates the misreading without which `select` returns the chosen rows of a table.
    fn of_order(
        words: impl Into<String>,
        select: impl Fn(&Measurements, &[usize]) -> Measurements + Send + Sync + 'static,
    ) -> Self {
        Self { words: words.into(), rows: Some(Arc::new(select)), ..Self::default() }
    }

    /// Creates the misreading that `correct` corrects in the problem.
    fn of_problem(
        words: impl Into<String>,
        correct: impl Fn(&mut Problem) -> Option<()> + Send + Sync + 'static,
    ) -> Self {
        Self { words: words.into(), ..Self::default() }.with_problem(correct)
    }

    /// Returns the misreading with a correction of the problem, too.
    fn with_problem(
        self,
        correct: impl Fn(&mut Problem) -> Option<()> + Send + Sync + 'static,
    ) -> Self {
        Self { problem: Some(Arc::new(correct)), ..self }
    }

    fn of_kind(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }

    /// Returns the misreading as one of those with the same `key`, which differ only in size.
    fn in_group(self, key: impl Into<String>) -> Self {
        Self { group: Some(key.into()), ..self }
    }

    /// Returns the misreading with a description that has names or places of the problem.
    fn located(self, words: Option<String>) -> Self {
        Self { located: words, ..self }
    }

    /// Returns the misreading with a size that is a parameter of `effect`, or of the arm.
    fn with_size(
        self,
        (parameter, effect): (impl Into<String>, Option<Effect>),
        of: impl Fn(f64) -> f64 + Send + Sync + 'static,
        words: impl Fn(f64) -> String + Send + Sync + 'static,
    ) -> Self {
        let (parameter, of, words) = (parameter.into(), Arc::new(of), Arc::new(words));
        Self { size: Some(Size { parameter, effect, of, words }), ..self }
    }

    /// Returns what is no misreading.
    pub(super) fn none() -> Self {
        Self::default().of_kind(Kind::Declared)
    }

    /// Returns true if the problem is misread.
    fn concerns_problem(&self) -> bool {
        self.problem.is_some()
    }

    /// Returns a key that is equal for misreadings that differ only in size. Of the misreadings
    /// with one key, only the best is fitted in full.
    fn key(&self) -> &str {
        self.group.as_ref().or(self.located.as_ref()).unwrap_or(&self.words)
    }

    /// Describes the misreading, with its fitted `size` if it has one.
    fn described(&self, size: Option<f64>) -> String {
        match (&self.size, size) {
            (Some(of), Some(size)) => (of.words)(size),
            _ => self.located.as_ref().unwrap_or(&self.words).clone(),
        }
    }

    /// Returns the problem with the misreading corrected; `None` if that changes nothing.
    fn rewritten(&self, declared: &Problem) -> Option<Problem> {
        let mut problem = declared.clone();
        (self.problem.as_ref()?)(&mut problem)?;
        Some(problem)
    }

    /// Returns the problem with the size of the misreading as a free parameter without a prior;
    /// `None` if the misreading has no size.
    fn with_free_size(&self, problem: &Problem) -> Option<Problem> {
        let Size { parameter, effect, .. } = self.size.as_ref()?;
        let mut problem = match effect {
            Some(effect) => problem.with_effect(effect.clone()),
            None => problem.clone(),
        };
        let rule = ParameterRule::free(parameter.clone(), &problem);
        problem.parameters.push(rule);
        Some(problem)
    }

    /// Returns the chosen rows of `table` with the misreading corrected; `joints` is the number of
    /// joints of the corrected problem.
    fn undone(&self, table: &Measurements, chosen: &[usize], joints: usize) -> Measurements {
        let mut rows =
            self.rows.as_ref().map_or_else(|| table.select(chosen), |rows| rows(table, chosen));
        if joints != rows.joints {
            resize(&mut rows, joints);
        }
        if let Some(correct) = &self.commands {
            rows.configurations.chunks_exact_mut(joints.max(1)).for_each(|q| correct(q));
        }
        if let Some(correct) = &self.position {
            rows.positions.iter_mut().for_each(|position| correct(position));
        }
        rows
    }
}

/// Sets the number of joints of each configuration in `rows` to `joints`; the commands of added
/// joints are 0.
fn resize(rows: &mut Measurements, joints: usize) {
    let previous = rows.joints;
    let resized = |column: &[f64]| -> Vec<f64> {
        let row = |q: &[f64]| {
            let mut q = q.to_vec();
            q.resize(joints, 0.0);
            q
        };
        column.chunks_exact(previous.max(1)).flat_map(row).collect()
    };
    let others = rows.other_configurations.iter_mut().chain(rows.approach.iter_mut());
    for column in std::iter::once(&mut rows.configurations).chain(others) {
        *column = resized(column);
    }
    rows.joints = joints;
}

/// Returns 10 to the power `power`, the factor between two units of a length or a mass.
fn power_of_ten(power: i8) -> f64 {
    10.0_f64.powi(power.into())
}

/// Returns the numbers, from 1, of the joints in a set of bits: bit k is set for joint k + 1.
fn numbers_of(joints: u64) -> impl Iterator<Item = usize> {
    (0..64).filter(move |joint| joints >> joint & 1 == 1).map(|joint| joint + 1)
}

/// Returns a number of things with its noun, which has a plural in s: "2 rows".
fn counted(count: u8, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
