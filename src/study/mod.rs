//! Monte Carlo comparison of strategies: many fits to simulated measurements whose truth is known
//! (`flexcal study`).
//!
//! A [`Study`] (`STUDY.toml`, see `docs/study.md`) has a cell for every combination of noise level,
//! number of poses, strategy and solver. Repetition r draws an arm, poses and noise from the seed
//! and r alone. Every cell therefore fits the same arms in the same poses. Results do not depend on
//! the order or on the number of threads or machines. The fits of a cell are grouped into
//! [`Part`]s. A finished part is kept in a [`Store`], and results are computed from finished parts
//! only.
//!
//! A [`MisprintStudy`] repeats the experiment of Chen et al. (2021) with simulated arms instead.

mod definition;
mod effects;
mod input;
mod key;
mod read;
mod repetition;
mod replica;
mod results;
mod run;
mod store;
mod tally;

pub use definition::{Part, Shard, Source, Study};
pub use read::Request;
pub use repetition::table;
pub(crate) use replica::{AlternativeModel, HeldOutError, NamedReading, Replica};
pub use replica::{Case, MisprintStudy, ReplicaResults, Spread, replicate};
pub use results::Results;
pub(crate) use results::{CellResult, ParameterResult};
pub use run::{collect, pending, run};
pub use store::Store;
