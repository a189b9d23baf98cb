//! Figures of the reports, one per file. Each converts data to an SVG with title, caption and CSV
//! data.

mod axis;
mod chart;
mod contribution;
mod correlation;
mod curves;
mod drawing;
mod effect;
mod errors;
mod forest;
mod histogram;
mod joint_map;
mod misprints;
mod order;
mod prelude;
mod ranking;
mod strategies;
mod svg;
mod uncertainty;
mod vectors;

pub(super) use contribution::contributions;
pub(super) use correlation::correlation;
pub(super) use correlation::spectrum;
pub(super) use curves::{Curve, Series};
pub(super) use drawing::Drawing;
pub(super) use effect::{effect, unexplained};
pub(super) use errors::{errors, of_procedure};
pub(super) use forest::Forest;
pub(super) use histogram::histogram;
pub(super) use joint_map::joint_map;
pub(super) use misprints::misprints;
pub(super) use order::order;
pub(super) use ranking::ranking;
pub(super) use strategies::{ablations, draw_rounds, strategies};
pub(super) use svg::{ACCENT, Colour, FAINT, GRID, INK, MUTED, WARM};
pub(super) use uncertainty::{bounds_over_workspace, joint_errors};
pub(super) use vectors::vectors;

/// File names, without extension, of all figures that are separate files. Those of effects
/// (numbered) and of procedures (named) are missing here.
const NAMES: &[&str] = &[
    "ablations",
    "bounds",
    "contributions",
    "correlations",
    "earlier-estimate",
    "held-out-errors",
    "misprints",
    "priors",
    "ranking",
    "remainder-joints",
    "residual-histogram",
    "residual-joints",
    "residual-order",
    "residual-vectors",
    "rounds",
    "singular-values",
    "strategies",
    "unexplained",
];

/// Returns true if the file name is that of a figure of a report, for example `effect-1.svg`.
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
