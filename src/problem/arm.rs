//! Reader of `[[joint]]` with its beams, hoists and bodies.

use nalgebra::Vector3;

use super::item::Item;
use super::section::Section;
use super::{
    Beam, Body, Hoist, Joint, JointKind, Mimic, Placement, effect, plausible, standard, tree,
};
use crate::error::{InputError, InputErrorKind, Warning};
use crate::quantity::Unit;

/// Reads all `[[joint]]` tables, at least one. The returned flag is true if they use the standard
/// DH form. Implausible values are added to `warnings`.
pub(super) fn read_joints(
    root: &mut Section<'_, '_>,
    warnings: &mut Vec<Warning>,
) -> Result<(Vec<Joint>, bool), InputError> {
    if let Some(item) = root.peek("joints").filter(Item::holds_tables) {
        let known = vec!["joint".to_owned()];
        let (key, meant) = ("joints".to_owned(), None);
        return Err(item.error(InputErrorKind::UnknownKey { key, meant, known }));
    }
    let form_is_declared = root.peek("dh").is_some();
    let form = root
        .word("dh", &["modified", "standard"], &[DhForm::Modified, DhForm::Standard])?
        .unwrap_or(DhForm::Modified);
    let (mut joints, mut beams, mut mimics, mut parents) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for mut section in root.sections("joint")? {
        let mimic = section.section("mimic")?;
        let number = joints.len() + 1;
        if let Some(leader) = mimic.as_ref().and_then(|mimic| mimic.peek("joint"))
            && leader.whole(0)? == number as u64
        {
            return Err(leader.error(InputErrorKind::MimicsItself { joint: number }));
        }
        let parent = section.get("parent");
        if let Some(item) = parent.as_ref().filter(|_| form == DhForm::Standard) {
            return Err(item.error(InputErrorKind::NotInStandardForm));
        }
        parents.push(parent);
        warnings.extend(plausible::joint_warnings(&section));
        joints.push(read_joint(section, number, (form, mimic.is_some()), &mut beams)?);
        mimics.push(mimic);
    }
    if joints.is_empty() {
        return Err(root.location().with_key("joint").error(InputErrorKind::NoJoints));
    }
    let can_lead: Vec<bool> = joints
        .iter()
        .zip(&mimics)
        .map(|(joint, mimic)| joint.kind != JointKind::Fixed && mimic.is_none())
        .collect();
    for ((joint, section), parent) in
        joints.iter_mut().zip(mimics).zip(tree::read_parents(&parents)?)
    {
        joint.mimic = section.map(|section| read_mimic(section, &can_lead)).transpose()?;
        joint.parent = parent;
    }
    if !form_is_declared && root.peek("urdf").is_none() {
        warnings.extend(plausible::form_warning(&joints));
    }
    let is_standard = form == DhForm::Standard;
    Ok((if is_standard { standard::to_modified_form(joints) } else { joints }, is_standard))
}

/// Order of the elementary transforms in a row of the joint table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DhForm {
    /// Modified DH: α and a act before θ and d.
    Modified,
    /// Standard DH: θ and d act before a and α.
    Standard,
}

/// Reads `mimic = { joint = 2, ratio = -1.0 }`. `can_lead[j]` is true if joint j takes a command,
/// so that others may follow it.
fn read_mimic(mut section: Section<'_, '_>, can_lead: &[bool]) -> Result<Mimic, InputError> {
    let item = section.require("joint", "joint = …, the number of the joint that it follows")?;
    let number = item.whole(0)?;
    let joint = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
    let mimic = match joint.and_then(|joint| Some((joint, *can_lead.get(joint)?))) {
        Some((joint, true)) => {
            Mimic { joint, ratio: section.get("ratio").map_or(Ok(1.0), |item| item.number())? }
        }
        Some((_, false)) => {
            return Err(item.error(InputErrorKind::LeaderNotCommanded { joint: number }));
        }
        None => {
            return Err(
                item.error(InputErrorKind::UnknownJoint { joint: number, joints: can_lead.len() })
            );
        }
    };
    section.finish()?;
    Ok(mimic)
}

