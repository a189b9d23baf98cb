//! Reader of the section `[poses]` of a truth.

use super::truth::HeldOutRows;
use crate::error::{InputError, InputErrorKind};
use crate::problem::frame::frame;
use crate::problem::item::Item;
use crate::problem::section::Section;
use crate::problem::{Joint, JointKind, PoseRanges, Problem};
use crate::quantity::Unit;

/// Share of held-out rows if the file gives none.
const DEFAULT_HELD_OUT: f64 = 0.3;
/// Time between poses if the file gives none \[s\].
const DEFAULT_TIME_STEP: f64 = 60.0;

/// Keys of other quantities in the section. A joint with one of these names is given by its number.
const RESERVED: [&str; 4] = ["payload", "hoist", "temperature", "time_step"];

/// Contents of the section `[poses]`: ranges of the poses and choice of the rows.
pub(super) struct Poses {
    pub ranges: PoseRanges,
    /// Range of the time between poses \[s\].
    pub time_step: (f64, f64),
    /// Rule for the number of held-out rows.
    pub held_out: HeldOutRows,
    /// Number of rows at the start of the table that measure positions; the rows after them
    /// measure the fixtures and the tilts in turn.
    pub positions: usize,
    /// Frames whose tilts are measured: 0 is the base of the arm, i the frame of joint i.
    pub tilts: Vec<usize>,
}

/// Reads the section `[poses]`.
pub(super) fn read(mut section: Section<'_, '_>, problem: &Problem) -> Result<Poses, InputError> {
    let joints = problem.joints.iter().enumerate();
    let joints = joints.map(|(index, joint)| joint_range(&mut section, index + 1, joint, problem));
    let joints = joints.collect::<Result<_, _>>()?;
    let payloads = payloads(&mut section)?;
    let hoist = range(&mut section, "hoist", Unit::Force)?;
    let temperature = range(&mut section, "temperature", Unit::Temperature)?;
    let time_step = time_step(&mut section)?;
    let covariates = section
        .section("covariates")?
        .map_or(Ok(Vec::new()), |inner| covariates(inner, problem))?;
    let approach = section.get("approach").map_or(Ok(true), |item| item.boolean())?;
    let held_out = held_out(&mut section)?;
    let positions = section.get("positions").map_or(Ok(0), |item| item.small().map(usize::from))?;
    let tilts = tilts(&mut section, problem)?;
    section.finish()?;
    let ranges = PoseRanges { joints, payloads, hoist, temperature, approach, covariates };
    Ok(Poses { ranges, time_step, held_out, positions, tilts })
}

/// Returns the poses of a truth without the section: within the limits of the joints, with the
/// defaults of everything else. Returns `None` if a joint that moves lacks a limit.
pub(super) fn within_limits(problem: &Problem) -> Option<Poses> {
    let range = |joint: &Joint| match joint.command_kind() {
        JointKind::Fixed => Some((0.0, 0.0)),
        _ => limits(joint),
    };
    let ranges = PoseRanges {
        joints: problem.joints.iter().map(range).collect::<Option<_>>()?,
        payloads: Vec::new(),
        hoist: None,
        temperature: None,
        approach: true,
        covariates: Vec::new(),
    };
    let (time_step, held_out) =
        ((DEFAULT_TIME_STEP, DEFAULT_TIME_STEP), HeldOutRows::Share(DEFAULT_HELD_OUT));
    Some(Poses { ranges, time_step, held_out, positions: 0, tilts: Vec::new() })
}

/// Returns the limits of a joint \[rad\] or \[m\]; `None` if one of them is missing.
fn limits(joint: &Joint) -> Option<(f64, f64)> {
    Some(joint.limits).filter(|(low, high)| low.is_finite() && high.is_finite())
}

