//! Command line: arguments, progress and printing. No other module prints.

#![allow(rustdoc::invalid_html_tags, reason = "<name> in a help text is for the terminal")]

mod accept;
mod advice;
mod camera_advice;
mod check;
mod compare;
mod compare_results;
mod compensate;
mod completions;
mod course;
mod diagnostic;
mod estimate;
mod export;
mod flags;
mod fleet;
mod git;
mod identify;
mod init;
mod input;
mod interrupt;
mod loop_command;
mod loop_record;
mod man;
mod mistaken;
mod next;
mod outcome;
mod output;
mod plan;
mod poses;
mod predict;
mod progress;
mod simulate;
mod study;
mod threads;
mod trace;
mod values;
mod watch;

use std::ffi::OsString;

use clap::{CommandFactory as _, Parser, Subcommand};
use flexcal::design::NextError;
use flexcal::fit::IdentifyError;
use flexcal::life::PriorError;

use outcome::Outcome;

/// Identify the geometric and elastic parameters of robot arms from measured end-point positions.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    max_term_width = 100,
    after_help = "Examples:
  flexcal check problems/lunar-sampler
  flexcal identify problems/lunar-sampler
  flexcal help identify

Exit status: 0 done; 1 the result is not to be trusted, or does not meet what was asked (accept; next if further poses gain nothing); \
2 bad input; 3 the arm has changed (watch); 130 interrupted."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a problem of the arm in a URDF or a data sheet.
    Init(init::Arguments),
    /// Fit the free parameters of a problem and report them with their errors.
    Identify(identify::Arguments),
    /// Compare strategies, solvers, and fits without parts of the elasticity.
    Compare(compare::Arguments),
    /// Put two estimates of one arm side by side: which parameters differ by more than their
    /// errors.
    CompareResults(compare_results::Arguments),
    /// Rank the effects that the residual points to; changes nothing.
    Trace(trace::Arguments),
    /// Find the effects that a problem lacks and add them, until nothing is left to find.
    Loop(loop_command::Arguments),
    /// Predict where an identified arm will be, and its error against measurements, without another
    /// fit.
    Predict(predict::Arguments),
    /// Test whether an arm has changed since its estimate, and what.
    Watch(watch::Arguments),
    /// Find what the estimates of several arms of one type say of the next one.
    Fleet(fleet::Arguments),
    /// Find the joint commands that bring the arm, as identified, to desired positions.
    Compensate(compensate::Arguments),
    /// Record to sign: accuracy of predictions before and after, counted as ISO 9283 does, with
    /// conditions and digests of every input.
    Accept(accept::Arguments),
    /// Write the identified arm: into the URDF that the problem came from, as YAML for a robot
    /// driver, as Denavit-Hartenberg parameters, or as C code for a controller.
    Export(export::Arguments),
    /// Forecast what measurements at some poses will tell.
    Check(check::Arguments),
    /// Choose the poses that identify best.
    Plan(plan::Arguments),
    /// Choose the poses to measure next, or say that there are enough.
    Next(next::Arguments),
    /// Simulate measurements of a known arm on the virtual test rig.
    Simulate(simulate::Arguments),
    /// Compare strategies over many fits to simulated measurements whose truth is known.
    Study(study::Arguments),
    /// Print a script that completes arguments in a shell.
    Completions(completions::Arguments),
    /// Print the manual page, or write those of all commands.
    Man(man::Arguments),
}

/// Runs the command line; `arguments` begin with the name of the program. Returns the exit status:
/// 0 done, 1 the result is not trusted, not passed or incomplete, 2 wrong input, 3 the arm has
/// changed since its estimate, 130 interrupted with nothing written
/// (143 by SIGTERM).
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let words: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&words) {
        Ok(cli) => cli,
        Err(error) => {
            let error = mistaken::with_tip(error, &words, &Cli::command());
            // If the message cannot be printed, nothing more can be reported.
            let _ = error.print();
            return if error.use_stderr() { 2 } else { 0 };
        }
    };
    flexcal::report::limit_text_width(output::terminal_columns());
    interrupt::watch();
    if let Err(error) = threads::check() {
        diagnostic::print(&error);
        return 2;
    }
    if !matches!(cli.command, Command::Completions(_) | Command::Man(_))
        && let Err(error) = threads::start()
    {
        diagnostic::print(&error);
        return 2;
    }
    let outcome = match cli.command {
        Command::Init(arguments) => init::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Accept(arguments) => accept::run(&arguments),
        Command::Identify(arguments) => identify::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::CompareResults(arguments) => compare_results::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::Loop(arguments) => loop_command::run(&arguments),
        Command::Predict(arguments) => predict::run(&arguments),
        Command::Watch(arguments) => watch::run(&arguments),
        Command::Fleet(arguments) => fleet::run(&arguments),
        Command::Compensate(arguments) => compensate::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Plan(arguments) => plan::run(&arguments),
        Command::Next(arguments) => next::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments, Cli::command()),
        Command::Man(arguments) => man::run(&arguments, Cli::command()),
    };
    match outcome {
        Ok(Outcome::Done) => 0,
        Ok(Outcome::NotMet) => 1,
        Ok(Outcome::Changed) => 3,
        Err(error) => {
            diagnostic::print(error.as_ref());
            let is_interrupted = error.downcast_ref().is_some_and(IdentifyError::is_interrupted)
                || error.downcast_ref().is_some_and(PriorError::is_interrupted)
                || error.downcast_ref().is_some_and(NextError::is_interrupted);
            if is_interrupted { interrupt::status() } else { 2 }
        }
    }
}
