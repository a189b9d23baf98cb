//! Results as people and programs read them.

mod json;
mod parameters;
mod quantity;
mod text;

pub use json::estimate_json;
pub use text::{estimate_text, why_not_trusted};
