//! Advice on wrong arguments, printed as a tip below the message.

use std::ffi::OsString;
use std::path::Path;

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use flexcal::report::shell_word;

/// Words that are often given as options or values, and where to write what they mean.
const ELSEWHERE: [(&[&str], &str); 4] = [
    (
        &["--heldout", "--held-out", "--held_out", "--holdout", "--fraction"],
        "the problem says which poses are held out: held_out = { fraction = 0.3, seed = 1 } in [data]",
    ),
    (&["-d", "--file", "--files", "--measurements"], "--data FILE names measurement files"),
    (
        &["--sigma", "--position-sigma", "--position_sigma_mm"],
        "the problem says how accurate the instrument is: position_sigma_mm = 0.05 in [data]",
    ),
    (
        &["urdf", "URDF"],
        "leave --format out to write a URDF: --urdf ARM.urdf names the one to change",
    ),
];

/// Adds a tip to the error of wrong arguments if a usual mistake is recognised. `words` are the
/// arguments, with the name of the program first; `cli` has the commands.
pub fn with_tip(mut error: clap::Error, words: &[OsString], cli: &Command) -> clap::Error {
    if let Some(tip) = tip(&error, words, cli) {
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::SuggestedSubcommand);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    error
}

fn tip(error: &clap::Error, words: &[OsString], cli: &Command) -> Option<String> {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => Some(word.as_str()),
        _ => None,
    };
    let first = words.get(1)?.to_str()?;
    match error.kind() {
        ErrorKind::InvalidSubcommand => {
            let path = Path::new(context(ContextKind::InvalidSubcommand)?);
            let is_problem = path.is_dir() || path.extension().is_some_and(|end| end == "toml");
            let named = shell_word(path);
            is_problem.then(|| format!("write a command first, as in flexcal identify {named}"))
        }
        ErrorKind::UnknownArgument if first.starts_with('-') => {
            let is_command = |word: &&str| cli.find_subcommand(word).is_some();
            let command = words.iter().skip(1).filter_map(|word| word.to_str()).find(is_command)?;
            Some(format!(
                "write options behind the command, as in flexcal {command} PROBLEM {first}"
            ))
        }
        _ => {
            let word = context(ContextKind::InvalidValue).or(context(ContextKind::InvalidArg))?;
            let (_, tip) = ELSEWHERE.iter().find(|(words, _)| words.contains(&word))?;
            Some((*tip).to_owned())
        }
    }
}
