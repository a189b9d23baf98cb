//! Parsers of the values of options.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Returns a parser of a finite number that `is_allowed` accepts; `wanted` is the message for other
/// words.
pub fn number(
    is_allowed: fn(f64) -> bool,
    wanted: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text: &str| {
        let number = text.parse::<f64>().ok().filter(|x| x.is_finite() && is_allowed(*x));
        number.ok_or_else(|| wanted.to_owned())
    }
}

/// Parses a probability greater than 0 and less than 1.
pub fn level(text: &str) -> Result<f64, String> {
    let wanted = "a probability between 0 and 1 is needed, such as 0.95";
    number(|level| 0.0 < level && level < 1.0, wanted)(text)
}

/// Parses a number of days, at least 0.
pub fn days(text: &str) -> Result<f64, String> {
    number(|days| days >= 0.0, "a number of days, at least 0, is expected")(text)
}

/// Parses a number of poses from 1 to `MAX`.
pub fn count<const MAX: u32>(text: &str) -> Result<u32, String> {
    let number = text.parse().ok().filter(|number| (1..=MAX).contains(number));
    number.ok_or_else(|| format!("a whole number from 1 to {MAX} is needed, such as 40"))
}

/// Parses exactly `N` finite numbers with commas between them.
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let finite = |word: &str| word.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let numbers: Option<Vec<f64>> = text.split(',').map(finite).collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| format!("not {N} numbers with commas between them"))
}

/// Returns a parser of the name of one of some values, which are given with names and summaries.
pub fn one_of<T: Clone + Send + Sync + 'static>(
    choices: impl Into<Vec<(&'static str, &'static str, T)>>,
) -> impl TypedValueParser<Value = T> {
    let choices = choices.into();
    let names = choices.iter().map(|(name, help, _)| PossibleValue::new(*name).help(*help));
    PossibleValuesParser::new(names.collect::<Vec<_>>()).try_map(move |word| {
        let chosen = choices.iter().find(|(name, ..)| name.eq_ignore_ascii_case(&word));
        chosen.map(|(.., value)| value.clone()).ok_or_else(|| format!("{word} stands for nothing"))
    })
}
