//! Tips for usual mistakes in the arguments, printed below the message of the argument parser.

use std::ffi::OsString;
use std::path::Path;

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use flexcal::report::shell_word;

/// Words that are often given as options or values but are neither, with the tip for them.
const MISTAKEN_WORDS: [(&[&str], &str); 18] = [
    (
        &["--output", "--ouput", "--outdir", "--out-dir", "--output-dir", "-o"],
        "--out DIR names the folder of the results",
    ),
    (
        &["--heldout", "--held-out", "--held_out", "--holdout", "--fraction"],
        "the problem says which poses are held out: held_out = { fraction = 0.3, seed = 1 } in \
         [data]; identify --held-out none fits all of them",
    ),
    (
        &["-d", "--file", "--files", "--measurements", "--input", "-i", "--table", "--csv"],
        "--data FILE names measurement files",
    ),
    (
        &["--targets", "--target", "--waypoints", "--points"],
        "tables of targets follow --data, as in flexcal compensate PROBLEM --estimate \
         estimate.json --data TARGETS.csv",
    ),
    (
        &["-e", "--est", "--result", "--results", "--calibration"],
        "--estimate FILE names the estimate.json of an identification",
    ),
    (
        &["-p", "--problem", "--config", "-c"],
        "the problem needs no option: it is the first argument after the command",
    ),
    (
        &["-n", "--number", "--count", "--num-poses", "--n-poses"],
        "--poses N is the number of poses",
    ),
    (&["-f", "--overwrite", "--yes", "-y"], "--force replaces files that were changed"),
    (
        &["--free", "--fix", "--fixed", "--hold", "--parameters", "--params"],
        "the problem says which parameters are fitted: its section [parameters]",
    ),
    (
        &["--strategies", "--solvers"],
        "compare fits with every strategy and solver; identify --strategy and --solver choose one",
    ),
    (
        &["--effect", "--effects", "--max-effects", "--candidates-of", "--laws"],
        "trace and loop try every effect and need no limit; the problem declares effects that are \
         always fitted: [[effect]]",
    ),
    (
        &["-j", "--threads", "--jobs"],
        "the environment variable RAYON_NUM_THREADS sets the number of threads",
    ),
    (
        &["--sigma", "--position-sigma", "--position_sigma_mm"],
        "the problem says how accurate the instrument is: position_sigma_mm = 0.05 in [data]",
    ),
    (
        &["--noise", "--position-noise", "--noise-mm"],
        "the file of --truth says how large the noise of a simulation is: position_sigma_mm = 0.05 in \
         [noise]",
    ),
    (
        &["urdf", "URDF"],
        "leave --format out to write a URDF: --urdf ARM.urdf names the one to change",
    ),
    (&["lm", "LM", "levmar", "marquardt"], "levenberg-marquardt is the name of that solver"),
    (&["gn", "GN", "newton"], "gauss-newton is the name of that solver"),
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
    // The tip to write an unknown option behind `--` as a value leads nowhere.
    if error.kind() == ErrorKind::UnknownArgument && error.get(ContextKind::SuggestedArg).is_none()
    {
        error.remove(ContextKind::Suggested);
    }
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
    let is_value = |kind| matches!(kind, ErrorKind::InvalidValue | ErrorKind::ValueValidation);
    if words.iter().any(|word| word.is_empty()) && is_value(error.kind()) {
        let tip = "an argument is empty, as it is if a variable of the shell has no value";
        return Some(tip.to_owned());
    }
    let value = context(ContextKind::InvalidValue).filter(|_| is_value(error.kind()));
    if let Some(tip) = value.and_then(percentage) {
        return Some(tip);
    }
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
                None => inner_command(&word, cli),
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
        ErrorKind::MissingRequiredArgument if first == "compensate" => Some(
            "flexcal identify writes estimate.json, and flexcal loop one in its folder closed: \
             --estimate out/<name of the problem>/estimate.json"
                .to_owned(),
        ),
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
                let spaced = || valueless(word, words, cli).or_else(|| unquoted(word, words));
                let second = || two_estimates(word, words).or_else(|| second_problem(word, words));
                let found = long_dash(word).or_else(|| negative_number(words));
                let found = found.or_else(other).or_else(table).or_else(spaced).or_else(second);
                found.filter(|_| is_unknown)
            })
        }
    }
}

