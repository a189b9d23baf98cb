//! Arguments and work of `flexcal trace`.

use std::error::Error;

use clap::Args;
use flexcal::fit::Options;
use flexcal::results::{Document as _, PlotData, TraceResult};
use flexcal::{report, select};

use super::input::{Common, Input};
use super::outcome::Outcome;
use super::progress::Line;
use super::{advice, diagnostic};

/// Arguments of `flexcal trace`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal trace problems/lunar-sampler
  flexcal trace problems/ur10-ipa --data session_A.csv session_B.csv session_C.csv
  flexcal trace my-arm/problem.toml --json")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
}

/// Fits, ranks the effects that the residual points to, writes `trace.json` and `trace.html`, and
/// prints the ranking.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let Input { problem, mut data, results } =
        common.read("trace", &["trace.json", "trace.html"])?;
    common.warn_if_nothing_is_free(&problem);
    common.warn_of_orientation(&problem, &mut data);
    let trace = Line::during(common.prints_text(), None, |sink| {
        select::trace(&problem, &data, &Options::default().with_progress(sink))
    })?;
    let result = TraceResult::new(&problem, &trace);
    let json = result.to_json();
    // The effects are ranked in a fit to positions, whose model has no orientation of the tool.
    let plots = PlotData::of_identification(&problem.positions_alone(), &data, &trace.fit)?;
    let story = report::trace(&problem, &trace, Some(&plots));
    results.write(&[("trace.json", &json), ("trace.html", &story.page())])?;
    let outcome = diagnostic::report_fit(&trace.fit, common.quiet);
    common.print_result(&json, || {
        let next = advice::after_trace(common, &result);
        format!("{}{}Next: {next}\n", story.text(), results.written())
    })?;
    Ok(outcome)
}
