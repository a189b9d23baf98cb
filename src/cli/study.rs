//! Arguments and work of `flexcal study`.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use flexcal::files;
use flexcal::report::{self, shell_word};
use flexcal::results::{
    Document as _, MisprintResult, StudyResult, study_csv, study_parameters_csv, study_timing_csv,
};
use flexcal::study::{self, CellResult, MisprintStudy, Request, Shard, Store, Study};

use super::diagnostic;
use super::flags::Flags;
use super::outcome::Outcome;
use super::output::{self, REPORT, Results, WriteError};
use super::progress::count_during;

/// Arguments of `flexcal study`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(mut_arg("out", |arg| arg.help("Folder for results [default: out/<name of the study>]")))]
#[command(
    after_help = "Finished parts are kept in DIR/cells: what was interrupted goes on where it stopped.

Examples:
  flexcal study problems/lunar-sampler/STUDY.toml
  flexcal study STUDY.toml --out results --shard 1/2
  flexcal study STUDY.toml --out results --shard 2/2
  flexcal study merge STUDY.toml --out results
  flexcal study problems/lunar-sampler/MISPRINTS.toml"
)]
pub struct Arguments {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// A STUDY.toml, or the folder that holds one
    #[arg(required = true)]
    study: Option<PathBuf>,
    #[command(flatten)]
    flags: Flags,
    /// Make only the i-th of n shares, without results, which `study merge` writes
    #[arg(long, value_name = "i/n", conflicts_with = "json")]
    shard: Option<Shard>,
    /// Write FILE once all is done, with exit status 0, for workflows that wait for it; an older
    /// FILE is removed first
    #[arg(long, value_name = "FILE")]
    done: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Merge {
    /// Write the results of a study whose shares have all been done.
    Merge {
        #[command(flatten)]
        common: Common,
        /// Folders of the shares, if they are not DIR
        #[arg(long, value_name = "FOLDER", num_args = 1..)]
        from: Vec<PathBuf>,
    },
}

#[derive(Debug, Args)]
#[command(mut_arg("out", |arg| arg.help("Folder for results [default: out/<name of the study>]")))]
struct Common {
    /// A STUDY.toml, or the folder that holds one
    study: PathBuf,
    #[command(flatten)]
    flags: Flags,
}

/// File that the argument `--done` names, written when the study is finished.
struct Sentinel<'a>(&'a Path);

impl<'a> Sentinel<'a> {
    /// Contents of the file, by which it is recognised.
    const TEXT: &'static str = "flexcal study: done\n";

    /// Removes an existing file at `path`. Returns an error if `--done` did not write it.
    fn claim(path: &'a Path) -> Result<Self, WriteError> {
        let io = |source| WriteError::Io { path: path.to_owned(), source };
        if path.symlink_metadata().is_ok() {
            if files::read_text(path).map_err(io)? != Self::TEXT {
                return Err(WriteError::InTheWay {
                    path: path.to_owned(),
                    why: "a file that --done did not write is there",
                });
            }
            fs::remove_file(path).map_err(io)?;
        }
        Ok(Self(path))
    }

    /// Writes the file.
    fn write(self) -> Result<(), WriteError> {
        files::write_new(self.0, Self::TEXT)
            .map_err(|source| WriteError::Io { path: self.0.to_owned(), source })
    }
}

/// Error of an option `--from` whose folder does not exist.
#[derive(Debug, thiserror::Error)]
#[error("--from {}: no such folder", folder.display())]
struct NoFolder {
    folder: PathBuf,
}

/// Names of the files that a study of fits writes.
const RESULT_FILES: [&str; 5] =
    ["study.json", "parameters.csv", "timing.csv", "study.csv", "study.html"];

impl Common {
    /// Claims the file names for the results of a study.
    fn results(&self, study: &Study) -> Result<Results, WriteError> {
        self.claim(&study.name, &study.files, &RESULT_FILES)
    }

    /// Claims the file names `names` for results of the study `name`, which reads `files`.
    fn claim(&self, name: &str, files: &[PathBuf], names: &[&str]) -> Result<Results, WriteError> {
        self.flags.claim("study", name, files.to_vec(), names)
    }
}

