//! The figures of the report, one a file: numbers in, SVG with its title and caption out.

mod cause;
mod correlation;
mod errors;
mod frame;
mod histogram;
mod order;
mod ranking;
mod spectrum;
mod strategies;
mod vectors;

pub use cause::{capital, cause};
pub use correlation::correlation;
pub use errors::errors;
pub use frame::{ACCENT, FAINT, GRID, INK, MUTED, WARM, power_of_ten};
pub use histogram::histogram;
pub use order::order;
pub use ranking::ranking;
pub use spectrum::spectrum;
pub use strategies::{ablations, strategies};
pub use vectors::vectors;

/// A figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// Name of its file, without the ending.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// What to see in it.
    pub caption: String,
    /// The drawing.
    pub svg: String,
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

/// " 3 poses without an equilibrium are left out." where there are any.
fn left_out(poses: usize) -> String {
    match poses {
        0 => String::new(),
        1 => " One pose without an equilibrium is left out.".to_owned(),
        n => format!(" {n} poses without an equilibrium are left out."),
    }
}

/// " Every third pose is drawn." where poses are left out of a drawing.
fn thinned(every: usize) -> String {
    if every > 1 { format!(" One pose in {every} is drawn.") } else { String::new() }
}
