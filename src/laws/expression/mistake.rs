//! Mistakes in formulas.

use std::fmt;

use thiserror::Error;

/// Mistake in a formula and the part of the text that is meant.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("column {}: {mistake}", .column)]
pub struct FormulaError {
    /// First character of that part, counted from 1.
    pub column: usize,
    /// The part as bytes of the formula.
    pub span: std::ops::Range<usize>,
    /// The mistake.
    pub mistake: Mistake,
}

/// Kind of a mistake in a formula.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Mistake {
    /// Something else should stand there.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// The kinds of words that may stand there.
        expected: &'static str,
        /// The word or sign in the text.
        found: String,
    },
    /// A word that is neither quantity, function nor parameter.
    #[error("unknown word {word}{}; a parameter of the formula takes {word} = {{ start = … }}", meant(.near.as_deref()))]
    UnknownWord {
        /// The word.
        word: String,
        /// The known word that it is most like.
        near: Option<String>,
    },
    /// A name in front of parentheses that is no function.
    #[error("unknown function {word}{}", meant(.near.as_deref()))]
    UnknownFunction {
        /// The name.
        word: String,
        /// The known function that it is most like.
        near: Option<String>,
    },
    /// A joint that the arm does not have.
    #[error("{word} names no joint; the arm has {joints}, counted from 1")]
    NoJoint {
        /// The word.
        word: String,
        /// Number of joints.
        joints: usize,
    },
    /// A function with the wrong number of arguments.
    #[error("{function} takes {takes} argument{}, found {found}", if *.takes == 1 { "" } else { "s" })]
    Arguments {
        /// The function.
        function: &'static str,
        /// Number of arguments that it takes.
        takes: usize,
        /// Number of arguments in the text.
        found: usize,
    },
    /// An argument that has to be a literal number or a certain quantity.
    #[error("write {write}")]
    Form {
        /// The form as it should be written.
        write: &'static str,
    },
    /// A number that cannot be represented.
    #[error("{number} is no finite number")]
    NotFinite {
        /// The number as written.
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
    /// A function of a quantity with a unit.
    #[error("{function} takes an angle or a number without unit, found {unit}; divide by a number")]
    HasUnit {
        /// The function.
        function: &'static str,
        /// Unit of its argument.
        unit: String,
    },
    /// Quantities that formulas do not have yet.
    #[error("{word}: {reason}")]
    Unsupported {
        /// The word.
        word: String,
        /// The reason.
        reason: &'static str,
    },
    /// A formula that is too long or too deeply nested.
    #[error("a formula takes at most {most} {of}")]
    TooLarge {
        /// The limit.
        most: usize,
        /// The thing that is limited.
        of: &'static str,
    },
}

/// Returns ` (did you mean …?)` if a known word is near.
fn meant(near: Option<&str>) -> impl fmt::Display {
    near.map_or_else(String::new, |near| format!(" (did you mean {near}?)"))
}
