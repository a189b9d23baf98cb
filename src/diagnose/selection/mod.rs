//! The loop: fit, trace, add the effect, fit again, until nothing is left to find.

mod alternatives;
mod close;
mod interval;
mod pick;
mod retest;
mod rounds;
mod waves;

pub use close::{Closure, Found, Step, Verdict, close};
pub use interval::Interval;
pub(super) use pick::LEVEL;
pub use waves::WAVES;
