//! Design of experiments: choice of poses, and forecast of the results of their measurement.
//!
//! All quantities are linear about the nominal arm. M = Σ JᵢᵀJᵢ + P is the information on the free
//! parameters, with Jᵢ the derivatives of a position over its σ (3 rows per pose) and P =
//! diag(1/σ²) of the priors. C = M⁻¹ is the expected covariance. No measured positions are needed.

mod candidate_poses;
mod check;
mod coordinates;
mod criterion;
mod drawn;
mod error;
mod exchange;
mod explanations;
mod forecast;
mod greedy;
mod growth;
mod misfit;
mod next;
mod plan;
mod pool;
mod posterior;
mod purpose;
mod scan;
mod sensitivity;
mod separate;
mod site;
mod tolerance;
mod views;
mod workspace;
mod workspace_error;

pub(crate) use check::PredictionPoses;
pub use check::{Check, CheckedPoses, check};
pub use criterion::Criterion;
pub use drawn::Candidates;
pub use error::DesignError;
pub(crate) use exchange::ExchangeResult;
pub(crate) use forecast::Prediction;
pub use forecast::{ExpectedParameter, Forecast};
pub(crate) use growth::{Growth, GrowthStep};
pub use plan::{Plan, PlanOptions, plan};
// Public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    candidate_poses::Extremes,
    check::{predictable_rows, random_rows},
    exchange::Exchange,
    explanations::{Explanations, rivals},
    next::{NextError, NextOptions, NextPoses, NextStep, next},
    plan::PlanProgress,
    purpose::{Purpose, StopReason},
    sensitivity::Sensitivity,
    separate::{EffectPair, PairSeparation, separate},
    site::Site,
    workspace::{RegionError, Workspace},
    workspace_error::WorkspaceError,
};
