//! Arguments and work of `flexcal export`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use flexcal::fit::{Placement, SavedEstimate, check_columns};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::model::Model;
use flexcal::problem::Problem;
use flexcal::report::{self, shell_word};
use flexcal::results::{Document as _, ExportResult, ExportedErrors};
use flexcal::urdf::{Chain, Robot, YamlFormat, export, joint_origins, yaml};

use super::diagnostic;
use super::flags::Flags;
use super::outcome::Outcome;
use super::output::Results;

/// Arguments of `flexcal export`.
#[derive(Debug, Args)]
#[command(
    mut_arg("out", |arg| {
        let default = "in out/<name of the problem>, under the name of the URDF or as kinematics.yaml";
        arg.value_name("FILE").help(format!("The file to write [default: {default}]"))
    }),
    after_help = "Examples:
  flexcal export panda --estimate out/panda/estimate.json --urdf panda.urdf
  flexcal export panda --estimate out/panda/estimate.json --format ros-yaml --out kinematics.yaml"
)]
pub struct Arguments {
    /// A problem.toml, or the folder that holds one
    problem: PathBuf,
    /// The estimate.json of an identification of the problem
    #[arg(long, value_name = "FILE")]
    estimate: PathBuf,
    /// The URDF that the problem came from; it is not changed
    #[arg(
        long,
        value_name = "ARM.urdf",
        required_unless_present = "format",
        conflicts_with = "format"
    )]
    urdf: Option<PathBuf>,
    /// Origins of the joints as YAML instead
    #[arg(long, value_name = "FORMAT")]
    format: Option<Format>,
    /// Measurement files instead of those the problem names
    #[arg(long, value_name = "FILE", num_args = 1..)]
    data: Vec<PathBuf>,
    #[command(flatten)]
    flags: Flags,
}

/// Dialect of the exported YAML.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// The calibration file of a Universal Robots driver
    UrYaml,
    /// Every joint by its name
    RosYaml,
}

/// Writes the identified geometry, and prints what the file cannot hold.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let flags = &arguments.flags;
    let problem = Problem::read(&arguments.problem)?;
    let estimates = SavedEstimate::read(&arguments.estimate)?;
    let model =
        estimates.model(Model::new(&problem, &estimates.words("base"), &estimates.words("tool"))?);
    let x = estimates.vector(&problem, &model)?;
    let arm = model.arm(|k| x.get(k).copied().unwrap_or(0.0));
    let (text, moved, default) = match (&arguments.urdf, arguments.format) {
        (Some(file), _) => {
            let robot = Robot::read(file)?;
            let export = export(&Chain::from_problem(&robot, &problem)?, &problem, &arm)?;
            let name = file.file_name().unwrap_or_default().to_owned();
            (export.text, Some(export.moved), PathBuf::from(name))
        }
        (None, format) => {
            let form = if matches!(format, Some(Format::UrYaml)) {
                YamlFormat::UniversalRobots
            } else {
                YamlFormat::Ros
            };
            (
                yaml(&joint_origins(&problem, &arm, form)?, form),
                None,
                PathBuf::from("kinematics.yaml"),
            )
        }
    };
    let path = flags.out.clone().unwrap_or_else(|| flags.folder(&problem.name).join(default));
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
        .to_owned();
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let file = if arguments.problem.is_dir() {
        arguments.problem.join("problem.toml")
    } else {
        arguments.problem.clone()
    };
    let files = if arguments.data.is_empty() { &problem.data.files } else { &arguments.data };
    let inputs = [&[file, arguments.estimate.clone()], arguments.urdf.as_slice(), files].concat();
    let results = Results::claim("export", folder, inputs, &[&name], (flags.force, flags.quiet))?;
    // Measurements that the problem names may have been removed.
    let at_hand =
        !arguments.data.is_empty() || !files.is_empty() && files.iter().all(|file| file.is_file());
    if let Some(absent) =
        files.iter().find(|file| !file.is_file()).filter(|_| !at_hand && !flags.quiet)
    {
        diagnostic::warn(&format!("errors are not judged: {} is not there", absent.display()));
    }
    let errors = if at_hand { Some(errors(&problem, files, &estimates, flags)?) } else { None };
    results.write(&[(&name, &text)])?;
    let result = ExportResult::new(&problem, &model, Some(&path), moved.as_deref(), errors);
    flags.tell(&result.to_json(), || {
        let [problem, estimate] = [&arguments.problem, &arguments.estimate].map(|path| shell_word(path));
        format!(
            "{}\nNext: flexcal predict {problem} --estimate {estimate} --data MEASURED.csv judges new measurements\n",
            report::export_text(&result)
        )
    })?;
    if !estimates.trusted {
        diagnostic::warn("the estimate is not to be trusted, so this file is not either");
    }
    Ok(if estimates.trusted { Outcome::Done } else { Outcome::NotTrusted })
}

/// Computes the held-out errors of the whole model and of its rigid geometry.
fn errors(
    problem: &Problem,
    files: &[PathBuf],
    estimates: &SavedEstimate,
    flags: &Flags,
) -> Result<ExportedErrors, Box<dyn Error>> {
    let (rows, warnings) = Measurements::read(files, problem)?;
    flags.warn(&warnings);
    check_columns(problem, &rows)?;
    let data = Dataset::from_measurements(problem, rows)?;
    let placement = Placement::of(&data.measurements);
    let model = estimates.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let x = estimates.vector(problem, &model)?;
    Ok(ExportedErrors::of(&model, &x, &data, Some(estimates)))
}
