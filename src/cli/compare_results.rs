//! Arguments and work of `flexcal compare-results`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::fit::SavedEstimateError;
use flexcal::report::{self, HeldOutRow, Side, shell_word};
use nalgebra::Vector3;

use super::diagnostic;
use super::estimate::{ChangedTable, Trust};
use super::outcome::Outcome;
use super::output::{self, Results};

/// Name of the HTML page that the command writes.
const PAGE_FILE: &str = "compare-results.html";
/// Keys of the errors in an estimate.json, and the names that people read.
const ERROR_PARTS: [(&str, &str); 3] =
    [("held_out", "held out"), ("left_out", "left out"), ("identification", "fitted rows")];

/// Units of errors, as in the keys of an estimate.json and as printed.
const ERROR_UNITS: [(&str, &str); 3] = [("mm", "mm"), ("deg", "°"), ("px", "px")];

/// Arguments of `flexcal compare-results`.
#[derive(Debug, Args)]
#[command(after_help = "Writes compare-results.html.

Examples:
  flexcal compare-results out/spring/estimate.json out/autumn/estimate.json")]
pub struct Arguments {
    /// The estimate.json of the first result
    #[arg(value_name = "A.json")]
    first: PathBuf,
    /// The estimate.json of the second result
    #[arg(value_name = "B.json")]
    second: PathBuf,
    /// Folder for the page
    #[arg(short, long, value_name = "DIR", default_value = "out/compare-results")]
    out: PathBuf,
    /// Also replace a page that flexcal did not write or that was changed since
    #[arg(long)]
    force: bool,
    /// Print errors alone
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    trust: Trust,
}

/// Compares two estimates, writes the page and prints the differences.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let Arguments { first, second, out, force, quiet, trust } = arguments;
    let inputs = vec![first.clone(), second.clone()];
    let flags = (*force, *quiet);
    let results = Results::claim("compare-results", out.clone(), inputs, &[PAGE_FILE], flags)?;
    let sides = [read_side(first, *trust)?, read_side(second, *trust)?];
    let real = [first, second].map(|file| file.canonicalize().ok());
    if !quiet && real[0].is_some() && real[0] == real[1] {
        diagnostic::warn(&format!("A and B are the same file: {}", first.display()));
    }
    let is_second_better = report::predicts_better(&sides);
    let are_named_alike = sides[0].estimate.problem_name() == sides[1].estimate.problem_name();
    if !quiet && is_second_better.is_some() && !are_named_alike {
        diagnostic::warn("the two results are of problems with different names");
    }
    let story = report::difference(&sides);
    results.write(&[(PAGE_FILE, &story.page())])?;
    if !quiet {
        // Nothing follows from two results of different arms.
        let next = is_second_better.map_or_else(String::new, |is_second_better| {
            let better = shell_word(if is_second_better { second } else { first });
            format!("Next: flexcal watch PROBLEM --estimate {better} --data FILE says whether new rows contradict an estimate\n")
        });
        output::print(&format!("{}{}{next}", story.text(), results.written()))?;
    }
    Ok(Outcome::Done)
}

/// Reads one estimate with its errors and held-out rows.
fn read_side(file: &Path, trust: Trust) -> Result<Side, Box<dyn Error>> {
    let estimate = trust.read(file)?;
    let text = flexcal::files::read_text(file)
        .map_err(|source| SavedEstimateError::Unreadable { file: file.to_owned(), source })?;
    let document: serde_json::Value = serde_json::from_str(&text)
        .map_err(|source| SavedEstimateError::Syntax { file: file.to_owned(), source })?;
    let errors_in = |part: Option<&serde_json::Value>, name: &str| {
        let mut errors = Vec::new();
        for (size, unit, symbol) in ["mean", "rms", "max"]
            .into_iter()
            .flat_map(|size| ERROR_UNITS.map(|(unit, symbol)| (size, unit, symbol)))
        {
            let value = part.and_then(|part| part.get(format!("{size}_{unit}"))?.get("norm"));
            let norm = value.and_then(serde_json::Value::as_f64);
            errors.extend(norm.map(|norm| (format!("{name}, {size}, {symbol}"), norm)));
        }
        errors
    };
    let errors = ERROR_PARTS.map(|(key, name)| errors_in(document.get(key), name)).concat();
    let remainder = document.get("remainder");
    // The errors of left-out configurations stand in the place of those of held-out rows.
    let held_out = if document.get("left_out").is_some() { "left out" } else { "held out" };
    let without = |(key, name)| errors_in(remainder.and_then(|of| of.get(key)), name);
    let keys = [("held_out_without", held_out), ("identification_without", "fitted rows")];
    let without_remainder = keys.map(without).concat();
    Ok(Side { estimate, errors, without_remainder, held_out: held_out_rows(file, trust)? })
}

/// Returns the held-out rows with positions in the residuals.csv beside an estimate.json; empty if
/// there is no such file. `flexcal identify` writes both files.
fn held_out_rows(estimate: &Path, trust: Trust) -> Result<Vec<HeldOutRow>, ChangedTable> {
    let is_identified = estimate.file_name().is_some_and(|name| name == "estimate.json");
    let file = estimate.with_file_name("residuals.csv");
    let text = is_identified.then(|| flexcal::files::read_text(&file).ok()).flatten();
    if text.is_some() {
        trust.check_table(&file)?;
    }
    let text = text.unwrap_or_default();
    let mut table = csv::Reader::from_reader(text.as_bytes());
    let header = table.headers().cloned().unwrap_or_default();
    let is_joint = |name: &str| {
        name.strip_prefix('q').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
    };
    let error = |row: &csv::StringRecord| {
        let cell = |name: &str| row.get(header.iter().position(|column| column == name)?);
        let number = |name: &str| cell(name)?.parse::<f64>().ok();
        let vector = |part: &str| {
            let [x, y, z] = ["x", "y", "z"].map(|axis| number(&format!("{part}_{axis}_mm")));
            Some(Vector3::new(x?, y?, z?))
        };
        let residual = vector("residual")?;
        let joints = header.iter().zip(row).filter(|(name, _)| is_joint(name));
        let configuration = joints.map(|(_, cell)| cell).collect::<Vec<_>>().join(",");
        let row = HeldOutRow {
            line: cell("line")?.to_owned(),
            configuration,
            measured: vector("predicted")? + residual,
            error: residual.norm(),
        };
        (cell("held_out")? == "true").then_some(row)
    };
    Ok(table.records().flatten().filter_map(|row| error(&row)).collect())
}
