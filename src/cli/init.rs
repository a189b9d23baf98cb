//! Arguments and work of `flexcal init`.

use std::error::Error;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::{ArgAction, Args};
use flexcal::error::InputError;
use flexcal::problem::Problem;
use flexcal::report;
use flexcal::results::{Document as _, InitResult};
use flexcal::urdf::{Chain, Robot, TAG, complete, describe_measured, in_tree_order, text_of_table};

use super::diagnostic;
use super::flags::Flags;
use super::outcome::Outcome;
use super::values;

/// Arguments of `flexcal init`.
#[derive(Debug, Args)]
#[command(
    mut_arg("out", |arg| arg.help("Folder for problem.toml [default: out/<name of the robot>]")),
    after_help = "Examples:
  flexcal init panda.urdf --tip panda_link8 --out panda
  flexcal init panda.urdf --tip panda_link8 --out panda --board 9x6x25
  flexcal init humanoid.urdf --tip head_camera --tip right_hand --board 9x6x25
  flexcal init panda.urdf --tip panda_link8 --out panda --tag 50
  flexcal init panda.urdf --tip panda_link8 --out panda --board 9x6x25 --camera world
  flexcal init sheet.csv --out my-arm
  flexcal identify panda --data measurements.csv"
)]
pub struct Arguments {
    /// The URDF (expand a xacro first), or the table of joints of a data sheet: CSV with units in the
    /// header (theta_deg, d_mm, a_mm, alpha_deg), or TOML
    #[arg(value_name = "ARM.urdf|ARM.csv|ARM.toml")]
    urdf: PathBuf,
    /// Link at the base of the arm [default: the root]
    #[arg(long, value_name = "LINK")]
    base: Option<String>,
    /// Link at its tip, which carries the target [default: the only leaf]; several times for the
    /// branches of a tree, such as two arms or a head and a hand
    #[arg(long, value_name = "LINK")]
    tip: Vec<String>,
    /// Board that a camera on the tip sees, in the world or on the second tip: inner corners along
    /// and across, and their distance in mm. The problem then measures its pixels instead of
    /// positions
    #[arg(long, value_name = "9x6x25", value_parser = parse_board)]
    board: Option<Board>,
    /// Tag (AprilTag, ArUco) in place of a board: its size in mm, from corner to corner of the black
    /// square
    #[arg(long, value_name = "50", value_parser = parse_tag, conflicts_with = "board")]
    tag: Option<Board>,
    /// Where the camera is that sees the board or tag: on the tip, or in the world, and the board
    /// on the tip
    #[arg(long, value_name = "tip|world", default_value = CAMERA_PLACES[0].0, action = ArgAction::Set, value_parser = values::one_of(CAMERA_PLACES))]
    camera: bool,
    #[command(flatten)]
    flags: Flags,
}

/// Places of the camera, each with a summary, and true if it is the world.
const CAMERA_PLACES: [(&str, &str, bool); 2] = [
    ("tip", "On the (first) tip; the board is in the world, or on the second tip", false),
    ("world", "Beside the arm; the board is on the tip", true),
];

impl Arguments {
    /// Returns the board or tag that a camera sees.
    fn board(&self) -> Option<Board> {
        self.board.or(self.tag)
    }
}

/// Numbers of inner corners along and across a calibration board, and their distance \[mm\].
type Board = ([usize; 2], f64);

/// Usual distances of the corners of a calibration board \[mm\].
const USUAL_SQUARES_MM: std::ops::RangeInclusive<f64> = 0.5..=500.0;

/// Parses the size of a calibration board such as `9x6x25`.
fn parse_board(text: &str) -> Result<Board, String> {
    let parts: Vec<&str> = text.split(['x', '×']).collect();
    let [columns, rows, distance] = parts[..] else {
        return Err("corners along, across and their distance in mm, such as 9x6x25".to_owned());
    };
    let count = |text: &str| match text.parse::<usize>() {
        Ok(count @ 2..=100) => Ok(count),
        _ => Err(format!("{text} is no number of corners from 2 to 100")),
    };
    let distance = distance.parse::<f64>().ok().filter(|mm| *mm > 0.0 && mm.is_finite());
    let distance = distance.ok_or("the distance of the corners in mm has to be above 0")?;
    Ok(([count(columns)?, count(rows)?], distance))
}

/// Parses the size of a tag in mm: a square without further corners.
fn parse_tag(text: &str) -> Result<Board, String> {
    let size = text.parse::<f64>().ok().filter(|mm| *mm > 0.0 && mm.is_finite());
    Ok((TAG, size.ok_or("the size of the tag in mm has to be above 0, such as 50")?))
}

