//! What the JSON of several commands has in common: errors, conditioning, unidentified combinations.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::identify::{AxisValues, ErrorSummary, Errors, PointSpread};
use crate::least_squares::{Identifiability, UnidentifiableCombination};

/// Declares a JSON object: its keys with their types and what each is made of, in the order of the file.
macro_rules! object {
    ($(#[$meta:meta])* $name:ident $(<$a:lifetime>)? ($($argument:ident: $of:ty),* $(,)?) {
        $($(#[$attribute:meta])* $key:ident: $type:ty = $value:expr,)*
    }) => {
        $(#[$meta])*
        #[derive(Debug, serde::Serialize)]
        #[allow(clippy::struct_field_names, reason = "keys of the file")]
        pub(in crate::report) struct $name $(<$a>)? { $($(#[$attribute])* $key: $type,)* }

        impl $(<$a>)? $name $(<$a>)? {
            pub fn of($($argument: $of),*) -> Self {
                Self { $($key: $value,)* }
            }
        }
    };
}
pub(super) use object;

object! {
    /// Of each axis and of the length \[mm\].
    Axes(values: &AxisValues) {
        x: f64 = values.x * 1e3,
        y: f64 = values.y * 1e3,
        z: f64 = values.z * 1e3,
        norm: f64 = values.norm * 1e3,
    }
}
object! {
    /// Of each axis and of the length \[°\].
    Degrees(values: &AxisValues) {
        x: f64 = values.x.to_degrees(),
        y: f64 = values.y.to_degrees(),
        z: f64 = values.z.to_degrees(),
        norm: f64 = values.norm.to_degrees(),
    }
}
object! {
    Lengths(summary: &ErrorSummary) {
        mean_mm: Axes = Axes::of(&summary.mean),
        max_mm: Axes = Axes::of(&summary.max),
        rms_mm: Axes = Axes::of(&summary.rms),
    }
}
object! {
    Angles(summary: &ErrorSummary) {
        mean_deg: Degrees = Degrees::of(&summary.mean),
        max_deg: Degrees = Degrees::of(&summary.max),
        rms_deg: Degrees = Degrees::of(&summary.rms),
    }
}
object! {
    /// An error summary.
    Summary(summary: &ErrorSummary) {
        /// Left out where it is that of positions.
        #[serde(skip_serializing_if = "Option::is_none")]
        kind: Option<&'static str> = Some(summary.kind).filter(|kind| !matches!(*kind, "" | "position")),
        n: usize = summary.n,
        #[serde(flatten)]
        lengths: Option<Lengths> = (!summary.is_angle()).then(|| Lengths::of(summary)),
        #[serde(flatten)]
        angles: Option<Angles> = summary.is_angle().then(|| Angles::of(summary)),
    }
}
object! {
    /// The spread of the target at a point.
    Spread(point: &PointSpread) {
        n: usize = point.n,
        mean_mm: f64 = point.mean * 1e3,
        along: [f64; 3] = point.along.into(),
        share: f64 = point.share,
    }
}
object! {
    /// The same with the nominal and with the identified arm.
    SpreadChange(of: &(PointSpread, PointSpread, bool)) {
        n: usize = of.0.n,
        held_out: bool = of.2,
        registered_mm: f64 = of.0.mean * 1e3,
        mean_mm: f64 = of.1.mean * 1e3,
        /// Where the spread is largest, and the part of its squares there.
        along: [f64; 3] = of.1.along.into(),
        share: f64 = of.1.share,
    }
}
object! {
    /// Errors of one kind of rows before and after.
    Kind(of: &(Errors, Errors)) {
        registered: Both = Both::of(&of.0),
        #[serde(flatten)]
        fitted: Both = Both::of(&of.1),
    }
}
object! {
    /// Error summaries of both kinds of poses.
    Both(errors: &Errors) {
        identification: Summary = Summary::of(&errors.identification),
        held_out: Summary = Summary::of(&errors.held_out),
    }
}
object! {
    /// What poses tell of parameters.
    Conditioning<'a>(found: &Identifiability, coordinates: usize) {
        condition_number: f64 = found.condition_number(),
        observability: BTreeMap<&'a str, f64> =
            ["O1", "O2", "O3", "O4", "O5"].into_iter().zip(found.observability(coordinates)).collect(),
    }
}
object! {
    /// A combination that no measurement sees.
    Unidentified<'a>(own: &UnidentifiableCombination, name: impl Fn(usize) -> &'a str) {
        combination: BTreeMap<&'a str, f64> = own.weights.iter().map(|&(k, weight)| (name(k), weight)).collect(),
        singular_value: f64 = own.singular_value,
    }
}

/// Every unidentified combination, by the names of the unknowns.
pub(super) fn unidentified<'a>(found: &Identifiability, name: impl Fn(usize) -> &'a str) -> Vec<Unidentified<'a>> {
    found.unidentifiable.iter().map(|own| Unidentified::of(own, &name)).collect()
}

/// JSON text that ends in a line break; text keys and numbers always serialise, numbers that are not finite as null.
pub(super) fn to_text(document: &impl Serialize) -> String {
    let mut text = serde_json::to_string_pretty(document).unwrap_or_default();
    text.push('\n');
    text
}
