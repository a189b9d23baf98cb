//! Next commands for problems whose rows are images: what to mend in a camera, and what to export.

use std::path::Path;

use flexcal::fit::{Estimate, FindingCode, Identification};
use flexcal::problem::{Fixture, Problem};
use flexcal::report::shell_word;

use super::input::Common;

/// Returns true if pixels are measured instead of positions, so that the arm need not have a target
/// whose commands could be corrected.
pub fn measures_no_position(problem: &Problem) -> bool {
    let has_camera = problem.fixtures.iter().any(|fixture| fixture.kind.word() == "camera");
    has_camera && problem.data.position_sigma.is_none()
}

/// Returns what to do about a lens or views that are the reason not to trust a fit; `None` if neither
/// is.
pub fn camera_advice(found: &Identification, file: &str) -> Option<String> {
    if found.has(FindingCode::LensContradicted) {
        return Some(format!("correct or free the intrinsics in {file} as the warning says"));
    }
    let are_open = found.has(FindingCode::ViewsUndecided);
    are_open.then(|| {
        "add views with the camera turned about two axes, or declare where camera or marker is"
            .to_owned()
    })
}

/// States what to do about the first camera with a coordinate that the rows do not determine; `None`
/// if they determine all that was fitted.
pub fn open_camera(found: &Identification) -> Option<String> {
    let is_open = |estimate: &&Estimate| {
        estimate.std_error.is_none()
            && estimate.name.starts_with("camera[")
            && found.unknowns.contains(&estimate.name)
    };
    let name = &found.estimates.iter().find(is_open)?.name;
    Some(format!(
        "hold {name} or what moves the same way, as the notes above say: export writes no pose that \
         the rows leave open"
    ))
}

/// Returns the command that writes an estimate into the URDF of the arm, or the camera of it if the
/// problem names no URDF.
pub fn to_export(common: &Common, problem: &Problem, estimate: &Path) -> String {
    let [named, estimate] = [common.problem(), estimate].map(shell_word);
    let export = format!("flexcal export {named} --estimate {estimate}");
    if problem.urdf.is_some() {
        let is_rigid = problem.effects.is_empty() && !problem.is_elastic();
        let alone = if is_rigid { "" } else { " --fitted-alone" };
        return format!("{export} --urdf ARM.urdf{alone} writes the calibrated URDF");
    }
    let of_kind = |of: &&Fixture| of.kind.word() == "camera";
    let cameras: Vec<&Fixture> = problem.fixtures.iter().filter(of_kind).collect();
    let camera = match cameras.as_slice() {
        [first, _, ..] => format!(" --camera {}", shell_word(Path::new(&first.name))),
        _ => String::new(),
    };
    let add = if cameras.first().is_some_and(|camera| camera.image.is_none()) {
        let file = common.problem_file();
        format!("add image_px = [width, height] to [[camera]] in {}, then ", file.display())
    } else {
        String::new()
    };
    format!("{add}{export} --format opencv{camera} writes the camera with its pose")
}
