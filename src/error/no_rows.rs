//! Reasons why one part of the split is empty.

use thiserror::Error;

use super::phrases::plural;

/// Reason why one part of the split (identification or held-out rows) is empty.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NoRows {
    #[error(
        "column {column} says {word} in every row; write {} in some of them, or held_out = {{ \
         fraction = 0.3, seed = 1 }} in [data]",
        if *word == "identification" { "validation" } else { "identification" }
    )]
    Column { column: String, word: &'static str },
    #[error("every row is of session \"{session}\"")]
    Session { session: String },
    #[error(
        "the {rows} rows are of {configurations} joint configuration{}, too few for fraction \
         {fraction}; repeated measurements of a pose show the noise, other poses identify the arm",
        plural(*configurations)
    )]
    Fraction { rows: usize, configurations: usize, fraction: String },
}
