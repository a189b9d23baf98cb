//! Remedies that depend on the place of an error as well as on its kind.

use std::fmt;

use super::near::nearest;
use super::{InputError, InputErrorKind, Location, TableErrorKind, one_line};

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let remedy = remedy(&self.location, &self.kind);
        write!(f, "{}: {}{remedy}", self.location, one_line(&self.kind.to_string()))
    }
}

/// Returns `; ` and the remedy for an error at a location, or an empty text.
fn remedy(location: &Location, kind: &InputErrorKind) -> &'static str {
    let key = location.key.as_deref().unwrap_or_default();
    let (section, name) = (
        key.split(['.', '[']).next().unwrap_or_default(),
        key.rsplit(['.', ' ']).next().unwrap_or_default(),
    );
    match kind {
        InputErrorKind::NotPositive { .. }
            if section == "parameters" && name.starts_with("sigma") =>
        {
            "; fixed = true holds a parameter"
        }
        InputErrorKind::NotPositive { .. } if section == "parameters" => {
            "; relative is a multiple of the nominal value, such as 0.8 for one that is 20 % \
             smaller"
        }
        InputErrorKind::NotPositive { .. }
            if section == "data" && name.starts_with("position_sigma") =>
        {
            "; without this key, σ is estimated from the residuals"
        }
        InputErrorKind::WrongType { found: "a list", .. } if name.contains("_sigma") => {
            "; one σ holds for all axes, and a column sigma_mm states one for each row"
        }
        InputErrorKind::NotAFraction { value } if section == "data" && *value == 0.0 => {
            "; held_out = \"none\" fits all rows"
        }
        InputErrorKind::Table(TableErrorKind::MissingColumn { write, .. }) if write == "point" => {
            "; it holds the number of the marker's point, counted from 0"
        }
        InputErrorKind::NotFinite { .. } if name.starts_with("stiffness") => {
            "; for a rigid part leave the key out"
        }
        InputErrorKind::UnknownKey { key, known, .. }
            if section == "effect"
                && !location.key.as_deref().is_some_and(|path| path.contains("].law"))
                && !ARGUMENTS.contains(&key.as_str())
                && nearest(key, known).is_none() =>
        {
            "; an effect has no value, because it is found: a prior or start is a rule of \
             [parameters]"
        }
        InputErrorKind::UnknownKey { key, .. }
            if name.ends_with(key) && is_modulus(key) && name_of_parent(location) == "beam" =>
        {
            "; write the rigidities of the cross-section: EA_N = E·A, EIy_N_m2 = E·I and \
             GJ_N_m2 = G·J"
        }
        InputErrorKind::WrongUnit { noun: "an angle", suffix, .. }
            if section.starts_with("column") && matches!(&**suffix, "m" | "mm") =>
        {
            "; if the joint slides, its section lacks kind = \"prismatic\""
        }
        _ => "",
    }
}

/// Keys that name the place of an effect, not its size.
const ARGUMENTS: [&str; 8] = ["joint", "joints", "from", "order", "orders", "link", "base", "at"];

/// Returns true if a key names a modulus of elasticity or of shear, such as `E_GPa`.
fn is_modulus(key: &str) -> bool {
    matches!(key.split('_').next(), Some("E" | "G"))
}

/// Returns the name of the section that contains the key of a location.
fn name_of_parent(location: &Location) -> &str {
    let key = location.key.as_deref().unwrap_or_default();
    let parent = key.rsplit_once('.').map_or("", |(parent, _)| parent);
    parent.rsplit('.').next().unwrap_or_default()
}
