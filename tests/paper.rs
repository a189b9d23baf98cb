//! The paper's closed forms: each group of equations, each misprint, and the iteration, on the lunar sampler.

#[path = "paper/arm.rs"]
mod arm;
#[path = "paper/elastic.rs"]
mod elastic;
#[path = "paper/geometry.rs"]
mod geometry;
#[path = "paper/identification.rs"]
mod identification;
#[path = "paper/iteration.rs"]
mod iteration;
#[path = "paper/misprints.rs"]
mod misprints;
