//! Arguments and work of `flexcal export`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::builder::RangedU64ValueParser;
use clap::{ArgGroup, Args, ValueEnum};
use flexcal::design::Workspace;
use flexcal::export as code;
use flexcal::fit::{Identification, Placement, SavedEstimate, check_columns};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::mechanics::Arm;
use flexcal::model::Model;
use flexcal::nalgebra::{DVector, Vector3};
use flexcal::problem::{Fixture, Problem};
use flexcal::remainder;
use flexcal::report::{self, shell_word};
use flexcal::results::{Document as _, ExportResult, ExportedErrors};
use flexcal::urdf::{
    Chain, MovedOrigin, Robot, YamlFormat, export_with_links, joint_origins, mounted_links,
    mounted_target, yaml,
};

use super::camera_advice::measures_no_position;
use super::estimate::Trust;
use super::flags::{Flags, file_in};
use super::outcome::Outcome;
use super::output::Results;
use super::{diagnostic, values};

/// Arguments of `flexcal export`.
#[derive(Debug, Args)]
#[command(
    group(ArgGroup::new("form").args(["urdf", "format"]).required(true)),
    mut_arg("out", |arg| {
        let default = "in out/<name of the problem>, under the name of the URDF or the form; a folder for --format c";
        arg.value_name("FILE").help(format!("The file to write [default: {default}]"))
    }),
    after_help = "Examples:
  flexcal export panda --estimate out/panda/estimate.json --urdf panda.urdf
  flexcal export panda --estimate out/panda/estimate.json --format ros-yaml --out kinematics.yaml
  flexcal export panda --estimate out/panda/estimate.json --format dh --best-rigid \\
    --workspace-mm=200,700,-400,400,0,800
  flexcal export panda --estimate out/panda/estimate.json --format ros-camera --camera hand
  flexcal export panda --estimate out/panda/estimate.json --format c --out model"
)]
pub struct Arguments {
    /// A problem.toml, or the folder that holds one
    problem: PathBuf,
    /// The estimate.json of an identification of the problem
    #[arg(long, value_name = "FILE")]
    estimate: PathBuf,
    /// The URDF that the problem came from; it is not changed
    #[arg(long, value_name = "ARM.urdf")]
    urdf: Option<PathBuf>,
    /// Write another file than a URDF: a table, a camera or the whole model
    #[arg(long, value_name = "FORMAT", ignore_case = true)]
    format: Option<Format>,
    /// Name of the camera that --format ros-camera or opencv writes, if there are several
    #[arg(long, value_name = "NAME", requires = "format")]
    camera: Option<String>,
    /// Link of the URDF that gets the fitted pose of what was measured on the tool, such as a camera
    /// whose poses another program gave
    #[arg(long, value_name = "LINK", requires = "urdf")]
    tool_link: Option<String>,
    /// Measurement files instead of those the problem names
    #[arg(long, value_name = "FILE", num_args = 1..)]
    data: Vec<PathBuf>,
    /// Write the rigid geometry that is nearest to the whole model in the workspace, instead of the
    /// identified one
    #[arg(long)]
    best_rigid: bool,
    /// Write the geometry that a rigid model without effects gives, fitted to the same measurements
    #[arg(long)]
    fitted_alone: bool,
    /// Box of the target in which --best-rigid fits, frame of the arm's base
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = values::numbers::<6>, allow_hyphen_values = true, requires = "best_rigid")]
    workspace_mm: Option<[f64; 6]>,
    /// Number of poses in the test program of --format c
    #[arg(long, value_name = "N", default_value_t = 100, requires = "format", value_parser = test_count())]
    test_poses: usize,
    /// Number of these poses at which the test program compares compensated commands too
    #[arg(long, value_name = "N", default_value_t = 100, requires = "format", value_parser = test_count())]
    test_commands: usize,
    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    flags: Flags,
}

/// Returns the parser of a number of poses in the test program.
fn test_count() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(0..=10_000)
}

/// Format of the exported model.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// The calibration file of a Universal Robots driver
    UrYaml,
    /// Every joint by its name
    RosYaml,
    /// Modified Denavit-Hartenberg parameters, with β
    Mdh,
    /// Standard Denavit-Hartenberg parameters
    Dh,
    /// A camera as a camera_info file of ROS
    RosCamera,
    /// A camera and its pose as a file storage of OpenCV
    Opencv,
    /// All cameras as a camera chain of Kalibr
    Kalibr,
    /// The whole model as C99, into the folder --out
    C,
}

