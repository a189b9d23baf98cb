//! What the residual of a fit points to.

mod json;
mod text;

pub use json::trace_json;
pub(super) use text::ranking;
pub use text::trace_text;
