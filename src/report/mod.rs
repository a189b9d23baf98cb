//! Results as people and programs read them.

mod compare_json;
mod compare_text;
mod json;
mod parameters;
mod quantity;
mod text;

pub use compare_json::compare_json;
pub use compare_text::compare_text;
pub use json::estimate_json;
pub use text::{estimate_text, why_not_trusted};
