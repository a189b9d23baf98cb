//! Design of experiments: choice of poses, and forecast of the results of their measurement.
//!
//! All quantities are linear about the nominal arm. M = Σ JᵢᵀJᵢ + P is the information on the free
//! parameters, with Jᵢ the derivatives of a position over its σ (3 rows per pose) and P =
//! diag(1/σ²) of the priors. C = M⁻¹ is the expected covariance. No measured positions are needed.

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
pub use check::{Check, CheckedPoses, PredictionPoses, check, predictable_rows, random_rows};
pub use criterion::Criterion;
pub use error::DesignError;
pub use exchange::{Exchange, ExchangeResult};
pub use forecast::{ExpectedParameter, Forecast, Prediction};
pub use growth::{Growth, GrowthStep};
pub use plan::{Candidates, Plan, PlanOptions, PlanProgress, plan};
pub use sensitivity::Sensitivity;
pub use separate::{EffectPair, PairSeparation, separate};
pub use site::Site;
pub use workspace::Workspace;