fn read_joint(
    mut section: Section<'_, '_>,
    number: usize,
    (form, follows): (DhForm, bool),
    beams: &mut Vec<String>,
) -> Result<Joint, InputError> {
    let name = section.text("name")?.map_or_else(|| format!("joint {number}"), str::to_owned);
    let kinds = [JointKind::Revolute, JointKind::Prismatic, JointKind::Fixed];
    let kind = section
        .word("kind", &["revolute", "prismatic", "fixed"], &kinds)?
        .unwrap_or(JointKind::Revolute);
    if follows && kind == JointKind::Fixed {
        return Err(section.error(InputErrorKind::FixedJointMimics));
    }
    let placement = if kind == JointKind::Fixed { read_placement(&mut section)? } else { None };
    let (mut alpha, mut a, mut theta, mut d, mut beta) = (0.0, 0.0, 0.0, 0.0, 0.0);
    if placement.is_none() {
        alpha = section.number("alpha", Unit::Angle)?.unwrap_or(0.0);
        a = section.number("a", Unit::Length)?.unwrap_or(0.0);
        theta = section.number("theta", Unit::Angle)?.unwrap_or(0.0);
        d = section.number("d", Unit::Length)?.unwrap_or(0.0);
    }
    if placement.is_none() && form == DhForm::Modified {
        beta = section.number("beta", Unit::Angle)?.unwrap_or(0.0);
    }
    let placed = ["xyz_m", "xyz_mm", "rpy_deg", "rpy_rad"];
    if let Some(item) =
        placed.iter().find_map(|key| section.peek(key)).filter(|_| kind != JointKind::Fixed)
    {
        let place = "xyz_m and rpy_deg place a joint with kind = \"fixed\": write such a joint \
                     before this one, which takes alpha_deg, a_m, theta_deg and d_m, or let \
                     flexcal init ARM.urdf convert a URDF";
        return Err(item.error(InputErrorKind::MisplacedKey { place: place.to_owned() }));
    }
    check_compatible_keys(&section, number, (follows, placement.is_some()))?;
    let limits = read_limits(&mut section, if follows { JointKind::Fixed } else { kind })?;
    let stiffness = read_stiffness(&mut section, "stiffness", Unit::TorsionalStiffness)?;
    let beam = match section.section("beam")? {
        Some(beam) if form == DhForm::Standard => {
            return Err(beam.error(InputErrorKind::BeamInStandardForm));
        }
        Some(beam) if a == 0.0 => return Err(beam.error(InputErrorKind::BeamWithoutLength)),
        Some(section) => Some(read_beam(section, beams)?),
        None => None,
    };
    let bodies = read_bodies(&mut section, "body", "com", false)?;
    section.finish()?;
    let location = section.location();
    let (parent, mimic) = (None, None);
    Ok(Joint {
        name,
        kind,
        parent,
        placement,
        mimic,
        alpha,
        a,
        theta,
        d,
        beta,
        limits,
        stiffness,
        beam,
        bodies,
        location,
    })
}

/// Keys of a row of the joint table, without the suffixes of their units.
const ROW_KEYS: [&str; 5] = ["alpha", "a", "theta", "d", "beta"];
/// Keys of the limits of a joint, without the suffixes of their units.
const LIMIT_KEYS: [&str; 2] = ["min", "max"];

/// Checks that a joint has no key that another of its keys makes meaningless: limits if it follows
/// another joint, and a row of the joint table if it is placed by `xyz_m` and `rpy_deg`.
fn check_compatible_keys(
    section: &Section<'_, '_>,
    number: usize,
    (follows, is_placed): (bool, bool),
) -> Result<(), InputError> {
    let is_one_of = |key: &str, bases: &[&str]| {
        let suffixes = || Unit::Angle.suffixes().iter().chain(Unit::Length.suffixes());
        bases.iter().any(|base| suffixes().any(|suffix| key == format!("{base}_{}", suffix.name)))
    };
    for (key, item) in section.entries() {
        let place = if follows && is_one_of(key, &LIMIT_KEYS) {
            format!("joint {number} follows another joint, so it has no limits; leave {key} out")
        } else if is_placed && is_one_of(key, &ROW_KEYS) {
            format!(
                "joint {number} is placed by xyz_m and rpy_deg; write either these or the row \
                 alpha, a, theta, d"
            )
        } else {
            continue;
        };
        return Err(item.error(InputErrorKind::MisplacedKey { place }));
    }
    Ok(())
}

/// Reads `xyz_m` and `rpy_deg` in URDF convention; returns `None` if both are absent.
pub(super) fn read_placement(
    section: &mut Section<'_, '_>,
) -> Result<Option<Placement>, InputError> {
    let (xyz, rpy) = (section.vector("xyz", Unit::Length)?, section.vector("rpy", Unit::Angle)?);
    let given = xyz.is_some() || rpy.is_some();
    Ok(given.then(|| Placement { xyz: xyz.unwrap_or_default(), rpy: rpy.unwrap_or_default() }))
}

/// Reads the range of q; a side without a limit is infinite.
fn read_limits(section: &mut Section<'_, '_>, kind: JointKind) -> Result<(f64, f64), InputError> {
    let unit = match kind {
        JointKind::Revolute => Unit::Angle,
        JointKind::Prismatic => Unit::Length,
        JointKind::Fixed => return Ok((f64::NEG_INFINITY, f64::INFINITY)),
    };
    let mut limit = |base| -> Result<_, InputError> {
        let found = section.quantity(base, unit).map_err(|error| with_kind_hint(error, kind))?;
        let Some((item, suffix)) = found else { return Ok(None) };
        Ok(Some(((suffix.to_si)(item.number()?), item)))
    };
    match (limit("min")?, limit("max")?) {
        (Some((min, lower)), Some((max, upper))) if min > max => {
            Err(lower.crossed_limits_error(&upper))
        }
        (min, max) => Ok((
            min.map_or(f64::NEG_INFINITY, |(min, _)| min),
            max.map_or(f64::INFINITY, |(max, _)| max),
        )),
    }
}

