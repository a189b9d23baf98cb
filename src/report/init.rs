//! Text of the command `init`: the problem that was made, and the next steps.

use std::fmt::Write as _;
use std::path::Path;

use super::shell::shell_word;
use crate::problem::{Joint, Problem};
use crate::urdf::{Chain, Description, HELD_OUT, SIGMA_MM, names_of_joints};

/// Describes the problem that was made from a URDF, with its `further` branches, and written to `folder`, and the next steps. If
/// `camera` is given, these are for a camera that sees a board; true: a camera in the world.
pub fn init_text(
    chain: &Chain,
    further: &[Chain],
    description: &Description,
    (folder, camera): (&Path, Option<bool>),
) -> String {
    let (base, first) = chain.ends();
    let tips: Vec<&str> = further.iter().map(|chain| chain.ends().1).collect();
    let tip = [&[first], tips.as_slice()].concat().join(" and ");
    let joints = names_of_joints(chain, further);
    let target = if further.is_empty() { "target_m" } else { "at_m    " };
    let mut words = format!(
        "{}: {} moving joints from {base} to {tip}\n  {}\n",
        description.name,
        joints.len(),
        joints.join(", ")
    );
    for note in &description.notes {
        let _ = writeln!(words, "  note: {note}");
    }
    let file = folder.join("problem.toml");
    let (written, word) = (file.display(), shell_word(folder));
    if let Some(in_world) = camera {
        let other = tips.first().unwrap_or(&"the world");
        let [camera, board] = if in_world { [other, &first] } else { [&first, other] };
        let _ = write!(
            words,
            "\nWritten to {written}. Fill in there\n  \
             focal_px, centre_px  of your camera, roughly; they are fitted\n  \
             image_px             width and height of its images\n  \
             pixel_sigma          1 σ of a found corner\n  \
             on                   the frame that carries the camera and the board; now {camera} and {board}\n\
             and put measurements.csv beside it, with a row for each corner of each image; \
             problem.toml\nlists the columns it needs.\n\
             Where camera and board are need not be known; the views decide it.\n\
             Next: flexcal identify {word}, then flexcal loop {word}\n"
        );
        return words;
    }
    let _ = write!(
        words,
        "\nWritten to {written}. Fill in there\n  \
         {target}           where the measured point sits in the frame of {tip}, roughly; now its origin\n  \
         position_sigma_mm  1 σ of a coordinate that your instrument measures; now {SIGMA_MM}\n  \
         held_out           now {} % of the poses are held out to judge the fit\n\
         and put measurements.csv beside it; problem.toml lists the columns it needs. flexcal \
         check says\nhow many poses to measure, those held out included; flexcal plan counts fitted poses \
         alone. A URDF declares no\nelastic links. To look for elastic effects of a link, declare it in \
         [joint.beam]. To look for effects of\ntemperature, give reference_temperature_C and a column \
         temperature_C.\n\
         Next: flexcal check {word} --poses 40, then flexcal loop {word}\n",
        100.0 * HELD_OUT
    );
    words
}

/// Describes the problem that was completed from a typed table of joints and written to `folder`, and
/// the next steps.
pub fn sheet_text(problem: &Problem, description: &Description, folder: &Path) -> String {
    let moving = problem.joints.iter().filter(|joint: &&Joint| joint.takes_command()).count();
    let mut words = format!("{}: {moving} moving joints\n", description.name);
    for note in &description.notes {
        let _ = writeln!(words, "  note: {note}");
    }
    let (written, word) = (folder.join("problem.toml").display().to_string(), shell_word(folder));
    let is_added = |section: &str| {
        description.text.contains(section)
            && !description.notes.iter().any(|note| note.contains(section))
    };
    let held = if is_added("[parameters]") {
        ", with the parameters held that positions cannot tell from others"
    } else {
        ""
    };
    let _ = writeln!(words, "\nWritten to {written}{held}. Fill in there");
    let lacks_range = |joint: &Joint| {
        joint.takes_command() && !(joint.limits.0.is_finite() && joint.limits.1.is_finite())
    };
    let lines = [
        (
            problem.joints.iter().any(lacks_range),
            "min_deg, max_deg    of each row: the range in which you measure (_mm where it slides)",
        ),
        (
            is_added("[tool]"),
            "target_m           where the measured point sits behind the last row, roughly",
        ),
        (
            is_added("[data]"),
            "position_sigma_mm  1 σ of a coordinate that your instrument measures",
        ),
        (
            is_added("[parameters]"),
            "sigma_deg, _mm     in [parameters]: how far off the sheet may be",
        ),
        (
            problem.joints.iter().all(|joint| joint.bodies.is_empty()),
            "mass_kg, com_m     in body of each row, as the comment shows: to find what gives way under loads",
        ),
        (is_added("[data]"), "files              your table or tables"),
    ];
    for (_, line) in lines.into_iter().filter(|(is_needed, _)| *is_needed) {
        let _ = writeln!(words, "  {line}");
    }
    let _ = writeln!(words, "Next: flexcal check {word} --poses 40, then flexcal loop {word}");
    words
}
