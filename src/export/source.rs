//! Assembly of the C source: templates with generated tables and formulas.

use std::fmt::Write as _;

use nalgebra::DVector;

use super::answers::Answers;
use super::error::ExportError;
use super::formula::{array, formula, helpers, real};
use super::numbers::{BEAM, FRAME, HOIST, JOINT, LOAD, Numbers, inner};
use super::remainder::remainder_tables;
use crate::laws::RANGE_AXIS;
use crate::model::parameter::{JointField, ParameterSite};
use crate::model::{Model, ModelParts, PartSite};
use crate::problem::{Equilibrium, JointKind, Problem};
use crate::remainder::Correction;

/// Text of the generated C files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sources {
    /// Text of `flexcal_model.h`.
    pub header: String,
    /// Text of `flexcal_model.c`.
    pub model: String,
    /// Text of `flexcal_model_test.c`.
    pub test: String,
}

/// Returns the model of an identified arm as C99, with a test program that contains `answers`. `x`
/// is the full parameter vector of `model`.
///
/// # Errors
/// Returns an error if a law depends on earlier poses or on moments of the loads, or if a number is
/// not finite.
pub fn sources(
    problem: &Problem,
    model: &Model,
    x: &DVector<f64>,
    correction: Option<&Correction>,
    answers: &Answers,
) -> Result<Sources, ExportError> {
    // The C code must contain a compliance of each joint whose compliance a remainder corrects.
    let tables = correction.and_then(|correction| correction.tables(model, x));
    let compliant = correction.map_or_else(Vec::new, Correction::compliant_joints);
    let field = JointField::Compliance;
    let probe = |&joint: &usize| (ParameterSite::Joint { joint, field }, 0.0);
    let model = &model.with_probes(&compliant.iter().map(probe).collect::<Vec<_>>());
    let x = &x.clone().resize_vertically(x.len() + compliant.len(), 0.0);
    let parts = model.parts(x.as_slice());
    let joints: Vec<String> = problem.joints.iter().map(|joint| plain(&joint.name)).collect();
    let plain_all = |names: &[String]| names.iter().map(|name| plain(name)).collect::<Vec<_>>();
    let (bases, targets) = (plain_all(&answers.bases), plain_all(&answers.targets));
    let names = [&joints[..], &bases[..], &targets[..]];
    let numbers = Numbers::of(&parts, names);
    let lost = numbers.values.iter().position(|value| !value.is_finite());
    if let Some(at) = lost {
        let (what, value) = (numbers.comments[at].clone(), numbers.values[at]);
        return Err(ExportError::NotFinite { what, value });
    }
    let about = format!(
        "/* {}: model of the identified arm, written by flexcal {}.\n   C99; no allocation, no \
         library but libm; double, or float with -DFLEXCAL_FLOAT. */\n",
        plain(&problem.name),
        env!("CARGO_PKG_VERSION")
    );
    let list = |names: &[String]| names.join(", ");
    let covariates: Vec<String> =
        problem.data.covariates.iter().map(|covariate| plain(&covariate.name)).collect();
    let header = format!(
        "{about}#ifndef FLEXCAL_MODEL_H\n#define FLEXCAL_MODEL_H\n\n\
         #define FLEXCAL_JOINTS {} /* {} */\n#define FLEXCAL_BASES {} /* {} */\n\
         #define FLEXCAL_TARGETS {} /* {} */\n#define FLEXCAL_COVARIATES {} /* {} */\n{}",
        joints.len(),
        list(&joints),
        bases.len(),
        list(&bases),
        targets.len(),
        list(&targets),
        covariates.len(),
        list(&covariates),
        include_str!("c/model.h")
    );
    let changes = tables.as_ref().map(|tables| {
        let at = |x: &DVector<f64>| Numbers::of(&model.parts(x.as_slice()), names).values;
        remainder_tables(tables, x, at)
    });
    let terms = terms(&parts, &numbers)?;
    let is_elastic = parts.arm.is_elastic();
    let mut text =
        format!("{about}#include \"flexcal_model.h\"\n\n{}", include_str!("c/prelude.c"));
    push_structure(&mut text, problem, &parts, tables.is_some());
    let _ = writeln!(text, "#define HAS_APPROACH {}", u8::from(answers.has_approach));
    push_numbers(&mut text, &numbers);
    text.push_str(&changes.unwrap_or_default());
    text.push_str(include_str!("c/frames.c"));
    text.push_str(&helpers(&terms));
    text.push_str(&terms);
    text.push_str(if is_elastic { include_str!("c/elastic.c") } else { include_str!("c/rigid.c") });
    text.push_str(include_str!("c/predict.c"));
    if tables.is_some() {
        text.push_str(include_str!("c/remainder.c"));
    }
    text.push_str(include_str!("c/inverse.c"));
    let columns = answers.rows.first().map_or(1, Vec::len);
    let mut test = format!(
        "{about}#include \"flexcal_model.h\"\n\n#include <stdio.h>\n#include <time.h>\n\n\
         enum {{ ROWS = {}, COLUMNS = {columns} }};\n",
        answers.rows.len()
    );
    test.push_str("\nstatic const double ROW[ROWS][COLUMNS] = {\n");
    for row in &answers.rows {
        let numbers: Vec<String> = row.iter().map(|number| format!("{number:?}")).collect();
        let _ = writeln!(test, "    {{{}}},", numbers.join(", "));
    }
    test.push_str("};\n");
    test.push_str(include_str!("c/test.c"));
    Ok(Sources { header, model: text, test })
}

