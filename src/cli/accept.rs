//! Arguments and work of `flexcal accept`.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::files::{self, digest};
use flexcal::fit::{self, Options, SolverChoice, Strategy};
use flexcal::report;
use flexcal::results::{AcceptanceRecord, AcceptanceResult, Document as _};

use super::diagnostic;
use super::input::{Common, Input};
use super::outcome::Outcome;
use super::progress::Line;

/// Arguments of `flexcal accept`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal accept problems/lunar-sampler --instrument 'laser tracker, 1.5 inch reflector'
  flexcal accept out/lunar-sampler/problem.closed.toml

Writes acceptance.html, a page to print and sign, and acceptance.json with the digest of every input.")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The instrument, for the record
    #[arg(long, value_name = "TEXT")]
    instrument: Option<String>,
}

/// Identifies, judges the held-out poses, and writes the record and the page.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let Input { problem, data, results } =
        common.read("accept", &["acceptance.json", "acceptance.html"])?;
    fit::held_out_positions(&problem, &data)?;
    let options = Options::default().with_strategy(Strategy::Joint).with_solver(SolverChoice::Auto);
    let fit = |sink| fit::identify(&problem, &data, &options.with_progress(sink));
    let found = Line::during(common.talks(), None, fit)?;
    let judged = fit::acceptance(&problem, &data, &found)?;
    let file = common.problem_file();
    let inputs = std::iter::once(&file).chain(common.files(&problem));
    let record = AcceptanceRecord {
        inputs: inputs.map(|file| (file.clone(), sha256(file))).collect(),
        commit: commit(&file),
        instrument: arguments.instrument.clone(),
    };
    let result = AcceptanceResult::new(&problem, &data.measurements, &found, &judged, &record);
    let (json, page) = (result.to_json(), report::acceptance_page(&problem, &result));
    results.write(&[("acceptance.json", &json), ("acceptance.html", &page)])?;
    common.tell(&json, || {
        let text = report::acceptance_text(&problem, &result);
        let page = results.path("acceptance.html");
        format!("{text}{}Next: print {} and sign it\n", results.written(), page.display())
    })?;
    Ok(diagnostic::judged(&found, common.quiet))
}

/// Returns the SHA-256 digest of a file; `None` for a pipe, which cannot be read a second time.
fn sha256(file: &Path) -> Option<String> {
    file.is_file().then(|| fs::read(file).ok()).flatten().map(|bytes| digest(&bytes))
}

/// Returns the commit at HEAD of the git repository that contains a file; `None` if there is none.
fn commit(file: &Path) -> Option<String> {
    let whole = file.canonicalize().ok()?;
    let git =
        whole.ancestors().skip(1).map(|folder| folder.join(".git")).find(|git| git.exists())?;
    let read = |path: PathBuf| Some(files::read_text(&path).ok()?.trim().to_owned());
    // In a worktree .git is a file that names its folder, which names the folder of the references.
    let folder = match read(git.clone()) {
        Some(text) => git.parent()?.join(text.strip_prefix("gitdir: ")?),
        None => git,
    };
    let head = read(folder.join("HEAD"))?;
    let Some(name) = head.strip_prefix("ref: ") else { return Some(head) };
    let common =
        read(folder.join("commondir")).map_or_else(|| folder.clone(), |common| folder.join(common));
    read(common.join(name)).or_else(|| {
        let packed = read(common.join("packed-refs"))?;
        packed
            .lines()
            .find_map(|line| Some(line.strip_suffix(name)?.strip_suffix(' ')?.trim().to_owned()))
    })
}
