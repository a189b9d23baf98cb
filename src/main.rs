//! The flexcal command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(flexcal::cli::run(std::env::args_os()))
}
