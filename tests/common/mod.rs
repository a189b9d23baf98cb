//! Shared fixtures of the tests: arms, and measurements simulated by the model.

#![allow(dead_code, reason = "each test takes what it needs")]

pub mod arms;
pub mod bounded;
pub mod effects;
pub mod golden;
pub mod made;
pub mod program;
pub mod reading;
pub mod schema;
