//! Results as people and programs read them.

mod commands;
mod compare_json;
mod compare_text;
mod json;
mod parameters;
mod quantity;
mod text;

pub use commands::{commands_csv, commands_json, commands_text};
pub use compare_json::compare_json;
pub use compare_text::compare_text;
pub use json::estimate_json;
pub use text::{estimate_text, why_not_trusted};