/// Computes the unfinished fits, or merges shares. Then writes the files [`RESULT_FILES`] and
/// prints the table. For a share alone, writes no results.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    if let Some(Merge::Merge { common, from }) = &arguments.merge {
        let study = Study::read(&common.study)?;
        let results = common.results(&study)?;
        if let Some(folder) = from.iter().find(|folder| !folder.is_dir()) {
            return Err(NoFolder { folder: folder.clone() }.into());
        }
        let folders =
            if from.is_empty() { std::slice::from_ref(&results.folder) } else { from.as_slice() };
        let stores: Vec<Store> = folders.iter().map(|folder| Store::new(folder)).collect();
        return finish(common, &study, &results, &stores);
    }
    // Without a subcommand clap requires a study.
    let Some(study) = arguments.study.clone() else { return Ok(Outcome::Done) };
    let common = &Common { study, flags: arguments.flags.clone() };
    let sentinel = arguments.done.as_deref().map(Sentinel::claim).transpose()?;
    let outcome = compute(common, arguments.shard)?;
    if let (Some(sentinel), Outcome::Done) = (sentinel, &outcome) {
        sentinel.write()?;
    }
    Ok(outcome)
}

/// Computes the unfinished fits of a study, or only those of a share, and writes the results of a
/// whole study.
fn compute(common: &Common, shard: Option<Shard>) -> Result<Outcome, Box<dyn Error>> {
    let study = match Request::read(&common.study)? {
        Request::Fits(study) => *study,
        Request::Misprints(study) if shard.is_none() => return run_misprints(common, &study),
        // The reader of studies of fits reports why this file cannot be divided into shards.
        Request::Misprints(_) => Study::read(&common.study)?,
    };
    if study.problem.data.fits_orientation && !common.flags.quiet {
        diagnostic::warn("a study fits positions alone: orientation_sigma is left out");
    }
    let results = common.results(&study)?;
    let store = Store::new(&results.folder);
    compute_parts(common, &study, &store, shard.unwrap_or(Shard::WHOLE))?;
    if shard.is_none() {
        return finish(common, &study, &results, &[store]);
    }
    if common.flags.prints_text() {
        let (file, folder) = (shell_word(&common.study), shell_word(&results.folder));
        output::print(&format!(
            "Share done. After the last: flexcal study merge {file} --out {folder}\n"
        ))?;
    }
    Ok(Outcome::Done)
}

/// Runs a study of the misprints, writes `misprints.json` and the reports, and prints the tables.
fn run_misprints(common: &Common, study: &MisprintStudy) -> Result<Outcome, Box<dyn Error>> {
    let names = ["misprints.json", REPORT[0], REPORT[1]];
    let results = common.claim(&study.name, &study.files, &names)?;
    let fits = study.specimens * study.cases.len();
    let found = count_during(common.flags.prints_text(), "fits", (fits, 0), |advance| {
        study::replicate(study, advance)
    })?;
    let json = MisprintResult::new(study, &found).to_json();
    results.write_report(&[(names[0], &json)], &report::replica_report(study, &found))?;
    common
        .flags
        .print_result(&json, || report::replica_text(study, &found) + &results.written())?;
    Ok(Outcome::Done)
}

/// Computes the unfinished parts of a share of a study, with a progress bar.
fn compute_parts(
    common: &Common,
    study: &Study,
    store: &Store,
    shard: Shard,
) -> Result<(), Box<dyn Error>> {
    let parts = study::pending(study, store, shard)?;
    let share = study.parts().into_iter().enumerate().filter(|(index, _)| shard.holds(*index));
    let repetitions: usize = share.map(|(_, part)| part.repetitions.len()).sum();
    let open: usize = parts.iter().map(|part| part.repetitions.len()).sum();
    let counts = (repetitions, repetitions - open);
    count_during(common.flags.prints_text(), "fits", counts, |advance| {
        study::run(study, store, &parts, advance)
    })?;
    Ok(())
}

/// Collects the results of all parts, writes the files [`RESULT_FILES`] and prints the table. The
/// outcome is not trusted if all fits of a cell failed.
fn finish(
    common: &Common,
    study: &Study,
    results: &Results,
    stores: &[Store],
) -> Result<Outcome, Box<dyn Error>> {
    let found = study::collect(study, stores)?;
    let json = StudyResult::new(study, &found).to_json();
    let story = report::study(study, &found);
    let texts = [
        (RESULT_FILES[0], json.as_str()),
        (RESULT_FILES[1], &study_parameters_csv(study, &found)),
        (RESULT_FILES[2], &study_timing_csv(study, &found)),
        (RESULT_FILES[3], &study_csv(study, &found)),
        (RESULT_FILES[4], &story.page()),
    ];
    results.write(&texts)?;
    common.flags.print_result(&json, || {
        let next = "Next: parameters.csv has bias, scatter and coverage of each parameter; docs/study.md explains the columns\n";
        story.text() + &results.written() + next
    })?;
    let has_failed = |cell: &CellResult| cell.tally.failed() == cell.tally.fits;
    Ok(Outcome::from_trust(!found.cells.iter().any(has_failed)))
}
