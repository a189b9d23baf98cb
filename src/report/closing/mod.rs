//! The loop: what was found, before and after, and what remains.

mod json;
mod markdown;
mod parts;
mod problem;
mod text;

pub use json::loop_json;
pub use markdown::loop_markdown;
pub use problem::closed_problem;
pub use text::loop_text;
