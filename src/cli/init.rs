//! `flexcal init`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::report;
use flexcal::urdf::{Chain, Robot, describe};

use super::outcome::Outcome;
use super::output;
use super::output::Results;

/// Arguments of `flexcal init`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal init panda.urdf --tip panda_link8 --out panda
  flexcal identify panda --data measurements.csv")]
pub struct Arguments {
    /// The URDF (expand a xacro first)
    #[arg(value_name = "ARM.urdf")]
    urdf: PathBuf,
    /// Link at the base of the arm [default: the root]
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// Link at its tip, which carries the target [default: the only leaf]
    #[arg(long, value_name = "LINK")]
    tip: Option<String>,
    /// Folder for problem.toml [default: out/<name of the robot>]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace a problem.toml that flexcal did not write, or that was changed since
    #[arg(long)]
    force: bool,
    /// Print what was made as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Writes the chain between two links as `problem.toml`.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let robot = Robot::read(&arguments.urdf)?;
    let chain = Chain::new(&robot, arguments.base.as_deref(), arguments.tip.as_deref())?;
    let description = describe(&chain)?;
    let folder = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(&description.name));
    let inputs = vec![arguments.urdf.clone()];
    let results = Results::claim("init", folder, inputs, &["problem.toml"], (arguments.force, arguments.quiet))?;
    results.write(&[("problem.toml", &description.text)])?;
    let file = results.path("problem.toml");
    if arguments.json {
        output::print_json(&report::init_json(&chain, &description, &file))?;
    } else if !arguments.quiet {
        output::print(&report::init_text(&chain, &description, &results.folder))?;
    }
    Ok(Outcome::Done)
}
