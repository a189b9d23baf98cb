//! `flexcal study`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use flexcal::monte_carlo::{self, CellResult, Shard, Store, Study};
use flexcal::report;

use super::outcome::Outcome;
use super::output;
use super::progress::FitBar;

/// Arguments of `flexcal study`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "Finished parts are kept in DIR/cells: what was interrupted goes on where it stopped.

Examples:
  flexcal study problems/lunar-sampler/STUDY.toml
  flexcal study STUDY.toml --out results --shard 1/2
  flexcal study STUDY.toml --out results --shard 2/2
  flexcal study merge STUDY.toml --out results")]
pub struct Arguments {
    #[command(subcommand)]
    merge: Option<Merge>,
    #[command(flatten)]
    common: Option<Common>,
    /// Do the i-th of n shares alone, and write no results: that is for `study merge`
    #[arg(long, value_name = "i/n", conflicts_with = "json")]
    shard: Option<Shard>,
}

#[derive(Debug, Subcommand)]
enum Merge {
    /// Write the results of a study whose shares have all been done.
    Merge {
        #[command(flatten)]
        common: Common,
        /// Folders of the shares, where they are not DIR
        #[arg(long, value_name = "FOLDER", num_args = 1..)]
        from: Vec<PathBuf>,
    },
}

#[derive(Debug, Args)]
struct Common {
    /// A STUDY.toml, or the folder that holds one
    study: PathBuf,
    /// Folder for results [default: out/<name of the study>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
    /// Print nothing but errors (and the JSON, where it is asked for)
    #[arg(long)]
    quiet: bool,
}

impl Common {
    fn folder(&self, study: &Study) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(&study.name))
    }

    /// Whether people read along.
    fn talks(&self) -> bool {
        !self.json && !self.quiet
    }
}

/// Does the fits that are not done yet, or merges; then writes `study.csv`, `study.json`, `parameters.csv`, `timing.csv`
/// and prints the table.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    if let Some(Merge::Merge { common, from }) = &arguments.merge {
        let study = Study::read(&common.study)?;
        let folder = common.folder(&study);
        let stores =
            if from.is_empty() { vec![Store::new(&folder)] } else { from.iter().map(|f| Store::new(f)).collect() };
        return finish(common, &study, &folder, &stores);
    }
    // Without a subcommand clap asks for these.
    let Some(common) = &arguments.common else { return Ok(Outcome::Done) };
    let study = Study::read(&common.study)?;
    let folder = common.folder(&study);
    let store = Store::new(&folder);
    fit(common, &study, &store, arguments.shard.unwrap_or(Shard::WHOLE))?;
    if arguments.shard.is_none() {
        return finish(common, &study, &folder, &[store]);
    }
    if common.talks() {
        let (file, folder) = (common.study.display(), folder.display());
        output::print(&format!("Share done. After the last: flexcal study merge {file} --out {folder}\n"))?;
    }
    Ok(Outcome::Done)
}

fn fit(common: &Common, study: &Study, store: &Store, shard: Shard) -> Result<(), Box<dyn Error>> {
    let parts = monte_carlo::pending(study, store, shard)?;
    let own = study.parts().into_iter().enumerate().filter(|(index, _)| shard.holds(*index));
    let all: usize = own.map(|(_, part)| part.repetitions.len()).sum();
    let open: usize = parts.iter().map(|part| part.repetitions.len()).sum();
    let bar = common.talks().then(|| FitBar::new(all as u64, (all - open) as u64));
    let done = monte_carlo::run(study, store, &parts, || bar.iter().for_each(FitBar::advance));
    bar.iter().for_each(FitBar::clear);
    Ok(done?)
}

fn finish(common: &Common, study: &Study, folder: &Path, stores: &[Store]) -> Result<Outcome, Box<dyn Error>> {
    let results = monte_carlo::collect(study, stores)?;
    let json = report::study_json(study, &results);
    let texts = [
        ("study.json", json.as_str()),
        ("parameters.csv", &report::study_parameters_csv(study, &results)),
        ("timing.csv", &report::study_timing_csv(&results)),
        ("study.csv", &report::study_csv(study, &results)),
    ];
    output::write_all(folder, &texts)?;
    if common.json {
        output::print(&json)?;
    } else if common.talks() {
        output::print(&report::study_text(study, &results))?;
        output::print(&format!(
            "\nWritten to {}, each parameter to parameters.csv beside it\n",
            folder.join("study.csv").display()
        ))?;
    }
    let hopeless = |cell: &CellResult| cell.tally.failed() == cell.tally.fits;
    Ok(if results.cells.iter().any(hopeless) { Outcome::NotTrusted } else { Outcome::Done })
}
