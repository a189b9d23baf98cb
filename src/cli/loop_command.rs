//! `flexcal loop`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{fs, io};

use clap::Args;
use flexcal::diagnose;
use flexcal::identify::Options;
use flexcal::report::{self, PlotData};

use super::input::{Common, Input};
use super::outcome::Outcome;
use super::progress::Line;
use super::{diagnostic, output};

/// Arguments of `flexcal loop`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal loop problems/lunar-sampler
  flexcal loop problems/ur10-ipa --data session_A.csv session_B.csv session_C.csv
  flexcal identify out/lunar-sampler/problem.closed.toml

Writes loop.json, problem.closed.toml (the problem with the effects that were found declared, a valid input again),
report.md and report.html, with its figures in figures/.")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
}

/// Closes the loop, writes `loop.json`, `problem.closed.toml` and both reports, and prints the story.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let Input { problem, data } = common.read()?;
    let text = fs::read_to_string(common.problem_file())?;
    let line = common.talks().then(Line::new);
    let options = Options::default().with_progress(line.as_ref().map(Line::sink));
    let result = diagnose::close(&problem, &data, &options);
    if let Some(line) = line {
        line.clear();
    }
    let closure = result?;
    let json = report::loop_json(&problem, &closure);
    let folder = output::folder(&common.folder(&problem))?;
    let files = common.files(&problem).iter().map(|file| seen_from(&folder, file)).collect::<Result<Vec<_>, _>>()?;
    let shown = PlotData::of_loop(&problem, &data, &closure)?;
    let results = [
        ("loop.json", json.as_str()),
        ("problem.closed.toml", &report::closed_problem(&text, &problem, &closure, &files)?),
    ];
    let told = report::loop_report(&problem, &closure, &shown);
    output::write_report(&folder, &results, &told)?;
    if common.json {
        output::print(&json)?;
    } else if common.talks() {
        output::print(&report::loop_text(&problem, &closure))?;
        let names = "loop.json, problem.closed.toml, report.md, report.html";
        output::print(&format!("\nWritten to {}: {names}\n", folder.display()))?;
    }
    Ok(diagnostic::judged(&closure.after, common.quiet))
}

/// A file as seen from a folder; absolute where no relative path leads there.
fn seen_from(folder: &Path, file: &Path) -> io::Result<PathBuf> {
    let (folder, file) = (folder.canonicalize()?, file.canonicalize()?);
    Ok(pathdiff::diff_paths(&file, folder).unwrap_or(file))
}
