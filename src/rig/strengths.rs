//! Reader of the tables `[[effect]]` of a truth: effects as in the problem file, with their values.

use super::effect::{Cause, Shape, TrueEffect, keys};
use crate::error::{InputError, InputErrorKind, Location};
use crate::laws::{LAW, Need};
use crate::problem::effect::NAMES;
use crate::problem::effects::{declared, effect, gives_way};
use crate::problem::item::Item;
use crate::problem::section::Section;
use crate::problem::{Effect, PoseRanges, Problem};

/// Key that declares an effect outside the catalogue.
const OUTSIDE: &str = "outside";

/// Reads every table `[[effect]]` of a truth.
pub(super) fn read(
    root: &mut Section<'_, '_>,
    problem: &Problem,
    poses: &PoseRanges,
) -> Result<Vec<TrueEffect>, InputError> {
    let sections = root.sections("effect")?.into_iter();
    let located = sections
        .map(|section| located_effect(section, problem, poses))
        .collect::<Result<Vec<(TrueEffect, Location)>, _>>()?;
    for (effect, location) in &located {
        let Some(joint) = effect.catalogued().and_then(|(effect, _)| effect.compensated()) else {
            continue;
        };
        let catalogued = located.iter().filter_map(|(effect, _)| effect.catalogued());
        let effects = catalogued.map(|(effect, _)| effect);
        if !gives_way(joint, &problem.joints, effects) {
            return Err(location.clone().error(InputErrorKind::NothingToRelieve { joint }));
        }
    }
    Ok(located.into_iter().map(|(effect, _)| effect).collect())
}

/// Reads one effect with its location in the file.
fn located_effect(
    mut section: Section<'_, '_>,
    problem: &Problem,
    poses: &PoseRanges,
) -> Result<(TrueEffect, Location), InputError> {
    let (name, item) = declaration(&section)?;
    section.get(name);
    let cause = if name == OUTSIDE {
        outside(&item, problem)?
    } else if name == LAW {
        Cause::Catalogued(declared(name, &item, &problem.joints, &problem.data, &problem.fixtures)?)
    } else {
        Cause::Catalogued(effect(name, &item, &problem.joints)?)
    };
    if let Cause::Catalogued(effect) = &cause
        && let Some(kind) = effect.refusal(problem.statics, &problem.joints, &problem.data)
        && effect.covariate().is_some()
    {
        return Err(item.error(kind));
    }
    if matches!(&cause, Cause::Catalogued(effect) if effect.has_need(&[Need::Velocities])) {
        return Err(item.error(InputErrorKind::NeedsColumn {
            write: "velocities of the joints; simulated images are of an arm at rest",
        }));
    }
    if matches!(&cause, Cause::Catalogued(effect) if effect.covariate().is_some())
        && poses.covariates.is_empty()
    {
        return Err(item.error(InputErrorKind::NeedsColumn {
            write: "covariates = { name = [from, to] } in [poses]",
        }));
    }
    check_temperature(&cause, &item, problem, poses)?;
    let keys = keys(&cause, &problem.joints);
    let mut values = Vec::with_capacity(keys.len());
    let mut has_value = false;
    for (key, unit) in &keys {
        let value = section.number(key, *unit)?;
        has_value |= value.is_some();
        values.push(value.unwrap_or(0.0));
    }
    section.finish()?;
    let write =
        || keys.iter().map(|(key, unit)| unit.alternatives(key)).collect::<Vec<_>>().join(", ");
    if !has_value {
        return Err(item.error(InputErrorKind::NoStrength { write: write() }));
    }
    match (&cause, values.as_slice()) {
        (Cause::Outside { .. }, &[.., width]) if width <= 0.0 => {
            return Err(item.error(InputErrorKind::NoStrength {
                write: format!("a width above 0: {}", write()),
            }));
        }
        (Cause::Catalogued(Effect::DeflectedEquilibrium), &[lambda])
            if (lambda - 1.0).abs() > 0.0 =>
        {
            return Err(item.error(InputErrorKind::AlwaysInEquilibrium));
        }
        _ => {}
    }
    // There is one value for each key.
    TrueEffect::new(cause, &values, &problem.joints)
        .map(|effect| (effect, item.location()))
        .map_err(|_| item.error(InputErrorKind::NoStrength { write: write() }))
}

/// Returns the key that declares the effect, with its value: a known name, or else the first entry
/// that is a table.
fn declaration<'a, 'i>(section: &Section<'a, 'i>) -> Result<(&'a str, Item<'a, 'i>), InputError> {
    let entries = section.entries();
    let is_effect = |(name, item): &(&str, Item<'_, '_>)| {
        *name == OUTSIDE || NAMES.contains(name) || item.section().is_ok() || item.boolean().is_ok()
    };
    let mut declared: Vec<_> = entries.into_iter().filter(is_effect).collect();
    match (declared.pop(), declared.len()) {
        (Some(single), 0) => Ok(single),
        (last, others) => {
            let found = others + usize::from(last.is_some());
            let remedy = (found > 1).then(|| "write each into an [[effect]] of its own".to_owned());
            Err(section.error(InputErrorKind::NotOneEffect { found, remedy }))
        }
    }
}

/// Reads `outside = { joint = 2, shape = "bump" }`.
fn outside(item: &Item<'_, '_>, problem: &Problem) -> Result<Cause, InputError> {
    let mut section = item.section()?;
    let item = section.require("joint", "joint = …, a joint's number")?;
    let joint = item.whole(0)?;
    let joints = problem.joints.len();
    let number = usize::try_from(joint).ok().filter(|number| (1..=joints).contains(number));
    let number =
        number.ok_or_else(|| item.error(InputErrorKind::UnknownJoint { joint, joints }))?;
    let shape = section
        .word("shape", &["bump", "step"], &[Shape::Bump, Shape::Step])?
        .unwrap_or(Shape::Bump);
    section.finish()?;
    Ok(Cause::Outside { joint: number, shape })
}

/// Checks, for a thermal effect, that the poses have temperatures and the problem a reference
/// temperature.
fn check_temperature(
    cause: &Cause,
    item: &Item<'_, '_>,
    problem: &Problem,
    poses: &PoseRanges,
) -> Result<(), InputError> {
    let is_thermal = matches!(cause, Cause::Catalogued(effect) if effect.is_thermal());
    let write = if poses.temperature.is_none() {
        "temperature_C = [from, to] in [poses]"
    } else if problem.data.reference_temperature.is_none() {
        "reference_temperature_C in [data] of the problem"
    } else {
        return Ok(());
    };
    if is_thermal { Err(item.error(InputErrorKind::NeedsTemperature { write })) } else { Ok(()) }
}
