//! Remedies for values of another type than their key takes.

use toml::de::DeValue;

use super::item::Item;
use crate::quantity::Unit;

/// Signs of units with the endings of keys that state them.
const UNIT_SIGNS: [(&str, &str); 5] =
    [("°", "deg"), ("degrees", "deg"), ("degree", "deg"), ("°C", "C"), ("pixels", "px")];

impl Item<'_, '_> {
    /// Returns `; ` and the remedy for a value that is not what is `expected`; an empty text if the
    /// value shows none.
    pub(super) fn type_remedy(&self, expected: &str) -> String {
        self.meant(expected).map_or_else(String::new, |remedy| format!("; {remedy}"))
    }

    /// Returns the remedy for a value whose meaning is clear though its type is wrong.
    fn meant(&self, expected: &str) -> Option<String> {
        let key = self.key.rsplit('.').next().unwrap_or_default();
        // Elements of lists have a number and no key.
        let write = |value: &str| match key.split_once('[') {
            None => format!("write {key} = {value}"),
            Some(_) => format!("write {value}"),
        };
        let name = key.split('[').next().unwrap_or_default();
        let is_number = matches!(self.value, DeValue::Integer(_) | DeValue::Float(_));
        match (expected, self.value) {
            ("a whole number", DeValue::String(text))
                if ["joint", "joints", "from", "parent"].contains(&name) =>
            {
                let names = self.names_of("joint", &["name"]);
                let is_meant = |name: &String| !name.is_empty() && *name == text.trim();
                let place = names.iter().position(is_meant);
                Some(match place {
                    Some(place) => {
                        format!("{}, the number of this joint", write(&(place + 1).to_string()))
                    }
                    None => "write the number of the joint, counted from 1".to_owned(),
                })
            }
            ("a number" | "a whole number", DeValue::String(text)) => {
                let text = text.trim();
                let decimal = text.replace(',', ".");
                if decimal.parse().is_ok_and(f64::is_finite) {
                    return Some(format!("a number stands without quotes: {}", write(&decimal)));
                }
                let (number, unit) = number_and_unit(text)?;
                let told = "the end of the key states the unit, and the value is the number alone";
                let written = with_unit(name, number, unit).filter(|_| !key.contains('['));
                Some(written.map_or_else(|| told.to_owned(), |it| format!("{told}: write {it}")))
            }
            ("true or false", DeValue::String(text)) => {
                let word = text.trim().to_lowercase();
                let value = match word.as_str() {
                    "true" | "yes" | "on" => "true",
                    "false" | "no" | "off" => "false",
                    _ => return None,
                };
                Some(format!("without quotes: {}", write(value)))
            }
            ("true or false", DeValue::Integer(number))
                if ["0", "1"].contains(&number.as_str()) =>
            {
                Some(write(if number.as_str() == "1" { "true" } else { "false" }))
            }
            ("a number", DeValue::Array(_))
                if ["min", "max"].contains(&name.split('_').next()?) =>
            {
                let (end, suffix) = name.split_once('_')?;
                let [least, most] = self.pair().ok().filter(|_| ["min", "max"].contains(&end))?;
                Some(format!("write min_{suffix} = {least} and max_{suffix} = {most}"))
            }
            ("a number" | "a whole number", DeValue::Array(list)) => {
                if name == "joint" && self.key.starts_with("effect") && list.len() > 1 {
                    let joints = self.list("").ok()?;
                    return several_joints(&joints);
                }
                let [one] = self.list("").ok()?.try_into().ok()?;
                Some(write(Self::written_number(&one)?))
            }
            ("text in quotes", DeValue::Array(_)) => {
                let [one] = self.list("").ok()?.try_into().ok()?;
                Some(write(&format!("{:?}", Self::any_text(&one).ok()?)))
            }
            ("a table, { key = value }", DeValue::Array(list)) if self.holds_tables() => {
                let header: String = self.key.split(['[', ']']).step_by(2).collect();
                let only = if list.len() > 1 { ", and keep one" } else { "" };
                Some(format!("write its header in single brackets, [{header}]{only}"))
            }
            ("a table, { key = value }", DeValue::String(text))
                if self.key.starts_with("effect") =>
            {
                let number = text.trim_start_matches("joint").trim();
                let names = self.names_of("joint", &["name"]);
                let place = names.iter().position(|name| name == number).map(|place| place + 1);
                let joint = number.parse().ok().or(place)?;
                Some(write(&format!("{{ joint = {joint} }}")))
            }
            ("a table, { key = value }", DeValue::Integer(_)) if self.key.starts_with("effect") => {
                Some(write(&format!("{{ joint = {} }}", self.written_number()?)))
            }
            ("a table, { key = value }", DeValue::Integer(_)) if name == "mimic" => {
                Some(write(&format!("{{ joint = {}, ratio = 1 }}", self.written_number()?)))
            }
            ("text in quotes", _) if name == "link" => Some(self.name_of_a_beam(write)),
            ("text in quotes", DeValue::Integer(number)) if ["on", "at"].contains(&name) => {
                Some(write(&format!("\"joint{}\"", number.as_str())))
            }
            ("text in quotes", DeValue::Integer(_) | DeValue::Float(_)) => {
                Some(write(&format!("\"{}\"", self.written_number()?)))
            }
            (list, DeValue::String(text)) if list.starts_with("a list") => {
                let written = text.trim();
                let text = written.trim_start_matches(['[', '(']).trim_end_matches([']', ')']);
                let words: Vec<&str> =
                    text.split([',', ' ', ';']).filter(|word| !word.is_empty()).collect();
                let is_number = |word: &&str| word.parse().is_ok_and(f64::is_finite);
                let are_numbers = !words.is_empty() && words.iter().all(is_number);
                if list.contains("numbers") {
                    return are_numbers.then(|| write(&format!("[{}]", words.join(", "))));
                }
                let is_of_texts = list.contains("file names") || list.contains("in quotes");
                // What is written must be the whole text, as TOML takes it.
                let is_plain =
                    written.len() <= 60 && !written.contains([',', ';', '\'', '"', '\\']);
                (is_of_texts && is_plain).then(|| write(&format!("[\"{written}\"]")))
            }
            ("a list of 2 numbers", _) if is_number => {
                let number = self.written_number()?;
                Some(format!("if both are alike, {}", write(&format!("[{number}, {number}]"))))
            }
            _ => None,
        }
    }

