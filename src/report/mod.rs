//! Texts, pages and tables of results.
//!
//! Each command has a file that puts its result into blocks (`document`). `render` shows blocks on
//! terminals, as Markdown and as a page; `figures` draws the figures of pages.

mod acceptance;
mod around;
mod brief;
mod check;
mod closed_loop;
mod closed_problem;
mod columns;
mod compare;
mod compensate;
mod detection;
mod document;
mod effect;
mod errors;
mod export;
mod figures;
mod findings;
mod forecast;
mod identify;
mod init;
mod limits;
mod noise;
mod paper_tables;
mod parameters;
mod plan;
mod poses;
mod predict;
mod probability;
mod quantity;
mod remainder;
mod render;
mod replica;
mod separation;
mod shell;
mod study;
mod table;
mod trace;
mod unexplained;
mod verdict;

pub use acceptance::{AcceptanceRecord, acceptance_page, acceptance_result, acceptance_text};
pub use brief::{estimate_brief, tells_little};
pub use check::{check_text, why_not_sufficient};
pub use closed_loop::{loop_brief, loop_report, loop_text};
pub use closed_problem::{closed_problem, with_remainder};
pub use columns::{Column, Columns, residual_columns, residuals_csv};
pub use compare::{compare_text, comparison_report};
pub use compensate::{commands_csv, commands_text};
pub use export::{ExportErrors, Exported, export_text};
pub use figures::{
    Cause, Contribution, Coverage, PlotData, Point, PoseError, Quantity, Stage, StageErrors,
    is_figure,
};
pub use identify::{estimate_text, identification_report, joint_sources_text, why_not_trusted};
pub use init::init_text;
pub use noise::{lacks_something, show_influential_rows};
pub use plan::plan_text;
pub use poses::poses_csv;
pub use predict::{prediction_text, predictions_csv};
pub use remainder::remainder_text;
pub use render::Report;
pub use replica::{replica_report, replica_text};
pub use shell::shell_word;
pub use study::{study_csv, study_parameters_csv, study_text, study_timing_csv};
pub use table::Command;
pub use trace::trace_text;
pub use verdict::interrupted;
