//! Virtual test rig: golden positions, hand calculations, effects, and use by the rest of the
//! program.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::float_cmp, reason = "what is written reads back exactly")]

mod common;

#[path = "rig/bench.rs"]
mod bench;
#[path = "rig/effects.rs"]
mod effects;
#[path = "rig/golden.rs"]
mod golden;
#[path = "rig/hand.rs"]
mod hand;
#[path = "rig/model.rs"]
mod model;
#[path = "rig/simulate.rs"]
mod simulate;
