//! The figures of the report, one a file: numbers in, SVG with its title and caption out.

mod arm;
mod cause;
mod correlation;
mod data;
mod errors;
mod frame;
mod histogram;
mod order;
mod ranking;
mod spectrum;
mod strategies;
mod vectors;

pub use frame::{ACCENT, Drawing, FAINT, GRID, INK, MUTED, WARM};

use crate::diagnose::Trace;
use crate::identify::Comparison;
use crate::least_squares::Identifiability;

pub use cause::{Cause, Point, Quantity};
pub use data::{PlotData, PoseError, Stage, StageErrors};

/// A figure with its numbers.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Figure<'a> {
    Errors(&'a PlotData),
    Vectors(&'a PlotData),
    Histogram(&'a PlotData),
    Order(&'a PlotData),
    Correlations(&'a PlotData),
    SingularValues(&'a Identifiability),
    Ranking(&'a Trace),
    Strategies(&'a Comparison),
    Ablations(&'a Comparison),
    /// Of an effect, with its number from 1.
    Cause(&'a Cause, usize),
    Trend(&'a Cause),
}

impl Figure<'_> {
    /// Its drawing; nothing where there is too little to draw.
    pub fn draw(&self) -> Option<Drawing> {
        match *self {
            Self::Errors(data) => Some(errors::errors(data)),
            Self::Vectors(data) => Some(vectors::vectors(data)),
            Self::Histogram(data) => histogram::histogram(data),
            Self::Order(data) => order::order(data),
            Self::Correlations(data) => correlation::correlation(&data.correlations),
            Self::SingularValues(found) => spectrum::spectrum(found),
            Self::Ranking(trace) => ranking::ranking(trace),
            Self::Strategies(comparison) => Some(strategies::strategies(comparison)),
            Self::Ablations(comparison) => strategies::ablations(comparison),
            Self::Cause(own, number) => Some(own.draw_effect(number)),
            Self::Trend(own) => Some(own.draw_unexplained()),
        }
    }
}

/// Every name but those of effects, which are numbered.
const NAMES: [&str; 10] = [
    "ablations",
    "correlations",
    "held-out-errors",
    "ranking",
    "residual-histogram",
    "residual-order",
    "residual-vectors",
    "singular-values",
    "strategies",
    "unexplained",
];

/// Whether a file of this name is a figure that some page may have: `effect-1.svg`.
pub fn is_figure(file: &str) -> bool {
    let Some(name) = file.strip_suffix(".svg") else { return false };
    let numbered = |number: &str| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    NAMES.contains(&name) || name.strip_prefix("effect-").is_some_and(numbered)
}
