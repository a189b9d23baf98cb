//! Reader of the tables `[[effect]]`: one effect each, with its arguments.

use std::path::Path;

use toml::de::DeTable;

use super::argument::ArgumentReader;
use super::effect::example;
use super::item::{Document, Item};
use super::law;
use super::section::Section;
use super::{Data, Effect, EffectDeclaration, Fixture, Joint, Problem, Statics, named_cameras};
use crate::error::{InputError, InputErrorKind, Location};
use crate::laws::{Argument, FAMILIES, LAW, NAMES};

/// Reads all `[[effect]]` tables.
pub(super) fn read(
    root: &mut Section<'_, '_>,
    joints: &[Joint],
    data: &Data,
    fixtures: &[Fixture],
) -> Result<Vec<EffectDeclaration>, InputError> {
    let mut effects: Vec<EffectDeclaration> = Vec::new();
    for section in root.sections("effect")? {
        let (name, item) = only_entry(&section)?;
        let effect = declared(name, &item, joints, data, fixtures)?;
        let is_same = |known: &&EffectDeclaration| known.effect.is_same_as(&effect);
        if let Some(first) = effects.iter().find(is_same) {
            let line = first.location.line.unwrap_or(0);
            return Err(item.error(InputErrorKind::RepeatedEffect { line }));
        }
        let shared = |known: &EffectDeclaration| {
            Some((known.effect.shared_order(&effect)?, known.location.line.unwrap_or(0)))
        };
        if let Some((order, line)) = effects.iter().find_map(shared) {
            return Err(item.error(InputErrorKind::RepeatedHarmonic { order, line }));
        }
        effects.push(EffectDeclaration { effect, location: item.location() });
    }
    Ok(effects)
}

/// Returns an error if an effect could never act on this arm.
pub(super) fn check(
    effects: &[EffectDeclaration],
    statics: Statics,
    joints: &[Joint],
    data: &Data,
) -> Result<(), InputError> {
    effects.iter().try_for_each(|declared| check_alone(declared, statics, joints, data))?;
    check_compensators(effects, joints)
}

/// Returns an error if an effect names a camera that the problem does not declare.
pub(super) fn check_cameras(
    effects: &[EffectDeclaration],
    fixtures: &[Fixture],
) -> Result<(), InputError> {
    let known: Vec<String> = named_cameras(fixtures).into_iter().map(|(name, _)| name).collect();
    for EffectDeclaration { effect, location } in effects {
        if let Some(name) = effect.camera().filter(|name| !known.contains(name)) {
            let kind = InputErrorKind::UnknownFixture { what: "camera", name, known };
            return Err(location.clone().error(kind));
        }
    }
    Ok(())
}

/// Returns an error if an effect could never act on this arm, regardless of other effects.
fn check_alone(
    EffectDeclaration { effect, location }: &EffectDeclaration,
    statics: Statics,
    joints: &[Joint],
    data: &Data,
) -> Result<(), InputError> {
    effect.refusal(statics, joints, data).map_or(Ok(()), |kind| Err(location.clone().error(kind)))
}

/// Returns an error for a gravity compensator at a joint that does not rotate under a moment, and
/// for a second compensator of a joint.
fn check_compensators(effects: &[EffectDeclaration], joints: &[Joint]) -> Result<(), InputError> {
    for (k, EffectDeclaration { effect, location }) in effects.iter().enumerate() {
        let Some(joint) = effect.compensated() else { continue };
        if let Some(first) =
            effects.iter().take(k).find(|known| known.effect.compensated() == Some(joint))
        {
            let line = first.location.line.unwrap_or(0);
            return Err(location
                .clone()
                .error(InputErrorKind::RepeatedCompensator { joint, line }));
        }
        if !gives_way(joint, joints, effects.iter().map(|declared| &declared.effect)) {
            return Err(location.clone().error(InputErrorKind::NothingToRelieve { joint }));
        }
    }
    Ok(())
}

/// Returns true if a joint, counted from 1, rotates under a moment about its axis: it has a
/// stiffness, or one of `effects` makes it compliant.
pub(crate) fn gives_way<'e>(
    joint: usize,
    joints: &[Joint],
    mut effects: impl Iterator<Item = &'e Effect>,
) -> bool {
    let stiff = joints.get(joint.wrapping_sub(1)).is_some_and(|joint| joint.stiffness.is_some());
    stiff || effects.any(|effect| effect.makes_compliant(joint))
}

