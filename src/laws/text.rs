//! Texts of the catalogue, filled in with arguments.

use super::argument::Argument;

/// Returns a text with `{key}` and `{key:form}` replaced by arguments.
///
/// The form `row` rounds a time up to a row, `cycles` lists orders with their noun. A covariate name
/// is quoted in formulas alone: a word as it is, others in backquotes.
pub(super) fn filled(text: &str, arguments: &[(&str, Argument)]) -> String {
    let mut out = String::with_capacity(text.len() + 16);
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('{') {
        out.push_str(before);
        let Some((inner, behind)) = after.split_once('}') else { break };
        let (key, form) = inner.split_once(':').unwrap_or((inner, ""));
        if let Some((_, argument)) = arguments.iter().find(|(known, _)| *known == key) {
            out.push_str(&shown(argument, form));
        }
        rest = behind;
    }
    out.push_str(rest);
    out
}

/// Returns an argument as text in one of the forms of [`filled`].
fn shown(argument: &Argument, form: &str) -> String {
    match (argument, form) {
        (Argument::Orders(orders), "cycles") => {
            let noun = if orders == &[1] { "cycle" } else { "cycles" };
            format!("{} {noun}", listed(orders))
        }
        (Argument::Orders(orders), _) => listed(orders),
        (Argument::Number(time), "row") => time.ceil().to_string(),
        (Argument::Name(name), "formula") => format!("`{name}`"),
        (argument, _) => argument.place().unwrap_or_else(|| argument.toml()),
    }
}

/// Returns ascending orders in words; three or more consecutive ones as "1 to 5".
fn listed(orders: &[u32]) -> String {
    let runs = orders.chunk_by(|a, b| a + 1 == *b).flat_map(|run| match run {
        [first, _, .., last] => vec![format!("{first} to {last}")],
        few => few.iter().map(u32::to_string).collect(),
    });
    runs.collect::<Vec<String>>().join(", ")
}