/// Returns the tip for a command that is part of another one, as `merge` is of `study`; `None` if
/// `word` is no such command.
fn inner_command(word: &str, cli: &Command) -> Option<String> {
    let outer = cli.get_subcommands().find(|outer| outer.find_subcommand(word).is_some())?;
    Some(format!("flexcal {} {word} may be meant", outer.get_name()))
}

/// Returns the tip for a value in percent; `None` for other values.
fn percentage(value: &str) -> Option<String> {
    let percent: f64 = value.strip_suffix('%')?.trim().parse().ok()?;
    let fraction: f64 = format!("{:.11e}", percent / 100.0).parse().ok()?;
    Some(format!("write {fraction} for {value}"))
}

/// Returns the tip for a word behind an option that takes no value; `None` for other words.
fn valueless(word: &str, words: &[OsString], cli: &Command) -> Option<String> {
    let place = words.iter().position(|other| other == word)?;
    let option = words.get(place.checked_sub(1)?)?.to_str()?;
    let command = cli.find_subcommand(words.get(1)?)?;
    let is_it = |argument: &&clap::Arg| {
        argument.get_long().is_some_and(|long| option == format!("--{long}"))
            || argument.get_short().is_some_and(|short| option == format!("-{short}"))
    };
    let argument = command.get_arguments().find(is_it)?;
    (!argument.get_action().takes_values())
        .then(|| format!("{option} takes no value: leave {word} out"))
}

/// Returns the tip for a second word of a value; `None` if no word precedes it that follows an
/// option.
fn unquoted(word: &str, words: &[OsString]) -> Option<String> {
    let words: Vec<&str> = words.iter().filter_map(|word| word.to_str()).collect();
    let place = words.iter().position(|other| *other == word)?;
    let [option, first] = words.get(place.checked_sub(2)?..place)? else { return None };
    let is_option = option.starts_with("--") && !option.contains('=') && !first.starts_with('-');
    let is_number = |word: &&&str| word.trim_end_matches(',').parse::<f64>().is_ok();
    let numbers = words.iter().skip(place - 1).take_while(is_number);
    let numbers: Vec<&str> = numbers.map(|word| word.trim_end_matches(',')).collect();
    if is_option && numbers.len() > 1 {
        return Some(format!(
            "several numbers have commas and no spaces: {option}={}",
            numbers.join(",")
        ));
    }
    (is_option && !word.starts_with('-'))
        .then(|| format!("a value with a space needs quotes: {option} \"{first} {word}\""))
}

/// Returns the tip for an option that begins with a dash of typeset text; `None` for other words.
fn long_dash(word: &str) -> Option<String> {
    if !word.starts_with('-') && !word.starts_with(['–', '—', '−'])
        || !word.contains(['–', '—', '−'])
    {
        return None;
    }
    let name = word.trim_start_matches(['–', '—', '−', '-']);
    let option = format!("--{name}");
    (name.len() < word.len())
        .then(|| format!("{word:?} begins with a dash of typeset text: write {option}"))
}

/// Returns the tip for two estimates after `compare`; `None` for other arguments.
fn two_estimates(word: &str, words: &[OsString]) -> Option<String> {
    let first =
        words.get(2).filter(|_| words.get(1).is_some_and(|command| command == "compare"))?;
    let estimates = [Path::new(first), Path::new(word)];
    let is_json = |path: &&Path| path.extension().is_some_and(|end| end == "json");
    let [first, second] = estimates.map(shell_word);
    estimates.iter().all(is_json).then(|| {
        format!("compare-results compares two estimates: flexcal compare-results {first} {second}")
    })
}

/// Returns the tip for a second problem; `None` if `word` is none, or if no problem precedes it.
fn second_problem(word: &str, words: &[OsString]) -> Option<String> {
    let is_problem = |word: &Path| word.is_dir() || word.extension().is_some_and(|of| of == "toml");
    let first = words.get(2).filter(|first| is_problem(Path::new(first)))?;
    let first = shell_word(Path::new(first));
    is_problem(Path::new(word)).then(|| format!("a command takes one problem, here {first}"))
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
    let seed = if option == "--seed" && FITTING.contains(&command) {
        "; the problem says which rows are held out: held_out = { fraction = 0.3, seed = 1 } in [data]"
    } else {
        ""
    };
    let others = others.join(", ");
    Some(format!("{command} takes no {option}{instead}; it is an option of {others}{seed}"))
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
