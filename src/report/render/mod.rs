//! Blocks as terminals, Markdown and browsers show them.

mod html;
mod markdown;
mod style;
mod text;

pub use html::Page;
pub(super) use html::page;
pub(super) use markdown::markdown;
pub(super) use text::text;