/// Parses one effect, written as in a problem file, without its `[[effect]]`: `gear-ratio = { joint
/// = 3 }`. A name alone, such as `hoist-force`, is short for `hoist-force = true`.
pub(super) fn parse(
    text: &str,
    named: &Path,
    problem: &Problem,
) -> Result<EffectDeclaration, InputError> {
    if text.contains('=') {
        return parse_written(text.to_owned(), named, problem);
    }
    parse_written(format!("{text} = true"), named, problem).map_err(|error| {
        let kind = match *error.kind {
            InputErrorKind::MissingKey { .. } => InputErrorKind::NeedsArguments {
                write: format!("'{}'", example(text.trim(), problem)),
            },
            kind => kind,
        };
        // The text around the effect was generated, so only the effect itself is quoted.
        Location::file(named).with_key(text.trim()).error(kind)
    })
}

fn parse_written(
    text: String,
    named: &Path,
    problem: &Problem,
) -> Result<EffectDeclaration, InputError> {
    let document = Document { file: named.to_owned(), text: text.into() };
    let table = document.table()?;
    let section = Section::new(&document, String::new(), 0..0, table.get_ref());
    let (name, item) = only_entry(&section)?;
    let declared = EffectDeclaration {
        effect: self::declared(name, &item, &problem.joints, &problem.data, &problem.fixtures)?,
        location: item.location(),
    };
    check_alone(&declared, problem.statics, &problem.joints, &problem.data)?;
    let effects = [problem.effects.as_slice(), std::slice::from_ref(&declared)].concat();
    check_compensators(&effects, &problem.joints)?;
    Ok(declared)
}

/// Returns the only entry of an `[[effect]]`, with its key.
fn only_entry<'a, 'i>(section: &Section<'a, 'i>) -> Result<(&'a str, Item<'a, 'i>), InputError> {
    match <[_; 1]>::try_from(section.entries()) {
        Ok([entry]) => Ok(entry),
        Err(entries) => {
            let (found, remedy) = (section.len(), several_keys(&entries));
            Err(section.error(InputErrorKind::NotOneEffect { found, remedy }))
        }
    }
}

/// Returns the remedy for an `[[effect]]` with several keys; `None` if it has none.
fn several_keys(entries: &[(&str, Item)]) -> Option<String> {
    let is_effect = |key: &str| key == LAW || NAMES.contains(&key);
    let (first, _) = entries.first()?;
    if entries.iter().all(|(key, _)| is_effect(key)) {
        return Some("write each into an [[effect]] of its own".to_owned());
    }
    let named = entries.iter().find_map(|(key, item)| Some((*key, item.value.as_str()?)));
    if let Some((key, name)) = named.filter(|(_, name)| is_effect(name)) {
        let others = entries.iter().filter(|(other, _)| *other != key);
        let arguments: Vec<String> = others.map(|(_, item)| item.written()).collect();
        return Some(format!(
            "the name of the effect is its key: write {name} = {{ {} }}",
            arguments.join(", ")
        ));
    }
    let other = entries.iter().map(|(key, _)| *key).find(|key| !is_effect(key));
    let other = other.unwrap_or(first);
    Some(if entries.iter().any(|(key, _)| is_effect(key)) {
        format!(
            "{other} is no effect: arguments of an effect stand within its braces, its prior in \
             [parameters]"
        )
    } else {
        "none of them is the name of an effect".to_owned()
    })
}

/// Reads an effect of the catalogue, or a declared law.
pub(crate) fn declared(
    name: &str,
    item: &Item<'_, '_>,
    joints: &[Joint],
    data: &Data,
    fixtures: &[Fixture],
) -> Result<Effect, InputError> {
    if name == LAW {
        law::read(item.section()?, joints, data, fixtures)
    } else {
        effect(name, item, joints)
    }
}

/// Reads an effect of the catalogue; the value `true` means no arguments.
pub(crate) fn effect(
    name: &str,
    item: &Item<'_, '_>,
    joints: &[Joint],
) -> Result<Effect, InputError> {
    let empty = DeTable::new();
    let section = match item.boolean() {
        Ok(true) => item.section_of(&empty),
        Ok(false) => return Err(item.wrong_type("a table of arguments, or true")),
        Err(_) => item.section()?,
    };
    let mut arguments = ArgumentReader::new(section, joints);
    let unknown =
        || item.error(InputErrorKind::UnknownEffect { name: name.to_owned(), known: NAMES });
    let family = FAMILIES.iter().find(|family| family.name == name).ok_or_else(unknown)?;
    let mut found: Vec<(&str, Argument)> = Vec::new();
    for (key, kind) in family.arguments {
        found.push((key, arguments.read(key, *kind)?));
    }
    arguments.section.finish()?;
    let argument =
        |key: &str| found.iter().find(|(known, _)| *known == key).map(|(_, value)| value.clone());
    Effect::from_name(name, &argument).ok_or_else(unknown)
}
