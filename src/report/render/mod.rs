//! Blocks as terminals, Markdown and browsers show them.

mod html;
mod markdown;
mod poses;
mod style;
mod text;

pub use html::Report;
pub(super) use html::report;
pub(super) use text::{text, text_within};
