//! Tips for usual mistakes in the arguments, printed below the message of the argument parser.

use std::ffi::OsString;
use std::path::Path;

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use flexcal::report::shell_word;

/// Words that are often given as options or values but are neither, with the tip for them.
const MISTAKEN_WORDS: [(&[&str], &str); 6] = [
    (
        &["--output", "--ouput", "--outdir", "--out-dir", "--output-dir", "-o"],
        "--out DIR names the folder of the results",
    ),
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
    (&["csv", "CSV"], "mdh or dh write the table of Denavit-Hartenberg parameters, as YAML"),
];

/// Commands, with the words that are often given for their names.
const SYNONYMS: [(&str, &[&str]); 6] = [
    (
        "identify",
        &["calibrate", "calibration", "fit", "estimate", "solve", "identification", "run"],
    ),
    ("compensate", &["correct", "apply", "inverse"]),
    ("simulate", &["sim", "simulation", "generate"]),
    ("loop", &["search", "select", "find", "discover"]),
    ("accept", &["validate", "verify", "validation", "acceptance"]),
    ("init", &["new", "create", "import"]),
];

/// Adds a tip to the error of wrong arguments if a usual mistake is recognised. `words` are the
/// arguments, with the name of the program first; `cli` has the commands.
pub fn with_tip(mut error: clap::Error, words: &[OsString], cli: &Command) -> clap::Error {
    if let Some(tip) = tip(&error, words, cli) {
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::SuggestedSubcommand);
        error.remove(ContextKind::SuggestedValue);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    error
}

/// Returns the tip for an error; `None` if no usual mistake is recognised.
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
            let word = path.to_str().unwrap_or_default().to_lowercase();
            let synonym = SYNONYMS.iter().find(|(_, words)| words.contains(&word.as_str()));
            match synonym {
                _ if is_problem => {
                    Some(format!("write a command first, as in flexcal identify {named}"))
                }
                Some((command, _)) => Some(format!("flexcal {command} may be meant")),
                None => None,
            }
        }
        ErrorKind::MissingRequiredArgument if first == "export" => {
            let is_given = |option: &str| {
                words.iter().filter_map(|word| word.to_str()).any(|word| word.starts_with(option))
            };
            let chooses_form = is_given("--urdf") || is_given("--format");
            (!chooses_form).then(|| {
                format!(
                    "--urdf ARM.urdf writes into a URDF; the values of --format are {}",
                    super::export::formats().join(", ")
                )
            })
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
            let elsewhere = MISTAKEN_WORDS.iter().find(|(words, _)| words.contains(&word));
            let is_unknown = error.kind() == ErrorKind::UnknownArgument;
            elsewhere.map(|(_, tip)| (*tip).to_owned()).or_else(|| {
                let other = || other_command(word, first, cli);
                let table = || table_without_option(word, first);
                negative_number(words).or_else(other).or_else(table).filter(|_| is_unknown)
            })
        }
    }
}

/// Returns the tip for a negative number after an option, which the parser takes for another
/// option. `None` if there is no such number.
fn negative_number(words: &[OsString]) -> Option<String> {
    let words: Vec<&str> = words.iter().filter_map(|word| word.to_str()).collect();
    let mut pairs = words.iter().zip(words.iter().skip(1));
    let (option, value) = pairs.find(|(option, value)| {
        option.starts_with("--") && value.starts_with('-') && value.parse::<f64>().is_ok()
    })?;
    Some(format!(
        "{option} is followed by {value}, which is read as an option; most options take numbers \
         above zero, and others are written {option}={value}"
    ))
}

/// Returns the tip for a table that is given without `--data`; `None` if the word names none.
fn table_without_option(word: &str, command: &str) -> Option<String> {
    let end = Path::new(word).extension()?.to_str()?.to_lowercase();
    let table = shell_word(Path::new(word));
    ["csv", "txt", "tsv", "dat"].contains(&end.as_str()).then(|| {
        format!(
            "tables of measurements follow --data, as in flexcal {command} PROBLEM --data {table}"
        )
    })
}

/// Returns the tip for an `option` that `command` does not have but others do; `None` if no command
/// has it.
fn other_command(option: &str, command: &str, cli: &Command) -> Option<String> {
    let name = option.strip_prefix("--")?;
    cli.find_subcommand(command)?;
    let has_option =
        |other: &&Command| other.get_arguments().any(|argument| argument.get_long() == Some(name));
    let others: Vec<&str> =
        cli.get_subcommands().filter(has_option).map(Command::get_name).collect();
    if others.is_empty() {
        return longer_option(option, command, cli);
    }
    let fits = FITTING.contains(&command) && option == "--estimate";
    let instead = if fits { ", because it fits by itself" } else { "" };
    Some(format!("{command} takes no {option}{instead}; it is an option of {}", others.join(", ")))
}

/// Commands that fit the measurements and so need no estimate.
const FITTING: [&str; 7] = ["identify", "compare", "trace", "loop", "accept", "check", "next"];

/// Returns the tip for an `option` that is the beginning of an option of other commands, such as
/// `--tolerance` of `--tolerance-mm`. `None` if there is none, or if `command` has such an option.
fn longer_option(option: &str, command: &str, cli: &Command) -> Option<String> {
    let start = format!("{}-", option.strip_prefix("--")?);
    let longer = |of: &Command| {
        let mut names = of.get_arguments().filter_map(|argument| argument.get_long());
        names.find(|name| name.starts_with(&start)).map(str::to_owned)
    };
    if cli.find_subcommand(command).and_then(longer).is_some() {
        return None;
    }
    let name = cli.get_subcommands().find_map(longer)?;
    let has_option = |of: &&Command| longer(of).is_some_and(|other| other == name);
    let others: Vec<&str> =
        cli.get_subcommands().filter(has_option).map(Command::get_name).collect();
    Some(format!("{command} takes no {option}; --{name} is an option of {}", others.join(", ")))
}