/// Completes the problem of an arm that was typed from a data sheet, as TOML or as a CSV table.
fn complete_sheet(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let has_link = arguments.base.iter().chain(&arguments.tip).next().is_some();
    if has_link || arguments.camera || arguments.board().is_some() {
        return Err(
            "--base, --tip, --board, --tag and --camera belong to a URDF, not to a table of joints"
                .into(),
        );
    }
    let flags = &arguments.flags;
    let (problem, text) = if has_ending(&arguments.urdf, &["toml"]) {
        Problem::read_with_text(&arguments.urdf)?
    } else {
        let sheet = text_of_table(&arguments.urdf)?;
        flags.warn(&sheet.warnings);
        let in_table = |error: InputError| InputError {
            location: Box::new(sheet.place(*error.location)),
            ..error
        };
        let mut problem = Problem::parse(&sheet.text, &arguments.urdf).map_err(in_table)?;
        for warning in &mut problem.warnings {
            warning.location = sheet.place(std::mem::take(&mut warning.location));
        }
        (problem, sheet.text.into())
    };
    flags.warn(&problem.plausibility_warnings());
    let description = complete(&problem, &text)?;
    let results =
        flags.claim("init", &description.name, vec![arguments.urdf.clone()], &["problem.toml"])?;
    results.write(&[("problem.toml", &description.text)])?;
    let file = results.path("problem.toml");
    let json = InitResult::of_sheet(&problem, &description, &file).to_json();
    flags.print_result(&json, || report::sheet_text(&problem, &description, &results.folder))?;
    Ok(Outcome::Done)
}

/// Returns true if the name of a file has one of the endings.
fn has_ending(file: &Path, endings: &[&str]) -> bool {
    let is_one = |ending: &OsStr| endings.iter().any(|one| ending.eq_ignore_ascii_case(one));
    file.extension().is_some_and(is_one)
}

/// Writes the chain of a URDF between two links as `problem.toml`, or completes a typed problem.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    if arguments.urdf.is_dir() {
        let folder = arguments.urdf.display();
        let held = if arguments.urdf.join("problem.toml").is_file() {
            format!("{folder} holds a problem already, as flexcal identify takes it")
        } else {
            "not its folder".to_owned()
        };
        return Err(format!(
            "{folder}: it is a folder; give the URDF of the arm or the table of its data sheet; {held}"
        )
        .into());
    }
    if has_ending(&arguments.urdf, &["toml", "csv", "tsv", "txt"]) {
        return complete_sheet(arguments);
    }
    if let Some((_, mm)) = arguments.board().filter(|board| !USUAL_SQUARES_MM.contains(&board.1)) {
        diagnostic::warn(&format!(
            "corners that are {mm} mm apart? --board 9x6x25 and --tag 50 are in mm, such as 25 for \
             squares of 0.025 m"
        ));
    }
    let robot = Robot::read(&arguments.urdf)?;
    let mut tips = arguments.tip.iter().map(|tip| Some(tip.as_str()));
    let to = |tip: Option<&str>| Chain::new(&robot, arguments.base.as_deref(), tip);
    let chain = to(tips.next().flatten())?;
    let in_world = arguments.camera;
    let is_on_tip = arguments.board().is_some() && !in_world;
    let chain = if is_on_tip { chain.up_to_carrier_of_camera()? } else { chain };
    let further = in_tree_order(&chain, tips.map(to).collect::<Result<_, _>>()?)?;
    if in_world && (arguments.board().is_none() || !further.is_empty()) {
        return Err("--camera world belongs to --board or --tag on a single tip".into());
    }
    if arguments.board().is_some() && further.len() > 1 {
        return Err(
            "--board takes one tip with the camera, and at most one that carries the board".into(),
        );
    }
    let board = arguments.board().map(|(corners, distance)| (corners, distance, in_world));
    let description = describe_measured(&chain, &further, board)?;
    let flags = &arguments.flags;
    let results =
        flags.claim("init", &description.name, vec![arguments.urdf.clone()], &["problem.toml"])?;
    results.write(&[("problem.toml", &description.text)])?;
    let file = results.path("problem.toml");
    let json = InitResult::new(&chain, &further, &description, &file).to_json();
    flags.print_result(&json, || {
        let camera = board.map(|(.., in_world)| in_world);
        report::init_text(&chain, &further, &description, (&results.folder, camera))
    })?;
    Ok(Outcome::Done)
}
