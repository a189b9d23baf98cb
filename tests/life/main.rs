//! Life of an arm: an earlier estimate as prior, changes since, and what siblings teach.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod carried;
mod fleet;
mod measured;
mod prior;
mod watch;
