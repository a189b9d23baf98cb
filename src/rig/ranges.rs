//! The section `[poses]`.

use super::truth::HeldOutRows;
use crate::error::{InputError, InputErrorKind};
use crate::problem::fixture::frame;
use crate::problem::item::Item;
use crate::problem::section::Section;
use crate::problem::{Joint, JointKind, PoseRanges, Problem};
use crate::quantity::Unit;

/// Part of the rows that is held out where the file says nothing.
const HELD_OUT: f64 = 0.3;
/// Seconds between poses where the file says nothing.
const TIME_STEP: f64 = 60.0;

/// Other quantities of the section: no joint goes by their names.
const OTHERS: [&str; 4] = ["payload", "hoist", "temperature", "time_step"];

/// `[poses]`.
pub(super) struct Poses {
    pub ranges: PoseRanges,
    /// Time from one pose to the next \[s\].
    pub time_step: (f64, f64),
    pub held_out: HeldOutRows,
    /// How many rows measure positions before the others.
    pub positions: usize,
    /// Frames whose tilts are measured.
    pub tilts: Vec<usize>,
}

/// The section.
pub(super) fn read(mut section: Section<'_, '_>, problem: &Problem) -> Result<Poses, InputError> {
    let joints = problem.joints.iter().enumerate();
    let joints = joints.map(|(index, joint)| joint_range(&mut section, index + 1, joint, problem));
    let joints = joints.collect::<Result<_, _>>()?;
    let payloads = payloads(&mut section)?;
    let hoist = range(&mut section, "hoist", Unit::Force)?;
    let temperature = range(&mut section, "temperature", Unit::Temperature)?;
    let time_step = time_step(&mut section)?;
    let covariates =
        section.section("covariates")?.map_or(Ok(Vec::new()), |own| covariates(own, problem))?;
    let approach = section.get("approach").map_or(Ok(true), |item| item.boolean())?;
    let held_out = held_out(&mut section)?;
    let positions = section.get("positions").map_or(Ok(0), |item| item.small().map(usize::from))?;
    let tilts = tilts(&mut section, problem)?;
    section.finish()?;
    let ranges = PoseRanges { joints, payloads, hoist, temperature, approach, covariates };
    Ok(Poses { ranges, time_step, held_out, positions, tilts })
}

/// `q1_deg = [from, to]`, or the joint's own name instead of `q1` where it alone has that name.
fn joint_range(
    section: &mut Section<'_, '_>,
    number: usize,
    joint: &Joint,
    problem: &Problem,
) -> Result<(f64, f64), InputError> {
    let unit = match joint.command_kind() {
        JointKind::Revolute => Unit::Angle,
        JointKind::Prismatic => Unit::Length,
        JointKind::Fixed => return Ok((0.0, 0.0)),
    };
    let base = format!("q{number}");
    let is_number = |name: &str| {
        name.strip_prefix('q').is_some_and(|rest| rest.bytes().all(|own| own.is_ascii_digit()))
    };
    let is_shared = |name: &str| problem.joints.iter().filter(|own| own.name == name).count() > 1;
    let own = Some(joint.name.as_str())
        .filter(|own| !is_number(own) && !OTHERS.contains(own) && !is_shared(own));
    let by_name = own.map(|name| section.quantity(name, unit)).transpose()?.flatten();
    let (item, suffix) = match (section.quantity(&base, unit)?, by_name) {
        (Some((_, first)), Some((item, _))) => {
            return Err(
                item.error(InputErrorKind::GivenTwice { first: format!("{base}_{}", first.name) })
            );
        }
        (Some(found), None) | (None, Some(found)) => found,
        (None, None) => {
            return Err(
                section.missing(&base, format!("{} = [from, to]", unit.alternatives(&base)))
            );
        }
    };
    let (from, to) = pair(&item)?;
    Ok(((suffix.to_si)(from), (suffix.to_si)(to)))
}

/// `name = [from, to]` of each of the problem's own covariates, in its unit.
fn covariates(
    mut section: Section<'_, '_>,
    problem: &Problem,
) -> Result<Vec<(f64, f64)>, InputError> {
    let own = problem.data.covariates.iter();
    let all =
        own.map(|own| pair(&section.require(&own.name, &format!("{} = [from, to]", own.name))?));
    let all = all.collect::<Result<_, _>>()?;
    section.finish()?;
    Ok(all)
}