/// Reads `q1_deg = [from, to]`, or a key with the joint's name in place of `q1` if no other joint
/// has the name. Returns the range in \[rad\] or \[m\]: without a key the limits of the joint, and
/// 0, 0 for a joint that takes no command.
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
        name.strip_prefix('q').is_some_and(|digits| digits.bytes().all(|b| b.is_ascii_digit()))
    };
    let is_shared =
        |name: &str| problem.joints.iter().filter(|other| other.name == name).count() > 1;
    let joint_name = Some(joint.name.as_str())
        .filter(|name| !is_number(name) && !RESERVED.contains(name) && !is_shared(name));
    let by_name = joint_name.map(|name| section.quantity(name, unit)).transpose()?.flatten();
    let (item, suffix) = match (section.quantity(&base, unit)?, by_name) {
        (Some((_, first)), Some((item, _))) => {
            return Err(
                item.error(InputErrorKind::GivenTwice { first: format!("{base}_{}", first.name) })
            );
        }
        (Some(given), None) | (None, Some(given)) => given,
        (None, None) => {
            let missing =
                || section.missing(&base, format!("{} = [from, to]", unit.alternatives(&base)));
            return limits(joint).ok_or_else(missing);
        }
    };
    let (from, to) = pair(&item)?;
    Ok(((suffix.to_si)(from), (suffix.to_si)(to)))
}

/// Reads `name = [from, to]` for each covariate of the problem, in its unit.
fn covariates(
    mut section: Section<'_, '_>,
    problem: &Problem,
) -> Result<Vec<(f64, f64)>, InputError> {
    let range = |name: &str| pair(&section.require(name, &format!("{name} = [from, to]"))?);
    let mut range = range;
    let ranges = problem.data.covariates.iter().map(|covariate| range(&covariate.name));
    let ranges = ranges.collect::<Result<_, _>>()?;
    section.finish()?;
    Ok(ranges)
}

/// Reads the range `base_unit = [from, to]`, for example `hoist_N`; `None` if it is not given. SI.
fn range(
    section: &mut Section<'_, '_>,
    base: &str,
    unit: Unit,
) -> Result<Option<(f64, f64)>, InputError> {
    let Some((item, suffix)) = section.quantity(base, unit)? else { return Ok(None) };
    let (from, to) = pair(&item)?;
    Ok(Some(((suffix.to_si)(from), (suffix.to_si)(to))))
}

/// Reads a list of two numbers, of which the first must not exceed the second.
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

/// Reads the list of payloads \[kg\]; empty if there is none.
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

/// Reads the time between poses \[s\], a number or a range; it must not be negative.
fn time_step(section: &mut Section<'_, '_>) -> Result<(f64, f64), InputError> {
    let Some((item, _)) = section.quantity("time_step", Unit::Time)? else {
        return Ok((DEFAULT_TIME_STEP, DEFAULT_TIME_STEP));
    };
    let (from, to) = item.number().map(|step| (step, step)).or_else(|_| pair(&item))?;
    if from < 0.0 {
        Err(item.error(InputErrorKind::Negative { value: from }))
    } else {
        Ok((from, to))
    }
}

/// Reads the frames whose tilts are measured; the problem must declare tilts.
fn tilts(section: &mut Section<'_, '_>, problem: &Problem) -> Result<Vec<usize>, InputError> {
    let Some(item) = section.get("tilts") else { return Ok(Vec::new()) };
    if !problem.data.kind_sigmas.contains_key("tilt") {
        return Err(problem.data.location.clone().with_key("tilt_sigma_deg".to_owned()).error(
            InputErrorKind::MissingKey {
                write: "tilt_sigma_deg = …, because tilts are measured".to_owned(),
                near: None,
            },
        ));
    }
    let named = |item: &Item<'_, '_>| {
        frame(item.text()?, &problem.joints, problem.tool.joint).map_err(|kind| item.error(kind))
    };
    item.list("a list of frames")?.iter().map(named).collect()
}

/// Reads the share of held-out rows, or the number of identification rows; only one may be given.
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
        (None, None) => Ok(HeldOutRows::Share(DEFAULT_HELD_OUT)),
    }
}
