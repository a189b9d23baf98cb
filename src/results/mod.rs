//! Results as data: one struct for every JSON file that flexcal writes.
//!
//! Every file begins with its `format` and the `program` ([`Document`]); docs/schema/ has the JSON
//! Schema of each. Texts, reports and the Python package use these structs.

#![allow(clippy::struct_field_names, reason = "fields are keys of the files, units included")]
#![expect(
    missing_docs,
    reason = "a field bears the name of its key; it has a comment where docs/results.md says more than the name"
)]

mod acceptance;
mod alternative;
mod application;
mod claims;
mod closed_loop;
mod comparison;
mod design;
mod document;
mod effect;
mod export;
mod fleet;
mod hints;
mod identification;
mod knowledge;
mod next;
mod parameter_value;
pub(crate) mod plots;
mod prior;
mod remainder;
mod residual_test;
mod study;
mod summary;
pub(crate) mod tables;
mod trace;
mod trust;
mod watch;

pub(crate) use acceptance::{AcceptanceRecord, AcceptanceResult, PoseAccuracy, TestedTolerance};
pub(crate) use application::{InitResult, PredictionErrors};
pub(crate) use claims::{Claims, at_place};
pub use closed_loop::LoopResult;
pub(crate) use closed_loop::{Gain, Step, Structure, Witness};
pub(crate) use comparison::ComparedFit;
pub(crate) use design::SeparationResult;
pub use document::Document;
use document::schema_of;
pub(crate) use effect::NamedEffect;
pub(crate) use export::Origin;
pub use identification::IdentificationResult;
pub(crate) use knowledge::{
    Knowledge, LargestHarmonics, MAX_LISTED_COEFFICIENTS, MAX_SHOWN_HARMONICS,
};
pub(crate) use parameter_value::ParameterValue;
pub use plots::PlotData;
pub(crate) use plots::{
    BoundAt, Contribution, Point, PoseError, ScriptData, Stage, StageErrors, procedure_stages,
    sample,
};
pub(crate) use remainder::REMAINDER_FILE;
pub(crate) use residual_test::{ResidualSize, exceeds_noise};
pub(crate) use study::Cell;
pub(crate) use summary::{Summary, measured_kinds, nominal_arm, registered_parts, rows_in};
pub(crate) use tables::{
    CommandedJoint, commanded_joints, predictions_csv, residuals_csv, study_timing_csv,
};
pub use trace::TraceResult;
pub(crate) use trace::{Candidate, Confounded, HypothesisSet, SeparatingPose};
#[doc(hidden)]
pub use watch::WatchResult;

pub(crate) use effect::joined;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    alternative::AlternativeEffect,
    application::CompensationResult,
    claims::Hypothesis,
    closed_loop::{Correction, Fit, FoundEffect, Row},
    comparison::ComparisonResult,
    design::{CheckResult, ExpectedParameter, PlanResult},
    effect::Untestable,
    export::{ExportResult, ExportedErrors},
    fleet::FleetResult,
    identification::{Parameter, Spread},
    next::NextResult,
    plots::{Cause, Quantity},
    residual_test::ResidualTest,
    study::{HeldOut, MisprintResult, Reading, StudyResult},
    summary::Errors,
    tables::{Column, commands_csv, poses_csv, residual_columns, study_csv, study_parameters_csv},
};
#[doc(hidden)]
pub use crate::files::{FORMAT_VERSION, PROGRAM};
pub(crate) use tables::pose_columns;
pub(crate) use trust::{Trust, raised_variance};

/// Implements [`Document`] for each result with the name of its format, and lists the schemas.
macro_rules! documents {
    ($($result:ty: $format:literal $($key:ident)?;)+) => {
        $(impl Document for $result {
            const FORMAT: &'static str = $format;
            $(const $key: bool = true;)?
        })+

        /// Returns the name of every format with its JSON Schema.
        #[doc(hidden)]
        pub fn schemas() -> Vec<(&'static str, String)> {
            use crate::{remainder, rig};
            let truth = schema_of::<rig::SavedTruth>(rig::TRUTH_FORMAT, false);
            let correction = schema_of::<remainder::SavedRemainder>(remainder::FORMAT, true);
            vec![
                $(($format, <$result>::schema()),)+
                (rig::TRUTH_FORMAT, truth),
                (remainder::FORMAT, correction),
            ]
        }
    };
}

documents! {
    AcceptanceResult: "flexcal-acceptance";
    CheckResult: "flexcal-check";
    ComparisonResult: "flexcal-compare";
    CompensationResult: "flexcal-compensate";
    ExportResult: "flexcal-export";
    FleetResult: "flexcal-fleet";
    IdentificationResult: "flexcal-estimate" IS_READ_BACK;
    InitResult: "flexcal-init";
    LoopResult: "flexcal-loop";
    MisprintResult: "flexcal-misprints";
    NextResult: "flexcal-next";
    PlanResult: "flexcal-plan";
    PredictionErrors: "flexcal-errors";
    StudyResult: "flexcal-study";
    TraceResult: "flexcal-trace";
    WatchResult: "flexcal-watch";
}
