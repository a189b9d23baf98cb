//! What the JSON of several commands has in common: errors, conditioning, unidentified
//! combinations.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::fit::{AxisValues, ErrorSummary, Errors, PointSpread};
use crate::least_squares::{Identifiability, UnidentifiableCombination};

/// A JSON object: its keys and their values in the order of the file. `..other` stands for the keys
/// of another object, `?key: value` for a key that is left out where there is no value.
macro_rules! object {
    ($($key:ident: $value:expr),* $(,)?) => {{
        #[allow(non_camel_case_types, non_snake_case, reason = "keys of the file, the value of each of a type called as it is")]
        mod keys {
            #[derive(serde::Serialize)]
            pub struct Object<$($key),*> { $(pub $key: $key),* }
        }
        keys::Object { $($key: $value),* }
    }};
    ($($key:ident: $value:expr,)* ..$other:expr $(, $($rest:tt)*)?) => {{
        #[allow(non_camel_case_types, non_snake_case, reason = "as above")]
        mod keys {
            #[derive(serde::Serialize)]
            pub struct Object<$($key,)* Other, Rest> {
                $(pub $key: $key,)*
                #[serde(flatten)]
                pub other: Other,
                #[serde(flatten)]
                pub rest: Rest,
            }
        }
        keys::Object { $($key: $value,)* other: $other, rest: object! { $($($rest)*)? } }
    }};
    ($($key:ident: $value:expr,)* ?$optional:ident: $of:expr $(, $($rest:tt)*)?) => {
        object! { $($key: $value,)* ..$crate::report::json::optional(stringify!($optional), $of) $(, $($rest)*)? }
    };
}
pub(super) use object;

/// A key that is left out where there is no value.
pub(super) fn optional<T>(
    key: &'static str,
    value: Option<T>,
) -> Option<BTreeMap<&'static str, T>> {
    value.map(|value| BTreeMap::from([(key, value)]))
}

/// A key of errors whose ending says what they are in: `mean_mm`, or `mean_deg` of angles.
pub(super) fn keyed<T>(key: &str, is_angle: bool, value: T) -> BTreeMap<String, T> {
    BTreeMap::from([(format!("{key}_{}", if is_angle { "deg" } else { "mm" }), value)])
}

/// An entry for each of several things.
pub(super) fn list<T, S>(of: impl IntoIterator<Item = T>, entry: impl FnMut(T) -> S) -> Vec<S> {
    of.into_iter().map(entry).collect()
}

/// A list or map that has entries.
pub(super) fn unless_empty<T>(all: T) -> Option<T>
where
    for<'a> &'a T: IntoIterator,
{
    let is_empty = (&all).into_iter().next().is_none();
    (!is_empty).then_some(all)
}

/// An error summary.
pub(super) fn summary(of: &ErrorSummary) -> impl Serialize + use<> {
    object! {
        // Left out where it is that of positions.
        ?kind: Some(of.kind).filter(|kind| !matches!(*kind, "" | "position")),
        ..sizes(of, of.is_angle()),
    }
}

/// The sizes of errors along each axis and of their length, in mm or °.
pub(super) fn sizes(of: &ErrorSummary, is_angle: bool) -> impl Serialize + use<> {
    let in_unit = |value: f64| if is_angle { value.to_degrees() } else { value * 1e3 };
    let axes = |values: &AxisValues| {
        let [x, y, z, norm] = [values.x, values.y, values.z, values.norm].map(in_unit);
        object! { x: x, y: y, z: z, norm: norm }
    };
    object! {
        n: of.n,
        ..keyed("mean", is_angle, axes(&of.mean)),
        ..keyed("max", is_angle, axes(&of.max)),
        ..keyed("rms", is_angle, axes(&of.rms)),
    }
}

/// Error summaries of both kinds of poses.
pub(super) fn both(errors: &Errors) -> impl Serialize + use<> {
    object! { identification: summary(&errors.identification), held_out: summary(&errors.held_out) }
}

/// Errors of one kind of rows before and after.
pub(super) fn kind((registered, fitted): &(Errors, Errors)) -> impl Serialize + use<> {
    object! { registered: both(registered), ..both(fitted) }
}

/// The spread of the target at a point: its mean, where it is largest, and the part of its squares
/// there.
pub(super) fn spread(point: &PointSpread) -> impl Serialize + use<> {
    object! { mean_mm: point.mean * 1e3, along: <[f64; 3]>::from(point.along), share: point.share }
}

/// What poses tell of parameters.
pub(super) fn conditioning(found: &Identifiability, coordinates: usize) -> impl Serialize + use<> {
    let observability =
        ["O1", "O2", "O3", "O4", "O5"].into_iter().zip(found.observability(coordinates));
    object! {
        condition_number: found.condition_number(),
        observability: observability.collect::<BTreeMap<_, _>>(),
    }
}

/// Combinations that no measurement sees, or too weakly, by the names of the unknowns.
pub(super) fn unidentified<'a>(
    all: &[UnidentifiableCombination],
    name: impl Fn(usize) -> &'a str,
) -> Vec<impl Serialize> {
    list(all, |own| {
        let weights: BTreeMap<&str, f64> =
            own.weights.iter().map(|&(k, weight)| (name(k), weight)).collect();
        object! { combination: weights, singular_value: own.singular_value }
    })
}

/// JSON text that ends in a line break; text keys and numbers always serialise, numbers that are
/// not finite as null.
pub(super) fn to_text(document: &impl Serialize) -> String {
    let mut text = serde_json::to_string_pretty(document).unwrap_or_default();
    text.push('\n');
    text
}
