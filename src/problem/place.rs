//! Sections to which misplaced keys belong.

use crate::error::one_typo;
use crate::laws::NAMES;

/// Sections with some of their keys that are often written in another section.
const SECTION_KEYS: [(&str, &[&str]); 4] = [
    ("", &["gravity_m_s2", "dh", "title"]),
    (
        "data",
        &[
            "files",
            "held_out",
            "position_sigma_mm",
            "orientation_sigma_deg",
            "reference_temperature_C",
            "columns",
            "format",
            "covariates",
        ],
    ),
    ("tool", &["target_m", "target_mm", "payload_kg"]),
    ("joint", &["alpha_deg", "a_m", "a_mm", "theta_deg", "d_m", "d_mm", "min_deg", "max_deg"]),
];

/// Returns the place where an unknown key belongs; `None` if it is a key of no section, or is
/// similar to a key that is `known` at its place.
pub(super) fn proper_place(key: &str, known: &[String]) -> Option<String> {
    if known.iter().any(|known| one_typo(key, known)) {
        return None;
    }
    if NAMES.contains(&key) {
        return Some(format!(
            "an effect stands below a line [[effect]]; write that line above {key}"
        ));
    }
    let (section, _) = SECTION_KEYS.iter().find(|(_, keys)| keys.contains(&key))?;
    // A joint with a placement or a leader has no such keys, so its section is the right one.
    if *section == "joint" && known.iter().any(|known| known == "kind") {
        return None;
    }
    Some(match *section {
        "" => format!("{key} is a key of the top level; write it above the first [section]"),
        "joint" => format!("{key} is a key of a joint; write it below its line [[joint]]"),
        "data" if ["columns", "format", "covariates"].contains(&key) => {
            format!("the section {key} is a part of [data]; write [data.{key}]")
        }
        section => format!("{key} is a key of [{section}]; write it below the line [{section}]"),
    })
}
