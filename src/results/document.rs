//! Head of every JSON result, and its JSON Schema.

use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform as _};
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::value::{RawValue, to_raw_value};
use serde_json::{Value, json};

use crate::files::{DIGEST_KEY, FORMAT_VERSION, Format, PROGRAM, sealed};

/// Result that is written as a JSON document, with the name and the schema of its format.
pub trait Document: Serialize + JsonSchema + Sized {
    /// Name of the format, for example `flexcal-loop`.
    const FORMAT: &'static str;

    /// True if flexcal reads the files back. They then end in a digest of each key, by which later
    /// changes are detected.
    const IS_READ_BACK: bool = false;

    /// Returns the JSON text of the result, ending in a line break: `format` and `program` first,
    /// then the fields of the result. Numbers that are not finite are written as null.
    fn to_json(&self) -> String {
        let format = Format::current(Self::FORMAT);
        let file = File { format, program: PROGRAM, content: self };
        let mut text = serde_json::to_string_pretty(&file).unwrap_or_default();
        text.push('\n');
        if Self::IS_READ_BACK { sealed(&text) } else { text }
    }

    /// Returns the JSON Schema (draft 2020-12) of the format, ending in a line break.
    fn schema() -> String {
        schema_of::<File<Self>>(Self::FORMAT, Self::IS_READ_BACK)
    }
}

/// Returns the JSON Schema (draft 2020-12) of the format with this name, whose files hold a `T`,
/// ending in a line break. `is_sealed` is true if the files end in a digest of each key.
pub(super) fn schema_of<T: JsonSchema>(name: &'static str, is_sealed: bool) -> String {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    completed(settings.into_generator().into_root_schema_for::<T>(), name, is_sealed)
}

/// Completes a generated schema for [`schema_of`].
fn completed(mut schema: Schema, name: &'static str, is_sealed: bool) -> String {
    RecursiveTransform(allow_null_numbers).transform(&mut schema);
    schema.remove("description");
    schema.insert("title".to_owned(), name.into());
    if let Some(format) = schema.pointer_mut("/$defs/Format/properties") {
        *format = json!({ "name": { "const": name }, "version": { "const": FORMAT_VERSION } });
    }
    if is_sealed && let Some(Value::Object(properties)) = schema.get_mut("properties") {
        let digests = json!({
            "description": "Digest of the value of each other key.",
            "type": "object",
            "additionalProperties": { "type": "string" }
        });
        properties.insert(DIGEST_KEY.to_owned(), digests);
    }
    let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
    text.push('\n');
    text
}

/// Returns the rows of an n × n matrix with the entries `entry`, each as one line of JSON text.
pub(super) fn json_rows<T: Serialize>(
    n: usize,
    entry: impl Fn(usize, usize) -> T,
) -> Vec<Box<RawValue>> {
    let rows = (0..n).map(|j| (0..n).map(|k| entry(j, k)).collect::<Vec<_>>());
    rows.filter_map(|row| to_raw_value(&row).ok()).collect()
}

/// Result with its format and program, as written to a file.
#[derive(Serialize, JsonSchema)]
struct File<T> {
    format: Format,
    /// Program and version that wrote the file.
    program: &'static str,
    #[serde(flatten)]
    content: T,
}

/// Allows every number to be null, because numbers that are not finite are written as null. Removes
/// annotations of Rust types such as `"format": "double"`.
fn allow_null_numbers(schema: &mut Schema) {
    schema.remove("format");
    if schema.get("type").and_then(Value::as_str) == Some("number") {
        schema.insert("type".to_owned(), json!(["number", "null"]));
    }
}
