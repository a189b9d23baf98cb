//! Solvers: certified results, rank deficiency, bounds, and independence of threads.

#![expect(clippy::unwrap_used, reason = "tests may panic")]

mod collections;

#[path = "solver/bench.rs"]
mod bench;
#[path = "solver/bounds.rs"]
mod bounds;
#[path = "solver/derivatives.rs"]
mod derivatives;
#[path = "solver/edges.rs"]
mod edges;
#[path = "solver/inequalities.rs"]
mod inequalities;
#[path = "solver/more_garbow_hillstrom.rs"]
mod more_garbow_hillstrom;
#[path = "solver/nist.rs"]
mod nist;
#[path = "solver/passing.rs"]
mod passing;
#[path = "solver/robust.rs"]
mod robust;
#[path = "solver/threads.rs"]
mod threads;
