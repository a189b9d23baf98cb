//! Arguments and work of `flexcal init`.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use flexcal::report;
use flexcal::results::{Document as _, InitResult};
use flexcal::urdf::{Chain, Robot, describe};

use super::flags::Flags;
use super::outcome::Outcome;

/// Arguments of `flexcal init`.
#[derive(Debug, Args)]
#[command(
    mut_arg("out", |arg| arg.help("Folder for problem.toml [default: out/<name of the robot>]")),
    after_help = "Examples:
  flexcal init panda.urdf --tip panda_link8 --out panda
  flexcal identify panda --data measurements.csv"
)]
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
    #[command(flatten)]
    flags: Flags,
}

/// Writes the chain between two links as `problem.toml`.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let robot = Robot::read(&arguments.urdf)?;
    let chain = Chain::new(&robot, arguments.base.as_deref(), arguments.tip.as_deref())?;
    let description = describe(&chain)?;
    let flags = &arguments.flags;
    let results =
        flags.claim("init", &description.name, vec![arguments.urdf.clone()], &["problem.toml"])?;
    results.write(&[("problem.toml", &description.text)])?;
    let file = results.path("problem.toml");
    let json = InitResult::new(&chain, &description, &file).to_json();
    flags.print_result(&json, || report::init_text(&chain, &description, &results.folder))?;
    Ok(Outcome::Done)
}