/// `base_unit = [from, to]` \[SI\].
fn range(
    section: &mut Section<'_, '_>,
    base: &str,
    unit: Unit,
) -> Result<Option<(f64, f64)>, InputError> {
    let Some((item, suffix)) = section.quantity(base, unit)? else { return Ok(None) };
    let (from, to) = pair(&item)?;
    Ok(Some(((suffix.to_si)(from), (suffix.to_si)(to))))
}

fn pair(item: &Item<'_, '_>) -> Result<(f64, f64), InputError> {
    if let Ok(value) = item.number() {
        return Err(item.error(InputErrorKind::OneNumber { value }));
    }
    let numbers = item.list("a list of 2 numbers, from and to")?;
    let numbers = numbers.iter().map(Item::number).collect::<Result<Vec<_>, _>>()?;
    match *numbers.as_slice() {
        [from, to] if from > to => Err(item
            .error(InputErrorKind::LimitsCross { lower: from.to_string(), upper: to.to_string() })),
        [from, to] => Ok((from, to)),
        _ => Err(item.error(InputErrorKind::NotARange { found: numbers.len() })),
    }
}

fn payloads(section: &mut Section<'_, '_>) -> Result<Vec<f64>, InputError> {
    let Some((item, _)) = section.quantity("payload", Unit::Mass)? else { return Ok(Vec::new()) };
    let choices = item.list("a list of masses to choose from")?;
    if choices.is_empty() {
        return Err(item.error(InputErrorKind::Empty));
    }
    let mass = |item: &Item<'_, '_>| match item.number()? {
        value if value < 0.0 => Err(item.error(InputErrorKind::Negative { value })),
        mass => Ok(mass),
    };
    choices.iter().map(mass).collect()
}

/// A number, or a range of them; time does not run backwards.
fn time_step(section: &mut Section<'_, '_>) -> Result<(f64, f64), InputError> {
    let Some((item, _)) = section.quantity("time_step", Unit::Time)? else {
        return Ok((TIME_STEP, TIME_STEP));
    };
    let (from, to) = item.number().map(|step| (step, step)).or_else(|_| pair(&item))?;
    if from < 0.0 {
        Err(item.error(InputErrorKind::Negative { value: from }))
    } else {
        Ok((from, to))
    }
}

/// The words of frames whose tilts are measured; the problem must read tilts.
fn tilts(section: &mut Section<'_, '_>, problem: &Problem) -> Result<Vec<usize>, InputError> {
    let Some(item) = section.get("tilts") else { return Ok(Vec::new()) };
    if problem.data.tilt_sigma.is_none() {
        return Err(problem.data.location.clone().with_key("tilt_sigma_deg".to_owned()).error(
            InputErrorKind::MissingKey {
                write: "tilt_sigma_deg = …, for tilts are measured".to_owned(),
                near: None,
            },
        ));
    }
    let named = |item: &Item<'_, '_>| {
        frame(item.text()?, &problem.joints, problem.tool.joint).map_err(|kind| item.error(kind))
    };
    item.list("a list of frames")?.iter().map(named).collect()
}

fn held_out(section: &mut Section<'_, '_>) -> Result<HeldOutRows, InputError> {
    let (share, kept) = (section.get("held_out"), section.get("identification"));
    match (share, kept) {
        (Some(_), Some(kept)) => {
            Err(kept.error(InputErrorKind::GivenTwice { first: "held_out".to_owned() }))
        }
        (Some(item), None) => match item.number()? {
            share if (0.0..1.0).contains(&share) => Ok(HeldOutRows::Share(share)),
            value => Err(item.error(InputErrorKind::NotAFraction { value })),
        },
        (None, Some(item)) => {
            Ok(HeldOutRows::AllBut(usize::try_from(item.whole(1)?).unwrap_or(usize::MAX)))
        }
        (None, None) => Ok(HeldOutRows::Share(HELD_OUT)),
    }
}
