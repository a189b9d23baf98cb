//! Design of experiments: which poses to measure, and what measurements will tell before anyone
//! makes them.
//!
//! Everything here is linear about the nominal arm. M = Σ JᵢᵀJᵢ + P is the information on the free
//! parameters: Jᵢ the derivatives of a position over its σ (3 rows a pose), P = diag(1/σ²) of the
//! priors; C = M⁻¹ is the covariance to expect. Positions need not be measured for that.

mod candidate_poses;
mod check;
mod coordinates;
mod criterion;
mod error;
mod exchange;
mod forecast;
mod growth;
mod plan;
mod scan;
mod sensitivity;
mod separate;
mod site;
mod workspace;

pub use candidate_poses::Extremes;
pub use check::{Check, Elsewhere, Judged, check, some_of, with_known_words};
pub use criterion::Criterion;
pub use error::DesignError;
pub use exchange::{Exchange, Exchanged};
pub use forecast::{Expected, Forecast, Prediction};
pub use growth::{Growth, GrowthStep};
pub use plan::{Candidates, Plan, PlanOptions, PlanProgress, plan};
pub use sensitivity::Sensitivity;
pub use separate::{Pair, Separated, separate};
pub use site::Site;
pub use workspace::Workspace;
