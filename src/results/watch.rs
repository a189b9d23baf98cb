//! Result of the command `watch`: watch.json.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::Serialize;

use crate::life::{Change, Watch, WatchedCause};
use crate::problem::Problem;
use crate::quantity::Unit;

/// Verdict whether an arm has changed since its estimate.
#[derive(Debug, Serialize, JsonSchema)]
pub struct WatchResult {
    pub problem: String,
    pub estimate: String,
    /// True if the fit of the estimate was trusted.
    pub estimate_trusted: bool,
    pub changed: bool,
    /// Largest probability of any alarm over all rows if nothing has changed.
    pub false_alarm_rate: f64,
    /// Days of drift that "unchanged" allows for.
    pub drift_days: f64,
    pub rows: usize,
    /// Number of rows that were left out, because the estimate was fitted to them.
    pub rows_left_out: usize,
    /// Number of rows up to the first look with an alarm; null without an alarm.
    pub changed_at_row: Option<usize>,
    /// Number of rows up to each evaluation of the evidence (look).
    pub look_rows: Vec<usize>,
    /// Common logarithm of the evidence for a change after each look. A value of at least
    /// −log10(`false_alarm_rate`) raises an alarm.
    pub log10_evidence: Vec<f64>,
    /// χ² of all rows under the assumption that nothing has changed.
    pub chi2: f64,
    pub coordinates: f64,
    pub p_value: f64,
    /// p-value of the rows under the assumption that nothing has changed and nothing drifts; null
    /// without `drift_days`.
    pub p_value_without_drift: Option<f64>,
    /// Root mean square error of the rows as the estimate predicts them, in `unit`.
    pub error: f64,
    /// Standard deviation (1 σ) of a coordinate, from noise and from the misfit of the estimate's
    /// fit, in `unit`.
    pub sigma: f64,
    pub unit: Cow<'static, str>,
    /// Causes of a change, the most probable first.
    pub causes: Vec<CauseResult>,
}

/// Possible cause of a change, with its probability.
#[derive(Debug, Serialize, JsonSchema)]
pub struct CauseResult {
    /// Kind of the cause, such as `joint-zero`, `tool`, `noise` or `row`.
    pub kind: &'static str,
    pub label: String,
    /// Placement that moves the rows in the same way, so that they do not tell the two apart; null
    /// if there is none.
    pub alike: Option<String>,
    /// Row with a gross error, counted from 1 among all rows of the table; null for other causes.
    pub row: Option<usize>,
    /// First row that shows the change, counted from 1; null if it happened before the table.
    pub from_row: Option<usize>,
    /// Probability among all causes, given that something changed.
    pub probability: f64,
    pub changes: Vec<ChangeResult>,
    /// Root mean square error over the rows, in `unit`. Each row is predicted with this cause as
    /// estimated without the row. Null for larger noise and for an unknown change.
    pub left_out_error: Option<f64>,
    /// Number of additional poses like these that are expected to distinguish this cause from the
    /// next one. Null if no number would suffice, or if there is no other cause.
    pub poses_to_tell_apart: Option<usize>,
}

/// Change of a parameter since the estimate, SI; for stiffnesses, change of the logarithm.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ChangeResult {
    pub parameter: String,
    pub unit: Cow<'static, str>,
    pub change: f64,
    pub std_error: Option<f64>,
}

impl WatchResult {
    /// Converts the verdict `watch` on the arm of the file `estimate`; `days` of drift are allowed
    /// for.
    pub fn new(problem: &Problem, estimate: &str, days: f64, watch: &Watch) -> Self {
        let unit = watch.unit.display(0.0);
        let (chi2, coordinates, p_value) = watch.chi2;
        Self {
            problem: problem.name.clone(),
            estimate: estimate.to_owned(),
            estimate_trusted: watch.estimate_trusted,
            changed: watch.is_changed(),
            false_alarm_rate: watch.false_alarm_rate,
            drift_days: days,
            rows: watch.rows,
            rows_left_out: watch.left_out,
            changed_at_row: watch.changed_at,
            look_rows: watch.looks.iter().map(|look| look.0).collect(),
            log10_evidence: watch.looks.iter().map(|look| look.1 / 10_f64.ln()).collect(),
            chi2,
            coordinates,
            p_value,
            p_value_without_drift: watch.p_without_drift,
            error: watch.error * unit.factor,
            sigma: watch.sigma * unit.factor,
            unit: match watch.unit {
                Unit::Angle => "deg".into(),
                Unit::Pixel => "px".into(),
                _ => "mm".into(),
            },
            causes: watch.causes.iter().map(|cause| CauseResult::new(cause, unit.factor)).collect(),
        }
    }
}

impl CauseResult {
    fn new(cause: &WatchedCause, factor: f64) -> Self {
        Self {
            kind: cause.kind.as_str(),
            label: cause.label.clone(),
            alike: cause.alike.clone(),
            row: cause.row.map(|row| row + 1),
            from_row: cause.from_row.map(|row| row + 1),
            probability: cause.probability,
            changes: cause.changes.iter().map(ChangeResult::new).collect(),
            left_out_error: cause.left_out_error.map(|error| error * factor),
            poses_to_tell_apart: cause.poses_to_tell_apart,
        }
    }
}

impl ChangeResult {
    fn new(change: &Change) -> Self {
        Self {
            parameter: change.parameter.clone(),
            unit: if change.unit.is_relative() { "ln".into() } else { change.unit.symbol() },
            change: change.change,
            std_error: Some(change.std_error).filter(|error| error.is_finite()),
        }
    }
}
