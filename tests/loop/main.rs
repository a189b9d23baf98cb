//! From a fit to the causes of its residual: screening, evidence, rules, checks, commands.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

#[path = "../common/mod.rs"]
mod common;

mod cases;
mod checks;
mod command;
mod custom_effect;
mod evidence;
mod evidence_laws;
mod harmonics;
mod limits;
mod masses;
mod rows_apart;
mod screening;
mod selection_rules;
mod stopped;
mod unsure;
