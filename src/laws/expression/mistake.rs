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
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// Kinds of words that are allowed there.
        expected: &'static str,
        /// Word or sign in the text.
        found: String,
    },
    /// A word that is neither quantity, function nor parameter.
    #[error("unknown word {word}{}; a parameter of the formula takes {word} = {{ start = … }}", meant(.near.as_deref()))]
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
    #[error("{function} takes {takes} argument{}, found {found}", if *.takes == 1 { "" } else { "s" })]
    Arguments {
        /// Name of the function.
        function: &'static str,
        /// Number of arguments that it takes.
        takes: usize,
        /// Number of arguments in the text.
        found: usize,
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

/// Returns ` (did you mean …?)` with a similar known word; an empty text for `None`.
fn meant(near: Option<&str>) -> impl fmt::Display {
    near.map_or_else(String::new, |near| format!(" (did you mean {near}?)"))
}
