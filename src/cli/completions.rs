//! Arguments and work of `flexcal completions`.

use std::error::Error;

use clap::{Args, Command};
use clap_complete::Shell;

use super::outcome::Outcome;
use super::output;

/// Arguments of `flexcal completions`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal completions bash > ~/.local/share/bash-completion/completions/flexcal
  flexcal completions zsh > ~/.zfunc/_flexcal
  flexcal completions fish > ~/.config/fish/completions/flexcal.fish")]
pub struct Arguments {
    /// Shell whose script is printed
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the script with which a shell completes the arguments of `flexcal`.
pub fn run(arguments: &Arguments, mut flexcal: Command) -> Result<Outcome, Box<dyn Error>> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut flexcal, "flexcal", &mut script);
    output::print_unchanged(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}
