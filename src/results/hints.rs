//! Physical causes that a law of the search resembles, as hints in words.

use crate::laws::At;
use crate::problem::Effect;

/// Physical cause that a law resembles.
struct Hint {
    /// Kind of site: the name of the site in files without joint number and axis.
    site: &'static str,
    /// Formula, with `#` for the number of the law's joint and `*` for that of another joint. The
    /// time of a step is left out.
    formula: &'static str,
    /// Noun phrase for the cause, which a sentence puts between "as" and "would".
    cause: &'static str,
}

const fn hint(site: &'static str, formula: &'static str, cause: &'static str) -> Hint {
    Hint { site, formula, cause }
}

/// Causes of laws with one term, by site and formula. Each cause is one of several possible ones.
const HINTS: [Hint; 27] = [
    hint("joint", "q#^2", "an encoder scale that changes over the range"),
    hint("joint", "abs(q# - c)", "a tooth flank that changes at c, or a cable that tightens there"),
    hint("joint", "sin(q#)", "a spring across the joint, or an eccentric encoder"),
    hint("joint", "cos(q#)", "a spring across the joint, or an eccentric encoder"),
    hint("joint", "sin(2*q#)", "a spring across the joint, or an oval gear"),
    hint("joint", "cos(2*q#)", "a spring across the joint, or an oval gear"),
    hint("joint", "sin(q# + q*)", "gravity on an undeclared mass of the next links"),
    hint("joint", "cos(q# + q*)", "gravity on an undeclared mass of the next links"),
    hint("joint", "sin(q* + q#)", "gravity on an undeclared mass of the links"),
    hint("joint", "cos(q* + q#)", "gravity on an undeclared mass of the links"),
    hint("joint", "sign(M#)", "play that the load takes up"),
    hint("joint", "payload", "a compliance under the payload"),
    hint("joint", "payload^2", "a compliance that grows with the payload"),
    hint("joint", "approach#*payload", "play or friction that grows with the payload"),
    hint("joint", "approach*", "a cable that another joint drags"),
    hint("joint", "T^2", "an expansion that grows with temperature"),
    hint("joint", "q#*T", "an encoder disc or a belt that expands"),
    hint("joint", "t", "creep, or a drive that warms slowly"),
    hint("joint", "1 - exp(-t/tau)", "a drive that warms up"),
    hint("joint", "step(t)", "a slip at that time"),
    hint("link", "T^2", "an expansion that grows with temperature"),
    hint("tool", "T", "a tool that expands"),
    hint("tool", "payload", "a tool that bends under its load"),
    hint("measurement", "t", "an instrument that drifts"),
    hint("measurement", "T", "an instrument stand that expands"),
    hint("base", "payload", "a floor that gives way under the load"),
    hint("base", "t", "a base that sinks"),
];

/// Returns the cause that a law of the search resembles, as a phrase "as … would". `None` for other
/// effects, for laws with several terms, and for laws without an entry in the table.
pub(super) fn resembled(effect: &Effect) -> Option<String> {
    let Effect::Law(law) = effect else { return None };
    law.composed_ln_prior()?;
    let [formula] = law.formulas().try_into().ok()?;
    let site = law.site();
    let site_kind = match law.at() {
        At::Beam(_) => "link",
        _ => site.split('.').next().unwrap_or_default(),
    };
    let is_small_motion = site.contains('.') && law.joint().is_some();
    let site_kind = site_kind.trim_end_matches(|c: char| c.is_ascii_digit());
    let pattern = pattern(&formula, law.joint());
    let is_of_law =
        |hint: &&Hint| hint.site == site_kind && hint.formula == pattern && !is_small_motion;
    let hint = HINTS.iter().find(is_of_law)?;
    Some(format!("as {} would", hint.cause))
}

/// Returns the pattern of a formula, by which laws at different joints are compared: `#` stands for
/// the number of `joint`, `*` for those of other joints, and the time of a step is left out.
fn pattern(formula: &str, joint: Option<usize>) -> String {
    let of_law = joint.map(|joint| joint.to_string());
    let mut out = String::new();
    let mut letters: Vec<char> = formula.chars().collect();
    letters.push(' ');
    let mut word = String::new();
    for letter in letters {
        if letter.is_ascii_alphanumeric() || letter == '_' {
            word.push(letter);
            continue;
        }
        let name = word.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = &word[name.len()..];
        if matches!(name, "q" | "M" | "approach") && !number.is_empty() {
            out += name;
            out.push(if of_law.as_deref() == Some(number) { '#' } else { '*' });
        } else {
            out += &word;
        }
        word.clear();
        out.push(letter);
    }
    let out = out.trim_end();
    match out.strip_prefix("step(t - ").and_then(|rest| rest.strip_suffix(')')) {
        Some(time) if time.parse::<f64>().is_ok() => "step(t)".to_owned(),
        _ => out.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_joints_are_left_out() {
        assert_eq!(pattern("sin(q3 + q4)", Some(3)), "sin(q# + q*)");
        assert_eq!(pattern("approach2*payload", Some(2)), "approach#*payload");
        assert_eq!(pattern("step(t - 345.5)", Some(2)), "step(t)");
        assert_eq!(pattern("abs(q2 - c)", Some(2)), "abs(q# - c)");
        assert_eq!(pattern("T", None), "T");
    }

    #[test]
    fn the_table_in_the_documentation_has_every_hint() {
        let page = include_str!("../../docs/laws.md");
        for Hint { site, formula, cause } in &HINTS {
            let line = page.lines().find(|line| {
                line.starts_with(&format!("| {site} |"))
                    && line.contains(&format!("`{formula}`"))
                    && line.contains(cause)
            });
            assert!(line.is_some(), "{site} {formula}: {cause}");
        }
    }
}
