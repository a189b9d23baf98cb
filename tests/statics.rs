//! Statics independent of the formulas: textbook beams, reciprocity, symmetry, convergence, limits.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod common;

#[path = "statics/bench.rs"]
mod bench;
#[path = "statics/derivatives.rs"]
mod derivatives;
#[path = "statics/golden.rs"]
mod golden;
#[path = "statics/limits.rs"]
mod limits;
#[path = "statics/reciprocity.rs"]
mod reciprocity;
#[path = "statics/symmetry.rs"]
mod symmetry;
#[path = "statics/textbook.rs"]
mod textbook;
#[path = "statics/tree.rs"]
mod tree;
