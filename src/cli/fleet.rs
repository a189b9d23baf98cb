//! Arguments and work of `flexcal fleet`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::life;
use flexcal::report::{self, shell_word};
use flexcal::results::{Document as _, FleetResult};

use super::diagnostic;
use super::estimate::Trust;
use super::outcome::Outcome;
use super::output::{self, Results};

/// Arguments of `flexcal fleet`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal fleet arms/*/estimate.json --out PRIOR.toml
  flexcal identify my-arm --prior PRIOR.toml")]
pub struct Arguments {
    /// An estimate.json of each arm; all arms have the same declaration
    #[arg(value_name = "ESTIMATE.json", required = true, num_args = 1..)]
    estimates: Vec<PathBuf>,
    /// File to write, which identify takes with --prior; the page of the same name ends in .html
    #[arg(short, long, value_name = "PRIOR.toml", default_value = "PRIOR.toml")]
    out: PathBuf,
    /// Also replace files that flexcal did not write or that were changed since
    #[arg(long)]
    force: bool,
    /// Print the result as JSON and nothing else
    #[arg(long)]
    json: bool,
    /// Print errors alone
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    trust: Trust,
}

/// Computes mean and spread of the fleet's parameters, writes them as a prior with an HTML page,
/// and prints them with a comparison of every arm.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let Arguments { estimates, out, force, json, quiet, trust } = arguments;
    let folder = out.parent().filter(|parent| !parent.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).to_owned();
    let name = out.file_name().map(|name| name.to_string_lossy().into_owned());
    let name = name.unwrap_or_else(|| "PRIOR.toml".to_owned());
    let flags = (*force, *quiet);
    let page = Path::new(&name).with_extension("html").display().to_string();
    let results = Results::claim("fleet", folder, estimates.clone(), &[&name, &page], flags)?;
    let read = estimates.iter().map(|file| trust.read(file)).collect::<Result<Vec<_>, _>>()?;
    let (trusted, others): (Vec<_>, Vec<_>) =
        read.into_iter().partition(|estimate| estimate.trusted);
    for estimate in &others {
        let file = estimate.file.display();
        diagnostic::warn(&format!(
            "{file}: its fit is not to be trusted, so that the arm is left out; see its findings"
        ));
    }
    let fleet = life::fleet(&trusted)?;
    let story = report::fleet(&fleet);
    results.write(&[(&name, &fleet.to_toml()), (&page, &story.page())])?;
    if *json {
        output::print_json(&FleetResult::new(&fleet).to_json())?;
    } else if !quiet {
        let text = story.text();
        let prior = shell_word(out);
        let next = format!(
            "flexcal identify PROBLEM --prior {prior} takes them as the prior of the next arm"
        );
        output::print(&format!("{text}{}Next: {next}\n", results.written()))?;
    }
    Ok(Outcome::Done)
}
