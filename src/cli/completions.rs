//! `flexcal completions`.

use std::error::Error;

use clap::{Args, CommandFactory as _};
use clap_complete::Shell;

use super::{Cli, Outcome, output};

/// Arguments of `flexcal completions`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal completions bash > ~/.local/share/bash-completion/completions/flexcal
  flexcal completions zsh > ~/.zfunc/_flexcal
  flexcal completions fish > ~/.config/fish/completions/flexcal.fish")]
pub struct Arguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints what makes a shell complete flexcal's arguments.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "flexcal", &mut script);
    output::print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}
