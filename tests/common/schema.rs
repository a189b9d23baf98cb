//! Validation of JSON against the keywords of JSON Schema that docs/schema/ uses.

use serde_json::Value;

/// Keywords that only annotate.
const ANNOTATIONS: [&str; 5] = ["$schema", "$defs", "title", "description", "default"];

/// Asserts that a JSON text satisfies the JSON text of a schema.
pub fn assert_valid(schema: &str, json: &str) {
    let (schema, value) =
        (serde_json::from_str(schema).unwrap(), serde_json::from_str(json).unwrap());
    assert_eq!(violations(&schema, &value), Vec::<String>::new());
}

/// Lists the places at which a value violates a schema; panics at a keyword that it does not know.
pub fn violations(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    validate(schema, schema, value, "", &mut found);
    found
}

fn validate(root: &Value, schema: &Value, value: &Value, at: &str, found: &mut Vec<String>) {
    let Some(keywords) = schema.as_object() else { return };
    let holds = |schema: &Value| {
        let mut inner = Vec::new();
        validate(root, schema, value, at, &mut inner);
        inner.is_empty()
    };
    for (keyword, rule) in keywords {
        let passes = match keyword.as_str() {
            "$ref" => {
                let pointer = rule.as_str().unwrap().trim_start_matches('#');
                validate(root, root.pointer(pointer).unwrap(), value, at, found);
                true
            }
            "type" => match rule {
                Value::Array(types) => types.iter().any(|name| is_of(value, name)),
                name => is_of(value, name),
            },
            "const" => value == rule,
            "enum" => rule.as_array().unwrap().contains(value),
            "anyOf" => rule.as_array().unwrap().iter().any(holds),
            "oneOf" => rule.as_array().unwrap().iter().filter(|option| holds(option)).count() == 1,
            "allOf" => rule.as_array().unwrap().iter().all(holds),
            "required" => rule
                .as_array()
                .unwrap()
                .iter()
                .all(|key| value.get(key.as_str().unwrap()).is_some()),
            "properties" => {
                for (key, schema) in rule.as_object().unwrap() {
                    if let Some(value) = value.get(key) {
                        validate(root, schema, value, &format!("{at}/{key}"), found);
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = keywords.get("properties").and_then(Value::as_object);
                for (key, value) in value.as_object().into_iter().flatten() {
                    if known.is_none_or(|known| !known.contains_key(key)) {
                        validate(root, rule, value, &format!("{at}/{key}"), found);
                    }
                }
                true
            }
            "items" => {
                let first =
                    keywords.get("prefixItems").map_or(0, |items| items.as_array().unwrap().len());
                for (k, value) in value.as_array().into_iter().flatten().enumerate().skip(first) {
                    validate(root, rule, value, &format!("{at}/{k}"), found);
                }
                true
            }
            "prefixItems" => {
                let items = value.as_array().into_iter().flatten();
                for (k, (schema, value)) in rule.as_array().unwrap().iter().zip(items).enumerate() {
                    validate(root, schema, value, &format!("{at}/{k}"), found);
                }
                true
            }
            "minimum" => value.as_f64().is_none_or(|number| number >= rule.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|number| number <= rule.as_f64().unwrap()),
            "minItems" => value.as_array().is_none_or(|items| items.len() >= length(rule)),
            "maxItems" => value.as_array().is_none_or(|items| items.len() <= length(rule)),
            other => {
                assert!(ANNOTATIONS.contains(&other), "unknown keyword {other}");
                true
            }
        };
        if !passes {
            found.push(format!("{at}: {keyword} {rule}"));
        }
    }
}

fn length(rule: &Value) -> usize {
    usize::try_from(rule.as_u64().unwrap()).unwrap()
}

fn is_of(value: &Value, kind: &Value) -> bool {
    match kind.as_str().unwrap() {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => false,
    }
}
