//! Reader of declared laws: `law = { name, at, terms, sigma_…, parameters }`.

use super::item::Item;
use super::section::Section;
use super::{Data, Fixture, FixtureKind, Joint, JointKind, beam_names, named_cameras};
use crate::error::{InputError, InputErrorKind};
use crate::laws::expression::{FormulaError, Vocabulary};
use crate::laws::{At, BeamField, Effect, FOCAL, Law, LawParameter, LawPrior, LawSite};
use crate::quantity::Unit;

/// Maximum number of terms of one law.
const MAX_LAW_TERMS: usize = 50;
/// Maximum number of parameters inside the formulas of one law.
const MAX_LAW_PARAMETERS: usize = 20;
/// Keys of a law other than the prior, whose key has a unit suffix.
const LAW_KEYS: [&str; 3] = ["name", "at", "terms"];

/// Reads a law for an arm with these joints and cameras, and data with these covariates.
pub(super) fn read(
    mut section: Section<'_, '_>,
    joints: &[Joint],
    data: &Data,
    fixtures: &[Fixture],
) -> Result<Effect, InputError> {
    let name = section.require("name", "name = \"…\", a word for its parameters")?;
    let at = section.require("at", "at = \"joint1\", the site that the law adds to")?;
    let terms = section.require("terms", "terms = [\"sin(q1)\"], formulas")?;
    let named = checked_name(&name, name.text()?, "a law")?;
    let names: Vec<(String, usize)> =
        joints.iter().enumerate().map(|(k, joint)| (joint.name.clone(), k)).collect();
    let links = beam_names(joints);
    let site = LawSite::parse(at.text()?, joints.len(), &names, &links, &named_cameras(fixtures))
        .map_err(|reason| at.error(InputErrorKind::LawSite { reason }))?;
    let prior = read_prior(&mut section, law_unit(site.at, site.joint(), joints))?;
    let parameters = read_parameters(&mut section)?;
    let formulas = read_formulas(&terms)?;
    let slides: Vec<bool> = joints.iter().map(|joint| joint.kind == JointKind::Prismatic).collect();
    let covariates: Vec<String> =
        data.covariates.iter().map(|covariate| covariate.name.clone()).collect();
    let vocabulary =
        Vocabulary { slides: &slides, joints: &names, covariates: &covariates, parameters: &[] };
    let texts: Vec<&str> = formulas.iter().map(|(_, text)| *text).collect();
    let law =
        Law::new(&named, site, &texts, prior, parameters, &vocabulary).map_err(|(k, error)| {
            match formulas.get(k) {
                Some((item, text)) => formula_error(item, text, error),
                None => section.error(InputErrorKind::NoTermsOfLaw),
            }
        })?;
    check_command(&law, &at, joints)?;
    for (key, item) in section.entries() {
        let is_parameter = law.parameters().iter().any(|parameter| parameter.name == key);
        if is_parameter && !law.uses(key) {
            return Err(item.error(InputErrorKind::UnusedParameter { name: key.to_owned() }));
        }
    }
    section.finish()?;
    Ok(Effect::Law(law))
}

/// Returns an error if the law acts on the coordinate of a fixed joint, which has no command.
fn check_command(law: &Law, at: &Item, joints: &[Joint]) -> Result<(), InputError> {
    let joint = law.joint().filter(|_| law.at() == At::Coordinate);
    let declared = joint.and_then(|joint| Some((joint, joints.get(joint.wrapping_sub(1))?)));
    match declared.map(|(joint, declared)| (joint, declared.command_kind())) {
        Some((joint, JointKind::Fixed)) => Err(at.error(InputErrorKind::NoCommand { joint })),
        _ => Ok(()),
    }
}

/// Returns the text as a name if it consists of letters, digits, _ and -, so that it cannot be
/// confused with a pattern or bracket. `noun` describes it in the error.
fn checked_name(item: &Item, text: &str, noun: &'static str) -> Result<String, InputError> {
    let is_word = text.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    if is_word {
        Ok(text.to_owned())
    } else {
        Err(item.error(InputErrorKind::NotAWord { name: text.to_owned(), noun }))
    }
}

