//! Reports: pages that are complete and self-contained, and formats that agree.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

#[path = "../common/mod.rs"]
mod common;

mod agreement;
mod page;
