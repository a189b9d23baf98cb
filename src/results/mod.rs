//! Results as data: one struct for every JSON file that flexcal writes.
//!
//! Every file begins with its `format` and the `program` ([`Document`]); docs/schema/ has the JSON
//! Schema of each. Sentences, reports and the Python package state what these structs hold.

#![expect(
    missing_docs,
    reason = "a field bears the name of its key; it has a comment where docs/results.md says more than the name"
)]

mod acceptance;
mod application;
mod claims;
mod closed_loop;
mod comparison;
mod design;
mod document;
mod effect;
mod identification;
mod remainder;
mod residual_test;
mod study;
mod summary;
mod trace;

pub use acceptance::{AcceptanceResult, Condition, Input, PoseAccuracy};
pub use application::{
    CompensationResult, ExportResult, ExportedErrors, InitResult, Origin, PredictionErrors,
    SpreadAtPoint,
};
pub use claims::{Claim, Claims, Hypothesis};
pub use closed_loop::{
    Correction, Fit, FoundEffect, Gain, LoopResult, OrderPrior, ParameterValue, Row, Step,
    Structure, Witness,
};
pub use comparison::{
    AblatedFit, ComparedFit, ComparisonResult, GeometryValue, HeldOutErrors, JointGeometry,
    PoseErrors, Procedure,
};
pub use design::{
    CheckResult, Detectable, DetectableEffect, DetectableSize, ExpectedParameter, GrowthStep,
    JudgedPrediction, PlanResult, PlannedParameter, PredictionError, SeparatedEffect,
    SeparationResult,
};
pub use document::{Document, FORMAT_VERSION, PROGRAM};
pub use effect::{NamedEffect, Untestable};
pub use identification::{
    Alternation, Combination, Conditioning, Constraint, Correlation, IdentificationResult,
    InfluentialRowSet, Orientation, OutlierRow, Parameter, Price, Spread, SpreadChange,
};
pub use remainder::{BoundSummary, REMAINDER_FILE, Remainder};
pub use residual_test::ResidualTest;
pub use study::{
    Cell, HeldOut, LargestBias, MisprintResult, MisprintSize, Reading, Rival, Specimen,
    StudiedCase, StudiedParameter, StudyResult,
};
pub use summary::{Axes, Errors, KindErrors, Sizes, Summary};
pub use trace::{Candidate, Confounded, HypothesisSet, ToldApart, TraceResult};

pub(crate) use effect::joined;

/// Name of every format with its JSON Schema.
pub fn schemas() -> Vec<(&'static str, String)> {
    macro_rules! schemas {
        ($($document:ty),+ $(,)?) => { vec![$((<$document>::FORMAT, <$document>::schema())),+] };
    }
    schemas![
        AcceptanceResult,
        CheckResult,
        ComparisonResult,
        CompensationResult,
        ExportResult,
        IdentificationResult,
        InitResult,
        LoopResult,
        MisprintResult,
        PlanResult,
        PredictionErrors,
        StudyResult,
        TraceResult,
    ]
}
