//! Effects of the catalogue in the model: against the virtual rig, at zero, derivatives, and
//! recovery from data.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that fails may panic")]
#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

mod common;

#[path = "effects/catalogue.rs"]
mod catalogue;
#[path = "effects/commands.rs"]
mod commands;
#[path = "effects/derivatives.rs"]
mod derivatives;
#[path = "effects/formulas.rs"]
mod formulas;
#[path = "effects/laws.rs"]
mod laws;
#[path = "effects/recovery.rs"]
mod recovery;
#[path = "effects/rig.rs"]
mod rig;
#[path = "effects/rules.rs"]
mod rules;
