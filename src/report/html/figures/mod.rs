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

/// " Every third pose is drawn." where poses are left out of a drawing.
fn thinned(every: usize) -> String {
    if every > 1 { format!(" One pose in {every} is drawn.") } else { String::new() }
}
