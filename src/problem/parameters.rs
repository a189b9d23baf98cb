//! Reader of the rules in `[parameters]`.

use super::Problem;
use super::item::Item;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// Rule of `[parameters]`: a pattern of names, and freedom, prior and bounds of the matching
/// parameters.
#[derive(Debug, Clone)]
pub struct ParameterRule {
    /// Pattern of parameter names, in which `*` matches any run of characters.
    pub pattern: String,
    /// Freedom of the matching parameters.
    pub freedom: Freedom,
    /// Place in the file, for errors.
    pub location: Location,
}

impl ParameterRule {
    /// Returns the rule that frees the parameters whose names match `pattern`, without prior and
    /// bounds; errors name the place of the data.
    pub(crate) fn free(pattern: String, problem: &Problem) -> Self {
        let none = Quantities::default();
        let freedom = Freedom::Free { sigma: none, min: none, max: none };
        Self { pattern, freedom, location: problem.data.location.clone() }
    }
}

/// Freedom of a parameter: fixed, or free with optional prior and bounds.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Freedom {
    /// The parameter is held at its nominal value.
    Fixed,
    /// The parameter is free, with optional prior and bounds.
    Free {
        /// Standard deviation (1 σ) of a Gaussian prior about the nominal value.
        sigma: Quantities,
        /// Lower bound of the deviation from nominal; for relative quantities a multiple of
        /// nominal.
        min: Quantities,
        /// Upper bound of the deviation from nominal; for relative quantities a multiple of
        /// nominal.
        max: Quantities,
    },
}

/// Rule of `[drift]`: a pattern of names, and the random change of the matching parameters.
#[derive(Debug, Clone)]
pub struct DriftRule {
    /// Pattern of parameter names, in which `*` matches any run of characters.
    pub pattern: String,
    /// Standard deviation (1 σ) of the change after one day; it grows with the root of the time.
    pub sigma: Quantities,
    /// Place in the file, for errors.
    pub location: Location,
}

/// Prior width or bound for each kind of parameter that a pattern may match.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Quantities {
    /// Value for angles \[rad\].
    pub angle: Option<f64>,
    /// Value for lengths \[m\].
    pub length: Option<f64>,
    /// Value for coordinates in an image \[px\].
    pub pixel: Option<f64>,
    /// Value relative to nominal; as a standard deviation, that of ln(value / nominal).
    pub relative: Option<f64>,
}

impl Quantities {
    /// Returns the value for parameters with this unit; `None` if the rule has none for it.
    pub(crate) fn of_kind(&self, unit: Unit) -> Option<f64> {
        match unit {
            Unit::Angle => self.angle,
            Unit::Length => self.length,
            Unit::Pixel => self.pixel,
            unit if unit.is_relative() => self.relative,
            _ => None,
        }
    }
}

/// Maximum number of rules in `[parameters]`.
const MAX_RULES: usize = 2000;

/// Maximum length of a pattern \[bytes\], which bounds the work of matching all parameters.
const MAX_PATTERN_BYTES: usize = 500;

/// Units of the values that a rule may give, in the order of [`Quantities`].
const RULE_UNITS: [Unit; 4] = [Unit::Angle, Unit::Length, Unit::Pixel, Unit::Ratio];
/// Nominal value for each unit in [`RULE_UNITS`], on the scale of bounds: deviation 0, or ratio 1 to the
/// nominal value.
const NOMINAL_VALUES: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Reads all rules in the order of the file.
pub(super) fn read(root: &mut Section<'_, '_>) -> Result<Vec<ParameterRule>, InputError> {
    let Some(section) = root.section("parameters")? else { return Ok(Vec::new()) };
    if let Some(item) = root.peek("parameters") {
        item.check_count("rules", section.len(), MAX_RULES)?;
    }
    section.entries().into_iter().map(|(pattern, item)| read_rule(pattern, &item)).collect()
}

/// Reads the rules of `[drift]` in the order of the file.
pub(super) fn read_drift(root: &mut Section<'_, '_>) -> Result<Vec<DriftRule>, InputError> {
    let Some(section) = root.section("drift")? else { return Ok(Vec::new()) };
    let rule = |(pattern, item): (&str, Item<'_, '_>)| {
        let mut section = item.section()?;
        let sigma = ValuesByUnit::read(&mut section, "sigma")?;
        section.finish()?;
        if section.len() == 0 {
            return Err(item.error(InputErrorKind::EmptyRule));
        }
        if let Some((value, place)) = sigma.0.iter().flatten().find(|(value, _)| *value < 0.0) {
            return Err(place.error(InputErrorKind::NotPositive { value: *value }));
        }
        let (pattern, sigma) = (pattern.to_owned(), sigma.quantities());
        Ok(DriftRule { pattern, sigma, location: item.location() })
    };
    section.entries().into_iter().map(rule).collect()
}

