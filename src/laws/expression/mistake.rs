//! Mistakes in formulas.

use std::fmt;

use thiserror::Error;

/// Mistake in a formula, with the part of the text that caused it.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("column {}: {mistake}", .column)]
pub struct FormulaError {
    /// Position of the first character of the wrong part, counted from 1.
    pub column: usize,
    /// Byte range of the wrong part in the formula.
    pub span: std::ops::Range<usize>,
    /// Kind of the mistake, with details.
    pub mistake: Mistake,
}

/// Kind of a mistake in a formula.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Mistake {
    /// A word or sign is not allowed at this position.
    #[error("expected {expected}, found {found}{}", power_hint(.found))]
    Unexpected {
        /// Kinds of words that are allowed there.
        expected: &'static str,
        /// Word or sign in the text.
        found: String,
    },
    /// A word that is neither quantity, function nor parameter.
    #[error("{}", unknown_word(.word, .near.as_deref()))]
    UnknownWord {
        /// Unknown word.
        word: String,
        /// Most similar known word, if there is one.
        near: Option<String>,
    },
    /// A name in front of parentheses that is no function.
    #[error("unknown function {word}{}", meant(.near.as_deref()))]
    UnknownFunction {
        /// Unknown name.
        word: String,
        /// Most similar known function, if there is one.
        near: Option<String>,
    },
    /// A joint that the arm does not have.
    #[error("{word} names no joint; the arm has {joints}, counted from 1")]
    NoJoint {
        /// Word in the text, such as `q9`.
        word: String,
        /// Number of joints of the arm.
        joints: usize,
    },
    /// A function with the wrong number of arguments.
    #[error(
        "{function} takes {takes} argument{}, found {found}{}",
        if *.takes == 1 { "" } else { "s" },
        if *.has_decimal_comma { "; a decimal comma is written as a point: 0.5 for 0,5" } else { "" }
    )]
    Arguments {
        /// Name of the function.
        function: &'static str,
        /// Number of arguments that it takes.
        takes: usize,
        /// Number of arguments in the text.
        found: usize,
        /// True if a comma stands between two digits.
        has_decimal_comma: bool,
    },
    /// An argument is not the literal number or the quantity that the function requires.
    #[error("write {write}")]
    Form {
        /// Form in which it should be written.
        write: &'static str,
    },
    /// A number that cannot be represented.
    #[error("{number} is no finite number")]
    NotFinite {
        /// Number as written in the text.
        number: String,
    },
    /// A sum or comparison of different kinds of quantities.
    #[error("{left} and {right} cannot be added or compared")]
    DifferentUnits {
        /// Unit on the left.
        left: String,
        /// Unit on the right.
        right: String,
    },
    /// A function is applied to a quantity with a unit.
    #[error("{function} takes an angle or a number without unit, found {unit}; divide by a number")]
    HasUnit {
        /// Name of the function.
        function: &'static str,
        /// Unit of the function's argument.
        unit: String,
    },
    /// A formula that is too long or too deeply nested.
    #[error("a formula takes at most {most} {of}")]
    TooLarge {
        /// Limit that is exceeded.
        most: usize,
        /// Noun for the quantity that is limited.
        of: &'static str,
    },
}

/// Returns the hint on powers for a second `*`, or an empty text.
fn power_hint(found: &str) -> &'static str {
    if found == "*" { "; a power is written with ^, as in q3^2" } else { "" }
}

/// Describes a word without a meaning. A function that is written without parentheses is its own
/// most similar word.
fn unknown_word(word: &str, near: Option<&str>) -> String {
    match near {
        Some(near) if near == word => format!("{word} needs parentheses: {word}(q1)"),
        _ => format!(
            "unknown word {word}{}; a parameter of the formula takes {word} = {{ start = … }}",
            meant(near)
        ),
    }
}

/// Returns ` (did you mean …?)` with a similar known word; an empty text for `None`.
fn meant(near: Option<&str>) -> impl fmt::Display {
    near.map_or_else(String::new, |near| format!(" (did you mean {near}?)"))
}
