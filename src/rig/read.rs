//! Reader of the truth file `TRUTH.toml`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::SEGMENTS;
use super::parameters::{self, TrueParameter};
use super::ranges::{self, Poses};
use super::strengths;
use super::truth::{Deviation, RandomRule, Truth};
use crate::error::{InputError, InputErrorKind};
use crate::observation::{Kind, Needs, kinds};
use crate::problem::item::{Document, Item, join};
use crate::problem::pattern::matches;
use crate::problem::section::Section;
use crate::problem::{HeldOut, Joint, JointKind, PoseRanges, Problem};
use crate::quantity::Unit;

impl Truth {
    /// Reads a `TRUTH.toml` for a problem; `path` is the file or its folder.
    ///
    /// # Errors
    /// Returns the first error in the file, or that it cannot be read.
    pub fn read(path: &Path, problem: &Problem) -> Result<Self, InputError> {
        truth(&document(path)?, problem)
    }

    /// Reads the ranges of poses of a `TRUTH.toml`; `path` is the file or its folder. A file that
    /// holds `[poses]` alone needs no true values.
    ///
    /// # Errors
    /// Returns the first error in the file, or that it cannot be read.
    #[doc(hidden)]
    pub fn read_ranges(path: &Path, problem: &Problem) -> Result<PoseRanges, InputError> {
        let document = document(path)?;
        let table = document.table()?;
        let mut root = Section::new(&document, String::new(), 0..0, table.get_ref());
        if root.entries().iter().any(|(name, _)| *name != "poses") {
            return Ok(truth(&document, problem)?.poses);
        }
        Ok(poses(&mut root, problem)?.ranges)
    }

    /// Parses a truth from its text; `file` names it in messages.
    ///
    /// # Errors
    /// Returns the first error in the text.
    pub fn parse(text: &str, file: &Path, problem: &Problem) -> Result<Self, InputError> {
        truth(&Document { file: file.to_owned(), text: Arc::from(text) }, problem)
    }

    /// Reads the sections of a truth, except `[noise]`, from another document such as a study. The
    /// noise is zero.
    pub(crate) fn of_sections(
        root: &mut Section<'_, '_>,
        problem: &Problem,
    ) -> Result<Self, InputError> {
        sections(root, problem)
    }
}

/// Reads the text of a truth; `path` is the file or its folder.
fn document(path: &Path) -> Result<Document, InputError> {
    let inside = path.is_dir().then(|| path.join("TRUTH.toml"));
    Document::read(inside.as_deref().unwrap_or(path), InputErrorKind::TruthMissing)
}

/// Reads the section `[poses]`; without it, poses are within the limits of the joints, which must
/// all be declared then.
fn poses(root: &mut Section<'_, '_>, problem: &Problem) -> Result<Poses, InputError> {
    match root.section("poses")? {
        Some(section) => ranges::read(section, problem),
        None => ranges::within_limits(problem)
            .ok_or_else(|| root.missing("poses", example(&problem.joints))),
    }
}

fn truth(document: &Document, problem: &Problem) -> Result<Truth, InputError> {
    let table = document.table()?;
    let mut root = Section::new(document, String::new(), 0..0, table.get_ref());
    if let Some(item) = root.peek("joint") {
        let found = "a problem, for it has joints";
        let kind = InputErrorKind::OtherFormat { found, expected: "a TRUTH.toml" };
        return Err(item.error(kind));
    }
    let noise = root.section("noise")?.map_or(Ok(Noise::default()), noise)?;
    let truth = sections(&mut root, problem)?;
    root.finish()?;
    let Noise { given, turn, missing } = noise;
    let count = truth.positions + problem.fixtures.len() + truth.tilts.len();
    let observations = truth.observations(&problem.fixtures, count.max(1));
    let is_needed = observations
        .iter()
        .map(|observation| observation.description())
        .any(|kind| kind.unit == Unit::Length && !given.contains_key(kind.name));
    if let Some(error) = missing.filter(|_| is_needed) {
        return Err(error);
    }
    let noise_sigma = given.get(POSITION).copied().unwrap_or(0.0);
    // Kinds of rows that measure lengths use the σ of positions unless the section states another
    // one.
    let sigma = |kind: &'static Kind| {
        let sigma = given.get(kind.name).filter(|_| kind.name != POSITION).copied();
        let declared = problem.data.kind_sigmas.get(kind.name).copied().unwrap_or(0.0);
        // Each camera declares the σ of its pixels.
        let has_default = kind.unit != Unit::Length && kind.needs != Needs::Carriers;
        let sigma = sigma.or_else(|| has_default.then_some(declared));
        Some((kind.name, sigma?))
    };
    let kind_sigmas = kinds().filter_map(sigma).collect();
    if let Some(HeldOut::Session(session)) = &problem.data.held_out {
        let location = problem.data.held_out_location.clone();
        return Err(location.error(InputErrorKind::NoSessions { session: session.clone() }));
    }
    let orientation_sigma = problem.data.orientation_sigma.map(|declared| turn.unwrap_or(declared));
    Ok(Truth { noise_sigma, kind_sigmas, orientation_sigma, ..truth })
}

