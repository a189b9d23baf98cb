//! Reasons why one part of the split is empty.

use thiserror::Error;

/// Reason why one part of the split (identification or held-out rows) is empty.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NoRows {
    #[error("column {column} says {word} in every row")]
    Column { column: String, word: &'static str },
    #[error("every row is of session \"{session}\"")]
    Session { session: String },
    #[error(
        "the {rows} rows have {configurations} joint configurations, too few for fraction \
         {fraction}"
    )]
    Fraction { rows: usize, configurations: usize, fraction: String },
}
