//! Edits of the text of a problem file. Everything else, including comments, is unchanged.

use std::path::PathBuf;

use toml_edit::{
    ArrayOfTables, DocumentMut, InlineTable, Item, RawString, Table, TableLike, TomlError, Value,
};

use super::{Argument, Effect};

/// Replaces the `declared` effects of the text by the `closed` ones (declared and found). Found
/// effects come with lines of comment.
///
/// The `closed` effects begin with the declared ones in their order, possibly with more harmonics.
/// `files` are the new lists of files of measurements and of joint tables.
///
/// # Errors
/// Returns an error if the text is not TOML.
pub(crate) fn with_effects(
    text: &str,
    declared: &[Effect],
    closed: &[(Effect, Vec<String>)],
    files: [&[PathBuf]; 2],
) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    if let Some(data) = document.get_mut("data").and_then(Item::as_table_like_mut) {
        set_files(data, files[0]);
        if let Some(joints) = data.get_mut("joints").and_then(Item::as_table_like_mut) {
            set_files(joints, files[1]);
        }
    }
    for (k, (effect, comments)) in closed.iter().enumerate() {
        match declared.get(k) {
            Some(known) if known == effect => {}
            Some(_) => replace_arguments(&mut document, k, effect),
            None => append_effect(&mut document, effect, comments),
        }
    }
    Ok(document.to_string())
}

/// Replaces the list of files in a table, `[data]` or its `joints`.
fn set_files(data: &mut dyn TableLike, files: &[PathBuf]) {
    let slashes = |file: &PathBuf| file.to_string_lossy().replace(std::path::MAIN_SEPARATOR, "/");
    let mut names = Value::Array(files.iter().map(slashes).collect());
    match data.get_mut("files") {
        Some(Item::Value(current)) => {
            *names.decor_mut() = current.decor().clone();
            *current = names;
        }
        _ => _ = data.insert("files", Item::Value(names)),
    }
}

/// Appends an effect to the document, below its comments.
fn append_effect(document: &mut DocumentMut, effect: &Effect, comments: &[String]) {
    let lines: String = comments.iter().flat_map(|line| ["# ", line, "\n"]).collect();
    if let Some(Item::Value(Value::Array(known))) = document.get_mut("effect") {
        let mut value =
            Value::InlineTable(InlineTable::from_iter([(effect.name(), toml_arguments(effect))]));
        value.decor_mut().set_prefix(format!("\n{lines}"));
        known.push_formatted(value);
        return;
    }
    // Text at the end of the file stays before the added effects.
    let trailing = document.trailing().as_str().unwrap_or_default().to_owned();
    document.set_trailing(RawString::default());
    let mut table = Table::new();
    table.insert(effect.name(), Item::Value(toml_arguments(effect)));
    table.decor_mut().set_prefix(format!("{trailing}\n{lines}"));
    let last = document.iter().map(|(_, item)| last_position(item)).max().unwrap_or(0);
    table.set_position(Some(last + 1));
    let effects =
        document.entry("effect").or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    if let Some(tables) = effects.as_array_of_tables_mut() {
        tables.push(table);
    }
}

/// Returns the position in the document of the last table of an item, 0 without a table.
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

/// Replaces the arguments of the declared effect with index `k` by those of `effect`.
fn replace_arguments(document: &mut DocumentMut, k: usize, effect: &Effect) {
    let declared: Option<&mut dyn TableLike> = match document.get_mut("effect") {
        Some(Item::ArrayOfTables(tables)) => {
            tables.get_mut(k).map(|table| table as &mut dyn TableLike)
        }
        Some(Item::Value(Value::Array(values))) => values
            .get_mut(k)
            .and_then(Value::as_inline_table_mut)
            .map(|table| table as &mut dyn TableLike),
        _ => None,
    };
    if let Some(declared) = declared {
        declared.insert(effect.name(), Item::Value(toml_arguments(effect)));
    }
}

/// Returns the arguments of an effect as a TOML value; `true` if it has none.
fn toml_arguments(effect: &Effect) -> Value {
    let arguments = effect.arguments();
    if arguments.is_empty() {
        return Value::from(true);
    }
    // Every argument writes itself as a value of TOML.
    let value = |(key, argument): (&str, Argument)| {
        Some((key.to_owned(), argument.toml().parse::<Value>().ok()?))
    };
    Value::InlineTable(arguments.into_iter().filter_map(value).collect())
}

/// Adds rules to the end of `[parameters]`: pairs of pattern and 1 σ \[rad\], or `None` for
/// parameters that are free without a prior. `comment` precedes the first.
///
/// # Errors
/// Returns an error if the text is not TOML.
pub(crate) fn with_rules(
    text: &str,
    rules: &[(String, Option<f64>)],
    comment: &str,
) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    if rules.is_empty() {
        return Ok(text.to_owned());
    }
    let parameters = document.entry("parameters").or_insert_with(|| Item::Table(Table::new()));
    if let Some(parameters) = parameters.as_table_like_mut() {
        for (pattern, sigma) in rules {
            let freedom = match sigma {
                Some(sigma) => ("sigma_rad", Value::from(*sigma)),
                None => ("free", Value::from(true)),
            };
            let freedom = InlineTable::from_iter([freedom]);
            parameters.insert(pattern, Item::Value(Value::InlineTable(freedom)));
        }
    }
    // An inline table cannot hold a comment.
    if let Some((first, _)) = rules.first()
        && let Some(mut key) = document
            .get_mut("parameters")
            .and_then(Item::as_table_mut)
            .and_then(|all| all.key_mut(first))
    {
        key.leaf_decor_mut().set_prefix(format!("# {comment}\n"));
    }
    Ok(document.to_string())
}

