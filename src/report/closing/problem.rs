//! `problem.closed.toml`: the problem as its author wrote it, with what was found declared.

use std::path::PathBuf;

use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, RawString, Table, TableLike, TomlError, Value};

use super::super::effect::p;
use crate::diagnosis::{Closure, Found};
use crate::effect::{self, Argument};
use crate::problem::{Effect, Problem};
use crate::study::Estimate;

/// The `text` of `problem` with the effects that were found declared and its data in `files`, as seen from where the text
/// will stand; everything else stays as it was written, comments included.
///
/// # Errors
/// The text is not TOML.
pub fn closed_problem(
    text: &str,
    problem: &Problem,
    closure: &Closure,
    files: &[PathBuf],
) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    if let Some(data) = document.get_mut("data").and_then(Item::as_table_like_mut) {
        name_files(data, files);
    }
    // The loop keeps what was declared in its order, gives it further orders at most, and adds behind it.
    let declared = problem.effects.len();
    for (k, effect) in closure.closed.effects.iter().map(|declared| &declared.effect).enumerate() {
        let found = closure.effects.iter().find(|found| found.effect == *effect);
        if k >= declared {
            add(&mut document, effect, &found.map(comments).unwrap_or_default());
        } else if problem.effects[k].effect != *effect {
            replace(&mut document, k, effect);
        }
    }
    Ok(document.to_string())
}

/// Writes the names of the data files.
fn name_files(data: &mut dyn TableLike, files: &[PathBuf]) {
    let slashes = |file: &PathBuf| file.to_string_lossy().replace(std::path::MAIN_SEPARATOR, "/");
    let mut names = Value::Array(files.iter().map(slashes).collect());
    match data.get_mut("files") {
        Some(Item::Value(known)) => {
            *names.decor_mut() = known.decor().clone();
            *known = names;
        }
        _ => _ = data.insert("files", Item::Value(names)),
    }
}

/// Appends an effect with comments above it.
fn add(document: &mut DocumentMut, effect: &Effect, comments: &[String]) {
    let lines: String = comments.iter().map(|line| format!("# {line}\n")).collect();
    if let Some(Item::Value(Value::Array(known))) = document.get_mut("effect") {
        let mut value = Value::InlineTable(InlineTable::from_iter([(effect::name(effect), arguments(effect))]));
        value.decor_mut().set_prefix(format!("\n{lines}"));
        known.push_formatted(value);
        return;
    }
    // What stands at the end of the file stays before what is added.
    let rest = document.trailing().as_str().unwrap_or_default().to_owned();
    document.set_trailing(RawString::default());
    let mut table = Table::new();
    table.insert(effect::name(effect), Item::Value(arguments(effect)));
    table.decor_mut().set_prefix(format!("{rest}\n{lines}"));
    let last = document.iter().map(|(_, item)| last_position(item)).max().unwrap_or(0);
    table.set_position(Some(last + 1));
    let known = document.entry("effect").or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    if let Some(known) = known.as_array_of_tables_mut() {
        known.push(table);
    }
}

/// The last place in the file where one of an item's tables stands.
fn last_position(item: &Item) -> isize {
    let of_table = |table: &Table| {
        let below = table.iter().map(|(_, item)| last_position(item)).max();
        table.position().unwrap_or(0).max(below.unwrap_or(0))
    };
    match item {
        Item::Table(table) => of_table(table),
        Item::ArrayOfTables(tables) => tables.iter().map(of_table).max().unwrap_or(0),
        Item::None | Item::Value(_) => 0,
    }
}

/// Gives the effect that was declared as number `k` other arguments.
fn replace(document: &mut DocumentMut, k: usize, effect: &Effect) {
    let declared: Option<&mut dyn TableLike> = match document.get_mut("effect") {
        Some(Item::ArrayOfTables(tables)) => tables.get_mut(k).map(|table| table as &mut dyn TableLike),
        Some(Item::Value(Value::Array(values))) => {
            values.get_mut(k).and_then(Value::as_inline_table_mut).map(|table| table as &mut dyn TableLike)
        }
        _ => None,
    };
    if let Some(declared) = declared {
        declared.insert(effect::name(effect), Item::Value(arguments(effect)));
    }
}

/// The arguments of an effect; `true` stands for none.
fn arguments(effect: &Effect) -> Value {
    let arguments = effect::arguments(effect);
    if arguments.is_empty() {
        return Value::from(true);
    }
    let whole = |number: usize| Value::from(i64::try_from(number).unwrap_or(i64::MAX));
    let value = |(key, argument): (&'static str, Argument)| {
        let value = match argument {
            Argument::Joint(joint) => whole(joint),
            Argument::Orders(orders) => Value::Array(orders.into_iter().map(i64::from).collect::<Array>()),
            Argument::Link(link) => Value::from(link),
            Argument::Time(time) => Value::from(time),
        };
        (key, value)
    };
    Value::InlineTable(arguments.into_iter().map(value).collect())
}

/// What is known of an effect that was found, line by line.
fn comments(found: &Found) -> Vec<String> {
    let first = format!("Found by flexcal loop: {}, {}.", effect::describe(&found.effect), p(found.p_value));
    let line = |estimate: &Estimate| {
        let unit = estimate.unit.symbol();
        match estimate.std_error {
            Some(error) => format!("{} = {:.4e} ± {error:.1e} {unit}", estimate.name, estimate.estimate),
            None => format!("{} = {:.4e} {unit}", estimate.name, estimate.estimate),
        }
    };
    std::iter::once(first).chain(found.estimates.iter().map(line)).collect()
}