/// Returns a name without characters that would end a C comment.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_graphic() && !"*\\".contains(c) { c } else { '_' }).collect()
}

/// Appends the structure of the arm to the C text: sizes and index tables.
fn push_structure(text: &mut String, problem: &Problem, parts: &ModelParts, has_remainder: bool) {
    let arm = &parts.arm;
    let beams: Vec<usize> =
        (0..arm.joints.len()).filter(|&j| arm.joints[j].beam.is_some()).collect();
    let (mut infos, mut first_body) = (Vec::new(), 0);
    for (joint, declared) in arm.joints.iter().zip(&problem.joints) {
        let kind = match joint.kind {
            JointKind::Revolute => "REVOLUTE",
            JointKind::Prismatic => "PRISMATIC",
            JointKind::Fixed => "FIXED",
        };
        let index = |of: Option<usize>| of.map_or("-1".to_owned(), |index| index.to_string());
        let beam = beams.iter().position(|&beam| std::ptr::eq(&raw const arm.joints[beam], joint));
        let flags = [declared.command_kind() != JointKind::Fixed, joint.placement.is_some()];
        let more = [
            joint.flexibility.is_some() || joint.nonlinear.is_some(),
            joint.lateral.is_some(),
            joint.slide.is_some(),
            joint.compensator.is_some(),
        ];
        infos.push(format!(
            "{{{kind}, {}, {}, {}, {}, {}, {first_body}, {}}}",
            index(declared.parent),
            index(declared.mimic.map(|mimic| mimic.joint)),
            bits(&flags),
            index(beam),
            bits(&more),
            joint.bodies.len()
        ));
        first_body += joint.bodies.len();
    }
    let count = |is_it: fn(&crate::mechanics::Joint<f64>) -> bool| {
        arm.joints.iter().filter(|j| is_it(j)).count()
    };
    let mut define = |name: &str, value: usize| _ = writeln!(text, "#define {name} {value}");
    let loads =
        |beam: &crate::mechanics::Beam<f64>| beam.masses.len() + usize::from(beam.added.is_some());
    let of_beams = || beams.iter().filter_map(|&joint| arm.joints[joint].beam.as_ref());
    let hoists = of_beams().filter(|beam| beam.hoist.is_some()).count();
    let hooks = if arm.rope.is_some() { 2 * hoists } else { 0 };
    let (lateral, slides) = (count(|j| j.lateral.is_some()), count(|j| j.slide.is_some()));
    let flexible = count(|j| j.flexibility.is_some() || j.nonlinear.is_some());
    let tilts = lateral + 2 * slides + usize::from(arm.mounting.is_some());
    define("BEAMS", beams.len());
    define("HOISTS", hoists);
    define("LEANING_ROPES", usize::from(arm.rope.is_some() && hoists > 0));
    define("MOUNTING", usize::from(arm.mounting.is_some()));
    define("UNDEFLECTED", usize::from(arm.equilibrium == Equilibrium::Undeflected));
    define("MIXING", usize::from(arm.mixing.is_some()));
    define("TILTS", tilts);
    define("SPRINGS", count(|j| j.compensator.is_some()));
    define("ELEMENTS", arm.beam_elements);
    define("MAX_LOADS", of_beams().map(|beam| loads(beam) + 1).max().unwrap_or(1));
    define("FIRST_MOMENT", hooks);
    define("UNKNOWNS", hooks + 3 * arm.beam_elements * beams.len() + 2 * tilts + flexible);
    let on_beams: usize = of_beams().map(|beam| 2 * arm.beam_elements + loads(beam) + 1).sum();
    define("EVENTS", 4 * arm.joints.len() + 2 + on_beams + tilts + first_body);
    define("PAYLOAD_JOINT", arm.payload_on.unwrap_or(arm.joints.len().saturating_sub(1)));
    let moves = parts.terms.iter().any(|term| matches!(term.site, PartSite::Motion { .. }));
    define("MOTIONS", usize::from(moves));
    define("REMAINDER", usize::from(has_remainder));
    let hoist = of_beams().find_map(|beam| beam.hoist).map_or(0.0, |hoist| hoist.force);
    let reference = problem.data.reference_temperature.unwrap_or(0.0);
    for (name, value) in
        [("PAYLOAD", arm.payload_mass), ("HOIST_FORCE", hoist), ("REFERENCE", reference)]
    {
        let _ = writeln!(text, "#define {name} {}", real(value));
    }
    let _ = writeln!(
        text,
        "\nstatic const joint_info JOINT[JOINTS] = {{\n    {}\n}};",
        infos.join(",\n    ")
    );
    if !beams.is_empty() {
        text.push_str(
            "\ntypedef struct { int first_load, loads, hoist, has_strain; } beam_info;\n",
        );
        let (mut first, mut hoist) = (0, 0);
        let rows = of_beams().map(|beam| {
            let has_strain = beam.strain.is_some();
            let number = if beam.hoist.is_some() { hoist.to_string() } else { "-1".to_owned() };
            let row =
                format!("{{{first}, {}, {number}, {}}}", loads(beam), usize::from(has_strain));
            first += loads(beam);
            hoist += usize::from(beam.hoist.is_some());
            row
        });
        let rows: Vec<String> = rows.collect();
        let _ = writeln!(text, "static const beam_info BEAM[BEAMS] = {{{}}};", rows.join(", "));
    }
    let joints: Vec<String> = parts.targets.iter().map(|target| target.0.to_string()).collect();
    let _ = writeln!(
        text,
        "static const int TARGET_JOINT[FLEXCAL_TARGETS] = {{{}}};",
        joints.join(", ")
    );
    let limits =
        problem.joints.iter().map(|j| format!("{{{}, {}}}", real(j.limits.0), real(j.limits.1)));
    let limits: Vec<String> = limits.collect();
    let _ = writeln!(
        text,
        "/* Range of each command [rad] or [m]. */\nstatic const real LIMIT[JOINTS][2] = {{{}}};",
        limits.join(", ")
    );
    let ratios: Vec<f64> =
        problem.joints.iter().map(|j| j.mimic.map_or(0.0, |m| m.ratio)).collect();
    let _ = writeln!(text, "/* Coordinate of a mimic joint over the command of its leader. */");
    array(text, "RATIO", &ratios);
}

