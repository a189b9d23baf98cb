//! Parser of the argument `--level` of error bounds and of other probabilities.

/// Parses a probability greater than 0 and less than 1.
pub fn parse_level(text: &str) -> Result<f64, String> {
    let level = text.parse::<f64>().ok().filter(|level| 0.0 < *level && *level < 1.0);
    level.ok_or_else(|| "a probability between 0 and 1 is needed, such as 0.95".to_owned())
}