/// Adds a hint to the error of a limit whose unit fits another kind of joint: the kind may be
/// wrong.
fn with_kind_hint(error: InputError, kind: JointKind) -> InputError {
    match *error.kind {
        InputErrorKind::WrongUnit { noun, suffix, write } => {
            let is_of = |unit: Unit| unit.suffix(&suffix).is_some();
            let write = match kind {
                JointKind::Revolute if is_of(Unit::Length) => {
                    format!("{write}, or kind = \"prismatic\" if the joint slides")
                }
                JointKind::Prismatic if is_of(Unit::Angle) => {
                    format!("{write}, or kind = \"revolute\" if the joint turns")
                }
                _ => write,
            };
            error.location.error(InputErrorKind::WrongUnit { noun, suffix, write })
        }
        kind => error.location.error(kind),
    }
}

fn read_beam(mut section: Section<'_, '_>, beams: &mut Vec<String>) -> Result<Beam, InputError> {
    let item = section.require("name", "name = \"…\"")?;
    let name = read_beam_name(&item, beams)?;
    beams.push(name.clone());
    let mass = section.non_negative_number("mass", Unit::Mass)?.unwrap_or(0.0);
    let ea = read_stiffness(&mut section, "EA", Unit::AxialRigidity)?;
    let ei_y = read_stiffness(&mut section, "EIy", Unit::FlexuralRigidity)?;
    let ei_z = read_stiffness(&mut section, "EIz", Unit::FlexuralRigidity)?;
    let gj = read_stiffness(&mut section, "GJ", Unit::FlexuralRigidity)?;
    let masses = read_bodies(&mut section, "mass", "at", true)?;
    let hoist = section.section("hoist")?.map(read_hoist).transpose()?;
    section.finish()?;
    Ok(Beam { name, mass, ea, ei_y, ei_z, gj, masses, hoist })
}

/// Reads the name of a beam, which is the prefix of its parameters.
fn read_beam_name(item: &Item<'_, '_>, beams: &[String]) -> Result<String, InputError> {
    let name = item.text()?.to_owned();
    let reserved = name
        .strip_prefix("joint")
        .is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_digit()))
        || ["tool", "base"].contains(&name.as_str())
        || effect::NAMES.contains(&name.as_str());
    if name.contains(|c: char| ".*[]\"".contains(c) || c.is_whitespace() || c.is_control()) {
        Err(item.error(InputErrorKind::NotABeamName { name }))
    } else if reserved {
        Err(item.error(InputErrorKind::ReservedName { name }))
    } else if beams.contains(&name) {
        Err(item.error(InputErrorKind::RepeatedBeamName { name }))
    } else {
        Ok(name)
    }
}

fn read_hoist(mut section: Section<'_, '_>) -> Result<Hoist, InputError> {
    let at = section.require_vector("at", Unit::Length)?;
    let force = section.number("force", Unit::Force)?.unwrap_or(0.0);
    let direction = match section.get("direction") {
        Some(item) => {
            let given = item.vector()?;
            // Scaling first keeps the direction of very large and very small vectors.
            let largest = given.amax();
            let scaled = if largest > 0.0 { given.map(|value| value / largest) } else { given };
            scaled.try_normalize(0.0).ok_or_else(|| item.error(InputErrorKind::NoDirection))?
        }
        None => Vector3::z(),
    };
    section.finish()?;
    Ok(Hoist { at, force, direction })
}

/// Reads the point masses under `key`; `base` is the key of a mass's position without its unit
/// suffix.
fn read_bodies(
    section: &mut Section<'_, '_>,
    key: &str,
    base: &str,
    position_needed: bool,
) -> Result<Vec<Body>, InputError> {
    let mut bodies = Vec::new();
    for mut section in section.sections(key)? {
        let number = bodies.len() + 1;
        let name = section.text("name")?.map_or_else(|| format!("{key} {number}"), str::to_owned);
        let mass = section
            .non_negative_number("mass", Unit::Mass)?
            .ok_or_else(|| section.missing("mass_kg", "mass_kg"))?;
        let position = if position_needed {
            section.require_vector(base, Unit::Length)?
        } else {
            section.vector(base, Unit::Length)?.unwrap_or_default()
        };
        section.finish()?;
        bodies.push(Body { name, mass, position });
    }
    Ok(bodies)
}

/// Reads an optional stiffness or rigidity, which must be above zero \[SI\].
fn read_stiffness(
    section: &mut Section<'_, '_>,
    base: &str,
    unit: Unit,
) -> Result<Option<f64>, InputError> {
    section.positive(base, unit, |value| InputErrorKind::StiffnessNotPositive { value })
}