/// Returns the values of `--format`.
pub(super) fn formats() -> Vec<String> {
    let values = Format::value_variants().iter().filter_map(ValueEnum::to_possible_value);
    values.map(|value| value.get_name().to_owned()).collect()
}

impl Format {
    /// Returns the format and the default file name of a camera file; `None` for formats of the
    /// arm.
    fn camera(self) -> Option<(code::CameraFormat, &'static str)> {
        match self {
            Self::RosCamera => Some((code::CameraFormat::Ros, "camera_info.yaml")),
            Self::Opencv => Some((code::CameraFormat::OpenCv, "camera.yaml")),
            Self::Kalibr => Some((code::CameraFormat::Kalibr, "camchain.yaml")),
            Self::UrYaml | Self::RosYaml | Self::Mdh | Self::Dh | Self::C => None,
        }
    }
}

/// Coordinates of a pose in names of parameters.
const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// Checks the options that choose the geometry of a file; `is_rigid` is true if the file holds one.
fn check_geometry(arguments: &Arguments, is_rigid: bool) -> Result<(), code::ExportError> {
    let options =
        [(arguments.best_rigid, "--best-rigid"), (arguments.fitted_alone, "--fitted-alone")];
    if let Some((_, option)) = options.into_iter().find(|(is_set, _)| *is_set && !is_rigid) {
        return Err(code::ExportError::WithoutEffect { option });
    }
    if arguments.best_rigid && arguments.fitted_alone {
        return Err(code::ExportError::TwoGeometries);
    }
    Ok(())
}

