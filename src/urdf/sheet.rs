//! Completion of a problem that declares an arm alone, typed from a data sheet.

use std::fmt::Write as _;

use toml_edit::DocumentMut;

use super::describe::{Description, HELD_OUT, SIGMA_MM, TOOL, parameters_of};
use super::free::distinguishable_parameters;
use crate::error::{InputError, WarningKind};
use crate::problem::{JointKind, Problem};

/// Returns the index of the first of the consecutively numbered `names` before which one is left out,
/// with the warning about that; `None` if none is, or the numbers are not consecutive elsewhere.
pub(super) fn left_out(names: &[&str]) -> Option<(usize, WarningKind)> {
    let numbered = |name: &&str| {
        let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
        Some((letters.to_owned(), name.strip_prefix(letters)?.parse::<u32>().ok()?))
    };
    let numbered: Vec<(String, u32)> = names.iter().map(numbered).collect::<Option<_>>()?;
    let steps = || numbered.iter().zip(numbered.iter().skip(1));
    let is_next = |((before, one), (letters, other)): &(&(String, u32), &(String, u32)),
                   by: u32| {
        before == letters && one.checked_add(by) == Some(*other)
    };
    let consecutive = steps().filter(|pair| is_next(pair, 1)).count();
    let place = steps().position(|pair| is_next(&pair, 2))?;
    let (letters, number) = numbered.get(place)?;
    let kind = WarningKind::JointLeftOut {
        missing: format!("{letters}{}", number + 1),
        before: format!("{letters}{}", number + 2),
        joints: names.len(),
    };
    (consecutive > 0 && consecutive + 2 == numbered.len()).then_some((place + 1, kind))
}

/// Completes the `text` of a problem by the sections of tool, parameters and data that it lacks:
/// priors for all parameters, except those which positions cannot distinguish from others.
///
/// # Errors
/// Returns an error if no model can be made of the arm.
pub(crate) fn complete(problem: &Problem, text: &str) -> Result<Description, InputError> {
    let document = text.parse::<DocumentMut>().ok();
    let has = |key: &str| document.as_ref().is_some_and(|document| document.contains_key(key));
    if !problem.fixtures.is_empty() {
        let note =
            "cameras, planes and the like are declared, so what else is missing is left to write";
        let (name, text) = (problem.name.clone(), text.to_owned());
        return Ok(Description { name, text, notes: vec![note.to_owned()] });
    }
    let names: Vec<&str> = problem.joints.iter().map(|joint| joint.name.as_str()).collect();
    let mut notes: Vec<String> =
        left_out(&names).map(|(_, kind)| kind.to_string()).into_iter().collect();
    let mut text = format!("{}\n", text.trim_end());
    if !has("tool") && !has("target") {
        text.push_str(TOOL);
    }
    if has("parameters") {
        notes.push("[parameters] is kept as it was".to_owned());
    } else if problem.is_chain() {
        let _ = write!(
            text,
            "\n{}",
            parameters_of(
                problem,
                &distinguishable_parameters(problem, &[problem.joints.len()], false)?
            )
        );
    } else {
        notes.push("the joints are a tree, so [parameters] is left to write".to_owned());
    }
    if has("data") {
        notes.push(
            "[data] is kept as it was; its files are looked for beside problem.toml".to_owned(),
        );
    } else {
        let _ = write!(text, "\n{}", data(problem));
    }
    Ok(Description { name: problem.name.clone(), text, notes })
}

/// Returns the section `[data]`, with the names of the columns and what other tables need as
/// comments.
fn data(problem: &Problem) -> String {
    let unit = |kind| if kind == JointKind::Prismatic { "mm" } else { "deg" };
    let joints = (1..).zip(&problem.joints).filter(|(_, joint)| joint.takes_command());
    let columns: Vec<String> =
        joints.map(|(number, joint)| format!("q{number}_{}", unit(joint.kind))).collect();
    format!(
        "# Columns of the measurements:\n#   {}, x_mm, y_mm, z_mm\n\
         [data]\nfiles = [\"measurements.csv\"]\n\
         # joints = {{ files = [\"controller.csv\"], by = \"time\" }}   # if another table holds the joints; or \"name\", \"order\"\n\
         position_sigma_mm = {SIGMA_MM}                         # 1 σ of a measured coordinate: put in that of your instrument\n\
         held_out = {{ fraction = {HELD_OUT}, seed = 1 }}          # poses that judge and are not fitted\n\n\
         # [data.columns]                                 # theirs = ours, where the names in the tables differ\n\
         # \"X\" = \"x_mm\"\n\
         # [data.format]\n\
         # decimal = \",\"                                  # where numbers have decimal commas\n",
        columns.join(", ")
    )
}