/// Reads the sections of a truth except `[noise]`.
fn sections(root: &mut Section<'_, '_>, problem: &Problem) -> Result<Truth, InputError> {
    let nominal = parameters::nominal(problem);
    let parameters = match root.section("parameters")? {
        Some(section) => {
            section.entries().iter().map(|(name, item)| deviation(name, item, &nominal)).collect()
        }
        None => Ok(Vec::new()),
    }?;
    let random = match root.section("random")? {
        Some(section) => section
            .entries()
            .iter()
            .map(|(pattern, item)| random(pattern, item, &nominal))
            .collect(),
        None => Ok(Vec::new()),
    }?;
    check_fixtures(root, problem, &parameters, &random)?;
    let segments = root.section("rig")?.map_or(Ok(SEGMENTS), segments)?;
    let Poses { ranges: poses, time_step, held_out, positions, tilts } = poses(root, problem)?;
    let effects = strengths::read(root, problem, &poses)?;
    Ok(Truth {
        parameters,
        random,
        effects,
        noise_sigma: 0.0,
        kind_sigmas: BTreeMap::new(),
        positions,
        tilts,
        orientation_sigma: None,
        poses,
        time_step,
        held_out,
        segments,
    })
}

/// Checks that every number of a fixture that the problem leaves open has a true value, given or
/// drawn.
fn check_fixtures(
    root: &Section<'_, '_>,
    problem: &Problem,
    parameters: &[Deviation],
    random: &[RandomRule],
) -> Result<(), InputError> {
    for fixture in &problem.fixtures {
        let fields = fixture.kind.fields().iter().zip(&fixture.known);
        for (field, _) in fields.filter(|(_, known)| known.is_none()) {
            let name = format!("{}[{}].{field}", fixture.kind.word(), fixture.name);
            let is_given = parameters.iter().any(|parameter| parameter.name == name);
            if !is_given && !random.iter().any(|rule| matches(&rule.pattern, &name)) {
                let write = format!("its true value: \"{name}\" in [parameters]");
                let location = root.location().with_key(join("parameters", &name));
                return Err(location.error(InputErrorKind::MissingKey { write, near: None }));
            }
        }
    }
    Ok(())
}

/// Returns an example of the section `[poses]` for these joints.
fn example(joints: &[Joint]) -> String {
    let range = |(number, joint): (usize, &Joint)| match joint.command_kind() {
        JointKind::Revolute => Some(format!("q{number}_deg = [-90, 90]")),
        JointKind::Prismatic => Some(format!("q{number}_mm = [0, 500]")),
        JointKind::Fixed => None,
    };
    let ranges: Vec<String> = (1..).zip(joints).filter_map(range).collect();
    format!("[poses] with the range of each joint: {}", ranges.join(", "))
}

/// Name of the kind of rows that measure positions.
const POSITION: &str = "position";

/// Contents of the section `[noise]`.
#[derive(Default)]
struct Noise {
    /// Standard deviations that the section states, by kind of rows \[m\] or \[rad\].
    given: BTreeMap<&'static str, f64>,
    /// Standard deviation of a measured orientation about each axis \[rad\], if given.
    turn: Option<f64>,
    /// Error to report if rows need the σ of positions; `None` if the section states it. Positions
    /// need it, and so do other lengths whose σ is not stated.
    missing: Option<InputError>,
}

/// Reads the section `[noise]`. The default σ of contacts is that of positions.
fn noise(mut section: Section<'_, '_>) -> Result<Noise, InputError> {
    let mut given = BTreeMap::new();
    for kind in kinds().filter(|kind| kind.needs != Needs::Fixtures) {
        let sigma = section.non_negative_number(&format!("{}_sigma", kind.name), kind.unit)?;
        given.extend(sigma.map(|sigma| (kind.name, sigma)));
    }
    let turn = section.non_negative_number("orientation_sigma", Unit::Angle)?;
    section.finish()?;
    let missing =
        || section.missing("position_sigma_mm", Unit::Length.alternatives("position_sigma"));
    let missing = (!given.contains_key(POSITION)).then(missing);
    Ok(Noise { given, turn, missing })
}

