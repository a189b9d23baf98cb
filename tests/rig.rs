//! The virtual test rig against golden positions, hand calculations, its effects, and the rest of the program.

#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that fails may panic")]

#[path = "rig/bench.rs"]
mod bench;
#[path = "rig/effects.rs"]
mod effects;
#[path = "rig/golden.rs"]
mod golden;
#[path = "rig/hand.rs"]
mod hand;
#[path = "rig/simulate.rs"]
mod simulate;
