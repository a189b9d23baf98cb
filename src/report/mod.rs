//! Results as people and programs read them.

mod commands;
mod compare_json;
mod compare_text;
mod json;
mod parameters;
mod quantity;
mod study_json;
mod study_tables;
mod study_text;
mod text;

pub use commands::{commands_csv, commands_json, commands_text};
pub use compare_json::compare_json;
pub use compare_text::compare_text;
pub use json::estimate_json;
pub use study_json::study_json;
pub use study_tables::{study_csv, study_parameters_csv, study_timing_csv};
pub use study_text::study_text;
pub use text::{estimate_text, why_not_trusted};
