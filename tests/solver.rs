//! Solvers against certified results, and what they promise at the edges: rank deficiency, bounds, threads.

mod common;

#[path = "solver/bounds.rs"]
mod bounds;
#[path = "solver/derivatives.rs"]
mod derivatives;
#[path = "solver/edges.rs"]
mod edges;
#[path = "solver/nist.rs"]
mod nist;
#[path = "solver/threads.rs"]
mod threads;
