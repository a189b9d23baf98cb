//! Effects of the catalogue on an arm: their parameters, and the candidates of a search.
//!
//! Entries of the [catalogue](crate::laws) are data; here they meet a problem. To add a family, add
//! an entry to `src/laws/catalogue.rs`; docs/effects.md walks through it. A declared law
//! needs no entry: a problem declares it.

mod candidates;
mod chance;
mod coverage;
mod place;
mod terms;

pub(crate) use candidates::Candidate;
pub(crate) use candidates::HIGHEST_ORDER;
pub use candidates::candidates;
pub(crate) use coverage::{Columns, DataCoverage, NO_REFERENCE, NO_TEMPERATURE, NO_VELOCITIES};
pub(crate) use terms::{Term, parameters};
