//! Errors and warnings on the terminal; an error in the input with the line of the file.

use std::error::Error;
use std::fs;
use std::io::{IsTerminal as _, Write as _};
use std::path::Path;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use flexcal::design::DesignError;
use flexcal::error::{
    InputError, InputErrorKind, Location, TableErrorKind, file_like, mask_hidden,
    message_with_causes, mistake, one_line,
};
use flexcal::fit::{Finding, FindingCode, Identification, SavedEstimateError};
use flexcal::report;

use super::outcome::Outcome;

/// Width of messages \[characters\], large enough that no line is wrapped.
const MESSAGE_WIDTH: usize = 1000;

/// Prints an error to standard error.
pub fn print(error: &(dyn Error + 'static)) {
    let mistake = mistake(error);
    let with_arguments =
        error.downcast_ref().and_then(by_arguments).or(mistake.and_then(with_argument));
    let message = with_arguments.unwrap_or_else(|| message_with_causes(error));
    let message = match missing_file(error, mistake).and_then(beside) {
        Some(beside) => format!("{message}; {beside}"),
        None => message,
    };
    show(Level::ERROR, &message, mistake.map(|input| &*input.location));
}

/// Returns the path that an error may say is missing.
fn missing_file<'a>(
    error: &'a (dyn Error + 'static),
    mistake: Option<&'a InputError>,
) -> Option<&'a Path> {
    let missing = match (mistake.map(|input| &*input.kind), error.downcast_ref()) {
        (Some(InputErrorKind::DataFileMissing { path }), _)
        | (_, Some(SavedEstimateError::NoSuchFile { file: path })) => path,
        _ => &mistake.filter(|input| input.location.line.is_none())?.location.file,
    };
    Some(missing)
}

/// Describes what is found in place of a missing file: a link without its target, a file below
/// folders that are separated by `\`, one whose name goes on behind a space, or one with a similar
/// name. `None` if the file exists, or nothing is found.
fn beside(missing: &Path) -> Option<String> {
    if missing.exists() {
        return None;
    }
    if let Some(link) = missing.ancestors().find(|path| path.is_symlink() && !path.exists()) {
        let target = fs::read_link(link).ok()?;
        return Some(format!(
            "{} is a link to {}, which is not there",
            link.display(),
            target.display()
        ));
    }
    let name = missing.to_str()?;
    let with_slashes = name.replace('\\', "/");
    if with_slashes != name && Path::new(&with_slashes).exists() {
        return Some(format!("on this system write {with_slashes}"));
    }
    let folder = missing.parent().filter(|folder| !folder.as_os_str().is_empty());
    let entries = fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?.flatten();
    let start = format!("{} ", missing.file_name()?.to_str()?);
    let mut names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    if let Some(longer) = names.find(|name| name.starts_with(&start)) {
        let path = missing.with_file_name(longer);
        return Some(format!("a name with spaces needs quotes: there is \"{}\"", path.display()));
    }
    file_like(missing).map(|file| format!("there is {}", file.display()))
}

/// Returns the message of an error in the input with the argument that would avoid it; `None` if no
/// argument would.
fn with_argument(error: &InputError) -> Option<String> {
    match *error.kind {
        InputErrorKind::Table(TableErrorKind::NoDataFiles) => {
            Some(format!("{error} or with --data"))
        }
        InputErrorKind::GivenFileMissing if error.location.file.to_str()?.contains(',') => {
            Some(format!("{error}; spaces separate files, as in --data a.csv b.csv"))
        }
        _ => None,
    }
}

/// Returns the message for an error of a design with the argument that caused or would avoid it;
/// `None` if there is no such argument.
fn by_arguments(error: &DesignError) -> Option<String> {
    match error {
        DesignError::NoRange(_) => Some(format!(
            "{error}, or name a TRUTH.toml with --truth whose [poses] say where to draw, or a \
             table of poses with --candidates"
        )),
        DesignError::TooFewCandidates { poses, candidates } => {
            Some(format!("--poses {poses}: there are only {candidates} candidates"))
        }
        DesignError::SameEffect { .. }
        | DesignError::DeclaredEffect { .. }
        | DesignError::CausesAlike { .. }
        | DesignError::FollowsTime { .. } => Some(format!("--separate: {error}")),
        _ => None,
    }
}

/// Prints a warning to standard error.
pub fn warn(message: &str) {
    show(Level::WARNING, message, None);
}

/// Prints that the command ends early, below its line of progress on a terminal.
pub fn interrupted(message: &str) {
    let mut terminal = std::io::stderr();
    if terminal.is_terminal() {
        // If this cannot be written, the message cannot either.
        let _ = writeln!(terminal);
    }
    show(Level::ERROR, message, None);
}

/// Prints the warnings of a fit and returns the outcome of the command that made it. If `quiet`,
/// prints only the reason why the fit is not trusted.
pub fn report_fit(fit: &Identification, quiet: bool) -> Outcome {
    if !fit.is_trusted() {
        warn(&report::why_not_trusted(fit));
    }
    if !quiet {
        print_cautions(fit);
    }
    Outcome::from_trust(fit.is_trusted())
}

/// Does the same as [`report_fit`] for a command whose text on standard output states the reason
/// why the fit is not trusted. If `prints_text`, and if both outputs are on a terminal, the warning
/// leaves the reason to the text, so that it is shown once.
pub fn report_fit_once(fit: &Identification, (quiet, prints_text): (bool, bool)) -> Outcome {
    let shows_text = std::io::stdout().is_terminal() && std::io::stderr().is_terminal();
    if fit.is_trusted() || !prints_text || !shows_text {
        return report_fit(fit, quiet);
    }
    warn("the fit is not to be trusted, for the reason below");
    print_cautions(fit);
    Outcome::NotMet
}

/// Prints the warnings of a fit, except the one that it is not trusted. Those that a named mistake
/// explains stand in the result and the report alone.
fn print_cautions(fit: &Identification) {
    let is_shown = |caution: &&Finding| {
        (fit.is_trusted() || caution.code != FindingCode::PriorsDecide)
            && !fit.is_consequence(caution)
    };
    fit.cautions().filter(is_shown).for_each(|caution| warn(&caution.to_string()));
}

/// Prints a message to standard error, with the excerpt of the input file if `location` has one.
fn show(level: Level<'_>, message: &str, location: Option<&Location>) {
    let (message, path) = (
        one_line(message),
        location.map(|location| one_line(&location.file.display().to_string())),
    );
    let title = level.primary_title(message);
    let excerpt = location.and_then(|location| Some((location, location.excerpt.as_ref()?)));
    let group = match excerpt {
        Some((_, excerpt)) => title.element(
            Snippet::source(mask_hidden(&excerpt.text))
                .line_start(excerpt.first_line)
                .path(path)
                .annotation(AnnotationKind::Primary.span(excerpt.span.clone())),
        ),
        None => Group::with_title(title),
    };
    let text = Renderer::styled().term_width(MESSAGE_WIDTH).render(&[group]);
    // If standard error is closed, nobody can read the message.
    let _ = writeln!(anstream::stderr(), "{text}");
}