/// Returns the `text` of a closed problem with a `[remainder]` that names `file`, in the same
/// folder. Without a file, an existing declaration is removed.
///
/// # Errors
/// Returns an error if the text is not TOML.
pub fn with_remainder(text: &str, file: Option<&str>) -> Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    document.remove("remainder");
    if let Some(file) = file {
        let mut table = Table::new();
        table.insert("file", Item::Value(Value::from(file)));
        table.decor_mut().set_prefix(
            "\n# Found by flexcal loop: what no law explains, applied to predictions and commands;\n\
             # use = false switches it off.\n",
        );
        document.insert("remainder", Item::Table(table));
    }
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Problem;

    const FILES: [&str; 1] = ["../data.csv"];

    fn edit(text: &str, declared: &[Effect], closed: &[Effect]) -> String {
        let closed: Vec<_> =
            closed.iter().map(|effect| (effect.clone(), vec!["found".to_owned()])).collect();
        with_effects(text, declared, &closed, [&FILES.map(PathBuf::from), &[]]).unwrap()
    }

    fn gear() -> Effect {
        Effect::GearRatio { joint: 3 }
    }

    #[test]
    fn what_was_written_stays() {
        let text = "name = \"x\" # a name\n\n[data]\nfiles = [\"data.csv\"] # measured in May\nsigma = 1\n\n# the end\n";
        let expected = "name = \"x\" # a name\n\n[data]\nfiles = [\"../data.csv\"] # measured in May\nsigma = 1\n\n# the end\n\n\
                        # found\n[[effect]]\ngear-ratio = { joint = 3 }\n\n# found\n[[effect]]\nhoist-force = true\n";
        assert_eq!(edit(text, &[], &[gear(), Effect::HoistForce]), expected);
        assert_eq!(edit(text, &[], &[]), text.replace("data.csv", "../data.csv"));
    }

    #[test]
    fn a_law_is_written_as_it_is_read() {
        let text = "name = 'arm'\njoint = [{}, {}, {}]\n";
        let problem = Problem::parse(text, "problem.toml".as_ref()).unwrap();
        let law = "law = { name = \"creep\", at = \"joint3\", terms = [\"t*exp(-k*t)\"], \
                   sigma_deg = 0.05, k = { start = 0.5, min = 0.0 } }";
        let creep = problem.effect(law, "law".as_ref()).unwrap().effect;
        assert_eq!(creep.declaration(), law);
        let edited = edit("[data]\nfiles = []\n", &[], std::slice::from_ref(&creep));
        let read = Problem::parse(&format!("{text}{edited}"), "problem.toml".as_ref());
        assert_eq!(read.unwrap().effects[0].effect, creep, "{edited}");
    }

    #[test]
    fn effects_follow_those_declared() {
        let harmonic = |orders: &[u32]| Effect::JointHarmonic { joint: 1, orders: orders.to_vec() };
        let declared = [harmonic(&[1]), Effect::PayloadMass];
        let closed = [harmonic(&[1, 2]), Effect::PayloadMass, gear()];
        let text = "[[effect]]\njoint-harmonic = { joint = 1, orders = [1] }\n\n[[effect]]\npayload-mass = true\n\n[data]\nfiles = []\n";
        let expected = "[[effect]]\njoint-harmonic = { joint = 1, orders = [1, 2] }\n\n[[effect]]\npayload-mass = true\n\n[data]\n\
                        files = [\"../data.csv\"]\n\n# found\n[[effect]]\ngear-ratio = { joint = 3 }\n";
        assert_eq!(edit(text, &declared, &closed), expected);
        let text = "effect = [{ joint-harmonic = { joint = 1, orders = [1] } }, { payload-mass = true }]\ndata.files = []\n";
        let edited = edit(text, &declared, &closed);
        let read: toml::Table = edited.parse().unwrap();
        assert_eq!(read["effect"].as_array().unwrap().len(), 3, "{edited}");
        assert_eq!(read["effect"][0]["joint-harmonic"]["orders"].as_array().unwrap().len(), 2);
        assert_eq!(read["effect"][2]["gear-ratio"]["joint"].as_integer(), Some(3));
        assert_eq!(read["data"]["files"][0].as_str(), Some("../data.csv"));
    }

    #[test]
    fn rules_join_the_others() {
        for text in [
            "[parameters]\n\"base.*\" = { free = true }\n\n[data]\nfiles = []\n",
            "parameters = {}\n",
            "name = \"x\"\n",
        ] {
            let rule = |name: &str, sigma: f64| (format!("joint-harmonic.{name}"), Some(sigma));
            let free = ("joint-coupling[3,2].factor".to_owned(), None);
            let rules = [rule("sin1", 2.5e-5), rule("cos17", 4.1e-5), free];
            let ruled = with_rules(text, &rules, "found").unwrap();
            let read: toml::Table = ruled.parse().unwrap();
            let sigma = |name: &str| read["parameters"][name]["sigma_rad"].as_float();
            assert_eq!(sigma("joint-harmonic.sin1"), Some(2.5e-5), "{ruled}");
            assert_eq!(sigma("joint-harmonic.cos17"), Some(4.1e-5), "{ruled}");
            let free = read["parameters"]["joint-coupling[3,2].factor"]["free"].as_bool();
            assert_eq!(free, Some(true), "{ruled}");
        }
    }

    #[test]
    fn other_ends_of_lines_do_no_harm() {
        let text = "name = \"x\"\r\n[data]\r\nfiles = [\"data.csv\"]\r\n";
        let read: toml::Table = edit(text, &[], &[gear()]).parse().unwrap();
        assert_eq!(read["effect"][0]["gear-ratio"]["joint"].as_integer(), Some(3));
        assert!(with_effects("name = ", &[], &[], [&[], &[]]).is_err());
    }
}
