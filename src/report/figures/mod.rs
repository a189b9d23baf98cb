//! Figures of the reports, one per file: data in, SVG with title and caption out.

mod arm;
mod axis_limit;
mod cause;
mod cause_drawing;
mod contribution;
mod correlation;
mod coverage;
mod data;
mod errors;
mod frame;
mod histogram;
mod joint_map;
mod misprints;
mod order;
mod pose;
mod prelude;
mod ranking;
mod sheet;
mod spectrum;
mod strategies;
mod tags;
mod vectors;

pub(super) use contribution::contributions;
pub(super) use correlation::correlation;
pub(super) use errors::{errors, of_procedure};
pub(super) use frame::range;
pub(super) use histogram::histogram;
pub(super) use joint_map::joint_map;
pub(super) use misprints::misprints;
pub(super) use order::order;
pub(super) use ranking::ranking;
pub(super) use spectrum::spectrum;
pub(super) use strategies::{ablations, rounds, strategies};
pub(super) use vectors::vectors;

pub use cause::{Cause, Point, Quantity};
pub use data::PlotData;
pub use frame::{ACCENT, Drawing, FAINT, GRID, INK, MUTED, WARM};

/// File names of all figures, except those of effects (numbered) and procedures (named).
const NAMES: [&str; 14] = [
    "ablations",
    "contributions",
    "correlations",
    "held-out-errors",
    "misprints",
    "ranking",
    "residual-histogram",
    "residual-joints",
    "residual-order",
    "residual-vectors",
    "rounds",
    "singular-values",
    "strategies",
    "unexplained",
];

/// Returns true if the file name is that of a figure, for example `effect-1.svg`.
pub fn is_figure(file: &str) -> bool {
    let Some(name) = file.strip_suffix(".svg") else { return false };
    let is_number =
        |number: &str| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    let is_word = |word: &str| {
        !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-')
    };
    NAMES.contains(&name)
        || name.strip_prefix("effect-").is_some_and(is_number)
        || name.strip_prefix("held-out-errors-").is_some_and(is_word)
}