fn segments(mut section: Section<'_, '_>) -> Result<usize, InputError> {
    let segments =
        section.get("segments").map_or(Ok(SEGMENTS), |item| item.small().map(usize::from))?;
    section.finish()?;
    Ok(segments)
}

/// Reads the deviation of a true value, for example `"joint2.stiffness" = { relative = 0.83 }`.
fn deviation(
    name: &str,
    item: &Item<'_, '_>,
    parameters: &[TrueParameter],
) -> Result<Deviation, InputError> {
    let mut section = named(name, item)?;
    let Some(parameter) = parameters.iter().find(|parameter| parameter.name == name) else {
        let known = parameters.iter().map(|parameter| parameter.name.clone()).collect();
        return Err(item.error(InputErrorKind::UnknownParameter { name: name.to_owned(), known }));
    };
    let units = parameter.unit.deviation_unit().suffixes();
    let given: Vec<_> =
        units.iter().filter_map(|unit| section.get(unit.name).map(|item| (item, unit))).collect();
    section.finish()?;
    let value = match given.as_slice() {
        [] => {
            let keys: Vec<_> = units.iter().map(|unit| format!("{} = …", unit.name)).collect();
            return Err(
                section.missing(units.first().map_or("", |unit| unit.name), keys.join(" or "))
            );
        }
        [(item, unit)] => (unit.to_si)(item.number()?),
        [(_, first), (item, _), ..] => {
            return Err(item.error(InputErrorKind::GivenTwice { first: first.name.to_owned() }));
        }
    };
    if parameter.unit.is_relative() && value <= 0.0 {
        return Err(item.error(InputErrorKind::NotPositive { value }));
    }
    let is_nominal = (value - parameter.nominal).abs() <= ROUNDING * parameter.nominal.abs();
    let largest = match parameter.unit {
        Unit::Length => MAX_PLAIN_DEVIATION,
        Unit::Angle => MAX_PLAIN_TURN,
        _ => 0.0,
    };
    if !parameter.unit.is_relative() && is_nominal && value.abs() > largest {
        return Err(item.error(InputErrorKind::AbsoluteDeviation));
    }
    Ok(Deviation { name: name.to_owned(), value })
}

/// Largest relative difference of two equal numbers.
const ROUNDING: f64 = 1e-9;
/// Largest deviation of a length that may equal its nominal value by chance \[m\].
const MAX_PLAIN_DEVIATION: f64 = 0.01;
/// Largest deviation of an angle that may equal its nominal value by chance \[rad\].
const MAX_PLAIN_TURN: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// Reads a rule for random values, for example `"joint*.alpha" = { sigma_deg = 0.3 }`.
fn random(
    pattern: &str,
    item: &Item<'_, '_>,
    parameters: &[TrueParameter],
) -> Result<RandomRule, InputError> {
    let mut section = named(pattern, item)?;
    let mut sigma = |unit: Unit| match section.pick("sigma", unit)? {
        Some((item, suffix)) => match item.number()? {
            value if value < 0.0 => Err(item.error(InputErrorKind::Negative { value })),
            value => Ok(Some((suffix.to_si)(value))),
        },
        None => Ok(None),
    };
    let (angle, length, relative) =
        (sigma(Unit::Angle)?, sigma(Unit::Length)?, sigma(Unit::Ratio)?);
    section.finish()?;
    let matched: Vec<_> =
        parameters.iter().filter(|parameter| matches(pattern, &parameter.name)).collect();
    let Some(first) = matched.first() else {
        let known = parameters.iter().map(|parameter| parameter.name.clone()).collect();
        return Err(
            item.error(InputErrorKind::MatchesNothing { pattern: pattern.to_owned(), known })
        );
    };
    let rule = RandomRule { pattern: pattern.to_owned(), angle, length, relative };
    if matched.iter().all(|parameter| rule.sigma(parameter.unit).is_none()) {
        let write = first.unit.deviation_unit().alternatives("sigma");
        return Err(section.missing("sigma", write));
    }
    Ok(rule)
}

/// Returns the table that is the value of a parameter name or pattern. A name without quotes is an
/// error: TOML reads `tool.x = { … }` as a table `tool` that holds a table `x`.
fn named<'a, 'i>(name: &str, item: &Item<'a, 'i>) -> Result<Section<'a, 'i>, InputError> {
    let section = item.section()?;
    match section.entries().into_iter().find(|(_, inner)| inner.holds_tables()) {
        Some((inner, _)) => {
            Err(item.error(InputErrorKind::UnquotedName { name: format!("{name}.{inner}") }))
        }
        None => Ok(section),
    }
}
