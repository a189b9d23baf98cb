//! The tables `[[effect]]` of a truth: an effect as the problem file declares it, and beside it how
//! strong it is.

use super::effect::{Cause, Shape, TrueEffect, keys};
use crate::error::{InputError, InputErrorKind, Location};
use crate::problem::effect::NAMES;
use crate::problem::effects::{effect, gives_way};
use crate::problem::item::Item;
use crate::problem::section::Section;
use crate::problem::{Effect, PoseRanges, Problem};

/// The key of what no catalogue holds.
const OUTSIDE: &str = "outside";

/// Every `[[effect]]`.
pub(super) fn read(
    root: &mut Section<'_, '_>,
    problem: &Problem,
    poses: &PoseRanges,
) -> Result<Vec<TrueEffect>, InputError> {
    let all = root.sections("effect")?.into_iter().map(|section| one(section, problem, poses));
    let all = all.collect::<Result<Vec<(TrueEffect, Location)>, _>>()?;
    for (own, location) in &all {
        let Some(joint) = own.parts().and_then(|(effect, _)| effect.compensated()) else {
            continue;
        };
        let effects = all.iter().filter_map(|(own, _)| own.parts()).map(|(effect, _)| effect);
        if !gives_way(joint, &problem.joints, effects) {
            return Err(location.clone().error(InputErrorKind::NothingToRelieve { joint }));
        }
    }
    Ok(all.into_iter().map(|(own, _)| own).collect())
}

/// One with where it stands.
fn one(
    mut section: Section<'_, '_>,
    problem: &Problem,
    poses: &PoseRanges,
) -> Result<(TrueEffect, Location), InputError> {
    let (name, item) = declaration(&section)?;
    section.get(name);
    let cause = if name == OUTSIDE {
        outside(&item, problem)?
    } else {
        Cause::Catalogued(effect(name, &item, &problem.joints)?)
    };
    if let Cause::Catalogued(effect) = &cause
        && let Some(kind) = effect.refusal(problem.statics, &problem.joints, &problem.data)
        && effect.covariate().is_some()
    {
        return Err(item.error(kind));
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
    let mut given = false;
    for (key, unit) in &keys {
        let value = section.number(key, *unit)?;
        given |= value.is_some();
        values.push(value.unwrap_or(0.0));
    }
    section.finish()?;
    let write =
        || keys.iter().map(|(key, unit)| unit.alternatives(key)).collect::<Vec<_>>().join(", ");
    if !given {
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
    // The number of values is that of the keys.
    TrueEffect::new(cause, &values, &problem.joints)
        .map(|own| (own, item.location()))
        .map_err(|_| item.error(InputErrorKind::NoStrength { write: write() }))
}

/// The one key that says what the effect is: a known name, or else the first that does not look
/// like a strength.
fn declaration<'a, 'i>(section: &Section<'a, 'i>) -> Result<(&'a str, Item<'a, 'i>), InputError> {
    let entries = section.entries();
    let is_effect = |(name, item): &(&str, Item<'_, '_>)| {
        *name == OUTSIDE || NAMES.contains(name) || item.section().is_ok() || item.boolean().is_ok()
    };
    let mut declared: Vec<_> = entries.into_iter().filter(is_effect).collect();
    match (declared.pop(), declared.len()) {
        (Some(only), 0) => Ok(only),
        (last, others) => {
            let found = others + usize::from(last.is_some());
            Err(section.error(InputErrorKind::NotOneEffect { found }))
        }
    }
}

/// `outside = { joint = 2, shape = "bump" }`.
fn outside(item: &Item<'_, '_>, problem: &Problem) -> Result<Cause, InputError> {
    let mut section = item.section()?;
    let place = section.require("joint", "joint = …, a joint's number")?;
    let joint = place.whole(0)?;
    let joints = problem.joints.len();
    let number = usize::try_from(joint).ok().filter(|number| (1..=joints).contains(number));
    let number =
        number.ok_or_else(|| place.error(InputErrorKind::UnknownJoint { joint, joints }))?;
    let shape = section
        .word("shape", &["bump", "step"], &[Shape::Bump, Shape::Step])?
        .unwrap_or(Shape::Bump);
    section.finish()?;
    Ok(Cause::Outside { joint: number, shape })
}

/// Thermal effects need temperatures and what to compare them with.
fn check_temperature(
    cause: &Cause,
    item: &Item<'_, '_>,
    problem: &Problem,
    poses: &PoseRanges,
) -> Result<(), InputError> {
    let thermal = matches!(cause, Cause::Catalogued(effect) if effect.is_thermal());
    let write = if poses.temperature.is_none() {
        "temperature_C = [from, to] in [poses]"
    } else if problem.data.reference_temperature.is_none() {
        "reference_temperature_C in [data] of the problem"
    } else {
        return Ok(());
    };
    if thermal { Err(item.error(InputErrorKind::NeedsTemperature { write })) } else { Ok(()) }
}
