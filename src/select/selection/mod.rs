//! Loop of model selection: searches the effects that a problem lacks, by the evidence of its fits.
//!
//! - `search`: alternates between evaluating the evidence about a fit and fitting the most probable
//!   set, until both agree; refines searched arguments on all rows.
//! - `state`: the fits made so far.
//! - `gears`: the common prior of harmonics.
//! - `close`: runs the loop from the declared problem to its result, with the gain on held-out
//!   poses.
//! - `remainder`: corrects what no sure law explains.
//! - `misread_effect`: the effect that expresses a misread table, with which the search begins.
//! - `gravity`: another direction of gravity that would explain what no law does.
//! - `excluded_rows`: rows with gross errors that spoil the last fit.
//! - `found`: the claims about each effect, compared with plainer causes that together do the same.
//! - `status`: the status of each effect, and the verdict.

mod close;
mod excluded_rows;
mod found;
mod gears;
mod gravity;
mod misread_effect;
mod remainder;
mod search;
mod state;
mod status;

pub use crate::numeric::Interval;
pub use close::{ClosedLoop, close, close_by};
pub use found::{Compared, Found};
pub use state::Round;
pub use status::{Status, Verdict};
