//! The flexcal command line.

#[deny(clippy::indexing_slicing)]
mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
