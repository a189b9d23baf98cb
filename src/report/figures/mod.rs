//! The figures of the report, one a file: numbers in, SVG with its title and caption out.

mod arm;
mod cause;
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
mod ranking;
mod reach;
mod sheet;
mod spectrum;
mod strategies;
mod tags;
mod vectors;

pub(super) use frame::range;
pub use frame::{ACCENT, Drawing, FAINT, GRID, INK, MUTED, WARM};

use crate::diagnose::{ClosedLoop, Trace};
use crate::identify::{Before, Comparison, Procedure};
use crate::least_squares::Identifiability;
use crate::monte_carlo::{MisprintStudy, ReplicaResults};

pub use cause::{Cause, Point, Quantity};
pub use contribution::Contribution;
pub use coverage::Coverage;
pub use data::{Command, PlotData, Stage, StageErrors};
pub use pose::PoseError;

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
    /// The held-out errors of one procedure of a comparison.
    Procedure(&'a Before, &'a Procedure),
    Strategies(&'a Comparison),
    Rounds(&'a ClosedLoop),
    Ablations(&'a Comparison),
    Misprints(&'a MisprintStudy, &'a ReplicaResults),
    /// Of an effect, with its number from 1.
    Cause(&'a PlotData, &'a Cause, usize),
    Trend(&'a PlotData, &'a Cause),
    Contributions(&'a PlotData),
    JointMap(&'a PlotData),
}

impl Figure<'_> {
    /// Its drawing; nothing where there is too little to draw.
    pub fn draw(&self) -> Option<Drawing> {
        match *self {
            Self::Errors(data) => errors::errors(data),
            Self::Vectors(data) => vectors::vectors(data),
            Self::Histogram(data) => histogram::histogram(data),
            Self::Order(data) => order::order(data),
            Self::Correlations(data) => correlation::correlation(&data.correlations),
            Self::SingularValues(found) => spectrum::spectrum(found),
            Self::Ranking(trace) => ranking::ranking(trace),
            Self::Procedure(before, own) => Some(errors::of_procedure(before, own)),
            Self::Strategies(comparison) => Some(strategies::strategies(comparison)),
            Self::Rounds(closure) => strategies::rounds(closure),
            Self::Ablations(comparison) => strategies::ablations(comparison),
            Self::Misprints(study, found) => Some(misprints::misprints(study, found)),
            Self::Cause(data, own, number) => Some(own.draw_effect(number, &data.shown)),
            Self::Trend(data, own) => Some(own.draw_unexplained(&data.shown)),
            Self::Contributions(data) => contribution::contributions(&data.contributions),
            Self::JointMap(data) => joint_map::joint_map(data),
        }
    }
}

/// Every name but those of effects, which are numbered, and of procedures, which are named.
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

/// Whether a file of this name is a figure that some page may have: `effect-1.svg`.
pub fn is_figure(file: &str) -> bool {
    let Some(name) = file.strip_suffix(".svg") else { return false };
    let numbered = |number: &str| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    let named = |word: &str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-');
    NAMES.contains(&name)
        || name.strip_prefix("effect-").is_some_and(numbered)
        || name.strip_prefix("held-out-errors-").is_some_and(named)
}
