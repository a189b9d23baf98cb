//! Words that a formula may use.

use super::tree::{Function, Operator};

/// Words of a problem that formulas may use in addition to the built-in ones.
#[derive(Debug, Clone, Copy, Default)]
pub struct Vocabulary<'a> {
    /// True for each prismatic joint.
    pub slides: &'a [bool],
    /// Names of joints with their indices from 0.
    pub joints: &'a [(String, usize)],
    /// Names of the covariates of the problem.
    pub covariates: &'a [String],
    /// Names of the parameters inside the formula.
    pub parameters: &'a [String],
}

impl Vocabulary<'_> {
    /// Quantities whose name is one word, in the syntax of formulas.
    pub const QUANTITIES: [&'static str; 5] = ["T", "t", "time", "payload", "hoist"];

    /// Returns true if a word has a meaning in formulas on any arm: a quantity, a function or a
    /// constant.
    pub fn is_reserved(word: &str) -> bool {
        let is_numbered = ["q", "approach", "M"].into_iter().any(|prefix| {
            let digits = word.strip_prefix(prefix).unwrap_or_default();
            !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit())
        });
        let operators = Operator::CALLS.iter().map(|(_, name)| *name);
        let mut names = Function::ALL.iter().map(|(_, name)| *name).chain(operators);
        is_numbered
            || Self::QUANTITIES.contains(&word)
            || ["pi", "lag", "friction"].contains(&word)
            || names.any(|name| name == word)
    }
}
