//! The loop: fit, trace, add the effect, fit again, until nothing is left to find.

mod alternatives;
mod close;
mod harmonics;
mod interval;
mod pick;
mod retest;
mod rounds;

pub use close::{ClosedLoop, Found, Round, Verdict, close};
pub use harmonics::HARMONICS;
pub use interval::Interval;
pub(super) use pick::LEVEL;
