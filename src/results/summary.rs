//! Error summaries: mean, largest and root mean square errors of the rows of one kind.

use schemars::JsonSchema;
use serde::Serialize;

use crate::fit::{self, AxisValues, ErrorSummary, Identification};
use crate::quantity::Unit;

/// Statistic of errors: along each axis of the measuring frame, and of their Euclidean norm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Axes {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub norm: f64,
}

/// Error summary of the rows of one kind. The keys of the errors contain their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Kind of the rows; absent for measured positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<&'static str>,
    /// Number of rows summarised.
    pub n: usize,
    #[serde(flatten)]
    pub sizes: Sizes,
}

/// Mean absolute error, largest absolute error and root mean square error, along each axis and of
/// the Euclidean norm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Sizes {
    Lengths {
        mean_mm: Axes,
        max_mm: Axes,
        rms_mm: Axes,
    },
    Angles {
        mean_deg: Axes,
        max_deg: Axes,
        rms_deg: Axes,
    },
    /// Image errors, with the same errors converted to lengths at the observed points.
    Pixels {
        mean_px: Axes,
        max_px: Axes,
        rms_px: Axes,
        mean_mm: Option<Axes>,
        max_mm: Option<Axes>,
        rms_mm: Option<Axes>,
    },
}

impl Summary {
    /// Creates the summary of `errors` in the unit of their kind of rows: mm for lengths, ° for
    /// angles, px for image errors.
    pub fn of(errors: &ErrorSummary) -> Self {
        let kind = Some(errors.kind).filter(|kind| !matches!(*kind, "" | "position"));
        Self { kind, n: errors.n, sizes: Sizes::of(errors, errors.unit()) }
    }

    /// Returns mean, root mean square and largest value of the error's norm, and their unit.
    pub fn norms(&self) -> ([f64; 3], &'static str) {
        let (axes, unit) = match &self.sizes {
            Sizes::Lengths { mean_mm, max_mm, rms_mm } => ([mean_mm, rms_mm, max_mm], "mm"),
            Sizes::Angles { mean_deg, max_deg, rms_deg } => ([mean_deg, rms_deg, max_deg], "°"),
            Sizes::Pixels { mean_px, max_px, rms_px, .. } => ([mean_px, rms_px, max_px], "px"),
        };
        (axes.map(|axes| axes.norm), unit)
    }
}

impl Sizes {
    /// Converts statistics of errors, whose `unit` is m, rad or px, to mm, ° or px.
    fn of(errors: &ErrorSummary, unit: Unit) -> Self {
        let axes = |values: &AxisValues, factor: f64| {
            let [x, y, z, norm] =
                [values.x, values.y, values.z, values.norm].map(|value| value * factor);
            Axes { x, y, z, norm }
        };
        let [mean, max, rms] = [&errors.mean, &errors.max, &errors.rms]
            .map(|values| axes(values, unit.in_tables().factor));
        match unit {
            Unit::Pixel => {
                let millimetres = Unit::Length.in_tables().factor;
                let at_point = errors.at_point.map(|sizes| sizes.map(|of| axes(&of, millimetres)));
                let at_point = |k: usize| at_point.map(|sizes| sizes[k]);
                let (mean_mm, max_mm, rms_mm) = (at_point(0), at_point(1), at_point(2));
                Self::Pixels { mean_px: mean, max_px: max, rms_px: rms, mean_mm, max_mm, rms_mm }
            }
            Unit::Angle => Self::Angles { mean_deg: mean, max_deg: max, rms_deg: rms },
            _ => Self::Lengths { mean_mm: mean, max_mm: max, rms_mm: rms },
        }
    }
}

/// Error summaries of the fitted rows and of the rows that test the fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Errors {
    pub identification: Summary,
    /// Errors of held-out rows; absent if none is held out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<Summary>,
    /// Errors of all rows, each configuration predicted by a fit without it; absent if rows are
    /// held out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out: Option<Summary>,
}

impl Errors {
    /// Creates the summaries of the fitted rows and of the rows that test the fit.
    pub fn of(errors: &fit::Errors) -> Self {
        let judged = Summary::of(&errors.held_out);
        Self::new(Summary::of(&errors.identification), judged, errors.is_left_out)
    }

