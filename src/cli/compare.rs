//! Arguments and work of `flexcal compare`.

use std::error::Error;

use clap::Args;
use flexcal::fit::{self, CompareOptions};
use flexcal::report;
use flexcal::results::{ComparisonResult, Document as _, PlotData, exceeds_noise};

use super::diagnostic;
use super::input::{Common, Input};
use super::outcome::Outcome;
use super::output::REPORT;
use super::progress::Line;

/// Arguments of `flexcal compare`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal compare problems/lunar-sampler
  flexcal compare problems/lunar-sampler --json --out results")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// Include the procedure of [Chen2021]; it is always included if the problem declares the
    /// paper's arm
    #[arg(long)]
    paper: bool,
}

/// Compares strategies, solvers and ablations, writes `compare.json` and both reports, and prints
/// the tables.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let Input { problem, data, results } =
        common.read("compare", &["compare.json", REPORT[0], REPORT[1]])?;
    let comparison = Line::during(common.prints_text(), None, |progress| {
        fit::compare(&problem, &data, &CompareOptions { paper: arguments.paper, progress })
    })?;
    let json = ComparisonResult::new(&problem, &comparison).to_json();
    let shown = PlotData::of_comparison(&problem, &data, &comparison)?;
    let told = report::comparison_report(&problem, &comparison, &shown);
    results.write_report(&[("compare.json", &json)], &told)?;
    let outcome = diagnostic::report_fit(&comparison.joint, common.quiet);
    common.print_result(&json, || {
        let text = report::compare_text(&problem, &comparison);
        let lacks = exceeds_noise(&comparison.joint);
        let (command, what) = if !comparison.joint.is_trusted() {
            ("identify", "says what to correct")
        } else if lacks {
            ("loop", "looks for what the model lacks")
        } else {
            ("identify", "writes the estimate of the joint fit")
        };
        format!(
            "{text}{}Next: flexcal {command} {} {what}\n",
            results.written(),
            common.problem_arguments()
        )
    })?;
    Ok(outcome)
}
