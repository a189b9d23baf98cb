//! Arguments and work of `flexcal man`.

use std::error::Error;
use std::path::PathBuf;

use clap::{Args, Command};
use clap_mangen::Man;

use super::outcome::Outcome;
use super::output::{self, Results};

/// Arguments of `flexcal man`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal man | man -l -
  flexcal man --out ~/.local/share/man/man1")]
pub struct Arguments {
    /// Also replace pages that flexcal did not write or that were changed since
    #[arg(long, requires = "out")]
    force: bool,
    /// Write the page of every command to this folder (flexcal.1, flexcal-identify.1, …), and print
    /// nothing
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Prints the manual page of `flexcal`, or writes those of all its commands.
pub fn run(arguments: &Arguments, flexcal: Command) -> Result<Outcome, Box<dyn Error>> {
    let mut flexcal = flexcal.disable_help_subcommand(true);
    flexcal.build();
    let Some(folder) = &arguments.out else {
        output::print_unchanged(&page(flexcal)?)?;
        return Ok(Outcome::Done);
    };
    let mut pages = Vec::new();
    for command in flexcal.get_subcommands() {
        let name = format!("flexcal-{}", command.get_name());
        pages.push((format!("{name}.1"), page(command.clone().display_name(name))?));
    }
    pages.push(("flexcal.1".to_owned(), page(flexcal)?));
    let pages: Vec<(&str, &str)> =
        pages.iter().map(|(name, page)| (name.as_str(), page.as_str())).collect();
    Results::claim("man", folder.clone(), Vec::new(), &[], (arguments.force, true))?
        .write(&pages)?;
    Ok(Outcome::Done)
}

/// Returns the manual page of a command in roff.
fn page(command: Command) -> Result<String, std::io::Error> {
    let mut page = Vec::new();
    Man::new(command).render(&mut page)?;
    Ok(String::from_utf8_lossy(&page).into_owned())
}