    /// Creates the errors from the summary of the fitted rows and from that of the rows that test
    /// the fit (`judged`). These are held out or, if `is_left_out`, left out in turn.
    pub(super) fn new(identification: Summary, judged: Summary, is_left_out: bool) -> Self {
        let (held_out, left_out) =
            if is_left_out { (None, Some(judged)) } else { (Some(judged), None) };
        Self { identification, held_out, left_out }
    }

    /// Returns the errors of the rows that test the fit: held-out rows, or rows left out in turn.
    /// If there are neither, returns the errors of the fitted rows.
    pub fn judged(&self) -> &Summary {
        self.held_out.as_ref().or(self.left_out.as_ref()).unwrap_or(&self.identification)
    }

    /// Creates both summaries of orientation errors \[rad\] in °; the kind of the rows is not
    /// stated.
    pub(super) fn of_angles(errors: &fit::Errors) -> Self {
        let of = |errors: &ErrorSummary| Summary {
            kind: None,
            n: errors.n,
            sizes: Sizes::of(errors, Unit::Angle),
        };
        let judged = of(&errors.held_out);
        Self::new(of(&errors.identification), judged, errors.is_left_out)
    }
}

/// Errors of the rows of one kind, for the registered nominal arm and for the fitted arm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct KindErrors {
    pub registered: Errors,
    #[serde(flatten)]
    pub fitted: Errors,
}

impl KindErrors {
    /// Lists the errors of each kind of rows, given for the registered nominal arm and for the
    /// fitted arm.
    pub(super) fn all(kinds: &[(fit::Errors, fit::Errors)]) -> Vec<Self> {
        let of = |(registered, fitted): &(fit::Errors, fit::Errors)| Self {
            registered: Errors::of(registered),
            fitted: Errors::of(fitted),
        };
        kinds.iter().map(of).collect()
    }
}

/// Returns a value \[m\], \[rad\] or \[px\] in the entry for `…_mm`, `…_deg` or `…_px`, converted
/// to that unit; the others are `None`.
pub(super) fn in_mm_deg_px(unit: Unit, value: f64) -> (Option<f64>, Option<f64>, Option<f64>) {
    let value = value * unit.in_tables().factor;
    let only = |wanted: Unit| (unit == wanted).then_some(value);
    (only(Unit::Length), only(Unit::Angle), only(Unit::Pixel))
}

/// Describes the registered nominal arm by the parts that were fitted in it: "nominal arm, base and
/// tool fitted".
pub(crate) fn nominal_arm(found: &Identification) -> String {
    match registered_parts(found) {
        Some(parts) => format!("nominal arm, {parts} fitted"),
        None => "nominal arm".to_owned(),
    }
}

/// Lists the parts that were fitted in the registered nominal arm: "base and tool"; `None` if no
/// part was fitted.
pub(crate) fn registered_parts(found: &Identification) -> Option<String> {
    let (last, first) = found.registered_parts.split_last()?;
    Some(if first.is_empty() {
        (*last).to_owned()
    } else {
        format!("{} and {last}", first.join(", "))
    })
}

/// Returns the number of rows of all kinds in one part of the data (identification or held out),
/// without known distances.
pub(crate) fn rows_in(found: &Identification, part: fn(&fit::Errors) -> ErrorSummary) -> usize {
    measured_kinds(found, part).map(|of| of.n).sum()
}

/// Iterates over the error summaries of the kinds of rows in one part of the data (identification
/// or held out), without known distances.
pub(crate) fn measured_kinds(
    found: &Identification,
    part: fn(&fit::Errors) -> ErrorSummary,
) -> impl Iterator<Item = ErrorSummary> + use<'_> {
    let only_kind = found.kinds.is_empty().then(|| part(&found.fitted));
    let several_kinds = found
        .kinds
        .iter()
        .map(move |(_, fitted)| part(fitted))
        .filter(|of| of.kind != "known distance");
    only_kind.into_iter().chain(several_kinds)
}
