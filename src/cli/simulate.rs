//! Arguments and work of `flexcal simulate`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::measurement::Measurements;
use flexcal::problem::{HeldOut, Problem};
use flexcal::report::shell_word;
use flexcal::rig::{SimulatedPoses, Simulation, Truth, simulate_counted};

use super::flags::{Flags, file_in};
use super::outcome::Outcome;
use super::progress::count_during;
use super::{diagnostic, values};

/// Arguments of `flexcal simulate`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal simulate problems/lunar-sampler --truth TRUTH.toml --poses 78 --seed 1
  flexcal identify problems/lunar-sampler --data out/lunar-sampler/measurements.csv
  flexcal simulate problems/lunar-sampler --truth TRUTH.toml --data out/lunar-sampler/plan.csv --seed 1 \\
    --out out/rehearsed")]
pub struct Arguments {
    /// A problem.toml, or the folder that holds one [default: the current folder]
    #[arg(default_value = ".", hide_default_value = true)]
    problem: PathBuf,
    /// True deviations of the arm from the problem, and ranges of the poses; or the folder that
    /// holds the file
    #[arg(long, value_name = "TRUTH.toml")]
    truth: PathBuf,
    /// Number of poses, drawn in the ranges of [poses]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::count::<1_000_000>, required_unless_present = "data")]
    poses: Option<u32>,
    /// Tables of poses to measure instead, such as plan.csv; positions in them are ignored
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "poses")]
    data: Vec<PathBuf>,
    /// Seed of every random number
    #[arg(long, value_name = "S")]
    seed: u64,
    #[command(flatten)]
    flags: Flags,
}

/// Simulates measurements of the true arm on the virtual test rig; writes `measurements.csv` and
/// `truth.json`.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let problem = Problem::read(&arguments.problem)?;
    let truth = Truth::read(&arguments.truth, &problem)?;
    arguments.flags.hint(truth.large_noise());
    let files =
        [file_in(&arguments.problem, "problem.toml"), file_in(&arguments.truth, "TRUTH.toml")];
    let inputs = [&files[..], &problem.data.files, &arguments.data].concat();
    let flags = &arguments.flags;
    let results =
        flags.claim("simulate", &problem.name, inputs, &["measurements.csv", "truth.json"])?;
    let poses = if let Some(poses) = arguments.poses {
        SimulatedPoses::Random(poses as usize)
    } else {
        let (rows, warnings) = Measurements::read_poses(&arguments.data, &problem)?;
        flags.warn(&warnings);
        SimulatedPoses::Given(rows.poses_to_simulate(&problem))
    };
    let count = match &poses {
        SimulatedPoses::Random(count) => *count,
        SimulatedPoses::Given(poses) => poses.len(),
    };
    let simulation = count_during(flags.prints_text(), "poses", (count, 0), |advance| {
        simulate_counted(&problem, &truth, poses, arguments.seed, advance)
    })?;
    let (json, table) = (simulation.truth_json(), results.path("measurements.csv"));
    results.write(&[("measurements.csv", &simulation.csv()), ("truth.json", &json)])?;
    // With a declared fraction, rows are held out when the file is read.
    let has_held_out = matches!(problem.data.held_out, Some(HeldOut::Fraction { .. }))
        || simulation.held_out() > 0;
    flags.print_result(&json, || {
        let next =
            if has_held_out { next_command(&arguments.problem, &table) } else { String::new() };
        summary(&simulation, &table) + &next
    })?;
    if !has_held_out && !flags.quiet {
        diagnostic::warn(
            "no row is held out, and identify needs some to judge by: simulate more poses, or change held_out or \
             identification in [poses]",
        );
    }
    Ok(Outcome::Done)
}

/// Describes the simulation: poses, noise, effects, and where the table is.
fn summary(simulation: &Simulation, table: &Path) -> String {
    let (poses, rows) = (simulation.poses(), simulation.rows.len());
    let held_out = simulation.held_out();
    let identify = poses - held_out;
    let of_rows = if rows > poses { format!(", {rows} rows") } else { String::new() };
    let noise = if simulation.rows.iter().any(|row| row.observation.is_position()) {
        format!("{} mm per axis, 1 σ", simulation.truth.noise_sigma * 1e3)
    } else {
        "as [noise] says of each kind of rows".to_owned()
    };
    let table = table.display();
    format!(
        "{poses} pose{s}{of_rows}: {identify} to identify, {held_out} held out; noise {noise}\n\
         Effects: {effects}\n\n\
         Written to {table}; the true values are in truth.json beside it\n",
        s = if poses == 1 { "" } else { "s" },
        effects = match simulation.effect_names().join(", ") {
            none if none.is_empty() => "none".to_owned(),
            names => names,
        },
    )
}

/// Returns the line with the command that identifies the simulated arm.
fn next_command(problem: &Path, table: &Path) -> String {
    let folder = table.parent().unwrap_or(table).join("identified");
    let [problem, table, folder] = [problem, table, &folder].map(shell_word);
    format!("Next: flexcal identify {problem} --data {table} --out {folder}\n")
}