/// Returns flags as 0 and 1, separated by commas.
fn bits(flags: &[bool]) -> String {
    flags.iter().map(|&flag| usize::from(flag).to_string()).collect::<Vec<_>>().join(", ")
}

/// Appends the numbers of the model to the C text, each with a comment.
fn push_numbers(text: &mut String, numbers: &Numbers) {
    text.push_str("\n/* Offsets within the numbers of the model. */\nenum {\n");
    for (prefix, fields) in [("J", JOINT), ("B", BEAM), ("L", LOAD), ("H", HOIST), ("F", FRAME)] {
        let names: Vec<String> =
            fields.iter().map(|(name, _)| format!("{prefix}_{name}")).collect();
        let _ = writeln!(text, "    {} = 0, {}, {prefix}_SIZE,", names[0], names[1..].join(", "));
    }
    for (name, first) in &numbers.groups {
        let _ = writeln!(text, "    N_{name} = {first},");
    }
    let _ = writeln!(
        text,
        "    NUMBERS = {}\n}};\n\nstatic const real NUMBER[NUMBERS] = {{",
        numbers.values.len()
    );
    for (value, comment) in numbers.values.iter().zip(&numbers.comments) {
        let _ = writeln!(
            text,
            "    {}, /* {} */",
            real(*value),
            comment.replace("*/", "* /").replace("/*", "/ *")
        );
    }
    text.push_str("};\n\n");
}

/// Returns the C function that evaluates the terms of laws and effects in a pose.
fn terms(parts: &ModelParts, numbers: &Numbers) -> Result<String, ExportError> {
    let mut text = include_str!("c/terms.c").to_owned();
    let mut at = numbers.groups.last().map_or(0, |group| group.1);
    for term in &parts.terms {
        let place = match term.site {
            PartSite::Joint(joint) => format!("coordinate[{joint}]"),
            PartSite::Strain { joint, which } => {
                let beam = parts.arm.joints[..joint].iter().filter(|j| j.beam.is_some()).count();
                format!("strain[{beam}][{which}]")
            }
            PartSite::Motion { joint, which } => format!("motion[{joint}][{which}]"),
            PartSite::Shift { axis: RANGE_AXIS, .. } => "range".to_owned(),
            PartSite::Shift { axis, is_error } => {
                format!("shift[{}][{axis}]", usize::from(is_error))
            }
            PartSite::Turn { axis, is_error } => format!("turn[{}][{axis}]", usize::from(is_error)),
        };
        let value = formula(&term.regressor, at + 1)?;
        let _ = writeln!(text, "    term->{place} += number[{at}] * {value};");
        at += 1 + inner(&term.regressor).len();
    }
    text.push_str("}\n\n");
    Ok(text)
}