fn read_rule(pattern: &str, item: &Item<'_, '_>) -> Result<ParameterRule, InputError> {
    if pattern.trim().is_empty() {
        return Err(item.error(InputErrorKind::Empty));
    }
    item.check_count("characters in a pattern", pattern.len(), MAX_PATTERN_BYTES)?;
    // Names of parameters have a point, so that another key belongs to another section.
    if !item.holds_tables() && !pattern.contains(['.', '*', '?']) {
        let place = "[parameters] holds names of parameters such as \"joint2.theta\"; a key of [data] \
                     stands below the line [data]";
        return Err(item.error(InputErrorKind::MisplacedKey { place: place.to_owned() }));
    }
    if !item.holds_tables() {
        let expected = "a table such as { free = true }, { fixed = true } or { sigma_mm = 1.0 }";
        return Err(item.wrong_type(expected));
    }
    let mut section = item.section()?;
    // TOML reads `tool.x = { … }` without quotes as a table `tool` with a table `x`.
    if let Some((inner, _)) = section.entries().into_iter().find(|(_, inner)| inner.holds_tables())
    {
        let name = format!("{pattern}.{inner}");
        return Err(item.error(InputErrorKind::UnquotedName { name }));
    }
    let fixed = read_flag(&mut section, "fixed")?;
    let free = read_flag(&mut section, "free")?;
    let sigma = ValuesByUnit::read(&mut section, "sigma")?;
    let min = ValuesByUnit::read(&mut section, "min")?;
    let max = ValuesByUnit::read(&mut section, "max")?;
    section.finish()?;

    let held_by = match (fixed, free) {
        (Some(true), _) => Some("fixed"),
        (_, Some(false)) => Some("free"),
        _ => None,
    };
    let freedom = if let Some(held_by) = held_by {
        if let Some((other, _)) = section.entries().into_iter().find(|(key, _)| *key != held_by) {
            return Err(item.error(InputErrorKind::FixedAndMore { other: other.to_owned() }));
        }
        Freedom::Fixed
    } else if section.len() == 0 {
        return Err(item.error(InputErrorKind::EmptyRule));
    } else {
        let kinds = NOMINAL_VALUES.into_iter().zip(&sigma.0).zip(&min.0).zip(&max.0);
        for (((nominal, sigma), min), max) in kinds {
            check_consistency(nominal, sigma.as_ref(), min.as_ref(), max.as_ref())?;
        }
        Freedom::Free { sigma: sigma.quantities(), min: min.quantities(), max: max.quantities() }
    };
    Ok(ParameterRule { pattern: pattern.to_owned(), freedom, location: item.location() })
}

fn read_flag(section: &mut Section<'_, '_>, key: &str) -> Result<Option<bool>, InputError> {
    section.get(key).map(|item| item.boolean()).transpose()
}

/// Prior width or bound in SI, with its entry in the file.
type Value<'a, 'i> = (f64, Item<'a, 'i>);

/// Prior widths or bounds, one for each unit in [`RULE_UNITS`].
struct ValuesByUnit<'a, 'i>([Option<Value<'a, 'i>>; RULE_UNITS.len()]);

impl<'a, 'i> ValuesByUnit<'a, 'i> {
    fn read(section: &mut Section<'a, 'i>, base: &str) -> Result<Self, InputError> {
        if let Some(bare) = section.peek(base) {
            let write = RULE_UNITS.map(|unit| unit.alternatives(base)).join(" or ");
            return Err(bare.error(InputErrorKind::NeedsUnit { noun: "a spread or bound", write }));
        }
        let mut values = [None, None, None, None];
        for (value, unit) in values.iter_mut().zip(RULE_UNITS) {
            if let Some((item, suffix)) = section.pick(base, unit)? {
                *value = Some(((suffix.to_si)(item.number()?), item));
            }
        }
        Ok(Self(values))
    }

    fn quantities(&self) -> Quantities {
        let [angle, length, pixel, relative] =
            self.0.each_ref().map(|value| value.as_ref().map(|(value, _)| *value));
        Quantities { angle, length, pixel, relative }
    }
}

/// Returns an error if prior width and bounds for one unit contradict each other. `nominal` is the
/// nominal value on the scale of the bounds.
fn check_consistency(
    nominal: f64,
    sigma: Option<&Value<'_, '_>>,
    min: Option<&Value<'_, '_>>,
    max: Option<&Value<'_, '_>>,
) -> Result<(), InputError> {
    if let Some((value, item)) = sigma.filter(|(value, _)| *value <= 0.0) {
        return Err(item.error(InputErrorKind::NotPositive { value: *value }));
    }
    if let (Some((min, item)), Some((max, upper))) = (min, max)
        && min > max
    {
        return Err(item.crossed_limits_error(upper));
    }
    // A ratio to the nominal value must be positive, because its logarithm is bounded.
    if let Some((value, item)) =
        min.into_iter().chain(max).find(|(value, _)| nominal > 0.0 && *value <= 0.0)
    {
        return Err(item.error(InputErrorKind::NotPositive { value: *value }));
    }
    Ok(())
}
