//! Results as people and programs read them.
//!
//! - [`estimate_text`], [`compare_text`], [`commands_text`]: tables of one command each, with their JSON beside them.
//! - [`trace`](trace_text), [`closing`](loop_text): the residual's story, as text, JSON, Markdown and a problem file.

mod cells;
mod check;
mod closing;
mod commands;
mod compare_json;
mod compare_text;
mod detection;
mod document;
mod effect;
mod errors;
mod expected;
mod findings;
mod html;
mod json;
mod markdown;
mod parameters;
mod plan;
pub mod plot_data;
mod poses;
mod quantity;
mod separation;
mod study_json;
mod study_tables;
mod study_text;
mod text;
mod trace;
mod waves;

pub use check::{check_json, check_text, why_not_sufficient};
pub use closing::{closed_problem, loop_json, loop_markdown, loop_text};
pub use commands::{commands_csv, commands_json, commands_text};
pub use compare_json::compare_json;
pub use compare_text::compare_text;
pub use html::{Page, closure_page, comparison_page, identification_page, is_figure};
pub use json::estimate_json;
pub use markdown::{comparison_markdown, identification_markdown};
pub use plan::{plan_json, plan_text};
pub use poses::poses_csv;
pub use study_json::study_json;
pub use study_tables::{study_csv, study_parameters_csv, study_timing_csv};
pub use study_text::study_text;
pub use text::{estimate_text, why_not_trusted};
pub use trace::{trace_json, trace_text};
