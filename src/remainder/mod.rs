//! Remainder: the smooth error that no law explains, modelled by Gaussian processes at the joints;
//! and the uncertainty of predictions.
//!
//! [`fit()`] conditions the processes and the parameters on the rows of an identification. It keeps
//! the processes if left-out configurations are then predicted better. The result is a
//! [`Correction`]. It is saved as `remainder.json`, and [`predict`] and [`compensate`] apply it to
//! other poses.

mod apply;
mod blocks;
mod bounds;
mod compensation;
mod correction;
mod cross_validation;
mod declared;
mod fit;
mod gain;
mod held_out;
mod hyperparameter_search;
mod inducing;
mod joint_errors;
mod judge;
mod kernel;
mod likelihood;
mod linearise;
mod noise_likelihood;
mod pairs;
mod placement_fit;
mod posterior;
mod prior;
mod residuals;
mod rivals;
mod rows;
mod saved;
mod scores;
mod search;
mod tables;
#[cfg(test)]
mod tests;
mod training_rows;
mod uncorrected;
mod update;

pub use apply::{CorrectedPrediction, predict};
pub use correction::{CorrectedPose, Correction};
pub(crate) use fit::{Carried, MIN_CONFIGURATIONS, Outcome};
pub use fit::{Fitted, fit};
pub(crate) use joint_errors::{JointError, JointErrorPoint};
pub(crate) use residuals::residuals;
pub(crate) use saved::{FORMAT, SavedRemainder};
pub(crate) use uncorrected::{side_changes, unknown_sides};
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    apply::{compensate, predict_identified, sides_of},
    bounds::{BoundTest, Bounds, Compared},
    compensation::{Compensation, CompensationError, TargetFrame},
    declared::{declared, of_estimate},
    fit::uncertainty,
    rivals::{Rival, Side},
    saved::SavedRemainderError,
    uncorrected::{Uncorrected, true_positions},
};
pub(crate) use declared::earlier;
pub(crate) use rows::InputSource;
pub(crate) use tables::{CorrectionTables, InputTable, SiteTable};
pub(crate) use update::{ChangedSince, EarlierCorrections, PredictedRows};