/// Writes the identified geometry, a camera or the whole model in the requested format. Prints the
/// parts of the model that the file cannot represent, and its held-out errors.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let flags = &arguments.flags;
    let camera = arguments.format.and_then(Format::camera);
    let is_rigid = camera.is_none() && !matches!(arguments.format, Some(Format::C));
    if arguments.camera.is_some() && camera.is_none() {
        return Err(code::ExportError::WithoutEffect { option: "--camera" }.into());
    }
    check_geometry(arguments, is_rigid)?;
    let problem = Problem::read(&arguments.problem)?;
    let estimates = arguments.trust.read(&arguments.estimate)?;
    check_poses(arguments, &problem, &estimates)?;
    if matches!(arguments.format, Some(Format::C)) {
        return write_c(arguments, &problem, &estimates);
    }
    let model =
        estimates.model(Model::new(&problem, &estimates.words("base"), &estimates.words("tool"))?);
    let x = estimates.vector(&problem, &model)?;
    let correction = remainder::of_estimate(&problem, &estimates);
    let files = if arguments.data.is_empty() { &problem.data.files } else { &arguments.data };
    // Measurement files that the problem names may have been removed; those of --data must exist.
    let has_files =
        !arguments.data.is_empty() || !files.is_empty() && files.iter().all(|file| file.is_file());
    let data =
        if has_files && camera.is_none() { Some(read_data(&problem, files, flags)?) } else { None };
    let choice = if arguments.best_rigid {
        let corners = arguments.workspace_mm.map(|[x0, x1, y0, y1, z0, z1]| {
            [Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)].map(|corner| corner * 1e-3)
        });
        code::GeometryChoice::BestRigid(Workspace { corners, planes: Vec::new() })
    } else if arguments.fitted_alone {
        code::GeometryChoice::FittedAlone
    } else {
        code::GeometryChoice::Identified
    };
    // Only --best-rigid needs the remainder; for other geometries its file may have been removed.
    let correction = match choice {
        code::GeometryChoice::BestRigid(_) => correction?,
        _ => correction.ok().flatten(),
    };
    let fitted = (&estimates, correction.as_ref());
    let last_joint = match &arguments.urdf {
        Some(file) => {
            let robot = Robot::read(file)?;
            Chain::from_problem(&robot, &problem)?.moving_end().map(str::to_owned)
        }
        None => None,
    };
    let (fit, choice) = ((&model, &x), (&choice, last_joint.is_none()));
    let geometry = code::Geometry::for_file(&problem, fitted, fit, data.as_ref(), choice)?;
    let arm = &geometry.arm;
    let alone = geometry.fitted_alone.as_ref();
    let workspace = geometry.best_rigid.as_ref().map(|best| [best.best, best.identified]);
    let mut remarks = report::ExportRemarks::new((workspace, problem.tool.payload_mass), alone);
    if matches!(arguments.format, Some(Format::Dh | Format::Mdh)) {
        remarks.found = report::set_up_at(&model, x.as_slice(), &estimates);
    }
    let Rendered { text, moved, name: default, elsewhere } =
        render(arguments, &problem, geometry.rigid().unwrap_or((&model, &x)), (arm, &mut remarks))?;
    let path = flags.out.clone().unwrap_or_else(|| flags.folder(&problem.name).join(default));
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
        .to_owned();
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let file = file_in(&arguments.problem, "problem.toml");
    let inputs = [&[file, arguments.estimate.clone()], arguments.urdf.as_slice(), files].concat();
    let results = Results::claim("export", folder, inputs, &[&name], (flags.force, flags.quiet))?;
    let absent = files.iter().find(|file| !file.is_file()).filter(|_| !has_files);
    flags.hint(absent.map(|absent| {
        format!("no errors are computed, because {} does not exist", absent.display())
    }));
    let errors = match &data {
        Some(data) => {
            // Bases and targets are those that occur in the data, perhaps fewer than in the fit.
            let placement = Placement::of(&data.measurements);
            let (bases, targets) = (&placement.bases, &placement.targets);
            let model = estimates.model(Model::new(&problem, bases, targets)?);
            let x = estimates.vector(&problem, &model)?;
            let errors = ExportedErrors::new(&model, &x, data, Some(&estimates));
            let geometries = geometry.errors(&problem, fitted, data)?;
            let is_open = geometry.best_rigid.is_some() && geometries[0].is_none();
            flags.hint(is_open.then_some(
                "no errors are computed, because the rows do not determine base, cameras and markers \
                 for the geometry of --best-rigid",
            ));
            (!is_open).then(|| errors.with_geometries(geometries))
        }
        None => None,
    };
    let is_xml = arguments.urdf.is_some();
    let text = text + &report::set_up_comment(&remarks, is_xml);
    results.write(&[(&name, &text)])?;
    let mut result = ExportResult::new(&problem, &model, Some(&path), moved.as_deref(), errors);
    if camera.is_some() {
        result.not_held.clear();
    }
    result.not_held.extend(pose_of_tool(arguments, &model));
    let stays = |link: String| format!("link {link}, which the URDF has on another link");
    result.not_held.extend(elsewhere.into_iter().map(stays));
    let kept = last_joint.filter(|_| geometry.best_rigid.is_some());
    result.not_held.extend(kept.map(|joint| report::kept_at_end(&joint)));
    flags.print_result(&result.to_json(), || {
        format!(
            "{}Next: {}\n",
            report::export_text(&result, &remarks),
            next_command(arguments, &result, (&estimates, &path))
        )
    })?;
    if let Some(worse) = report::worse_than_nominal(&result) {
        diagnostic::warn(&worse);
    }
    // A rigid geometry fitted to an elastic arm always misses measurements by more than σ.
    let is_strange = |alone: &&Identification| !alone.is_trusted() && !problem.is_elastic();
    if let Some(alone) = alone.filter(is_strange) {
        diagnostic::warn(&format!("geometry alone: {}", report::why_not_trusted(alone)));
    }
    for reservation in &estimates.reservations {
        diagnostic::warn(&format!("not to be relied upon alone, the estimate says: {reservation}"));
    }
    if !estimates.trusted {
        diagnostic::warn("the estimate is not to be trusted, so this file is not either");
    }
    // The trust in `alone` has no influence.
    Ok(Outcome::from_trust(estimates.trusted))
}

/// States how a URDF can hold the pose of what was measured on the tool, if all of it was fitted.
fn pose_of_tool(arguments: &Arguments, model: &Model) -> Option<String> {
    let names = model.parameters.iter().map(|parameter| parameter.name.as_str());
    let has_pose = names.filter(|name| name.starts_with("tool.")).count() == AXES.len();
    (has_pose && arguments.urdf.is_some() && arguments.tool_link.is_none()).then(|| {
        "the pose of what was measured on the tool; if it is a camera, --tool-link LINK writes it \
         to the camera's link"
            .to_owned()
    })
}

/// Text of the exported file, with facts for the printed summary.
struct Rendered {
    text: String,
    /// Origins of a URDF that were moved; `None` for other formats.
    moved: Option<Vec<MovedOrigin>>,
    /// File name without the option `--out`.
    name: PathBuf,
    /// Links that are mounted on another link in the URDF than in the problem.
    elsewhere: Vec<String>,
}

