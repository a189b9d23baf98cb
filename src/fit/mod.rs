//! Identification of an arm: fits, their uncertainty, checks of their results, and their
//! application.
//!
//! [`identify`] fits the free parameters of a problem. Its [`Options`] select a strategy and a
//! solver, which may be a [`CustomSolver`]. The returned [`Identification`] contains estimates with
//! standard errors, their covariance, errors of identification and held-out rows, and the
//! [`Finding`]s of the checks. [`Identification::predict`] and
//! [`Identification::predict_with_covariance`] apply it to other poses. [`compensate`] finds the
//! commands that bring the identified arm to given positions. A [`SavedEstimate`] is an
//! identification read back from `estimate.json`.

mod apply;
mod checks;
mod compare;
mod errors;
mod identification;
mod identify_error;
mod influential_rows;
mod options;
mod outcome;
mod prior_comparison;
mod residual_function;
mod stages;
mod uncertainty;
mod warm_start;

pub use crate::quantity::Unit;
pub(crate) use apply::acceptance::{Acceptance, Accuracy, acceptance, held_out_positions};
#[doc(hidden)]
pub use apply::command_jacobian::jacobian;
pub use apply::compensate::{Command, compensate};
pub(crate) use apply::joint_source::{JointSources, joint_sources};
pub(crate) use apply::missing_loads::missing_loads;
pub use apply::predict::Residual;
pub(crate) use apply::predict_saved::ErrorsBySession;
pub use apply::predict_saved::{PredictError, Prediction, predict};
pub use apply::predicted_covariance::PredictedPosition;
#[doc(hidden)]
pub use apply::predicted_covariance::standard_errors;
pub use apply::saved_estimate::SavedEstimate;
pub use apply::saved_estimate_error::SavedEstimateError;
#[doc(hidden)]
pub use apply::tolerance::{Tolerance, ToleranceTest, Verdict};
pub use checks::finding::{Finding, FindingCode, Severity};
pub(crate) use checks::misreading::{MisreadEffect, misread_table};
pub(crate) use checks::open_directions::{open_quantities, open_scale};
pub use checks::outliers::{InfluentialRows, Outlier};
pub use checks::point_spread::PointSpread;
pub(crate) use checks::required_columns::check_columns;
#[doc(hidden)]
pub use checks::required_columns::missing_target_columns;
pub(crate) use checks::row_kind::{format_error as size_of_kind, row_noun as rows_of_kind};
pub(crate) use checks::set_aside::selection as selection_of_outliers;
pub(crate) use compare::baseline::Baseline;
pub(crate) use compare::comparison::ErrorsBefore;
pub(crate) use compare::procedure::{PaperTableEntry, Procedure};
pub use errors::{AxisValues, ErrorSummary, Errors, OrientationErrors};
pub use identification::identify;
pub use identify_error::IdentifyError;
pub use options::Options;
pub use outcome::{Estimate, Identification};
pub(crate) use prior_comparison::{ComparedParameter, PriorComparison};
pub use stages::alternation::Alternation;
pub use stages::custom_solver::CustomSolver;
pub(crate) use stages::earlier_data::EarlierData;
pub(crate) use stages::fixture_location::locate;
pub use stages::progress::{Progress, ProgressSink, Stop};
pub(crate) use stages::registration::register;
pub use stages::solver_choice::SolverChoice;
pub(crate) use stages::stage::COST_TOLERANCE;
pub use stages::stage::StageError;
pub use stages::strategy::Strategy;
pub(crate) use stages::unmoved::Unmoved;
pub use uncertainty::active_constraint::ActiveConstraint;
pub use uncertainty::covariance::{Correlations, Covariance};
pub use uncertainty::noise::Noise;
pub use uncertainty::prior_sizes::PriorSize;
pub(crate) use uncertainty::residual_lengths::TypicalScatter;
pub use uncertainty::shadow_price::ShadowPrice;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    apply::compensate::{seen_from_base, seen_in_base, waypoints},
    checks::finding::FindingEntry,
    compare::comparison::{CompareOptions, Comparison, compare},
    identification::identify_model,
    residual_function::{ResidualFunction, ResidualOrigin},
    stages::placement::Placement,
};
