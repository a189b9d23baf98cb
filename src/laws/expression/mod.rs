//! Expressions: formulas over quantities of a pose and named parameters.
//!
//! An expression is read from text ([`parse`](fn@parse)), written back ([`std::fmt::Display`]), and
//! evaluated generically over the scalar, so that dual numbers differentiate it. Joints print as
//! `q1`, `q2`, … and covariates as `covariate1`, …, unless names are given ([`Names`]).

mod dimension;
mod evaluate;
mod mistake;
mod parse;
mod print;
mod tree;

pub(crate) use dimension::Per;
pub use mistake::{FormulaError, Mistake};
pub(crate) use parse::Parsed;
pub use parse::Vocabulary;
pub use parse::parse;
pub use print::Names;
pub use tree::Expression;
pub(crate) use tree::{Function, Operator};
