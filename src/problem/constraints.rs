//! Reader of `[[constraint]]`: linear inequalities between parameters.

use super::item::Item;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// Linear inequality `[[constraint]]`: at_least ≤ Σ coefficient · parameter ≤ at_most.
#[derive(Debug, Clone)]
pub struct Constraint {
    /// Parameters with their coefficients.
    pub terms: Vec<ConstraintTerm>,
    /// Lower limit of the sum.
    pub at_least: Option<Limit>,
    /// Upper limit of the sum.
    pub at_most: Option<Limit>,
    /// Location in the file, for errors.
    pub location: Location,
}

/// Term of a constraint: one parameter with its coefficient.
#[derive(Debug, Clone)]
pub struct ConstraintTerm {
    /// Name of the parameter.
    pub name: String,
    /// Coefficient of the parameter, not zero.
    pub coefficient: f64,
    /// Location in the file, for errors.
    pub location: Location,
}

/// Limit of a constraint.
#[derive(Debug, Clone)]
pub struct Limit {
    /// Value of the limit \[rad\], \[m\] or logarithm.
    pub value: f64,
    /// Kind of quantity that the constraint adds up.
    pub kind: LimitKind,
    /// Location in the file, for errors.
    pub location: Location,
}

/// Kind of quantity that a constraint adds up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LimitKind {
    /// Sum of angles \[rad\].
    Angle,
    /// Sum of lengths \[m\].
    Length,
    /// Sum of logarithms of stiffnesses and rigidities in SI units.
    Logarithm,
}

/// Reads all constraints in the order of the file.
pub(super) fn read(root: &mut Section<'_, '_>) -> Result<Vec<Constraint>, InputError> {
    root.sections("constraint")?.into_iter().map(read_constraint).collect()
}

fn read_constraint(mut section: Section<'_, '_>) -> Result<Constraint, InputError> {
    let item = section.require("terms", "terms = { \"A.EI\" = 1.0, \"B.EI\" = -1.0 }")?;
    let mut terms = Vec::new();
    for (name, term) in item.section()?.entries() {
        // TOML reads `terms = { A.EI = 1.0 }` without quotes as a table `A` with the key `EI`.
        if term.holds_tables() {
            let inner = term.section()?.entries().first().map_or("…", |(inner, _)| *inner);
            return Err(
                term.error(InputErrorKind::UnquotedName { name: format!("{name}.{inner}") })
            );
        }
        let coefficient = term.number()?;
        if coefficient == 0.0 {
            return Err(term.error(InputErrorKind::NoCoefficient));
        }
        terms.push(ConstraintTerm {
            name: name.to_owned(),
            coefficient,
            location: term.location(),
        });
    }
    if terms.is_empty() {
        return Err(item.error(InputErrorKind::NoTerms));
    }
    let at_least = read_limit(&mut section, "at_least")?;
    let at_most = read_limit(&mut section, "at_most")?;
    section.finish()?;
    match (&at_least, &at_most) {
        (None, None) => return Err(section.error(InputErrorKind::NoLimit)),
        (Some((least, lower)), Some((most, upper)))
            if least.kind == most.kind && least.value > most.value =>
        {
            return Err(lower.crossed_limits_error(upper));
        }
        _ => {}
    }
    let [at_least, at_most] = [at_least, at_most].map(|limit| limit.map(|(limit, _)| limit));
    Ok(Constraint { terms, at_least, at_most, location: section.location() })
}

/// Reads the limit under the key `base` with a suffix for its unit. A limit of logarithms has no
/// unit, so its key is `base` itself.
fn read_limit<'a, 'i>(
    section: &mut Section<'a, 'i>,
    base: &str,
) -> Result<Option<(Limit, Item<'a, 'i>)>, InputError> {
    let mut found = Vec::new();
    if let Some(item) = section.get(base) {
        found.push((item.number()?, LimitKind::Logarithm, item));
    }
    for (unit, kind) in [(Unit::Angle, LimitKind::Angle), (Unit::Length, LimitKind::Length)] {
        if let Some((item, suffix)) = section.pick(base, unit)? {
            found.push(((suffix.to_si)(item.number()?), kind, item));
        }
    }
    if let [_, (.., second), ..] = &found[..] {
        return Err(
            second.error(InputErrorKind::GivenTwice { first: format!("{base} in another unit") })
        );
    }
    Ok(found
        .pop()
        .map(|(value, kind, item)| (Limit { value, kind, location: item.location() }, item)))
}