/// Returns the unit of the quantity to which a law adds at the site `at`; `joint` counts from 1.
pub(crate) fn law_unit(at: At, joint: Option<usize>, joints: &[Joint]) -> Unit {
    let slides = |number: usize| {
        joints.get(number.wrapping_sub(1)).is_some_and(|joint| joint.kind == JointKind::Prismatic)
    };
    match at {
        At::Coordinate if joint.is_some_and(slides) => Unit::Length,
        At::Coordinate | At::BaseTurn(_) | At::Before(3..) | At::After(3..) | At::Tool(3..) => {
            Unit::Angle
        }
        At::Beam(BeamField::Stretch) => Unit::Ratio,
        At::Beam(_) => Unit::PerLength,
        At::Camera(FOCAL) => Unit::Pixel,
        At::Camera(field) => [FixtureKind::Camera, FixtureKind::Fisheye]
            .iter()
            .find_map(|kind| Some(kind.unit(kind.fields().iter().position(|name| *name == field)?)))
            .unwrap_or(Unit::Number),
        _ => Unit::Length,
    }
}

fn read_prior(section: &mut Section<'_, '_>, unit: Unit) -> Result<Option<LawPrior>, InputError> {
    let Some((item, suffix)) = section.quantity("sigma", unit)? else { return Ok(None) };
    let written = item.number()?;
    let sigma = (suffix.to_si)(written);
    if sigma > 0.0 {
        Ok(Some(LawPrior { sigma, key: format!("sigma_{}", suffix.name), written }))
    } else {
        Err(item.error(InputErrorKind::NotPositive { value: written }))
    }
}

/// Reads the parameters inside the formulas: every table `k = { start, min, max, sigma }`.
fn read_parameters(section: &mut Section<'_, '_>) -> Result<Vec<LawParameter>, InputError> {
    let mut parameters = Vec::new();
    for (key, item) in section.entries() {
        if LAW_KEYS.contains(&key) || !item.holds_tables() {
            continue;
        }
        section.get(key);
        let starts_as_word = key.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let is_free = !Vocabulary::is_reserved(key);
        if !starts_as_word || !is_free || key.contains('-') {
            let (name, noun) = (key.to_owned(), "a parameter of a formula");
            return Err(item.error(InputErrorKind::NotAWord { name, noun }));
        }
        let name = checked_name(&item, key, "a parameter of a formula")?;
        let mut section = item.section()?;
        let start = section.require("start", "start = …, the value at which the fit begins")?;
        let mut number = |key: &str| section.get(key).map(|item| item.number()).transpose();
        let (min, max, sigma) = (number("min")?, number("max")?, number("sigma")?);
        let parameter = LawParameter { name, start: start.number()?, min, max, sigma };
        if sigma.is_some_and(|sigma| sigma <= 0.0) {
            let value = sigma.unwrap_or_default();
            return Err(item.error(InputErrorKind::NotPositive { value }));
        }
        let is_within = min.is_none_or(|min| min <= parameter.start)
            && max.is_none_or(|max| parameter.start <= max);
        if !is_within {
            let start_value = parameter.start;
            return Err(start.error(InputErrorKind::StartOutOfBounds { start: start_value }));
        }
        section.finish()?;
        parameters.push(parameter);
    }
    if let Some(extra) = parameters.get(MAX_LAW_PARAMETERS)
        && let Some(item) = section.peek(&extra.name)
    {
        item.check_count("parameters of a law", parameters.len(), MAX_LAW_PARAMETERS)?;
    }
    Ok(parameters)
}

/// Reads the formulas, each with its location.
fn read_formulas<'a, 'i>(terms: &Item<'a, 'i>) -> Result<Vec<(Item<'a, 'i>, &'a str)>, InputError> {
    let elements = terms.list("a list of formulas in quotes")?;
    terms.check_count("terms", elements.len(), MAX_LAW_TERMS)?;
    if elements.is_empty() {
        return Err(terms.error(InputErrorKind::NoTermsOfLaw));
    }
    let read = |item: Item<'a, 'i>| {
        let text = item.text()?;
        Ok((item, text))
    };
    elements.into_iter().map(read).collect()
}

/// Returns the error of a formula, located at the part of the text that caused it.
fn formula_error(item: &Item, text: &str, error: FormulaError) -> InputError {
    let FormulaError { column, span, mistake } = error;
    let kind = InputErrorKind::Formula { column, mistake: mistake.to_string() };
    let start = item.span.start + 1;
    // A text with escapes differs from its spelling in the file, so columns cannot be located.
    let is_verbatim = item.document.text.get(start..start + text.len()) == Some(text);
    if is_verbatim && !span.is_empty() {
        let span = start + span.start..start + span.end;
        return item.document.locate(span).with_key(item.key.as_str()).error(kind);
    }
    item.error(kind)
}
