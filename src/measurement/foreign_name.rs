//! Names of joint and position columns as other programs write them.

use crate::quantity::Unit;

/// Words that other programs write before the number of a joint.
const JOINT_WORDS: [&str; 12] =
    ["j", "q", "a", "ax", "axis", "axe", "achse", "joint", "jt", "gelenk", "theta", "th"];
/// Words that other programs write before the letter of a coordinate.
const POSITION_WORDS: [&str; 10] =
    ["", "pos", "position", "p", "tcp", "target", "point", "meas", "measured", "coord"];

/// Returns a name of flexcal without its unit, such as `q2` or `x`, that a name of another program
/// means, and the suffix of the unit if the name has one.
pub(super) fn guess(name: &str) -> Option<(String, Option<&'static str>)> {
    let lower = name.to_lowercase();
    let words = lower.split(|letter: char| !letter.is_alphanumeric());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let (mut unit, mut plain) = (None, String::new());
    for (place, &word) in words.iter().enumerate() {
        let is_last = place > 0 && place + 1 == words.len();
        let mut foreign = [Unit::Length, Unit::Angle].into_iter().flat_map(Unit::foreign_suffixes);
        match word {
            "mm" | "millimeter" | "millimetre" => unit = Some("mm"),
            "m" | "meter" | "metre" => unit = Some("m"),
            "deg" | "degree" | "degrees" | "grad" => unit = Some("deg"),
            "rad" | "radian" | "radians" => unit = Some("rad"),
            "inch" | "inches" => unit = Some("in"),
            word => match foreign.find(|suffix| is_last && *suffix == word) {
                Some(suffix) => unit = Some(suffix),
                None => plain.push_str(word),
            },
        }
    }
    unit = unit.or_else(|| name.contains('°').then_some("deg"));
    let letters = plain.trim_end_matches(|letter: char| letter.is_ascii_digit());
    let number = plain.strip_prefix(letters)?.trim_start_matches('0');
    if !number.is_empty() {
        return JOINT_WORDS.contains(&letters).then(|| (format!("q{number}"), unit));
    }
    let axis = ["x", "y", "z"].into_iter().find(|axis| letters.ends_with(axis))?;
    let before = letters.strip_suffix(axis)?;
    POSITION_WORDS.contains(&before).then(|| (axis.to_owned(), unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_programs_are_recognised() {
        for (name, base, unit) in [
            ("J1 [deg]", "q1", Some("deg")),
            ("A06", "q6", None),
            ("Axis 3 (rad)", "q3", Some("rad")),
            ("theta_2", "q2", None),
            ("X (mm)", "x", Some("mm")),
            ("TCP.z [m]", "z", Some("m")),
            ("X (in)", "x", Some("in")),
            ("Y [inch]", "y", Some("in")),
            ("z_cm", "z", Some("cm")),
        ] {
            assert_eq!(guess(name), Some((base.to_owned(), unit)), "{name}");
        }
        for name in ["Name", "RMS", "Timestamp", "Point 3", "rx", "max", "dx1", "in x 3"] {
            assert_eq!(guess(name), None, "{name}");
        }
    }
}