/// Checks that the estimate determines the poses that the file holds: those of cameras and markers
/// on the arm in a URDF, and of cameras for OpenCV and Kalibr.
///
/// # Errors
/// Returns an error that names the first camera or marker with an open coordinate.
fn check_poses(
    arguments: &Arguments,
    problem: &Problem,
    estimates: &SavedEstimate,
) -> Result<(), code::ExportError> {
    let is_written = |fixture: &Fixture| match arguments.format {
        None => fixture.kind.has_pose() && fixture.carrier.is_some(),
        Some(Format::Opencv | Format::Kalibr) => {
            let is_chosen = arguments.camera.as_ref().is_none_or(|name| *name == fixture.name);
            fixture.kind.word() == "camera" && is_chosen
        }
        Some(_) => false,
    };
    let open_pose = |owner: &str, of: String, count: usize| {
        let names: Vec<String> =
            AXES.iter().take(count).map(|axis| format!("{owner}.{axis}")).collect();
        let open = estimates.undetermined(&names);
        let axes: Vec<&str> = open.iter().filter_map(|name| name.rsplit('.').next()).collect();
        let coordinates = axes.join(", ");
        let error = code::ExportError::PoseOpen { fixture: of, coordinates };
        if axes.is_empty() { Ok(()) } else { Err(error) }
    };
    if arguments.tool_link.is_some() {
        open_pose("tool", "the tool".to_owned(), AXES.len())?;
    }
    for fixture in problem.fixtures.iter().filter(|fixture| is_written(fixture)) {
        let (kind, name) = (fixture.kind.word(), &fixture.name);
        // No view shows how a marker of one point is turned, nor of two about their line.
        let count = if kind == "marker" && fixture.points.len() < 3 { 3 } else { AXES.len() };
        open_pose(&format!("{kind}[{name}]"), format!("{kind} \"{name}\""), count)?;
    }
    Ok(())
}

/// Checks that there is one tool with a known orientation, so that its pose may be that of a link.
///
/// # Errors
/// Returns an error otherwise.
fn check_tool(problem: &Problem, model: &Model) -> Result<(), code::ExportError> {
    let mut names = model.parameters.iter().map(|parameter| parameter.name.as_str());
    if names.clone().any(|name| name.starts_with("tool[")) {
        return Err(code::ExportError::SeveralTools);
    }
    let is_turned = problem.tool.rotation.norm() > 0.0 || names.any(|name| name == "tool.rx");
    let camera = problem.fixtures.iter().find(|fixture| fixture.kind.word() == "camera");
    match camera {
        _ if is_turned => Ok(()),
        Some(camera) if measures_no_position(problem) => {
            Err(code::ExportError::CameraIsWritten { camera: camera.name.clone() })
        }
        _ => Err(code::ExportError::ToolNotTurned),
    }
}

/// Formats the arm or a camera in the format of the arguments. Adds the table of standard
/// Denavit-Hartenberg parameters to the `remarks`.
fn render(
    arguments: &Arguments,
    problem: &Problem,
    (model, x): (&Model, &DVector<f64>),
    (arm, remarks): (&Arm<f64>, &mut report::ExportRemarks),
) -> Result<Rendered, Box<dyn Error>> {
    if let Some(file) = &arguments.urdf {
        let robot = Robot::read(file)?;
        let chain = Chain::from_problem(&robot, problem)?;
        let mut mounted = mounted_links(problem, model, x.as_slice());
        if arguments.tool_link.is_some() {
            check_tool(problem, model)?;
        }
        let target = |link: &String| mounted_target(problem, model, x.as_slice(), link);
        mounted.extend(arguments.tool_link.as_ref().map(target));
        let export = export_with_links(&chain, problem, arm, &mounted)?;
        let name = PathBuf::from(file.file_name().unwrap_or_default());
        let (text, elsewhere) = (export.text, export.elsewhere);
        return Ok(Rendered { text, moved: Some(export.moved), name, elsewhere });
    }
    let yaml_of = |form: YamlFormat| -> Result<_, Box<dyn Error>> {
        Ok((yaml(&joint_origins(problem, arm, form)?, form), "kinematics.yaml"))
    };
    let (text, name) = match arguments.format {
        Some(format) if let Some((form, name)) = format.camera() => {
            let chosen = arguments.camera.as_deref();
            (code::camera_yaml(problem, (model, x), form, chosen)?, name)
        }
        Some(Format::Mdh) => (code::modified_dh(problem, arm), "mdh.yaml"),
        Some(Format::Dh) => {
            let table = code::StandardTable::new(problem, arm)?;
            remarks.table = table.cells();
            remarks.notes = table.notes();
            (table.yaml(), "dh.yaml")
        }
        Some(Format::UrYaml) => yaml_of(YamlFormat::UniversalRobots)?,
        _ => yaml_of(YamlFormat::Ros)?,
    };
    Ok(Rendered { text, moved: None, name: PathBuf::from(name), elsewhere: Vec::new() })
}

