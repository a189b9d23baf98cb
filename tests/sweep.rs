//! The loop on many data sets of the independent rig with known truth.
//!
//! A representative part runs with all other tests; `docs/sweep.md` has the figures of the whole.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

mod common;

#[path = "sweep/arms.rs"]
mod arms;
#[path = "sweep/bench.rs"]
mod bench;
#[path = "sweep/calibration.rs"]
mod calibration;
#[path = "sweep/families.rs"]
mod families;
#[path = "sweep/full.rs"]
mod full;
#[path = "sweep/industrial.rs"]
mod industrial;
#[path = "sweep/judged.rs"]
mod judged;
#[path = "sweep/outside.rs"]
mod outside;
#[path = "sweep/quick.rs"]
mod quick;
