//! Texts, Markdown reports and HTML pages of results.
//!
//! Each command has a file that converts its result to blocks (`document`). `render` renders blocks
//! for terminals, as Markdown and as an HTML page ("page" for short); `figures` draws the figures
//! of pages.

mod acceptance;
mod brief;
mod candidates;
mod check;
mod closed_loop;
mod closed_problem;
mod compare;
mod compensate;
mod detection;
mod difference;
mod document;
mod effect;
mod errors;
mod export;
mod figures;
mod fleet;
mod forecast;
mod found_effects;
mod identify;
mod init;
mod next;
mod noise;
mod paper_tables;
mod parameters;
mod plan;
mod predict;
mod prior;
mod remainder;
mod render;
mod replica;
mod residual_tests;
mod row_kinds;
mod shell;
mod study;
mod trace;
mod unexplained;
mod verdict;
mod watch;

pub(crate) use acceptance::{acceptance_page, acceptance_text, tolerance_text};
pub(crate) use brief::{determines_nothing, estimate_brief};
pub(crate) use check::check_brief;
pub use closed_loop::{loop_report, loop_text};
pub(crate) use compensate::sides_not_stated;
pub(crate) use difference::{HeldOutRow, Side, difference, predicts_better};
pub(crate) use export::set_up_at;
pub(crate) use fleet::fleet;
pub(crate) use identify::joint_sources_text;
pub use identify::{estimate_text, identification_report};
pub(crate) use init::{init_text, sheet_text};
pub(crate) use noise::influential_rows_advice;
pub(crate) use predict::prediction;
pub(crate) use prior::is_prior_contradicted;
#[doc(hidden)]
pub use remainder::PredictionAccuracy;
pub(crate) use remainder::remainder_paragraph;
pub use render::Report;
#[doc(hidden)]
pub use render::{Story, limit_text_width, text_width};
pub(crate) use replica::{replica_report, replica_text};
pub(crate) use shell::shell_word;
pub(crate) use trace::names_cause;
pub(crate) use unexplained::lacks_masses;
pub(crate) use verdict::interrupted;
pub(crate) use watch::watch;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    check::{check, why_not_sufficient},
    closed_loop::loop_brief,
    closed_problem::closed_problem,
    compare::{compare_text, comparison_report},
    compensate::Doubts,
    compensate::commands_text,
    compensate::{certified_length, uncorrected_commands, undecided_commands, unknown_sides},
    export::{
        ExportRemarks, better_geometry, export_text, holds_whole_model, kept_at_end,
        set_up_comment, worse_than_nominal,
    },
    figures::is_figure,
    identify::why_not_trusted,
    next::next,
    plan::plan,
    predict::true_positions_sentence,
    remainder::remainder_text,
    study::study,
    trace::trace,
};
