//! `flexcal trace`.

use std::error::Error;

use clap::Args;
use flexcal::identify::Options;
use flexcal::{diagnose, report};

use super::input::{Common, Input};
use super::outcome::Outcome;
use super::progress::Line;
use super::{diagnostic, output};

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

/// Fits, traces what is left, writes `trace.json`, and prints the ranking.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let Input { problem, mut data, results } = common.read("trace", &["trace.json"])?;
    common.say_of_orientation(&problem, &mut data);
    let line = common.talks().then(Line::new);
    let options = Options::default().with_progress(line.as_ref().map(Line::sink));
    let result = diagnose::trace(&problem, &data, &options);
    if let Some(line) = line {
        line.clear();
    }
    let trace = result?;
    let json = report::trace_json(&problem, &trace);
    results.write(&[("trace.json", &json)])?;
    if common.json {
        output::print_json(&json)?;
    } else if common.talks() {
        output::print(&report::trace_text(&problem, &trace))?;
        output::print(&format!("\nWritten to {}\n", results.path("trace.json").display()))?;
    }
    Ok(diagnostic::judged(&trace.fit, common.quiet))
}
