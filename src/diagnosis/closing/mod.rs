//! The loop: fit, trace, add the effect, fit again, until nothing is left to find.

mod pick;
mod retest;
mod rounds;

pub use rounds::{Closure, Found, Verdict, close};