    /// Returns the remedy for a value that is no name of a beam; `write` completes the key.
    fn name_of_a_beam(&self, write: impl Fn(&str) -> String) -> String {
        let names = self.names_of("joint", &["beam", "name"]);
        let names: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
        match names.first() {
            Some(first) => {
                format!("write the name of a beam, {}: {}", names.join(" or "), write(first))
            }
            None => "write the name of a beam; this arm has none".to_owned(),
        }
    }

    /// Returns this entry with the keys that its key is another name of, where its value shows how
    /// to write it: one file, or both limits. `None` for other entries.
    pub(super) fn renamed(&self, names: &[&str]) -> Option<String> {
        match (names, self.value) {
            (["files"], DeValue::String(file)) => Some(format!("files = [{file:?}]")),
            ([min, max], DeValue::Array(_)) if min.starts_with("min") && max.starts_with("max") => {
                let [least, most] = self.pair().ok()?;
                Some(format!("{min} = {least}, {max} = {most}"))
            }
            _ => None,
        }
    }

    /// Returns the texts at `path` in the tables `[[list]]` of the file that holds this value, in
    /// the order of the file.
    fn names_of(&self, list: &str, path: &[&str]) -> Vec<String> {
        let Ok(root) = self.document.table() else { return Vec::new() };
        let tables = root.get_ref().get(list).and_then(|list| list.get_ref().as_array());
        let name = |table: &toml::Spanned<DeValue<'_>>| {
            let mut value = table.get_ref();
            for key in path {
                value = value.as_table()?.get(*key)?.get_ref();
            }
            value.as_str().map(str::to_owned)
        };
        // A joint without a name keeps its place.
        let names = tables.into_iter().flat_map(|tables| tables.iter());
        if path.len() > 1 {
            return names.filter_map(name).collect();
        }
        names.map(|table| name(table).unwrap_or_default()).collect()
    }
}

/// Returns the remedy for an effect with a list of `joints`; `None` if they are no numbers.
pub(super) fn several_joints(joints: &[Item<'_, '_>]) -> Option<String> {
    let arguments = joints.iter().map(|joint| Some(format!("joint = {}", joint.written_number()?)));
    let arguments = arguments.collect::<Option<Vec<_>>>()?;
    Some(format!("write an [[effect]] for each of them, with {}", arguments.join(" and ")))
}

/// Splits a text into a number and the unit behind it; `None` for other texts.
pub(super) fn number_and_unit(text: &str) -> Option<(&str, &str)> {
    let ends = |(place, c): (usize, char)| {
        let is_exponent = matches!(c, 'e' | 'E')
            && text
                .get(place + 1..)?
                .starts_with(|next: char| next.is_ascii_digit() || next == '-');
        (!(c.is_ascii_digit() || "+-._".contains(c) || is_exponent)).then_some(place)
    };
    let end = text.char_indices().find_map(ends)?;
    let (number, unit) = text.split_at(end);
    let unit = unit.trim();
    let is_unit = (1..=12).contains(&unit.len())
        && unit.chars().all(|c| c.is_alphabetic() || "°%/*·²³\"'′″".contains(c));
    (is_unit && number.parse::<f64>().is_ok()).then_some((number, unit))
}

/// Writes a number with its unit in the ending of the key, as in `d_mm = 360` for `360 mm` under
/// `d_m`; `None` if files do not write the quantity of the key in this unit.
fn with_unit(key: &str, number: &str, unit: &str) -> Option<String> {
    let sign = UNIT_SIGNS.iter().find(|(sign, _)| *sign == unit);
    let unit = sign.map_or(unit, |(_, suffix)| suffix);
    let (base, suffix) = key.rsplit_once('_')?;
    let is_known = suffix == unit || Unit::are_of_one_quantity([suffix, unit]);
    is_known.then(|| format!("{base}_{unit} = {number}"))
}