/// Names of the files of `--format c`.
const C_FILES: [&str; 3] = ["flexcal_model.h", "flexcal_model.c", "flexcal_model_test.c"];

/// Writes the whole model as C99, with a test program.
fn write_c(
    arguments: &Arguments,
    problem: &Problem,
    estimate: &SavedEstimate,
) -> Result<Outcome, Box<dyn Error>> {
    let flags = &arguments.flags;
    let correction = remainder::of_estimate(problem, estimate)?;
    let counts = (arguments.test_poses, arguments.test_commands);
    let (answers, model, x) = code::answers(problem, estimate, correction.as_ref(), counts)?;
    let sources = code::sources(problem, &model, &x, correction.as_ref(), &answers)?;
    let folder = flags.folder(&problem.name);
    let inputs = vec![arguments.problem.clone(), arguments.estimate.clone()];
    let quiet = (flags.force, flags.quiet);
    let results = Results::claim("export", folder.clone(), inputs, &C_FILES, quiet)?;
    let texts = [&sources.header, &sources.model, &sources.test].map(String::as_str);
    results.write(&C_FILES.into_iter().zip(texts).collect::<Vec<_>>())?;
    let mut result = ExportResult::new(problem, &model, Some(&folder), None, None);
    result.not_held.clear();
    flags.print_result(&result.to_json(), || {
        let sources: Vec<String> =
            C_FILES.iter().skip(1).map(|name| shell_word(&folder.join(name))).collect();
        let remainder = correction.is_some_and(|correction| correction.has_remainder());
        format!(
            "The whole model{}, and the correction of commands, as C99\nWritten to {}: {}\n\
             Next: cc -std=c99 -O2 {} -lm && ./a.out compares the code with flexcal at {} poses\n",
            if remainder { " with its remainder" } else { "" },
            folder.display(),
            C_FILES.join(", "),
            sources.join(" "),
            answers.rows.len()
        )
    })?;
    if !estimate.trusted {
        diagnostic::warn("the estimate is not to be trusted, so this code is not either");
    }
    Ok(Outcome::from_trust(estimate.trusted))
}

/// Reads the measurements on which the errors of an export are computed.
fn read_data(
    problem: &Problem,
    files: &[PathBuf],
    flags: &Flags,
) -> Result<Dataset, Box<dyn Error>> {
    let (rows, warnings) = Measurements::read(files, problem)?;
    flags.warn(&warnings);
    check_columns(problem, &rows)?;
    Ok(Dataset::from_measurements(problem, rows)?)
}

/// Returns the command to run next: the same export with the geometry that has the smallest error,
/// or `flexcal predict` with new measurements.
fn next_command(
    arguments: &Arguments,
    result: &ExportResult,
    (estimates, path): (&SavedEstimate, &Path),
) -> String {
    let [problem, estimate] =
        [&arguments.problem, &arguments.estimate].map(|path| shell_word(path));
    if !estimates.trusted {
        return format!("flexcal identify {problem} says why the estimate is not to be trusted");
    }
    if let Some(better) = report::better_geometry(result) {
        let form = match (&arguments.urdf, arguments.format) {
            (Some(urdf), _) => format!("--urdf {}", shell_word(urdf)),
            (None, format) => {
                let word = format.and_then(|format| format.to_possible_value());
                format!(
                    "--format {}",
                    word.map_or(String::new(), |word| word.get_name().to_owned())
                )
            }
        };
        let data: Vec<String> = arguments.data.iter().map(|file| shell_word(file)).collect();
        let data =
            if data.is_empty() { String::new() } else { format!(" --data {}", data.join(" ")) };
        let force = if arguments.flags.force { " --force" } else { "" };
        return format!(
            "flexcal export {problem} --estimate {estimate} {form}{data} {better} --out {}{force}",
            shell_word(path)
        );
    }
    let what = if report::holds_whole_model(result) {
        "new measurements"
    } else {
        "the whole model, not this file"
    };
    format!("flexcal predict {problem} --estimate {estimate} --data MEASURED.csv judges {what}")
}
