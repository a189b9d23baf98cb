//! Loop of model selection: searches the effects that a problem lacks, by the evidence of its fits.
//!
//! - `search`: alternates between evaluating the evidence about a fit and fitting the most probable
//!   set, until both agree.
//! - `state`: the fits made so far.
//! - `gears`: the common prior of harmonics.
//! - `polish`: refines searched arguments on all rows.
//! - `misread`: begins with the effect that expresses a misread table.
//! - `plainer`: compares an effect with plainer causes that together do the same.
//! - `close`: runs the loop from the declared problem to its result.
//! - `remainder`: corrects what no sure law explains.
//! - `found`, `status`, `interval`: the claims about each effect, the verdict, and the gain on
//!   held-out poses.

mod close;
mod found;
mod gears;
mod remainder;
mod search;
mod state;
mod status;

pub use crate::numeric::Interval;
pub use close::{ClosedLoop, close, close_by};
pub use found::Found;
pub use state::Round;
pub use status::{Status, Verdict};
