//! Model selection: fit, screen, add the effect, fit again, until nothing is left to find.

mod alternatives;
mod close;
mod harmonics;
mod interval;
mod pick;
mod rounds;
mod status;

pub use crate::numeric::Interval;
pub use close::{ClosedLoop, Found, Round, close, close_by};
pub use harmonics::HarmonicPrior;
pub use status::{Status, Verdict};
