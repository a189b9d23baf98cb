//! Results as people and programs read them.
//!
//! - [`estimate_text`], [`compare_text`], [`commands_text`]: tables of one command each, with their JSON beside them.
//! - [`trace`](trace_text), [`closing`](loop_text): the residual's story, as text, JSON, Markdown and a problem file.

mod checks;
mod closing;
mod commands;
mod compare_json;
mod compare_text;
mod document;
mod effect;
mod json;
mod parameters;
mod quantity;
mod text;
mod trace;

pub use closing::{closed_problem, loop_json, loop_markdown, loop_text};
pub use commands::{commands_csv, commands_json, commands_text};
pub use compare_json::compare_json;
pub use compare_text::compare_text;
pub use json::estimate_json;
pub use text::{estimate_text, why_not_trusted};
pub use trace::{trace_json, trace_text};
