//! Rendering of report blocks for terminals, Markdown and browsers.

mod html;
mod markdown;
mod poses;
mod style;
mod text;

pub(super) use html::report;
pub use html::{Report, Story};
pub(super) use text::text;
pub use text::{limit_text_width, text_width};
