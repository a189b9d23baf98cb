//! Rendering of report blocks for terminals, Markdown and browsers.

mod html;
mod markdown;
mod poses;
mod style;
mod text;

pub use html::Report;
pub(super) use html::{page, report};
pub(super) use text::text;
pub use text::{limit_text_width, text_width};
